"""The tray on a real window: what stands still while a job goes on."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.app.window.test_window import PATIENCE, ROOT, display, pytestmark

__all__ = ["display", "pytestmark"]  # a fixture and the mark of the window's tests

PLACES = """
import json, sys
from pathlib import Path
from app.window.scene.commands import Progressed
from app.window.scene.state import Job, Photo
from app.window.session import Session
from tests.app.window.items import Items

def places(session):
    for _ in range(4):
        job = session.state.scene.job
        session.dispatch(Progressed(job.stage, 0.5) if job else Progressed("", 0))
        session.step(0)
    found = {name.split()[-1]: boxes for name, boxes in items.now().items()}
    return {name: boxes for name, boxes in found.items() if name in ("Cancel", "##text")}

items = Items()
session = Session((), (900, 600))
session.state = session.state.with_scene(photos=tuple(Photo(Path(each)) for each in sys.argv[1:]))
seen = [places(session)]
session.state = session.state.with_scene(job=Job("Reconstructing", "starting"))
for stage in ("photos", "encoder", "language features", "depth", "poses", "refinement", "done"):
    seen.append(places(session))
    session.dispatch(Progressed(stage, 0.0))
session.state = session.state.with_scene(job=None)
seen.append(places(session))
print(json.dumps(seen))
session.close()
"""


@pytest.mark.parametrize("photos", [(), ("/p/a.jpg", "/p/b.jpg")], ids=["no photo", "two photos"])
def test_cancel_and_find_stand_still_from_stage_to_stage(display: str, photos, folders: Path) -> None:
    environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", PLACES, *photos],
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    before, *during, after = json.loads(done.stdout)
    assert len(during) == 7 and all(each == during[0] for each in during)
    assert "Cancel" not in before and "Cancel" in during[0]
    assert before["##text"] == after["##text"]
