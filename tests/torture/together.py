"""Two programs at once on one scene, one recovery folder, one preferences file, one vocabulary, one batch
folder: what either finished is there afterwards, or a sentence has said what is not.

    python -m tests.torture together [--seed 1] [--rounds 20]

Each program is a copy (fork) of this process that runs the product's own functions; both begin at once, and
rest for random moments between what they do.
"""

import json
import os
import random
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from app.places import config_folder
from app.window.editing.teaching import WORDS, with_kept
from app.window.recovery import preferences
from app.window.recovery.preferences import DEFAULTS, Preferences
from app.window.scene.commands import SceneArrived
from app.window.scene.work import describe_scene
from langflash_core.errors import LangFlashError
from langflash_core.language.lessons import Lesson, Lessons, read_lessons
from langflash_core.scene.file import load, save
from tests.app.cli.conftest import stripes
from tests.torture.jobs import in_this_process, small_pair
from tests.torture.kills import Window, begin, clean, fewer, killed, make_edit, own_places, parts, recovered
from tests.torture.rows import Counted

OWN = (  # settings that one of two windows changes, and one that both do
    {"theme": ("dark", "light"), "speed": (0.5, 1.0, 3.0), "dictionary_open": (True, False)},
    {"scale": (1.0, 1.25, 1.5), "fill_gaps": (True, False), "panel_width": (348.0, 420.0)},
)
BOTH = {"detail": ("low", "normal", "high")}
_BATCH = ("--size", "84", "--gaussians", "1000", "--backend", "torch")


