"""What is done while calls fail (`nth.py`): commands on small photos and scenes, and the window's keeping."""

import os
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from app.cli import main
from app.places import state_folder
from app.window.recovery import edits, preferences, records
from app.window.recovery.records import Keeper
from app.window.recovery.state import Kept
from app.window.scene.work import LoadScene
from langflash_core.base.formats import USD
from langflash_core.base.outputs import OUTPUTS, Output
from langflash_core.base.resources import asset_path
from langflash_core.batch.dispatch import Job as Set
from langflash_core.batch.dispatch import Lost, Made
from langflash_core.export import export
from langflash_core.lab.training.shards import write_shard
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History, Marks, Mask, delete
from langflash_core.scene.file import save
from langflash_core.types import Scene
from tests.app.cli.conftest import WORDS, stripes
from tests.lab.training.conftest import toy_record
from tests.torture.nth import FILES, Job

SIZE = "56x42"
FOLDERS = ("LANGFLASH_CONFIG", "LANGFLASH_STATE", "LANGFLASH_HOME")


def prepared(folder: Path) -> list[Job]:
    """All jobs, with what they read in `folder`/in."""
    source = folder / "in"
    source.mkdir(parents=True, exist_ok=True)
    for name in FOLDERS:
        os.environ[name] = str(folder / "out" / name.lower())
    photos = small_pair(source / "photos")
    content = tuple(photo.read_bytes() for photo in photos)
    posed = replace(stripes(), photos=content).with_record(photos=tuple(photo.name for photo in photos))
    export(posed, source / "s.langflash")
    _clip(source / "clips" / "one")
    small_pair(source / "sets" / "room")
    for name in ("train", "validation"):
        (source / "cache" / name).mkdir(parents=True, exist_ok=True)
        write_shard(source / "cache" / name / "a.safetensors", [toy_record(seed) for seed in range(2)])
    return [*_exports(), *_looking(), *_making(), *_keeping(posed)]


def small_pair(folder: Path, side: int = 112) -> list[Path]:
    """A shipped pair of photos, small."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "left.png", folder / "right.png"]
    for path in paths:
        with Image.open(asset_path(f"photos/living_room_{path.stem}.png")) as photo:
            photo.convert("RGB").resize((side, side * 3 // 4)).save(path)
    return paths


def _clip(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with Image.open(asset_path("photos/toy_left.png")) as opened:
        photo = opened.convert("RGB").resize((140, 98))
    for t in range(2):
        photo.crop((6 * t, 0, 6 * t + 112, 84)).save(folder / f"{t:03d}.png")


def command(*words: str | Path) -> Callable[[Path], tuple[int, str]]:
    """`langflash` with these words; `in/...` and `out/...` lie in the job's folder."""

    def run(folder: Path) -> tuple[int, str]:
        said = [str(folder / word) if str(word).startswith(("in/", "out/")) else str(word) for word in words]
        return main(said), ""

    return run


def _exports() -> Iterator[Job]:
    for kind in OUTPUTS:
        for ending in kind.endings:
            yield _export(kind, ending)


def _export(kind: Output, ending: str) -> Job:
    where = f"out/a{ending}" if ending.startswith(".") else f"out/{ending or 'folder'}"
    folder, drawn = kind.subject == "folder", kind.looks or kind.moves
    words = ["--segmented"] if folder else ["--what", kind.word] if kind.word else []
    words += ["--size", SIZE] if kind.sized and not folder else []
    words += ["--seconds", "0.3"] if kind.moves else []
    words += ["--backend", "gl"] if drawn else []
    asked = (["--prompt", WORDS[0]], ["--prompt", WORDS[2]]) if kind.takes_phrases else ([], [])
    other = ["--size", "48x36"] if kind.sized and not folder else []
    native = ending in USD
    kinds = (*FILES, *(("graphics", "lost") if drawn else ()), *(("disk",) if kind.moves or native else ()))
    start = ("export", "in/s.langflash", "-o", where, *words)
    return Job(
        f"export {ending or 'folder'} {kind.word}".strip(),
        command(*start, *asked[0]),
        command(*start, *asked[1], *other, "--replace"),
        kinds,
        same=not (kind.moves or native),
    )


