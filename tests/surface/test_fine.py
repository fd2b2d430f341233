"""From predictions to fine scenes: one light, colours that make the photos, and a record of both."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from langflash_core.base.detail import DETAILS
from langflash_core.scene.checks import check_scene
from langflash_core.scene.exposure import lit_camera
from langflash_core.splat import render
from langflash_core.surface import fine as module
from langflash_core.surface.detailed import assemble_detailed
from langflash_core.surface.exposure_compensation import ExposureCompensation
from langflash_core.surface.fine import _overlap_notes, coloured_scene, covered_scene
from langflash_core.surface.settings import COLOURS, LAYERS
from langflash_core.types import Camera, Scene
from tests.scene.photographed import GRID, Photographed, photographed, png
from tests.torch_threads import torch_threads

NORMAL = DETAILS["normal"]


def made(given: Photographed) -> tuple[Scene, ExposureCompensation]:
    covered = covered_scene(given.prediction, given.views, NORMAL, gaussians=None, preset="mini")
    return coloured_scene(covered), covered.light


@pytest.fixture(scope="module")
def given() -> Photographed:
    return photographed()


@pytest.fixture(scope="module")
def fine(given) -> tuple[Scene, ExposureCompensation]:
    return made(given)


def difference(scene: Scene, view: int, photo: Tensor) -> float:
    """dB of the picture at a photo's place."""
    drawn = render(scene, scene.camera(view, photo.shape[-1], photo.shape[-2]), weight_maps=False).rgb
    return -10 * float((drawn.movedim(-1, 0) - photo).square().mean().log10())


def shown(scene: Scene, camera: Camera) -> Tensor:
    """(3, h, w)."""
    return render(scene, camera, weight_maps=False).rgb.movedim(-1, 0).clamp(0, 1)


@pytest.mark.parametrize("ratios", [(3,), (3, 1, 2.2)])
def test_pictures_at_the_photos_places_are_nearer_to_them_than_with_copied_colours(ratios):
    """Also of photos of different sizes: sources are never enlarged, so those of one shape may be of any."""
    given = photographed(len(ratios), ratios)
    scene, light = made(given)
    check_scene(scene)
    photos = [light.correct_photos(photo, view=v).clamp(0, 1) for v, photo in enumerate(given.photos)]
    lit = replace(given.views, images=light.correct_photos(given.views.images).clamp(0, 1))
    copied = assemble_detailed(given.prediction, lit, photos, NORMAL)
    assert torch.equal(copied.gaussians.means, scene.gaussians.means)
    for view, photo in enumerate(photos):
        assert difference(scene, view, photo) > difference(copied, view, photo) + 0.5


@pytest.mark.parametrize("edge", [16, 19])
def test_a_plain_thing_before_a_plain_wall_ends_where_it_ends(edge):
    """Nothing but the edge asks for small elements. Elements of a pixel blur by one, the ground of 4 pixels
    below them (.72 sides) by some more; a largest square would reach 40 across."""
    given = photographed(1, screen=False)
    depths, photo = torch.full((1, *GRID), 3.0), torch.full((3, 90, 120), 0.8)
    depths[..., :edge], photo[..., : 3 * edge] = 1.5, 0.2
    views = replace(given.views, images=photo[None, :, 1::3, 1::3], sources=(png(photo),))
    scene, _ = made(replace(given, prediction=replace(given.prediction, depths=depths), views=views))
    drawn = render(scene, scene.camera(0, 120, 90), weight_maps=False).rgb.movedim(-1, 0)
    off = (drawn - photo).abs().amax(0)[16:-16].mean(0)
    assert float(off[: 3 * edge - 6].max()) < 0.05 and float(off[3 * edge + 6 : -4].max()) < 0.05


