"""The matrix of contributions against the reference rasteriser, and what leaving pairs out costs."""

import dataclasses
import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.splat import mixing as module
from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import ALPHA_MIN, Footprints, project
from langflash_core.splat.reference import rasterize
from langflash_core.splat.settings import MIXING
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import camera, cloud, parallel, splats, turned

# An alpha is exp of -(u^2 + v^2) / 2, where it is not cut at most 5.5, of float32 numbers that were some tens
# before they were subtracted: 1e-7 * 30 * 5. A pixel adds some tens of them, each with a transmittance.
CLOSE = 1e-4


def exact(gaussians: Gaussians, features: torch.Tensor, seen: Camera) -> tuple[np.ndarray, np.ndarray]:
    """The reference in float64: maps (H W, F) and alphas (H W,)."""
    maps, alphas = rasterize(gaussians.map(lambda v: v.double()), features.double(), seen)
    return maps.flatten(0, 1).numpy(), alphas.flatten().numpy()


def everything(gaussians: Gaussians, seen: Camera):
    """All pairs that a picture has; footprints in float64, so that only the matrix's own error counts."""
    footprints = project(gaussians.map(lambda v: v.double()), seen)
    return mixing(footprints, seen, len(gaussians), faint=ALPHA_MIN, small=0.0)


def agree(gaussians: Gaussians, seen: Camera) -> None:
    features = torch.rand(len(gaussians), 4, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    matrix = everything(gaussians, seen)
    maps, alphas = exact(gaussians, features, seen)
    assert matrix.shape == (seen.width * seen.height, len(gaussians)) and matrix.dtype == np.float32
    off = np.abs(matrix @ features.numpy() - maps).max(1)
    off = np.maximum(off, np.abs(np.asarray(matrix.sum(1)).ravel() - alphas))
    # A pair at 1/255 may fall on either side of the cut, another rounding of exp decides: one pixel, 1/255.
    assert (off > CLOSE).mean() < 1e-3 and off.max() < 2 / 255


@pytest.mark.parametrize("pose", [None, turned(0.3, (0.1, -0.05, 0.2))])
@pytest.mark.parametrize("size", [0.003, 0.03, 0.3])
@pytest.mark.parametrize("flat", [False, True])
def test_equals_the_reference(pose, size, flat):
    """From Gaussians thinner than a pixel to some larger than the picture."""
    scene, seen = cloud(300, size=size), camera(pose=pose)
    agree(scene.gaussians, parallel(seen) if flat else seen)
    assert exact(scene.gaussians, torch.zeros(300, 1), seen)[1].max() > 0.9, "the scene must cover something"


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (3, 2), (130, 3)])
def test_pictures_of_any_size(size):
    agree(cloud(100, size=0.1).gaussians, camera(*size, focal=float(max(size))))


def test_some_pixels_at_a_time(monkeypatch):
    """The same numbers, in the same order, however few pairs are in work."""
    scene = cloud(200, size=0.1)
    whole = everything(scene.gaussians, camera())
    for at_once in (4, 1000):
        monkeypatch.setattr(module, "MIXING", replace(module.MIXING, at_once=at_once))
        parts = everything(scene.gaussians, camera())
        assert np.array_equal(parts.indptr, whole.indptr) and np.array_equal(parts.indices, whole.indices)
        # Sums of logs begin elsewhere, in float64: the last digit of float32.
        np.testing.assert_allclose(parts.data, whole.data, rtol=1e-6)


def test_rows_run_front_to_back():
    scene, seen = cloud(300, size=0.1), camera()
    matrix, depths = everything(scene.gaussians, seen), scene.gaussians.means[:, 2].numpy()
    for start, end in itertools.pairwise(matrix.indptr):
        assert (np.diff(depths[matrix.indices[start:end]]) >= 0).all()


def test_equal_depths_keep_their_order():
    """The first of the scene is in front: it has its whole alpha, the next what that leaves."""
    gaussians = splats([(0, 0, 2.0)] * 3, scales=0.5, opacities=[0.5, 0.75, 0.5])
    matrix = everything(gaussians, camera(9, 9))
    middle = matrix.toarray()[4 * 9 + 4]
    assert middle == pytest.approx([0.5, 0.5 * 0.75, 0.5 * 0.25 * 0.5], abs=1e-6)  # float32
    back = everything(gaussians.rows(torch.tensor([2, 1, 0])), camera(9, 9))
    assert back.toarray()[4 * 9 + 4] == pytest.approx(middle, abs=1e-6)  # 0.5 before and behind


