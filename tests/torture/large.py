"""Scenes of millions of Gaussians: opened by a program, and shown by the window while its camera moves.

    python -m tests.torture load --only large

Each in a process of its own with a bound on its memory; what does not fit is one sentence before the work.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from app.window.governor import LARGE_SCENE
from tests.app.window.test_window import x_server
from tests.torture.rows import Row

LARGE = 10_000_000
MEMORY = 6 << 30  # bytes that opening the large scene may take
WINDOW_MEMORY = 6 << 30  # and showing it, with OpenGL on the processor
PATIENCE = 1800.0

_OPEN = """
import resource, sys, time
resource.setrlimit(resource.RLIMIT_DATA, (int(sys.argv[2]),) * 2)
from langflash_core.export import read
from app.cli.report import explained
began = time.process_time()
try:
    said = f"{len(read(sys.argv[1]).gaussians):,} Gaussians"
except Exception as error:
    said = explained(error)
most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
print(f"{said}; {time.process_time() - began:.1f} s of the processor, {most} MB")
"""

_SHOW = """
import json, resource, sys, time
from pathlib import Path
resource.setrlimit(resource.RLIMIT_DATA, (int(sys.argv[2]),) * 2)
from PIL import Image
from app.window.scene import camera
from app.window.scene.commands import OpenScene
from app.window.session import Session

def run(until, seconds=900.0):
    # Seconds of this thread's processor and of the clock that each frame took.
    end, frames = time.monotonic() + seconds, [(0.0, 0.0)]
    while not until() and time.monotonic() < end:
        session.step(0.02)
        frames.append((time.thread_time() - frames_began[0], session.state.stats.frame_seconds))
        frames_began[0] = time.thread_time()
    return frames

frames_began = [time.thread_time()]
path, shown = Path(sys.argv[1]), {}
session = Session((), (1000, 700))
viewport = session._viewport
run(lambda: False, 2.0)
began = time.process_time()
session.dispatch(OpenScene(path))
opening = run(lambda: session.state.scene.info is not None or session.state.toasts)
if session.state.scene.info is not None:
    shown["count"], shown["opened"] = session.state.scene.info.num_gaussians, time.process_time() - began
    opening += run(lambda: viewport.drawn is not None)
    shown["drawn"] = time.process_time() - began
    opening += run(lambda: viewport.whole or viewport.failing)
    shown["whole"], shown["failing"] = time.process_time() - began, viewport.failing
    Image.fromarray(viewport.seen()).save(sys.argv[3])
    plans, moving = set(), []
    for turn in range(30):
        session.dispatch(camera.Orbit(0.02, 0.0))
        moving += run(lambda: False, 0.02)[1:]
        if turn > 9:
            plan = viewport.drawn.plan
            plans.add((plan.scale, round(plan.share * shown["count"])))
    shown["plans"] = sorted(plans)
    shown["moving"] = [sorted(one[n] for one in moving)[len(moving) // 2] for n in (0, 1)]
shown["slowest"] = [max(one[n] for one in opening) for n in (0, 1)]
shown["said"] = [toast.text for toast in session.state.toasts]
shown["most"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
session.close()
print(json.dumps(shown))
"""


def write_splat(path: Path, count: int) -> None:
    """A .splat of so many: a cloud, normal in each direction."""
    rng = np.random.default_rng(0)
    kind = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quat", "u1", 4)])
    with path.open("wb") as stream:
        for start in range(0, count, 1_000_000):
            some = np.zeros(min(1_000_000, count - start), kind)
            some["mean"] = rng.normal(0, 1, some["mean"].shape)
            some["scale"], some["rgba"], some["quat"] = 0.01, 200, (255, 128, 128, 128)
            stream.write(some.tobytes())


def large_scene(path: Path, count: int) -> Row:
    """A .splat of so many opens within `MEMORY`, or is refused in one sentence, before the work."""
    row = Row(f"large: {count:,} opened")
    words = [sys.executable, "-c", _OPEN, str(path), str(MEMORY)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE)
    row.told = done.stdout.strip()
    opened = row.told.startswith(f"{count:,} Gaussians")
    refused = "GB to open" in row.told or "more than" in row.told
    if done.returncode or "\n" in row.told or not (opened or refused):
        row.finds.append(f"exit code {done.returncode}: {done.stderr[-200:]}")
    return row


def large_window(path: Path, count: int, picture: Path) -> Row:
    """The window shows all of it within `WINDOW_MEMORY` and moves with the share that its plan says, or it
    says in a sentence why not."""
    row = Row(f"large: {count:,} in the window")
    with x_server(1100, 800) as display:
        environment = {**os.environ, "DISPLAY": display}
        environment.pop("WAYLAND_DISPLAY", None)
        for name in ("LANGFLASH_CONFIG", "LANGFLASH_STATE"):
            environment[name] = str(path.parent / name.lower())
        words = [sys.executable, "-c", _SHOW, str(path), str(WINDOW_MEMORY), str(picture)]
        done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, env=environment)
    if done.returncode:
        row.finds.append(f"exit code {done.returncode}: {done.stderr[-300:]}")
        return row
    shown = json.loads(done.stdout)
    row.told = json.dumps(shown)
    if "count" not in shown:
        row.finds += [] if len(shown["said"]) == 1 and "GB to open" in shown["said"][0] else [row.told]
        return row
    if shown["failing"] or any("unexpected" in text for text in shown["said"]):
        row.finds.append("the picture at rest does not come")
    if any(moved > LARGE_SCENE for _, moved in shown["plans"]):
        row.finds.append(f"moves with more than {LARGE_SCENE:,} Gaussians")
    return row
