"""Training in several processes, as torchrun starts them: who this one is, what it agrees on with the others.

Without torchrun there is one process, and everything here answers at once.
"""

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
import torch.distributed as dist


@contextmanager
def joined(device: str) -> Iterator[str]:
    """Inside, the processes that torchrun started are one group.

    Args:
        device: cpu (they talk through gloo) or cuda (nccl, one card a process).

    Yields:
        The device of this process.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) < 2:
        yield device
        return
    own = f"cuda:{os.environ['LOCAL_RANK']}" if device == "cuda" else device
    if device == "cuda":
        torch.cuda.set_device(own)
    # Convolutions keep their channels last, which its buckets do not; it warns once a process.
    warnings.filterwarnings("ignore", message="Grad strides do not match bucket view strides")
    dist.init_process_group("nccl" if device == "cuda" else "gloo")
    try:
        yield own
    finally:
        dist.destroy_process_group()


def rank() -> int:
    """Number of this process, from 0."""
    return dist.get_rank() if dist.is_initialized() else 0


def world() -> int:
    """How many processes there are."""
    return dist.get_world_size() if dist.is_initialized() else 1


def leads() -> bool:
    """Whether this is the process that writes and judges for all."""
    return rank() == 0


def agreed(number: float, device: str) -> float:
    """What process 0 says the number is."""
    if world() == 1:
        return number
    told = torch.tensor(number, dtype=torch.float64, device=device)
    dist.broadcast(told, 0)
    return float(told)


def everywhere(true: bool, device: str) -> bool:
    """Whether it is true in all processes."""
    if world() == 1:
        return true
    told = torch.tensor(int(true), device=device)
    dist.all_reduce(told, dist.ReduceOp.MIN)
    return bool(told)


def gathered(value: Any) -> list[Any]:
    """What every process gives, in order."""
    if world() == 1:
        return [value]
    values: list[Any] = [None] * world()
    dist.all_gather_object(values, value)
    return values
