"""What one version of the program makes of two pairs of demo photos; `same` starts this in each checkout.

    PYTHONPATH=CHECKOUT python tests/tools/made.py WAY FOLDER

WAY is `command`, `api`, `batch` or `window`. Only what all versions have is called: words of the command
line, the five functions of the package, commands of the window by their names.
"""

import contextlib
import importlib
import io
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

PAIRS = {
    "living_room": ("living_room_left.png", "living_room_right.png"),
    "books": ("books_left.jpg", "books_right.jpg"),
}
PHRASES = ("plant", "window", "floor", "book")
ONE = PHRASES[:1]
GAUSSIANS = (
    "a.ply", "a.compressed.ply", "a.spz", "a.sog", "a.splat", "a.glb", "a.usda", "a.usdz", "a.langflash",
)  # fmt: skip
EXPORTS: tuple[tuple[str, ...], ...] = (
    *((name,) for name in GAUSSIANS),
    *((f"part_{name}", "--prompt", *ONE) for name in ("a.ply", "a.spz", "a.langflash")),
    ("low.ply", "--detail", "low"),
    ("page.html",),
    ("asked.html", "--prompt", *PHRASES),
    ("posed/transforms.json",),
    ("colmap/cameras.txt",),
    ("rgb.png",),
    ("large.png", "--size", "640x480", "--view", "1", "--fade", "--fill"),
    ("flat.png", "--ortho"),
    ("heat.png", "--what", "heat", "--prompt", *ONE, "--colormap", "viridis"),
    *((f"{what}.png", "--what", what, "--prompt", *PHRASES) for what in (
        "mask", "soft", "cutout", "labels", "instances",
    )),
    ("depth.png", "--what", "depth"),
    ("depth.exr",),
    ("numbers.npz",),
    ("asked.npz", "--prompt", *PHRASES),
    ("masks/coco.json", "--prompt", *PHRASES),
    ("boxes.json", "--what", "boxes", "--prompt", *PHRASES),
    ("boxes.csv", "--prompt", *PHRASES),
    ("boxes.glb", "--what", "boxes", "--prompt", *PHRASES),
    ("surface.glb", "--what", "surface", "--prompt", *ONE),
    ("all/rgb.png", "--all-views"),
    ("segmented", "--segmented", "--prompt", *PHRASES),
    ("film.webp", "--seconds", "1", "--size", "160x120"),
    ("film.mp4", "--seconds", "1", "--size", "160x120"),
)  # fmt: skip
PICTURES = ("rgb", "depth", "relevance", "labels", "atoms", "weights:3")
BATCHED = (".ply", ".spz", ".png", ".json", ".csv", ".html", "transforms.json")
MOVED = (0.3, -0.1)  # radians right and up


def photos_of(name: str) -> list[Path]:
    folder = Path(importlib.import_module("langflash_core").__file__ or "").parents[1] / "assets" / "photos"
    return [folder / photo for photo in PAIRS[name]]


def langflash(*words: str | Path) -> None:
    """A command in this process. What it said with `--json` becomes a file, and so does why it failed."""
    run = importlib.import_module("langflash_core.__main__").main
    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["langflash", *map(str, words)]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run()
    if code:
        with Path("failed.txt").open("a") as log:
            log.write(f"{' '.join(Path(str(word)).name for word in words)}: {code}\n{err.getvalue()}\n")
    elif words[-1] == "--json":
        Path(f"{words[0]}.json").write_text(out.getvalue())


def by_command() -> None:
    for name in PAIRS:
        with _inside(name):
            langflash("reconstruct", *photos_of(name), "-o", "scene.langflash", "--json")
            langflash("info", "scene.langflash", "--json")
            langflash("query", "scene.langflash", *PHRASES, "-o", "answers", "--npz", "--json")
            for what in PICTURES:
                asked = {"relevance": ONE, "labels": PHRASES}.get(what, ())
                prompted = ("--prompt", *asked) if asked else ()
                langflash(
                    "render", "scene.langflash", "--what", what, *prompted,
                    "-o", f"render_{what.replace(':', '_')}.png",
                )  # fmt: skip
            for path, *words in EXPORTS:
                Path(path).parent.mkdir(exist_ok=True)
                langflash("export", "scene.langflash", "-o", path, *words)


