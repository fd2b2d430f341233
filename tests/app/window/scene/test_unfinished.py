"""Pausing: what is kept of work on many photos, where, how long, and what the window says of it."""

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.window.scene import commands as show
from app.window.scene import unfinished, work
from app.window.scene.state import MOMENTS, PAUSED
from app.window.state import State
from langflash_core import pipeline
from langflash_core.base.files import held_alone
from langflash_core.base.keeping import Keep
from langflash_core.errors import Cancelled


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    return tmp_path / "home" / "unfinished"


@pytest.fixture
def photos(tmp_path) -> tuple[Path, ...]:
    return written(tmp_path / "photos", range(5))


def written(folder: Path, numbers) -> tuple[Path, ...]:
    folder.mkdir()
    paths = tuple(folder / f"{number}.jpg" for number in numbers)
    for number, path in zip(numbers, paths, strict=True):
        path.write_bytes(bytes([number]) * 100)
    return paths


def began(photos: tuple[Path, ...]) -> Path:
    """Work on photos that was kept and stopped."""
    with pytest.raises(Cancelled), unfinished.kept(photos) as folder:
        assert folder is not None
        Keep(folder, "key")("step", lambda: {"values": np.ones(3)})
        raise Cancelled("stopped")
    assert folder is not None
    return folder


def test_what_is_stopped_stays_and_what_ends_well_goes(photos, home):
    assert not unfinished.is_unfinished(photos)
    folder = began(photos)
    assert unfinished.is_unfinished(photos) and folder.parent == home
    with unfinished.kept(photos) as again:
        assert again == folder
        found = Keep(folder, "key")("step", lambda: pytest.fail("it was kept"))
        assert found["values"].tolist() == [1, 1, 1]
    assert not unfinished.is_unfinished(photos) and not folder.exists()


def test_photos_are_known_by_what_they_hold_in_their_order(photos, tmp_path):
    began(photos)
    assert unfinished.is_unfinished(written(tmp_path / "moved", range(5)))
    assert not unfinished.is_unfinished(photos[::-1]) and not unfinished.is_unfinished(photos[:4])
    photos[2].write_bytes(b"another")
    assert not unfinished.is_unfinished(photos)


def test_few_photos_and_such_as_are_gone_are_not_kept(photos, home):
    for some in (photos[:3], (*photos, photos[0].with_name("gone.jpg"))):
        with unfinished.kept(some) as folder:
            assert folder is None
        assert not unfinished.is_unfinished(some)
        unfinished.drop(some)
    assert not home.exists()


def test_nothing_is_kept_on_a_full_disk_and_beside_another_window(photos, monkeypatch):
    folder = unfinished.folder_of(photos)
    assert folder is not None
    with held_alone(folder), unfinished.kept(photos) as kept:
        assert kept is None
    monkeypatch.setattr(unfinished, "_FREE_MB", 10**12)
    with unfinished.kept(photos) as kept:
        assert kept is None


def test_old_work_and_too_much_of_it_goes(photos, tmp_path):
    sets = [written(tmp_path / str(k), range(10 * k, 10 * k + 4)) for k in range(1, 6)]
    for age, some in enumerate(sets):
        folder = began(some)
        then = time.time() - 3600 * (len(sets) - age)
        os.utime(folder, (then, then))
    began(photos)
    known = [unfinished.is_unfinished(some) for some in (*sets, photos)]
    assert known == [False, False, False, True, True, True]  # `MOST_FOLDERS`, the newest
    old = unfinished.folder_of(sets[4])
    assert old is not None
    os.utime(old, (0, 0))
    began(photos)
    assert not unfinished.is_unfinished(sets[4]) and unfinished.is_unfinished(sets[3])


def test_what_another_window_works_on_is_not_swept(photos, tmp_path):
    """It may be the oldest of many: its steps are all that it has after a death."""
    sets = [written(tmp_path / str(k), range(10 * k, 10 * k + 4)) for k in range(1, 6)]
    at_work = began(sets[0])
    with held_alone(at_work):
        for some in (*sets[1:], photos):
            began(some)
            os.utime(at_work, (0, 0))
        assert unfinished.is_unfinished(sets[0])
    os.utime(at_work, (0, 0))
    began(sets[1])
    assert not at_work.exists()


def test_the_window_s_job_keeps_its_work_and_forgets_it_when_it_is_cancelled(photos, monkeypatch):
    kept = []

    def reconstruct(paths, *, keep, **options):
        kept.append(keep)
        if keep is not None:
            Keep(keep, "key")("step", lambda: {"values": np.ones(1)})
        raise Cancelled("stopped")

    monkeypatch.setattr(pipeline, "reconstruct", reconstruct)
    for some in (photos, photos[:2]):
        with pytest.raises(Cancelled):
            work.ReconstructPhotos(some).run(1, lambda stage, fraction: None, lambda: True)
    assert kept == [unfinished.folder_of(photos), None]

    def never() -> bool:
        return False

    assert list(work.LookForWork(photos).run(never)) == [show.WorkFound(photos, True)]
    assert list(work.DropWork(photos).run(never)) == [show.WorkFound(photos, False)]
    assert list(work.LookForWork(photos).run(never)) == [show.WorkFound(photos, False)]


def running(photos: tuple[Path, ...]) -> State:
    return show.Reconstruct().apply(show.AddPhotos(photos).apply(State()))


def test_a_pause_leaves_the_tray_and_says_how_it_goes_on(photos):
    state = show.SetPhotosAside().apply(State())  # of a new room, beside the scene on show
    state = show.PauseJob().apply(show.Reconstruct().apply(show.AddPhotos(photos).apply(state)))
    assert state.scene.job is not None and state.scene.job.cancelling and state.scene.job.pausing
    state = show.JobCancelled().apply(state)
    assert state.scene.job is None and state.toasts[-1].text == PAUSED
    assert [photo.path for photo in state.scene.photos] == list(photos) and state.scene.goes_on
    fewer = show.RemovePhoto(0).apply(state)
    assert not fewer.scene.goes_on
    resumed = show.Reconstruct().apply(state)
    assert resumed.scene.job is not None and not resumed.scene.job.pausing
    assert not resumed.scene.goes_on  # when it is done there is nothing to go on from


def test_few_photos_are_not_paused_and_what_is_cancelled_is_not_resumed(photos):
    few = running(photos[:3])
    assert show.PauseJob().apply(few) is few
    assert show.PauseJob().apply(State()) == State()
    paused = show.JobCancelled().apply(show.PauseJob().apply(running(photos)))
    resumed = show.Reconstruct().apply(paused)
    again = show.CancelJob().apply(replace(resumed, now=resumed.now + MOMENTS))
    assert not show.JobCancelled().apply(again).scene.goes_on


def test_work_that_is_found_is_of_the_photos_in_the_tray(photos):
    state = show.AddPhotos(photos).apply(State())
    assert show.WorkFound(photos, True).apply(state).scene.goes_on
    assert not show.WorkFound(photos[1:], True).apply(state).scene.goes_on
    found = replace(state.scene, unfinished=photos)
    assert not show.WorkFound(photos, False).apply(replace(state, scene=found)).scene.goes_on
