"""Guided depth and the per-pixel Gaussians against slow twins."""

import itertools

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from langflash_core.depth.sharpening import sharpen_depths
from langflash_core.depth.surfaces import one_by_one
from langflash_core.geometry.cameras import invert_rigid, rays
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.network.gaussians import CHANNELS, assemble_gaussians, footprints
from langflash_core.network.model import pooled_weights
from langflash_core.network.sweep import Compared, patches, sample_bilinear, sweep_correlation
from langflash_core.rig.rig import DepthMaps
from tests.geometry.spread import covariances

K = torch.tensor([[40.0, 0, 16], [0, 40.0, 12], [0, 0, 1]], dtype=torch.float64)


def _sweep_twin(features, log_depths, offsets, viewmats, Ks, view, other, plane, row, column):
    """One entry of the volume for two views, from the definition."""
    depth = float(torch.exp(log_depths[view, row, column] + offsets[plane]))
    pixel = torch.tensor([column + 0.5, row + 0.5, 1.0], dtype=torch.float64)
    pos = viewmats[other] @ torch.linalg.inv(viewmats[view])
    pos = pos[:3, :3] @ (torch.linalg.inv(Ks[view]) @ pixel * depth) + pos[:3, 3]
    x, y = (Ks[other] @ pos / pos[2])[:2].tolist()
    height, width = features.shape[-2:]
    if pos[2] <= 0 or not (0 <= x <= width and 0 <= y <= height):
        return 0.0
    total = torch.zeros(features.shape[1], dtype=torch.float64)
    left, top = int(np.floor(x - 0.5)), int(np.floor(y - 0.5))
    for r in (top, top + 1):
        for c in (left, left + 1):
            if 0 <= r < height and 0 <= c < width:
                share = (1 - abs(x - 0.5 - c)) * (1 - abs(y - 0.5 - r))
                total += share * features[other, :, r, c]
    return float(total @ features[view, :, row, column])


def _swept(num_views: int, channels: int, height: int, width: int) -> tuple[torch.Tensor, ...]:
    """Features, log depths and offsets that a sweep reads, and cameras at one place; float64."""
    torch.manual_seed(0)
    features = F.normalize(torch.randn(num_views, channels, height, width, dtype=torch.float64), dim=1)
    log_depths = torch.rand(num_views, height, width, dtype=torch.float64) * 0.5 + 0.5
    offsets = torch.linspace(-0.4, 0.4, 5, dtype=torch.float64)
    return features, log_depths, offsets, torch.eye(4, dtype=torch.float64).repeat(num_views, 1, 1)


def test_sweep_equals_its_twin():
    features, log_depths, offsets, viewmats = _swept(2, 6, 24, 32)
    viewmats[1, :3, 3] = torch.tensor([-0.3, 0.05, 0.1])
    compared = [Compared.of(features, (24, 32), groups) for groups in (1, 3)]
    (volume, grouped), _ = sweep_correlation(compared, log_depths, offsets, viewmats, K.expand(2, 3, 3))
    for plane, row, column in [(0, 3, 5), (2, 12, 20), (4, 23, 31), (1, 0, 0), (3, 20, 2)]:
        expected = _sweep_twin(
            features, log_depths, offsets, viewmats, K.expand(2, 3, 3), 0, 1, plane, row, column
        )
        assert volume[0, 0, plane, row, column].item() == pytest.approx(expected, abs=1e-10)
    assert grouped.shape == (2, 3, 5, 24, 32)
    torch.testing.assert_close(grouped.sum(1), volume[:, 0])


def test_vectors_are_gathered_as_grid_sample_has_them():
    """Also on the border, where half of what is read is 0; both round float64."""
    torch.manual_seed(0)
    maps = torch.randn(2, 5, 6, 9, dtype=torch.float64)
    places = torch.rand(2, 40, 3, dtype=torch.float64) * 2 - 1
    places[:, 0, :2] = torch.tensor([[-1.0, 1.0], [1.0, -1.0]])
    table = Compared.of(maps, (6, 9)).table[1]
    found = sample_bilinear(table, (6, 9), places)
    expected = F.grid_sample(maps[1:], places.movedim(0, -1)[None], align_corners=False)[0]
    assert torch.allclose(found, expected.movedim(0, -1), rtol=0, atol=1e-12)


