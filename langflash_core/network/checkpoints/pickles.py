"""Pickles of tensors, read without running anything that they name.

torch's own reader of plain tensors refuses a file that names anything else. Training frameworks put more
beside the weights, their callbacks' classes as keys of a table for one: whatever is not known as plain
becomes a `Stub` here, which takes everything and does nothing.
"""

import warnings
from pathlib import Path
from typing import Any

import torch
from torch.serialization import get_unsafe_globals_in_checkpoint, safe_globals


class Stub:
    """Stands where a pickle names a class or a function; `named` is what it named."""

    named = ""

    def __new__(cls, *args: object, **words: object) -> "Stub":
        return super().__new__(cls)

    def __init__(self, *args: object, **words: object) -> None:
        """Takes what the class or function would have been called with."""

    def __setstate__(self, state: object) -> None:
        """Keeps nothing."""


def read_pickle(path: Path) -> Any:
    """What torch saved, tensors mapped from the disk where the format allows it.

    Raises:
        pickle.UnpicklingError: it wants more than names: to fill an object that is no plain table, say,
            or a module that torch blocks.
        RuntimeError, ValueError, OSError ...: it is no such file, or damaged.
    """
    with path.open("rb") as stream:
        mapped = stream.read(2) == b"PK"  # the zip format can be mapped, the older one cannot
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about pickle protocols: what cannot be read is refused anyway
        unknown = get_unsafe_globals_in_checkpoint(path) if mapped else []
        with safe_globals([(_stub(name), name) for name in sorted(unknown)]):
            return torch.load(path, map_location="cpu", weights_only=True, mmap=mapped)


def stub_name(value: object) -> str:
    """What a stub, or an object of one, stands for; "" for anything else."""
    kind = value if isinstance(value, type) else type(value)
    return kind.named if issubclass(kind, Stub) else ""


def _stub(name: str) -> type[Stub]:
    return type("Stub", (Stub,), {"named": name})
