"""The composer, end to end: real photos, the real network, the real text tower, the reference splatter."""

import math
import subprocess
import sys
import weakref
from dataclasses import replace
from pathlib import Path

import pytest
import torch

import langflash_core as lf
from langflash_core.base.records import FoundFocal
from langflash_core.base.resources import asset_path
from langflash_core.errors import Cancelled, ImageError, InputError, PromptError, ViewError, WeightsError
from langflash_core.images.leaving_out import views_without
from langflash_core.images.straight import straighten_views
from langflash_core.language.leads import nearer_threshold
from langflash_core.level import level_scene
from langflash_core.network import PRESETS, GuidedDepthNet, build_network, save_network
from langflash_core.reconstruction import stages
from langflash_core.reconstruction.views import found_views, straight_prediction
from langflash_core.splat import render
from langflash_core.types import Camera, FoundLens, Lenses, Prediction, Scene, Views
from tests.blobs import three_blobs
from tests.torch_threads import torch_threads

SMALL = 112  # pixels: 8 x 8 patches keep a pass below a second
NOTHING = Prediction.of_bent((), "minilm", {})


@pytest.fixture(autouse=True, scope="module")
def one_thread():
    """Passes this small gain little from more threads, and test workers share the machine."""
    with torch_threads(1):
        yield


@pytest.fixture(scope="session")
def weights(tmp_path_factory) -> Path:
    """The shipped checkpoint; where a checkout has none yet, the real network as it is drawn at random."""
    try:
        return asset_path("weights/mini.safetensors")
    except FileNotFoundError:
        torch.manual_seed(0)
        path = tmp_path_factory.mktemp("weights") / "mini.safetensors"
        save_network(build_network(PRESETS["mini"]), path)
        return path


@pytest.fixture(scope="session")
def photos() -> list[Path]:
    return [asset_path("photos/books_left.jpg"), asset_path("photos/books_right.jpg")]


@pytest.fixture(scope="module")
def scene(weights, photos) -> Scene:
    return lf.reconstruct(photos, weights=weights, size=SMALL)


def test_photos_become_a_scene(scene):
    assert scene.num_views == 2
    assert len(scene.gaussians) > 1000
    assert len(scene.photos) == 2
    for values in vars(scene.gaussians).values():
        assert torch.isfinite(values).all()
    # World = camera of view 0; poses are rigid to float32.
    torch.testing.assert_close(scene.viewmats[0], torch.eye(4), rtol=0, atol=1e-6)
    turns = scene.viewmats[:, :3, :3]
    torch.testing.assert_close(turns @ turns.mT, torch.eye(3).expand(2, 3, 3), rtol=0, atol=1e-5)
    width, height = scene.view_size
    assert abs(math.sqrt(width * height) - SMALL) < 14  # of the photo's shape, about the size asked for


def test_the_scene_records_how_it_was_made(scene):
    record, cost = scene.record, scene.record.cost
    assert record.preset == "mini"
    assert record.photos == ("books_left.jpg", "books_right.jpg")
    inside = [stage for stage in GuidedDepthNet.stages if stage != "Gaussians"]  # the scene's own are finer
    stages = ["photos", "weights", *inside, "assembly", "colours", "pruning", "level"]
    assert list(cost.timings) == stages
    assert all(seconds > 0 for seconds in cost.timings.values())
    # The stages are all that is done: between them lie bookkeeping, one copy, and what a busy machine takes.
    assert sum(cost.timings.values()) == pytest.approx(cost.seconds["total"], rel=0.2)
    network = sum(cost.timings[stage] for stage in inside)
    assert network == pytest.approx(cost.seconds["network"], rel=0.2)
    assert sys.platform == "win32" or 100 < (cost.peak_memory_mb or 0) < 100_000
    assert len(set(record.warnings)) == len(record.warnings)


def test_the_scene_is_levelled_beside_its_tensors(scene):
    """By its photos' edges where they tell, else it says that they do not."""
    world = scene.record.world
    assert (world is None) == any("which way is up" in warning for warning in scene.record.warnings)
    again = level_scene(replace(scene, record=replace(scene.record, world=None, warnings=())))
    assert again.record.world == world
    assert again.gaussians is scene.gaussians and again.viewmats is scene.viewmats


