"""Projects without a window: kept as a scene is left, opened so, pictured, gone with what they show."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from app.places import forget_pictures, state_folder
from app.window.asking.commands import EditPrompt
from app.window.commands import Command, ShowPicture
from app.window.editing.mending import HiddenForGood, RememberUnhidden
from app.window.recovery import commands as keep
from app.window.recovery import records, tiles
from app.window.recovery.commands import Opened, OpenProject
from app.window.recovery.effects import KEEP_AFTER
from app.window.recovery.preferences import DEFAULTS, MOST_RECENT
from app.window.recovery.state import Kept
from app.window.recovery.tiles import LOOK_AGAIN, REMEMBER_AFTER, TileEffects, keep_picture, picture, stamp
from app.window.recovery.work import ReadProjects
from app.window.scene import commands as show
from app.window.scene.camera import MoveTo, SetMode
from app.window.scene.state import Room
from app.window.scene.work import LoadScene, describe_scene
from langflash_core.base.pictures import DEPTH
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.file import save
from tests.app.window.desk import Desk
from tests.app.window.scenes import room


@dataclass
class Seen:
    """A picture at rest, in the place of the viewport. drawn: names it."""

    whole: bool = True
    settling: bool = False
    drawn: int = 0
    dropped: list[str] = field(default_factory=list)
    shades: dict[str, int] = field(default_factory=dict)  # of small pictures

    def seen(self) -> np.ndarray:
        return np.full((60, 90, 3), 40 * (self.drawn + 1), np.uint8)

    def drop(self, key: str) -> None:
        self.dropped.append(key)
        self.shades.pop(key, None)


@dataclass
class Table(Desk):
    """A desk at which scenes are pictured, too."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.picture = Seen()
        self.tiles = TileEffects(self.hands, self.picture, self.picture)  # type: ignore[arg-type]
        self.followers = (self.effects, self.tiles)

    def written(self) -> None:
        super().written()
        self.tiles._write(lambda: None).result(timeout=10)

    def settle(self) -> None:
        self.pass_time(1.1 * REMEMBER_AFTER)
        self.written()

    def perform(self, *commands: Command) -> None:
        super().perform(*commands)
        for command in commands:
            if isinstance(command, ShowPicture):
                self.picture.shades[command.key] = int(command.rgb.mean().round())

    def close(self, crashed: bool = False) -> None:
        for effects in self.followers:
            effects.close(self.state, crashed)
        self.followers = ()

    def shown(self) -> dict[str, int]:
        """Shades of the pictures of tiles, a moment later."""
        self.pass_time(1.1 * LOOK_AGAIN)
        self.written()
        return dict(self.picture.shades)

    def small(self, path: Path) -> int | None:
        """The shade of the small picture of a scene; None where there is none."""
        self.written()
        found = picture(str(path))
        return None if found is None else int(found.mean().round())


@pytest.fixture
def desk(folders: Path) -> Iterator[Table]:
    desk = Table()
    yield desk
    desk.close()


@pytest.fixture
def path(folders: Path) -> Path:
    path = folders / "room.langflash"
    save(room(torch.eye(3)), path)
    return path


def opened(desk: Table, path: Path) -> None:
    desk.perform(show.OpenScene(path, alone=True))
    read(desk, path)


def read(desk: Table, path: Path) -> None:
    """As the scene's own effects have it done."""
    desk.asked[:] = [LoadScene(path, alone=True)]
    desk.work()


def hidden(desk: Table) -> None:
    """Something is hidden for good, as editing does it."""
    info, marks = desk.state.scene.info, desk.state.editing.marks
    assert info is not None and marks is not None
    done = HiddenForGood(info.serial, marks, describe_scene(info.scene, 99, info.name), "Hidden")
    before, unhidden = desk.state, Room(info)
    desk.perform(done.arrival(desk.state))
    desk.perform(RememberUnhidden(unhidden))
    desk.tiles.follow(done, before, desk.state)


def test_a_scene_opens_as_it_was_left_from_a_window_that_is_open_still_or_closed(
    desk: Table, path: Path
) -> None:
    photo = path.with_name("left.png")
    photo.write_bytes(b"pixels")
    opened(desk, path)
    desk.perform(show.AddPhotos((photo,)))
    desk.perform(EditPrompt(0, "armchair"))
    pose = Pose(Vector(0.25, 0.0, 0.0))
    desk.perform(MoveTo(pose))
    desk.perform(SetMode(DEPTH))
    desk.settle()
    assert desk.small(path) == 40 and not list(state_folder().glob("project-*.json"))
    for closed in (False, True):
        if closed:
            desk.close()
            assert list(state_folder().glob("project-*.json")) and not desk.keeper.file.exists()
        later = Table()
        later.perform(Opened(path))
        later.perform(OpenProject(str(path)))
        (waiting,) = later.state.scene.pending  # edits of what is on show are asked about first
        later.perform(waiting)
        assert later.state.scene.job is not None
        read(later, path)
        state = later.state
        assert [prompt.text for prompt in state.asking.prompts] == ["armchair"]
        assert (state.scene.pose.centre, state.scene.mode) == (pose.centre, DEPTH)
        assert [each.path for each in state.scene.photos] == [photo]
        later.die()
        records.forget(later.keeper.file)


