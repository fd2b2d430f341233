"""What a long session no longer needs goes back to the system."""

import subprocess
import sys
from pathlib import Path

import pytest

from app.window.commands import Measured, Notify, Tick
from app.window.effects import REST_SECONDS, Hands, RestEffects
from app.window.state import State, Stats
from langflash_core.language.spaces import language_space
from langflash_core.scene.file import save
from tests.app.window import test_window
from tests.app.window.guarded import environment
from tests.app.window.scenes import PHRASES, room
from tests.app.window.test_window import ROOT, x_server

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="asks the GNU C library")
FREE_MB = 12  # that a window at rest holds and needs not
HELD_MB = 100  # of the 300 MB of arrays that are gone; what lies apart leaves a tenth of that

RESIDENT = """
def resident_mb():
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("RssAnon:")) / 1024
"""


def told_mb(program: str, *words: str | Path, **more) -> list[float]:
    """What a process of its own prints, MB: what other tests have left free would feed it."""
    command = [sys.executable, "-c", RESIDENT + program, *map(str, words)]
    done = subprocess.run(command, **{"cwd": ROOT, "capture_output": True, "text": True, **more})
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


ARRAYS_AMONG_SMALL_THINGS = """
import sys
import numpy as np
from langflash_core.base import memory

if sys.argv[1] == "apart":
    memory.keep_tidy()
np.ones(30 << 20, np.uint8)  # a picture that is gone raises the library's own border to its size
before, stays = resident_mb(), []
arrays = []
for _ in range(60):
    arrays.append(np.ones(5 << 20, np.uint8))
    stays.append(bytes(100_000))
assert resident_mb() - before > 290
del arrays
print(resident_mb() - before)
memory.give_back()
print(resident_mb() - before)
"""


def test_large_arrays_leave_nothing_behind() -> None:
    """At once, and once they were given back."""
    at_once, _ = told_mb(ARRAYS_AMONG_SMALL_THINGS, "apart")
    assert at_once < HELD_MB
    usual, later = told_mb(ARRAYS_AMONG_SMALL_THINGS, "as usual")
    assert usual > 2 * HELD_MB  # what the library does by itself, else this test could not fail
    assert later < HELD_MB  # what `give_back` is for


THREADS_BY_TURNS = """
import sys
from threading import Event, Thread
from langflash_core.base import memory

if sys.argv[1] == "tidy":
    memory.keep_tidy()
turns, stays = [Event() for _ in range(9)], []

def take(turn):
    turns[turn].wait()
    pieces = [bytearray(64_000) for _ in range(640)]
    stays.extend(pieces[::100])
    del pieces
    turns[turn + 1].set()
    turns[-1].wait()  # a thread that has ended would leave its arena to the next

threads = [Thread(target=take, args=(turn,), daemon=True) for turn in range(8)]
for thread in threads:
    thread.start()
before = resident_mb()
turns[0].set()
turns[-1].wait()
print(resident_mb() - before)
"""


def test_what_one_thread_gives_back_serves_the_next() -> None:
    """Eight threads take 39 MB each, one after the other, and keep a hundredth."""
    (tidy,), (usual,) = (told_mb(THREADS_BY_TURNS, how) for how in ("tidy", "as usual"))
    assert tidy < 2 * 39  # once, and the pieces that stay
    assert usual > 4 * 39  # what the library does by itself, else this test could not fail


A_JOB_OF_CRUMBS = """
import time
from app.window.commands import Notify
from app.window.requests import Job
from app.window.scene.commands import Loaded
from app.window.worker import Worker

class Crumbs(Job):
    # takes 200 MB in pieces too small to be mapped one by one, and keeps every hundredth
    kept = []

    def run(self, serial, progress, cancelled):
        pieces = [bytearray(64_000) for _ in range(3200)]
        Crumbs.kept = pieces[::100]
        return Notify(str(resident_mb()))

def heard(kind):
    end = time.monotonic() + 60
    while time.monotonic() < end:
        for command in worker.poll():
            if isinstance(command, kind):
                return command
        time.sleep(0.01)
    raise SystemExit(f"no {kind}")

worker = Worker()
heard(Loaded)
before = resident_mb()
worker.submit(Crumbs())
print(float(heard(Notify).text) - before)
end = time.monotonic() + 10
while resident_mb() > before + 60 and time.monotonic() < end:
    time.sleep(0.05)
print(resident_mb() - before)
worker.stop()
"""


def test_what_a_finished_job_held_goes_back() -> None:
    taken, stayed = told_mb(A_JOB_OF_CRUMBS)
    assert taken > 150  # of 200 MB
    assert stayed < 60  # a third of it; allocators round


def test_rest_begins_with_the_last_command() -> None:
    clock = [5.0]
    hands = Hands(print, print, print, lambda: None, lambda: clock[0])
    effects, state = RestEffects(hands), State()
    effects.follow(Tick(5.0), state, state)
    effects.follow(Measured(Stats()), state, state)
    assert effects.due == float("inf")  # every frame has those
    effects.follow(Notify("here"), state, state)
    effects.tick(state, clock[0])
    assert effects.due == clock[0] + REST_SECONDS
    effects.tick(state, effects.due)
    assert effects.due == float("inf")


ASKING = """
import ctypes, sys, time
from pathlib import Path
from app.window.asking.commands import AddPrompt, EditPrompt
from app.window.scene.commands import OpenScene
from app.window.session import Session

session = Session((), (1000, 700))

def until(reached, seconds=240):
    end = time.monotonic() + seconds
    while not reached():
        assert time.monotonic() < end, session.state
        session.step(0.1)

def asked(text):
    session.dispatch(EditPrompt(session.state.asking.prompts[0].key, text))
    until(lambda: session.state.asking.prompts[0].text == text)
    until(lambda: session.state.asking.prompts[0].score is not None and not session.state.stats.settling)

session.dispatch(OpenScene(Path(sys.argv[1]), alone=True))
until(lambda: session.state.scene.info is not None and session.state.scene.job is None)
if not session.state.asking.prompts:
    session.dispatch(AddPrompt())
    until(lambda: session.state.asking.prompts)
for text in ("armchair", "wall", "floor"):
    asked(text)
end = time.monotonic() + 4
while time.monotonic() < end:
    session.step(0.1)
before = resident_mb()
ctypes.CDLL(None).malloc_trim(0)
print(before - resident_mb())
session.close()
"""


@test_window.pytestmark[0]
def test_a_window_at_rest_holds_little_that_is_free(tmp_path: Path) -> None:
    scene = tmp_path / "room.langflash"
    save(room(language_space("minilm").encode(list(PHRASES))), scene)
    with x_server(1000, 700) as display:
        own = {**environment(tmp_path, ROOT), "DISPLAY": display}
        own.pop("WAYLAND_DISPLAY", None)
        assert told_mb(ASKING, scene, cwd=tmp_path, env=own)[-1] < FREE_MB
