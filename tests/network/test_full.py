"""The paper's network: its size, every view count, hard photos, its poses and its mask filter."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.cameras import invert_rigid, rays
from langflash_core.network import FULL, PointMapNet, build_network
from langflash_core.network.points.heads import exponential_points
from langflash_core.network.points.resection import depths_and_confidences, resect
from langflash_core.network.precision import has_bfloat16
from langflash_core.network.presets import MaskFilter
from langflash_core.network.semantics.grouping import Groups
from langflash_core.network.semantics.residual import filter_queries
from langflash_core.types import Views
from tests.network.sizes import TINY, large, noise_views

UNUSED_UNIT = 2 * (256 * 256 * 9 + 256)
"""The published DPTs carry one residual unit at the coarsest level that nothing reads."""


@pytest.fixture(scope="module")
def tiny() -> PointMapNet:
    torch.manual_seed(0)
    return build_network(TINY).eval()


def test_parameters_agree_with_the_published_network():
    with torch.device("meta"):
        network = build_network(FULL)
    count = {name: sum(p.numel() for p in part.parameters()) for name, part in network.named_children()}
    millions = {name: number / 1e6 for name, number in count.items()}
    assert millions["encoder"] == pytest.approx(303.1, abs=0.05)
    assert millions["decoder"] == pytest.approx(227.7, abs=0.05)
    assert (count["point_heads"] / 2 + UNUSED_UNIT) / 1e6 == pytest.approx(20.2, abs=0.05)
    assert (count["gaussian_heads"] / 2 + UNUSED_UNIT) / 1e6 == pytest.approx(20.4, abs=0.05)
    geometry = sum(count[name] for name in ("encoder", "decoder", "point_heads", "gaussian_heads"))
    assert (geometry + 4 * UNUSED_UNIT) / 1e6 == pytest.approx(612, abs=0.5)
    assert (count["scratch"] + 2 * UNUSED_UNIT) / 1e6 == pytest.approx(39.6, abs=0.05)
    assert network.grouping.patterns.shape == (256, 256)


@pytest.mark.parametrize("num_views", [1, 2, 3, 8])
def test_any_number_of_views(tiny, num_views):
    views = noise_views(num_views)
    prediction = tiny.predict(views)
    gaussians = prediction.gaussians
    assert len(gaussians) == num_views * 64 * 64
    assert gaussians.sh.shape == (num_views * 64 * 64, 25, 3)
    for values in (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh):
        assert torch.isfinite(values).all()
    assert (gaussians.scales > 0).all() and (prediction.depths > 0).all()
    assert torch.isfinite(prediction.viewmats).all()
    assert torch.equal(prediction.viewmats[0], torch.eye(4))
    assert prediction.weights.shape[0] == num_views and prediction.weights.shape[2:] == (64, 64)
    assert prediction.dictionary.shape == (prediction.weights.shape[1], 512)
    assert tuple(prediction.timings) == tiny.stages


@large
def test_compiled_parts_give_the_same_numbers(tiny):
    """Through dynamo's capture; its code generation is torch's own and needs a compiler."""
    views = noise_views()
    network = build_network(TINY).eval().compiled("eager")
    network.load_state_dict(tiny.state_dict())
    with torch.inference_mode():
        found, expected = (n.encode(views.images[None], views.Ks[None]) for n in (network, tiny))
    for compiled, plain in zip(found.hooks, expected.hooks, strict=True):
        torch.testing.assert_close(compiled, plain)


def test_groups_may_come_from_elsewhere(tiny):
    seen = []

    def halves(geometry, views):
        seen.append((geometry.depths.shape, views.num_views))
        left = torch.zeros(2, 2, 64, 64)
        left[:, 0, :, :32], left[:, 1, :, 32:] = 1, 1
        return left

    prediction = tiny.predict(noise_views(), groups=halves)
    assert seen == [((2, 64, 64), 2)]
    assert prediction.weights[0, :, 0, 0].tolist() == [1, 0] and prediction.dictionary.shape == (2, 512)


@pytest.mark.parametrize("size", [(48, 80), (80, 48), (16, 16)])
def test_any_shape_of_whole_patches(tiny, size):
    prediction = tiny.predict(noise_views(2, *size))
    assert prediction.depths.shape == (2, *size)
    assert torch.isfinite(prediction.gaussians.means).all()


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_blank_identical_photos_stay_finite(tiny, value):
    views = replace(noise_views(), images=torch.full((2, 3, 64, 64), value))
    prediction = tiny.predict(views)
    assert torch.isfinite(prediction.gaussians.means).all() and torch.isfinite(prediction.viewmats).all()


def test_one_photo_is_paired_with_itself(tiny):
    one = tiny.predict(noise_views(1))
    views = noise_views(1)
    twice = Views(views.images.repeat(2, 1, 1, 1), views.Ks.repeat(2, 1, 1), ("a", "b"))
    both = tiny.predict(twice)
    torch.testing.assert_close(one.gaussians.means, both.gaussians.means[: 64 * 64])


def test_without_grouping_weights_groups_come_from_the_language_features():
    torch.manual_seed(0)
    network = build_network(TINY).eval()
    network.grouped = False
    weights = network.predict(noise_views()).weights
    assert weights.shape[1] >= 1
    torch.testing.assert_close(weights.sum(1), torch.ones(2, 64, 64))


def test_exponential_points_keep_directions():
    points = exponential_points(torch.tensor([[0.0, 3.0], [0.0, 4.0], [0.0, 0.0]])[None, :, None])
    assert torch.equal(points[0, :, 0, 0], torch.zeros(3))
    far = points[0, :, 0, 1]
    assert far.norm() == pytest.approx(np.expm1(5.0), rel=1e-6)
    assert far[0] / far[1] == pytest.approx(0.75)


def _seen_points(noise: float) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """A slanted wall in the world's frame, as a camera beside it sees it: points, K, viewmat."""
    height = width = 128
    K = torch.tensor([[120.0, 0, 64], [0, 120.0, 64], [0, 0, 1]])
    depth = 3 + torch.linspace(0, 1, width).expand(height, width) + 0.3 * torch.rand(height, width)
    pos_c = rays(K, width, height) * depth[..., None]
    turn = torch.linalg.matrix_exp(torch.tensor([[0.0, -0.1, 0.2], [0.1, 0, -0.05], [-0.2, 0.05, 0]]))
    viewmat = torch.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = turn, torch.tensor([0.4, -0.1, 0.2])
    pose = invert_rigid(viewmat)
    pos_w = pos_c @ pose[:3, :3].T + pose[:3, 3]
    return (pos_w + noise * torch.randn(pos_w.shape)).movedim(-1, 0), K, viewmat


