"""What was behind a screen, against the wall that is there."""

import numpy as np
import torch

from langflash_core.mending.filling import fill
from langflash_core.mending.hiding import preview
from langflash_core.mending.planes import planes
from langflash_core.mending.texture import diffuse, heal
from langflash_core.scene.gaps import fill_gaps
from langflash_core.scene.joining import append_part


def psnr(shown, truth, where) -> float:
    return float(-10 * np.log10(((shown - truth)[where] ** 2).mean()))


def test_a_wall_goes_on_behind_what_was_removed(known, draw):
    scene = known.scene
    rows = preview(scene, known.members, draw)
    left = scene.rows(~rows)
    patch = fill(scene, rows, draw)
    unit = float(left.gaussians.means[:, 2].median())
    assert float((patch.gaussians.means[:, 2] / unit - 1).abs().quantile(0.95)) < 0.02
    done = append_part(left, patch)
    for view in range(scene.num_views):
        truth = known.without[view].movedim(0, -1).numpy()
        camera = scene.camera(view, truth.shape[1], truth.shape[0])
        before, after = (draw(each, camera, weight_maps=False) for each in (left, done))
        hole = (before.alphas < 0.5).numpy()
        assert hole.sum() > 200 and float((after.alphas[torch.from_numpy(hole)] > 0.9).float().mean()) > 0.97
        gaps = fill_gaps(before.rgb, before.alphas).numpy()
        assert psnr(after.rgb.numpy(), truth, hole) > max(16, psnr(gaps, truth, hole) - 1)
        assert psnr(after.rgb.numpy(), truth, hole) > psnr(before.rgb.numpy(), truth, hole) + 8


def test_what_is_filled_says_that_nobody_saw_it_and_means_what_is_around(known, draw):
    patch = fill(known.scene, preview(known.scene, known.members, draw), draw)
    assert len(patch.gaussians) > 50
    assert patch.confidences is not None and not bool(patch.confidences.any())
    totals = patch.semantics.weight_values.sum(1)
    assert torch.allclose(totals, torch.ones_like(totals), atol=1e-4)


def test_where_nothing_is_missing_nothing_is_filled(known, draw):
    assert not len(fill(known.scene, torch.zeros_like(known.members), draw).gaussians)


def test_planes_are_found_among_points_of_none():
    draws = np.random.default_rng(0)
    floor = np.c_[draws.uniform(-1, 1, (600, 2)), np.zeros(600)]
    wall = np.c_[np.ones(400), draws.uniform(-1, 1, (400, 2))]
    points = np.concatenate((floor, wall, draws.uniform(-1, 1, (300, 3))))
    points += draws.normal(0, 0.003, points.shape)
    found = planes(points, np.full(len(points), 0.01), share=0.1, most=5)
    assert len(found) == 2
    assert abs(found[0].normal[2]) > 0.999 and abs(found[1].normal[0]) > 0.999
    again = planes(points, np.full(len(points), 0.01), share=0.1, most=5)
    assert [plane.offset for plane in again] == [plane.offset for plane in found]
    assert np.abs(found[0].apart(floor)).max() < 0.01


def test_texture_goes_on_in_a_hole():
    y, x = np.mgrid[:60, :80]
    truth = np.stack((0.5 + 0.3 * np.sin(x * 0.8), 0.5 + 0.2 * np.cos(y * 0.6), 0.4 + 0.002 * x), -1)
    hole = np.zeros((60, 80), bool)
    hole[24:36, 30:50] = True
    damaged = np.where(hole[..., None], 0, truth)
    better, smooth = heal(damaged, ~hole, hole), diffuse(damaged, ~hole)
    assert np.array_equal(better[~hole], truth[~hole])
    assert psnr(better, truth, hole) > psnr(smooth, truth, hole) + 6


def test_spread_reaches_everything_and_keeps_what_is_even():
    known = np.zeros((30, 200), bool)
    known[3, 4] = True
    assert np.allclose(diffuse(np.full((30, 200, 3), 0.3), known), 0.3, atol=1e-4)
    assert not diffuse(np.ones((5, 5, 3)), np.zeros((5, 5), bool)).any()


def test_nothing_is_copied_that_is_not_to_be():
    """A dark thing beside the hole, which reaches into its edge's colours, is not painted into it."""
    y, x = np.mgrid[:60, :80]
    wall = np.full((60, 80, 3), 0.7) + 0.02 * np.sin(x * 0.8)[..., None]
    hole = (abs(y - 30) < 10) & (abs(x - 40) < 10)
    thing = (abs(y - 30) < 25) & (abs(x - 60) < 9)
    shown = np.where(thing[..., None], 0.1, wall)
    filled = heal(np.where(hole[..., None], 0, shown), ~hole & ~thing, hole, ~thing)
    assert filled[hole].min() > 0.6


def test_one_edge_of_light_goes_on_across_a_hole():
    """A line between floor and wall meets itself, where colours that run in alone blur it."""
    shown = np.where((np.mgrid[:96, :96][0] > 48)[..., None], 0.3, 0.8) * np.ones(3)
    hole = np.hypot(*(np.mgrid[:96, :96] - 48)) < 20
    damaged = np.where(hole[..., None], 0, shown)
    better, smooth = heal(damaged, ~hole, hole), diffuse(damaged, ~hole)
    assert psnr(better, shown, hole) > psnr(smooth, shown, hole) + 3
