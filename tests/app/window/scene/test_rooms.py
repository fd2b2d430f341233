"""What takes the place of a scene, and the way back to the one before, without a window."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from app.window import commands as do
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.effects import Effects, Hands
from app.window.scene import commands as show
from app.window.scene import merging, work
from app.window.scene.effects import SceneEffects
from app.window.scene.state import MOST_ROOMS, Photo, SceneInfo
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core import pipeline
from langflash_core.errors import ImageError
from langflash_core.scene.edits import Mask
from langflash_core.scene.file import save
from tests.app.window.scenes import after, shown_scene

PHOTOS = (Path("/p/a.jpg"), Path("/p/b.jpg"))
SOME = Mask.of(np.arange(12_300) < 5)


class Nothing:
    """Takes what the renderer and the thumbnails would; notes which pictures are dropped."""

    shares = ()

    def __init__(self) -> None:
        self.dropped = list[str]()

    def drop(self, key: str) -> None:
        self.dropped.append(key)

    def __getattr__(self, name: str):
        return lambda *_: None


def of_scene(hands: Hands, world: Any) -> Effects:
    return SceneEffects(hands, world, world, lambda title: None)


class Desk:
    """Effects, what they ask of the worker, and a state that follows. make: each of hands, and of what stands
    for renderer and thumbnails."""

    def __init__(self, state: State | None = None, *make: Callable[[Hands, Any], Effects]) -> None:
        self.state, self.asked, self.performed = state or State(), list[Any](), list[do.Command]()
        hands = Hands(self.perform, self.perform, self.asked.append, lambda: None, lambda: 0.0)
        self.world = Nothing()
        self.effects = [each(hands, self.world) for each in make or (of_scene,)]

    def perform(self, *commands: do.Command) -> None:
        for command in commands:
            before, self.state = self.state, after(self.state, command)
            self.performed.append(command)
            for each in self.effects:
                each.follow(command, before, self.state)

    def work(self) -> None:
        """Do what was asked, and what that asks."""
        while self.asked:
            self.perform(*self.asked.pop(0).run(lambda: False))

    @property
    def jobs(self) -> list[str]:
        return [type(each).__name__ for each in self.asked if isinstance(each, work.Job)]


@pytest.fixture
def desk(info) -> Desk:
    """A scene made of two photos."""
    desk = Desk()
    desk.perform(show.AddPhotos(PHOTOS), show.SceneArrived(info))
    desk.asked.clear()
    return desk


@pytest.fixture
def edited(desk: Desk) -> Desk:
    desk.perform(edit.Found(SOME, "replace", "here"), edit.Delete())
    return desk


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    (tmp_path / "c.jpg").write_bytes(b"a photo")
    return tmp_path / "c.jpg"


def names(desk: Desk) -> list[str]:
    return [path.name for path in desk.state.scene.paths]


def test_photos_dropped_on_a_scene_are_asked_about(desk: Desk, photo: Path) -> None:
    desk.perform(show.OpenPaths((str(photo),)))
    assert desk.state.dialog is Dialog.DROP and names(desk) == ["a.jpg", "b.jpg"] and desk.jobs == []
    desk.perform(do.ShowDialog(None))
    assert names(desk) == ["a.jpg", "b.jpg"] and desk.jobs == []
    for new, wanted in ((False, ["a.jpg", "b.jpg", "c.jpg"]), (True, ["c.jpg"])):
        desk.perform(show.OpenPaths((str(photo),)))
        desk.perform(show.dropped(desk.state, desk.state.scene.dropped, new))
        assert desk.state.dialog is None and names(desk) == wanted and len(desk.jobs) == 1 + new


def test_without_a_scene_a_drop_starts_at_once(photo: Path) -> None:
    desk = Desk()
    desk.perform(show.OpenPaths((str(photo),)))
    assert desk.state.dialog is None and desk.jobs == ["ReconstructPhotos"]


def test_scenes_have_the_detail_that_is_preferred(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    for detail in ("normal", "high"):
        wanted = replace(desk.state.preferences, detail=detail)
        desk.state = replace(desk.state.with_scene(job=None), preferences=wanted)
        desk.perform(show.Reconstruct())
        assert desk.asked[-1].detail == detail
    told = {}

    def reconstruct(photos, **options):
        told.update(options)
        raise ImageError("no scene is wanted")

    monkeypatch.setattr(pipeline, "reconstruct", reconstruct)
    with pytest.raises(ImageError):
        desk.asked[-1].run(1, lambda stage, fraction: None, lambda: False)
    assert told["detail"] == "high"


def test_a_person_who_starts_by_hand_still_says_where_photos_belong(edited: Desk, photo: Path) -> None:
    wanted = replace(edited.state.preferences, start_at_once=False)
    edited.state = replace(edited.state, preferences=wanted)
    edited.perform(show.OpenPaths((str(photo),)))
    edited.perform(show.dropped(edited.state, edited.state.scene.dropped, new=True))
    assert names(edited) == ["c.jpg"] and edited.jobs == [] and edited.state.dialog is None


def test_unsaved_edits_are_asked_about_before_anything_takes_their_place(
    edited: Desk, info, photo: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.langflash"
    save(info.scene, other)
    desk = edited
    for begins in (
        show.Instead((show.Reconstruct(),)),
        show.OpenPaths((str(other),)),
        show.dropped(desk.state, (photo,), new=True),
    ):
        desk.perform(begins)
        assert desk.state.dialog is Dialog.UNSAVED and desk.jobs == []
        desk.perform(do.ShowDialog(None))  # cancel
        assert desk.state.scene.pending == () and names(desk) == ["a.jpg", "b.jpg"] and desk.jobs == []
    desk.perform(show.Instead((show.Reconstruct(),)), show.GoOn())
    assert desk.jobs == ["ReconstructPhotos"] and desk.state.scene.pending == ()


@pytest.mark.parametrize("closed", [False, True], ids=["saved", "closed"])
@pytest.mark.parametrize("begins", [show.Instead((show.Reconstruct(),)), do.Leave()], ids=["room", "quit"])
def test_saving_first_goes_on_when_it_is_done(edited: Desk, begins: do.Command, closed: bool) -> None:
    """Also out of the program, which stayed; a save dialog that is closed ends what waited."""
    place = Path("/x/a.langflash")
    edited.perform(begins, show.SaveFirst())
    assert edited.state.dialog is Dialog.SAVE
    if closed:
        edited.perform(do.ShowDialog(None), do.ShowDialog(Dialog.SAVE))
    edited.perform(show.SaveScene(place))
    assert edited.jobs == [] and not edited.state.leaving, "it is not written yet"
    edited.perform(show.SceneSaved(place, edited.state.editing.marks))
    went_on = edited.state.leaving if isinstance(begins, do.Leave) else edited.jobs == ["ReconstructPhotos"]
    assert went_on != closed and not edited.state.editing.unsaved and edited.state.scene.pending == ()


def test_the_room_before_comes_back_as_it_was_left(edited: Desk, info) -> None:
    before = edited.state
    edited.perform(show.SceneArrived(replace(info, serial=2, name="kitchen"), alone=True))
    assert edited.state.scene.photos == () and [r.info.name for r in edited.state.scene.rooms] == ["room"]
    edited.perform(show.GoToRoom(1))
    state = edited.state
    assert state.editing.history == before.editing.history and state.editing.unsaved
    assert state.scene.photos == before.scene.photos and state.scene.pose == before.scene.pose
    assert [r.info.name for r in state.scene.rooms] == ["kitchen"]
    edited.perform(edit.Undo(), edit.Undo())
    assert not edited.state.editing.unsaved


def test_rooms_are_few_and_a_file_is_there_once(desk: Desk, info) -> None:
    for serial in range(2, MOST_ROOMS + 4):
        desk.perform(show.SceneArrived(replace(info, serial=serial, name=str(serial))))
    assert [room.info.serial for room in desk.state.scene.rooms] == [5, 4, 3]
    path = Path("/x/a.langflash")
    for serial in (10, 11, 12):
        desk.perform(show.SceneArrived(replace(info, serial=serial, path=path)))
    assert [room.info.serial for room in desk.state.scene.rooms] == [6, 5, 4]


OLD, NEW, NEWER = (Path(f"{name}.png") for name in ("old", "new", "newer"))


def aside(state: State, *photos: Path) -> State:
    """A new room of photos begun beside the scene on show; each takes the place of the one before."""
    for photo in photos:
        state = after(state, show.SetPhotosAside(), show.AddPhotos((photo,)))
    return after(state, show.Reconstruct())


@pytest.mark.parametrize("end", [show.JobFailed("nothing to see"), show.JobCancelled()])
@pytest.mark.parametrize("photos", [(NEW,), (NEW, NEWER)])
def test_where_a_new_room_cannot_be_made_the_tray_is_as_before(photos: tuple[Path, ...], end) -> None:
    state = aside(shown_scene().with_scene(photos=(Photo(OLD),)), *photos)
    assert state.scene.paths == photos[-1:]
    state = after(state, end)
    assert state.scene.paths == (OLD,) and state.scene.job is None


@pytest.mark.parametrize("own", [(), (Photo(OLD),)], ids=["no photos", "its photos"])
def test_the_room_left_keeps_its_own_photos(own: tuple[Photo, ...]) -> None:
    state = aside(shown_scene().with_scene(photos=own), NEW)
    assert state.scene.info is not None
    state = after(state, show.SceneArrived(replace(state.scene.info, serial=2, path=None)))
    assert state.scene.paths == (NEW,) and state.scene.rooms[0].photos == own


def test_a_scene_that_cannot_be_opened_leaves_waiting_photos() -> None:
    state = after(shown_scene(), show.SetPhotosAside(), show.AddPhotos((NEW,)))
    state = after(state, show.OpenScene(Path("missing.langflash")), show.JobFailed("there is no such file"))
    assert state.scene.paths == (NEW,)


@pytest.fixture
def layered(info: SceneInfo) -> SceneInfo:
    """The room as two layers, which keeps its photos."""
    scene = replace(info.scene, photos=(b"a",) * info.scene.num_views)
    ids = torch.arange(len(scene.gaussians)) % scene.num_views
    return describe_scene(replace(scene, view_ids=ids).with_record(layered=True), 3, "room")


def test_a_photo_dropped_on_a_room_of_layers_makes_a_room_with_it_of_what_is_on_show(
    layered: SceneInfo, photo: Path, monkeypatch
) -> None:
    desk, given = Desk(), []

    def add_photos(scene, photos, **_):
        given.append((len(scene.gaussians), photos))
        return scene

    monkeypatch.setattr(pipeline, "add_photos", add_photos)
    desk.perform(show.SceneArrived(layered), edit.Found(SOME, "replace", "here"), edit.Delete())
    assert merging.can_grow(desk.state, 1)
    desk.perform(merging.AddToScene((photo,)))
    assert desk.state.scene.job is not None and desk.state.scene.job.title == "Adding c.jpg"
    request = desk.asked[-1]
    assert isinstance(request, work.PutInPhotos)
    desk.perform(request.run(4, lambda *_: None, lambda: False))
    assert given == [(layered.num_gaussians - 5, (photo,))]
    state = desk.state
    assert state.scene.info is not None and (state.scene.info.serial, state.scene.info.name) == (4, "room")
    assert [each.info.serial for each in state.scene.rooms] == [3] and state.scene.job is None


def test_a_room_without_layers_is_made_anew_instead(desk: Desk, layered: SceneInfo) -> None:
    assert not merging.can_grow(desk.state, 1)
    desk.perform(show.SceneArrived(layered))
    assert not merging.can_grow(desk.state, layered.scene.num_views)  # most would be new
