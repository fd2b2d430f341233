"""A session outlives the process that dies, and only that; a scene is remembered as it was left."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.places import state_folder
from app.window.recovery import records
from app.window.recovery.commands import restored_phrases
from app.window.recovery.locks import locked
from app.window.recovery.records import Keeper
from app.window.recovery.state import Kept
from app.window.state import State
from langflash_core.errors import OutputError
from langflash_core.geometry.poses import Pose, Vector
from tests.torture.failing import failing

ROOT = Path(__file__).parents[4]
DYING = """
import os, sys, signal
from app.window.recovery.records import Keeper
from app.window.recovery.state import Kept
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
    kept = records.left_behind()
    assert kept is not None and kept.file is not None
    assert (kept.photos, kept.fovs, kept.phrases) == ((str(photo),), (61.5,), ("armchair",))
    assert not kept.saved and Path(kept.scene).read_bytes() == b"a scene"
    assert kept.sentence() == "kitchen, 1 photo, 1 phrase"
    photo.unlink()  # what is gone is not offered
    again = records.left_behind()
    assert again is not None and again.photos == () and again.fovs == ()
    assert again.missing == ("a photo.png",)
    records.forget(kept.file)
    assert records.left_behind() is None and list(state_folder().iterdir()) == []


def test_a_session_that_runs_or_ended_well_is_not_offered(folders: Path) -> None:
    keeper = Keeper()
    keeper.keep(Kept(phrases=("door",), pose=Pose(Vector(1.0, 2.0, 3.0))))
    assert records.left_behind() is None
    keeper.close()
    assert records.left_behind() is None and list(state_folder().iterdir()) == []
    keeper.keep(Kept(phrases=("wall",)))  # a late write after the end writes nothing
    assert list(state_folder().iterdir()) == []


def test_a_session_that_ends_well_is_gone_before_its_lock_is_free(folders: Path) -> None:
    """Another window that looked in between offered it."""
    keeper, seen = Keeper(), []
    keeper.keep(Kept(phrases=("door",)))
    lock = keeper._lock
    assert lock is not None and keeper.file.exists()
    keeper._lock = SimpleNamespace(close=lambda: seen.append(keeper.file.exists()))  # type: ignore[assignment]
    keeper.close()
    lock.close()
    assert seen == [False] and list(state_folder().iterdir()) == []


def test_the_camera_comes_back_exactly(folders: Path) -> None:
    keeper, kept = Keeper(), Kept(phrases=("door",), pose=Pose(Vector(0.1, 1 / 3, -7.0), fov=61.0))
    keeper.keep(kept)
    file = next(state_folder().glob("*.json"))
    read = records.read(file)
    keeper.close()
    assert read is not None and read.pose == kept.pose


