"""Photos that come with the program, and where files about them go."""

from dataclasses import replace
from pathlib import Path

from app.window import commands as do
from app.window.dialogs import Dialog
from app.window.exporting.commands import ShowExport
from app.window.scene.samples import beside, pairs
from app.window.scene.state import Photo
from app.window.state import State
from tests.app.window.scenes import after, shown_scene


def test_files_go_beside_a_persons_photos_but_not_among_the_programs_own() -> None:
    assert beside(()) == Path.home() / "scene"
    assert beside((Photo(Path("/holidays/a.jpg")), Photo(Path("/b.jpg")))) == Path("/holidays/a.jpg")
    for _, (left, _) in pairs():
        assert beside((Photo(left),)) == Path.home() / left.name


def test_save_and_export_propose_that_place() -> None:
    state: State = shown_scene()
    assert state.scene.info is not None
    left = pairs()[0][1][0]
    state = state.with_scene(photos=(Photo(left),), info=replace(state.scene.info, path=None))
    assert Path(after(state, ShowExport()).exporting.form.path).parent == Path.home()
    assert Path(after(state, do.ShowDialog(Dialog.SAVE)).typed.text).parent == Path.home()
