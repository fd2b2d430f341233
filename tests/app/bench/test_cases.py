"""Scenes, dictionaries and camera paths that the bench makes."""

import pytest
import torch

from app.bench import generated, generated_atoms_case, paper_cases, scene_case, synthetic_case
from app.bench.paths import ARC_STEP, camera_path
from langflash_core.errors import InputError, PromptError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.splat import render
from tests.splat.scenes import cloud


def test_a_path_between_views_ends_at_them():
    room = generated.room(10, (64, 48))
    path = camera_path(room, (32, 24), 4)
    assert path.num_frames == 4 and len(path.cameras) == 5
    for camera, view in ((path.cameras[0], 0), (path.cameras[-1], 1)):
        expected = room.camera(view, 32, 24)
        assert torch.allclose(camera.viewmat.float(), expected.viewmat, atol=1e-6)
        assert torch.allclose(camera.K.float(), expected.K)
        assert (camera.width, camera.height) == (32, 24)
    degrees, way = path.step()
    assert degrees == pytest.approx(12 / 4, rel=1e-4) and way == pytest.approx(0.4 / 4, rel=1e-4)


def test_a_single_view_is_circled():
    scene = cloud(200)
    path = camera_path(scene, (40, 40), 6)
    degrees, _ = path.step()
    assert degrees == pytest.approx(ARC_STEP, rel=1e-6)
    depth = scene.gaussians.means[:, 2].median()
    pivot = torch.tensor([0.0, 0.0, float(depth)], dtype=torch.float64)
    for camera in path.cameras:
        centre = invert_rigid(camera.viewmat)[:3, 3]
        assert (centre - pivot).norm() == pytest.approx(float(depth), rel=1e-6)
    assert torch.allclose(path.cameras[3].viewmat, scene.viewmats[0].double(), atol=1e-12)  # the middle


def test_a_generated_room_fills_both_views():
    scene = generated.with_atoms(generated.room(3001, (64, 48)), 20)
    assert len(scene.gaussians) == 3001 and scene.semantics.num_atoms == 20
    sums = scene.semantics.weight_values.sum(-1)
    assert torch.allclose(sums, torch.ones_like(sums))
    assert scene.semantics.weight_values[:, 0].mean() < 0.95  # mixed, not one atom each
    for view in (0, 1):
        frame = render(scene, scene.camera(view), weight_maps=False)
        assert frame.alphas.mean() > 0.9
    near = (scene.gaussians.means[:, None] - scene.gaussians.means[None, :50]).norm(dim=-1)
    closest = near.masked_fill(near == 0, 9).argmin(0)
    dense = scene.semantics.dense_weights()
    # Smooth: the nearest neighbour's weights differ less than those of a Gaussian drawn by lot.
    assert (dense[closest] - dense[:50]).abs().sum(-1).mean() < 0.5 * (
        dense[1000:1050] - dense[:50]
    ).abs().sum(-1).mean()


def test_spread_is_a_factor_of_the_widths():
    one, three = (generated.room(100, (64, 48), spread) for spread in (1.0, 3.0))
    assert torch.allclose(3 * one.gaussians.scales, three.gaussians.scales)


@pytest.mark.parametrize("num_gaussians, num_atoms", [(1, 1), (2, 5), (40, 200)])
def test_few_gaussians_and_many_atoms(num_gaussians, num_atoms):
    case = synthetic_case(num_gaussians, num_atoms, (16, 12), 1)
    assert case.compiled.factor.shape == (num_atoms, min(num_atoms, generated.CHANNELS))
    assert torch.isfinite(case.scene.semantics.weight_values).all()


def test_the_paper_has_four_cases():
    cases = paper_cases(50, 8, None, 1, 1.0)
    assert [(c.size, len(c.compiled.texts)) for c in cases] == [
        ((988, 731), 1), ((988, 731), 8), ((1920, 1080), 1), ((1920, 1080), 8),
    ]  # fmt: skip


def test_atoms_are_for_scenes_without():
    bare = generated.room(50, (16, 12))
    case = generated_atoms_case("bare", bare, 6, None, 2)
    assert case.scene.semantics.num_atoms == 6 and "generated" in case.notes[0]
    with pytest.raises(InputError, match="atoms of its own"):
        generated_atoms_case("own", cloud(50), 6, None, 2)
    with pytest.raises(InputError, match="--atoms 64"):
        scene_case("bare", bare, None, 2, None)


def test_an_empty_scene_and_too_many_phrases_are_refused():
    scene = cloud(20)
    empty = scene.rows(torch.zeros(len(scene.gaussians), dtype=torch.bool))
    with pytest.raises(InputError, match="no Gaussians"):
        scene_case("empty", empty, None, 2, None)
    with pytest.raises(PromptError, match="at most 16"):
        scene_case("many", cloud(20), None, 2, ["chair"] * 17)