def test_the_scene_answers(scene):
    result = lf.query(scene, ["book", "floor"], size=(40, 30))
    assert [a.prompt for a in result.answers] == ["book", "floor"]
    assert result.relevance.shape == result.masks.shape == (2, 30, 40)
    assert ((result.relevance >= 0) & (result.relevance < 1)).all()
    for found, mask in zip(result.answers, result.masks, strict=True):
        assert found.found == bool(mask.any())
        assert found.area == pytest.approx(mask.float().mean().item())


def test_one_photo_and_progress(weights, photos):
    steps = []
    single = lf.reconstruct(
        photos[:1],
        weights=weights,
        size=SMALL,
        fov=60,
        progress=lambda stage, part: steps.append((stage, part)),
    )
    assert single.num_views == 1
    fractions = [fraction for _, fraction in steps]
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)
    told = {stage for stage, _ in steps}
    assert {"photos", "weights", "network", "encoder", "assemble", "done"} <= told
    assert {"light", "elements", "colours", "prune"} <= told


def test_the_weight_maps_of_photos_are_gone_when_colours_are_solved_for(weights, photos, monkeypatch):
    """Five megabytes a photo, of which a hundred are as much as all else; one photo is enough to see it."""
    covered, coloured, maps, left = stages.covered_scene, stages.coloured_scene, [], []

    def remembered(prediction: Prediction, *args, **more):
        maps.append(weakref.ref(prediction.weights))
        return covered(prediction, *args, **more)

    def looked_up(*args):
        left.extend(known() for known in maps)
        return coloured(*args)

    monkeypatch.setattr(stages, "covered_scene", remembered)
    monkeypatch.setattr(stages, "coloured_scene", looked_up)
    lf.reconstruct(photos[:1], weights=weights, size=SMALL)
    assert left == [None]


def test_a_stage_that_leaves_photos_out_gives_the_scene_of_the_others(monkeypatch, weights, photos, scene):
    """Key points of all photos were found beside; those of the others are found again."""
    loaded = stages.load_views
    fewer_views = lambda *args, **kwargs: views_without(loaded(*args, **kwargs), [2])  # noqa: E731
    monkeypatch.setattr(stages, "load_views", fewer_views)
    third = asset_path("photos/aloe_left.jpg")
    fewer = lf.reconstruct([*photos, third], weights=weights, size=SMALL)
    assert fewer.record.photos == scene.record.photos
    assert (fewer.gaussians.means == scene.gaussians.means).all()


def test_the_lens_is_taken(weights, photos):
    wide = lf.reconstruct(photos[:1], weights=weights, size=SMALL, fov=90)
    longer = max(wide.view_size)
    # The photo's shape is fitted to whole patches, which crops at most half a patch a side.
    assert wide.Ks[0, 0, 0].item() == pytest.approx(longer / 2, rel=0.15)


def test_a_warning_of_an_assumed_lens_goes_when_photos_tell_it(unchecked):
    lenses = Lenses((0, 0, 0), (65.0,), (0.35,), (False,), "assumed")
    Ks, images = torch.eye(3).repeat(3, 1, 1), torch.zeros(3, 3, 14, 14)
    views = Views(images, Ks, ("a", "b", "c"), warnings=("dark", "assumed"), lenses=lenses)
    found = replace(NOTHING, Ks=2 * Ks, lenses=(FoundLens(61.0, 0.5, 3, 65.0, False),))
    told = found_views(views, found)
    assert told.warnings == ("dark",) and (told.Ks == 2 * Ks).all()
    [dark, left] = found_views(views, NOTHING).warnings
    assert dark == "dark" and left.startswith("assumed;") and (found_views(views, NOTHING).Ks == Ks).all()


