"""A room whose truth is known: three blobs of Gaussians, side by side, each with its own word."""

import torch

from langflash_core.language.spaces import language_space
from langflash_core.types import Scene, Semantics
from tests.splat.scenes import unturned

PLACES = {"sofa": -1.0, "lamp": 0.0, "bookcase": 1.0}


def three_blobs() -> Scene:
    """Blobs that answer to their words, seen by two photos."""
    generator = torch.Generator().manual_seed(0)
    centres = torch.tensor([[x, 0.2 * x, 3.0] for x in PLACES.values()])
    means = (centres[:, None] + 0.2 * torch.randn(3, 80, 3, generator=generator)).flatten(0, 1)
    count = len(means)
    ids = torch.arange(3).repeat_interleave(80)[:, None]
    semantics = Semantics(ids, torch.ones(count, 1), language_space().encode(list(PLACES)), "minilm")
    K = torch.tensor([[60.0, 0, 48], [0, 60.0, 32], [0, 0, 1]])
    second = torch.eye(4)
    second[0, 3] = 0.5
    viewmats = torch.stack((torch.eye(4), second))
    return Scene(unturned(means, 0.06), semantics, viewmats, K.expand(2, 3, 3), (96, 64))
