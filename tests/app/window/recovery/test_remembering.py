"""Projects followed without a window: written as a scene is left, opened so, gone with what they show."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from app.places import forget_pictures
from app.window.asking.commands import EditPrompt
from app.window.commands import Command, ShowPicture
from app.window.editing.mending import HiddenForGood, RememberUnhidden
from app.window.effects import Hands
from app.window.recovery import commands as keep
from app.window.recovery import projects
from app.window.recovery.commands import Opened, OpenProject
from app.window.recovery.preferences import MOST_RECENT
from app.window.recovery.remembering import LOOK_AGAIN, REMEMBER_AFTER, RememberingEffects
from app.window.recovery.work import ReadProjects
from app.window.scene import commands as show
from app.window.scene.camera import MoveTo, SetMode
from app.window.scene.state import Room
from app.window.scene.work import LoadScene, describe_scene
from langflash_core.base.pictures import DEPTH
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.file import save
from tests.app.window.recovery.desk import Desk
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
    """A desk at which projects are remembered; recent scenes are noted as recovery does."""

    def __post_init__(self) -> None:
        self.keeper = None
        self.picture = Seen()
        hands = Hands(self.perform, self.perform, self.asked.append, lambda: None, lambda: self.state.now)
        self.effects = RememberingEffects(hands, self.picture, self.picture)  # type: ignore[arg-type]

    def settle(self) -> None:
        self.pass_time(1.1 * REMEMBER_AFTER)
        self.effects._writer.submit(lambda: None).result()

    def perform(self, command: Command) -> None:
        super().perform(command)
        if isinstance(command, ShowPicture):
            self.picture.shades[command.key] = int(command.rgb.mean().round())

    def tiles(self) -> dict[str, int]:
        """Shades of the pictures of tiles, a moment later."""
        self.pass_time(1.1 * LOOK_AGAIN)
        self.effects._writer.submit(lambda: None).result()
        return dict(self.picture.shades)

    def small(self, path: Path) -> int | None:
        """The shade of the small picture of a scene; None where there is none."""
        self.effects._writer.submit(lambda: None).result()
        found = projects.picture(str(path))
        return None if found is None else int(found.mean().round())


@pytest.fixture
def desk(folders: Path) -> Iterator[Table]:
    desk = Table()
    yield desk
    desk.effects.close(desk.state, crashed=False)


@pytest.fixture
def path(folders: Path) -> Path:
    path = folders / "room.langflash"
    save(room(torch.eye(3)), path)
    return path


def opened(desk: Table, path: Path) -> None:
    desk.perform(Opened(path))
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
    desk.effects.follow(done, before, desk.state)


def test_a_scene_opens_as_it_was_left(desk: Table, path: Path) -> None:
    photo = path.with_name("left.png")
    photo.write_bytes(b"pixels")
    opened(desk, path)
    desk.perform(show.AddPhotos((photo,)))
    desk.perform(EditPrompt(0, "armchair"))
    pose = Pose(Vector(0.25, 0.0, 0.0))
    desk.perform(MoveTo(pose))
    desk.perform(SetMode(DEPTH))
    desk.settle()
    assert desk.small(path) == 40
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
    later.effects.close(later.state, crashed=False)


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
    desk.perform(Opened(path))
    info = describe_scene(room(torch.eye(3)), 5, path.name, path)
    desk.perform(show.SceneArrived(info))  # not read from there
    desk.settle()
    assert desk.small(path) is None and projects.read(str(path)).views == 2


def test_what_is_taken_off_the_list_leaves_nothing(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    desk.perform(keep.ProjectsRead((projects.read(str(path)),)))
    assert desk.state.recovery.projects
    desk.perform(keep.ForgetRecent(str(path)))
    assert desk.small(path) is None and projects.read(str(path)).views == 0
    assert desk.state.recovery.projects == () and desk.picture.dropped == [f"project {path}"]
    desk.perform(EditPrompt(0, "armchair"))  # it is on show still, and off the list
    desk.settle()
    assert projects.read(str(path)).views == 0


def test_no_more_are_kept_than_the_list_has(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    for number in range(MOST_RECENT):
        desk.perform(Opened(path.with_name(f"{number}.langflash")))
    assert desk.small(path) is None and projects.read(str(path)).views == 0


def test_recent_scenes_are_read_and_those_that_have_gone_are_none(desk: Table, path: Path) -> None:
    opened(desk, path)
    desk.settle()
    found = list(ReadProjects((str(path), str(path.with_name("gone.langflash")))).run(lambda: False))
    assert [type(each).__name__ for each in found] == ["ProjectsRead"]
    assert [project.path for project in found[0].projects] == [str(path)]  # type: ignore[attr-defined]
    assert projects.sweep([]) == ()
    (read,) = ReadProjects((str(path),)).run(lambda: False)
    assert replace(read.projects[0], when=None).sentence() == ""  # type: ignore[attr-defined]


def test_a_project_that_has_gone_is_said(desk: Table, path: Path) -> None:
    path.unlink()
    desk.perform(OpenProject(str(path)))
    assert desk.state.scene.job is None and not desk.state.scene.pending


def test_a_tile_shows_what_its_file_is_by_now(desk: Table, path: Path) -> None:
    """Another process hid something in it, and the open window went on showing that."""
    opened(desk, path)
    desk.settle()
    empty = Table()
    empty.perform(Opened(path))
    empty.effects.begin((str(path),))
    empty.work()
    key = f"project {path}"
    assert empty.tiles() == {key: 40} and empty.effects.due <= empty.state.now + LOOK_AGAIN
    empty.picture.shades[key] = 7
    assert empty.tiles() == {key: 7}, "what has not changed is not read again"
    save(room(torch.eye(3)).rows(torch.arange(11_000)), path)  # as `langflash hide` does
    assert empty.tiles() == {}
    forget_pictures([path])
    assert empty.tiles() == {}
    projects.keep_picture(str(path), desk.picture.seen(), projects.stamp(path))  # by another window
    assert empty.tiles() == {key: 40}
    forget_pictures([path])  # something was hidden in a copy of it
    assert empty.tiles() == {}
    read(empty, path)
    empty.settle()
    assert empty.effects.due == float("inf"), "nobody looks at tiles"
    empty.effects.close(empty.state, crashed=False)
