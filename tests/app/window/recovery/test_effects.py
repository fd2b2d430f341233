"""What lasts, followed without a window: files of this version and of the one before."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from app.places import state_folder
from app.window.asking.state import Prompt
from app.window.commands import Command, Notify, OfScene, apply
from app.window.editing import commands as edit
from app.window.editing.pointing import LIKE_THRESHOLD
from app.window.recovery import commands as keep
from app.window.recovery import edits, records, work
from app.window.recovery.effects import KEEP_AFTER
from app.window.recovery.preferences import DEFAULTS
from app.window.scene import commands as show
from app.window.scene import work as scene_work
from app.window.scene.work import JoinScenes, LoadScene
from app.window.state import State
from langflash_core.scene.edits import Mask, delete
from langflash_core.scene.file import save
from tests.app.window.desk import Desk


@pytest.fixture
def desk(folders: Path) -> Iterator[Desk]:
    desk = Desk()
    yield desk
    desk.effects.close(desk.state, crashed=False)


def some(count: int = 12_300) -> Mask:
    return Mask.of(np.arange(count) < 5)


def test_an_unsaved_scene_gets_a_copy_and_its_edits_are_written_once_they_rest(desk: Desk, info) -> None:
    desk.perform(show.SceneArrived(info))
    assert {type(each) for each in desk.asked} == {work.LookForEdits, work.KeepCopy}
    desk.work()
    assert desk.keeper.scene_file.is_file() and desk.state.recovery.copy == desk.keeper.scene_file
    desk.perform(edit.Found(some(), "replace", "here"))
    desk.perform(edit.Delete())
    desk.pass_time(0.5 * KEEP_AFTER)
    assert desk.asked == []
    desk.pass_time(0.6 * KEEP_AFTER)
    desk.work()
    kept = desk.state.recovery.kept
    assert kept is not None and desk.keeper.own(kept) and edits.find(info.scene) is not None
    desk.perform(show.SceneSaved(Path("/rooms/a.langflash"), desk.state.editing.marks))
    desk.work()
    assert desk.state.recovery.kept is None and edits.find(info.scene) is None
    assert desk.state.preferences.recent == ("/rooms/a.langflash",)


def test_the_edits_of_the_scene_before_are_kept_when_another_comes(desk: Desk, info) -> None:
    desk.perform(show.SceneArrived(info))
    desk.perform(edit.Found(some(), "replace", "here"))
    desk.perform(edit.Delete())
    desk.perform(show.SceneArrived(replace(info, serial=2, name="other")))
    assert "edits of room are kept" in desk.state.toasts[-1].text
    desk.work()
    assert desk.state.recovery.kept is None  # the answer was about the scene that is gone
    offer = edits.find(info.scene)
    assert offer is not None and (offer.name, offer.count) == ("room", 2)


BEFORE = {
    "photos": [], "fovs": [], "scene": "", "edits": "", "saved": False, "name": "kitchen",
    "phrases": ["armchair"], "mode": "DEPTH",
    "pose": {"centre": [0.1, 0.2, -0.3], "rotation": [1.0, 0.0, 0.0, 0.0], "reach": 1.5, "fov": 60.0,
             "aspect": 1.25, "shift": [0.0, 0.0]},
}  # fmt: skip
"""As the version before wrote a session."""


def test_a_merge_takes_the_kept_edits_along_and_is_restored(desk: Desk, info, tmp_path: Path) -> None:
    views = torch.zeros(12_300, dtype=torch.int64)  # of the merged Gaussians nobody knows the view
    info = replace(info, scene=replace(info.scene, view_ids=views))
    desk.perform(show.SceneArrived(info))
    desk.perform(edit.Found(some(), "replace", "here"))
    desk.perform(edit.Delete())
    desk.pass_time(2 * KEEP_AFTER)
    desk.work()
    first = desk.state.recovery.kept
    assert first is not None and desk.state.editing.marks is not None and desk.state.scene.info is not None
    save(info.scene, tmp_path / "b.langflash")
    request = JoinScenes(desk.state.scene.info, desk.state.editing.marks, tmp_path / "b.langflash")
    merged = request.run(2, lambda *_: None, lambda: False)
    desk.perform(merged.arrival(desk.state))
    desk.work()
    kept, history = desk.state.recovery.kept, desk.state.editing.history
    assert kept is not None and not first.exists() and "are kept" not in str(desk.state.toasts)
    again = LoadScene(kept.with_suffix(".langflash"), kept).run(3, lambda *_: None, lambda: False)
    assert isinstance(again, show.SceneArrived) and history is not None
    assert again.info.history == history and len(history.marks.selected) == 12_300
    assert again.info.scene.view_ids is not None
    assert torch.equal(again.info.scene.view_ids, torch.cat((views, views - 1)))
    assert after_restoring(again).editing.unsaved
    assert not after_restoring(again, *3 * (edit.Undo(),)).editing.unsaved


def test_kept_edits_stay_where_those_of_the_merged_scene_cannot_be_written(
    desk: Desk, info, tmp_path: Path
) -> None:
    desk.perform(show.SceneArrived(info))
    desk.perform(edit.Found(some(), "replace", "here"))
    desk.perform(edit.Delete())
    desk.pass_time(2 * KEEP_AFTER)
    desk.work()
    first = desk.state.recovery.kept
    assert first is not None and desk.state.editing.marks is not None and desk.state.scene.info is not None
    save(info.scene, tmp_path / "b.langflash")
    request = JoinScenes(desk.state.scene.info, desk.state.editing.marks, tmp_path / "b.langflash")
    desk.perform(request.run(2, lambda *_: None, lambda: False).arrival(desk.state))
    desk.asked = [each for each in desk.asked if not isinstance(each, work.KeepEdits)]  # the disk is full
    desk.work()
    assert first.exists()


def after_restoring(arrived: show.SceneArrived, *commands: Command) -> State:
    state = apply(State(), arrived)
    for command in commands:
        state = apply(state, command)
    return state


def test_a_session_of_the_version_before_is_restored_with_its_edits(desk: Desk, info) -> None:
    scene = state_folder() / "session-1-00000000.langflash"
    scene.parent.mkdir(parents=True)
    save(info.scene, scene)
    assert info.history is not None
    history = info.history.edited("Delete 5", delete(info.history.marks, some()))
    file = edits.keep(info.scene, history, "kitchen", None, "deadbeef")
    session = state_folder() / "session-1-00000000.json"
    session.write_text(json.dumps({**BEFORE, "scene": str(scene), "edits": str(file)}))
    desk.effects.begin(DEFAULTS, "", empty=True)
    assert desk.state.recovery.session is not None
    assert not any(isinstance(each, work.LookForEdits) for each in desk.asked)  # it holds its edits
    desk.perform(keep.EndSessionOffer(restore=True))
    desk.perform(scene_work.LoadScene(file.with_suffix(".langflash"), file).run(3, print, lambda: False))
    state = desk.state
    assert state.editing.history == history and state.scene.info is not None
    assert (state.scene.info.name, state.scene.info.path, state.scene.mode.name) == ("kitchen", None, "depth")
    assert tuple(state.scene.pose.centre) == (0.1, 0.2, -0.3) and [p.text for p in state.asking.prompts] == [
        "armchair"
    ]
    desk.work()
    desk.written()
    assert not file.exists()  # this window keeps them under its own name
    again = edits.find(info.scene)
    assert again is not None and desk.keeper.own(again.edits)
    desk.effects.close(desk.state, crashed=True)
    left = records.left_behind()
    assert left is None  # this process lives and holds its lock
    assert not session.exists() and not scene.exists()


def test_without_a_session_the_newest_edits_are_looked_for(desk: Desk) -> None:
    desk.effects.begin(DEFAULTS, "Something was lost.", empty=True)
    assert [type(each) for each in desk.asked] == [work.LookForEdits, work.ReadProjects]
    assert desk.state.toasts[-1].text == "Something was lost."
    other = Desk()
    other.effects.begin(DEFAULTS, "", empty=False)
    assert [type(each) for each in other.asked] == [work.ReadProjects]
    other.effects.close(other.state, crashed=False)


def with_photos(folder: Path, count: int = 2) -> tuple[Path, ...]:
    paths = tuple(folder / f"photo {number}.jpg" for number in range(count))
    for path in paths:
        path.write_bytes(b"")
    return paths


def leave_edits(info, paths: tuple[Path, ...]) -> None:
    """A session with photos in the tray that ends with edits unsaved."""
    desk = Desk()
    desk.perform(show.AddPhotos(paths))
    desk.perform(show.SetPhotoFov(1, 70.0))
    desk.perform(show.SceneArrived(info))
    desk.perform(edit.Found(some(), "replace", "here"))
    desk.perform(edit.Delete())
    desk.effects.close(desk.state, crashed=False)


def test_restored_edits_bring_the_photos_of_the_tray_back(desk: Desk, info, tmp_path: Path) -> None:
    paths = with_photos(tmp_path)
    leave_edits(info, paths)
    desk.effects.begin(DEFAULTS, "", empty=True)
    desk.work()
    offer = desk.state.recovery.edits
    assert offer is not None
    desk.perform(keep.EndOffer(restore=True))
    assert any(isinstance(each, scene_work.MakeThumbnails) and each.paths == paths for each in desk.asked)
    desk.perform(scene_work.LoadScene(offer.scene, offer.edits).run(3, print, lambda: False))
    assert [(photo.path, photo.fov) for photo in desk.state.scene.photos] == [
        (paths[0], None),
        (paths[1], 70.0),
    ]
    assert desk.state.scene.info is not None and desk.state.toasts == ()


def test_photos_that_have_gone_are_named_in_one_sentence(desk: Desk, info, tmp_path: Path) -> None:
    paths = with_photos(tmp_path)
    leave_edits(info, paths)
    paths[0].unlink()
    desk.effects.begin(DEFAULTS, "", empty=True)
    desk.work()
    desk.perform(keep.EndOffer(restore=True))
    assert [photo.path for photo in desk.state.scene.photos] == [paths[1]]
    assert "photo 0.jpg can no longer be found" in desk.state.toasts[-1].text


def test_the_room_that_restored_edits_replace_keeps_its_own_photos(desk: Desk, info, tmp_path: Path) -> None:
    paths = with_photos(tmp_path, 3)
    leave_edits(info, paths[:1])
    for each in (show.AddPhotos(paths[1:]), show.SceneArrived(replace(info, serial=2, name="other"))):
        desk.perform(each)
    desk.work()
    offer = desk.state.recovery.edits
    assert offer is not None  # of the same content
    desk.perform(keep.EndOffer(restore=True))
    assert [photo.path for photo in desk.state.scene.photos] == [paths[0]]
    failed = apply(desk.state, show.JobFailed("It is damaged."))
    assert [photo.path for photo in failed.scene.photos] == list(paths[1:]) and failed.scene.aside is None
    desk.perform(scene_work.LoadScene(offer.scene, offer.edits).run(3, print, lambda: False))
    assert [photo.path for photo in desk.state.scene.photos] == [paths[0]]
    assert [photo.path for photo in desk.state.scene.rooms[0].photos] == list(paths[1:])


def test_what_holds_for_one_scene_is_nothing_for_another(info) -> None:
    shown = apply(State(), show.SceneArrived(info))
    word = Notify("a word")
    assert apply(shown, OfScene(1, word)).toasts and not apply(shown, OfScene(2, word)).toasts
    assert apply(State(), OfScene(0, word)).toasts and not apply(State(), OfScene(1, word)).toasts


def test_a_phrase_that_asks_for_a_place_comes_back_as_what_it_was(desk: Desk, info) -> None:
    """Not as its words, "like this (armchair)", which mean nothing."""
    desk.perform(show.SceneArrived(info))
    vector = np.array([0.6, 0.8, 0.0], np.float32).tobytes()
    similar = Prompt(5, "like this (armchair)", threshold=LIKE_THRESHOLD, like=vector)
    desk.state = desk.state.with_asking(prompts=(Prompt(0, "door"), similar))
    desk.perform(Notify("anything"))
    desk.pass_time(1.1 * KEEP_AFTER)
    desk.effects.close(desk.state, crashed=True)
    (file,) = state_folder().glob("session-*.json")
    kept = records.read(file)
    assert kept is not None
    kept = kept.with_photos((("/p/a.jpg", 60.0),))
    state = apply(apply(State(), keep.OfferSession(kept)), keep.EndSessionOffer(restore=True))
    assert [(photo.path, photo.fov) for photo in state.scene.photos] == [(Path("/p/a.jpg"), 60.0)]
    assert state.recovery.session is None
    door, again = state.asking.prompts
    assert (door.text, door.like, door.threshold) == ("door", b"", None)
    assert (again.text, again.like, again.threshold) == (similar.text, vector, LIKE_THRESHOLD)


def test_a_restored_session_goes_only_once_this_one_is_on_the_disk(desk: Desk, info) -> None:
    """Killed again within a second of coming back, a scene that nobody had saved was lost."""
    scene = state_folder() / "session-1-00000000.langflash"
    scene.parent.mkdir(parents=True)
    save(info.scene, scene)
    session = scene.with_suffix(".json")
    session.write_text(json.dumps({**BEFORE, "scene": str(scene)}))
    desk.effects.begin(DEFAULTS, "", empty=True)
    desk.perform(keep.EndSessionOffer(restore=True))
    desk.perform(scene_work.LoadScene(scene).run(3, print, lambda: False))
    desk.work()
    desk.written()  # and no time has passed
    (own,) = state_folder().glob("session-*.json")
    kept = records.read(own)
    assert own != session and not scene.exists() and kept is not None
    assert kept.scene == str(desk.keeper.scene_file) and desk.keeper.scene_file.is_file()


def test_edits_that_a_restored_session_names_stay_until_it_goes(desk: Desk, info) -> None:
    """Killed between the two, the session came back without its edits."""
    ended = Desk()
    ended.perform(show.SceneArrived(info))
    ended.perform(edit.Found(some(), "replace", "here"))
    ended.perform(edit.Delete())
    for _ in range(2):
        ended.pass_time(1.1 * KEEP_AFTER)
        ended.work()
    named = ended.state.recovery.kept
    ended.die()
    assert named is not None
    desk.effects.begin(DEFAULTS, "", empty=True)
    desk.perform(keep.EndSessionOffer(restore=True))
    desk.perform(scene_work.LoadScene(named.with_suffix(".langflash"), named).run(3, print, lambda: False))
    first = [each for each in desk.asked if isinstance(each, work.KeepEdits)]
    rest = [each for each in desk.asked if each not in first]
    desk.asked[:] = first
    desk.work()
    assert named.exists() and desk.state.recovery.kept not in (None, named)
    desk.asked[:] = rest
    desk.work()
    desk.written()
    (own,) = state_folder().glob("session-*.json")
    kept = records.read(own)
    assert kept is not None and kept.edits == str(desk.state.recovery.kept) and not named.exists()
