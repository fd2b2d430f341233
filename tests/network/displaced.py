"""Run as a program: the same weights read from every address, and what the network makes of them.

Usage: displaced.py FOLDER, the LANGFLASH_HOME that holds the parts of the TINY preset. Prints one
digest of the prediction per displacement.
"""

import hashlib
import os
import sys
from contextlib import contextmanager

import torch
from safetensors import safe_open

from langflash_core.network.checkpoints import store
from langflash_core.types import Prediction
from tests.network.sizes import TINY, noise_views

STEP, END = 4, 64  # bytes: a float32, and what torch itself aligns to


def at(value: torch.Tensor, displacement: int) -> torch.Tensor:
    """The same numbers, `displacement` bytes after a multiple of 64, or just before where the type asks."""
    displacement -= displacement % value.element_size()
    size = value.numel() * value.element_size()
    room = torch.empty(size + 2 * END, dtype=torch.uint8)
    start = -room.data_ptr() % END + displacement
    moved = room[start : start + size].view(value.dtype).view(value.shape)
    assert size == 0 or moved.data_ptr() % END == displacement
    return moved.copy_(value)


def displaced(displacement: int):
    """`safe_open` whose tensors lie `displacement` bytes after a multiple of 64."""

    class File:
        def __init__(self, file) -> None:
            self._file = file

        def __getattr__(self, name: str):
            return getattr(self._file, name)

        def get_tensor(self, key: str) -> torch.Tensor:
            return at(self._file.get_tensor(key), displacement)

    @contextmanager
    def opened(path: str, framework: str):
        with safe_open(path, framework=framework) as file:
            yield File(file)

    return opened


def digest(prediction: Prediction) -> str:
    """Of everything the network said."""
    total = hashlib.sha256()
    g = prediction.gaussians
    for value in (g.means, g.opacities, prediction.weights, prediction.dictionary):
        total.update(value.contiguous().numpy().tobytes())
    return total.hexdigest()


def main(home: str) -> None:
    """Print a digest per displacement."""
    os.environ["LANGFLASH_HOME"] = home
    views = noise_views()
    for displacement in range(0, END, STEP):
        store.safe_open = displaced(displacement)
        sys.stdout.write(digest(store.assemble_network(TINY, None, "cpu").predict(views)) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