def test_wholly_beside_the_picture_or_behind_the_camera():
    gaussians = splats([(5, 0, 1.0), (0, -5, 1.0), (0, 0, -1.0), (0, 0, 0.0), (0, 0, 0.001)], 0.05)
    for seen in (camera(), parallel(camera())):
        agree(gaussians, seen)
        assert everything(gaussians, seen).nnz == 0


def test_footprints_that_were_not_culled_may_lie_anywhere():
    """`mixing` takes footprints as they are: those beside the picture, however far, change nothing."""
    seen = camera()
    far = [(-1e6, 20.0), (24.0, 1e6), (-3e8, -3e8), (24.0, 20.0)]
    roots = torch.tensor([[2.0, 0.5, 1.0]] * 4)
    footprints = Footprints(torch.arange(4), torch.tensor(far), roots, torch.ones(4), torch.ones(4), 0)
    matrix = mixing(footprints, seen, 4)
    last = Footprints(
        footprints.ids[3:], footprints.centres[3:], roots[3:], torch.ones(1), torch.ones(1), num_dropped=0
    )
    alone = mixing(last, seen, 4)
    assert alone.nnz > 0 and np.array_equal(matrix.toarray(), alone.toarray())


@pytest.mark.parametrize("scale", [1.0, 1e2, 1e5])
@pytest.mark.parametrize("flat", [False, True])
def test_footprints_larger_than_the_picture(scale, flat):
    """Centred, and with a centre that is as far beside the picture as it is large."""
    gaussians = splats([(0, 0, 1.5), (0.9 * scale, 0, 2.0)], scale, [0.6, 0.5])
    agree(gaussians, parallel(camera()) if flat else camera())


def test_large_footprints_cost_what_the_picture_has(monkeypatch):
    """A surface that another photo has close before its lens: 4,900 pixels wide, of which 48 x 40 are looked
    at, in squares of the next larger class, 64 pixels here."""
    looked_at = []
    pairs = module._Table.pairs
    monkeypatch.setattr(
        module._Table,
        "pairs",
        lambda table, rows, *of: (
            looked_at.append(len(rows) * int(table.sides[rows[0]]) ** 2) or pairs(table, rows, *of)
        ),
    )
    places = [(0.0, 0, 1.0), (20.0, 0, 1.0), (0, -20.0, 1.1), (-15.0, 15.0, 1.2)]
    agree(splats(places, 10.0, [0.3, 0.4, 0.5, 0.6]), camera())
    assert sum(looked_at) <= len(places) * 64**2


def test_thin_and_long_footprints():
    """A hundred pixels long, a pixel wide, at 45 degrees: u and v are hundreds and cancel to some units."""
    gaussians = dataclasses.replace(
        splats([(0, 0, 1.0)], [(2.5, 1e-4, 1e-4)], 0.9),
        quats=torch.tensor([[0.92388, 0, 0, 0.38268]], dtype=torch.float64),
    )
    agree(gaussians, camera())


def test_values_that_are_no_numbers_are_left_out(recwarn):
    scene = cloud(50, size=0.1, dtype=torch.float32)
    means, scales = scene.gaussians.means.clone(), scene.gaussians.scales.clone()
    means[3], means[4, 0], scales[5] = torch.nan, torch.inf, torch.inf
    gaussians = dataclasses.replace(scene.gaussians, means=means, scales=scales)
    agree(gaussians, camera())
    assert not {3, 4, 5} & set(everything(gaussians, camera()).indices)


@pytest.mark.parametrize("far", [1e18, 1e25, 1e38])
def test_sizes_that_overflow_float32_are_finite(far):
    """Finite, but their squares are not: whatever is drawn of them, what else there is stays a number."""
    gaussians = splats([(0, 0, 1.0), (far, 0, 1.0), (0, 0, 2.0)], [0.1, far, far], dtype=torch.float32)
    matrix = mixing(project(gaussians, camera()), camera(), 3)
    assert np.isfinite(matrix.data).all() and 0 in matrix.indices


def test_nothing_and_one():
    seen = camera()
    empty = everything(Gaussians.none(), seen)
    assert empty.shape == (48 * 40, 0) and empty.nnz == 0
    assert (empty @ np.zeros((0, 3), np.float32)).shape == (48 * 40, 3)
    one = splats([(0.01, 0.02, 1.0)], opacities=0.7)
    agree(one, seen)
    assert everything(one, seen).data.max() == pytest.approx(
        0.7, abs=0.05
    )  # a pixel's centre is near its own