def _looking() -> Iterator[Job]:
    ask = ("in/s.langflash", WORDS[0], "nothing like it", "-o", "out/answers", "--size", SIZE)
    kinds = (*FILES, "memory", "graphics", "lost")
    yield Job("query", command("query", *ask), command("query", *ask, "--view", "1"), kinds)
    draw = ("render", "in/s.langflash", "-o", "out/a.png")
    large = ("--size", "640x480", "--what", "atoms")
    yield Job("render", command(*draw, *large), command(*draw, "--size", SIZE), kinds)
    torch_only = (*large, "--backend", "torch")
    yield Job("render torch", command(*draw, *torch_only), command(*draw, "--size", SIZE), ("memory",))


def _making() -> Iterator[Job]:
    tiny = ("--size", "84", "--gaussians", "1000")
    pair = ("reconstruct", "in/photos/left.png", "in/photos/right.png", "-o", "out/a.langflash", *tiny)
    other = command(*pair, "--fov", "40")
    yield Job("reconstruct", command(*pair), other, (*FILES, "memory"))
    yield Job("reconstruct --keep", command(*pair, "--keep", "out/kept"), other, FILES, keeps="kept/")
    batch = ("batch", "in/sets", "-o", "out/batch", *tiny, "--prompt", "plant", "--export", ".ply")
    batch = (*batch, "--backend", "torch")
    yield Job("batch", _inline(*batch), _inline(*batch, "--fov", "40"), FILES, same=False)
    labels = _inline("lab", "labels", "in/clips", "-o", "out/labels", "--workers", "1")
    yield Job("labels", labels, labels, FILES, same=False)
    train = ("lab", "train", "run", "in/cache", "-o", "out/run", "--stages", "depth", "--minutes", "1")
    train, kinds = (*train, "--max-steps", "1"), (*FILES, "memory", "disk")  # torch writes by itself
    yield Job("train run", command(*train), command(*train, "--seed", "5"), kinds, same=False)


class InlineWorkers:
    """One worker in this process, so that what fails here fails in it, too."""

    count = 1

    def __init__(self, open_maker: Any, _: int = 1) -> None:
        self._opened = open_maker()
        self._make: Any = None
        self._done: list[tuple[Set, Made | Lost]] = []

    @property
    def busy(self) -> Sequence[Set]:
        return [job for job, _ in self._done]

    def start(self, job: Set) -> None:
        """What a process of its own would die of is printed, as that would, and the job is lost."""
        try:
            if self._make is None:
                self._make = self._opened.__enter__()
            made: Made | Lost = self._make(job)
        except Exception:
            traceback.print_exc()
            made = Lost("exit code 1")
        self._done.append((job, made))

    def wait(self, seconds: float) -> list[tuple[Set, Made | Lost]]:
        done, self._done = self._done, []
        return done

    def close(self) -> None:
        if self._make is not None:
            self._opened.__exit__(None, None, None)
            self._make = None


def _inline(*words: str) -> Callable[[Path], tuple[int, str]]:
    def run(folder: Path) -> tuple[int, str]:
        with in_this_process():
            return command(*words)(folder)

    return run


@contextmanager
def in_this_process() -> Iterator[None]:
    from langflash_core.batch import processes

    before = processes.LocalWorkers
    processes.LocalWorkers = InlineWorkers  # type: ignore[misc]
    try:
        yield
    finally:
        processes.LocalWorkers = before  # type: ignore[misc]


# --- what the window keeps ------------------------------------------------------------------------


