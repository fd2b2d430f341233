"""Scenes as fine as their photos: what they hold, how many, and bad numbers on the way."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from langflash_core.base.detail import DETAILS, Detail
from langflash_core.errors import InputError
from langflash_core.scene.checks import check_scene
from langflash_core.splat.reference import render
from langflash_core.surface.detailed import _spending_record, assemble_detailed, working_photo, working_size
from langflash_core.surface.elements import under
from langflash_core.types import Camera, Scene
from tests.scene.photographed import GRID, Photographed, photographed

LOW, NORMAL, HIGH = (DETAILS[name] for name in ("low", "normal", "high"))


def made(given: Photographed, detail: Detail = NORMAL, **options) -> Scene:
    photos = [working_photo(photo, GRID) for photo in given.photos]
    return assemble_detailed(given.prediction, given.views, photos, detail, **options)


@pytest.fixture(scope="module")
def given() -> Photographed:
    return photographed()


@pytest.fixture(scope="module")
def scene(given) -> Scene:
    return made(given)


def test_a_scene_is_whole(given, scene):
    check_scene(scene)
    count = len(scene.gaussians)
    assert scene.num_views == 2 and scene.view_size == (GRID[1], GRID[0])
    assert scene.photos == given.views.sources
    assert (
        scene.levels is not None
        and scene.levels.shape == (count,)
        and scene.levels.unique().tolist() == [0, 1]
    )
    assert scene.view_ids is not None and bool((scene.view_ids.diff() >= 0).all())
    assert scene.view_ids.unique().tolist() == [0, 1]
    assert scene.confidences is not None
    assert torch.equal(scene.confidences, torch.full((count,), 0.9))  # as all cells have it
    assert scene.semantics.weight_ids.shape[0] == count
    # Renormalised sums of 6 float32.
    assert torch.allclose(scene.semantics.weight_values.sum(-1), torch.ones(count), atol=1e-5)


def test_confidences_are_those_of_the_cells(given):
    """One that differs from cell to cell comes back as the same numbers, clamped."""
    maps = torch.linspace(-0.2, 1.2, 2 * GRID[0] * GRID[1]).view(2, *GRID)
    scene = made(replace(given, prediction=replace(given.prediction, confidences=maps)))
    assert scene.confidences is not None and scene.view_ids is not None
    assert bool(torch.isin(scene.confidences, maps.clamp(0, 1)).all())
    assert float(scene.confidences.min()) == 0 and float(scene.confidences.max()) == 1
    assert float(scene.confidences[scene.view_ids == 0].max()) < float(maps[0].max()) + 1e-6


def test_the_record_adds_up(given, scene):
    record, count = scene.record, len(scene.gaussians)
    detail = record.detail
    assert scene.levels is not None
    assert (detail["level"], detail["elements"], detail["photo_size"]) == ("normal", count, [120, 90])
    assert detail["asked"] == round(NORMAL.most * GRID[0] * GRID[1] * 2)
    assert detail["coarse"] + detail["fine"] == count
    assert detail["fine"] == int(scene.levels.sum()) == detail["by_size"]["1"] + detail["by_size"]["2"]
    goes_on_behind = count - sum(detail["by_size"].values())
    assert 0 < goes_on_behind < detail["coarse"]  # beside the screen
    cells = 2 * GRID[0] * GRID[1]
    assert record.counts == {"predicted": cells, "covered": cells}
    assert record.layered
    assert record.photos == ("0.png", "1.png")
    assert record.warnings == ("of triage", "a note of the network")
    assert list(record.cost.timings) == ["encoder", "assembly"]


def test_what_goes_on_under_others_is_no_square_of_a_size():
    """Of seven cells of 16 / 7 pixels each it is 16 pixels wide, as the largest squares are."""
    behind = under(torch.ones(7, 7).triu().log1p(), torch.rand(3, 7, 7), (16, 16))
    assert len(behind) and torch.allclose(behind.sides, torch.tensor(16.0))
    assert not any(_spending_record(behind, NORMAL, 1, (16, 16))["by_size"].values())


def test_a_wall_alone_needs_nothing_behind_it():
    scene = made(photographed(screen=False))
    assert sum(scene.record.detail["by_size"].values()) == len(scene.gaussians)


def test_more_is_finer():
    given = photographed(busy=True)
    counts = [len(made(given, detail).gaussians) for detail in (LOW, NORMAL, HIGH)]
    assert counts == sorted(set(counts))


@pytest.mark.parametrize("asked", [1500, 2500, 5000])
def test_as_many_as_were_asked_for_where_there_is_detail_enough(asked):
    """The ground beneath what is parted is counted in by two more tries; without a screen nothing must be."""
    scene = made(photographed(screen=False, busy=True), HIGH, gaussians=asked)
    assert scene.record.detail["asked"] == asked
    assert abs(len(scene.gaussians) - asked) < 0.1 * asked


def test_a_photo_without_detail_needs_few():
    given = photographed(screen=False)
    plain = [torch.full_like(photo, 0.5) for photo in given.photos]
    scene = made(replace(given, photos=plain), HIGH)
    # Squares of 16 pixels of 120 x 90 in each photo, and of 8 and 4 along their borders.
    assert len(scene.gaussians) < 400
    assert scene.levels is not None and not scene.levels.any()


@pytest.mark.parametrize("eye", [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, -0.1, 0.3)])
def test_the_coarse_level_alone_is_closed(scene, eye):
    """Wherever the whole scene is, from the first photo's place and from aside, at the photo's size; but for
    the outermost pixels, beyond which nothing lies that would add to them."""
    unit = scene.record.network_unit
    assert unit is not None and scene.levels is not None
    viewmat = torch.eye(4)
    viewmat[:3, 3] = -torch.tensor(eye) / unit
    camera = Camera(viewmat, scene.Ks[0], GRID[1], GRID[0]).with_size(120, 90)
    coarsest = scene.rows(scene.levels == 0)
    whole, coarse = (render(s, camera, weight_maps=False).alphas[1:-1, 1:-1] for s in (scene, coarsest))
    assert float((whole >= 0.97).float().mean()) > 0.75
    assert bool((coarse[whole >= 0.97] >= 0.97).all())


def test_a_view_without_a_place_leaves_no_trace():
    """The middle one of three is lost: the scene is that of the other two, to the bit."""
    given = photographed(3)
    others = [0, 2]
    alone = Photographed(
        replace(
            given.prediction,
            weights=given.prediction.weights[others],
            viewmats=given.prediction.viewmats[others],
            depths=given.prediction.depths[others],
            confidences=given.prediction.confidences[others],
        ),
        replace(
            given.views,
            images=given.views.images[others],
            Ks=given.views.Ks[others],
            names=("0.png", "2.png"),
            sources=tuple(given.views.sources[v] for v in others),
        ),
        [given.photos[v] for v in others],
    )
    depths = given.prediction.depths * torch.tensor([1.0, 9, 1])[:, None, None]
    scene = made(replace(given, prediction=replace(given.prediction, unplaced=(1,), depths=depths)))
    assert scene.num_views == 2 and scene.record.photos == ("0.png", "2.png")
    assert_same(scene, made(alone))


def assert_same(first: Scene, second: Scene) -> None:
    """To the bit."""
    assert first.record.detail == second.record.detail and first.record.light == second.record.light
    for name, values in tensors(first).items():
        assert torch.equal(values, tensors(second)[name]), name


def tensors(scene: Scene) -> dict[str, Tensor]:
    parts = (scene, scene.gaussians, scene.semantics)
    return {
        name: values for part in parts for name, values in vars(part).items() if isinstance(values, Tensor)
    }


@pytest.mark.parametrize("bad", [torch.nan, torch.inf, -torch.inf, 0.0, -1.0])
def test_depths_that_are_no_depths_leave_holes_and_no_bad_number(bad):
    """Elements as small as in a photo full of detail reach a few pixels into a hole of 10 x 15 cells."""
    given = photographed(screen=False, busy=True)
    depths = given.prediction.depths.clone()
    depths[0, 5:15, 5:20] = bad
    depths[1, :, -3:] = bad
    scene = made(replace(given, prediction=replace(given.prediction, depths=depths)), HIGH)
    check_scene(scene)
    drawn = render(scene.rows(scene.view_ids == 0), scene.camera(0), weight_maps=False).alphas
    assert float(drawn[8:12, 8:17].max()) < 0.03 and float(drawn[18:-3, 5:20].min()) > 0.97


def test_a_prediction_without_a_usable_depth_or_pose_is_refused(given):
    nowhere = replace(given.prediction, depths=given.prediction.depths * torch.nan)
    with pytest.raises(InputError, match="no depth could be found"):
        made(replace(given, prediction=nowhere))
    first = given.prediction.depths * torch.tensor([torch.nan, 1.0])[:, None, None]
    with pytest.raises(InputError, match="no depth could be found"):
        made(replace(given, prediction=replace(given.prediction, depths=first)))
    with pytest.raises(ValueError, match="finite poses"):
        made(
            replace(
                given, prediction=replace(given.prediction, viewmats=given.prediction.viewmats * torch.nan)
            )
        )


def test_no_group_survived(given):
    none = replace(
        given.prediction, weights=given.prediction.weights[:, :0], dictionary=given.prediction.dictionary[:0]
    )
    scene = made(replace(given, prediction=none))
    check_scene(scene)
    assert scene.semantics.num_atoms == 0 and scene.semantics.weight_ids.shape == (len(scene.gaussians), 0)


def test_a_group_without_direction_carries_nothing(given):
    spoiled = given.prediction.dictionary.clone()
    spoiled[2], spoiled[4] = torch.nan, 0
    scene = made(replace(given, prediction=replace(given.prediction, dictionary=spoiled)))
    check_scene(scene)
    assert scene.semantics.num_atoms == 4


@pytest.mark.parametrize("ratio", [0.5, 1, 2.2, 5])
def test_photos_of_any_size(ratio):
    scene = made(photographed(ratio=ratio))
    check_scene(scene)
    size = {0.5: (30, 40), 1: (30, 40), 2.2: (66, 88), 5: (90, 120)}[ratio]
    assert scene.record.detail["photo_size"] == [size[1], size[0]]
    # A largest square and a half from the corners, where fewer lie around.
    assert float(render(scene, scene.camera(0), weight_maps=False).alphas[8:-8, 8:-8].min()) > 0.99


@pytest.mark.parametrize(
    ("photo", "expected"),
    [
        ((30, 40), (30, 40)),
        ((15, 20), (30, 40)),
        ((60, 80), (60, 80)),
        ((90, 120), (90, 120)),
        ((300, 400), (90, 120)),
    ],
)
def test_the_size_at_which_a_photo_is_used(photo, expected):
    assert working_size(photo, GRID) == expected
    drawn = torch.rand(3, *photo, generator=torch.Generator().manual_seed(0))
    sized = working_photo(drawn, GRID)
    assert sized.shape[-2:] == expected and float(sized.min()) >= 0 and float(sized.max()) <= 1
    assert (sized is drawn) == (photo == expected)


def test_the_unit_of_the_network_does_not_show(given, scene):
    """The same depths in metres and in thousands of them: the same scene but for float32 rounding."""
    viewmats = given.prediction.viewmats.clone()
    viewmats[:, :3, 3] *= 1000
    big = replace(given.prediction, viewmats=viewmats, depths=given.prediction.depths * 1000)
    other = made(replace(given, prediction=big))
    assert other.record.detail == scene.record.detail
    assert torch.allclose(other.gaussians.means, scene.gaussians.means, atol=1e-5)
    assert torch.allclose(other.gaussians.scales, scene.gaussians.scales, atol=1e-5)


def test_every_photo_is_told_and_may_be_the_last(given):
    told: list[float] = []
    made(given, progress=told.append)
    assert len(told) == 2 * 2 and told == sorted(told) and told[0] == 0 and told[-1] < 1

    def stop(done: float) -> None:
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        made(given, progress=stop)
