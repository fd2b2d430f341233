"""Random hands on a real window: moves, clicks, drags, keys, typing, drops, resizes, from a seed.

    python -m tests.tools.monkey [--minutes 10] [--seed 1] [--screen 1000x700]

Ends with 0 when the window lived through it without an exception, an OpenGL error or a hang, and its
memory stayed. The window can write only in a temporary folder (guarded.py); leaving is refused, so that
the run goes on. It begins with a reconstruction, a phrase, every mode of the picture and every command, so
that the network and the shaders are there from the start, not from whichever minute hands ask for them. Every
minute the same scene is opened in a window of the same size, and memory is compared there at rest, without
what the rooms take that the window holds to go back to: which these are is up to random hands, as is which
panels are open, so those are closed, and preferences put back. The scene's file is written anew before, since
hands merge scenes into it and save it. Each line says what memory is asked of the C library, free in its
hands and mapped from files, and which modules were loaded since the last.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import glfw
import numpy as np
from imgui_bundle import imgui
from PIL import Image

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.editing import commands as edit
from app.window.filming import commands as film
from app.window.frame.table import ENTRIES, Chord, named
from app.window.inventory.commands import ShowInventory
from app.window.recovery.commands import Prefer
from app.window.recovery.preferences import DEFAULTS
from app.window.scene import camera
from app.window.session import Session
from app.window.touring.commands import ShowTour
from langflash_core.base import pictures
from langflash_core.base.files import write_atomically
from langflash_core.base.pictures import PICTURES
from langflash_core.base.resources import asset_path
from tests.app.window.guarded import REFUSED, environment
from tests.app.window.items import Items
from tests.app.window.test_window import ROOT, x_server
from tests.app.window.x11 import Client
from tests.tools.memory import held_mb, memory_parts, packages, resident_mb

PATIENCE = 120.0  # seconds without any sign of life that count as a hang, also on a busy machine
STEPS_AT_ONCE = 12
MODE_SECONDS = 2.0
COMMAND_SECONDS = 0.7
IDLE = 30.0  # seconds in which nothing follows a drop, also on a busy machine
LONGEST_QUEUE = 40.0  # seconds in which a slow window takes the letters of a command
AT_REST = 3.0  # seconds without a frame; what is free is given back one second after the last command
LONGEST_REST = 15.0  # seconds until a window counts that never rests, as where a text cursor blinks
WARM_MINUTES = 10.0
SLOPE_MB = 8.0  # a minute; a scene that leaked at each opening would be 20, a reconstruction hundreds
_NAMES = {
    **{f"{way}_arrow": way.capitalize() for way in ("up", "down", "left", "right")},
    **{f"{side}_bracket": f"bracket{side}" for side in ("left", "right")},
    "page_up": "Prior", "page_down": "Next", "home": "Home", "delete": "Delete", "backspace": "BackSpace",
}  # fmt: skip
_OTHERS = (
    *["Escape", "Return", "Tab", "shift+Tab", "End", "space", "minus", "plus", "F6", "F11", "ctrl+c"],
    *"wasdqet0",
)


def chord(keys: Chord) -> str:
    """A chord of the window in xdotool's words, as "ctrl+shift+Left"."""
    name = str(keys.key.name).strip("_")
    if name.startswith("keypad"):
        name = name.replace("keypad", "KP_")
    elif name[0] == "f" and name[1:].isdigit():
        name = name.upper()
    return "ctrl+" * keys.ctrl + "shift+" * keys.shift + _NAMES.get(name, name)


KEYS = (*(chord(keys) for entry in ENTRIES for keys in entry.keys), *_OTHERS)
COMMANDS = tuple(entry.name for entry in ENTRIES)
PALETTE = chord(named("All commands").keys[0])
SURE = ("Discard", "Open it")  # buttons of the questions before a scene that is opened
WORDS = ("armchair", "wall - floor", "sofa + cushion", "plant", "+", "élan 椅子", "a " * 200, "0.5", "-3")
WORDS = (*WORDS, "room")
PAIR = ("living_room_left.png", "living_room_right.png")
PHOTOS = (*PAIR, "books_left.jpg")