def test_a_sweep_in_float32_stays_close_to_float64():
    """Products of unit vectors of 64 numbers round at 1e-6; a place moves by as much of a pixel, and vectors
    change from one pixel to the next by at most 2."""
    features, log_depths, offsets, viewmats = _swept(2, 64, 24, 32)
    viewmats[1, 0, 3] = -0.01  # every point stays clear of the border, where it counts or does not
    volumes = []
    for kind in (torch.float64, torch.float32):
        compared = [Compared.of(features.to(kind), (24, 32), 2)]
        given = (log_depths.to(kind), offsets.to(kind), viewmats.to(kind), K.expand(2, 3, 3).to(kind))
        volumes.append(sweep_correlation(compared, *given)[0][0].double())
    assert (volumes[0] - volumes[1]).abs().max() < 1e-4


def test_a_view_is_compared_with_its_neighbours_alone():
    features, log_depths, offsets, viewmats = _swept(3, 6, 12, 16)
    viewmats[1, 0, 3], viewmats[2, 1, 3] = -0.3, 0.2
    Ks = K.expand(3, 3, 3)

    def swept(keep: list[int], neighbours):
        compared = [Compared.of(features[keep], (12, 16))]
        (volume,), seen = sweep_correlation(
            compared, log_depths[keep], offsets, viewmats[keep], Ks[keep], neighbours
        )
        return volume, seen

    near = swept([0, 1, 2], [[1], [0], [0, 1]])
    pair, everyone = swept([0, 1], None), swept([0, 1, 2], None)
    for found, two, three in zip(near, pair, everyone, strict=True):
        torch.testing.assert_close(found[:2], two)
        torch.testing.assert_close(found[2], three[2])
        assert not torch.equal(found[0], three[0])


def test_sweep_of_a_lonely_or_blind_view_is_zero():
    features = F.normalize(torch.randn(2, 4, 6, 8), dim=1)
    behind = torch.eye(4).repeat(2, 1, 1)
    behind[1, :3, :3] = torch.diag(torch.tensor([-1.0, 1.0, -1.0]))
    for count, viewmats in ((1, torch.eye(4)[None]), (2, behind)):
        (volume,), seen = sweep_correlation(
            [Compared.of(features[:count], (6, 8))],
            torch.zeros(count, 6, 8),
            torch.tensor([0.0]),
            viewmats,
            K.float().expand(count, 3, 3),
        )
        assert volume.abs().max() == 0 and seen.abs().max() == 0


def test_patches_are_what_cross_correlation_compares():
    """Against numpy.corrcoef of two patches; exposure changes nothing; a blank patch is zero."""
    torch.manual_seed(0)
    images = torch.rand(1, 3, 24, 32)
    vectors = patches(images)
    resized = F.interpolate(images, scale_factor=0.5, mode="bilinear", antialias=True).mean(1)[0]
    one, two = (resized[r - 2 : r + 3, c - 2 : c + 3].flatten() for r, c in ((5, 6), (7, 9)))
    expected = np.corrcoef(one.numpy(), two.numpy())[0, 1]
    assert float(vectors[0, :, 5, 6] @ vectors[0, :, 7, 9]) == pytest.approx(expected, abs=1e-5)
    inside = (..., slice(2, -2), slice(2, -2))  # patches over the edge see zeros
    torch.testing.assert_close(patches(0.3 * images + 0.2)[inside], vectors[inside], atol=1e-4, rtol=0)
    assert patches(torch.full((1, 3, 24, 32), 0.5))[..., 4, 4].abs().max() < 1e-2


def test_refiner_stays_in_its_range_and_is_finite(untrained):
    from langflash_core.network.encoders.shared import Tokens

    torch.manual_seed(0)
    images = torch.rand(1, 2, 3, 56, 70)
    tokens = Tokens(tuple(torch.randn(1, 2, 20, 384) for _ in range(4)), (4, 5))
    prior = DepthMaps(torch.rand(1, 2, 56, 70), torch.zeros(1, 2, 56, 70))
    viewmats = torch.eye(4).expand(1, 2, 4, 4)
    Ks = torch.tensor([[60.0, 0, 35], [0, 60.0, 28], [0, 0, 1]]).expand(1, 2, 3, 3)
    local = untrained.local(images[0])
    passes = untrained.refiner(images, tokens, local, prior, viewmats, Ks)
    assert len(passes) == untrained.preset.sweep_passes
    for before, after in itertools.pairwise((prior, *passes)):
        assert torch.isfinite(after.depths).all()
        change = (after.log_depths - before.log_depths).abs().max()
        assert change <= untrained.preset.sweep_range + 1e-5  # float32


def _plane(tilt: float) -> torch.Tensor:
    """Depth of the plane z = 2 + tilt * x."""
    slopes = rays(K, 32, 24)[..., 0]
    return 2 / (1 - tilt * slopes)


