"""A program is killed with -9 at a random moment: while it writes, while it recovers, and once more.

    python -m tests.torture kills [--seed 1] [--count 1000]

The program is a copy (fork) of this process that runs the product's own functions on files of its own. What
it has finished it says through a pipe, so that what may be lost is known: the last thing alone, which was not
finished. After each kill: every file is whole, old or new; nothing finished is missing; and what the dead one
left half-written is swept up by the next write.
"""

import os
import random
import shutil
import signal
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.places import config_folder, state_folder
from app.window.commands import Command
from app.window.editing import commands as edit
from app.window.recovery import commands as keep
from app.window.recovery import preferences
from app.window.recovery.effects import KEEP_AFTER
from app.window.scene import commands as show
from app.window.scene.work import LoadScene, describe_scene
from langflash_core.base.files import staged_folder
from langflash_core.export import export
from langflash_core.scene.edited import edited_scene, first_marks
from langflash_core.scene.edits import Mask, delete
from langflash_core.types import Scene
from tests.app.cli.conftest import stripes
from tests.app.window.desk import Desk
from tests.torture.rows import Counted

ENDINGS = (".langflash", ".ply", ".spz", ".sog", ".glb", ".splat", ".compressed.ply", ".html")
DONE = -(1 << 62)
Say = Callable[[int], object]


def killed(work: Callable[[Say], None], seconds: float) -> tuple[list[int], bool]:
    """Do `work` in a copy of this process, and kill it so many seconds after its first word, or so.

    Returns what it said it had done, and whether it was still at work.
    """
    heard, said = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.close(heard)
            os.nice(5)
            work(lambda number: os.write(said, struct.pack("<q", number)))
            os.write(said, struct.pack("<q", DONE))
            time.sleep(60)
        finally:
            os._exit(code)
    os.close(said)
    with os.fdopen(heard, "rb") as words:
        first = words.read(8)  # the work has begun
        time.sleep(seconds)
        with suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        rest = first + words.read()
    whole = len(rest) // 8 * 8
    numbers = [number for (number,) in struct.iter_unpack("<q", rest[:whole])]
    if os.WIFEXITED(status) and os.WEXITSTATUS(status):
        raise RuntimeError(f"the work itself failed, after {numbers}")
    return [number for number in numbers if number != DONE], DONE not in numbers


# --- while it writes ------------------------------------------------------------------------------