def _keeping(scene: Scene) -> Iterator[Job]:
    """What the window writes beside its frames, by the functions that its threads call."""
    first = first_marks(scene)
    histories = [_history(first, count) for count in (1, 2)]

    def kept(count: int) -> Callable[[Path], tuple[int, str]]:
        return _doing(lambda _: edits.keep(scene, histories[count], "room", None, "deadbeef") and "")

    def session(name: str) -> Callable[[Path], tuple[int, str]]:
        said = Kept(name=name, phrases=(name,), likes=("",), thresholds=(None,), visible=(True,))
        return _doing(lambda _: _keep_session(said))

    def preferred(scale: float) -> Callable[[Path], tuple[int, str]]:
        return _doing(lambda _: preferences.try_to_save(replace(preferences.DEFAULTS, scale=scale)))

    def saved(which: Scene) -> Callable[[Path], tuple[int, str]]:
        return _doing(lambda folder: save(which, folder / "out" / "a.langflash"))

    less = replace(scene, photos=())
    yield Job("save", saved(scene), saved(less), FILES)
    yield Job("autosave of edits", kept(1), kept(0), FILES)
    yield Job("autosave of a session", session("new"), session("old"), FILES)
    yield Job("preferences", preferred(1.5), preferred(1.0), FILES)
    again, killed = (_recover(scene, histories[1], write) for write in (False, True))
    yield Job("recovery of edits", again, killed, ("read", "place"), fresh=False)
    yield Job("recovery of a session", _restored_session, _killed_session, ("read", "place"), fresh=False)


def _doing(work: Callable[[Path], object]) -> Callable[[Path], tuple[int, str]]:
    """What `work` gives is what it has to complain of."""

    def run(folder: Path) -> tuple[int, str]:
        said = work(folder)
        return (1, f"langflash: {said}") if said else (0, "")

    return run


def _keep_session(said: Kept) -> None:
    keeper = _keeper()
    try:
        keeper.keep(said)
    finally:
        if keeper._lock is not None:  # the process goes on: only a death or `close` opens it
            keeper._lock.close()


def _history(first: Marks, count: int) -> History:
    history = History(first)
    for n in range(count):
        rows = np.arange(first.selected.count) % 7 == n
        history = history.edited(f"Delete {n}", delete(history.marks, Mask.of(rows)))
    return history


def _keeper() -> Keeper:
    keeper = Keeper()
    keeper.token, keeper.file = "deadbeef", state_folder() / f"{records.SESSION}1-deadbeef.json"
    return keeper


def _recover(scene: Scene, history: History, write: bool) -> Callable[[Path], tuple[int, str]]:
    """Find the edits that a killed session left, and open them; what fails must not remove them."""

    def run(folder: Path) -> tuple[int, str]:
        if write:
            edits.keep(scene, history, "room", None, "deadbeef")
            return 0, ""
        offer = edits.find()
        if offer is None:
            return 1, "langflash: nothing to go on with"
        arrived = LoadScene(offer.scene, offer.edits).run(1, lambda *_: None, lambda: False)
        assert arrived.info.history == history
        return 0, ""

    return run


def _killed_session(folder: Path) -> tuple[int, str]:
    """A session whose process is gone: its file, and the copy of a scene that nobody saved."""
    state_folder().mkdir(parents=True, exist_ok=True)
    copy = state_folder() / f"{records.SESSION}1-deadbeef.langflash"
    copy.write_bytes((folder / "in" / "s.langflash").read_bytes())
    kept = Kept(
        scene=str(copy), saved=False, name="room", phrases=("plant",), likes=("",), thresholds=(None,)
    )
    copy.with_suffix(".json").write_bytes(records.told(replace(kept, visible=(True,))))
    return 0, ""


def _restored_session(folder: Path) -> tuple[int, str]:
    """What is left behind is offered, or else still there for the next start."""
    kept = records.left_behind()
    return (0, "") if kept is not None else (1, "langflash: nothing to go on with")
