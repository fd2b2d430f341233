"""Photos that come with the program, and where files about them go."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.places import state_folder
from app.window import commands as do
from app.window.dialogs import Dialog
from app.window.exporting.commands import ShowExport
from app.window.scene.samples import beside, pairs
from app.window.scene.state import Photo
from app.window.state import State
from langflash_core.base.resources import home_folder
from tests.app.window.scenes import after, shown_scene


def test_files_go_beside_a_persons_photos_but_not_among_the_programs_own() -> None:
    assert beside(()) == Path.home() / "scene.langflash"
    for label, sides in pairs():
        name = label.lower().replace(" ", "_")
        assert beside([Photo(side) for side in sides]) == Path.home() / f"{name}.langflash"
    pasted = state_folder() / "pasted" / "0001.png", state_folder() / "pasted" / "0002.png"
    assert beside([Photo(path) for path in pasted]) == Path.home() / "scene.langflash"


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("0000.png", "0006.png", "0031.png"), "loft.langflash"),
        (("IMG_0001.JPG", "IMG_0002.JPG"), "loft.langflash"),
        (("a.jpg", "b.jpg"), "loft.langflash"),
        (("attic_left.jpg", "attic_lamp.jpg"), "attic.langflash"),
        (("attic 01.jpg", "attic 02.jpg"), "attic.langflash"),
        (("IMG_0001.jpg",), "IMG_0001.langflash"),
        (("old.walk.mp4 @ 03.27 s.jpg", "old.walk.mp4 @ 10.00 s.jpg"), "old.walk.langflash"),
        (("one.mp4 @ 03.27 s.jpg", "two.mp4 @ 10.00 s.jpg"), "loft.langflash"),
    ],
)
def test_a_scene_is_called_by_words_of_its_photos_or_as_their_folder(
    names: tuple[str, ...], expected: str
) -> None:
    assert beside([Photo(Path("/photos/loft") / name) for name in names]) == Path("/photos/loft") / expected


def test_a_film_goes_home_and_not_among_frames_that_are_thrown_away() -> None:
    frames = home_folder() / "films" / "0a1b", ("walk.mp4 @ 03.27 s.jpg", "walk.mp4 @ 10.00 s.jpg")
    assert beside([Photo(frames[0] / name) for name in frames[1]]) == Path.home() / "walk.langflash"


def test_save_and_export_propose_that_place() -> None:
    state: State = shown_scene()
    assert state.scene.info is not None
    left = pairs()[0][1][0]
    state = state.with_scene(photos=(Photo(left),), info=replace(state.scene.info, path=None))
    assert Path(after(state, ShowExport()).exporting.form.path).parent == Path.home()
    assert Path(after(state, do.ShowDialog(Dialog.SAVE)).typed.text).parent == Path.home()
