"""A room whose truth is known: three blobs of Gaussians, side by side, each with its own word."""

import torch

from langflash_core.language.spaces import language_space
from langflash_core.types import Gaussians, Scene, Semantics

PLACES = {"sofa": -1.0, "lamp": 0.0, "bookcase": 1.0}


def three_blobs() -> Scene:
    """Blobs that answer to their words, seen by two photos."""
    generator = torch.Generator().manual_seed(0)
    centres = torch.tensor([[x, 0.2 * x, 3.0] for x in PLACES.values()])
    means = (centres[:, None] + 0.2 * torch.randn(3, 80, 3, generator=generator)).flatten(0, 1)
    count = len(means)
    quats, scales = torch.tensor([1.0, 0, 0, 0]).expand(count, 4), torch.full((count, 3), 0.06)
    gaussians = Gaussians(means, quats, scales, torch.full((count,), 0.9), torch.zeros(count, 1, 3))
    ids = torch.arange(3).repeat_interleave(80)[:, None]
    semantics = Semantics(ids, torch.ones(count, 1), language_space().encode(list(PLACES)), "minilm")
    K = torch.tensor([[60.0, 0, 48], [0, 60.0, 32], [0, 0, 1]])
    second = torch.eye(4)
    second[0, 3] = 0.5
    return Scene(gaussians, semantics, torch.stack((torch.eye(4), second)), K.expand(2, 3, 3), (96, 64))
