"""Much at once, and often: large scenes (`large.py`), many atoms and phrases, thousands of questions.

    python -m tests.torture load [--questions 10000] [--only atoms questions large]

Memory is that of the process (resident), after a tenth of the questions and after the last; handles, threads
and the names that OpenGL gives to new objects are counted then as well.
"""

import gc
import os
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import torch

from app.cli.renderers import GlRenderer
from langflash_core.base.memory import give_back
from langflash_core.geometry.poses import from_view, to_camera
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.types import Camera, Scene, Semantics
from langflash_core.writing.renderers import TorchRenderer
from tests.app.cli.conftest import WORDS, stripes
from tests.torture.large import LARGE, large_scene, large_window, write_splat
from tests.torture.rows import Row

ATOMS, PHRASES = 256, 64
MOST_GROWTH = 0.01
CLOSE = 5e-3  # relevance of float16 maps beside the reference; means are within 1e-4 (app/gl/renderer.py)


def everything(folder: Path, count: int, only: Sequence[str] | None = None) -> Iterator[Row]:
    """All rows, or those whose names begin so; count: of questions in a row."""

    def wanted(name: str) -> bool:
        return any(name.startswith(word) for word in only or [""])

    if wanted("atoms"):
        yield many_atoms(ATOMS, PHRASES)
    if wanted("questions"):
        yield many_questions(count)
    if wanted("large"):
        path = folder / "large.splat"
        write_splat(path, LARGE)
        yield large_scene(path, LARGE)
        yield large_window(path, LARGE, folder / "large.png")


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