@pytest.mark.parametrize("rounds", [0, 1, 9])
def test_photos_are_straightened_until_nothing_bends(rounds, unchecked):
    """Always from the photos as they were taken, and the last round seeks no bends."""
    lenses = Lenses((0, 0), (65.0,), (0.35,), (False,), "assumed")
    K = torch.tensor([[50.0, 0, 32], [0, 50, 24], [0, 0, 1]])
    taken = Views(torch.rand(2, 3, 48, 64), K.expand(2, 3, 3), ("a", "b"), lenses=lenses)
    seen = list[Views]()

    def predict(views: Views) -> Prediction:
        seen.append(views)
        assert views.lenses is not None
        if len(seen) <= rounds and not views.lenses.straight:
            return Prediction.of_bent(
                (FoundFocal(1.0, 0.01, 2, -0.05 / 4 ** len(seen), 0.001),), "minilm", {}
            )
        return replace(NOTHING, viewmats=torch.eye(4).expand(len(seen), 4, 4))

    predicted, views = straight_prediction(predict, taken)
    assert len(predicted.viewmats) == len(seen) and views is seen[-1] and len(seen) == min(rounds, 3) + 1
    assert views.lenses is not None and views.lenses.straight == (rounds > 3)
    if not rounds:
        assert views is taken
        return
    [bend] = views.lenses.straightened
    total = sum(0.05 / 4 ** (i + 1) for i in range(min(rounds, 3)))
    assert bend is not None and bend.bend == pytest.approx(-total)
    assert torch.equal(views.images, straighten_views(taken, [bend]).images)
    [told] = views.lenses.found([FoundFocal(1.0, 0.01, 2)])
    assert told.bend == bend.bend and "straightened by k1 = -0.0" in str(told)


def test_a_lens_that_is_not_told_again_stays_straightened(unchecked):
    """The second round tells the other lens alone."""
    lenses = Lenses((0, 1), (65.0, 65.0), (0.35, 0.35), (False, False))
    K = torch.tensor([[50.0, 0, 32], [0, 50, 24], [0, 0, 1]])
    taken = Views(torch.rand(2, 3, 48, 64), K.expand(2, 3, 3), ("a", "b"), lenses=lenses)
    first, second = FoundFocal(1.0, 0.01, 3, -0.05, 0.001), FoundFocal(1.0, 0.01, 3, -0.04, 0.001)
    rounds = iter([(first, None), (None, second)])

    def predict(views: Views) -> Prediction:
        for found in rounds:
            return Prediction.of_bent(found, "minilm", {})
        return NOTHING

    _, views = straight_prediction(predict, taken)
    assert views.lenses is not None and views.lenses.straightened == (first, second)


@pytest.mark.parametrize("patience", [0, 1, 4, 9])
def test_cancelling_stops_between_stages(weights, photos, patience):
    asked = []

    def cancelled() -> bool:
        asked.append(True)
        return len(asked) > patience

    with pytest.raises(Cancelled):
        lf.reconstruct(photos, weights=weights, size=SMALL, cancelled=cancelled)
    # Two readers of photos, the matcher and the main thread: each may ask once more and stop.
    assert patience + 1 <= len(asked) <= patience + 4


def test_bad_input_is_one_sentence(weights, photos, tmp_path):
    text = tmp_path / "text.jpg"
    text.write_text("no photo")
    for bad in ([], [text], [tmp_path], [tmp_path / "none.jpg"]):
        with pytest.raises(InputError) as caught:
            lf.reconstruct(bad, weights=weights)
        assert "\n" not in str(caught.value)
    with pytest.raises(ImageError):
        lf.reconstruct([text], weights=weights)
    with pytest.raises(WeightsError, match="no preset 'huge'"):
        lf.reconstruct(photos, preset="huge")
    with pytest.raises(WeightsError):
        lf.reconstruct(photos, weights=tmp_path / "none.safetensors")
    with pytest.raises(InputError, match="size 7 is out of range"):
        lf.reconstruct(photos, weights=weights, size=7)
    with pytest.raises(InputError, match="detail 'fine' is unknown; choose low, normal, high"):
        lf.reconstruct(["gone.jpg"], detail="fine")  # said before anything is read
    with pytest.raises(InputError, match="999 Gaussians are out of range"):
        lf.reconstruct(["gone.jpg"], gaussians=999)
    with pytest.raises(InputError, match="device 'tpu'"):
        lf.reconstruct(photos, weights=weights, device="tpu")


@pytest.fixture(scope="module")
def room() -> Scene:
    return three_blobs()


@pytest.mark.parametrize("mode", ["relevancy", "cosine"])
def test_phrases_find_their_things(room, mode):
    result = lf.query(room, ["couch", "bookshelf", "elephant"], mode=mode)
    couch, shelf, elephant = result.answers
    assert result.mode == mode
    assert couch.found and shelf.found
    assert couch.centroid is not None and shelf.centroid is not None
    # The visible side of a blob of radius 0.2 lies around its centre.
    assert couch.centroid == pytest.approx((-1.0, -0.2, 2.9), abs=0.2)
    assert shelf.centroid == pytest.approx((1.0, 0.2, 2.9), abs=0.2)
    assert not elephant.found
    assert not result.masks[2].any()
    # A few border pixels mix both atoms, and are near both phrases.
    both, smaller = (result.masks[0] & result.masks[1]).sum(), result.masks[:2].flatten(1).sum(1).min()
    assert both < 0.1 * smaller


