"""Lengths, poses, weights, and bad numbers on the way from a prediction to a scene."""

from dataclasses import replace

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.scene.checks import check_scene
from langflash_core.scene.weights import sparse_weights
from langflash_core.surface.assemble import assemble
from langflash_core.types import Scene
from tests.scene.plane import wall_prediction


def views_of(scene: Scene) -> list[int]:
    """How many Gaussians each view made; they lie in the order of the views."""
    assert scene.view_ids is not None and bool((scene.view_ids.diff() >= 0).all())
    return scene.view_ids.bincount(minlength=scene.num_views).tolist()


def test_the_mean_distance_of_view_0_is_one_and_everything_moved_with_it():
    prediction, views = wall_prediction()
    scene = assemble(prediction, views)
    check_scene(scene)
    per_view = views.size[0] * views.size[1]
    assert views_of(scene) == [per_view, per_view]
    # float32 means over some thousand points.
    assert float(scene.gaussians.means[:per_view].norm(dim=-1).mean()) == pytest.approx(1, abs=1e-5)
    unit = scene.record.network_unit
    assert unit is not None
    assert torch.allclose(scene.gaussians.scales * unit, prediction.gaussians.scales)
    assert torch.allclose(scene.viewmats[:, :3, 3] * unit, prediction.viewmats[:, :3, 3])
    assert torch.equal(scene.viewmats[:, :3, :3], prediction.viewmats[:, :3, :3])


def test_the_record_tells_where_the_scene_came_from():
    prediction, views = wall_prediction()
    record = assemble(prediction, views, preset="full").record
    assert record.preset == "full"
    assert record.photos == ("0.jpg", "1.jpg")
    assert record.warnings == ("a note of triage", "a note of the network")
    assert list(record.cost.timings) == ["encoder", "assembly"]
    assert record.counts == {"predicted": 2 * 56 * 42, "unusable": 0, "seen_through": 0}


@pytest.mark.parametrize("field", ["means", "quats", "scales", "opacities", "sh"])
@pytest.mark.parametrize("bad", [torch.nan, torch.inf, -torch.inf])
def test_numbers_that_are_not_finite_are_dropped(field, bad):
    prediction, views = wall_prediction(width=28, height=28)
    spoiled = getattr(prediction.gaussians, field).clone()
    spoiled[[3, 800]] = bad
    scene = assemble(replace(prediction, gaussians=replace(prediction.gaussians, **{field: spoiled})), views)
    check_scene(scene)
    assert scene.record.counts["unusable"] == 2
    assert views_of(scene) == [28 * 28 - 1, 28 * 28 - 1]


def test_zero_quaternions_and_scales_become_harmless():
    prediction, views = wall_prediction(width=14, height=14)
    gaussians = replace(
        prediction.gaussians, quats=torch.zeros_like(prediction.gaussians.quats),
        scales=-prediction.gaussians.scales, opacities=prediction.gaussians.opacities * 7,
    )  # fmt: skip
    check_scene(assemble(replace(prediction, gaussians=gaussians), views))


def test_a_prediction_without_points_or_of_another_size_is_refused():
    prediction, views = wall_prediction(width=14, height=14)
    nowhere = prediction.gaussians.map(lambda values: values * torch.nan)
    with pytest.raises(InputError, match="no depth could be found"):
        assemble(replace(prediction, gaussians=nowhere), views)
    with pytest.raises(ValueError, match="gaussians: expected 392"):
        assemble(replace(prediction, gaussians=prediction.gaussians.map(lambda v: v[1:])), views)
    with pytest.raises(ValueError, match="finite poses"):
        assemble(replace(prediction, viewmats=prediction.viewmats * torch.nan), views)


@pytest.mark.parametrize("num_atoms", [0, 1, 5, 8, 40])
@pytest.mark.parametrize("top_m", [1, 8])
def test_sparse_weights_are_the_largest_and_sum_to_one(num_atoms, top_m):
    dense = torch.rand(50, num_atoms, generator=torch.Generator().manual_seed(num_atoms))
    ids, values = sparse_weights(dense, top_m)
    assert ids.shape == values.shape == (50, min(top_m, num_atoms))
    if num_atoms == 0:
        return
    twin = torch.zeros_like(dense)
    for row in range(50):
        for atom in sorted(range(num_atoms), key=lambda k: -float(dense[row, k]))[:top_m]:
            twin[row, atom] = dense[row, atom]
    twin = twin / twin.sum(-1, keepdim=True)
    # float32 sums of at most 40 terms.
    assert torch.allclose(torch.zeros_like(dense).scatter_add(1, ids, values), twin, atol=1e-6)


def test_weights_without_sum_or_finite_value_carry_nothing():
    nan, inf = torch.nan, torch.inf
    dense = torch.tensor([[0, 0, 0], [nan, 0.5, 0.5], [0.5, inf, 0.5], [-inf, 0.5, 0.5], [0.5, -1, 0.5]])
    ids, values = sparse_weights(dense, 2)
    assert values.sum(-1).tolist() == [0.0, 0.0, 0.0, 0.0, 1.0]
    assert sorted(ids[4].tolist()) == [0, 2]


def test_tensors_of_inference_become_plain_ones():
    with torch.inference_mode():
        prediction, views = wall_prediction(width=14, height=14)
    scene = assemble(prediction, views)
    tensors = (
        scene.gaussians.means,
        scene.gaussians.sh,
        scene.semantics.weight_values,
        scene.viewmats,
        scene.Ks,
    )
    assert not any(values.is_inference() for values in tensors)
    scene.gaussians.means.requires_grad_()  # as fitting and tests of gradients do


def test_no_group_survived():
    prediction, views = wall_prediction(width=14, height=14)
    scene = assemble(
        replace(prediction, weights=prediction.weights[:, :0], dictionary=prediction.dictionary[:0]), views
    )
    check_scene(scene)
    assert scene.semantics.num_atoms == 0 and scene.semantics.weight_ids.shape == (2 * 14 * 14, 0)


def test_a_view_without_a_place_leaves_no_trace():
    """Three photos of which the middle one is lost: the scene is that of the other two."""
    prediction, views = wall_prediction(num_views=3)
    lost = replace(
        prediction, unplaced=(1,), depths=prediction.depths * torch.tensor([1.0, 9, 1])[:, None, None]
    )
    scene = assemble(lost, views)
    check_scene(scene)
    per_view = views.size[0] * views.size[1]
    assert scene.num_views == 2 and scene.record.photos == ("0.jpg", "2.jpg")
    assert scene.photos == (views.sources[0], views.sources[2])
    assert views_of(scene) == [per_view, per_view]  # nothing was "seen through"
    assert torch.allclose(scene.viewmats[1, :3, :3], prediction.viewmats[2, :3, :3])
    rows = torch.cat((torch.arange(per_view), torch.arange(2 * per_view, 3 * per_view)))
    unit = scene.record.network_unit
    assert unit is not None
    assert torch.allclose(scene.gaussians.means * unit, prediction.gaussians.means[rows], atol=1e-5)