def test_a_scene_and_its_record_are_whole(given, fine):
    scene, _ = fine
    check_scene(scene)
    detail, count = scene.record.detail, len(scene.gaussians)
    assert detail["elements"] == detail["coarse"] + detail["fine"] == count
    assert scene.levels is not None and int(scene.levels.sum()) == detail["fine"]
    assert detail["rounds"] == COLOURS.rounds and len(detail["photos_psnr_db"]) == 2
    # Told of what is drawn, with each pixel's light made 1; so over black a little is lost at the borders.
    assert detail["photos_psnr_db"][0] > difference(scene, 0, given.photos[0]) - 1
    assert list(scene.record.cost.timings) == ["encoder", "assembly", "colours", "pruning"]
    assert scene.record.pruning["gaussians_after"] == scene.record.pruning["gaussians_before"] == count
    assert scene.record.preset == "mini" and scene.view_ids is not None and scene.confidences is not None


def test_light_is_recorded_where_it_is_not_the_identity():
    alone, light = made(photographed(1))
    assert alone.record.light == {} and torch.equal(light.gains, torch.ones(1, 3).double())
    assert not alone.layered
    scene, light = made(photographed(gains=(1.0, 0.7)))
    assert scene.record.light == light.stored()
    gains = torch.tensor(scene.record.light["gains"])
    offsets = torch.tensor(scene.record.light["offsets"])
    middle = gains * torch.tensor([0.6, 0.42])[:, None] + offsets  # the wall's grey in both
    assert torch.allclose(middle[0], middle[1], atol=0.03)  # half of the robust sum's sigma


def test_pictures_at_the_photos_places_have_the_photos_light():
    """Two photos, half a stop apart: what would be white in the dark one is beyond it in the light of both.
    Without the light of the place each picture is a quarter of a stop off."""
    given = photographed(gains=(1.2, 0.84))
    scene, light = made(given)
    assert float(light.span[1].max()) > 1.05
    for view, photo in enumerate(given.photos):
        camera = scene.camera(view, photo.shape[-1], photo.shape[-2])
        near, far = (
            -10 * float((shown(scene, of) - photo.clamp(0, 1)).square().mean().log10())
            for of in (lit_camera(scene, camera), camera)
        )
        assert near > far + 3  # 4.3 and 6.0; the greys of the screen are off by less
        # Over black here, and with a little of the other photo's layer.
        assert near == pytest.approx(scene.record.detail["photos_psnr_db"][view], abs=1)


def test_photos_without_sources_are_brought_to_one_light_once():
    given = photographed(gains=(1.2, 0.84), ratio=1)
    bare = replace(given, views=replace(given.views, sources=()))
    scenes = [made(each)[0] for each in (given, bare)]
    shown_by = [shown(scene, lit_camera(scene, scene.camera(1))) for scene in scenes]
    assert (shown_by[0] - shown_by[1]).abs().mean() < 1 / 255  # photos of the sources have 8 bits


def test_a_view_without_a_place_leaves_no_trace():
    given = photographed(3)
    scene, light = made(replace(given, prediction=replace(given.prediction, unplaced=(1,))))
    assert scene.num_views == 2 and scene.record.photos == ("0.png", "2.png")
    assert light.gains.shape == (2, 3) and len(scene.record.detail["photos_psnr_db"]) == 2
    check_scene(scene)


@pytest.mark.parametrize("smaller", [True, False])
def test_without_finer_photos_the_network_s_own_do(smaller):
    """Sources smaller than the grid, or none."""
    given = photographed(1, ratio=0.5)
    views = given.views if smaller else replace(given.views, sources=())
    scene, _ = made(replace(given, views=views))
    check_scene(scene)
    assert scene.record.detail["photo_size"] == [GRID[1], GRID[0]]


def test_the_number_asked_for_is_kept():
    given = photographed(screen=False, busy=True)
    scene = coloured_scene(
        covered_scene(given.prediction, given.views, NORMAL, gaussians=4000, preset="mini")
    )
    assert abs(len(scene.gaussians) - 4000) < 400
    assert scene.record.detail["asked"] == 4000


