"""How late frames come, from launch to the end of a first phrase, an orbit and three exports.

    python -m tests.tools.frames [--size 1280x800] [--code FOLDER ...] [--photos A B]

A real X server, real mouse and keys. The gap of a frame is the time since the frame before it, less the time
that the loop slept with nothing to do: what a person would have waited for at the worst. Each FOLDER is a
version of the program to measure; they follow each other in one run.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from langflash_core.base.resources import asset_path
from tests.app.window.guarded import HOMES
from tests.app.window.test_window import ROOT, Program, x_server

PHOTOS = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
PATIENCE = 240.0
LATE = 0.25  # seconds
WORST = 8  # gaps that are printed


@dataclass(frozen=True)
class Gap:
    """A frame that came late. spent: seconds by what was done meanwhile."""

    at: float
    seconds: float
    phase: str
    spent: dict[str, float]


def gaps(steps: list[dict], phases: list[tuple[str, float]]) -> list[Gap]:
    """Of every frame shown, and of what no frame followed at the end."""
    found, since, asleep, spent = [], None, 0.0, {}
    for step in steps:
        asleep += step["asleep"]
        for name, seconds in step["spent"].items():
            spent[name] = spent.get(name, 0.0) + seconds
        since = step["start"] if since is None else since
        if step["shown"] is not None or step["asleep"] > 0:
            until = step["shown"] or step["end"]
            phase = next((name for name, start in reversed(phases) if start <= until), "launch")
            found.append(Gap(until, until - since - asleep, phase, spent))
            since, asleep, spent = until, 0.0, {}
    return found


class Watched(Program):
    """A window whose loop is watched."""

    patience = PATIENCE

    def __init__(self, display: str, size: tuple[int, int], code: Path, folder: Path, photos: list[Path]):
        self.record = folder / "record.json"
        homes = {variable: str(folder / name) for variable, name in HOMES.items()}
        for home in homes.values():
            Path(home).mkdir(exist_ok=True)
        self._environment = {**os.environ, **homes, "DISPLAY": display, "PYTHONPATH": str(code)}
        self._environment.pop("WAYLAND_DISPLAY", None)
        self.launched = time.perf_counter()
        driver = Path(__file__).with_name("watched.py")
        command = [sys.executable, str(driver), *map(str, size), str(self.record), *map(str, photos)]
        self.size, self.phases = size, [("launch", self.launched)]
        self._begin(display, command, folder)

    def _begin(self, display: str, command: list[str], folder: Path) -> None:
        import threading

        from tests.app.window.x11 import Client

        self._process = subprocess.Popen(
            command, env=self._environment, cwd=folder, stdout=subprocess.PIPE, text=True
        )
        self._lines, self._changed = [], threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.client = Client(display)
        self.until(lambda s: True, "the first frame")
        self.window = int(self.xdotool("search", "--name", "LangFlash").split()[0])
        self.xdotool("windowmove", str(self.window), "0", "0", "windowfocus", "--sync", str(self.window))

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with self._changed:
                self._lines.append(json.loads(line))
                self._changed.notify_all()

    def phase(self, name: str) -> None:
        self.phases.append((name, time.perf_counter()))

    def quiet(self, seconds: float = 1.5) -> None:
        """Wait until nothing is told any more."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            seen = self.state
            time.sleep(seconds)
            if self.state == seen:
                return

    def since(self, moment: float, holds) -> float:
        """Seconds from `moment` to the first line that satisfies `holds`."""
        with self._changed:
            return next(
                (line["at"] - moment for line in self._lines if line["at"] > moment and holds(line)), -1
            )

    def end(self) -> dict:
        self.client.close()
        self._process.terminate()
        self._reader.join(PATIENCE)
        self._process.wait(PATIENCE)
        return json.loads(self.record.read_text())


