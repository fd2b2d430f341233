"""What a person points at: regions by the reference's own shares, pixels as the weight maps hold them."""

import numpy as np
import pytest
import torch

from langflash_core.splat import render
from langflash_core.splat.picking import SEEN, projected, seen_in, weights_at
from langflash_core.splat.reference import rasterize
from tests.splat.scenes import camera, cloud


def box() -> np.ndarray:
    pixels = np.zeros((40, 48), bool)
    pixels[12:26, 15:30] = True
    return pixels


@pytest.mark.parametrize("hidden", [False, True])
def test_seen_is_what_adds_enough_to_some_pixel(hidden: bool) -> None:
    scene, seen = cloud(200, size=0.06), camera()
    visible = np.arange(200) % 3 > 0 if hidden else np.ones(200, bool)
    rows = np.flatnonzero(visible)
    shown = scene.gaussians.map(lambda values: values[torch.from_numpy(rows)])
    maps, _ = rasterize(shown, torch.eye(len(rows), dtype=torch.float64), seen)  # (H, W, n)
    most = maps[torch.from_numpy(box())].amax(0).numpy()
    expected = np.zeros(200, bool)
    expected[rows[most >= SEEN]] = True
    found = seen_in(scene.gaussians, visible, seen, box())
    assert (found == expected).all() and 5 < found.sum() < len(rows)
    through = seen_in(scene.gaussians, visible, seen, box(), through=True)
    assert through[found].all() and through.sum() > found.sum() and not through[~visible].any()


def test_a_pixel_is_weighed_as_the_weight_maps_hold_it() -> None:
    scene, seen = cloud(150, size=0.08), camera()
    maps = render(scene, seen).weight_maps
    assert maps is not None
    rows, footprints = projected(scene.gaussians, np.ones(150, bool), seen)
    for x, y in ((0, 0), (24, 20), (47, 39), (10, 31)):
        weights = weights_at(scene.semantics, rows, footprints, x, y)
        torch.testing.assert_close(weights.double(), maps[y, x].double(), rtol=0, atol=1e-6)  # float32 out


def test_nothing_shown_is_nothing_seen_and_weighs_nothing() -> None:
    scene, seen = cloud(20), camera()
    assert not seen_in(scene.gaussians, np.zeros(20, bool), seen, box()).any()
    rows, footprints = projected(scene.gaussians, np.zeros(20, bool), seen)
    assert not weights_at(scene.semantics, rows, footprints, 24, 20).any()
