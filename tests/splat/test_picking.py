"""What a person points at: regions by the reference's own shares, pixels as the weight maps hold them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.splat import compose, picking, render
from langflash_core.splat.frustum import may_touch
from langflash_core.splat.picking import SEEN, seen_in, sights, weights_at
from langflash_core.splat.reference import rasterize
from tests.splat.scenes import camera, cloud, parallel
from tests.splat.test_compose import camera_at, layered


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
    found = seen_in(scene, visible, seen, box())
    assert (found == expected).all() and 5 < found.sum() < len(rows)
    through = seen_in(scene, visible, seen, box(), through=True)
    assert through[found].all() and through.sum() > found.sum() and not through[~visible].any()


def test_a_pixel_is_weighed_as_the_weight_maps_hold_it() -> None:
    scene, seen = cloud(150, size=0.08), camera()
    maps = render(scene, seen).weight_maps
    assert maps is not None
    shown = sights(scene, np.ones(150, bool), seen)
    for x, y in ((0, 0), (24, 20), (47, 39), (10, 31)):
        weights = weights_at(scene.semantics, shown, x, y)
        torch.testing.assert_close(weights.double(), maps[y, x].double(), rtol=0, atol=1e-6)  # float32 out


def test_nothing_shown_is_nothing_seen_and_weighs_nothing() -> None:
    scene, seen = cloud(20), camera()
    assert not seen_in(scene, np.zeros(20, bool), seen, box()).any()
    assert not weights_at(scene.semantics, sights(scene, np.zeros(20, bool), seen), 24, 20).any()


@pytest.mark.parametrize("flat", [False, True])
def test_what_cannot_touch_a_region_is_left_out_and_nothing_else(flat: bool, monkeypatch) -> None:
    scene, seen = cloud(400, size=0.06), camera()
    means = scene.gaussians.means.clone()
    means[::50] = torch.nan
    means[::7] -= torch.tensor([0.0, 0.0, 1.4])  # some close to the eye, some behind it
    scene = replace(scene, gaussians=replace(scene.gaussians, means=means))
    seen, visible, asked = parallel(seen) if flat else seen, np.ones(400, bool), 0
    for line, column, side in ((0, 0, 3), (20, 24, 1), (36, 44, 4), (10, 5, 12)):
        pixels = np.zeros((40, 48), bool)
        pixels[line : line + side, column : column + side] = True
        near = may_touch(scene.gaussians, seen, picking._box(pixels))
        asked += int(near.sum())
        for through in (False, True):
            found = seen_in(scene, visible, seen, pixels, through=through)
            with monkeypatch.context() as slowly:
                slowly.setattr(picking, "may_touch", lambda *_: visible)
                assert (found == seen_in(scene, visible, seen, pixels, through=through)).all()
    assert asked < 4 * 300, "few others"
    assert not seen_in(scene, visible, seen, np.zeros((40, 48), bool)).any()


def test_a_pixel_of_layers_is_weighed_as_their_blend() -> None:
    scene = layered([(2, 0.2, 0), (2.1, 0.8, 1), (5, 0.5, 2)], [0.0, 0.6, 1.0])
    view = camera_at(scene, 0.3)
    maps = compose.render(scene, view).weight_maps
    assert maps is not None
    shown = sights(scene, np.ones(len(scene.gaussians), bool), view)
    for x, y in ((0, 0), (4, 3), (7, 7)):
        weights = weights_at(scene.semantics, shown, x, y)
        torch.testing.assert_close(weights, maps[y, x], rtol=0, atol=1e-5)  # float32 maps


def test_what_is_pointed_at_is_found_in_all_layers_and_nothing_behind_it() -> None:
    # A wall in three layers, and a fourth, of a photo near the third, that shows what lies far behind it.
    scene = layered([(2, 0.2, 0), (2.1, 0.8, 1), (1.95, 0.5, 2), (5, 0.5, 3)], [0.0, 0.3, 0.6, 0.7])
    assert scene.view_ids is not None
    ids, visible = scene.view_ids.numpy(), np.ones(len(scene.gaussians), bool)
    pixels = np.zeros((8, 8), bool)
    pixels[3:6, 2:5] = True
    found = seen_in(scene, visible, camera_at(scene, 0.0), pixels)
    assert [int(found[ids == view].sum()) > 3 for view in range(4)] == [True, True, True, False]
    alone = [
        seen_in(scene.layer(view), visible[ids == view], camera_at(scene, 0.0), pixels) for view in range(3)
    ]
    for view in range(3):  # as in a scene of that layer alone
        assert (found[ids == view] == alone[view]).mean() > 0.98  # float32 about the least share
    through = seen_in(scene, visible, camera_at(scene, 0.0), pixels, through=True)
    assert through[ids == 3].any() and not found[~through].any()
