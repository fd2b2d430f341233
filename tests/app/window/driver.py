"""Runs the window for a test: steps it until it is closed and sends its state as JSON.

It is sent when anything a test may wait for has changed, with the seconds that each frame since the last
time took and by how much each came late. "items" tells where the things to click are. What is sent last
has "closed".
"""

import json
import os
from multiprocessing.connection import Connection

from app.window.editing.state import Editing
from app.window.session import Session
from tests.app.window.items import Items


def editing(now: Editing) -> dict:
    history, card, preview = now.history, now.card, now.floaters
    return {
        "tool": now.tool.name,
        "selected": now.num_selected,
        "level": None if now.reached is None else [now.reached.level, len(now.reached.levels)],
        "lines": _lines(now),
        "deleted": len(history.marks.deleted) if history else 0,
        "hiding": "" if now.hiding is None else now.hiding.how,
        "margin": None if now.hiding is None else now.hiding.margin,
        "hides": _hides(now),
        "hidden": len(history.marks.hidden) if history else 0,
        "edits": [edit.label for edit in history.done] if history else [],
        "undone": len(history.undone) if history else 0,
        "changes": [type(change).__name__ for change in history.marks.changes] if history else [],
        "source": now.source,
        "gesture": None if now.gesture is None else type(now.gesture).__name__,
        "handle": now.handle.name,
        "waiting": now.waiting,
        "unsaved": now.unsaved,
        "hover": None if now.hover is None else now.hover.point,
        "shares": None if now.hover is None or now.hover.atoms is None else dict(now.hover.atoms),
        "words": None if card is None or card.words is None else [word for word, _ in card.words],
        "floaters": None
        if preview is None or not preview.least or history is None
        else len(preview.mask(history.marks.visible)),
    }


def _lines(now: Editing) -> int | None:
    """How many lines are around what is selected; None: not known yet."""
    fits = now.outline is not None and now.marks is not None and now.outline.of == now.marks.selected
    return len(now.outline.lines) if fits and now.outline is not None else None


def _hides(now: Editing) -> int | None:
    """How many Gaussians are previewed as hidden; None: none are, or not yet."""
    found = None if now.hiding is None or now.marks is None else now.hiding.mask(now.marks)
    return None if found is None else len(found)


def summary(session: Session) -> dict:
    state = session.state
    return {
        "scene": None if state.scene.info is None else state.scene.info.name,
        "photos": [photo.path.name for photo in state.scene.photos],
        "mode": state.scene.mode.name,
        "pose": [*state.scene.pose.centre, *state.scene.pose.rotation],
        "span": state.scene.pose.span,
        "view": state.scene.view,
        "flying": state.scene.flight is not None,
        "unhidden": state.scene.unhidden is not None,
        "job": None if state.scene.job is None else state.scene.job.stage,
        "prompts": [[p.text, p.score, p.found, p.cut] for p in state.asking.prompts],
        "recent": list(state.asking.recent),
        "binned": [h.key for h in state.asking.histograms],
        "toasts": [toast.text for toast in state.toasts],
        "dialog": None if state.dialog is None else state.dialog.name.lower().replace("_", " "),
        **editing(state.editing),
        "offer": None if state.recovery.edits is None else state.recovery.edits.count,
        "maps": dict(state.stats.passes).get("weights", 0),
        "picture": list(state.stats.picture_size),
        "settling": state.stats.settling,
        "splats": sum(n for kind, n in state.stats.passes if kind in ("colour", "weights")),
        "gl_errors": session.gl_errors,
        "closed": session.should_close,
    }


def main(sent: Connection, environment: dict[str, str], size: tuple[int, int], paths: list[str]) -> None:
    os.environ.clear()
    os.environ.update(environment)
    items = Items()
    session = Session(paths, size)
    last = None
    frames = 0
    seconds: list[float] = []
    lags: list[float] = []
    try:
        while not session.should_close:
            if session.step():
                frames += 1
                seconds.append(session.state.stats.frame_seconds)  # of the frame before
                lags.append(session.lag)
            now = {**summary(session), "items": items.now()}
            if now != last:
                last = now
                line = {**now, "frames": frames, "seconds": seconds, "lags": lags}
                sent.send(json.dumps(line))
                seconds, lags = [], []
    finally:
        session.close()
