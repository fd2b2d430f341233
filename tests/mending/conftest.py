"""A screen before a wall, photographed twice, as a scene whose truth is known; and who draws it."""

from dataclasses import dataclass

import pytest
from torch import Tensor

from langflash_core.base.detail import DETAILS
from langflash_core.mending.looks import draw_scene
from langflash_core.surface.fine import coloured_scene, covered_scene
from langflash_core.types import Scene
from tests.scene.photographed import SCREEN, WALL, photographed
from tests.torch_threads import torch_threads


@pytest.fixture(autouse=True)
def one_thread():
    with torch_threads(1):
        yield


@dataclass(frozen=True)
class Known:
    """scene: of the photos. members (N,): the screen's. without: the photos (3, h, w) as they would be
    without it."""

    scene: Scene
    members: Tensor
    photos: list[Tensor]
    without: list[Tensor]


@pytest.fixture(scope="session")
def known() -> Known:
    made = photographed(2)
    covered = covered_scene(made.prediction, made.views, DETAILS["normal"], gaussians=None, preset="mini")
    scene = coloured_scene(covered)
    unit = float(scene.gaussians.means[:, 2].quantile(0.9)) / WALL
    members = scene.gaussians.means[:, 2] < (WALL + SCREEN) / 2 * unit
    return Known(scene, members, made.photos, photographed(2, screen=False).photos)


@pytest.fixture
def draw():
    return draw_scene
