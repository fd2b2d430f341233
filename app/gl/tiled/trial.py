"""Quads or tiles: whichever a graphics card draws sooner. A few frames of a made-up scene say, once per
driver, and what they said is kept beside the preferences."""

import json
import math
import statistics
import time
from collections.abc import Callable, Generator
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import moderngl
import torch
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.graphics import COMPUTE, draws_in_software
from langflash_core.errors import GraphicsError, OutputError
from langflash_core.types import Camera, Gaussians, Scene, Semantics

from ...places import config_folder
from ..processor.moving import REACH
from ..renderer import SplatRenderer
from ..splats import MakeSplats, SplatBuffers
from ..warming import warm_up
from .splats import TiledSplats

Way = Literal["quads", "tiles"]
WAYS: dict[Way, type[SplatBuffers]] = {"quads": SplatBuffers, "tiles": TiledSplats}
CLEARLY = 0.9
"""Share of the quads' time that tiles may take to be chosen: within a tenth, another trial might say
otherwise."""
SAME = 0.01
"""Of full brightness, on average, that both pictures may differ by: float16 quads lose up to a third of that
under forty layers, what is wrong shows more."""
_GAUSSIANS, _ATOMS, _SIZE, _FRAMES = 150_000, 24, (1280, 720), 3

Steps = Generator[None, None, "Way"]
"""A trial, to be gone on with between frames; each step takes about as long as one."""


@dataclass(frozen=True)
class Trial:
    """Milliseconds of a moving picture and a resting one with its weight maps together; infinite where the
    driver refused, and of tiles where they showed something else."""

    quads_ms: float
    tiles_ms: float

    @property
    def sooner(self) -> Way:
        return "tiles" if self.tiles_ms < CLEARLY * self.quads_ms else "quads"


FATAL = Trial(0.0, math.inf)
"""Kept while a trial is under way: of a driver that takes the process along the next start tries nothing."""


def chosen(ctx: moderngl.Context, wanted: str) -> Way | None:
    """How to draw on a context; None: a trial must say it. wanted: "quads", "tiles", or "measured". Where
    OpenGL runs on the processor, which draws tiles several times as slowly, nothing is tried."""
    if wanted == "quads" or ctx.version_code < COMPUTE:
        return "quads"
    if wanted == "tiles":
        return "tiles"
    if draws_in_software(ctx):
        return "quads"
    found = kept(ctx)
    return None if found is None else found.sooner


def maker(ctx: moderngl.Context, way: Way) -> MakeSplats:
    """Of a window's splats on a context; on a processor quads end as `moving_renderer` has them."""
    sooner = way == "quads" and draws_in_software(ctx)
    return partial(SplatBuffers, reach=REACH) if sooner else WAYS[way]


def file() -> Path:
    """Where trials are kept."""
    return config_folder() / "drawing.json"


def kept(ctx: moderngl.Context) -> Trial | None:
    """The trial of this card and driver, if there was one."""
    with suppress(KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return Trial(**{name: float(ms) for name, ms in _all_kept()[_driver(ctx)].items()})
    return None


def trying(ctx: moderngl.Context) -> Steps:
    """Make the trial of this card and driver, and keep what it says; one that is ended early never was."""
    found = None
    _keep(ctx, FATAL)
    try:
        found = yield from measuring(ctx)
        return found.sooner
    finally:
        _keep(ctx, found)


def _driver(ctx: moderngl.Context) -> str:
    return f"{ctx.info['GL_RENDERER']}, {ctx.info['GL_VERSION']}"


def _keep(ctx: moderngl.Context, trial: Trial | None) -> None:
    others = {driver: told for driver, told in _all_kept().items() if driver != _driver(ctx)}
    own = {} if trial is None else {_driver(ctx): asdict(trial)}
    with suppress(OutputError):  # the next start tries again
        make_folder(file().parent)
        write_atomically(file(), json.dumps({**others, **own}, indent=2).encode())


def _all_kept() -> dict:
    with suppress(OSError, ValueError, RecursionError):
        content = json.loads(file().read_bytes())
        if isinstance(content, dict):
            return content
    return {}


def measuring(ctx: moderngl.Context) -> Generator[None, None, Trial]:
    """Draw some frames in both ways."""
    scene, cameras = _cloud(), [_camera(0.02 * frame) for frame in range(_FRAMES + 1)]
    yield
    quads_ms, expected = yield from _timed(ctx, SplatBuffers, scene, cameras)
    yield
    _ = ctx.error  # of the quads, or of the window before
    tiles_ms, picture = yield from _timed(ctx, TiledSplats, scene, cameras)
    same = (picture - expected).abs().mean() <= SAME and ctx.error == "GL_NO_ERROR"
    return Trial(quads_ms, tiles_ms if same else math.inf)


def _timed(
    ctx: moderngl.Context, make: MakeSplats, scene: Scene, cameras: list[Camera]
) -> Generator[None, None, tuple[float, Tensor]]:
    """Milliseconds, and the last picture (H, W, 3); infinite, and nothing to see, where the driver refuses.
    The first frame compiles what `warm_up` did not."""
    renderer = SplatRenderer(ctx, splats=make)
    try:
        yield from warm_up(renderer.canvas, make)
        renderer.set_scene(scene)
        yield
        taken = []
        for camera in cameras:
            moving = partial(renderer.draw, camera, weight_maps=False, moving=True, late=True)
            taken.append(_milliseconds(renderer, moving))
            yield
            taken[-1] += _milliseconds(renderer, partial(renderer.draw, camera))
            yield
        return statistics.median(taken[1:]), renderer.frame().rgb
    except (GraphicsError, moderngl.Error):
        return math.inf, torch.zeros(())
    finally:
        renderer.release()


def _milliseconds(renderer: SplatRenderer, draw: Callable[[], None]) -> float:
    renderer.finish()
    start = time.perf_counter()
    draw()
    renderer.finish()
    return 1e3 * (time.perf_counter() - start)


def _camera(yaw: float) -> Camera:
    width, height = _SIZE
    pose = torch.eye(4, dtype=torch.float64)
    pose[0, 0] = pose[2, 2] = math.cos(yaw)
    pose[0, 2], pose[2, 0] = math.sin(yaw), -math.sin(yaw)
    lens = torch.tensor([[0.8 * width, 0, width / 2], [0, 0.8 * width, height / 2], [0, 0, 1]])
    return Camera(pose, lens, width, height)


def _cloud() -> Scene:
    """Gaussians of a few pixels, as scenes of photos have them, in a few layers over the whole view."""
    g = torch.Generator().manual_seed(0)
    depth = 1 + 3 * torch.rand(_GAUSSIANS, 1, generator=g)
    aside = 1.6 * (torch.rand(_GAUSSIANS, 2, generator=g) - 0.5)
    gaussians = Gaussians(
        torch.cat((aside * depth, depth), 1),
        torch.randn(_GAUSSIANS, 4, generator=g),
        0.004 * depth * torch.exp(0.5 * torch.randn(_GAUSSIANS, 3, generator=g)),
        0.2 + 0.8 * torch.rand(_GAUSSIANS, generator=g),
        0.4 * torch.randn(_GAUSSIANS, 1, 3, generator=g),
    )
    ids = torch.randint(_ATOMS, (_GAUSSIANS, 2), generator=g)
    semantics = Semantics(ids, torch.full((_GAUSSIANS, 2), 0.5), torch.eye(_ATOMS), "none")
    seen = _camera(0.0)
    return Scene(gaussians, semantics, seen.viewmat[None].float(), seen.K[None], _SIZE)
