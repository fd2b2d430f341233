"""The pictures of the README's tour, made again with one command:

    python -m tests.tools.tour assets/readme

A window on a screen of its own is told what a person would do there with the shipped photos of the
living room, and photographed each time it rests.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.editing import commands as edit
from app.window.editing import pointing as point
from app.window.editing.state import Region, Tool
from app.window.exporting import commands as export
from app.window.recovery import commands as keep
from app.window.recovery.state import Kept
from app.window.scene import camera
from app.window.scene import commands as show
from app.window.session import Session
from langflash_core.base import outputs, pictures
from langflash_core.base.pictures import PICTURES
from langflash_core.base.resources import asset_path
from langflash_core.geometry import poses
from tests.app.window.test_window import TOP, x_server
from tests.app.window.x11 import Client
from tests.tools.sheet import Shot, write_picture, write_sheet

SIZE = (1280, 800)
LEFT, BOTTOM = 348, 32  # of the picture's place, pixels
PHOTOS = tuple(asset_path(f"photos/living_room_{side}.png") for side in ("left", "right"))
PHRASES = ("plant", "window", "floor", "picture")
PLANT, FLOOR = (420.0, 330.0), (260.0, 640.0)  # pixels of the picture's place
PATIENCE = 300.0  # seconds
MODES = tuple((picture, picture.label) for picture in PICTURES)


class Guide:
    """Tells the window what to do and photographs it."""

    def __init__(self, display: str) -> None:
        self._client = Client(display)
        self.session = Session((), SIZE)

    def tell(self, *commands: do.Command) -> None:
        for command in commands:
            self.session.dispatch(command)
            self.steps(0.3)

    def steps(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.session.step(0.05)

    def until(self, holds: Callable[[], bool], what: str) -> None:
        end = time.monotonic() + PATIENCE
        while not holds():
            assert time.monotonic() < end, f"waited for {what}"
            self.session.step(0.05)

    def rest(self) -> None:
        """Until the picture is full, every phrase has a score, and nothing is under way."""
        full = (SIZE[0] - LEFT, SIZE[1] - TOP - BOTTOM)

        def settled() -> bool:
            state = self.session.state
            answered = (
                all(prompt.score is not None for prompt in state.asking.asked) or not state.scene.mode.answers
            )
            quiet = not (state.scene.job or state.scene.flight or state.editing.waiting)
            return quiet and answered and state.stats.picture_size == full

        self.steps(1.0)
        self.until(settled, "rest")
        self.steps(1.0)

    def screen(self) -> np.ndarray:
        self.session.state = replace(self.session.state, toasts=())
        self.steps(0.5)
        self._client.picture(1, 1)
        return self._client.picture(*SIZE)

    def canvas(self) -> np.ndarray:
        return self.screen()[TOP : SIZE[1] - BOTTOM, LEFT:]

    @property
    def keys(self) -> list[int]:
        return [prompt.key for prompt in self.session.state.asking.prompts]

    def ask(self, *phrases: str) -> None:
        """These phrases instead of the present ones."""
        for key in self.keys:
            self.tell(ask.RemovePrompt(key))
        for phrase in phrases[:-1]:  # at once: a row that has the keys would keep what is typed there
            self.session.state = ask.EditPrompt(self.keys[-1], phrase).apply(self.session.state)
            self.session.state = ask.CaretTaken().apply(ask.AddPrompt().apply(self.session.state))
        self.tell(ask.EditPrompt(self.keys[-1], phrases[-1]), ask.SelectPrompt(self.keys[0]))

    def close(self) -> None:
        self.session.close()
        self._client.close()


def hero(guide: Guide, folder: Path) -> None:
    """The first picture of the README."""
    guide.ask("plant")
    guide.tell(camera.SetMode(pictures.HEAT))
    guide.rest()
    write_picture(guide.screen(), folder / "hero.png")


def modes(guide: Guide, folder: Path) -> None:
    """One sheet of every mode."""
    guide.ask(*PHRASES)
    shots = []
    for mode, caption in MODES:
        guide.tell(ask.ShowAtom(atom_of(guide, "plant")) if mode is pictures.WEIGHT else camera.SetMode(mode))
        guide.rest()
        shots.append(Shot(caption, guide.canvas()))
    write_sheet(shots, folder / "tour_modes.png", columns=_columns(len(shots)), width=260, numbered=False)


def _columns(count: int) -> int:
    """Four or five a row, whichever leaves fewer places empty."""
    return min((5, 4), key=lambda columns: -count % columns)


def atom_of(guide: Guide, word: str) -> int:
    """The atom whose nearest words have this one first, else the first atom."""
    guide.until(lambda: bool(guide.session.state.editing.names), "the words of the atoms")
    names = guide.session.state.editing.names
    return next((k for k, words in enumerate(names) if word in words), 0)


def asking(guide: Guide, folder: Path) -> None:
    guide.ask("plant", "window", "armchair")
    guide.tell(camera.SetMode(pictures.LABELS))
    guide.rest()
    write_picture(guide.screen(), folder / "tour_ask.png")


def pointing(guide: Guide, folder: Path) -> None:
    guide.ask("plant")
    guide.tell(camera.SetMode(pictures.RGB), point.SetTool(Tool.POINT), point.Ask(PLANT))
    guide.until(
        lambda: bool(guide.session.state.editing.card and guide.session.state.editing.card.words), "words"
    )
    guide.steps(1.0)
    write_picture(guide.screen(), folder / "tour_point.png")
    guide.tell(point.CloseCard(), point.SetTool(Tool.MOVE))


def editing(guide: Guide, folder: Path) -> None:
    brush = (FLOOR, (FLOOR[0] + 120, FLOOR[1] - 40))
    guide.tell(edit.SelectByPhrase(guide.keys[0]))
    guide.rest()
    guide.tell(
        edit.Hide(), edit.Undo(), edit.SelectRegion(Region(brush, 40.0), "add"), point.SetTool(Tool.BRUSH)
    )
    guide.rest()
    write_picture(guide.screen(), folder / "tour_edit.png")
    guide.tell(edit.GoTo(0), point.SetTool(Tool.MOVE))


def dictionary(guide: Guide, folder: Path) -> None:
    guide.tell(ask.OpenDictionary(True), camera.SetMode(pictures.ATOMS))
    guide.until(lambda: guide.session.state.asking.insight is not None, "the atoms' description")
    guide.rest()
    write_picture(guide.screen(), folder / "tour_dictionary.png")
    guide.tell(ask.OpenDictionary(False))


def trust(guide: Guide, folder: Path) -> None:
    aside = poses.orbit(guide.session.state.scene.pose, 0.35, -0.1)
    guide.tell(camera.SetMode(pictures.COVERAGE), camera.MoveTo(aside))
    guide.rest()
    write_picture(guide.screen(), folder / "tour_trust.png")
    guide.tell(camera.JumpTo(0))


def exporting(guide: Guide, folder: Path) -> None:
    guide.tell(show.SceneSaved(Path("room.langflash")), camera.SetMode(pictures.HEAT), export.ShowExport())
    form = replace(guide.session.state.exporting.form, what=outputs.CUTOUT, path="plant.png")
    guide.tell(export.EditForm(form))
    guide.rest()
    write_picture(guide.screen(), folder / "tour_export.png")
    guide.tell(do.ShowDialog(None))


def recovery(guide: Guide, folder: Path) -> None:
    kept = Kept(
        tuple(map(str, PHOTOS)), (None, None), "room.langflash", name="living room", phrases=("plant",)
    )
    guide.tell(keep.OfferSession(kept))
    guide.steps(1.0)
    write_picture(guide.screen(), folder / "tour_recovery.png")
    guide.tell(keep.EndSessionOffer(False))


TOUR = (hero, modes, asking, pointing, editing, dictionary, trust, exporting)


def main() -> int:
    folder = Path(sys.argv[1]).resolve()
    wanted = [each for each in TOUR if len(sys.argv) < 3 or each.__name__ in sys.argv[2:]]
    with tempfile.TemporaryDirectory(prefix="tour-") as place, x_server(*SIZE) as display:
        os.environ.update(DISPLAY=display, LANGFLASH_CONFIG=place, LANGFLASH_STATE=place, HOME=place)
        guide = Guide(display)
        recovery(guide, folder)
        guide.tell(show.OpenPaths(tuple(map(str, PHOTOS))))
        guide.until(lambda: guide.session.state.scene.info is not None, "the scene")
        for each in wanted:
            each(guide, folder)
        guide.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
