"""Scenes and kept edits of every format there has been, in the window's own opening: they look alike.

`tests/scene/` compares what they hold with what it is to be, number by number; here the window has it, too.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.app.window.test_window import PATIENCE, ROOT, display, pytestmark
from tests.scene.test_edits import KEPT_EDITS
from tests.scene.test_file import VERSION_1, VERSION_2, VERSION_3

__all__ = ["display", "pytestmark"]  # a fixture and the mark of the window's tests

OPENED = """
import json, sys, time
from pathlib import Path
import numpy as np
from app.window.scene.commands import OpenScene
from app.window.session import Session
from langflash_core.scene.file import load
from tests.scene.test_file import same

def rest(until):
    end = time.monotonic() + 60
    while not until():
        assert time.monotonic() < end, [toast.text for toast in session.state.toasts]
        session.step(0.02)

def look():
    rest(lambda: session._viewport.whole and not session._viewport.settling)
    return session._viewport.seen().astype(int)

scenes, edits = json.loads(sys.argv[1])
session, said, pictures = Session((), (720, 520)), [], []
for path in map(Path, scenes):
    session.dispatch(OpenScene(path))
    rest(lambda: session.state.scene.info is not None and session.state.scene.info.path == path)
    pictures.append(look())
    said.append(same(session.state.scene.info.scene, load(path)))
steps = []
for path in map(Path, edits):
    before = session.state.scene.info
    session.dispatch(OpenScene(path.with_suffix(".langflash"), path))
    rest(lambda: session.state.scene.info is not before)
    pictures.append(look())
    steps.append([edit.label for edit in session.state.editing.history.done])
drawn = [int((picture.max(-1) != picture[0, 0].max()).sum()) for picture in pictures]
apart = [float(abs(picture - pictures[0]).mean()) for picture in pictures]
toasts = [toast.text for toast in session.state.toasts]
session.close()
print(json.dumps({"same": said, "steps": steps, "drawn": drawn, "apart": apart, "toasts": toasts}))
"""


def test_files_of_every_format_open_in_the_window(display: str, folders: Path) -> None:
    scenes = [VERSION_1, VERSION_2, VERSION_3]
    before = [path.read_bytes() for path in scenes]
    kept = []
    for path in KEPT_EDITS:
        kept.append(folders / path.name)
        kept[-1].write_bytes(path.read_bytes())
        kept[-1].with_suffix(".langflash").write_bytes(VERSION_2.read_bytes())
    asked = json.dumps([[str(path) for path in scenes], [str(path) for path in kept]])
    done = subprocess.run(
        [sys.executable, "-c", OPENED, asked],
        env={**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["same"] == [True] * 3 and [path.read_bytes() for path in scenes] == before
    labels = ["Delete 8", "Rename", "Not a wall", "Scale", "Move", "Tint", "Tour", "Things", "Upright"]
    assert told["steps"] == [labels[:count] for count in (4, 6, 7, 9)]
    assert min(told["drawn"]) > 100_000, "of 720 x 520 pixels those that are not the corner's"
    first, second, third, *edited = told["apart"]  # mean difference of 0 to 255 from the first
    assert first == second == 0 and third < 1, "levels choose which elements are drawn"
    deleted, moved, *more = edited
    assert 1 < deleted < moved and more == [moved, moved], "neither a tour nor a name is seen"
    # Their toy network speaks in 32 numbers, which is said once, and in one sentence.
    strange = [text for text in told["toasts"] if "are kept" not in text]
    assert len(strange) == 1 and "speaks 'minilm' with 32 numbers" in strange[0]
