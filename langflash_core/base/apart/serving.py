"""The other side: a process that reads files and answers through a pipe, under limits it cannot lift.

A message is its header's length (8 bytes, little-endian), the header as JSON, and then the bytes of the
arrays it names. From this side: {"kind": "part", "end" or "refused", "facts", "arrays": [[name, dtype,
shape], ...]}; from the other: {"reader", "request", "size"} and that many bytes of a file.

Where the system has them, limits are the kernel's (`resource`): of memory, of processor time between two
answers, and no file may be written. Elsewhere a thread watches the memory. Only the standard library is
imported before the reader is.
"""

import importlib
import json
import os
import signal
import struct
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

HEADER = struct.Struct("<Q")
OUT_OF_MEMORY = 76  # the code of a process that ended for want of memory
READERS = {"photo": "photos", "film": "films", "film pictures": "films", "stage": "stages"}
"""Which module of this folder answers: its `answers` takes the reader's name, the request and the bytes."""

_IDLE = 20.0  # seconds that a process waits for the next request
_LOOK = 0.5  # seconds between two looks of the watch


def serve(module: str, memory: int, seconds: int) -> None:
    """Answer requests until there are none any more. memory: bytes. seconds: between two answers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the other side, which ends this one
    requests, answers = os.dup(0), os.dup(1)
    nothing = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1):  # what libraries print goes nowhere
        os.dup2(nothing, standard)
    if sys.platform == "win32":
        import msvcrt

        for pipe in (requests, answers):
            msvcrt.setmode(pipe, os.O_BINARY)
    try:
        reader = importlib.import_module(f"langflash_core.base.apart.{module}")
        watch = _Watch(memory)
        _limit(memory)
        while True:
            watch.idle_since = time.monotonic()
            head = json.loads(_read_exactly(requests, HEADER.unpack(_read_exactly(requests, HEADER.size))[0]))
            content = _read_exactly(requests, head["size"])
            watch.idle_since = None
            _answer(reader, head, content, answers, seconds)
    except (EOFError, BrokenPipeError):
        os._exit(0)
    except MemoryError:
        os._exit(OUT_OF_MEMORY)


def _answer(reader: Any, head: dict, content: bytes, out: int, seconds: int) -> None:
    """Raises:
    MemoryError: there is not enough of it.
    """
    _grant(seconds)
    try:
        for facts, arrays in reader.answers(head["reader"], head["request"], content):
            _write(out, "part", facts, arrays)
            _grant(seconds)
    except (MemoryError, BrokenPipeError):
        raise
    except Exception as error:
        if "llocat" in str(error) or "bad_alloc" in str(error):  # as libraries say it
            raise MemoryError from None
        _write(out, "refused", {"said": f"{error}" or type(error).__name__}, {})
        return
    _write(out, "end", {}, {})


def _write(out: int, kind: str, facts: Mapping[str, Any], arrays: Mapping[str, Any]) -> None:
    views, described = [], []
    for name, values in arrays.items():
        if isinstance(values, bytes):
            described.append([name, "|u1", [len(values)]])
        else:
            described.append([name, values.dtype.str, list(values.shape)])
        if described[-1][2] and 0 not in described[-1][2]:
            views.append(memoryview(values).cast("B"))
    head = json.dumps({"kind": kind, "facts": facts, "arrays": described}).encode()
    for view in (memoryview(HEADER.pack(len(head)) + head), *views):
        while view:
            view = view[os.write(out, view) :]


def _read_exactly(pipe: int, size: int) -> bytes:
    """Raises:
    EOFError: the other side is gone.
    """
    parts = []
    while size:
        part = os.read(pipe, min(size, 1 << 20))
        if not part:
            raise EOFError
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


def _limits() -> Iterator[tuple[str, int]]:
    """Names of `resource` and bounds: no file of any size, no picture of the memory, few open files."""
    yield "RLIMIT_FSIZE", 0
    yield "RLIMIT_CORE", 0
    yield "RLIMIT_NOFILE", 256


def _limit(memory: int) -> None:
    """From now on this process can hold no more than `memory`, and write nowhere."""
    try:
        import resource
    except ImportError:
        return
    # Of the address space Linux counts what threads only reserve; of data, what can be written to.
    kind = "RLIMIT_DATA" if sys.platform == "linux" else "RLIMIT_AS"
    for name, bound in (*_limits(), (kind, memory)):
        with suppress(AttributeError, ValueError, OSError):
            number = getattr(resource, name)
            hard = resource.getrlimit(number)[1]
            bound = bound if hard == resource.RLIM_INFINITY else min(bound, hard)
            resource.setrlimit(number, (bound, bound))


def _grant(seconds: int) -> None:
    """As much more processor time, on all processors together: for when nobody is left to end this one."""
    try:
        import resource
    except ImportError:
        return
    more = int(time.process_time()) + seconds * (os.cpu_count() or 1) + 1
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (more, resource.getrlimit(resource.RLIMIT_CPU)[1]))


class _Watch:
    """A thread that ends this process: where it waited too long, is left alone, or holds too much."""

    def __init__(self, memory: int) -> None:
        self.idle_since: float | None = None
        self._memory, self._parent = memory, os.getppid()
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self) -> None:
        while True:
            time.sleep(_LOOK)
            since = self.idle_since
            if (since is not None and time.monotonic() - since > _IDLE) or os.getppid() != self._parent:
                os._exit(0)
            if _peak_memory() > self._memory:
                os._exit(OUT_OF_MEMORY)


def _peak_memory() -> int:
    """Bytes that this process held at most; 0 where the kernel bounds them, or nothing tells."""
    if sys.platform == "linux":
        return 0
    if sys.platform == "win32":
        return _held_on_windows()
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def _held_on_windows() -> int:
    import ctypes

    sizes = [("size", ctypes.c_uint32), ("faults", ctypes.c_uint32)]
    names = ("most", "now", "pool", "pool_now", "other", "other_now", "paged", "paged_most")
    kind = type("Counters", (ctypes.Structure,), {"_fields_": sizes + [(n, ctypes.c_size_t) for n in names]})
    counters = kind()
    counters.size = ctypes.sizeof(counters)
    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined]
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    handle = ctypes.c_void_p(kernel.GetCurrentProcess())
    known = kernel.K32GetProcessMemoryInfo(handle, ctypes.byref(counters), counters.size)
    return counters.paged if known else 0