def orbit(someone: Watched, left: int, turn: int) -> None:
    """Drag the picture aside; again where a frame was so slow that it took a whole drag for a click."""
    before, end = someone.state["pose"], time.monotonic() + PATIENCE
    while someone.state["pose"] == before:
        assert time.monotonic() < end, "no drag moves the camera"
        someone.xdotool("mousemove", str(left), str(someone.size[1] // 2), "mousedown", "1")
        for _ in range(25):
            someone.xdotool("mousemove_relative", "--", str(6 * turn), "1", "sleep", "0.02")
        someone.xdotool("mouseup", "1")
        someone.quiet()


def walk(someone: Watched, phrase: str) -> Iterator[tuple[str, float]]:
    """The session; yields what took how long beside the frames."""
    someone.until(lambda s: s["scene"] is not None and s["job"] is None, "the scene")
    yield "scene on show since launch", time.perf_counter() - someone.launched
    someone.quiet()
    someone.phase("first phrase")
    someone.xdotool("mousemove", *map(str, someone.field), "click", "1")
    someone.xdotool("type", "--delay", "80", phrase)
    typed = time.perf_counter()
    someone.until(lambda s: s["prompts"][0][0] == phrase and s["prompts"][0][1] is not None, "a score")
    yield "first score after the last letter", time.perf_counter() - typed
    someone.quiet(2.5)
    full = someone.state["picture"]
    scored = lambda line: line["prompts"][0][0] == phrase and line["prompts"][0][1] is not None  # noqa: E731
    score = someone.since(typed, scored)
    half = someone.since(typed, lambda s: scored(s) and 2 * s["picture"][0] >= full[0] - 1)
    yield "half-resolution picture with the phrase, after its score", max(half - score, 0.0)
    yield (
        f"full picture {full} with its score",
        someone.since(typed, lambda s: scored(s) and s["picture"] == full),
    )
    someone.phase("orbit")
    left = (someone.size[0] + 330) // 2
    for turn in (1, -1, 1):
        orbit(someone, left, turn)
        time.sleep(2.0)
        someone.xdotool("mousemove", "380", "26", "sleep", "0.4", "mousemove", "420", "26", "sleep", "0.4")
    someone.quiet(2.5)
    someone.phase("exports")
    for what in ("Mask", "Boxes, JSON", "Cut-out"):
        someone.xdotool("key", "Escape", "sleep", "0.3", "key", "ctrl+e")
        someone.until(lambda s: s["dialog"] == "export", "the dialog")
        middle = (str(side // 2) for side in someone.size)  # a small window's dialog scrolls there
        someone.xdotool("mousemove", *middle, "sleep", "0.4", "click", "--repeat", "30", "4", "sleep", "0.4")
        someone.click(what)
        someone.click("Export")
        someone.until(lambda s: s["exporting"], f"the export {what}")
        began = time.perf_counter()
        someone.until(lambda s: not s["exporting"], f"the end of the export {what}")
        yield f"export {what}", time.perf_counter() - began
        assert any(toast.startswith("Exported") for toast in someone.state["toasts"]), someone.state["toasts"]
        time.sleep(0.5)
    someone.xdotool("key", "Escape")
    someone.quiet()


@contextmanager
def _place() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="frames-") as folder:
        yield Path(folder).resolve()


def measure(code: Path, size: tuple[int, int], photos: list[Path], phrase: str) -> None:
    """One session, and what there is to say of it."""
    with _place() as folder, x_server(*size) as display:
        copies = [Path(shutil.copy(photo, folder)) for photo in photos]  # exports go beside them
        someone = Watched(display, size, code, folder, copies)
        try:
            told = list(walk(someone, phrase))
        finally:
            record = someone.end()
    found = gaps(record["steps"], someone.phases)
    say = sys.stdout.write
    say(f"\n{code} at {size[0]} x {size[1]}: {len(found)} frames\n")
    late = sum(gap.seconds > LATE for gap in found)
    say(f"  {late or 'no'} frame{'s' * (late > 1)} later than {1000 * LATE:.0f} ms\n")
    for what, seconds in told:
        say(f"  {what}: {seconds:.2f} s\n")
    for phase, _ in someone.phases:
        worst = max((gap.seconds for gap in found if gap.phase == phase), default=0.0)
        say(f"  {phase:14} worst {1000 * worst:6.0f} ms\n")
    for gap in sorted(found, key=lambda gap: -gap.seconds)[:WORST]:
        doing = sorted(gap.spent.items(), key=lambda pair: -pair[1])[:4]
        rest = gap.seconds - sum(gap.spent.values())
        said = ", ".join(f"{name} {1000 * seconds:.0f}" for name, seconds in doing)
        say(f"    {1000 * gap.seconds:6.0f} ms  {gap.phase:12} {said}; elsewhere {1000 * rest:.0f}\n")
    sys.stdout.flush()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--size", action="append", help="1280x800; again for more")
    parser.add_argument("--code", action="append", type=Path, help="a version of the program; again for more")
    parser.add_argument("--photos", nargs="+", type=Path, default=PHOTOS)
    parser.add_argument("--phrase", default="plant")
    given = parser.parse_args()
    for size in given.size or ["1280x800", "1920x1080"]:
        width, height = map(int, size.split("x"))
        for code in given.code or [ROOT]:
            measure(code.resolve(), (width, height), given.photos, given.phrase)
    return 0


if __name__ == "__main__":
    sys.exit(main())
