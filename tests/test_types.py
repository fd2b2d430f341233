"""The dataclasses that cross stages: the little arithmetic they own."""

from dataclasses import replace

import pytest
import torch

from langflash_core.base.resources import asset_path, shader_path
from langflash_core.types import Camera, Gaussians, Record, Scene, Semantics
from tests.splat.scenes import unturned


def test_a_resized_camera_sees_the_same_rays():
    K = torch.tensor([[50.0, 0, 17], [0, 60.0, 13], [0, 0, 1]])
    camera = Camera(torch.eye(4), K, 40, 30).with_size(80, 90)
    assert (camera.width, camera.height) == (80, 90)
    assert torch.allclose(camera.K, torch.tensor([[100.0, 0, 34], [0, 180.0, 39], [0, 0, 1]]))


def test_dense_weights_add_repeated_atoms():
    ids = torch.tensor([[0, 2], [1, 1]])
    values = torch.tensor([[0.75, 0.25], [0.5, 0.5]])
    semantics = Semantics(ids, values, torch.eye(3), "minilm")
    assert semantics.dense_weights().tolist() == [[0.75, 0, 0.25], [0, 1, 0]]


def test_no_atoms_give_an_empty_matrix():
    semantics = Semantics(
        torch.zeros(4, 0, dtype=torch.int64), torch.zeros(4, 0), torch.zeros(0, 8), "minilm"
    )
    assert semantics.dense_weights().shape == (4, 0)


def made(count: int = 4, **changes) -> Scene:
    """Two views, three atoms; Gaussian i lies at x = i."""
    means = torch.arange(count)[:, None] * torch.tensor([1.0, 0, 0])
    gaussians = replace(unturned(means, 1.0), opacities=torch.linspace(0, 1, count))
    semantics = Semantics(torch.arange(count)[:, None] % 3, torch.ones(count, 1), torch.eye(3), "minilm")
    whole = {
        "viewmats": torch.eye(4).repeat(2, 1, 1),
        "Ks": torch.eye(3).repeat(2, 1, 1),
        "view_size": (4, 3),
        "photos": (b"a", b"b"),
        "view_ids": torch.arange(count) % 2,
        "levels": (torch.arange(count) % 2).to(torch.uint8),
        "confidences": torch.arange(count) / max(count, 1),
    }
    return Scene(gaussians, semantics, **{**whole, **changes})


@pytest.mark.parametrize(
    ("views", "most", "chosen"), [(1, 4, [0]), (4, 4, [0, 1, 2, 3]), (9, 4, [0, 2, 4, 6])]
)
def test_some_views_are_spread_over_all(views, most, chosen):
    viewmats, Ks = torch.eye(4).repeat(views, 1, 1), torch.eye(3).repeat(views, 1, 1)
    scene = made(viewmats=viewmats, Ks=Ks, photos=(), view_ids=None)
    assert scene.some_views(most) == chosen


def test_a_record_is_replaced_not_changed():
    scene = made(record=Record(preset="mini"))
    assert scene.with_record(metric_scale=2.0).record == Record(preset="mini", metric_scale=2.0)
    assert scene.record == Record(preset="mini")
    assert scene.camera(0, 8, 6).K[0, 0] == 2
    with pytest.raises(TypeError, match="colour"):
        scene.with_record(colour="red")


@pytest.mark.parametrize(
    "keep",
    [torch.tensor([False, True, False, True]), torch.tensor([3, 1]), torch.tensor([], dtype=torch.int64)],
)
def test_rows_take_every_field_along(keep):
    scene = made()
    part = scene.rows(keep)
    rows = keep.nonzero()[:, 0].tolist() if keep.dtype == torch.bool else keep.tolist()
    assert part.gaussians.means[:, 0].tolist() == rows
    assert part.gaussians.opacities.tolist() == [scene.gaussians.opacities[row].item() for row in rows]
    assert part.semantics.weight_ids[:, 0].tolist() == [row % 3 for row in rows]
    assert part.view_ids is not None and part.view_ids.tolist() == [row % 2 for row in rows]
    assert part.semantics.dictionary is scene.semantics.dictionary and part.photos is scene.photos
    assert part.levels is not None and part.levels.tolist() == [row % 2 for row in rows]
    assert part.confidences is not None and part.confidences.tolist() == [row / 4 for row in rows]
    unknown = made(view_ids=None, levels=None, confidences=None).rows(keep)
    assert unknown.view_ids is None and unknown.levels is None and unknown.confidences is None


