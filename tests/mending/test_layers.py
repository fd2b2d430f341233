"""What is taken out of a scene of layers is gone from all of them, and what comes in its place is in all."""

import pytest
import torch

from langflash_core.base.detail import DETAILS
from langflash_core.mending.hiding import Hiding, hide
from langflash_core.surface.fine import coloured_scene, covered_scene
from langflash_core.types import Scene
from tests.scene.photographed import SCREEN, WALL, photographed


@pytest.fixture(scope="module")
def screened() -> tuple[Scene, torch.Tensor]:
    """A screen before a wall, a layer a photo; and which Gaussians are the screen's."""
    made = photographed(2)
    scene = coloured_scene(
        covered_scene(made.prediction, made.views, DETAILS["normal"], gaussians=None, preset="mini")
    )
    assert scene.layered
    unit = float(scene.gaussians.means[:, 2].quantile(0.9)) / WALL
    return scene, scene.gaussians.means[:, 2] < (WALL + SCREEN) / 2 * unit


@pytest.mark.parametrize("how", ["remove", "pixels"])
def test_what_was_hidden_is_hidden_in_every_layer(screened, draw, how):
    scene, members = screened
    done, report = hide(scene, members, draw, Hiding(how))
    assert done.layered and done.view_ids is not None and report.made > 0
    assert int((done.view_ids < 0).sum()) == report.made  # in every layer
    for view in range(2):
        camera = scene.camera(view)
        before = draw(scene.layer(view), camera)
        after = draw(done.layer(view), camera)
        was = before.depths < 0.8 * before.depths.max()  # the screen's pixels
        assert 0.03 < float(was.float().mean()) < 0.5
        # what takes its place closes each layer by itself, but for a rim
        assert float((after.alphas[was] > 0.5).float().mean()) > 0.9
        if how == "remove":
            assert float((after.depths[was] > 0.8 * before.depths.max()).float().mean()) > 0.9
