"""Nothing that is written or pressed is clipped or lies on anything else, in any panel or dialog."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.window import commands as do
from app.window.asking.state import Prompt
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.editing.state import Floaters, Hiding, Tint, Tool
from app.window.exporting import commands as export
from app.window.filming import commands as film
from app.window.frame import layout
from app.window.inventory import commands as take
from app.window.kit import theme
from app.window.recovery import commands as keep
from app.window.scene.state import Job, Photo
from app.window.state import State
from app.window.touring import commands as tour
from langflash_core.base import pictures
from langflash_core.base.outputs import OFFERED
from langflash_core.geometry.poses import Vector
from tests.app.window.headless import context, frames, look
from tests.app.window.rows import Rows, clipped, collisions
from tests.app.window.scenes import after
from tests.app.window.test_dialogs import opened
from tests.app.window.test_small_windows import OFFER, edited

SIZES = ((900, 560), (1280, 800))
LONG = "the small round wooden table with a white porcelain lamp beside the window"
NOTE = f'"{LONG}" is not a word this model knows well; try a more common word'


def asked() -> State:
    """Phrases of every kind: found, maybe, not found, unanswered, long, read in parts."""
    rows = (
        Prompt(901, "chair", score=0.93),
        Prompt(902, LONG, score=0.41, note=NOTE, reading="a chair, not red; near a window, and no lamp"),
        Prompt(903, "door", score=0.02, threshold=0.7),
        Prompt(904, "lamp"),
    )
    state = edited()
    return state.with_asking(prompts=rows, active=901)


def with_photos(count: int) -> State:
    photos = tuple(Photo(Path(f"/photos/a walk through the kitchen {k}.jpg")) for k in range(count))
    return edited().with_scene(photos=photos)


def working(stage: str) -> State:
    job = Job("Reconstructing", stage, 0.3, pausable=True)
    return with_photos(5).with_scene(job=job)


def with_dictionary(state: State) -> State:
    return replace(state, preferences=replace(state.preferences, dictionary_open=True))


PANELS: dict[str, State] = {
    "empty": State(),
    "shown": after(edited(), edit.Deselect()),
    "asked": asked(),
    "three photos": with_photos(3),
    "many photos": with_photos(40),
    "working": working("taking parallax from pairs of photos that see the same"),
    "brush": edited(tool=Tool.BRUSH),
    "clone": edited(tool=Tool.CLONE, source=(0.0, 0.0, 1.0)),
    "place": edited(tool=Tool.PLACE),
    "tint": edited(tint=Tint((0.8, 0.2, 0.2), 0.8)),
    "floaters": edited(floaters=Floaters(bytes(4 * 12_300))),
    "rules": edited(floaters=Floaters(bytes(4 * 12_300), open=True)),
    "hiding": edited(hiding=Hiding("blur")),
    "deleted": after(edited(), edit.Delete()),
    "dictionary": with_dictionary(edited()),
    "key frames": after(edited(), film.AddKey(), film.AddKey(), film.AddKey()),
    "tour": after(
        edited(), edit.Deselect(), tour.ShowTour(True), tour.AddStop(), tour.AddStop(),
        tour.AddNote("a note about the chair that goes on for longer than a line", Vector(0.0, 0.0, 1.0)),
    ),
    "inventory": after(edited(), take.ShowInventory(True)),
    "offer": after(edited(), edit.Deselect(), keep.OfferEdits(OFFER)),
    "exporting": after(edited(), export.ExportBegan(Path("/rooms/a film of the kitchen from the door.mp4"))),
    "told": after(edited(), do.Notify("The card is out of memory; close other programs."), do.Notify(NOTE)),
}  # fmt: skip
PANELS |= {
    f"as {mode.label}": asked().with_scene(mode=mode) for mode in pictures.PICTURES if mode.legend is not None
}
DIALOGS = {f"dialog {dialog.name}": opened(dialog) for dialog in Dialog}
DIALOGS |= {
    f"export of {what.label}": after(opened(Dialog.EXPORT), export.ShowExport(what)) for what in OFFERED
}


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("name", [*PANELS, *DIALOGS])
def test_rows_are_whole_and_apart(monkeypatch, name: str, size: tuple[int, int]) -> None:
    """Of a window that is as small as one of half a laptop's screen, and of the usual one."""
    state = (PANELS | DIALOGS)[name]
    if state.scene.info is not None:
        monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    rows = Rows(monkeypatch)
    with context(size):
        theme.set_up(1.0, "dark")
        frames(lambda seen: layout.draw_all(state, seen), look(), 12)
        found = rows.now()
        cut, on_each_other = [str(row) for row in found if clipped(row)], collisions(found)
    assert len(found) > 5
    assert cut == []
    assert [f"{one} and {other}" for one, other in on_each_other] == []