def everything(folder: Path, count: int, seed: int) -> Iterator[Counted]:
    """All rows; count: how often each, but for batches, of which there is a twentieth."""
    rng = random.Random(seed)
    own_places(folder)
    for name, once in (
        ("saves of one scene", lambda: saves(folder, rng)), ("preferences", lambda: settings(folder, rng)),
        ("vocabulary", lambda: taught(rng)), ("windows that die together", lambda: windows(rng)),
        ("one scene, edited in both", lambda: one_scene(folder, rng)),
        ("recovered by both at once", lambda: both_recover(rng)), ("batch", lambda: batches(folder)),
    ):  # fmt: skip
        row = Counted(f"two at once: {name}")
        for _ in range(count if name != "batch" else max(1, count // 20)):
            row.finds += once()
            row.done()
        yield row


def both(work: Callable[[int], object]) -> list[str]:
    """Twice at once, to the end; what went wrong in either."""
    finds, children = [], []
    for number in range(2):
        heard, said = os.pipe()
        child = os.fork()
        if child == 0:
            words = "ended without a word"
            try:
                work(number)
                words = ""
            except Exception as error:
                words = repr(error)
            finally:
                os.write(said, words.encode()[:4000])
                os._exit(0)
        os.close(said)
        children.append((child, heard))
    for child, heard in children:
        with os.fdopen(heard, "rb") as stream:
            words = stream.read().decode()
        if os.waitpid(child, 0)[1] or words:
            finds.append(f"the work of one of two failed: {words}")
    return finds


def _rests(seed: float, number: int) -> random.Random:
    """What one of two draws from; it has rested already."""
    rng = random.Random(f"{seed} {number}")
    time.sleep(rng.uniform(0, 0.003))
    return rng


# --- files ----------------------------------------------------------------------------------------


def saves(folder: Path, rng: random.Random) -> list[str]:
    """Two save over one file while a third reads it: it is one of the two scenes at any time."""
    scenes, path, seed = (stripes(), fewer(stripes())), folder / "both.langflash", rng.random()
    sizes = {len(scene.gaussians) for scene in scenes}
    save(scenes[0], path)

    def work(number: int) -> None:
        rests = _rests(seed, number)
        for _ in range(10):
            save(scenes[number], path)
            seen = len(load(path).gaussians)
            assert seen in sizes, seen
            time.sleep(rests.uniform(0, 0.002))

    finds = both(work)
    if len(load(path).gaussians) not in sizes:
        finds.append("two saves into one file tore it")
    return finds + [f"left behind: {name}" for name in parts(folder)]


def settings(folder: Path, rng: random.Random) -> list[str]:
    """Two windows change settings of their own, one that both have, and open files."""
    seed = rng.random()
    preferences.save(DEFAULTS)

    def work(number: int) -> None:
        rests, own, since = _rests(seed, number), DEFAULTS, DEFAULTS
        for step in range(12):
            name, values = rests.choice(list({**OWN[number], **BOTH}.items()))
            own = replace(own, **{name: rests.choice(values)})
            if rests.random() < 0.4:
                own = own.opened(Path(f"/{number}/{step % 5}.langflash"))
            said = preferences.try_to_save(own, since)
            assert not said, said
            since = own
            time.sleep(rests.uniform(0, 0.002))
        (folder / f"{number}.json").write_text(json.dumps(asdict(own)))

    finds = both(work)
    kept, complaint = preferences.load()
    lasts = [json.loads((folder / f"{number}.json").read_bytes()) for number in range(2)]
    finds += [complaint] if complaint else []
    return finds + list(_lost_settings(kept, lasts))


def _lost_settings(kept: Preferences, lasts: list[dict]) -> Iterator[str]:
    for number, last in enumerate(lasts):
        for name in OWN[number]:
            if getattr(kept, name) != last[name]:
                yield f"window {number} left {name} at {last[name]}, kept is {getattr(kept, name)}"
        for path in set(last["recent"]) - set(kept.recent):
            yield f"{path} is no recent file any more"
    if kept.detail not in {last["detail"] for last in lasts} | {DEFAULTS.detail}:
        yield f"the detail is {kept.detail}"


def taught(rng: random.Random) -> list[str]:
    """Two windows keep what was taught for other scenes."""
    seed, path, count = rng.random(), config_folder() / WORDS, 5
    path.unlink(missing_ok=True)

    def work(number: int) -> None:
        rests = _rests(seed, number)
        for step in range(count):
            vector = np.zeros(2 * count, np.float32)
            vector[number * count + step] = 1
            with_kept(Lessons("f00d", (Lesson(vector, f"thing {number} {step}"),)), path)
            time.sleep(rests.uniform(0, 0.002))

    finds = both(work)
    names = {lesson.name for lesson in read_lessons(path).lessons}
    wanted = {f"thing {number} {step}" for number in range(2) for step in range(count)}
    return finds + [f"forgotten: {name}" for name in sorted(wanted - names)]


def batches(folder: Path) -> list[str]:
    """Two runs of one batch: one works, the other says so; a third finds all done."""
    from app.cli import main

    out, told = folder / "batch", folder / "told"
    if not (folder / "sets").is_dir():
        for name in ("hall", "room"):
            small_pair(folder / "sets" / name)

    def run(number: int) -> None:
        with told.with_suffix(f".{number}").open("w") as stream, in_this_process():
            os.dup2(stream.fileno(), 1)
            os.dup2(stream.fileno(), 2)
            code = main(["batch", str(folder / "sets"), "-o", str(out), *_BATCH])
        told.with_suffix(f".{number}.code").write_text(str(code))

    finds = both(run)
    codes = [int(told.with_suffix(f".{number}.code").read_text()) for number in range(2)]
    said = [told.with_suffix(f".{number}").read_text() for number in range(2)]
    for code, words in zip(codes, said, strict=True):
        if code and not (code == 2 and "another run is writing" in words):
            finds.append(f"exit code {code}: {words[-200:]!r}")
    if all(codes):
        finds.append("neither of two batches worked")
    for name in ("hall", "room"):
        scenes = list(out.rglob(f"{name}*/*.langflash")) + list(out.rglob(f"{name}.langflash"))
        finds += (
            [] if scenes and all(len(load(path).gaussians) for path in scenes) else [f"no scene of {name}"]
        )
    return finds + [f"left behind: {name}" for name in parts(out)]


# --- windows --------------------------------------------------------------------------------------


def windows(rng: random.Random) -> list[str]:
    """Both die with a scene that nobody saved; both can be had back, one after the other."""
    clean()
    scenes = (stripes(), fewer(stripes()))
    for scene in scenes:
        killed(lambda say, scene=scene: begin(scene, say, 0), rng.uniform(0.2, 0.3))
    found = {size for size, _ in _had_back(2)}
    wanted = {len(scene.gaussians) for scene in scenes}
    return [] if found == wanted else [f"of scenes of {wanted} came back {found}"]


def one_scene(folder: Path, rng: random.Random) -> list[str]:
    """One file open in two windows, edited in both at once, killed: both windows' edits can be had back."""
    clean()
    path = folder / "edited.langflash"
    save(stripes(), path)
    counts = (rng.randint(1, 4), rng.randint(5, 8))

    def work(number: int) -> None:
        desk = Window()
        desk.effects.begin(DEFAULTS, "", empty=False)
        scene = load(path)
        desk.perform(SceneArrived(describe_scene(scene, serial=1, name=path.name, path=path)))
        desk.work()
        for step in range(counts[number]):
            make_edit(desk, scene, step)
            time.sleep(rng.uniform(0, 0.002))
        os._exit(0)  # as a kill would leave it

    finds = both(work)
    found = {edits for _, edits in _had_back(2)}
    return finds + ([] if found == set(counts) else [f"of {set(counts)} edits came back {found}"])


def _had_back(most: int) -> Iterator[tuple[int, int]]:
    """Gaussians and edits of what so many windows get back, one after the other; each ends well."""
    for _ in range(most):
        desk = recovered()
        info, history = desk.state.scene.info, desk.state.editing.history
        if info is not None and history is not None:
            yield info.num_gaussians, len(history.done) // 2
        desk.effects.close(desk.state, crashed=False)


def both_recover(rng: random.Random) -> list[str]:
    """Two windows start at once on what one has left, and die; all of it is offered afterwards."""
    clean()
    scene = stripes()
    done, _ = killed(lambda say: begin(scene, say, 3), rng.uniform(0.1, 0.3))

    def work(number: int) -> None:
        time.sleep(random.Random(f"{number}{done}").uniform(0, 0.02))
        with suppress(LangFlashError):  # a sentence: the other has taken it over
            recovered()
        os._exit(0)  # as a kill would leave it

    finds = both(work)
    best = max((edits for _, edits in _had_back(3)), default=-1)  # a later start offers what lies deeper
    return finds + ([] if best >= max(done) else [f"{best} edits came back of {max(done)}"])