@dataclass
class Outcome:
    """What a run has seen. checkpoints: (minutes, MB) with the same scene open and at rest, without
    the rooms before it."""

    steps: int = 0
    frames: int = 0
    checkpoints: list[tuple[float, float]] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    refused: list[str] = field(default_factory=list)
    latest: float = 0.0  # seconds, of the frame that came latest
    picture: np.ndarray | None = None  # of the screen where it went wrong

    def slope(self) -> float:
        """MB a minute over the checkpoints after the first two, when caches have filled; 0 of fewer."""
        late = np.array(self.checkpoints[2:])
        return float(np.polyfit(late[:, 0], late[:, 1], 1)[0]) if len(late) > 2 else 0.0

    def growth(self) -> float | None:
        """Of the median memory, from the first third of the time after `WARM_MINUTES` to the last; None where
        there is too little of it. Medians, since what random hands left open comes and goes."""
        late = np.array([(at, size) for at, size in self.checkpoints if at >= WARM_MINUTES])
        if len(late) < 6:
            return None
        third = len(late) // 3
        return float(np.median(late[-third:, 1]) / np.median(late[:third, 1]) - 1)


class Staying(Session):
    """A window that is not to be left."""

    @property
    def should_close(self) -> bool:
        if self.state.leaving:
            self.state = replace(self.state, leaving=False)
        glfw.set_window_should_close(self._window, False)
        return False


def inside(width: int, height: int, photos: tuple[str, ...]) -> None:
    """The process of the window: a line of JSON about it twice a second, until stdin ends. A line there asks
    for the window of the checkpoints, as if nobody had left anything open in it."""
    ended, asked = threading.Event(), threading.Event()

    def listen() -> None:
        for _ in sys.stdin:
            asked.set()
        ended.set()

    threading.Thread(target=listen, daemon=True).start()
    items = Items()
    session = Staying(photos, (width, height))
    if photos:
        _see_everything(session)
    frames, said, latest = 0, 0.0, 0.0
    loaded, came = packages(), list[str]()
    while not ended.is_set() and not session.should_close:
        if session.step(0.25):
            frames, latest = frames + 1, max(latest, session.lag)
        if asked.is_set():
            asked.clear()
            loaded, came = packages(), [*came, *sorted(packages() - loaded)]
            _tidy(session)
            glfw.set_window_size(session._window, width, height)
        if time.monotonic() - said > 0.5:
            said, state = time.monotonic(), session.state
            now = items.now()
            line = {
                "frames": frames,
                "latest": latest,
                "rss": resident_mb(os.getpid()),
                "taken": memory_parts(os.getpid()),
                "loaded": came,
                "rooms": held_mb(state.scene.rooms) if state.scene.rooms else 0.0,
                "scene": state.scene.info.serial if state.scene.info and state.scene.job is None else None,
                "gaussians": state.scene.info.num_gaussians if state.scene.info else 0,
                "unexpected": [t.text for t in state.toasts if "unexpected" in t.text],
                "gl_errors": session.gl_errors,
                "dialog": None if state.dialog is None else state.dialog.name,
                "queued": len(imgui.get_current_context().input_events_queue),
                "job": None if state.scene.job is None else state.scene.job.stage,
                "discard": next((now[name][0] for name in SURE if now.get(name)), None),
            }
            sys.stdout.write(json.dumps(line) + "\n")
            sys.stdout.flush()
    session.close()


def _tidy(session: Session) -> None:
    """Without phrases, panels or a photo beside the picture, and with the preferences of a new window."""
    for prompt in session.state.asking.prompts:
        session.dispatch(ask.RemovePrompt(prompt.key))
    own = session.state.preferences
    plain = replace(DEFAULTS, window=own.window, recent=own.recent, folder=own.folder)
    for command in (
        camera.SetMode(pictures.RGB),
        camera.Compare(None),
        ShowInventory(False),
        ShowTour(False),
        do.ShowDialog(None),
        Prefer(plain),
    ):
        session.dispatch(command)


def _see_everything(session: Session) -> None:
    """Wait for the scene of the photos, ask, look at it in every mode, on a way between two places, and after
    every command: what OpenGL compiles for each, and keeps, is there before memory is compared."""

    def goes_on(seconds: float, until: Callable[[], bool]) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            session.step(0.25)

    goes_on(PATIENCE, lambda: session.state.scene.info is not None)
    session.dispatch(ask.EditPrompt(session.state.asking.prompts[0].key, "plant"))
    for mode in PICTURES:
        session.dispatch(camera.SetMode(mode))
        goes_on(MODE_SECONDS, lambda: False)
    for turn in (0.0, 0.1):
        session.dispatch(camera.Orbit(turn, 0.0))
        session.dispatch(film.AddKey())
    session.dispatch(film.Preview())
    goes_on(PATIENCE, lambda: session.state.filming.tour is not None)
    session.dispatch(film.StopTour())
    session.dispatch(film.ClearKeys())
    for entry in ENTRIES:
        session.dispatch(edit.SelectAll())
        command = entry.make(session.state)
        if command is not None:
            session.dispatch(command)
            goes_on(COMMAND_SECONDS, lambda: False)
            session.dispatch(do.ShowDialog(None))
    session.dispatch(camera.SetMode(pictures.RGB))


