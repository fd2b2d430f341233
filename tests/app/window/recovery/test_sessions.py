"""A session outlives the process that dies, and only that."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from app.places import state_folder
from app.window.recovery import sessions
from app.window.recovery.commands import restored_phrases
from app.window.recovery.keeper import Keeper
from app.window.recovery.locks import locked
from app.window.recovery.state import Kept
from app.window.state import State
from langflash_core.errors import OutputError
from langflash_core.geometry.poses import Pose, Vector
from tests.torture.failing import failing

ROOT = Path(__file__).parents[4]
DYING = """
import os, sys, signal
from app.window.recovery.keeper import Keeper
from app.window.recovery.locks import locked
from app.window.recovery.state import Kept
from app.window.state import State
keeper = Keeper()
keeper.scene_file.parent.mkdir(parents=True, exist_ok=True)
keeper.scene_file.write_bytes(b"a scene")
keeper.keep(Kept(photos=(sys.argv[1],), fovs=(61.5,), scene=str(keeper.scene_file), saved=False,
                 name="kitchen", phrases=("armchair",)))
print("kept", flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def die(photo: Path) -> None:
    """A process that keeps a session and is killed."""
    done = subprocess.run(
        [sys.executable, "-c", DYING, str(photo)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == -signal.SIGKILL and done.stdout == "kept\n", done.stderr


def test_a_killed_session_is_left_behind(folders: Path) -> None:
    photo = folders / "a photo.png"
    photo.write_bytes(b"pixels")
    die(photo)
    kept = sessions.left_behind()
    assert kept is not None and kept.file is not None
    assert (kept.photos, kept.fovs, kept.phrases) == ((str(photo),), (61.5,), ("armchair",))
    assert not kept.saved and Path(kept.scene).read_bytes() == b"a scene"
    assert kept.sentence() == "kitchen, 1 photo, 1 phrase"
    photo.unlink()  # what is gone is not offered
    again = sessions.left_behind()
    assert again is not None and again.photos == () and again.fovs == ()
    assert again.missing == ("a photo.png",)
    sessions.forget(kept.file)
    assert sessions.left_behind() is None and list(state_folder().iterdir()) == []


def test_a_session_that_runs_or_ended_well_is_not_offered(folders: Path) -> None:
    keeper = Keeper()
    keeper.keep(Kept(phrases=("door",), pose=Pose(Vector(1.0, 2.0, 3.0))))
    assert sessions.left_behind() is None
    keeper.close()
    assert sessions.left_behind() is None and list(state_folder().iterdir()) == []
    keeper.keep(Kept(phrases=("wall",)))  # a late write after the end writes nothing
    assert list(state_folder().iterdir()) == []


def test_the_camera_comes_back_exactly(folders: Path) -> None:
    keeper, kept = Keeper(), Kept(phrases=("door",), pose=Pose(Vector(0.1, 1 / 3, -7.0), fov=61.0))
    keeper.keep(kept)
    file = next(state_folder().glob("*.json"))
    read = sessions.read(file)
    keeper.close()
    assert read is not None and read.pose == kept.pose


def test_a_camera_from_which_nothing_can_be_drawn_is_damage(folders: Path) -> None:
    for pose in (Pose(span=0.0), Pose(span=float("nan")), Pose(reach=0.0)):
        path = folders / "kept.json"
        path.write_text(json.dumps(sessions.fields(Kept(phrases=("door",), pose=pose))))
        assert sessions.read(path) is None


def test_damage_and_emptiness_are_passed_over_and_removed(folders: Path) -> None:
    state_folder().mkdir(parents=True)
    for name, content in (
        ("session-1-a.json", b"{"), ("session-2-b.json", b'{"pose": 3}'), ("session-3-c.json", b"[]"),
    ):  # fmt: skip
        (state_folder() / name).write_bytes(content)
    assert sessions.left_behind() is None
    assert list(state_folder().iterdir()) == []


def test_phrases_come_back_in_their_colours_shown_or_not(folders: Path) -> None:
    colours = ((0.1, 0.2, 0.3), (0.9, 0.8, 0.7))
    kept = Kept(phrases=("door", "chair"), colours=colours, visible=(False, True))
    path = folders / "kept.json"
    path.write_text(json.dumps(sessions.fields(kept)))
    read = sessions.read(path)
    assert read is not None and (read.colours, read.visible) == (colours, (False, True))
    rows = restored_phrases(State(), read).asking.prompts
    assert [(row.colour, row.visible) for row in rows] == [(colours[0], False), (colours[1], True)]


def test_a_colour_that_is_no_number_is_damage(folders: Path) -> None:
    keeper, colours = Keeper(), ((0.1, float("nan"), 0.3),)
    keeper.keep(Kept(phrases=("door",), colours=colours, visible=(True,)))
    read = sessions.read(next(state_folder().glob("*.json")))
    keeper.close()
    assert read is None


def test_a_session_that_cannot_be_read_today_stays(folders: Path) -> None:
    """Too many open files, or a disk that hiccups: it went with the scene that nobody had saved."""
    photo = folders / "a photo.png"
    photo.write_bytes(b"pixels")
    die(photo)
    there = set(state_folder().iterdir())
    with failing("read", 3, folders):  # the folder, the lock, the session
        assert sessions.left_behind() is None
    assert set(state_folder().iterdir()) >= there
    assert sessions.left_behind() is not None


def test_of_two_windows_that_died_together_both_come_back(folders: Path) -> None:
    state_folder().mkdir(parents=True)
    for number in (1, 2):
        stem = state_folder() / f"session-{number}-0000000{number}"
        stem.with_suffix(".langflash").write_bytes(b"a scene")
        kept = Kept(scene=str(stem.with_suffix(".langflash")), saved=False, name=f"room {number}")
        stem.with_suffix(".json").write_text(json.dumps(sessions.fields(kept)))
        os.utime(stem.with_suffix(".json"), (number, number))
    for name in ("room 2", "room 1"):
        kept = sessions.left_behind()
        assert kept is not None and kept.name == name and Path(kept.scene).is_file()
        assert kept.file is not None
        sessions.forget(kept.file)
    assert sessions.left_behind() is None


@pytest.mark.parametrize("when", ["listed", "read"])
def test_one_that_another_window_ends_meanwhile_hides_no_other(folders: Path, monkeypatch, when: str) -> None:
    state_folder().mkdir(parents=True)
    for number in (1, 2):
        kept = Kept(phrases=(f"door {number}",))
        (state_folder() / f"session-{number}-a.json").write_text(json.dumps(sessions.fields(kept)))
    read, gone = sessions.read, []

    def ended(path: Path) -> Kept | None:
        first, before = not gone, read(path)
        if first:
            sessions.forget(path)
            gone.append(path)
        return read(path) if first and when == "listed" else before

    monkeypatch.setattr(sessions, "read", ended)
    kept = sessions.left_behind()
    assert kept is not None and kept.file is not None
    assert kept.file != gone[0] and kept.file.is_file()


def test_a_lock_on_a_full_disk_leaves_no_open_file(folders: Path) -> None:
    state_folder().mkdir(parents=True)
    before = set(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else set()
    with failing("write", 1, folders), pytest.raises(OutputError, match="cannot write"):
        locked(state_folder() / "session-1-a.lock")
    if before:
        assert len(os.listdir("/proc/self/fd")) == len(before)
