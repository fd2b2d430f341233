"""Times and errors of all modes of one case.

The modes take turns frame by frame, so that whatever slows the machine for a moment slows them
alike; the order rotates. A frame goes from a new camera to the first phrase's heat-map: sort,
projection, colours, weight maps, relevance of all phrases. `ctx.finish()` stands before and
after. Encoding text and reading pixels back are not part of it.
"""

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import moderngl
import numpy as np

from langflash_core.base.running import Progress
from langflash_core.types import Camera, Scene

from ..gl import SplatRenderer
from ..gl.canvas import Canvas
from ..gl.processor.still import draw_still
from ..gl.tiled.splats import TiledSplats
from .cases import Case
from .errors import Errors, View, errors_of, true_view
from .modes import DEFAULT, Mode

ERROR_FRAMES = 2  # the reference takes seconds to minutes a view
_TIMER_END = 2**32 - 1  # nanoseconds: moderngl reads 32 bits


@dataclass
class Times:
    """Milliseconds, one entry a frame.

    frames: a moving camera, wall clock. cpu: the same in processor time of all threads, which other
    programs do not lengthen. gpu: the same by a GL timer query, empty where it does not work. answers:
    every query pass of a view whose maps are drawn, empty in the fast mode, which has none. phrases: a
    new phrase, nothing else.
    """

    frames: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    gpu: list[float] = field(default_factory=list)
    answers: list[float] = field(default_factory=list)
    phrases: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Stages:
    """The default mode with a finish after each stage, the shortest of a few frames: milliseconds of sort,
    projection and colours, of all weight maps, and how many passes these are; splats blended per pixel."""

    colour_ms: float
    maps_ms: float
    map_passes: int
    layers_a_pixel: float


@dataclass(frozen=True)
class Result:
    """One case measured. rows: modes in order, the default first. error_frames: indices on the path."""

    case: Case
    rows: tuple[tuple[Mode, Times, Errors], ...]
    stages: Stages
    error_frames: tuple[int, ...]


def measure(ctx: moderngl.Context, case: Case, modes: Sequence[Mode], progress: Progress) -> Result:
    """Draw every frame of the case's path in every mode.

    Args:
        modes: the default first. progress: told a stage's name and the share that is done.

    Raises:
        GraphicsError: the picture is larger than the driver's textures.
        ValueError: the default mode is not the first.
    """
    if not modes or modes[0] != DEFAULT:
        raise ValueError("modes: expected the default first")
    bench = _Bench(ctx, case, modes)
    try:
        frames = _error_frames(case.path.num_frames)
        errors = _errors(bench, frames, progress)
        times = _times(bench, progress)
        stages = _stages(bench, progress)
    finally:
        bench.release()
    rows = tuple((mode, times[mode], errors[mode]) for mode in modes)
    return Result(case, rows, stages, frames)


