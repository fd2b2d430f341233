"""The worker thread, for real: files, the text tower, cancel, and latest-wins."""

import time
from pathlib import Path

import pytest
from PIL import Image

from app.window import messages
from app.window.state import NEGATIVES
from app.window.worker import Worker
from langflash_core.language.answers import answer
from langflash_core.language.relevance import relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.resources import asset_path
from langflash_core.scene.file import load, save
from langflash_core.splat import render
from tests.app.window.scenes import PHRASES, room

PATIENCE = 60.0  # seconds; generous because the machine may be busy, never waited for in full


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("scenes") / "room.langflash"
    save(room(language_space("minilm").encode(list(PHRASES))), path)
    return path


@pytest.fixture
def worker():
    worker = Worker()
    yield worker
    worker.stop()


def wait_for(worker: Worker, kind, count: int = 1) -> list:
    """All results up to the `count`-th of a kind."""
    results: list = []
    end = time.monotonic() + PATIENCE
    while sum(isinstance(r, kind) for r in results) < count:
        assert time.monotonic() < end, f"no {kind}; heard {results}"
        results += worker.poll()
        time.sleep(0.01)
    return results


def test_a_scene_is_loaded_and_phrases_are_scored(worker: Worker, scene_file: Path) -> None:
    worker.submit(messages.LoadScene(scene_file))
    info = wait_for(worker, messages.SceneReady)[-1].info
    assert (info.num_atoms, len(info.views), info.path) == (3, 2, scene_file)
    texts = ("armchair", "elephant")
    worker.submit(messages.Encode(info.serial, info.scene, (4, 9), texts, NEGATIVES))
    compiled = wait_for(worker, messages.Compiled)[-1]
    assert compiled.keys == (4, 9)
    camera = info.scene.camera(0, 112, 84)
    frame = render(info.scene, camera)
    assert frame.weight_maps is not None
    relevance = relevance_maps(frame.weight_maps, compiled.query)
    worker.submit(messages.Answer(info.serial, (4, 9), relevance, frame, camera, compiled.query))
    scored = wait_for(worker, messages.Scored)  # and histograms, perhaps in the same moment
    scores = next(each for each in scored if isinstance(each, messages.Scored)).scores
    chair, elephant = answer(relevance, frame, camera, compiled.query).answers
    assert scores == ((4, "armchair", chair.score), (9, "elephant", elephant.score))
    assert chair.score >= compiled.query.threshold > elephant.score


def test_a_splat_file_is_opened_saved_and_said_to_be_mute(
    worker: Worker, scene_file: Path, tmp_path: Path
) -> None:
    worker.submit(messages.WriteScene(load(scene_file), tmp_path / "room.ply"))
    wait_for(worker, messages.SceneWritten)
    worker.submit(messages.LoadScene(tmp_path / "room.ply"))
    info = wait_for(worker, messages.SceneReady)[-1].info
    assert (info.num_atoms, len(info.views), info.name) == (0, 1, "room.ply")
    assert info.num_gaussians == len(load(scene_file).gaussians)
    assert len(info.warnings) == 1 and "no language" in info.warnings[0]


def test_failures_are_sentences_and_the_thread_lives_on(
    worker: Worker, scene_file: Path, tmp_path: Path
) -> None:
    worker.submit(messages.LoadScene(tmp_path / "gone.langflash"))
    failed = wait_for(worker, messages.Failed)[-1]
    assert failed.job and "gone.langflash" in failed.sentence
    worker.submit(messages.LoadScene(scene_file))
    assert isinstance(wait_for(worker, messages.SceneReady)[-1], messages.SceneReady)


def test_only_the_newest_prompts_are_encoded(worker: Worker, scene_file: Path) -> None:
    scene = load(scene_file)
    typed = "an armchair by the window"
    for end in range(1, len(typed) + 1):
        worker.submit(messages.Encode(1, scene, (0,), (typed[:end],), NEGATIVES))
    results = wait_for(worker, messages.Compiled)
    while results[-1].query.texts != (typed,):
        results += wait_for(worker, messages.Compiled)
    # Submitting takes microseconds and encoding milliseconds: most keystrokes are passed over.
    assert len(results) < len(typed) / 2


def test_a_newer_job_silences_the_older(worker: Worker, scene_file: Path, tmp_path: Path) -> None:
    for _ in range(3):
        worker.submit(messages.LoadScene(tmp_path / "gone.langflash"))
    worker.submit(messages.LoadScene(scene_file))
    results = wait_for(worker, messages.SceneReady)
    assert sum(isinstance(r, messages.Failed) for r in results) <= 1  # the one that had begun


def test_scenes_are_written_and_thumbnails_made(worker: Worker, scene_file: Path, tmp_path: Path) -> None:
    scene = load(scene_file)
    worker.submit(messages.WriteScene(scene, tmp_path / "copy.langflash"))
    assert wait_for(worker, messages.SceneWritten)[-1].path.is_file()
    photo, broken = tmp_path / "p.png", tmp_path / "b.jpg"
    Image.new("RGB", (1200, 900), (10, 200, 30)).save(photo)
    broken.write_text("not a picture")
    worker.submit(messages.MakeThumbnails((photo, broken)))
    good, bad = wait_for(worker, messages.Thumbnail, 2)[-2:]
    assert good.rgb.shape == (240, 320, 3) and tuple(good.rgb[0, 0]) == (10, 200, 30)
    assert bad.rgb is None and "b.jpg" in bad.problem


def test_a_cancelled_reconstruction_stops_between_stages(worker: Worker) -> None:
    photos = tuple(asset_path(f"photos/books_{side}.jpg") for side in ("left", "right"))
    worker.submit(messages.ReconstructPhotos(photos))
    worker.cancel()
    results = wait_for(worker, messages.Stopped)
    assert not any(isinstance(r, messages.SceneReady | messages.Failed) for r in results)


def test_stop_is_quick_and_repeatable(scene_file: Path) -> None:
    worker = Worker()
    worker.submit(messages.LoadScene(scene_file))
    start = time.monotonic()
    worker.stop(patience=PATIENCE)
    worker.stop()
    assert time.monotonic() - start < PATIENCE


@pytest.mark.parametrize("began", [True, False])
def test_what_was_to_be_saved_is_saved_before_the_end(scene_file: Path, tmp_path: Path, began: bool) -> None:
    """Behind other errands, and even where the thread has not started yet."""
    scene = load(scene_file)
    worker = Worker(begins=began)
    worker.submit(messages.MakeThumbnails((scene_file,) * 50))
    worker.submit(messages.WriteScene(scene, tmp_path / "saved.langflash"))
    worker.stop()
    assert len(load(tmp_path / "saved.langflash").gaussians) == len(scene.gaussians)
    assert not [file for file in tmp_path.iterdir() if file.name != "saved.langflash"]
