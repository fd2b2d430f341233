"""The tree that clicks choose from: of things of one word that touch one is taken, in all photos, and levels
nest."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, rays, transform
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.scene.instances import things
from langflash_core.scene.regions import _mutual, regions_of
from langflash_core.scene.settings import REGIONS
from langflash_core.types import Gaussians, Record, Scene, Semantics
from tests.splat.scenes import unturned

HEIGHT, WIDTH, FOV = 60, 80, 60.0
WALL, LEFT, RIGHT, SIGN = 0, 1, 2, 3  # what each Gaussian is of
ATOMS = torch.tensor([0, 1, 1, 2])  # left and right are of one word
DEPTHS = (3.0, 2.0, 2.08, 2.0)
"""Right begins where left ends, .04 deeper by logarithm: nearer than what touches, and a jump."""
COLOURS = torch.tensor([[0.7, 0.7, 0.7], [0.5, 0.2, 0.2], [0.5, 0.2, 0.2], [0.4, 0.2, 0.3]])


def of_pixels(right_of: float) -> tuple[np.ndarray, np.ndarray]:
    """What a photo (H, W) shows whose camera stands `right_of` the first, and z there."""
    u = (np.arange(WIDTH) + 0.5 - WIDTH / 2) / focal()
    v = (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / focal()
    ids, depths = np.zeros((HEIGHT, WIDTH), int), np.full((HEIGHT, WIDTH), DEPTHS[WALL])
    boxes = {LEFT: (-0.6, 0.0, -0.3, 0.6), RIGHT: (0.0, 0.6, -0.3, 0.6), SIGN: (-0.5, -0.2, 0.0, 0.3)}
    for thing, (x0, x1, y0, y1) in boxes.items():
        x, y = u * DEPTHS[thing] + right_of, v * DEPTHS[thing]
        inside = ((y >= y0) & (y < y1))[:, None] & ((x >= x0) & (x < x1))[None]
        inside &= DEPTHS[thing] <= depths + 1e-9
        ids[inside], depths[inside] = thing, DEPTHS[thing]
    return ids, depths


def focal() -> float:
    return float(intrinsics_from_fov(FOV, WIDTH, HEIGHT)[0, 0])


def photographed(shifts: tuple[float, ...] = (0.0, 0.15)) -> tuple[Scene, np.ndarray]:
    """A wall, two boxes of one word side by side and a sign on the left one: a Gaussian a pixel of each
    photo, in layers; and what each is of."""
    K, parts, whose = intrinsics_from_fov(FOV, WIDTH, HEIGHT).float(), [], []
    viewmats = torch.eye(4).repeat(len(shifts), 1, 1)
    viewmats[:, 0, 3] = -torch.tensor(shifts)
    for viewmat, shift in zip(viewmats, shifts, strict=True):
        ids, depths = of_pixels(shift)
        points = rays(K, WIDTH, HEIGHT) * torch.from_numpy(depths).float()[..., None]
        parts.append(transform(invert_rigid(viewmat), points).reshape(-1, 3))
        whose.append(ids.ravel())
    own = np.concatenate(whose)
    means = torch.cat(parts)
    wide = (means[:, 2] / focal() * 0.85)[:, None]
    scales = torch.cat((wide, wide, 0.1 * wide), 1)
    # A sign is more like a box than a wall is.
    dictionary = torch.tensor([[1.0, 0, 0], [0, 1, 0], [0, 1, 0.4]])
    return Scene(
        unturned(means, scales, 0.95, colour_to_sh(COLOURS[own])[:, None]),
        Semantics(ATOMS[own][:, None], torch.ones(len(own), 1), dictionary, "none"),
        viewmats,
        K.expand(len(shifts), 3, 3).contiguous(),
        (WIDTH, HEIGHT),
        view_ids=torch.arange(len(shifts)).repeat_interleave(WIDTH * HEIGHT),
        record=Record(layered=True),
    ), own


def clicked(own: np.ndarray, thing: int) -> np.ndarray:
    """Some Gaussians of a thing, in its middle, in the first photo."""
    rows = np.flatnonzero((own == thing) & (np.arange(len(own)) < WIDTH * HEIGHT))
    return np.isin(np.arange(len(own)), rows[len(rows) // 2 :][:3])


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    return (one & other).sum() / (one | other).sum()


def test_of_two_things_of_a_word_that_touch_a_click_takes_one_in_all_photos():
    scene, own = photographed()
    of_a_word = np.isin(own, (LEFT, RIGHT))
    assert things(scene, of_a_word)[of_a_word].max() == 1, "they touch"
    regions = regions_of(scene)
    for thing, whole in ((LEFT, (LEFT, SIGN)), (RIGHT, RIGHT), (SIGN, SIGN), (WALL, WALL)):
        reach = regions.around(clicked(own, thing))
        assert reach is not None
        best = max(overlap(reach.rows(level), np.isin(own, whole)) for level in range(reach.count))
        assert best > 0.97, thing  # pixels beside a jump, one of thirty
        if thing != WALL:
            assert not reach.rows(reach.chosen)[own == WALL].any()
    reach = regions.around(clicked(own, RIGHT))
    assert reach is not None
    chosen = reach.rows(reach.chosen)
    assert overlap(chosen, own == RIGHT) > 0.97 and not chosen[own == LEFT].any()
    later = np.arange(len(own)) >= WIDTH * HEIGHT
    assert chosen[later & (own == RIGHT)].mean() > 0.97


def test_levels_grow_and_hold_what_was_clicked():
    scene, own = photographed()
    seen = clicked(own, SIGN)
    reach = regions_of(scene).around(seen)
    assert reach is not None and 0 <= reach.chosen < reach.count > 1
    rows = [reach.rows(level) for level in range(reach.count)]
    assert all(small[seen].all() for small in rows)
    assert all(
        (large | ~small).all() and large.sum() > small.sum() for small, large in itertools.pairwise(rows)
    )
    assert any(overlap(each, np.isin(own, (LEFT, SIGN))) > 0.95 for each in rows), "the sign with its box"
    assert (reach.rows(-3) == rows[0]).all() and (reach.rows(99) == rows[-1]).all()


def tiled() -> tuple[Scene, np.ndarray]:
    """One photo of a wall of tiles, 5 pixels wide, with a lamp on it; and whether each Gaussian is the
    lamp's."""
    scene, _ = photographed((0.0,))
    v, u = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    lamp = (abs(v - 30) < 3) & (abs(u - 40) < 3)
    tiles = (v // 5 + u // 5) % 2
    colours = torch.tensor([[0.6, 0.6, 0.6], [0.72, 0.72, 0.72]])[tiles]
    colours[torch.from_numpy(lamp)] = torch.tensor([0.9, 0.8, 0.1])
    points = rays(scene.Ks[0], WIDTH, HEIGHT).reshape(-1, 3) * DEPTHS[WALL]
    gaussians = replace(scene.gaussians, means=points, sh=colour_to_sh(colours)[:, None])
    semantics = replace(scene.semantics, weight_ids=torch.from_numpy(lamp.astype(np.int64))[:, None])
    return replace(scene, gaussians=gaussians, semantics=semantics), lamp


def test_more_of_a_thing_comes_in_steps_that_people_follow():
    """From a lamp a step led to the whole wall, 190 times as large."""
    scene, lamp = tiled()
    reach = regions_of(scene).around(lamp & (np.arange(len(lamp)) % 3 == 0))
    assert reach is not None and overlap(reach.rows(reach.chosen), lamp) > 0.9
    counts = [int(reach.rows(level).sum()) for level in range(reach.chosen, reach.count)]
    low, high = REGIONS.steps
    assert len(counts) > 3 and counts[-1] > 0.25 * len(lamp)
    assert all(low <= more / less <= high for less, more in itertools.pairwise(counts)), counts
    first = np.flatnonzero(reach.rows(reach.chosen + 1))
    assert np.abs(first // WIDTH - 30).max() < 15 and np.abs(first % WIDTH - 40).max() < 15, "what touches it"


def test_parents_are_later_and_no_lower():
    regions = regions_of(photographed()[0])
    some = np.flatnonzero(regions.parents >= 0)
    assert (regions.parents[some] > some).all() and regions.leaves.max() < some.max()
    assert (regions.heights[regions.parents[some]] >= regions.heights[some]).all()
    parts = np.bincount(regions.parents[some], regions.sizes[some], len(regions.sizes))
    joined = parts > 0
    assert regions.sizes[joined] == pytest.approx(parts[joined])


def test_the_scenes_unit_and_the_order_of_its_gaussians_do_not_matter():
    scene, own = photographed()
    order = torch.randperm(len(own), generator=torch.Generator().manual_seed(0))
    large = scene.rows(order)
    viewmats = large.viewmats.clone()
    viewmats[:, :3, 3] *= 4
    larger = Gaussians(
        4 * large.gaussians.means, large.gaussians.quats, 4 * large.gaussians.scales,
        large.gaussians.opacities, large.gaussians.sh,
    )  # fmt: skip
    other = regions_of(replace(large, gaussians=larger, viewmats=viewmats)).around(clicked(own, RIGHT)[order])
    first = regions_of(scene).around(clicked(own, RIGHT))
    assert first is not None and other is not None
    assert overlap(other.rows(other.chosen), first.rows(first.chosen)[order]) > 0.97  # ties go either way


def test_gaussians_that_no_photo_made_hang_together_where_they_touch():
    scene, own = photographed((0.0,))
    alone = replace(scene, view_ids=None, record=Record())
    reach = regions_of(alone).around(clicked(own, SIGN))
    assert reach is not None
    assert max(overlap(reach.rows(level), own == SIGN) for level in range(reach.count)) > 0.97


def test_without_language_colour_and_depth_decide():
    scene, own = photographed()
    none = Semantics(
        torch.zeros(len(own), 0, dtype=torch.int64), torch.zeros(len(own), 0), torch.zeros(0, 3), "none"
    )
    reach = regions_of(replace(scene, semantics=none)).around(clicked(own, SIGN))
    assert reach is not None
    assert max(overlap(reach.rows(level), own == SIGN) for level in range(reach.count)) > 0.97


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_and_one(count: int):
    scene, _ = photographed()
    few = scene.rows(torch.arange(count))
    reach = regions_of(few).around(np.ones(count, bool))
    assert reach is None if count == 0 else reach is not None and reach.rows(reach.chosen).all()


def test_what_is_not_finite_is_of_nothing():
    scene, own = photographed()
    means = scene.gaussians.means.clone()
    means[:5] = torch.nan
    broken = replace(scene, gaussians=replace(scene.gaussians, means=means))
    regions = regions_of(broken)
    assert (regions.leaves[:5] == -1).all() and (regions.leaves[5:] >= 0).all()
    assert regions.around(np.arange(len(own)) < 5) is None
    reach = regions.around(clicked(own, RIGHT))
    assert reach is not None and not reach.rows(reach.count - 1)[:5].any()


def test_pairs_are_each_others_nearest():
    generator = np.random.default_rng(0)
    ends = generator.integers(0, 30, (2, 120))
    ends = ends[:, ends[0] != ends[1]]
    differences = generator.random(ends.shape[1])
    differences[::7] = np.inf
    nearest = [
        min(
            ((d, p) for p, d in enumerate(differences) if each in ends[:, p] and np.isfinite(d)),
            default=(0, -1),
        )[1]
        for each in range(30)
    ]
    expected = {p for p in range(ends.shape[1]) if nearest[ends[0, p]] == nearest[ends[1, p]] == p}
    assert set(_mutual((ends[0], ends[1]), differences, 30).tolist()) == expected and expected
