"""From launch to an answer with nothing but a pointer and a keyboard, recorded.

    python -m tests.tools.journey assets/readme/journey.png

The program is the one that people start, `python -m app view`; it is seen only on the screen.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from app.window.kit import theme
from langflash_core.base.resources import asset_path
from tests.app.window.guarded import environment
from tests.app.window.test_window import ROOT, x_server
from tests.app.window.x11 import Client
from tests.tools.sheet import Shot, write_sheet

SIZE = (1280, 800)
PHOTOS = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
PATIENCE = 180.0  # seconds; an upper bound for a busy machine, never waited for in full
LEFT, TOP = int(theme.PANEL_WIDTH), 52
REST = 2.0  # seconds without a change or work: longer than the window waits before it draws the full picture


class Person:
    """One window, the hands on it and the eyes before it."""

    def __init__(
        self,
        display: str,
        folder: Path,
        size: tuple[int, int] = SIZE,
        words: tuple[str, ...] = (),
        code: Path = ROOT,
    ) -> None:
        self.size = size
        self._environment = {**environment(folder, code), "DISPLAY": display}
        self._environment.pop("WAYLAND_DISPLAY", None)
        self.started = time.perf_counter()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "app", "view", *words], env=self._environment, cwd=folder
        )
        self._client = Client(display)
        self.window = 0

    def see(self) -> np.ndarray:
        """The screen, (h, w, 3) uint8."""
        return self._client.picture(*self.size)

    @property
    def canvas(self) -> np.ndarray:
        """The picture's place on the screen."""
        return self.see()[TOP : self.size[1] - int(theme.STATUS_HEIGHT), LEFT:]

    def until(self, holds: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
        """Wait for something to be seen."""
        assert self.comes(holds, patience), f"waited for {what}"

    def comes(self, holds: Callable[[], bool], patience: float) -> bool:
        """Whether something is seen in time."""
        end = time.monotonic() + patience
        while not holds():
            assert self.process.poll() is None, "the program has ended"
            if time.monotonic() > end:
                return False
            time.sleep(0.01)
        return True

    def until_first_frame(self) -> float:
        """Wait for a window with something written in it; returns seconds since the launch."""
        self.until(lambda: len(np.unique(self.see()[: self.size[1] // 2, :LEFT])) > 20, "the first frame")
        seconds = time.perf_counter() - self.started
        self.window = int(self.do("search", "--sync", "--name", "LangFlash").split()[0])
        where = str(self.window)
        self.do("windowmove", where, "0", "0", "windowsize", where, *map(str, self.size))
        self.do("windowfocus", "--sync", where)
        return seconds

    def rest(self) -> np.ndarray:
        """The screen, once its picture stays the same and most looks at the program find no thread that runs
        or would: a full picture may take many seconds, the frames of a blinking cursor take few of them."""
        end = time.monotonic() + PATIENCE
        before, since, looks = self.canvas, time.monotonic(), [False]
        while time.monotonic() < end:
            time.sleep(0.1)
            now = self.canvas
            looks.append(runs(self.process.pid))
            if not np.array_equal(now, before) or sum(looks) > len(looks) / 2:
                before, since, looks = now, time.monotonic(), [False]
            elif time.monotonic() - since > REST:
                break
        return self.see()

    def title(self) -> str:
        return self.do("getwindowname", str(self.window)).strip()

    def drop(self, paths: list[Path]) -> None:
        """Files from a file manager onto the picture's place."""
        self._client.drop(self.window, paths, ((LEFT + self.size[0]) // 2, self.size[1] // 2), PATIENCE)

    def do(self, *words: str) -> str:
        """What xdotool can do."""
        done = subprocess.run(["xdotool", *words], env=self._environment, capture_output=True, text=True)
        return done.stdout

    def click(self, x: int, y: int) -> None:
        self.do("mousemove", str(x), str(y), "sleep", "0.2", "click", "1")

    def type(self, phrase: str) -> None:
        """Into the first phrase's field, over what it holds. The pauses let a busy machine see the
        click before the keys."""
        self.click(*self.field)
        time.sleep(1.0)
        self.do("key", "ctrl+a")
        self.do("type", "--delay", "60", phrase)
        time.sleep(1.0)

    @property
    def field(self) -> tuple[int, int]:
        """Where the first phrase is typed, beside its swatch in the accent colour."""
        panel = self.see()[: self.size[1] - 40, 18:40].astype(int)
        accent = np.array([255 * c for c in (0.96, 0.62, 0.16)])
        rows = np.flatnonzero((abs(panel - accent).max(-1) < 6).all(1))
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        return 140, int(runs[-1].mean())  # above it, a button may have that colour

    def leave(self) -> int:
        """Close the window for good."""
        self.process.terminate()
        self._client.close()
        return self.process.wait(PATIENCE)


@contextmanager
def person(size: tuple[int, int] = SIZE, words: tuple[str, ...] = (), code: Path = ROOT) -> Iterator[Person]:
    """A program just launched on a screen of its own, with folders of its own. code: where it is."""
    with tempfile.TemporaryDirectory(prefix="journey-") as place, x_server(*size) as display:
        someone = Person(display, Path(place).resolve(), size, words, code)
        try:
            yield someone
        finally:
            someone.leave()


def runs(process: int) -> bool:
    """Whether a thread of a process, or of those that it started, is at work or waits for its turn."""
    parents: dict[int, int] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it ended meanwhile
            parents[int(path.parent.name)] = int(_stat(path)[1])
    family = {process}
    while more := {child for child, parent in parents.items() if parent in family} - family:
        family |= more
    for member in family:
        with suppress(OSError):
            if any(_stat(path)[0] in "RD" for path in Path(f"/proc/{member}/task").glob("*/stat")):
                return True
    return False


def _stat(path: Path) -> list[str]:
    """State, parent and on: what stands after the name, which may hold spaces."""
    return path.read_text().rpartition(")")[2].split()


def lit(canvas: np.ndarray) -> np.ndarray:
    """(h, w) bool: what the heat-map marks in yellow; nothing in the grey photos is."""
    red, green, blue = np.moveaxis(canvas.astype(int), -1, 0)
    return (red > 120) & (red > blue + 24) & (green > blue + 16)


def walk(someone: Person) -> Iterator[Shot]:
    """The steps, each as it is seen."""
    someone.until_first_frame()
    yield Shot("Launch: an empty window", someone.rest())
    someone.drop(PHOTOS)
    time.sleep(4.0)  # some stages on
    yield Shot("Two photos dropped: it starts at once", someone.see())
    someone.until(lambda: "living_room_left" in someone.title(), "the scene")
    yield Shot("The scene, from the first photo's view", someone.rest())
    someone.type("pla")
    yield Shot("Typing", someone.see())
    for _ in range(3):  # again where a busy machine lost the click or a key
        someone.type("plant")
        if someone.comes(lambda: lit(someone.canvas).mean() > 0.01, PATIENCE / 3):
            break
    someone.do("mousemove", str(someone.size[0] - 40), str(TOP + 40))
    yield Shot("The answer: where the plant is", someone.rest())
    middle = (str((LEFT + someone.size[0]) // 2), str(someone.size[1] // 2))
    dragged = "mousedown 1 mousemove_relative 60 -25 sleep 0.3 mouseup 1"
    someone.do("mousemove", *middle, *dragged.split())
    yield Shot("The same from another place", someone.rest())


def main() -> int:
    with person() as someone:
        write_sheet(list(walk(someone)), Path(sys.argv[1]), columns=3, width=480)
    return 0


if __name__ == "__main__":
    sys.exit(main())
