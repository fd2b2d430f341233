"""The window lives while the graphics driver refuses the n-th thing, or everything from there on, and while
the disk is full: the edits of its scene stay, and it draws again as soon as it can.

    python -m tests.torture window [--seed 1] [--minutes 5]

The window is the real one, in this process, on an X server of its own without a clipboard's owner and without
a file dialog of the desktop.
"""

import os
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import glfw
import numpy as np

from app.window.asking import commands as ask
from app.window.commands import CopyText
from app.window.editing import commands as edit
from app.window.opening.commands import OpenFiles, Paste
from app.window.scene import camera
from app.window.scene.commands import SaveScene
from app.window.session import Session
from langflash_core.base.pictures import PICTURES
from langflash_core.scene.edits import Mask
from tests.app.window.test_window import x_server
from tests.torture.failing import failing
from tests.torture.nth import Failed

SIZES = ((720, 520), (800, 560))  # by turns, so that targets are made anew
KINDS = ("graphics", "lost", "write", "place")
MOST = 400  # calls, beyond which none comes
PATIENCE = 60.0


@contextmanager
def opened(scene: Path, folder: Path) -> Iterator[Session]:
    """A window that shows a scene with one deletion."""
    for name in ("LANGFLASH_CONFIG", "LANGFLASH_STATE"):
        os.environ[name] = str(folder / name.lower())
    with x_server(1000, 700) as display:
        os.environ["DISPLAY"] = display
        os.environ.pop("WAYLAND_DISPLAY", None)
        session = Session((scene,), SIZES[0])
        try:
            _steps(session, until=lambda: session.state.scene.info is not None)
            assert session.state.scene.info is not None
            count = len(session.state.scene.info.scene.gaussians)
            session.dispatch(edit.Found(Mask.of(np.arange(count) % 9 == 0), "replace", "here"))
            session.dispatch(edit.Delete())
            _steps(session, 10)
            yield session
        finally:
            session.close()


def torture(session: Session, folder: Path, seconds: float, seed: int = 1) -> Iterator[Failed]:
    """A row per kind of failure; `seconds` of the processor for all of them."""
    for kind in KINDS:
        row, began, nth = Failed(f"window: {kind}"), time.process_time(), 0
        while time.process_time() - began < seconds / len(KINDS) and nth < MOST:
            nth += 1
            failed = _one(session, folder, kind, nth, seed, row)
            row.tried += failed
            row.calls = max(row.calls, nth)
            if not failed and nth > 3:
                break
        yield row.tell()


def _one(session: Session, folder: Path, kind: str, nth: int, seed: int, row: Failed) -> bool:
    """Use the window while something fails; whether it did."""
    before = _edits(session)
    with failing(kind, nth, folder, 28) as fault:
        try:
            _use(session, folder, nth + seed)
        except Exception as error:
            said = traceback.format_exception_only(error)[-1].strip()
            row.find(f"the window died: {said} [{fault.failed}]")
    try:
        _steps(session, 4)
    except Exception as error:
        row.find(f"it does not go on: {type(error).__name__}: {error} [{fault.failed}]")
    texts = [toast.text for toast in session.state.toasts]
    wrong = [text for text in texts if "unexpected" in text or "\n" in text]
    if wrong:
        row.find(f"said: {wrong[0][:150]} [{fault.failed}]")
    if _edits(session) != before or session.should_close:
        row.find(f"edits are gone [{fault.failed}]")
    return bool(fault.failed)


def _edits(session: Session) -> tuple:
    history = session.state.editing.history
    return () if history is None else history.done


def _use(session: Session, folder: Path, turn: int) -> None:
    """Another size, another mode, another phrase; copy, paste, open and save."""
    glfw.set_window_size(session._window, *SIZES[turn % 2])
    session.dispatch(camera.SetMode(PICTURES[turn % len(PICTURES)]))
    session.dispatch(ask.EditPrompt(session.state.asking.prompts[0].key, ("armchair", "wall")[turn % 2]))
    session.dispatch(CopyText("some text"))
    session.dispatch(Paste())
    if turn % 4 == 0:
        session.dispatch(OpenFiles())
    if turn % 3 == 0:
        session.dispatch(SaveScene(folder / "out" / "saved.langflash"))
    _steps(session, 12)


def _steps(session: Session, count: int = 10_000, until=lambda: False) -> None:
    end = time.monotonic() + PATIENCE
    for _ in range(count):
        if until():
            return
        assert time.monotonic() < end, "the window hangs"
        session.step(0.05)
