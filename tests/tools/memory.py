"""What the memory of a process is: all of it, what is asked of the C library or lies free in its hands, what
arrays hold, and which modules are loaded.
"""

import ctypes
import os
import sys
from contextlib import suppress
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import numpy as np


def resident_mb(process: int) -> float:
    """Memory of a process, MB."""
    for line in Path(f"/proc/{process}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise ValueError("status: expected a line VmRSS")


def memory_parts(process: int) -> dict[str, float]:
    """What memory is, MB, of this process: asked of the C library by whoever holds it, free in its hands,
    mapped from files; and how many threads and open files there are."""
    found = _Mallinfo2()
    with suppress(AttributeError):  # before glibc 2.33, and elsewhere
        ask_library = ctypes.CDLL(None).mallinfo2
        ask_library.restype = _Mallinfo2
        found = ask_library()
    lines = dict(line.split(":", 1) for line in Path(f"/proc/{process}/status").read_text().splitlines())
    mapped = sum(int(lines[name].split()[0]) for name in ("RssFile", "RssShmem")) / 1024
    return {
        "asked": (found.uordblks + found.hblkhd) / 2**20,
        "free": found.fordblks / 2**20,
        "files": mapped,
        "threads": int(lines["Threads"]),
        "handles": len(os.listdir(f"/proc/{process}/fd")),
    }


class _Mallinfo2(ctypes.Structure):
    """Of mallinfo(3)."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd")),
        *((name, ctypes.c_size_t) for name in ("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")),
    )


def packages() -> set[str]:
    """Names of loaded modules, to the second dot."""
    return {".".join(name.split(".")[:2]) for name in list(sys.modules)}


def held_mb(value: Any) -> float:
    """What the arrays and tensors take that a value holds, each once, MB."""
    import torch  # the window's worker loads it, not its first frame

    sizes: dict[int, int] = {}

    def walk(each: Any) -> None:
        if isinstance(each, torch.Tensor):
            storage = each.untyped_storage()
            sizes[storage.data_ptr()] = storage.nbytes()
        elif isinstance(each, np.ndarray):
            sizes[each.ctypes.data] = each.nbytes
        elif is_dataclass(each):
            walk(list(vars(each).values()))
        elif isinstance(each, list | tuple):
            for part in each:
                walk(part)

    walk(value)
    return sum(sizes.values()) / 1e6
