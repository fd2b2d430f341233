"""The reference against plain loops, against formulas on paper, and against itself."""

import dataclasses
import math

import pytest
import torch

from langflash_core.splat import project, rasterize, reference, render, view_depths
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import brute_force, camera, cloud, maps_of, parallel, scene_of, splats, turned

# Both sides are float64; running sums of logs lose a few digits of 1e-16 per layer.
EXACT = 1e-10


@pytest.mark.parametrize("pose", [None, turned(0.3, (0.1, -0.05, 0.2))])
@pytest.mark.parametrize("principal", [(10.0, 8.0), (3.0, 12.5), None])
def test_equals_plain_loops(pose, principal):
    """Parallel rays where there is no principal point."""
    scene = cloud(60, size=0.08)
    seen = camera(20, 16, 15.0, pose)
    if principal is None:
        seen = parallel(seen)
    else:
        K = seen.K.clone()
        K[0, 2], K[1, 2] = principal
        K[1, 1] = 18.0  # pixels need not be square
        seen = Camera(seen.viewmat, K, 20, 16)
    features = torch.randn(60, 4, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    maps, alphas = rasterize(scene.gaussians, features, seen)
    expected, expected_alphas = brute_force(scene.gaussians, features.numpy(), seen)
    torch.testing.assert_close(maps, torch.from_numpy(expected), rtol=0, atol=EXACT)
    torch.testing.assert_close(alphas, torch.from_numpy(expected_alphas), rtol=0, atol=EXACT)
    assert alphas.max() > 0.9, "the scene must cover something"


def test_parallel_rays_are_those_of_a_pinhole_far_away():
    """From 1e6 units, rays that meet the scene differ from parallel ones by 3e-6: colours, which turn with
    the direction, footprints and depths follow within a few times that."""
    scene, flat = cloud(200, num_atoms=3, size=0.08), parallel(camera())
    away = 1e6
    viewmat = flat.viewmat.clone()
    viewmat[2, 3] += away - 2.0  # what was 2 ahead is `away` ahead
    K = flat.K * torch.tensor([[away], [away], [1.0]], dtype=torch.float64)
    K[:2, 2] = flat.K[:2, 2]
    far = Camera(viewmat, K, flat.width, flat.height)
    near, distant = render(scene, flat), render(scene, far)
    assert near.alphas.mean() > 0.3
    torch.testing.assert_close(near.rgb, distant.rgb, rtol=0, atol=1e-4)
    torch.testing.assert_close(maps_of(near), maps_of(distant), rtol=0, atol=1e-4)
    solid = near.alphas > 0.1
    torch.testing.assert_close(near.depths[solid], distant.depths[solid] - away + 2.0, rtol=0, atol=1e-3)


@pytest.mark.parametrize("flat", [False, True])
def test_gradients(flat):
    scene = cloud(6, size=0.15, seed=3)
    fields = [f.clone().requires_grad_() for f in scene.gaussians.map(lambda v: v).__dict__.values()]
    features = torch.rand(6, 2, dtype=torch.float64, requires_grad=True)
    viewmat = turned(0.1, (0.0, 0.1, 0.0)).requires_grad_()
    seen = parallel(camera(7, 6, 6.0)) if flat else camera(7, 6, 6.0)

    def draw(means, quats, scales, opacities, features, viewmat):
        gaussians = Gaussians(means, quats, scales, opacities, scene.gaussians.sh)
        return rasterize(gaussians, features, dataclasses.replace(seen, viewmat=viewmat))

    # gradcheck's own tolerances: float64 central differences of step 1e-6.
    assert torch.autograd.gradcheck(draw, (*fields[:4], features, viewmat))


def test_cutting_the_image_changes_nothing(monkeypatch):
    scene = cloud(300, num_atoms=3)
    whole = render(scene, camera())
    monkeypatch.setattr(reference, "_MAX_PAIRS", 200)
    pieces = render(scene, camera())
    for name in ("rgb", "alphas", "depths", "weight_maps"):
        torch.testing.assert_close(getattr(pieces, name), getattr(whole, name), rtol=0, atol=EXACT)


def test_float32_follows_float64():
    scene = cloud(500, dtype=torch.float32)
    features = torch.rand(500, 3)
    maps, _ = rasterize(scene.gaussians, features, camera())
    exact, _ = rasterize(scene.gaussians.map(lambda v: v.double()), features.double(), camera())
    assert maps.dtype == torch.float32
    # A pair whose alpha is 1/255 may fall on either side: it moves a pixel by at most 1/255.
    assert (maps - exact).abs().max() < 2 / 255
    assert (maps - exact).abs().mean() < 1e-5  # float32 rounding of a few layers


@pytest.mark.parametrize("num_atoms", [0, 1, 24, 25, 130])
def test_features_first_equals_weights_first(num_atoms):
    scene = cloud(200, num_atoms, kept=8)
    frame = render(scene, camera())
    assert maps_of(frame).shape == (40, 48, num_atoms)
    dense = scene.semantics.dense_weights()
    features, _ = rasterize(scene.gaussians, dense @ scene.semantics.dictionary, camera())
    combined = maps_of(frame) @ scene.semantics.dictionary
    torch.testing.assert_close(combined, features, rtol=0, atol=EXACT)
    if num_atoms:
        torch.testing.assert_close(maps_of(frame).sum(-1), frame.alphas, rtol=0, atol=EXACT)


def test_splitting_and_permuting_atoms_changes_nothing():
    scene = cloud(200, 6)
    semantics = scene.semantics
    order = torch.tensor([3, 0, 5, 1, 4, 2])
    permuted = dataclasses.replace(
        semantics, weight_ids=order.argsort()[semantics.weight_ids], dictionary=semantics.dictionary[order]
    )
    halves = semantics.weight_values / 2
    split = dataclasses.replace(
        semantics,
        weight_ids=torch.cat((semantics.weight_ids, semantics.weight_ids + 6), 1),
        weight_values=torch.cat((halves, halves), 1),
        dictionary=semantics.dictionary.repeat(2, 1),
    )
    maps = [
        maps_of(render(dataclasses.replace(scene, semantics=changed), camera())) @ changed.dictionary
        for changed in (semantics, permuted, split)
    ]
    torch.testing.assert_close(maps[1], maps[0], rtol=0, atol=EXACT)
    torch.testing.assert_close(maps[2], maps[0], rtol=0, atol=EXACT)


def centred(size: int = 21) -> Camera:
    """The middle of the middle pixel is the principal point."""
    return camera(size, size, 20.0)


def test_alpha_is_held_at_0_99_and_cut_at_1_over_255():
    opaque = splats([(0.0, 0.0, 2.0)], opacities=1.0)
    _, alphas = rasterize(opaque, torch.ones(1, 1, dtype=torch.float64), centred())
    assert alphas[10, 10].item() == pytest.approx(0.99, abs=1e-15)
    for opacity, visible in ((1.0001 / 255, True), (0.9999 / 255, False)):
        faint = splats([(0.0, 0.0, 2.0)], opacities=[opacity])
        _, alphas = rasterize(faint, torch.ones(1, 1, dtype=torch.float64), centred())
        assert (alphas > 0).sum() == int(visible)


def test_of_equal_depths_the_first_is_in_front():
    means = [(0.0, 0.0, 2.0)] * 3
    colours = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    frame = render(scene_of(splats(means, opacities=0.5, colours=colours)), centred())
    expected = torch.tensor([0.5, 0.25, 0.125], dtype=torch.float64)
    torch.testing.assert_close(frame.rgb[10, 10], expected, rtol=0, atol=1e-12)


def test_depth_is_a_mean_along_z():
    gaussians = splats([(0.0, 0.0, 2.0), (0.0, 0.0, 4.0)], scales=[0.2, 0.4], opacities=0.5)
    frame = render(scene_of(gaussians), centred())
    assert frame.depths[10, 10].item() == pytest.approx((0.5 * 2 + 0.25 * 4) / 0.75)
    assert frame.depths[0, 0].item() == 0 and frame.alphas[0, 0].item() == 0


def test_200_opaque_layers():
    gaussians = splats([(0.0, 0.0, 1 + 0.01 * i) for i in range(200)], scales=0.2, opacities=1.0)
    frame = render(scene_of(gaussians), centred())
    # 1 - 0.01^200; the sum of 200 terms rounds a few times 1e-16.
    assert frame.alphas[10, 10].item() == pytest.approx(1.0, abs=1e-13)
    assert frame.depths[10, 10].item() == pytest.approx(
        sum(0.99 * 0.01**i * (1 + 0.01 * i) for i in range(20))
    )


def test_nothing_behind_or_nearer_than_near():
    gaussians = splats([(0.0, 0.0, z) for z in (-1.0, 0.0, 0.0099)], opacities=1.0)
    assert render(scene_of(gaussians), centred()).alphas.max() == 0
    kept = project(splats([(0.0, 0.0, 0.01)]), centred())
    assert len(kept.ids) == 1


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_weight_that_is_not_finite_drops_its_gaussian(bad):
    scene = cloud(50)
    values = scene.semantics.weight_values.clone()
    values[::10, 2] = bad
    poisoned = dataclasses.replace(
        scene, semantics=dataclasses.replace(scene.semantics, weight_values=values)
    )
    hidden = scene.gaussians.opacities.clone()
    hidden[::10] = 0
    expected = dataclasses.replace(scene, gaussians=dataclasses.replace(scene.gaussians, opacities=hidden))
    for with_maps in (True, False):  # the picture is the same with and without maps
        frame = render(poisoned, camera(), weight_maps=with_maps)
        truth = render(expected, camera(), weight_maps=with_maps)
        torch.testing.assert_close(frame.rgb, truth.rgb, rtol=0, atol=EXACT)
        if with_maps:
            torch.testing.assert_close(maps_of(frame), maps_of(truth), rtol=0, atol=EXACT)


def test_equal_means_have_equal_depths():
    """Whatever the row, and bit by bit as NumPy computes the same terms for the renderer."""
    gaussians = cloud(37).gaussians.map(lambda v: v.repeat_interleave(3, 0))
    seen = camera(pose=turned(0.3, (0.1, -0.05, 0.2)))
    depths = view_depths(gaussians, seen)
    triples = depths.unflatten(0, (37, 3))
    assert (triples == triples[:, :1]).all()
    (x, y, z), row = gaussians.means.numpy().T, seen.viewmat[2].numpy()
    assert (depths.numpy() == x * row[0] + y * row[1] + z * row[2] + row[3]).all()


@pytest.mark.parametrize("field", ["means", "quats", "scales", "opacities", "sh"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_values_that_are_not_finite_are_dropped_and_counted(field, bad):
    scene = cloud(50)
    broken = getattr(scene.gaussians, field).clone()
    broken.view(50, -1)[::10] = bad
    kept = torch.ones(50, dtype=torch.bool)
    kept[::10] = False
    poisoned = dataclasses.replace(scene.gaussians, **{field: broken})
    features = torch.ones(50, 1, dtype=torch.float64)
    maps, _ = rasterize(poisoned, features, camera())
    expected, _ = rasterize(scene.gaussians.map(lambda v: v[kept]), features[kept], camera())
    torch.testing.assert_close(maps, expected, rtol=0, atol=EXACT)
    assert project(poisoned, camera()).num_dropped == 5
    frame = render(dataclasses.replace(scene, gaussians=poisoned), camera())
    assert all(torch.isfinite(m).all() for m in (frame.rgb, frame.alphas, frame.depths, maps_of(frame)))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_gaussians(count):
    frame = render(cloud(count, num_atoms=2), camera(), background=(0.1, 0.2, 0.3))
    assert frame.rgb.shape == (40, 48, 3) and maps_of(frame).shape == (40, 48, 2)
    empty = frame.alphas == 0
    assert empty.any()
    shade = torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64).expand(int(empty.sum()), 3)
    torch.testing.assert_close(frame.rgb[empty], shade)
    assert maps_of(frame)[empty].abs().max() == 0 and frame.depths[empty].abs().max() == 0


def test_needles_keep_their_area():
    """det S by Cauchy-Binet: a needle of aspect 1e9 seen along a diagonal keeps its width."""
    gaussians = splats([(0.0, 0.0, 2.0)], scales=[(1e3, 1e-6, 1e-6)])
    half_turn = math.sin(math.pi / 8)
    turn = torch.tensor([[math.cos(math.pi / 8), 0.0, 0.0, half_turn]], dtype=torch.float64)
    footprints = project(dataclasses.replace(gaussians, quats=turn), centred())
    l11, _, l22 = footprints.roots[0].tolist()
    long = 20 * 1e3 / 2
    expected = math.sqrt((long**2 + 0.3) * 0.3)  # sqrt(det): the thin axis is the dilation alone
    # float32's cancellation would lose every digit here; the product keeps nine in float64.
    assert l11 * l22 == pytest.approx(expected, rel=1e-9)


def test_one_pixel_and_a_strip():
    scene = cloud(100)
    one = render(scene, camera(1, 1))
    strip = render(scene, camera(300, 2))
    assert one.rgb.shape == (1, 1, 3) and torch.isfinite(one.rgb).all()
    assert strip.rgb.shape == (2, 300, 3) and strip.alphas.max() > 0


def test_refuses_features_of_another_length():
    with pytest.raises(ValueError, match="features: expected 4 rows, received 3"):
        rasterize(cloud(4).gaussians, torch.zeros(3, 1), camera())
