"""Whether another version starts, opens, saves, asks and draws as quickly: processor seconds, in turns.

    python -m tests.tools.paired OLD NEW [--rounds 7] [--only start load ...] [--scene S.langflash]

OLD and NEW are checkouts. Each round measures every case once in a fresh process of each version, the older
one first in every other round, on one thread: what else the machine does falls on both. Of each case stand
the medians, and the ratio with the interval that holds nine tenths of its bootstrap over rounds: unchanged is
what has 1 in it. Without a scene the older version makes one of the demo photos.
"""

import argparse
import importlib
import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

import numpy as np

PHRASES = ["plant", "window", "floor", "book"]
PHOTOS = ("living_room_left.png", "living_room_right.png")
TURNS = 40  # steps of an orbit, as a drag gives them


def spent() -> float:
    """Processor seconds of this process and of those that it started and that have ended."""
    own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + others.ru_utime + others.ru_stime


def timed(act: Callable[[], object], times: int = 1) -> float:
    """Processor seconds of each of so many."""
    start = spent()
    for _ in range(times):
        act()
    return (spent() - start) / times


def help_of_the_command(scene: Path) -> float:
    words = [sys.executable, "-m", "langflash_core", "export", "--help"]
    return timed(lambda: subprocess.run(words, stdout=subprocess.DEVNULL, check=True))


def importing(scene: Path) -> float:
    words = [sys.executable, "-c", "import langflash_core as lf; lf.reconstruct, lf.query, lf.load"]
    return timed(lambda: subprocess.run(words, check=True))


def loading(scene: Path) -> float:
    lf = importlib.import_module("langflash_core")
    lf.load(scene)  # what is imported for it has been
    return timed(lambda: lf.load(scene), 10)


def saving(scene: Path) -> float:
    lf = importlib.import_module("langflash_core")
    loaded = lf.load(scene)
    with tempfile.TemporaryDirectory() as place:
        return timed(lambda: lf.save(loaded, Path(place) / "a.langflash"), 10)


def asking(scene: Path) -> float:
    """Four phrases of a view that the reference draws."""
    lf = importlib.import_module("langflash_core")
    loaded = lf.load(scene)
    lf.query(loaded, PHRASES)
    return timed(lambda: lf.query(loaded, PHRASES), 3)


@contextmanager
def _renderer():
    """The package and OpenGL."""
    renderers = importlib.import_module("app.cli.renderers")
    with renderers.open_renderer("gl") as renderer:
        yield importlib.import_module("langflash_core"), renderer


def drawing(scene: Path) -> float:
    """Colours, depth and weight maps of one view, by OpenGL."""
    with _renderer() as (lf, renderer):
        loaded = lf.load(scene)
        camera = importlib.import_module("langflash_core.types").Camera
        shot = camera(loaded.viewmats[0], loaded.Ks[0], *loaded.view_size)
        renderer(loaded, shot)
        return timed(lambda: renderer(loaded, shot), 10)


def answering(scene: Path) -> float:
    """Four phrases of a view that OpenGL draws."""
    with _renderer() as (lf, renderer):
        loaded = lf.load(scene)
        lf.query(loaded, PHRASES, render=renderer)
        return timed(lambda: lf.query(loaded, PHRASES, render=renderer), 5)


@contextmanager
def _window():
    tour = importlib.import_module("tests.tools.tour")
    with tempfile.TemporaryDirectory() as place, tour.x_server(*tour.SIZE) as display:
        os.environ.update(DISPLAY=display, LANGFLASH_CONFIG=place, LANGFLASH_STATE=place, HOME=place)
        guide = tour.Guide(display)
        try:
            yield guide
        finally:
            guide.close()


def _open(guide, scene: Path) -> None:
    show = importlib.import_module("app.window.scene.commands")
    guide.tell(show.OpenPaths((str(scene),)))
    guide.until(lambda: _shown(guide.session.state.scene), "the scene")


def _shown(scene) -> bool:
    return scene.info is not None and scene.job is None


