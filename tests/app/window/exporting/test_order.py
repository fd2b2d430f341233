"""The export form and the command line that it comes to."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from app.window.asking import commands as ask
from app.window.exporting import commands as export
from app.window.exporting import order as export_form
from app.window.exporting.state import What
from app.window.poses import Pose, Vector
from app.window.recovery import commands as keep
from app.window.scene import camera
from app.window.scene.state import Photo
from app.window.state import State
from langflash_core.scene.edits import Atom, History, Marks, Mask
from tests.app.window.scenes import after, told
from tests.app.window.scenes import shown_scene as scene


def form(state: State, **changes) -> State:
    return after(state, export.EditForm(replace(state.exporting.form, **changes)))


@pytest.mark.parametrize("what", What)
def test_every_kind_says_the_command_that_does_it(what: What) -> None:
    state = form(scene(), what=what, path="/out/a picture")
    order = export_form.order(state)
    assert not isinstance(order, str)
    words = shlex.split(order.line)
    assert words[:5] == [
        "langflash",
        "export",
        "/rooms/my room.langflash",
        "-o",
        f"/out/a picture{what.suffix}",
    ]
    assert ("--prompt" in words) == what.needs_phrases and ("--view" in words) == what.looks
    assert ("--size" in words) == what.sized and ("--seconds" in words) == (what is What.VIDEO)


def wrong(state: State) -> str:
    """What the form lacks."""
    order = export_form.order(state)
    assert isinstance(order, str), order
    return order


def test_what_is_missing_is_said() -> None:
    assert "no scene" in wrong(State())
    assert "file name" in wrong(form(scene(), path=" "))
    assert "is the scene itself" in wrong(form(scene(), what=What.SCENE, path="/rooms/my room"))
    silent = after(scene(), ask.EditPrompt(0, ""))
    assert "needs a phrase" in wrong(form(silent, what=What.MASK, path="/x"))
    assert "no phrase to keep" in wrong(form(silent, what=What.PLY, only_found=True, path="/x"))
    assert "save it first" in wrong(form(scene(None), path="/x"))


def test_the_view_on_show_a_camera_of_its_own_or_all_photos() -> None:
    state = form(after(scene(), camera.JumpTo(1)), path="/out/x.png")
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[order.words.index("--view") + 1] == "1"
    moved = export_form.order(after(state, camera.MoveTo(Pose(Vector(0.0, 0.0, -1.0)))))
    assert not isinstance(moved, str) and moved.camera_file == Path("/out/x.camera.json")
    every = export_form.order(form(state, all_views=True))
    assert not isinstance(every, str) and "--all-views" in every.words and every.camera_file is None


def test_a_new_kind_takes_its_own_ending_and_an_unsaved_scene_its_copy() -> None:
    state = form(form(scene(), path="/out/x.png"), what=What.VIDEO)
    assert state.exporting.form.path == "/out/x.mp4"
    state = form(after(scene(None), keep.CopyAt(Path("/state/copy.langflash"))), path="/x")
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[1] == "/state/copy.langflash"
    assert "copy" in export_form.remarks(state)[0]


def test_unsaved_edits_and_a_selection_are_read_from_their_copies() -> None:
    plain = scene()
    marks = Marks.untouched(8, 3)
    selected = replace(marks, selected=Mask.full(8), atoms=(Atom(0, "sofa"), *marks.atoms[1:]))
    editing = replace(plain.editing, history=History(selected), saved=marks)
    state = form(replace(plain, editing=editing), what=What.PLY, path="/x")
    assert state.editing.unsaved and "save it first" in str(export_form.order(state))  # before the copies
    state = after(state, export.CopiesAt(Path("/s/edited.langflash"), Path("/s/selection.langflash")))
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[1] == "/s/edited.langflash"
    assert "edits are not saved" in export_form.remarks(state)[0]
    state = form(state, only_selected=True)
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[1] == "/s/selection.langflash"
    assert "selection is not saved" in export_form.remarks(state)[0]
    nothing = replace(state.editing, history=History(marks))
    again = after(replace(state, editing=nothing), export.ShowExport())
    assert not again.exporting.form.only_selected and again.dialog == "export"


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


def test_an_export_never_replaces_a_photo() -> None:
    """Neither by the name it offers, nor by one that is typed, nor by one of several views' files."""
    photos = (Photo(Path("/p/left.png")), Photo(Path("/p/left_1.png")))
    state = replace(scene(None), photos=photos)
    state = after(state, keep.CopyAt(Path("/state/copy.langflash")), export.ShowExport())
    assert state.exporting.form.path == "/p/left_view.png"
    assert not isinstance(export_form.order(state), str)
    for path in ("/p/left.png", "/p/left"):
        assert "photo" in str(export_form.order(form(state, path=path)))
    views = form(state, path="/p/left.png", all_views=True)
    assert "photo" in str(export_form.order(replace(views, photos=photos[1:])))