def by_api() -> None:
    import langflash_core as lf

    for name in PAIRS:
        with _inside(name):
            scene = lf.reconstruct(photos_of(name))
            lf.save(scene, Path("scene.langflash"))
            for path in GAUSSIANS:
                with contextlib.suppress(Exception) if path.startswith("a.usd") else contextlib.nullcontext():
                    lf.save(scene, Path(path))
            for mode in ("relevancy", "cosine"):
                found = lf.query(scene, list(PHRASES), view=1, mode=mode)
                np.savez(
                    f"{mode}.npz",
                    relevance=found.relevance.numpy(),
                    masks=found.masks.numpy(),
                    rgb=found.frame.rgb.numpy(),
                    depths=found.frame.depths.numpy(),
                    scores=np.array([answer.score for answer in found.answers]),
                )


def by_batch() -> None:
    sets = Path("sets")
    for name in PAIRS:
        (sets / name).mkdir(parents=True)
        for photo in photos_of(name):
            (sets / name / photo.name).write_bytes(photo.read_bytes())
    langflash(
        "batch", sets, "-o", "out", "--workers", "1", "--prompt", *PHRASES, "--export", *BATCHED, "--json"
    )


def by_window() -> None:
    for name in PAIRS:
        with _inside(name), _window() as (tour, guide):
            camera = importlib.import_module("app.window.scene.camera")
            show = importlib.import_module("app.window.scene.commands")
            guide.tell(show.OpenPaths(tuple(map(str, photos_of(name)))))
            guide.until(lambda guide=guide: _shown(guide.session.state.scene), "the scene")
            guide.ask(*PHRASES)
            for mode, _ in tour.MODES:
                guide.tell(camera.SetMode(mode))
                guide.rest()
                np.save(f"canvas_{mode.name.lower()}.npy", guide.canvas())
            guide.tell(camera.SetMode(tour.MODES[0][0]), camera.Orbit(*MOVED))
            guide.rest()
            np.save("canvas_moved.npy", guide.canvas())
            guide.tell(camera.JumpTo(0), show.SaveScene(Path("scene.langflash").resolve()))
            guide.until(Path("scene.langflash").exists, "the file")
            _exported(guide)


def _shown(scene) -> bool:
    return scene.info is not None and scene.job is None


def _exported(guide) -> None:
    """What the window's dialog writes."""
    outputs = importlib.import_module("langflash_core.base.outputs")
    export = importlib.import_module("app.window.exporting.commands")
    Path("exported").mkdir()
    for what, path in (
        (outputs.RGB, "rgb.png"), (outputs.CUTOUT, "cutout.png"), (outputs.PLY, "a.ply"),
        (outputs.PAGE, "page.html"), (outputs.COCO, "coco.json"),
    ):  # fmt: skip
        target = Path("exported", path).resolve()
        guide.tell(export.ShowExport())
        form = replace(guide.session.state.exporting.form, what=what, path=str(target))
        guide.tell(export.EditForm(form))
        guide.steps(0.5)
        guide.tell(export.Export(sure=True))
        guide.until(target.exists, path)
        guide.until(lambda: guide.session.state.exporting.running is None, "the end of the export")


@contextlib.contextmanager
def _window() -> Iterator[tuple]:
    tour = importlib.import_module("tests.tools.tour")
    with tempfile.TemporaryDirectory() as place, tour.x_server(*tour.SIZE) as display:
        os.environ.update(DISPLAY=display, LANGFLASH_CONFIG=place, LANGFLASH_STATE=place, HOME=place)
        guide = tour.Guide(display)
        try:
            yield tour, guide
        finally:
            guide.close()


@contextlib.contextmanager
def _inside(name: str) -> Iterator[None]:
    folder = Path(name)
    folder.mkdir()
    with contextlib.chdir(folder):
        yield


WAYS: dict[str, Callable[[], None]] = {
    "command": by_command, "api": by_api, "batch": by_batch, "window": by_window,
}  # fmt: skip


def main() -> int:
    way, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True)
    os.chdir(folder)
    start = time.process_time()
    WAYS[way]()
    sys.stderr.write(f"{way}: {time.process_time() - start:.0f} s of the processor\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