@pytest.mark.parametrize(
    ("keep", "words"),
    [
        (torch.ones(3, dtype=torch.bool), r"keep: expected shape \(4,\), received \(3,\)"),
        (torch.tensor([0.0, 1.0]), "keep: expected .* bool or .* int64, received torch.float32"),
        (torch.tensor([[True]]), "keep: expected"),
        (torch.tensor([-1]), r"keep: expected values in \[0, 4\), received -1 to -1"),
        (torch.tensor([4]), "received 4 to 4"),
    ],
)
def test_rows_that_are_not_there_are_refused(keep, words, unchecked):
    with pytest.raises(ValueError, match=words):
        made().rows(keep)


def _gaussians(**changes) -> Gaussians:
    return replace(made().gaussians, **changes)


def _semantics(**changes) -> Semantics:
    return replace(made().semantics, **changes)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: _gaussians(quats=torch.zeros(3, 4)), "quats: expected shape .4, 4., received .3, 4."),
        (lambda: _gaussians(opacities=torch.zeros(4, 1)), "opacities: expected shape"),
        (lambda: _gaussians(sh=torch.zeros(4, 3)), "sh: expected shape"),
        (lambda: _semantics(weight_values=torch.zeros(4, 2)), "weight_values: expected shape"),
        (lambda: _semantics(weight_ids=torch.full((4, 1), 3)), r"weight_ids: expected values in \[0, 3\)"),
        (
            lambda: _semantics(weight_ids=torch.zeros(4, 1)),
            "weight_ids: expected int64",
        ),
        (lambda: _semantics(dictionary=torch.zeros(3)), "dictionary: expected"),
        (lambda: replace(made(), gaussians=made(3).gaussians), "weight_ids: expected 3 rows"),
        (lambda: made(viewmats=torch.eye(4)), "viewmats: expected shape"),
        (lambda: made(Ks=torch.eye(3)[None]), "Ks: expected shape"),
        (lambda: made(view_size=(4, 0)), "views: expected"),
        (lambda: made(photos=(b"a",)), "photos: expected 2, one per view, received 1"),
        (lambda: made(view_ids=torch.zeros(3, dtype=torch.int64)), "view_ids: expected shape"),
        (lambda: made(view_ids=torch.full((4,), 2)), r"view_ids: expected values in \[-1, 2\)"),
        (lambda: made(view_ids=torch.full((4,), -2)), r"view_ids: expected values in \[-1, 2\)"),
        (lambda: made(levels=torch.zeros(3, dtype=torch.uint8)), "levels: expected shape"),
        (lambda: made(levels=torch.zeros(4, dtype=torch.int64)), "levels: expected uint8, received"),
        (lambda: made(levels=torch.full((4,), 2, dtype=torch.uint8)), r"levels: expected values in \[0, 2\)"),
        (lambda: made(confidences=torch.zeros(5)), "confidences: expected shape"),
        (lambda: made(confidences=torch.zeros(4, dtype=torch.float64)), "confidences: expected float32"),
        (lambda: made(confidences=torch.full((4,), 1.01)), r"confidences: expected values in \[0, 1\]"),
        (lambda: made(confidences=torch.full((4,), torch.nan)), r"confidences: expected values in \[0, 1\]"),
        (lambda: made(record=Record(silent_atoms=(3,))), "silent_atoms: expected values"),
        (lambda: made(record=Record(atom_names={-1: "a"})), "atom_names: expected values"),
    ],
)
def test_what_does_not_fit_is_refused(wrong, words, unchecked):
    with pytest.raises(ValueError, match=words):
        wrong()


@pytest.mark.parametrize("find", [asset_path, shader_path])
def test_a_missing_resource_names_the_remedy(find):
    with pytest.raises(FileNotFoundError, match="reinstall"):
        find("no/such.file")
