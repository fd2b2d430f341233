"""A short run of random input into a real window; ten minutes of it: python -m tests.tools.monkey."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from langflash_core.language.spaces import language_space
from tests.app.window import test_window
from tests.app.window.guarded import REFUSED, environment
from tests.app.window.scenes import PHRASES, room
from tests.tools import monkey
from tests.tools.memory import held_mb

pytestmark = test_window.pytestmark
SECONDS = 15.0


def test_random_input_breaks_nothing() -> None:
    outcome = monkey.run(SECONDS, seed=5, size=(1000, 700))
    assert outcome.problems == []
    assert outcome.steps > 3 and outcome.frames > 20  # it lived, however busy the machine
    assert len(outcome.checkpoints) == 2


def test_what_the_window_may_not_do_under_random_input(tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    outside.mkdir()
    (outside / "dear.txt").write_text("dear")
    code = f"""
import os, pathlib, subprocess
outside = pathlib.Path({str(outside)!r})
for attempt in (
    lambda: (outside / "new.txt").write_text("x"),
    lambda: (outside / "dear.txt").open("a"),
    lambda: (outside / "dear.txt").unlink(),
    lambda: os.open(outside / "low.txt", os.O_CREAT | os.O_WRONLY),
    lambda: (outside / "dear.txt").rename("taken.txt"),
    lambda: (outside / "folder").mkdir(),
    lambda: subprocess.run(["rm", outside / "dear.txt"]),
):
    try:
        attempt()
    except PermissionError:
        continue
    raise SystemExit("allowed")
pathlib.Path("mine.txt").write_text("mine")
"""
    own = environment(inside, test_window.ROOT)
    done = subprocess.run([sys.executable, "-c", code], env=own, cwd=inside, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (inside / "mine.txt").read_text() == "mine"
    assert os.listdir(outside) == ["dear.txt"] and (outside / "dear.txt").read_text() == "dear"
    assert len((inside / REFUSED).read_text().splitlines()) == 7


def test_memory_that_grows_is_told_from_memory_that_comes_and_goes() -> None:
    minutes = range(31)
    flat = [(float(at), 1000.0 + (80.0 if at in (10, 17, 28) else 0.0)) for at in minutes]
    grown = [(float(at), 1000.0 + max(at - 10, 0)) for at in minutes]  # 2 % in 20 minutes
    assert monkey.Outcome(checkpoints=flat).growth() == 0.0
    growth = monkey.Outcome(checkpoints=grown).growth()
    assert growth is not None and growth > 0.01
    assert monkey.Outcome(checkpoints=grown[:12]).growth() is None


def test_what_rooms_hold_is_counted_once() -> None:
    scene = room(language_space("minilm").encode(list(PHRASES)))
    once = held_mb(scene)
    assert once > scene.gaussians.means.nbytes / 1e6
    assert held_mb((scene, scene)) == once == held_mb([replace(scene)])
