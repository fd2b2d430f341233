"""The whole way as a person goes it, on the shipped photos: launch, drop, type, see; and meanwhile a
window that never freezes. The figures that the project promises are the bounds here."""

import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from app.window.kit import theme
from tests.app.window import test_window
from tests.app.window.test_window import LEFT, PATIENCE, TOP, Program, x_server
from tests.tools.journey import PHOTOS, lit, person, walk

pytestmark = test_window.pytestmark

LAUNCH_SECONDS = 3.0  # from the command to the first frame, warm, on 2 cores
HELD_SECONDS = 0.250  # by which a frame may come late while a scene is made, without drawing the scene
SMALL = (LEFT + 640, TOP + 480 + int(theme.STATUS_HEIGHT))  # a window whose picture is 640 x 480
LARGE = (1280, 800)


def test_the_first_frame_comes_soon() -> None:
    """Other programs only add to it, and come and go: the best of several launches counts."""
    seconds: list[float] = []
    for _ in range(6):
        with person() as someone:
            seconds.append(someone.until_first_frame())
        if seconds[-1] < LAUNCH_SECONDS:
            break
    assert min(seconds) < LAUNCH_SECONDS, seconds


def test_torch_is_not_loaded_before_the_first_frame(folders: Path, monkeypatch) -> None:
    """It takes seconds: the worker loads it once there is a window to look at."""
    program = (
        "import os, sys\n"
        "from app.window import session\n"
        "def present(self, show=session.Session._present):\n"
        "    show(self)\n"
        "    heavy = [name for name in ('torch', 'cv2', 'timm') if name in sys.modules]\n"
        "    sys.stdout.write(f'loaded: {heavy}')\n"
        "    sys.stdout.flush()\n"
        "    os._exit(0)\n"
        "session.Session._present = present\n"
        "from app.cli import main\n"
        "main(['view'])\n"
    )
    with x_server(900, 600) as display:
        monkeypatch.setenv("DISPLAY", display)
        monkeypatch.setenv("PYTHONPATH", str(test_window.ROOT))
        done = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE
        )
    assert done.stdout == "loaded: []", done.stderr


def test_from_launch_to_an_answer() -> None:
    """`python -m app view`, two photos dropped, "plant" typed; all that is known is on the screen."""
    with person() as someone:
        shots = list(islice(walk(someone), 5))  # up to the answer
    assert [shot.caption.split()[0] for shot in shots][:3] == ["Launch:", "Two", "The"]
    scene, answer = shots[2].picture, shots[4].picture
    canvas = (slice(TOP, LARGE[1] - int(theme.STATUS_HEIGHT)), slice(LEFT, LARGE[0]))
    marked = lit(answer[canvas]) & ~lit(scene[canvas])
    # The plant stands left of the middle, from a quarter to two thirds of the height; it takes 5 to
    # 15 % of the picture. The network marks it and little else.
    height, width = marked.shape
    place = np.zeros_like(marked)
    place[height // 5 : height * 3 // 4, width // 4 : width * 5 // 8] = True
    assert 0.03 < marked.mean() < 0.25
    assert marked[place].sum() > 0.8 * marked.sum()


@pytest.fixture(scope="module")
def program() -> Iterator[Program]:
    """A window with nothing open and a picture of 640 x 480."""
    with x_server(*SMALL) as display:
        running = Program(display, size=SMALL)
        yield running
        running.leave()


def wiggle(program: Program, seconds: float) -> None:
    """Move the pointer over the picture."""
    x, y = LEFT + 320, TOP + 240
    steps = [word for n in range(10) for word in ("mousemove", str(x + 5 * n), str(y + n), "sleep", "0.03")]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        program.xdotool(*steps)


def lags(program: Program, first: int) -> dict[str | None, list[float]]:
    """By how much each frame of the lines from `first` on came late, by the stage of the job meanwhile."""
    late: dict[str | None, list[float]] = {}
    with program._changed:
        for line in program._lines[first:]:
            late.setdefault(line["job"], []).extend(line["lags"])
    return {stage: frames for stage, frames in late.items() if frames}


def test_a_reconstruction_never_blocks_the_window(program: Program) -> None:
    """With a scene on show and the pointer moving over it.

    What other programs take only adds, and comes at any time, where the window itself would hold a frame
    up at the same stage each time: so of each stage the best of three reconstructions counts; of it the
    latest frame less the latest one of an idle second before.
    """
    program.client.drop(program.window, PHOTOS, (LEFT + 300, TOP + 200))
    program.until(lambda s: s["scene"] is not None and s["job"] is None, "the first scene")
    excess: dict[str | None, float] = {}
    for _ in range(3):
        time.sleep(3.0)  # words of the atoms, the kept copy
        first = len(program._lines)
        wiggle(program, 1.0)
        idle = max((lag for frames in lags(program, first).values() for lag in frames), default=0.0)
        first = len(program._lines)
        program.client.drop(program.window, PHOTOS, (LEFT + 300, TOP + 200))
        program.click("New room")
        program.until(lambda s: s["job"] is not None, "the job")
        while program.state["job"] is not None:
            wiggle(program, 0.5)
        late = lags(program, first)
        assert sum(map(len, late.values())) > 20  # there was something to be late
        for stage, frames in late.items():
            excess[stage] = min(excess.get(stage, np.inf), max(frames) - min(idle, 0.1))
        if max(excess.values()) < HELD_SECONDS:
            break
    assert max(excess.values()) < HELD_SECONDS, {stage: f"{1000 * e:.0f} ms" for stage, e in excess.items()}
    assert program.state["gl_errors"] == [] and program.state["toasts"] == []
