"""The export form and the command line that it comes to."""

import errno
import shlex
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.dialogs import Dialog
from app.window.exporting import commands as export
from app.window.exporting import order as export_form
from app.window.exporting.effects import ExportingEffects
from app.window.exporting.process import Exporter
from app.window.recovery import commands as keep
from app.window.recovery.records import Keeper
from app.window.scene import camera
from app.window.scene import commands as show
from app.window.scene.near import photos_known
from app.window.scene.state import Photo
from app.window.state import State
from langflash_core.base import outputs
from langflash_core.base.outputs import OFFERED, ROOM, Output
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.edits import Atom, History, Marks, Mask
from tests.app.window.scene.test_rooms import Desk
from tests.app.window.scenes import after, of_photos, told, with_splats
from tests.app.window.scenes import shown_scene as scene


def form(state: State, **changes) -> State:
    return after(state, export.EditForm(replace(state.exporting.form, **changes)))


@pytest.mark.parametrize("what", (*OFFERED, *ROOM), ids=lambda what: what.name)
def test_every_kind_says_the_command_that_does_it(what: Output) -> None:
    order = ordered(scene(), what=what, path="/out/a picture")
    words, output = shlex.split(order.request.line), f"/out/a picture{what.suffix}"
    assert words[:5] == ["langflash", "export", "/rooms/my room.langflash", "-o", output]
    asked = what.needs_phrases or what is outputs.PAGE  # a page shows the phrases as asked
    assert ("--prompt" in words) == asked and ("--camera" in words) == what.looks
    assert ("--size" in words) == what.sized and ("--seconds" in words) == what.moves
    assert ("--segmented" in words) == (what is outputs.SEGMENTED)


def ordered(state: State, **changes) -> export_form.Order:
    """What a form comes to."""
    order = export_form.order(form(state, **changes))
    assert not isinstance(order, str), order
    return order


def test_what_fades_on_show_fades_in_files_unless_said_otherwise() -> None:
    def fades(near: bool, **changes) -> bool:
        state = of_photos(scene())
        state = replace(state, preferences=replace(state.preferences, near_photos=near))
        return ordered(state, path="/out/a picture", **changes).request.fade

    assert fades(True, what=outputs.RGB) and fades(True, what=outputs.VIDEO)
    assert not fades(False, what=outputs.RGB)
    assert fades(False, what=outputs.RGB, fade=True) and not fades(True, what=outputs.RGB, fade=False)
    assert not fades(True, what=outputs.PLY) and not fades(True, what=outputs.MASK)
    plan = after(form(of_photos(scene()), path="/out/a picture", what=outputs.RGB), camera.SwitchRays())
    assert plan.preferences.near_photos and not export_form.fades(plan), "a plan does not fade on show"


def test_gaps_are_filled_in_files_as_on_show() -> None:
    def fills(state: State, what: Output, **changes) -> bool:
        return ordered(state, path="/out/a picture", what=what, **changes).request.fill

    state = of_photos(scene())
    kinds = {what for what in OFFERED if fills(state, what)}
    assert kinds == {outputs.RGB, outputs.HEAT, outputs.VIDEO, outputs.WEBP, outputs.HEAT_VIDEO}
    assert not fills(state, outputs.VIDEO, only_found=True), "around a thing on its own is no gap"
    assert not fills(replace(state, preferences=replace(state.preferences, fill_gaps=False)), outputs.RGB)
    assert not fills(scene(), outputs.RGB)


def test_what_no_photo_made_does_not_fade_since_its_file_does_not_say_where_photos_looked() -> None:
    for fade in (None, True):
        assert not ordered(scene(), path="/out/a picture", what=outputs.RGB, fade=fade).request.fade
    marks = scene().editing.marks
    assert marks is not None
    merged = torch.zeros(marks.there[0], dtype=torch.int64)
    merged[-9:] = -1
    state = with_splats(scene(), view_ids=merged)
    assert not photos_known(state)
    undone = replace(marks, there=(len(merged) - 9, marks.there[1]))
    editing = replace(state.editing, history=History(undone))
    assert photos_known(replace(state, editing=editing))


