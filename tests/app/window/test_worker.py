"""The worker thread, for real: files, the text tower, cancel, and latest-wins."""

import time
from dataclasses import dataclass
from pathlib import Path

import pytest
import torch
from PIL import Image

from app.window.asking import commands as ask
from app.window.asking.work import Answer, Encode
from app.window.commands import Command, OfScene, ShowPicture
from app.window.drawing.values import View
from app.window.requests import Job, Task
from app.window.scene import commands as show
from app.window.scene import work
from app.window.worker import Worker
from langflash_core.base.resources import asset_path
from langflash_core.errors import Cancelled
from langflash_core.language.answers import answer
from langflash_core.language.relevance import relevance_maps
from langflash_core.language.spaces import language_space
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
    """All commands up to the `count`-th of a kind; those of a scene without its number."""
    results: list = []
    end = time.monotonic() + PATIENCE
    while sum(isinstance(r, kind) for r in results) < count:
        assert time.monotonic() < end, f"no {kind}; heard {results}"
        results += [each.command if isinstance(each, OfScene) else each for each in worker.poll()]
        time.sleep(0.01)
    return results


@dataclass(frozen=True)
class Predicting(Job):
    """Tells of its progress from within the network's own mode, as reconstructions do."""

    def run(self, serial, progress, cancelled):
        with torch.inference_mode():
            while not cancelled():
                progress("predicting", 0.5)
                time.sleep(0.01)
        raise Cancelled


@dataclass(frozen=True)
class Counting(Task):
    """Makes a tensor that is kept."""

    def run(self, stopping):
        yield Kept(torch.zeros(3))


@dataclass(frozen=True)
class Kept(Command):
    tensor: torch.Tensor

    def apply(self, state):
        return state


def compiled(worker: Worker) -> list[ask.PhrasesCompiled]:
    """Phrases that came, without where they are answered."""
    return [each for each in wait_for(worker, ask.PhrasesCompiled) if isinstance(each, ask.PhrasesCompiled)]


def test_tensors_of_tasks_within_a_prediction_can_be_changed_after_it(worker: Worker) -> None:
    worker.submit(Predicting())
    wait_for(worker, show.Progressed)
    worker.submit(Counting())
    (kept,) = (each for each in wait_for(worker, Kept) if isinstance(each, Kept))
    worker.cancel()
    assert kept.tensor.add_(1).tolist() == [1, 1, 1]  # an inference tensor refuses that


def test_a_scene_is_loaded_and_phrases_are_scored(worker: Worker, scene_file: Path) -> None:
    worker.submit(work.LoadScene(scene_file))
    info = wait_for(worker, show.SceneArrived)[-1].info
    assert (info.num_atoms, len(info.views), info.path) == (3, 2, scene_file)
    texts = ("armchair", "elephant")
    worker.submit(Encode(info.serial, info.scene, (4, 9), texts, ()))
    phrases = compiled(worker)[-1]
    assert phrases.keys == (4, 9)
    camera = info.scene.camera(0, 112, 84)
    frame = render(info.scene, camera)
    assert frame.weight_maps is not None
    relevance = relevance_maps(frame.weight_maps, phrases.query)
    view = View(info.serial, (4, 9), frame, relevance, camera, phrases.query, 0)
    worker.submit(Answer(info.serial, view))
    scored = wait_for(worker, ask.Answered)  # and histograms, perhaps in the same moment
    scores = next(each for each in scored if isinstance(each, ask.Answered)).scores
    chair, elephant = answer(relevance, frame, camera, phrases.query).answers
    assert scores == ((4, "armchair", chair.score), (9, "elephant", elephant.score))
    assert chair.score >= phrases.query.threshold > elephant.score


def test_a_splat_file_is_opened_saved_and_said_to_be_mute(
    worker: Worker, scene_file: Path, tmp_path: Path
) -> None:
    worker.submit(work.WriteScene(load(scene_file), tmp_path / "room.ply"))
    wait_for(worker, show.SceneSaved)
    (tmp_path / "room.language.safetensors").unlink()  # with it the scene would speak again
    worker.submit(work.LoadScene(tmp_path / "room.ply"))
    info = wait_for(worker, show.SceneArrived)[-1].info
    assert (info.num_atoms, len(info.views), info.name) == (0, 1, "room.ply")
    assert info.num_gaussians == len(load(scene_file).gaussians)
    assert len(info.warnings) == 1 and "cannot answer phrases yet" in info.warnings[0]