class _Bench:
    """The renderers of one case: one for each way to upload a scene. Those of a precision and a size share a
    canvas, so that many fit in memory."""

    def __init__(self, ctx: moderngl.Context, case: Case, modes: Sequence[Mode]):
        self.ctx, self.case, self.modes = ctx, case, modes
        # moderngl has no way to give a query back: these two live as long as the context.
        self.timer = ctx.query(time=True)
        self.counter = ctx.query(samples=True)
        self._canvases: dict[tuple, Canvas] = {}
        self._renderers: dict[tuple, SplatRenderer] = {}
        self._scenes: dict[tuple, Scene] = {_scene_key(mode): mode.scene(case.scene) for mode in modes}

    def camera(self, mode: Mode, frame: int) -> Camera:
        """Frame -1 is where frame 0 comes from."""
        camera = self.case.path.cameras[frame + 1]
        if mode.shrink == 1:
            return camera
        return camera.with_size(max(1, camera.width // mode.shrink), max(1, camera.height // mode.shrink))

    def prepared(self, mode: Mode) -> SplatRenderer:
        """The mode's renderer as it stands before it sees a frame's camera: nothing counts as drawn."""
        key = _renderer_key(mode)
        if key not in self._renderers:
            self._renderers[key] = self._made(mode)
        renderer = self._renderers[key]
        renderer.forget()
        self.ask(renderer)
        if mode.fast:
            renderer.carry()
        self.ctx.finish()
        return renderer

    def draw(self, renderer: SplatRenderer, mode: Mode, camera: Camera) -> None:
        """One picture, its weight maps too unless the mode has none."""
        if mode.still:
            scene = self._scenes[_scene_key(mode)]
            renderer.bring(draw_still(scene, camera, threads=os.cpu_count() or 1))
        else:
            renderer.draw(camera, fast=mode.fast)

    def ask(self, renderer: SplatRenderer, other: bool = False) -> None:
        """The case's phrases; `other`: other numbers of equal work."""
        question = self.case.compiled
        renderer.ask(replace(question, prompts=-question.prompts) if other else question)

    def _made(self, mode: Mode) -> SplatRenderer:
        shared = (mode.precision, mode.shrink)
        if shared not in self._canvases:
            self._canvases[shared] = Canvas(self.ctx, mode.precision)
        splats = TiledSplats if mode.tiled else None
        renderer = SplatRenderer(self.ctx, mode.precision, splats, canvas=self._canvases[shared])
        renderer.set_scene(self._scenes[_scene_key(mode)])
        return renderer

    def release(self) -> None:
        for owned in (*self._renderers.values(), *self._canvases.values()):
            owned.release()
        self._renderers.clear()
        self._canvases.clear()


def _renderer_key(mode: Mode) -> tuple:
    return mode.precision, mode.shrink, mode.tiled, *_scene_key(mode)


def _scene_key(mode: Mode) -> tuple:
    return mode.kept, mode.share


def _error_frames(num_frames: int) -> tuple[int, ...]:
    """At even places on the path, not at its ends where a scene's own views are."""
    count = min(ERROR_FRAMES, num_frames)
    return tuple(int((2 * i + 1) * num_frames / (2 * count)) for i in range(count))


def _errors(bench: _Bench, frames: tuple[int, ...], progress: Progress) -> dict[Mode, Errors]:
    """Also draws every mode for the first time: programs are compiled and memory is taken."""
    truth: list[View] = []
    for done, frame in enumerate(frames):
        progress("float64 reference", 0.3 * done / len(frames))
        truth.append(true_view(bench.case, bench.camera(DEFAULT, frame)))
    errors = {}
    for done, mode in enumerate(bench.modes):
        progress(f"errors of {mode.name}", 0.3 + 0.1 * done / len(bench.modes))
        drawn = []
        for frame, true in zip(frames, truth, strict=True):
            renderer = bench.prepared(mode)
            bench.draw(renderer, mode, bench.camera(mode, frame))
            drawn.append(View(renderer.frame().rgb, renderer.relevance(), true.covered))
        errors[mode] = errors_of(drawn, truth, bench.case.compiled.threshold)
    return errors


def _times(bench: _Bench, progress: Progress) -> dict[Mode, Times]:
    times = {mode: Times() for mode in bench.modes}
    num_frames = bench.case.path.num_frames
    for frame in range(num_frames):
        progress(f"frame {frame + 1} of {num_frames}", 0.4 + 0.5 * frame / num_frames)
        for place in range(len(bench.modes)):
            mode = bench.modes[(place + frame) % len(bench.modes)]
            _time_frame(bench, mode, frame, times[mode])
    return times


def _time_frame(bench: _Bench, mode: Mode, frame: int, into: Times) -> None:
    renderer, camera = bench.prepared(mode), bench.camera(mode, frame)

    def moving() -> None:
        with bench.timer:
            bench.draw(renderer, mode, camera)
            renderer.heat_texture(0)

    def another() -> None:
        bench.ask(renderer, other=True)
        renderer.heat_texture(0)

    before = time.process_time()
    into.frames.append(_milliseconds(bench.ctx, moving))
    into.cpu.append(1e3 * (time.process_time() - before))
    elapsed = bench.timer.elapsed
    if 0 < elapsed < _TIMER_END:
        into.gpu.append(elapsed / 1e6)
    if not mode.fast:
        renderer.forget(answers_only=True)
        bench.ask(renderer)
        into.answers.append(_milliseconds(bench.ctx, lambda: renderer.heat_texture(0)))
    into.phrases.append(_milliseconds(bench.ctx, another))


def _stages(bench: _Bench, progress: Progress) -> Stages:
    colour, maps, layers = [], [], []
    passes = 0
    width, height = bench.case.size
    for frame in _error_frames(bench.case.path.num_frames):
        progress("stages", 0.9)
        renderer, camera = bench.prepared(DEFAULT), bench.camera(DEFAULT, frame)
        colour.append(_milliseconds(bench.ctx, lambda: renderer.draw(camera, weight_maps=False)))  # noqa: B023
        before = renderer.passes["weights"]
        maps.append(_milliseconds(bench.ctx, lambda: renderer.draw(camera)))  # noqa: B023
        passes = renderer.passes["weights"] - before
        renderer = bench.prepared(DEFAULT)
        with bench.counter:
            renderer.draw(camera, weight_maps=False)
        layers.append(bench.counter.samples / (width * height))
    return Stages(min(colour), min(maps), passes, float(np.mean(layers)))


def _milliseconds(ctx: moderngl.Context, work: Callable[[], object]) -> float:
    ctx.finish()
    start = time.perf_counter()
    work()
    ctx.finish()
    return 1e3 * (time.perf_counter() - start)