def wrong(state: State) -> str:
    """What the form lacks."""
    looked = export.TargetLookedUp(export_form.look_up(state)).apply(state)
    order = export_form.order(looked)
    assert isinstance(order, str), order
    return order


def test_what_is_missing_is_said() -> None:
    assert "no scene" in wrong(State())
    assert "file name" in wrong(form(scene(), path=" "))
    assert "is the scene itself" in wrong(form(scene(), what=outputs.SCENE, path="/rooms/my room"))
    silent = after(scene(), ask.EditPrompt(0, ""))
    assert "needs a phrase" in wrong(form(silent, what=outputs.MASK, path="/x"))
    assert "no phrase to export" in wrong(form(silent, what=outputs.PLY, only_found=True, path="/x"))
    assert "save it first" in wrong(form(scene(None), path="/x"))


def test_the_view_on_show_or_all_photos() -> None:
    state = form(after(scene(), camera.JumpTo(1)), path="/out/x.png")
    for each in (state, after(state, camera.MoveTo(Pose(Vector(0.0, 0.0, -1.0))))):
        assert ordered(each).camera_file == Path("/out/x.camera.json")
    every = ordered(state, all_views=True)
    assert every.request.all_views and every.camera_file is None


def test_the_view_on_show_has_the_shape_of_the_window() -> None:
    """It had that of a photo, and what the window shows beside it was cut off."""
    state = form(scene(), side=1024, path="/out/x.png")
    assert state.scene.pose.aspect == pytest.approx(4 / 3)
    wide = replace(state, stats=replace(state.stats, picture_size=(1200, 600)))
    assert ordered(wide).request.size == (1024, 512)
    every, undrawn = ordered(wide, all_views=True), ordered(state)
    assert every.request.size == undrawn.request.size == (1024, 768)  # of photos; before the first picture


def test_an_unsaved_scene_is_read_from_its_copy() -> None:
    state = form(after(scene(None), keep.CopyAt(Path("/state/copy.langflash"))), path="/x")
    assert ordered(state).request.scene == Path("/state/copy.langflash")
    assert "copy" in export_form.remarks(state)[0]


def test_unsaved_edits_and_a_selection_are_read_from_their_copies() -> None:
    plain = scene()
    marks = Marks.without_edits(8, 3)
    selected = replace(marks, selected=Mask.full(8), atoms=(Atom(0, "sofa"), *marks.atoms[1:]))
    editing = replace(plain.editing, history=History(selected), saved=marks)
    state = form(replace(plain, editing=editing), what=outputs.PLY, path="/x")
    assert state.editing.unsaved and "save it first" in str(export_form.order(state))  # before the copies
    state = after(state, export.CopiesAt(Path("/s/edited.langflash"), Path("/s/selection.langflash")))
    assert ordered(state).request.scene == Path("/s/edited.langflash")
    assert "edits are not saved" in export_form.remarks(state)[0]
    state = form(state, only_selected=True)
    assert ordered(state).request.scene == Path("/s/selection.langflash")
    assert "selection is not saved" in export_form.remarks(state)[0]
    nothing = replace(state.editing, history=History(marks))
    again = after(replace(state, editing=nothing), export.ShowExport())
    assert not again.exporting.form.only_selected and again.dialog is Dialog.EXPORT


def test_an_export_is_followed_to_its_end() -> None:
    state = after(scene(), export.ShowExport(), export.ExportBegan(Path("/x.png")))
    assert state.dialog is None and state.exporting.running is not None
    state = after(state, export.ExportProgressed("drawing", 1.5))
    assert state.exporting.running is not None and state.exporting.running.fraction == 1.0
    assert told(after(state, export.ExportEnded(0, "/x.png", ""))) == "Exported /x.png"
    assert told(after(state, export.ExportEnded(2, "", "no room on the disk"))) == "no room on the disk"
    stopped = after(state, export.CancelExport(), export.ExportEnded(130, "", ""))
    assert stopped.exporting.running is None and "nothing was written" in told(stopped)
    assert "no scene" in told(after(State(), export.ShowExport()))