def test_a_scene_that_another_follows_is_left_with_its_own_photos(desk: Table, path: Path) -> None:
    """Those in the tray are the other's."""
    own, others = path.with_name("own.png"), path.with_name("other.png")
    for photo in (own, others):
        photo.write_bytes(b"pixels")
    opened(desk, path)
    desk.perform(show.AddPhotos((own,)))
    desk.perform(show.SetPhotosAside())
    desk.perform(show.AddPhotos((others,)))
    desk.perform(EditPrompt(0, "armchair"))
    desk.perform(show.SceneArrived(describe_scene(room(torch.eye(3)), 8, "other")))
    desk.written()
    left = records.project(str(path))
    assert (left.photos, left.phrases, left.views, left.aside) == ((str(own),), ("armchair",), 2, None)


def test_a_crash_that_nobody_goes_on_with_says_how_its_scene_was_left(desk: Table, path: Path) -> None:
    ended = Table()
    opened(ended, path)
    ended.perform(EditPrompt(0, "armchair"))
    ended.settle()
    ended.die()
    desk.effects.begin(DEFAULTS.opened(path), "", empty=True)
    session = desk.state.recovery.session
    assert session is not None and session.sentence() == "room.langflash, 1 phrase"
    desk.perform(keep.EndSessionOffer(restore=False))
    desk.written()
    assert records.left_behind() is None and not list(state_folder().glob("session-*"))
    assert records.project(str(path)).phrases == ("armchair",)


def test_a_disk_that_sleeps_under_a_tile_holds_no_record_up(desk: Table, path: Path, monkeypatch) -> None:
    asked, awake = threading.Event(), threading.Event()
    monkeypatch.setattr(tiles, "stamp", lambda _: asked.set() or (awake.wait(10) and ""))
    desk.perform(Opened(path), keep.ProjectsRead((Kept(scene=str(path)),)))
    desk.pass_time(1.1 * LOOK_AGAIN)
    assert asked.wait(5)
    desk.perform(EditPrompt(0, "armchair"))
    desk.pass_time(1.1 * KEEP_AFTER)
    try:
        desk.effects._write(lambda: None).result(timeout=5)
        assert records.read(desk.keeper.file) is not None
    finally:
        awake.set()


def test_a_picture_that_cannot_be_read_back_stops_no_closing(desk: Table, path: Path, monkeypatch) -> None:
    """After a crash none is read back at all."""
    asked = []

    def seen() -> np.ndarray:
        asked.append("read back")
        raise MemoryError

    monkeypatch.setattr(desk.picture, "seen", seen)
    opened(desk, path)
    desk.tiles.close(desk.state, crashed=True)
    assert asked == []
    desk.close()
    assert asked and not desk.keeper.file.exists()


def test_only_a_picture_that_is_whole_is_kept(desk: Table, path: Path) -> None:
    desk.picture.whole = False
    opened(desk, path)
    desk.settle()
    assert desk.small(path) is None
    desk.picture.whole = True
    desk.settle()
    assert desk.small(path) == 40


