"""What the network and the geometry around it run on: which devices there are, and which one is meant."""

import os
import sys

from langflash_core.errors import InputError

DEVICES = ("auto", "cpu", "cuda", "mps")


def let_processor_help() -> None:
    """Let the processor do what a Mac's card lacks, which torch says once; called before torch is loaded,
    which reads the variable then."""
    if sys.platform == "darwin":
        os.environ.setdefault("PYTORCH_ENABLE_MPS_FALLBACK", "1")


def chosen_device(name: str) -> str:
    """ "cuda", "mps" or "cpu"; of "auto" the first of these that there is.

    Raises:
        InputError: there is no such device.
    """
    import torch

    if name not in DEVICES:
        raise InputError(f"the device '{name}' is unknown; choose {', '.join(DEVICES[:-1])} or {DEVICES[-1]}")
    there = {"cuda": torch.cuda.is_available(), "mps": torch.backends.mps.is_available(), "cpu": True}
    if name == "auto":
        return next(device for device, usable in there.items() if usable)
    if not there[name]:
        raise InputError(f"there is no {name.upper()} device that torch can use; choose --device cpu or auto")
    return name