@pytest.mark.parametrize(
    "damage",
    [
        {"pose": Pose(span=0.0)}, {"pose": Pose(span=float("nan"))}, {"pose": Pose(reach=0.0)},
        {"colours": ((0.1, float("nan"), 0.3),)}, {"likes": ("0f",)}, {"visible": (True, False)},
        {"scene": 1}, {"phrases": (1,)}, {"aside": ((1, None),)}, {"views": "many"}, {"views": -1},
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_asked_or_opened_is_damage(folders: Path, damage: dict) -> None:
    """A camera that draws nothing, half a number of a vector, a number that names an open file."""
    path, whole = folders / "kept.json", Kept(phrases=("door",))
    path.write_bytes(records.told(whole))
    assert records.read(path) is not None
    path.write_bytes(records.told(replace(whole, **damage)))
    assert records.read(path) is None


def test_damage_and_emptiness_are_passed_over_and_removed(folders: Path) -> None:
    state_folder().mkdir(parents=True)
    for name, content in (
        ("session-1-a.json", b"{"), ("session-2-b.json", b'{"pose": 3}'), ("session-3-c.json", b"[]"),
    ):  # fmt: skip
        (state_folder() / name).write_bytes(content)
    assert records.left_behind() is None
    assert list(state_folder().iterdir()) == []


def test_phrases_come_back_in_their_colours_shown_or_not(folders: Path) -> None:
    colours = ((0.1, 0.2, 0.3), (0.9, 0.8, 0.7))
    kept = Kept(phrases=("door", "chair"), colours=colours, visible=(False, True))
    path = folders / "kept.json"
    path.write_bytes(records.told(kept))
    read = records.read(path)
    assert read is not None and (read.colours, read.visible) == (colours, (False, True))
    rows = restored_phrases(State(), read).asking.prompts
    assert [(row.colour, row.visible) for row in rows] == [(colours[0], False), (colours[1], True)]


def test_a_session_that_cannot_be_read_today_stays(folders: Path) -> None:
    """Too many open files, or a disk that hiccups: it went with the scene that nobody had saved."""
    photo = folders / "a photo.png"
    photo.write_bytes(b"pixels")
    die(photo)
    there = set(state_folder().iterdir())
    with failing("read", 3, folders):  # the folder, the lock, the session
        assert records.left_behind() is None
    assert set(state_folder().iterdir()) >= there
    assert records.left_behind() is not None


def test_of_two_windows_that_died_together_both_come_back(folders: Path) -> None:
    state_folder().mkdir(parents=True)
    for number in (1, 2):
        stem = state_folder() / f"session-{number}-0000000{number}"
        stem.with_suffix(".langflash").write_bytes(b"a scene")
        kept = Kept(scene=str(stem.with_suffix(".langflash")), saved=False, name=f"room {number}")
        stem.with_suffix(".json").write_bytes(records.told(kept))
        os.utime(stem.with_suffix(".json"), (number, number))
    for name in ("room 2", "room 1"):
        kept = records.left_behind()
        assert kept is not None and kept.name == name and Path(kept.scene).is_file()
        assert kept.file is not None
        records.forget(kept.file)
    assert records.left_behind() is None


def test_one_that_another_window_ends_meanwhile_hides_no_other(folders: Path, monkeypatch) -> None:
    state_folder().mkdir(parents=True)
    for number in (1, 2):
        kept = Kept(phrases=(f"door {number}",))
        (state_folder() / f"session-{number}-a.json").write_bytes(records.told(kept))
    read, gone = records.read, []

    def ended(path: Path) -> Kept | None:
        if not gone:
            records.forget(path)
            gone.append(path)
        return read(path)

    monkeypatch.setattr(records, "read", ended)
    kept = records.left_behind()
    assert kept is not None and kept.file is not None
    assert kept.file != gone[0] and kept.file.is_file()


def test_a_lock_on_a_full_disk_leaves_no_open_file(folders: Path) -> None:
    state_folder().mkdir(parents=True)
    before = set(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else set()
    with failing("write", 1, folders), pytest.raises(OutputError, match="cannot write"):
        locked(state_folder() / "session-1-a.lock")
    if before:
        assert len(os.listdir("/proc/self/fd")) == len(before)


# Projects


@pytest.fixture
def scene(folders: Path) -> Path:
    path = folders / "my room.langflash"
    path.write_bytes(b"a scene")
    return path


def left(scene: Path) -> Kept:
    return Kept(
        scene=str(scene), phrases=("a chair",), likes=("",), pose=Pose(Vector(0.1, 0.2, 0.3)), views=4
    )


def record_of(scene: Path) -> Path:
    """The file that says how a scene was left."""
    records.keep_project(left(scene))
    (file,) = state_folder().glob("project-*.json")
    return file


def test_a_scene_is_remembered_as_it_was_left(scene: Path) -> None:
    record_of(scene)
    project = records.project(str(scene))
    assert (project.phrases, project.pose, project.views) == (("a chair",), left(scene).pose, 4)
    assert project.project_sentence() == "4 photos, 1 phrase" and project.when is not None


@pytest.mark.parametrize(
    "change",
    [
        lambda content: b"{",
        lambda content: b"[]",
        lambda content: json.dumps({**content, "views": 4, "session": {}}).encode(),
        lambda content: b" " * 2**20,
    ],
)
def test_of_a_damaged_record_the_path_is_left(scene: Path, change) -> None:
    file = record_of(scene)
    file.write_bytes(change(json.loads(file.read_bytes())))
    assert records.project(str(scene)) == Kept(scene=str(scene))


def test_photos_of_other_scenes_are_not_looked_for(scene: Path, monkeypatch) -> None:
    """Of each there may be 300, on a disk that sleeps, and the window waits."""
    record_of(scene)
    session = state_folder() / "session-1-00000001.json"
    photos = tuple(f"/far/{number}.jpg" for number in range(3))
    other = replace(left(scene), scene="/far/other.langflash", photos=photos, fovs=(None,) * 3)
    session.write_bytes(records.told(other))
    isfile, asked = os.path.isfile, []
    monkeypatch.setattr(os.path, "isfile", lambda path: asked.append(str(path)) or isfile(path))
    assert records.project(str(scene)).phrases == ("a chair",)
    assert not [path for path in asked if path.startswith("/far")]


def test_what_is_kept_while_a_sweep_waits_for_a_disk_stays(scene: Path, monkeypatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(os.path, "isfile", lambda _: records.keep_project(left(scene)) is None)
        records.sweep(["/far/other.langflash"])
    assert records.project(str(scene)).phrases == ("a chair",)


def test_what_earlier_versions_kept_and_nobody_can_move_stops_no_sweep(scene: Path) -> None:
    earlier = scene.parent / "config" / "projects"
    earlier.mkdir(parents=True)
    (earlier / "a.json").write_text("{}")
    state_folder().parent.mkdir(parents=True, exist_ok=True)
    state_folder().write_text("a file in the way")
    assert records.sweep([str(scene)]) == (str(scene),)


def test_what_belongs_to_no_recent_scene_is_swept_away(scene: Path) -> None:
    other = scene.with_name("other.langflash")
    other.write_bytes(b"another")
    for path in (scene, other):
        records.keep_project(left(path))
    assert records.sweep([str(other), str(scene)]) == (str(other), str(scene))
    os.unlink(scene)
    assert records.sweep([str(other), str(scene)]) == (str(other),)
    assert len(list(state_folder().iterdir())) == 1
    assert records.sweep([]) == () and list(state_folder().iterdir()) == []


def test_projects_of_an_earlier_version_are_taken_over(scene: Path) -> None:
    """They lay beside the preferences, each around a session."""
    file = record_of(scene)
    content = json.loads(file.read_bytes())
    del content["aside"]
    earlier = scene.parent / "config" / "projects"
    earlier.mkdir(parents=True)
    place = earlier / file.name.removeprefix("project-")
    place.write_text(json.dumps({"views": content.pop("views"), "session": content}))
    os.utime(place, (1000, 1000))
    file.unlink()
    assert records.sweep([str(scene)]) == (str(scene),) and not earlier.exists()
    project = records.project(str(scene))
    assert project == replace(left(scene), fovs=(), when=datetime.fromtimestamp(1000))


def test_a_session_that_is_closed_late_does_not_undo_what_came_after(scene: Path) -> None:
    record_of(scene)
    session = state_folder() / "session-1-00000001.json"
    session.write_bytes(records.told(replace(left(scene), phrases=("old",), likes=("",))))
    os.utime(session, (1000, 1000))
    kept = records.left_behind()
    assert kept is not None
    records.close(kept, [str(scene)])
    assert records.project(str(scene)).phrases == ("a chair",) and not session.exists()