@pytest.mark.parametrize("tilt", [0.0, 0.5, -1.0])
def test_footprints_have_the_covariance_of_their_tangents(tilt):
    """On a plane both differences agree up to perspective; numpy's eigh is the twin."""
    depths = _plane(tilt)
    pos, axes, scales = footprints(depths, K)
    shift_u, shift_v = pos[:, 1:] - pos[:, :-1], pos[1:] - pos[:-1]
    row, column = 12, 16
    steps = lambda s, a, b: s[a] if s[a].norm() < s[b].norm() else s[b]  # noqa: E731
    t_u = steps(shift_u, (row, column - 1), (row, column))
    t_v = steps(shift_v, (row - 1, column), (row, column))
    expected = 0.36 * (torch.outer(t_u, t_u) + torch.outer(t_v, t_v)).numpy()
    values, vectors = np.linalg.eigh(expected)
    own = axes[row, column].numpy()
    assert np.sort(scales[row, column, :2].numpy() ** 2) == pytest.approx(values[1:], rel=1e-9)
    assert abs(own[:, 2] @ vectors[:, 0]) == pytest.approx(1, abs=1e-9)
    assert np.linalg.det(own) == pytest.approx(1, abs=1e-9)


def test_footprints_at_a_depth_jump_stay_small():
    depths = torch.full((24, 32), 2.0, dtype=torch.float64)
    depths[:, 16:] = 20.0
    _, axes, scales = footprints(depths, K)
    assert torch.isfinite(axes).all()
    assert scales[:, :15].max() < 2.0 / 40 * 0.61  # the near side never reaches across


def test_one_pixel_gives_a_finite_element():
    _, axes, scales = footprints(torch.full((1, 1), 2.0, dtype=torch.float64), K)
    assert torch.isfinite(axes).all() and (scales > 0).all()


def test_gaussians_land_on_the_surface_in_world_space():
    torch.manual_seed(0)
    viewmats = torch.eye(4, dtype=torch.float64).repeat(2, 1, 1)
    angle = 0.3
    viewmats[1, :3, :3] = quats_to_matrices(
        torch.tensor([np.cos(angle / 2), 0, np.sin(angle / 2), 0], dtype=torch.float64)
    )
    viewmats[1, :3, 3] = torch.tensor([0.2, -0.1, 0.3])
    maps = DepthMaps(
        torch.stack((_plane(0.2), _plane(-0.3))).log(), torch.zeros(2, 24, 32, dtype=torch.float64)
    )
    images = torch.rand(2, 3, 24, 32, dtype=torch.float64)
    raw = torch.zeros(2, CHANNELS, 24, 32, dtype=torch.float64)
    gaussians = assemble_gaussians(raw, images, maps, viewmats, K.expand(2, 3, 3))
    pixel = 24 * 32 + 10 * 32 + 7  # view 1, row 10, column 7
    expected = rays(K, 32, 24)[10, 7] * maps.depths[1, 10, 7]
    back = viewmats[1] @ torch.cat((gaussians.means[pixel], torch.ones(1, dtype=torch.float64)))
    assert torch.allclose(back[:3], expected, atol=1e-12)
    assert torch.allclose(
        invert_rigid(viewmats) @ viewmats, torch.eye(4, dtype=torch.float64).expand(2, 4, 4), atol=1e-12
    )
    spread = covariances(gaussians.quats, gaussians.scales)
    assert torch.linalg.eigvalsh(spread).min() > 0
    assert torch.allclose(0.5 + 0.28209479177387814 * gaussians.sh[pixel, 0], images[1, :, 10, 7], atol=1e-12)


def test_views_one_by_one_give_what_all_at_once_do(untrained):
    torch.manual_seed(0)
    images = torch.rand(3, 3, 56, 70)
    depths = (images[:, 0] > 0.5) + torch.rand(3, 56, 70) / 10
    # The same sums; a convolution may order them otherwise for another batch.
    torch.testing.assert_close(
        one_by_one(untrained.local, images), untrained.local(images), atol=1e-5, rtol=0
    )
    found = one_by_one(sharpen_depths, depths, images)
    torch.testing.assert_close(found, sharpen_depths(depths, images), atol=1e-5, rtol=0)


def test_weights_are_pooled_as_adaptive_pooling_has_them():
    """Windows that do not divide the map overlap; both round float64."""
    torch.manual_seed(0)
    weights = torch.rand(2, 3, 21, 35, dtype=torch.float64)
    for size in ((6, 10), (21, 35), (4, 9), (1, 1)):
        found = pooled_weights(weights, torch.zeros(1, 2, 4, *size, dtype=torch.float64))
        assert torch.allclose(found[0], F.adaptive_avg_pool2d(weights, size), rtol=0, atol=1e-12)
    assert pooled_weights(weights[:, :0], torch.zeros(1, 2, 4, 6, 10)).shape == (1, 2, 0, 6, 10)