def test_fainter_than_the_cut_is_not_there():
    assert (
        mixing(project(splats([(0, 0, 1.0)], opacities=0.9 * MIXING.faint), camera()), camera(), 1).nnz == 0
    )


def test_more_gaussians_than_footprints():
    """Columns are the scene's, not the footprints': ids stay."""
    gaussians = splats([(0, 0, -1.0), (0, 0, 1.0), (9, 0, 1.0)])
    matrix = mixing(project(gaussians, camera()), camera(), 7)
    assert matrix.get_shape()[1] == 7 and set(matrix.indices) == {1}


@pytest.mark.parametrize(("size", "kept"), [(0.01, 0.75), (0.03, 0.5), (0.1, 0.1)])
def test_what_is_left_out_by_default_is_little(size, kept):
    """Of a footprint alone ln(0.95 * 64) / ln(0.95 * 255) = 0.75 of its pixels stay; where many lie behind
    each other, most of them say nothing."""
    scene, seen = cloud(1500, size=size), camera()
    gaussians = dataclasses.replace(scene.gaussians, opacities=torch.full((1500,), 0.95, dtype=torch.float64))
    footprints = project(gaussians, seen)
    whole = mixing(footprints, seen, 1500, faint=ALPHA_MIN, small=0.0)
    part = mixing(footprints, seen, 1500)
    assert part.nnz < kept * whole.nnz
    before, after = (np.asarray(m.sum(1)).ravel() for m in (whole, part))
    assert 0 < 1 - after.sum() / before.sum() < 0.03  # 2 % is stated, of scenes at large
    # 1 - prod(1 - alpha) over fewer factors is less, and what is small is left out after that.
    assert (after <= before + CLOSE).all()


def test_what_small_leaves_out_is_below_it():
    """Without the cut by alpha, contributions that stay are the same, and no other reaches SMALL."""
    footprints, seen = project(cloud(400, size=0.1).gaussians, camera()), camera()
    whole = mixing(footprints, seen, 400, faint=ALPHA_MIN, small=0.0).tocsr()
    part = mixing(footprints, seen, 400, faint=ALPHA_MIN, small=MIXING.small).tocsr()
    left = (whole - part).tocoo()
    assert part.nnz < whole.nnz and np.abs(left.data).max() < MIXING.small
    assert part.data.min() >= MIXING.small and np.isin(part.data, whole.data).all()


@pytest.mark.parametrize("small", [0.0, MIXING.small, 0.1])
def test_slabs_by_depth_change_nothing(monkeypatch, small):
    """What lies behind opaque pixels is not looked at, and would have been left out."""
    opaque = dataclasses.replace(cloud(3000, size=0.08).gaussians, opacities=torch.full((3000,), 0.95))
    gaussians, seen = opaque.map(lambda v: v.double()), camera(150, 130, focal=120.0)
    footprints = project(gaussians, seen)
    whole = mixing(footprints, seen, 3000, small=small)
    looked_at, pairs = [], module._Table.pairs

    def counted(table, rows, *of):
        looked_at.append(len(rows))
        return pairs(table, rows, *of)

    monkeypatch.setattr(module._Table, "pairs", counted)
    monkeypatch.setattr(module, "MIXING", replace(module.MIXING, least_slab=300))
    parts = mixing(footprints, seen, 3000, small=small)
    assert np.array_equal(parts.indptr, whole.indptr) and np.array_equal(parts.indices, whole.indices)
    # Sums of logs begin elsewhere, in float64: the last digit of float32.
    np.testing.assert_allclose(parts.data, whole.data, rtol=1e-6)
    assert small == 0 or sum(looked_at) < 0.7 * len(footprints.ids)


@pytest.mark.parametrize("small", [0.0, MIXING.small])
def test_rows_that_are_not_wanted_are_empty_and_the_others_the_same(small):
    gaussians, seen = cloud(400, size=0.05).gaussians, camera()
    footprints = project(gaussians, seen)
    wanted = np.zeros((seen.height, seen.width), bool)
    wanted[5:20, 3:30] = True
    whole = mixing(footprints, seen, 400, small=small)
    some = mixing(footprints, seen, 400, small=small, wanted=wanted)
    assert some[~wanted.ravel()].nnz == 0 and some.nnz > 0
    assert (some[wanted.ravel()] != whole[wanted.ravel()]).nnz == 0
    assert mixing(footprints, seen, 400, wanted=np.zeros_like(wanted)).nnz == 0