def test_a_long_export_says_how_long_it_takes() -> None:
    state = after(replace(scene(), now=100.0), export.ExportBegan(Path("/x.mp4")))
    running = after(state, export.ExportProgressed("drawing", 0.25)).exporting.running
    assert running is not None and running.told(101.0) == "drawing"
    assert running.told(160.0) == "about 3 min left"
    assert replace(running, cancelling=True).told(160.0) == "stopping"


def test_an_export_never_replaces_a_photo() -> None:
    """Neither by the name it offers, nor by one that is typed, nor by one of several views' files."""
    photos = (Photo(Path("/p/left.png")), Photo(Path("/p/left_1.png")))
    state = scene(None).with_scene(photos=photos)
    state = after(state, keep.CopyAt(Path("/state/copy.langflash")), export.ShowExport())
    assert state.exporting.form.path == "/p/left_picture.png"
    ordered(state)
    for path in ("/p/left.png", "/p/left"):
        assert "photo" in wrong(form(state, path=path))
    views = form(state, path="/p/left.png", all_views=True)
    assert "photo" in wrong(views.with_scene(photos=photos[1:]))


def written(state: State) -> set[Path]:
    return set(ordered(state).files)


@pytest.mark.parametrize("all_views", [False, True])
@pytest.mark.parametrize("moved", [False, True])
def test_no_two_kinds_write_the_same_file(all_views: bool, moved: bool) -> None:
    """A legend, the pictures of COCO masks and camera files among them."""
    state = after(scene(), export.ShowExport())
    state = after(state, camera.MoveTo(Pose(Vector(0.0, 0.0, -1.0)))) if moved else state
    taken: dict[Path, Output] = {}
    for what in (*OFFERED, *reversed(OFFERED)):
        state = form(state, what=what, all_views=all_views)
        for file in written(state):
            assert taken.setdefault(file, what) is what, file
    assert Path("/rooms/my room_labels.json") in taken or all_views


def test_what_a_kind_writes_beside_its_file() -> None:
    state = form(scene(), what=outputs.LABELS, path="/x/a.png")
    assert written(state) == {Path("/x/a.png"), Path("/x/a.json"), Path("/x/a.camera.json")}
    every = form(state, all_views=True)
    assert written(every) == {Path(f"/x/a_{n}.{kind}") for n in (1, 2) for kind in ("png", "json")}
    coco = form(scene(), what=outputs.COCO, path="/x/a.json")
    assert written(coco) == {Path("/x/a.json"), Path("/x/a_1.png"), Path("/x/a.camera.json")}
    ply = form(scene(), what=outputs.PLY, path="/x/a.ply")
    assert written(ply) == {Path("/x/a.ply"), Path("/x/a.language.safetensors")}


def test_a_name_of_ones_own_is_kept_for_its_scene_and_named_by_kind() -> None:
    state = form(after(scene(), export.ShowExport()), path="/out/x.png")
    state = form(state, what=outputs.MASK)
    assert state.exporting.form.path == "/out/x_mask.png"
    assert form(state, what=outputs.VIDEO).exporting.form.path == "/out/x_film.mp4"
    folder = form(state, what=outputs.SEGMENTED)
    assert folder.exporting.form.path == "/out/x_segmented"
    assert form(folder, what=outputs.RGB).exporting.form.path == "/out/x_picture.png"
    again = after(state, do.ShowDialog(None), export.ShowExport())
    assert again.exporting.form.path == "/out/x_mask.png"


def test_a_folder_may_be_there_already_and_is_asked_about(tmp_path) -> None:
    state = form(scene(), what=outputs.SEGMENTED, path=str(tmp_path))
    assert export_form.there(ordered(state)) == (tmp_path,)
    every = ordered(state, all_views=True).request.words()
    assert not {"--all-views", "--view", "--camera"} & set(every)