def test_a_camera_is_found_from_its_point_map():
    torch.manual_seed(0)
    points, K, viewmat = _seen_points(noise=0.005)
    points[:, :30] = torch.rand(3, 30, 128)  # a quarter of the map is wrong
    found = resect(points, K)
    assert found.is_trusted and 0.6 < found.share < 0.8
    # 3,000 points with 0.3 px of noise: a few hundredths of a pixel, 1e-3 leaves a margin of ten.
    np.testing.assert_allclose(found.viewmat, viewmat.numpy(), atol=2e-3)
    depths, trust = depths_and_confidences(points[None], viewmat[None], K[None])
    assert trust[0, 40:].min() > 0.5 > trust[0, :30].mean()
    assert bool((depths > 0).all())


@pytest.mark.parametrize("kind", ["random", "nan", "one place"])
def test_a_point_map_of_nothing_places_no_camera(kind):
    torch.manual_seed(0)
    points = {
        "random": torch.randn(3, 64, 64),
        "nan": torch.full((3, 64, 64), torch.nan),
        "one place": torch.ones(3, 64, 64),
    }[kind]
    found = resect(points, torch.tensor([[60.0, 0, 32], [0, 60.0, 32], [0, 0, 1]]))
    assert not found.is_trusted
    assert np.isfinite(found.viewmat).all()


def _brute_filter(logits: np.ndarray, scores: np.ndarray, rule: MaskFilter) -> list[int]:
    """SAM's recipe, one mask at a time."""
    passed = []
    for n, mask in enumerate(logits.reshape(len(logits), -1)):
        low = (mask > -rule.offset).sum()
        stability = (mask > rule.offset).sum() / low if low else 0.0
        if (
            scores[n] >= rule.min_score
            and stability >= rule.min_stability
            and (mask > 0).sum() >= rule.min_area
        ):
            passed.append(n)
    kept: list[int] = []
    for n in sorted(passed, key=lambda n: -scores[n]):
        mine = logits[n].ravel() > 0
        others = [logits[k].ravel() > 0 for k in kept]
        if all((mine & o).sum() / max((mine | o).sum(), 1) <= rule.max_overlap for o in others):
            kept.append(n)
    return kept


def test_the_released_filter_equals_its_twin():
    rng = np.random.default_rng(0)
    ys, xs = np.mgrid[:32, :32]
    masks = []
    for _ in range(40):
        y, x, radius = rng.uniform(0, 32, 3) * (1, 1, 0.4)
        softness = rng.uniform(0.2, 6)
        masks.append((radius - np.hypot(ys - y, xs - x)) / softness)
    logits = np.stack([np.stack((m, m[::-1])) for m in masks])  # (N, V, h, w)
    scores = rng.uniform(0, 1, 40)
    rule = MaskFilter(min_area=60)
    groups = Groups(
        torch.from_numpy(logits).movedim(0, 1)[None], torch.from_numpy(np.log(scores / (1 - scores)))[None]
    )
    expected = _brute_filter(logits, scores, rule)
    assert 3 < len(expected) < 30  # every condition has something to do
    assert filter_queries(groups, rule).tolist() == expected
    nothing = Groups(groups.mask_logits - 100, groups.existence_logits)
    assert filter_queries(nothing, rule).tolist() == []


def test_masks_add_up_over_the_layers(tiny):
    """While training every layer answers; the last one alone is the same answer."""
    tokens = tiny.encode(noise_views().images[None], noise_views().Ks[None])
    memories, finest = tiny.semantic_maps(tokens, noise_views().images[None])
    with torch.no_grad():
        alone = tiny.grouping(memories, finest, 2)
        tiny.grouping.train()
        every = tiny.grouping(memories, finest, 2)
        tiny.grouping.eval()
    assert (len(alone), len(every)) == (1, 6)
    assert torch.equal(alone[0].mask_logits, every[-1].mask_logits)
    assert not torch.equal(every[0].mask_logits, every[-1].mask_logits)


@large
def test_the_real_size_runs_at_256():
    """Random weights: shapes, finite numbers, and 131,072 Gaussians of degree 4."""
    torch.manual_seed(0)
    network = build_network(FULL).eval()
    if has_bfloat16():
        network.use_bfloat16()
    prediction = network.predict(noise_views(2, 256, 256))
    assert len(prediction.gaussians) == 2 * 256 * 256
    assert prediction.gaussians.sh.shape[1:] == (25, 3)
    assert torch.isfinite(prediction.gaussians.means).all()
    assert prediction.dictionary.shape[1] == 512