def test_a_thing_stays_where_it_is_from_another_view(room):
    first, second = (lf.query(room, "lamp", view=view).answers[0].centroid for view in (0, 1))
    assert first is not None and second is not None
    assert first == pytest.approx(second, abs=0.08)


def test_cameras_sizes_and_renderers(room):
    own = Camera(torch.eye(4), torch.tensor([[30.0, 0, 24], [0, 30.0, 16], [0, 0, 1]]), 48, 32)
    assert lf.query(room, ["lamp"], camera=own).relevance.shape == (1, 32, 48)
    assert lf.query(room, ["lamp"], camera=own, size=(24, 16)).relevance.shape == (1, 16, 24)
    asked = []

    def drawn(scene, camera):
        asked.append((camera.width, camera.height))
        return render(scene, camera)

    given = lf.query(room, ["lamp"], render=drawn)
    assert asked == [(96, 64)]
    assert torch.equal(given.relevance, lf.query(room, ["lamp"]).relevance)


def test_bad_queries_are_one_sentence(room):
    for view in (2, -1, 99):
        with pytest.raises(ViewError, match="views 0 to 1"):
            lf.query(room, ["lamp"], view=view)
    with pytest.raises(ViewError, match="cannot be drawn"):
        lf.query(room, ["lamp"], size=(0, 10))
    for prompts in ([], [""], " "):
        with pytest.raises(PromptError):
            lf.query(room, prompts)
    with pytest.raises(PromptError, match="out of range"):
        lf.query(room, ["lamp"], threshold=1.5)
    with pytest.raises(ValueError, match="weight maps"):
        lf.query(room, ["lamp"], render=lambda scene, camera: render(scene, camera, weight_maps=False))


def test_the_scenes_calibration_is_used(room):
    strict = room.with_record(calibration={"threshold": 0.999})
    assert lf.query(room, ["couch"]).answers[0].found
    answer = lf.query(strict, ["couch"]).answers[0]
    assert (answer.found, answer.threshold) == (False, nearer_threshold(0.999, 10.0))


def test_a_scene_survives_the_file(scene, tmp_path):
    path = tmp_path / "room.langflash"
    lf.save(scene, path)
    again = lf.load(path)
    before, after = (lf.query(s, ["book"], size=(40, 30)).relevance for s in (scene, again))
    # The file keeps what the renderer needs; a mean change above half a per cent would be seen.
    assert (before - after).abs().mean() < 5e-3


def test_a_question_reads_in_nothing_that_it_does_without(scene, tmp_path):
    path = tmp_path / "room.langflash"
    lf.save(scene, path)
    program = (
        "import sys\n"
        "from app.cli import main\n"
        "code = main(sys.argv[1:])\n"
        "needless = {'scipy', 'cv2', 'langflash_core.network.guided', 'langflash_core.export.html'}\n"
        "sys.exit(code or needless & set(sys.modules) or None)\n"
    )
    words = ["query", str(path), "book", "-o", str(tmp_path / "answers"), "--backend", "torch"]
    subprocess.run([sys.executable, "-c", program, *words], check=True, cwd=Path(lf.__file__).parents[1])
    assert (tmp_path / "answers" / "book_heat.png").is_file()


def test_the_package_is_light_and_its_functions_keep_their_names():
    program = (
        "import sys, langflash_core as lf\n"
        "assert 'torch' not in sys.modules\n"
        "import langflash_core.language.relevance\n"
        "assert callable(lf.query) and lf.query.__module__ == 'langflash_core.pipeline'\n"
        "from langflash_core import query, reconstruct, save, load\n"
        "assert query is lf.query\n"
        "assert {'query', 'reconstruct', 'save', 'load'} <= set(dir(lf))\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, cwd=Path(lf.__file__).parents[1])
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        lf.nothing  # noqa: B018 (the access is the test)  # pyright: ignore[reportAttributeAccessIssue]