def test_the_name_follows_the_scene() -> None:
    """Also one that was typed: it was for the scene before. A saved scene gives its name at once."""
    first = after(scene(), export.ShowExport())
    assert first.exporting.form.path == "/rooms/my room_picture.png"
    assert first.scene.info is not None
    other = replace(first.scene.info, serial=2, path=Path("/rooms/kitchen.langflash"))
    for state in (first, form(first, path="/out/x.png")):
        state = after(state, do.ShowDialog(None), show.SceneArrived(other), export.ShowExport())
        assert state.exporting.form.path == "/rooms/kitchen_picture.png"
    saved = after(first, show.SceneSaved(Path("/else/hall.langflash")), export.ShowExport())
    assert saved.exporting.form.path == "/else/hall_picture.png"


def test_it_is_asked_before_a_file_is_replaced(monkeypatch, folders: Path) -> None:
    path = folders / "room.langflash"
    ran = []
    monkeypatch.setattr(Exporter, "start", lambda _, words: ran.append(words))
    state = form(scene(path), what=outputs.LABELS, path=str(folders / "a.png"))
    desk = Desk(state, lambda hands, _world: ExportingEffects(hands, Keeper()))
    desk.perform(export.Export())
    assert len(ran) == 1 and "--replace" not in ran[0]
    desk.perform(export.ExportEnded(0, "done", ""))
    (folders / "a.json").write_text("boxes")  # where the legend would go
    desk.perform(export.Export())
    assert len(ran) == 1 and desk.state.dialog is Dialog.REPLACE
    assert desk.state.exporting.there == (folders / "a.json", folders / "a.camera.json")
    desk.perform(do.ShowDialog(Dialog.EXPORT))
    assert desk.state.exporting.form.path == str(folders / "a.png")
    desk.perform(export.Export(sure=True))
    assert len(ran) == 2 and "--replace" in ran[1] and desk.state.dialog is None


@pytest.mark.parametrize("by", ["end", "close"])
def test_an_export_that_failed_leaves_no_camera_behind(monkeypatch, folders: Path, by: str) -> None:
    """The next try asked whether to replace it."""
    monkeypatch.setattr(Exporter, "start", lambda *_: None)
    state = form(scene(folders / "room.langflash"), path=str(folders / "a.png"))
    desk = Desk(state, lambda hands, _world: ExportingEffects(hands, Keeper()))
    camera = folders / "a.camera.json"
    for before in (None, "mine"):
        if before:
            camera.write_text(before)
        desk.perform(export.Export(sure=True))
        assert camera.exists()
        if by == "close":
            monkeypatch.setattr(Exporter, "running", True)
            desk.effects[0].close(desk.state, crashed=False)
            monkeypatch.setattr(Exporter, "running", False)
        desk.perform(export.ExportEnded(2, "", "not found in this view: chair; lower --threshold"))
        assert camera.exists() is bool(before)
    assert [toast.text for toast in desk.state.toasts][
        -1
    ] == "not found in this view: chair; lower its threshold"


def test_an_export_that_cannot_be_started_leaves_no_camera_behind(monkeypatch, folders: Path) -> None:
    def start(*_) -> None:
        raise OSError(errno.ENOMEM, "Cannot allocate memory")

    monkeypatch.setattr(Exporter, "start", start)
    state = form(scene(folders / "room.langflash"), path=str(folders / "a.png"))
    desk = Desk(state, lambda hands, _world: ExportingEffects(hands, Keeper()))
    desk.perform(export.Export(sure=True))
    assert "cannot be started: Cannot allocate" in desk.state.toasts[-1].text
    assert not (folders / "a.camera.json").exists()


def test_a_heat_map_is_exported_in_the_window_s_own_colours() -> None:
    state = form(scene(), what=outputs.HEAT, path="/out/heat")
    assert not {"--colormap", "--span"} & set(ordered(state).request.words())
    own = keep.Prefer(replace(state.preferences, colormap="viridis"))
    order = ordered(after(state, own, ask.SetSpan((0.25, 0.9))))
    assert "--colormap viridis --span 0.25,0.9" in order.request.line
    assert "--colormap" not in ordered(after(state, own), what=outputs.MASK).request.words()