class Hands:
    """The random input; `scene` is opened at every checkpoint."""

    def __init__(self, display: str, folder: Path, scene: Path, size: tuple[int, int], seed: int) -> None:
        self._random = random.Random(seed)
        self._size = size
        self._scene = scene
        self._content = scene.read_bytes()
        self._environment = {**os.environ, "DISPLAY": display}
        self._display = display
        self._folder = folder
        self._droppable = self._fill(folder / "things")

    def _fill(self, things: Path) -> list[list[Path]]:
        """Files to drop, of every sort."""
        things.mkdir()
        for name in PHOTOS:
            shutil.copy(ROOT / "assets" / "photos" / name, things / name)
        (things / "notes.txt").write_text("no photo")
        (things / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0 cut short")
        (things / "broken.langflash").write_bytes(b"\0" * 100)
        left, right, books = (things / name for name in PHOTOS)
        names = ([left, right], [left, right], [books], [things], [things / "notes.txt"], [self._scene])
        return [*names, [things / "broken.jpg"], [things / "broken.langflash"], [things / "gone.png"]]

    def find(self, patience: float = PATIENCE) -> None:
        """Wait for the window and give it the keyboard."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            found = self._xdotool("search", "--name", "LangFlash").split()
            if found:
                self.window = int(found[0])
                self._xdotool("windowmove", found[0], "0", "0", "windowfocus", "--sync", found[0])
                return
            time.sleep(0.2)
        raise TimeoutError("no window")

    def act(self) -> None:
        """Some random steps, or one drop, resize, close or command by its name."""
        chosen = self._random.random()
        if chosen < 0.06:
            self.drop(self._random.choice(self._droppable))
        elif chosen < 0.09:
            width, height = (self._random.randint(side * 2 // 3, side) for side in self._size)
            self._xdotool("windowsize", str(self.window), str(width), str(height))
        elif chosen < 0.10:
            with self._client() as client:
                client.ask_to_close(self.window)
        elif chosen < 0.20:
            self._xdotool("key", "Escape", "key", PALETTE)
            self._xdotool("type", "--delay", "5", self._random.choice(COMMANDS))
            self._xdotool("sleep", "0.2", "key", "Return")
        else:
            steps = [self._step() for _ in range(STEPS_AT_ONCE)]
            self._xdotool(*(word for step in steps for word in step))
            if chosen > 0.7:  # to xdotool all words after "type" are text
                self._xdotool("type", "--delay", "5", self._random.choice(WORDS))
            self._xdotool("keyup", "shift", "keyup", "ctrl", "mouseup", "1", "mouseup", "2", "mouseup", "3")

    def drop(self, paths: list[Path]) -> None:
        """Files onto the window."""
        at = (self._size[0] // 2, self._size[1] // 2)
        with self._client() as client:
            client.drop(self.window, paths, at, PATIENCE)

    def open_scene(self) -> None:
        """The scene of the checkpoints as it was at first, whatever is going on."""
        write_atomically(self._scene, self._content)
        self.drop([self._scene])
        self._xdotool("mousemove", "5", str(self._size[1] - 5))

    def click(self, box: list[int]) -> None:
        """The middle of an item."""
        left, top, right, bottom = box
        at = (str((left + right) // 2), str((top + bottom) // 2))
        self._xdotool("mousemove", *at, "sleep", "0.3", "click", "1", "sleep", "1")

    def look(self) -> np.ndarray:
        """The screen, (H, W, 3) uint8."""
        with self._client() as client:
            return client.picture(*self._size)

    def _step(self) -> list[str]:
        r = self._random
        place = [str(r.randrange(side)) for side in self._size]
        button = r.choice("11123")
        match r.choices(("move", "click", "drag", "wheel", "key"), (2, 5, 3, 2, 5))[0]:
            case "move":
                return ["mousemove", *place]
            case "click":
                return ["mousemove", *place, "sleep", "0.03", "click", button]
            case "drag":
                held = r.choice(("", "", "shift", "ctrl"))
                there = [str(r.randrange(side)) for side in self._size]
                drag = ["mousemove", *place, "mousedown", button, "sleep", "0.03", "mousemove", *there]
                drag += ["sleep", "0.03", "mouseup", button]
                return [*(["keydown", held] if held else []), *drag, *(["keyup", held] if held else [])]
            case "wheel":
                return ["mousemove", *place, "click", "--repeat", str(r.randint(1, 5)), r.choice("45")]
        return ["key", r.choice(KEYS)]

    @contextmanager
    def _client(self):
        client = Client(self._display)
        try:
            yield client
        finally:
            client.close()

    def _xdotool(self, *words: str) -> str:
        return subprocess.run(
            ["xdotool", *words], env=self._environment, capture_output=True, text=True
        ).stdout


class Watched:
    """The window's process and what it says."""

    def __init__(self, display: str, folder: Path, size: tuple[int, int], photos: Sequence[Path]) -> None:
        program = [sys.executable, "-m", "tests.tools.monkey", "--inside", *map(str, (*size, *photos))]
        own = {**environment(folder, ROOT), "DISPLAY": display}
        own.pop("WAYLAND_DISPLAY", None)
        self._errors = (folder / "stderr.txt").open("w+")
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": self._errors}
        self.process = subprocess.Popen(program, env=own, cwd=folder, text=True, **pipes)
        self.last: dict = {}
        self.heard = time.monotonic()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.last, self.heard = json.loads(line), time.monotonic()

    def problems(self) -> list[str]:
        """What has gone wrong so far."""
        said = self.last
        found = [*said.get("gl_errors", []), *said.get("unexpected", [])]
        if self.process.poll() is not None:
            found.append(f"the window ended with {self.process.returncode}")
        if time.monotonic() - self.heard > PATIENCE:
            found.append(f"no sign of life for {PATIENCE:.0f} s")
        self._errors.seek(0)
        errors = self._errors.read()
        if "Traceback" in errors or "rror" in errors:
            found.append(errors[-3000:])
        return found

    def has_listened(self) -> None:
        """Wait until the window has taken the input that waits: a frame takes one letter of a command, so
        what a slow one was sent would answer the questions of what comes now."""
        start = time.monotonic()
        self._waits(lambda: self.heard > start + 1.0 and not self.last.get("queued"), PATIENCE)

    def until_scene(self, before: int | None, count: int, click: Callable[[list[int]], None]) -> bool:
        """Wait for another scene than number `before`, of `count` Gaussians, at rest; edits that would be
        lost are to be discarded with a click. Input that waited may have merged it instead, or have answered
        the question: then nothing more comes."""
        end = time.monotonic() + PATIENCE
        idle, seen = time.monotonic(), None
        while time.monotonic() < end and self.process.poll() is None:
            now = (self.last.get("scene"), self.last.get("dialog"))
            if self.last.get("job") or now != seen:
                idle, seen = time.monotonic(), now
            if time.monotonic() - idle > IDLE:
                return False
            if box := self.last.get("discard"):
                click(box)
                self._is_answered(box, end)
                idle = time.monotonic()
            elif self._has_come(before, count):
                time.sleep(2.0)  # for what follows a scene: words of its atoms, files kept
                if not self.last.get("discard"):
                    return self._has_come(before, count)
            time.sleep(0.2)
        return False

    def _is_answered(self, box: list[int], end: float) -> None:
        """Wait until a click on a question has come through what was typed before, of which a frame takes one
        letter. A second click would meet the next question's button."""
        self._waits(lambda: self.last.get("discard") != box, min(end - time.monotonic(), LONGEST_QUEUE))

    def reconstructs(self) -> bool:
        """Wait for the scene of the photos that the window was launched with."""
        self._waits(lambda: self.last.get("scene") is not None, PATIENCE)
        return self.last.get("scene") is not None

    def _waits(self, holds: Callable[[], bool], patience: float) -> None:
        """Until something holds, the time is over, or the window has ended."""
        end = time.monotonic() + patience
        while not holds() and time.monotonic() < end and self.process.poll() is None:
            time.sleep(0.1)

    def ask(self) -> None:
        """Ask for the checkpoints' size and picture."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write("\n")
            self.process.stdin.flush()

    def rests(self) -> None:
        """Ask again, since input may have waited, and wait until nothing is drawn any more."""
        self.ask()
        end = time.monotonic() + LONGEST_REST
        frames, since = self.last.get("frames"), time.monotonic()
        while time.monotonic() < min(end, since + AT_REST):
            time.sleep(0.2)
            if self.last.get("frames") != frames:
                frames, since = self.last.get("frames"), time.monotonic()

    def _has_come(self, before: int | None, count: int) -> bool:
        return self.last.get("scene") not in (None, before) and self.last["gaussians"] == count

    def end(self) -> int:
        """Ask the process to end, and wait."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        try:
            code = self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        self._reader.join(PATIENCE)
        assert self.process.stdout is not None
        self.process.stdout.close()
        self._errors.close()
        return code


def opened(hands: Hands, watched: Watched, count: int) -> bool:
    """Open the scene, of `count` Gaussians; again where random input that still waited has opened another one
    since."""
    for _ in range(3):
        watched.has_listened()
        before = watched.last.get("scene")
        hands.open_scene()
        if watched.until_scene(before, count, hands.click):
            return True
    return False


def run(
    seconds: float,
    seed: int,
    size: tuple[int, int],
    every: float = 60.0,
    photos: Sequence[Path] = (),
    say=lambda text: None,
) -> Outcome:
    """Random input for some seconds, a checkpoint `every` so many. photos: what it begins with, to see
    everything once before."""
    from langflash_core.language.spaces import language_space
    from langflash_core.scene.file import save
    from tests.app.window.scenes import PHRASES, room

    outcome = Outcome()
    with tempfile.TemporaryDirectory(prefix="monkey-") as place, x_server(*size) as display:
        folder = Path(place).resolve()
        scene = folder / "room.langflash"
        made = room(language_space("minilm").encode(list(PHRASES)))
        save(made, scene)
        watched = Watched(display, folder, size, photos)
        try:
            hands = Hands(display, folder, scene, size, seed)
            try:
                hands.find()
            except TimeoutError as error:
                outcome.problems += [str(error), *watched.problems()]
            if not outcome.problems and photos and not watched.reconstructs():
                outcome.problems.append(f"the photos became no scene: {watched.last}")
            start = time.monotonic()
            checkpoint, known = 0.0, 0
            while not outcome.problems:
                now = time.monotonic() - start
                if now >= checkpoint or now >= seconds:
                    watched.ask()  # a scene comes without what pictures of the one before needed
                    if not opened(hands, watched, len(made.gaussians)):
                        outcome.problems.append(f"the scene did not open: {watched.last}")
                    watched.rests()
                    rooms = watched.last.get("rooms", 0.0)
                    memory = watched.last.get("rss", 0.0) - rooms
                    outcome.checkpoints.append((now / 60, memory))
                    sizes = f"{memory:6.0f} MB and {rooms:.0f} of rooms"
                    parts = ", ".join(f"{k} {v:.0f}" for k, v in watched.last.get("taken", {}).items())
                    came = watched.last.get("loaded", [])
                    since = " ".join(came[known:])
                    say(f"{now / 60:5.1f} min  {sizes}  {outcome.steps} steps; {parts}; {since}")
                    known = len(came)
                    checkpoint = now + every
                if now >= seconds:
                    break
                hands.act()
                outcome.steps += 1
                outcome.problems += watched.problems()
            outcome.problems += [p for p in watched.problems() if p not in outcome.problems]
            if outcome.problems:
                outcome.picture = hands.look()
        finally:
            code = watched.end()
        if code and not outcome.problems:
            outcome.problems.append(f"the window ended with {code}")
        outcome.frames, outcome.latest = watched.last.get("frames", 0), watched.last.get("latest", 0.0)
        notes = folder / REFUSED
        outcome.refused = notes.read_text().splitlines() if notes.is_file() else []
    return outcome


def main() -> int:
    if sys.argv[1:2] == ["--inside"]:
        inside(int(sys.argv[2]), int(sys.argv[3]), tuple(sys.argv[4:]))
        return 0
    parser = argparse.ArgumentParser(description="Random input into a real window.")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--screen", default="1000x700")
    args = parser.parse_args()
    width, height = map(int, args.screen.split("x"))

    def say(text: str) -> None:
        sys.stdout.write(text + "\n")
        sys.stdout.flush()

    photos = [asset_path(f"photos/{name}") for name in PAIR]
    outcome = run(60 * args.minutes, args.seed, (width, height), photos=photos, say=say)
    say(f"{outcome.steps} batches, {outcome.frames} frames, the latest by {outcome.latest:.2f} s")
    if outcome.picture is not None:
        picture = Path(tempfile.gettempdir()) / "monkey.png"
        Image.fromarray(outcome.picture).save(picture)
        say(f"what the screen showed is in {picture}")
    growth = outcome.growth()
    if growth is not None:
        say(f"memory {100 * growth:+.2f} % from minute {WARM_MINUTES:.0f} to the end")
    say(f"memory {outcome.slope():+.2f} MB a minute; refused outside the folder: {len(outcome.refused)}")
    for line in sorted(set(outcome.refused))[:20]:
        say(f"  {line}")
    if outcome.slope() > SLOPE_MB:
        outcome.problems.append("memory grows")
    for problem in outcome.problems:
        say(f"PROBLEM {problem}")
    return 1 if outcome.problems else 0


if __name__ == "__main__":
    sys.exit(main())