def writing(folder: Path, count: int, rng: random.Random) -> Iterator[Counted]:
    """Saves and exports over each other, a folder of answers, preferences, a session with its edits."""
    yield _over_each_other(folder / "files", count * 45 // 100, rng)
    yield _folders(folder / "folders", count * 10 // 100, rng)
    yield _preferred(count * 10 // 100, rng)
    yield _autosaves(count * 35 // 100, rng)


def _over_each_other(folder: Path, count: int, rng: random.Random) -> Counted:
    """One file, written again and again by two scenes in turn."""
    row, scenes = Counted("killed at: save and export"), (stripes(), fewer(stripes()))
    folder.mkdir(parents=True)
    known: dict[str, set[bytes]] = {}
    for ending in ENDINGS:
        path = folder / f"a{ending}"
        known[ending] = set()
        for scene in scenes:
            export(scene, path)
            known[ending].add(path.read_bytes())
        assert len(known[ending]) == 2
    for _ in range(count):
        ending = rng.choice(ENDINGS)
        path = folder / f"a{ending}"

        def work(say: Say, path: Path = path) -> None:
            say(0)
            while True:
                for scene in scenes:
                    export(scene, path)

        _, inside = killed(work, rng.uniform(0, 0.08))
        row.done(inside)
        if not path.is_file() or path.read_bytes() not in known[ending]:
            row.finds.append(f"{path.name} is neither of the two")
        export(scenes[0], path)
        row.finds += [f"not swept up: {left}" for left in parts(folder)]
    return row


def fewer(scene: Scene) -> Scene:
    return edited_scene(scene, delete(first_marks(scene), some(scene, 0)))


def _folders(folder: Path, count: int, rng: random.Random) -> Counted:
    """Ten files that belong together are put in place together: a kill between two of the moves is all that
    may part them, and then every one of them is whole."""
    row = Counted("killed at: a folder of files")
    folder.mkdir(parents=True)

    def fill(number: int) -> None:
        with staged_folder(folder / "out") as staging:
            for place in range(10):
                (staging / f"{place}").write_bytes(bytes([number]) * 20_000)

    def work(say: Say) -> None:
        say(0)
        for number in range(1, 200):
            fill(number)

    for _ in range(count):
        _, inside = killed(work, rng.uniform(0, 0.03))
        row.done(inside)
        for path in filter(Path.is_file, (folder / "out").glob("*")):
            content = path.read_bytes()
            if len(content) != 20_000 or len(set(content)) != 1:
                row.finds.append(f"{path.name} is torn")
        fill(0)
        row.finds += [f"not swept up: {left}" for left in parts(folder)]
    return row


def _preferred(count: int, rng: random.Random) -> Counted:
    row = Counted("killed at: preferences")

    def work(say: Say) -> None:
        say(0)
        for number in range(10_000):
            preferences.save(replace(preferences.DEFAULTS, recent=(str(number),) * 5))

    preferences.save(preferences.DEFAULTS)
    for _ in range(count):
        _, inside = killed(work, rng.uniform(0, 0.01))
        row.done(inside)
        _, complaint = preferences.load()
        row.finds += [complaint] if complaint else []
        preferences.save(preferences.DEFAULTS)
        row.finds += [f"not swept up: {left}" for left in parts(config_folder())]
    return row


# --- a session with its edits ---------------------------------------------------------------------


def some(scene: Scene, number: int) -> Mask:
    """The Gaussians of one edit; every edit has others."""
    return Mask.of(np.arange(len(scene.gaussians)) % 64 == number % 64)


class Window(Desk):
    """Also opens what it is told to open, as the window's worker does."""

    def perform(self, *commands: Command) -> None:
        super().perform(*commands)
        for command in commands:
            if isinstance(command, show.OpenScene):
                self.asked.append(LoadScene(command.path, command.edits, command.alone))


def make_edit(desk: Desk, scene: Scene, number: int) -> None:
    """One edit, and the time until it is kept."""
    desk.perform(edit.Found(some(scene, number), "replace", "here"))
    desk.perform(edit.Delete())
    rest(desk)


def rest(desk: Desk) -> None:
    """A moment without a change: everything is kept."""
    for _ in range(2):  # the session names edits that are kept
        desk.pass_time(2 * KEEP_AFTER)
        desk.work()
    desk.written()


def _count(desk: Desk) -> int:
    """Edits of the scene on show, without the selections between."""
    history = desk.state.editing.history
    return 0 if history is None else len(history.done) // 2


def begin(scene: Scene, say: Say, most: int) -> None:
    """A window with an unsaved scene, and edits until it is killed."""
    desk = Window()
    desk.effects.begin(preferences.DEFAULTS, "", empty=True)
    desk.work()
    desk.perform(show.SceneArrived(describe_scene(scene, serial=1, name="room")))
    desk.work()
    rest(desk)
    say(0)
    for number in range(1, most + 1):
        make_edit(desk, scene, number)
        say(number)


def recovered(say: Say | None = None) -> Desk:
    """A window that goes on with what was left behind, whichever way it is offered."""
    desk = Window()
    if say is not None:
        say(-1)
    desk.effects.begin(preferences.DEFAULTS, "", empty=True)
    desk.work()
    if desk.state.recovery.session is not None:
        desk.perform(keep.EndSessionOffer(restore=True))
    elif desk.state.recovery.edits is not None:
        desk.perform(keep.EndOffer(restore=True))
    desk.work()
    rest(desk)
    return desk


def _autosaves(count: int, rng: random.Random) -> Counted:
    row, scene = Counted("killed at: autosave"), stripes()
    for _ in range(count):
        clean()
        done, inside = killed(lambda say: begin(scene, say, 40), rng.uniform(0, 0.4))
        row.done(inside)
        row.finds += _lost(max(done))
    return row


def recovering(count: int, rng: random.Random, again: bool) -> Counted:
    """A window is killed with edits that nobody saved; the next is killed while it takes them over, and, with
    `again`, not before it has gone on editing."""
    row = Counted("killed at: recovery and edits" if again else "killed at: recovery")
    scene = stripes()

    def second(say: Say) -> None:
        desk = recovered(say)
        if again and desk.state.scene.info is not None:
            for number in range(10, 40):
                make_edit(desk, desk.state.scene.info.scene, number)
                say(_count(desk))

    for _ in range(count):
        clean()
        done, _ = killed(lambda say: begin(scene, say, 3), rng.uniform(0.05, 0.3))
        done2, inside = killed(second, rng.uniform(0, 0.5 if again else 0.2))
        row.done(inside)
        row.finds += _lost(max(max(done), max(done2)))
    return row


def _lost(kept: int) -> list[str]:
    """What is wrong with what can be had back, where so many edits were kept."""
    desk = recovered()
    finds = []
    have = _count(desk)
    if desk.state.scene.info is None:
        finds.append(f"nothing is offered, {kept} edits were kept")
    elif not kept <= have <= kept + 1:
        finds.append(f"{have} edits came back of {kept}")
    desk.effects.close(desk.state, crashed=False)
    finds += [f"not swept up: {left}" for left in parts(state_folder())]
    return finds


def own_places(folder: Path) -> None:
    """What programs remember goes into a folder from here on."""
    for name in ("STATE", "CONFIG"):
        os.environ[f"LANGFLASH_{name}"] = str(folder / name.lower())


def clean() -> None:
    shutil.rmtree(state_folder(), ignore_errors=True)


def parts(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob("*.part")] if folder.is_dir() else []


def everything(folder: Path, count: int, seed: int) -> Iterator[Counted]:
    """All rows: `count` kills while it writes, a fifth of them while it recovers, a fifth twice in a row."""
    rng = random.Random(seed)
    own_places(folder)
    yield from writing(folder, count, rng)
    yield recovering(count // 5, rng, again=False)
    yield recovering(count // 5, rng, again=True)
