"""Runs the window for `frames.py`: notes when frames were shown, and what was done between them.

    python watched.py WIDTH HEIGHT RECORD [PATHS...]

What `driver.py` tells goes to stdout as JSON lines; on leaving, RECORD receives every step of the loop.
The code under watch is the one that PYTHONPATH names, which may be another version of the program.
"""

import gc
import importlib
import json
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import glfw

from app.window.session import Session
from tests.app.window.driver import summary
from tests.app.window.items import Items

TICK = 0.05  # seconds: the loop is never asleep for longer, so that a held interpreter is seen
WATCHED = {
    "app.window.session": (
        "Session._update_picture", "Session._present", "Session._perform", "draw_all",
    ),
    "app.window.worker": ("Worker.poll",),
    "app.window.viewport": ("Viewport.set_scene",),
    "app.window.drawing.easel": ("Easel.draw", "Easel.paint", "Easel.view", "Easel.read"),
    "app.gl.level": ("Level.prepare",),
    "app.gl.scene": ("LiveScene._level_of",),
    "app.gl.view": ("ViewTargets.draw_colour", "ViewTargets.fast"),
    "app.gl.weights": ("WeightMaps.draw",),
    "app.gl.processor.cell_maps": ("CellMaps.draw",),
    "app.gl.processor.host": (
        "HostAnswers.measure", "HostAnswers.scale", "HostAnswers.compare", "read_maps", "inverse_norms",
    ),
    "app.gl.packed": ("PackedMaps._of",),
    "app.gl.display": ("Display._filled",),
    "langflash_core.base.graphics": ("Programs.get",),
}  # fmt: skip


class Watch:
    """Seconds of the loop: when it slept, when a frame was shown, what took how long in between."""

    def __init__(self) -> None:
        self.steps: list[dict] = []
        self._left = dict(WATCHED)
        self._open: list[list] = []  # of the spans under way: name, start, seconds of those inside
        self._spent: dict[str, float] = {}
        self._due = self._asleep = 0.0
        self._shown: float | None = None
        swap, nap = glfw.swap_buffers, glfw.wait_events_timeout
        self._main = threading.get_ident()

        def swap_buffers(window: Any) -> None:
            swap(window)
            self._shown = time.perf_counter()

        def wait_events_timeout(seconds: float) -> None:
            start = time.perf_counter()
            nap(seconds)
            self._asleep += min(time.perf_counter() - start, seconds)

        glfw.swap_buffers, glfw.wait_events_timeout = swap_buffers, wait_events_timeout
        gc.callbacks.append(self._collected)

    def step(self, session: Session) -> bool:
        self._wrap()
        self._asleep, self._shown, self._spent = 0.0, None, {}
        start = time.perf_counter()
        drawn = session.step(TICK)
        end = time.perf_counter()
        kept = {name: round(s, 4) for name, s in self._spent.items() if s > 0.004}
        step = {"start": start, "asleep": self._asleep, "end": end, "shown": self._shown, "spent": kept}
        self.steps.append(step)
        return drawn

    def _wrap(self) -> None:
        """Watch what has been imported by now, here or by the worker."""
        for module_name in list(self._left):
            module = sys.modules.get(module_name)
            if module is None or getattr(module.__spec__, "_initializing", False):
                continue
            for name in self._left.pop(module_name):
                owner: Any = module
                *path, last = name.split(".")
                for part in path:
                    owner = getattr(owner, part, None)
                if owner is not None and hasattr(owner, last):
                    setattr(owner, last, self._timed(name, getattr(owner, last)))

    def _timed(self, name: str, real: Callable) -> Callable:
        def timed(*args: Any, **named: Any) -> Any:
            if threading.get_ident() != self._main:
                return real(*args, **named)
            about = f" {type(args[1]).__name__}" if name == "Session._perform" else ""
            span = [name + about, time.perf_counter(), 0.0]
            self._open.append(span)
            try:
                return real(*args, **named)
            finally:
                self._open.pop()
                self._close(span)

        return timed

    def _close(self, span: list) -> None:
        name, start, inside = span
        seconds = time.perf_counter() - start
        self._spent[name] = self._spent.get(name, 0.0) + seconds - inside
        if self._open:
            self._open[-1][2] += seconds

    def _collected(self, phase: str, info: dict) -> None:
        if phase == "start":
            self._collecting = time.perf_counter()
        elif hasattr(self, "_collecting"):
            self._spent["gc"] = self._spent.get("gc", 0.0) + time.perf_counter() - self._collecting


def main() -> int:
    width, height, record, *paths = sys.argv[1:]
    items = Items()
    launched = time.perf_counter()
    leaving = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: leaving.set())  # the record is written all the same
    session = Session(paths, (int(width), int(height)))
    watch = Watch()
    last = None
    try:
        while not (session.should_close or leaving.is_set()):
            watch.step(session)
            state = session.state
            now = {**summary(session), "items": items.now()}
            now["exporting"] = state.exporting.running is not None
            now["said"] = getattr(state.stats, "picture_seconds", 0.0)
            if now != last:
                last = now
                sys.stdout.write(json.dumps({**now, "at": time.perf_counter(), "frames": 0}) + "\n")
                sys.stdout.flush()
    finally:
        Path(record).write_text(json.dumps({"launched": launched, "steps": watch.steps}))
        session.close()
    return 0


if __name__ == "__main__":
    importlib.import_module("app")
    sys.exit(main())