def _until_shown(scene: Path, then: Callable[..., object] = lambda guide: None) -> float:
    def act() -> None:
        with _window() as guide:
            _open(guide, scene)
            then(guide)

    return timed(act)


def starting(scene: Path) -> float:
    """The window from its first step until a scene is there."""
    return _until_shown(scene)


def opening(scene: Path) -> float:
    """The window from its first step until a scene that was asked four phrases rests in it."""

    def asked(guide) -> None:
        guide.ask(*PHRASES)
        guide.rest()

    return _until_shown(scene, asked)


def turning(scene: Path) -> float:
    """A step of the window's loop while a scene with a heat-map is turned; pictures are as fine as the window
    makes them then."""
    camera = importlib.import_module("app.window.scene.camera")
    with _window() as guide:
        _open(guide, scene)
        guide.ask(*PHRASES[:1])
        guide.rest()

        def turn() -> None:
            guide.session.dispatch(camera.Orbit(0.01, 0.0))
            guide.session.step(0.05)

        return timed(turn, TURNS)


CASES: dict[str, Callable[[Path], float]] = {
    "help": help_of_the_command, "import": importing, "load": loading, "save": saving,
    "query": asking, "draw": drawing, "query-gl": answering, "start": starting,
    "window": opening, "turn": turning,
}  # fmt: skip


def measured(checkout: Path, case: str, scene: Path) -> float:
    """Seconds of one case in a fresh process of a version."""
    env = dict(os.environ, PYTHONPATH=str(checkout), OMP_NUM_THREADS="1", LP_NUM_THREADS="1")
    words = [sys.executable, str(Path(__file__)), "--case", case, str(scene)]
    done = subprocess.run(words, env=env, cwd=checkout, check=True, capture_output=True, text=True)
    return float(json.loads(done.stdout.strip().splitlines()[-1]))


def ratio_interval(old: list[float], new: list[float], draws: int = 2000) -> tuple[float, float, float]:
    """Median of the rounds' ratios, and the 5th and 95th percentile of its bootstrap."""
    ratios = np.array(new) / np.array(old)
    again = np.random.default_rng(0).choice(ratios, (draws, len(ratios)))
    low, high = np.percentile(np.median(again, axis=1), [5, 95])
    return float(np.median(ratios)), float(low), float(high)


def _made(checkout: Path, place: Path) -> Path:
    scene = place / "scene.langflash"
    photos = [str(checkout / "assets" / "photos" / name) for name in PHOTOS]
    env = dict(os.environ, PYTHONPATH=str(checkout))
    words = [sys.executable, "-m", "langflash_core", "reconstruct", *photos, "-o", str(scene)]
    subprocess.run(words, env=env, cwd=checkout, check=True, stdout=subprocess.DEVNULL)
    return scene


def _compare(old: Path, new: Path, scene: Path | None, cases: list[str], rounds: int) -> None:
    sys.stdout.write("| case | old, ms | new, ms | new : old |\n|---|---|---|---|\n")
    with tempfile.TemporaryDirectory() as place:
        scene = scene or _made(old, Path(place))
        for case in cases:
            seconds: dict[Path, list[float]] = {old: [], new: []}
            for number in range(rounds):
                for checkout in (old, new) if number % 2 == 0 else (new, old):
                    seconds[checkout].append(measured(checkout, case, scene))
            first, second = (1000 * float(np.median(seconds[each])) for each in (old, new))
            ratio, low, high = ratio_interval(seconds[old], seconds[new])
            shown = f"{first:.1f} | {second:.1f} | {ratio:.2f} ({low:.2f} to {high:.2f})"
            sys.stdout.write(f"| {case} | {shown} |\n")
            sys.stdout.flush()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("paths", nargs="+", type=Path, metavar="OLD NEW")
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--scene", type=Path)
    given = parser.parse_args()
    if given.case:
        sys.stdout.write(f"\n{json.dumps(CASES[given.case](given.paths[0]))}\n")
        return 0
    old, new = (path.resolve() for path in given.paths)
    _compare(old, new, given.scene and given.scene.resolve(), given.only, given.rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