def with_somebody(given: Photographed, view: int) -> Photographed:
    """Somebody red stands before one of the photos, at half the depth of the wall."""
    depths, images = given.prediction.depths.clone(), given.views.images.clone()
    depths[view, 5:27, 2:12] = 1.5
    photo = given.photos[view].clone()
    photo[:, 15:81, 6:36] = torch.tensor([0.9, 0.1, 0.1])[:, None, None]
    images[view] = torch.nn.functional.interpolate(photo[None], GRID, mode="area")[0]
    sources = tuple(png(photo) if v == view else source for v, source in enumerate(given.views.sources))
    views = replace(given.views, images=images, sources=sources)
    return replace(given, prediction=replace(given.prediction, depths=depths), views=views)


def test_somebody_before_one_photo_leaves_no_trace_in_the_scene():
    given = photographed(4)
    scene, light = made(with_somebody(given, 2))
    shares = scene.record.left_out["shares"]
    assert [share > 0 for share in shares] == [False, False, True, False]
    said = [warning for warning in scene.record.warnings if "left out" in warning]
    here = f"{round(100 * shares[2])} % of {given.views.names[2]}"
    assert said == [f"{here} disagrees with the other photos and was left out"]
    drawn = render(scene, scene.camera(2, 120, 90), weight_maps=False).rgb.movedim(-1, 0)
    behind = light.correct_photos(given.photos[2], view=2)[:, 15:81, 6:36]
    # .4 with somebody there; the borders of the hole are soft, and the others' layers fill the rest.
    assert float((drawn[:, 15:81, 6:36] - behind).abs().mean()) < 0.1


def test_what_several_photos_show_alone_is_said_in_number_and_by_name():
    said = _overlap_notes({"shares": [0.42, 0.0, 0.16]}, ("a.jpg", "b.jpg", "c.jpg"))
    shown = "42 % of a.jpg, 16 % of c.jpg disagree with the other photos and were left out"
    assert said == [shown] and _overlap_notes({}, ("a.jpg",)) == []


def test_of_two_photos_nothing_is_left_out():
    scene, _ = made(with_somebody(photographed(2), 1))
    assert scene.record.left_out == {}
    assert not any("left out" in warning for warning in scene.record.warnings)


def test_equal_calls_give_equal_scenes(given, fine):
    first, second = fine[0], made(given)[0]
    assert first.record.light == second.record.light and first.record.detail == second.record.detail
    for name, values in vars(first.gaussians).items():
        assert torch.equal(values, getattr(second.gaussians, name)), name
    assert torch.equal(first.semantics.weight_values, second.semantics.weight_values)
    assert torch.equal(first.semantics.weight_ids, second.semantics.weight_ids)


def test_nothing_of_it_asks_for_gradients():
    given = photographed(1)
    weights = given.prediction.weights.clone().requires_grad_()
    scene, _ = made(replace(given, prediction=replace(given.prediction, weights=weights)))
    assert not scene.semantics.weight_values.requires_grad


def test_colours_of_layers_are_the_same_with_several_threads(given):
    covered = covered_scene(given.prediction, given.views, NORMAL, gaussians=None, preset="mini")
    colours = []
    for threads in (1, 2):  # each layer's are solved with one
        with torch_threads(threads):
            colours.append(coloured_scene(covered).gaussians.sh)
    # What is done of all layers at once, with several threads, are sums of two products.
    assert torch.allclose(*colours, rtol=0, atol=1e-6)


def test_of_many_photos_those_all_over_the_walk_keep_a_layer(monkeypatch):
    """Three of five that stand in a row: the first, the last and the middle one."""
    monkeypatch.setattr(module, "LAYERS", replace(LAYERS, most=3))
    scene, _ = made(photographed(5))
    check_scene(scene)
    assert scene.view_ids is not None and scene.view_ids.unique().tolist() == [0, 2, 4]
    assert scene.num_views == 5 and len(scene.record.detail["photos_psnr_db"]) == 3