def test_failures_are_sentences_and_the_thread_lives_on(
    worker: Worker, scene_file: Path, tmp_path: Path
) -> None:
    worker.submit(work.LoadScene(tmp_path / "gone.langflash"))
    failed = wait_for(worker, show.JobFailed)[-1]
    assert "gone.langflash" in failed.sentence
    worker.submit(work.LoadScene(scene_file))
    assert isinstance(wait_for(worker, show.SceneArrived)[-1], show.SceneArrived)


@dataclass(frozen=True)
class Urgent(Counting):
    """A picture waits for it."""

    urgent = True

    def run(self, stopping):
        yield Kept(torch.ones(3))


def test_what_a_picture_waits_for_comes_before_what_was_asked_earlier() -> None:
    worker = Worker(begins=False)
    for task in (Counting(), Counting(), Urgent()):
        worker.submit(task)
    worker.begin()
    kept = []
    while len(kept) < 3:
        kept += [each.tensor[0].item() for each in wait_for(worker, Kept) if isinstance(each, Kept)]
    worker.stop()
    assert kept == [1, 0, 0]


def test_only_the_newest_prompts_are_encoded(worker: Worker, scene_file: Path) -> None:
    scene = load(scene_file)
    typed = "an armchair by the window"
    for end in range(1, len(typed) + 1):
        worker.submit(Encode(1, scene, (0,), (typed[:end],), ()))
    results = compiled(worker)
    while results[-1].query.texts != (typed,):
        results += compiled(worker)
    # Submitting takes microseconds and encoding milliseconds: most keystrokes are passed over.
    assert len(results) < len(typed) / 2


def test_a_newer_job_silences_the_older(worker: Worker, scene_file: Path, tmp_path: Path) -> None:
    for _ in range(3):
        worker.submit(work.LoadScene(tmp_path / "gone.langflash"))
    worker.submit(work.LoadScene(scene_file))
    results = wait_for(worker, show.SceneArrived)
    assert sum(isinstance(r, show.JobFailed) for r in results) <= 1  # the one that had begun


def test_scenes_are_written_and_thumbnails_made(worker: Worker, scene_file: Path, tmp_path: Path) -> None:
    scene = load(scene_file)
    worker.submit(work.WriteScene(scene, tmp_path / "copy.langflash"))
    assert wait_for(worker, show.SceneSaved)[-1].path.is_file()
    photo, broken = tmp_path / "p.png", tmp_path / "b.jpg"
    Image.new("RGB", (1200, 900), (10, 200, 30)).save(photo)
    broken.write_text("not a picture")
    worker.submit(work.MakeThumbnails((photo, broken)))
    good, read, bad = wait_for(worker, show.PhotoFailed)[-3:]
    assert isinstance(good, ShowPicture) and good.key == str(photo)
    assert good.rgb.shape == (240, 320, 3) and tuple(good.rgb[0, 0]) == (10, 200, 30)
    assert isinstance(read, show.PhotoRead) and (read.path, read.recorded) == (photo, None)
    assert bad.path == broken and "b.jpg" in bad.problem


def test_a_cancelled_reconstruction_stops_between_stages(worker: Worker) -> None:
    photos = tuple(asset_path(f"photos/books_{side}.jpg") for side in ("left", "right"))
    worker.submit(work.ReconstructPhotos(photos))
    worker.cancel()
    results = wait_for(worker, show.JobCancelled)
    assert not any(isinstance(r, show.SceneArrived | show.JobFailed) for r in results)


def test_stop_is_quick_and_repeatable(scene_file: Path) -> None:
    worker = Worker()
    worker.submit(work.LoadScene(scene_file))
    start = time.monotonic()
    worker.stop(patience=PATIENCE)
    worker.stop()
    assert time.monotonic() - start < PATIENCE


@pytest.mark.parametrize("began", [True, False])
def test_what_was_to_be_saved_is_saved_before_the_end(scene_file: Path, tmp_path: Path, began: bool) -> None:
    """Behind other tasks, and even where the thread has not started yet."""
    scene = load(scene_file)
    worker = Worker(begins=began)
    worker.submit(work.MakeThumbnails((scene_file,) * 50))
    worker.submit(work.WriteScene(scene, tmp_path / "saved.langflash"))
    worker.stop()
    assert len(load(tmp_path / "saved.langflash").gaussians) == len(scene.gaussians)
    assert not [file for file in tmp_path.iterdir() if file.name != "saved.langflash"]
