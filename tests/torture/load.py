"""Much at once, and often: large scenes, many atoms and phrases, thousands of questions in a row.

    python -m tests.torture load [--count 10000]

Memory is that of the process (resident), after a tenth of the questions and after the last; handles, threads
and the names that OpenGL gives to new objects are counted then as well.
"""

import gc
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import torch

from app.cli.renderers import GlRenderer
from langflash_core.geometry.poses import from_view, to_camera
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.memory import give_back
from langflash_core.types import Camera, Scene, Semantics
from langflash_core.writing.renderers import TorchRenderer
from tests.app.cli.conftest import WORDS, stripes

LARGE = 10_000_000
ATOMS, PHRASES = 256, 64
MOST_GROWTH = 0.01
MEMORY = 6 << 30  # bytes that opening the large scene may take
CLOSE = 5e-3  # relevance of float16 maps beside the reference; means are within 1e-4 (app/gl/renderer.py)


@dataclass
class Row:
    name: str
    told: str = ""
    finds: list[str] = field(default_factory=list)


def everything(folder: Path, count: int) -> Iterator[Row]:
    """All rows; count: of questions in a row."""
    yield many_atoms(ATOMS, PHRASES)
    yield many_questions(count)
    yield large_scene(folder, LARGE)


def camera_of(scene: Scene) -> Camera:
    """The first photo's."""
    pose = from_view(scene.viewmats[0].double().numpy(), scene.Ks[0].double().numpy(), scene.view_size, 1.0)
    return to_camera(pose, *scene.view_size)


def many_atoms(atoms: int, phrases: int) -> Row:
    """A scene of so many atoms answers so many phrases at once as the reference does."""
    row = Row(f"{atoms} atoms, {phrases} phrases")
    scene, generator = stripes(), torch.Generator().manual_seed(0)
    count = len(scene.gaussians)
    dictionary = torch.nn.functional.normalize(torch.randn(atoms, 384, generator=generator), dim=-1)
    ids = torch.randint(0, atoms, (count, 1), generator=generator)
    scene = replace(scene, semantics=Semantics(ids, torch.ones(count, 1), dictionary, "minilm"))
    space, camera = language_space("minilm"), camera_of(scene)
    compiled = compile_query(scene, space, [f"{WORDS[n % 3]} number {n}" for n in range(phrases)])
    truth = TorchRenderer()(scene, camera)
    renderer = GlRenderer()
    try:
        drawn = renderer(scene, camera)
    finally:
        renderer.release()
    assert truth.weight_maps is not None and drawn.weight_maps is not None
    maps = [relevance_maps(weights, compiled) for weights in (truth.weight_maps, drawn.weight_maps)]
    off = float((maps[0] - maps[1]).abs().max())
    row.told = f"{tuple(maps[1].shape)} relevance, at most {off:.1e} from the reference"
    if not (maps[1].isfinite().all() and off < CLOSE):
        row.finds.append(f"{off} from the reference")
    return row


def many_questions(count: int) -> Row:
    """A new question each time, answered from the picture that is drawn."""
    row, scene, space = Row(f"{count:,} questions in a row"), stripes(), language_space("minilm")
    camera, renderer = camera_of(scene), GlRenderer()
    splats, ctx = renderer._splats, renderer._context
    first: tuple = ()
    try:
        with ctx:
            splats.set_scene(scene)
            splats.draw(camera)
            for number in range(count):
                splats.ask(compile_query(scene, space, [f"{WORDS[number % 3]} {number % 97}"]))
                _ = splats.relevance()
                if number == count // 10:
                    first = _held(ctx)
            last = _held(ctx)
            if ctx.error != "GL_NO_ERROR":
                row.finds.append("OpenGL complains")
    finally:
        renderer.release()
    growth = last[0] / first[0] - 1
    row.told = f"memory {first[0] / 2**20:.0f} to {last[0] / 2**20:.0f} MB ({growth:+.2%})"
    row.told += f"; handles, threads, OpenGL names {first[1:]} to {last[1:]}"
    if growth > MOST_GROWTH:
        row.finds.append(f"memory grew by {growth:.1%}")
    # Mesa gives every name once: looking at them took one of each kind.
    if last[1:3] != first[1:3] or any(b - a != 1 for a, b in zip(first[3], last[3], strict=True)):
        row.finds.append(f"left behind: {first[1:]} to {last[1:]}")
    return row


def _held(ctx) -> tuple[int, int, int, tuple[int, ...]]:
    """Bytes resident, open handles, threads, and the next free names of OpenGL."""
    gc.collect()
    give_back()
    made = [ctx.texture((1, 1), 4), ctx.buffer(reserve=4)]
    names = tuple(each.glo for each in made)
    for each in made:
        each.release()
    resident = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return resident, len(os.listdir("/proc/self/fd")), threading.active_count(), names


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


def large_scene(folder: Path, count: int) -> Row:
    """A .splat of so many opens within `MEMORY`, or is refused in one sentence, before the work."""
    row, path = Row(f"{count:,} Gaussians"), folder / "large.splat"
    rng = np.random.default_rng(0)
    kind = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quat", "u1", 4)])
    with path.open("wb") as stream:
        for start in range(0, count, 1_000_000):
            some = np.zeros(min(1_000_000, count - start), kind)
            some["mean"] = rng.normal(0, 1, some["mean"].shape)
            some["scale"], some["rgba"], some["quat"] = 0.01, 200, (255, 128, 128, 128)
            stream.write(some.tobytes())
    words = [sys.executable, "-c", _OPEN, str(path), str(MEMORY)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=600)
    row.told = done.stdout.strip()
    opened = row.told.startswith(f"{count:,} Gaussians")
    if (
        done.returncode
        or "\n" in row.told
        or not (opened or "GB to open" in row.told or "more than" in row.told)
    ):
        row.finds.append(f"exit code {done.returncode}: {done.stderr[-200:]}")
    path.unlink()
    return row


def report(rows: Iterator[Row], say: Callable[[str], object]) -> int:
    """The table; how many finds."""
    finds, began = 0, time.process_time()
    for row in rows:
        say(f"{row.name:32}{row.told}\n")
        for words in row.finds:
            say(f"    {words}\n")
        finds += len(row.finds)
    say(f"{time.process_time() - began:.0f} s of the processor\n")
    return finds
