"""Quads or tiles: whichever a graphics card draws sooner. A few frames of a made-up scene say, once per
driver, and what they said is kept beside the preferences."""

import json
import math
import statistics
import time
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


@dataclass(frozen=True)
class Trial:
    """Milliseconds of a moving picture and a resting one with its weight maps together; infinite where the
    driver refused, and of tiles where they showed something else."""

    quads_ms: float
    tiles_ms: float

    @property
    def sooner(self) -> Way:
        return "tiles" if self.tiles_ms < CLEARLY * self.quads_ms else "quads"


def chosen(ctx: moderngl.Context, wanted: str) -> Way:
    """How to draw on a context. wanted: "quads", "tiles", or "measured". Where OpenGL runs on the processor,
    which draws tiles several times as slowly (MEASURED.md), nothing is tried."""
    if wanted == "quads" or ctx.version_code < COMPUTE:
        return "quads"
    if wanted == "tiles":
        return "tiles"
    return "quads" if draws_in_software(ctx) else tried(ctx).sooner


def maker(ctx: moderngl.Context, way: Way) -> MakeSplats:
    """Of a window's splats on a context; on a processor quads end as `moving_renderer` has them."""
    sooner = way == "quads" and draws_in_software(ctx)
    return partial(SplatBuffers, reach=REACH) if sooner else WAYS[way]


def file() -> Path:
    """Where trials are kept."""
    return config_folder() / "drawing.json"


def tried(ctx: moderngl.Context) -> Trial:
    """The trial of this card and driver: the one that is kept, or else a new one."""
    driver = f"{ctx.info['GL_RENDERER']}, {ctx.info['GL_VERSION']}"
    kept = _kept()
    with suppress(KeyError, TypeError, ValueError):
        return Trial(**{name: float(ms) for name, ms in kept[driver].items()})
    trial = measured(ctx)
    with suppress(OutputError):  # the next start tries again
        make_folder(file().parent)
        write_atomically(file(), json.dumps({**kept, driver: asdict(trial)}, indent=2).encode())
    return trial


def _kept() -> dict:
    with suppress(OSError, ValueError):
        kept = json.loads(file().read_bytes())
        if isinstance(kept, dict):
            return kept
    return {}


def measured(ctx: moderngl.Context) -> Trial:
    """Draw some frames in both ways."""
    scene, cameras = _cloud(), [_camera(0.02 * frame) for frame in range(_FRAMES + 1)]
    quads_ms, expected = _timed(ctx, SplatBuffers, scene, cameras)
    tiles_ms, picture = _timed(ctx, TiledSplats, scene, cameras)
    same = (picture - expected).abs().mean() <= SAME and ctx.error == "GL_NO_ERROR"
    return Trial(quads_ms, tiles_ms if same else math.inf)


def _timed(
    ctx: moderngl.Context, make: MakeSplats, scene: Scene, cameras: list[Camera]
) -> tuple[float, Tensor]:
    """Milliseconds, and the last picture (H, W, 3); infinite, and nothing to see, where the driver refuses.
    The first frame compiles."""
    renderer = SplatRenderer(ctx, splats=make)
    try:
        renderer.set_scene(scene)
        taken = []
        for camera in cameras:
            renderer.finish()
            start = time.perf_counter()
            renderer.draw(camera, weight_maps=False, moving=True, late=True)
            renderer.finish()
            renderer.draw(camera)
            renderer.finish()
            taken.append(1e3 * (time.perf_counter() - start))
        return statistics.median(taken[1:]), renderer.frame().rgb
    except (GraphicsError, moderngl.Error):
        return math.inf, torch.zeros(())
    finally:
        renderer.release()


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
