"""Shaders compiled before somebody waits for them: a driver does so at the first drawing, and software
renderers take a quarter of a second for some."""

from collections.abc import Iterator

import torch

from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.language.relevance import CompiledQuery
from langflash_core.types import Camera, Gaussians, Scene, Semantics

from .renderer import SplatRenderer

_SIDE = 16  # pixels


def warm_up(renderer: SplatRenderer) -> Iterator[None]:
    """Draw one Gaussian in the ways that come first, a way a step; the renderer's scene is lost."""
    camera = Camera(torch.eye(4), torch.tensor([[16.0, 0, 8], [0, 16, 8], [0, 0, 1]]), _SIDE, _SIDE)
    renderer.set_scene(_one())
    yield
    renderer.draw(camera, weight_maps=False)
    yield
    _ = renderer.rgb_texture
    yield
    one = torch.ones(1, 1)
    renderer.ask(CompiledQuery(one, one, one, 1.0, 0.5, "relevancy", ("",)))
    renderer.draw(camera, weight_maps=False, fast=True)
    yield
    renderer.relevance()
    yield
    renderer.heat_texture()
    renderer.ask(None)


def _one() -> Scene:
    place = torch.tensor([[0.0, 0.0, 1.0]])
    quat = torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    colour = colour_to_sh(torch.full((1, 3), 0.5))[:, None]
    gaussians = Gaussians(place, quat, torch.full((1, 3), 0.1), torch.ones(1), colour)
    semantics = Semantics(torch.zeros(1, 1, dtype=torch.int64), torch.ones(1, 1), torch.ones(1, 1), "none")
    return Scene(gaussians, semantics, torch.eye(4)[None], torch.eye(3)[None], (_SIDE, _SIDE))