def test_nothing_that_was_hidden_stays_in_a_picture(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    assert desk.small(path) == 40
    hidden(desk)
    assert desk.small(path) is None  # at once, and none of a scene that is in no file yet
    desk.settle()
    assert desk.small(path) is None
    save(room(torch.eye(3)), path)
    desk.picture.drawn = 1
    desk.perform(show.SceneSaved(path))
    desk.settle()
    assert desk.small(path) == 80


def test_saving_makes_the_picture_anew(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    save(room(torch.eye(3)), path)
    desk.perform(show.SceneSaved(path))
    assert desk.small(path) is None
    desk.settle()
    assert desk.small(path) == 40


def test_no_picture_is_kept_of_a_file_that_is_another_by_now(desk: Table, path: Path) -> None:
    """The window shows what was read; meanwhile the command line has hidden a part of the file."""
    opened(desk, path)
    path.write_bytes(path.read_bytes() + b" ")
    desk.settle()
    assert desk.small(path) is None


def test_edits_of_an_earlier_session_are_no_picture_of_the_file(desk: Table, path: Path) -> None:
    info = describe_scene(room(torch.eye(3)), 5, path.name, path)
    desk.perform(show.SceneArrived(info))  # not read from there
    desk.settle()
    assert desk.small(path) is None and records.project(str(path)).views == 2


def test_what_is_taken_off_the_list_leaves_nothing(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    desk.perform(keep.ProjectsRead((records.project(str(path)),)))
    assert desk.state.recovery.projects
    desk.perform(keep.ForgetRecent(str(path)))
    assert desk.small(path) is None
    assert desk.state.recovery.projects == () and desk.picture.dropped == [f"project {path}"]
    desk.perform(EditPrompt(0, "armchair"))  # it is on show still, and off the list
    desk.settle()
    desk.close()
    assert list(state_folder().iterdir()) == []


def test_no_more_are_kept_than_the_list_has(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    desk.perform(show.SceneArrived(describe_scene(room(torch.eye(3)), 8, "other")))
    for number in range(MOST_RECENT):
        desk.perform(Opened(path.with_name(f"{number}.langflash")))
    assert desk.small(path) is None and not list(state_folder().glob("project-*"))


def test_recent_scenes_are_read_and_those_that_have_gone_are_none(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    found = list(ReadProjects((str(path), str(path.with_name("gone.langflash")))).run(lambda: False))
    assert [type(each).__name__ for each in found] == ["ProjectsRead"]
    (project,) = found[0].projects  # type: ignore[attr-defined]
    assert (project.scene, project.project_sentence()) == (str(path), "2 photos")
    desk.close()
    assert records.sweep([]) == ()
    (read,) = ReadProjects((str(path),)).run(lambda: False)
    assert read.projects[0].project_sentence() == ""  # type: ignore[attr-defined]


def test_a_project_that_has_gone_is_said(desk: Table, path: Path) -> None:
    path.unlink()
    desk.perform(OpenProject(str(path)))
    assert desk.state.scene.job is None and not desk.state.scene.pending


def test_a_tile_shows_what_its_file_is_by_now(desk: Table, path: Path) -> None:
    """Another process hid something in it, and the open window went on showing that."""
    opened(desk, path)
    desk.settle()
    empty = Table()
    empty.effects.begin(DEFAULTS.opened(path), "", empty=True)
    empty.work()
    key = f"project {path}"
    assert empty.shown() == {key: 40} and empty.tiles.due <= empty.state.now + LOOK_AGAIN
    empty.picture.shades[key] = 7
    assert empty.shown() == {key: 7}, "what has not changed is not read again"
    save(room(torch.eye(3)).rows(torch.arange(11_000)), path)  # as `langflash hide` does
    assert empty.shown() == {}
    forget_pictures([path])
    assert empty.shown() == {}
    keep_picture(str(path), desk.picture.seen(), stamp(path))  # by another window
    assert empty.shown() == {key: 40}
    forget_pictures([path])  # something was hidden in a copy of it
    assert empty.shown() == {}
    read(empty, path)
    empty.settle()
    assert empty.tiles.due == float("inf"), "nobody looks at tiles"
    empty.close()


# The files of small pictures


def seen(noise: int = 0) -> np.ndarray:
    """A red half and a blue one, with so much noise."""
    pixels = np.zeros((700, 900, 3), np.uint8)
    pixels[:, :450, 0] = pixels[:, 450:, 2] = 200
    return pixels + np.random.default_rng(0).integers(0, noise + 1, pixels.shape, np.uint8)


def pictured(path: Path, noise: int = 0) -> Path:
    """The file of a small picture."""
    keep_picture(str(path), seen(noise), stamp(path))
    (file,) = state_folder().glob("project-*.jpg")
    return file


@pytest.mark.parametrize("noise", [0, 50])
def test_a_small_picture_is_the_middle_in_ten_kilobytes_at_the_most(path: Path, noise: int) -> None:
    assert pictured(path, noise).stat().st_size <= 10 * 1024
    small = picture(str(path))
    assert small is not None and small.shape == (180, 270, 3)
    assert small[90, 20, 0] > 190 and small[90, 250, 2] > 190 and small[90, 20, 2] < 80


def test_a_picture_of_what_the_file_was_before_is_neither_shown_nor_kept(path: Path) -> None:
    """Somebody hid a part of it meanwhile, by the command line say."""
    file = pictured(path)
    path.write_bytes(b"the scene without the part")
    assert picture(str(path)) is None and not file.exists()
    assert pictured(path) == file
    keep_picture(str(path), seen(), "langflash 7 1")  # the window still shows what was read before
    assert not file.exists()


@pytest.mark.parametrize("content", [b"", b"no picture", b"\xff\xd8\xff\xe0 cut off", bytes(2**20), None])
def test_a_damaged_picture_is_none(path: Path, content: bytes | None) -> None:
    file = pictured(path)
    file.write_bytes(file.read_bytes()[:-500] if content is None else content)
    assert picture(str(path)) is None and not file.exists()


def test_a_foreign_picture_is_none(path: Path) -> None:
    file = pictured(path)
    Image.new("RGB", tiles.SIDES).save(file, "JPEG")  # says of no file that it is of it
    assert picture(str(path)) is None
    file.mkdir()
    assert picture(str(path)) is None


def test_pictures_of_an_earlier_version_are_taken_over_or_forgotten(desk: Table, path: Path) -> None:
    """They lay beside the preferences."""
    earlier = path.parent / "config" / "projects"
    earlier.mkdir(parents=True)
    file = pictured(path)
    place = earlier / file.name.removeprefix("project-")
    file.rename(place)
    assert records.sweep([str(path)]) == (str(path),) and desk.small(path) and not earlier.exists()
    earlier.mkdir()
    file.rename(place)
    forget_pictures([path])
    assert not place.exists()
