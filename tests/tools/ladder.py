"""What a moving picture costs and how far it is from the exact one, by size and share of the Gaussians.

    python -m tests.tools.ladder SCENE [--size 640x480] [--rounds 4]

The rungs of `app/window/governor.py` were chosen from this table. Colours and one phrase's heat-map in the
fast mode, enlarged to full size by a linear filter as the window does; the camera is on its way from the
first photo to the second. Milliseconds of processor time of all threads, and of the window's own thread
alone: with c cores a frame takes at least own + (all - own) / c. The least of the rounds, which other
programs lengthen least.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import moderngl
import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import interpolate

import langflash_core as lf
from app.gl import SplatRenderer, moving_renderer
from langflash_core.base.graphics import offscreen_context
from langflash_core.language.relevance import compile_query
from langflash_core.language.spaces import language_space
from langflash_core.scene.thin import coarse_share, thin_with_rows
from langflash_core.types import Camera, Scene

SCALES = (1.0, 0.75, 0.5, 0.35, 0.25, 0.18)
SHARES = (1.0, 0.5, 0.25, 0.125)
PLACES = (0.25, 0.6)  # on the way, where errors are measured


@dataclass(frozen=True)
class Rung:
    """decibels: PSNR of the colours against the exact picture. relevance: mean error, of the full size's too,
    which is drawn in the fast mode. all_ms, own_ms: see above."""

    scale: float
    share: float
    decibels: float
    relevance: float
    all_ms: float
    own_ms: float


def between(scene: Scene, place: float, size: tuple[int, int]) -> Camera:
    """A camera on the way from the first photo's pose, 0, to the second's, 1."""
    camera = scene.camera(0, *size)
    first, last = scene.viewmats[0].double(), scene.viewmats[-1].double()
    viewmat = torch.lerp(first, last, place)
    u, _, v = torch.linalg.svd(viewmat[:3, :3])  # the nearest rotation
    viewmat[:3, :3] = u @ v
    return replace(camera, viewmat=viewmat.to(camera.viewmat))


def enlarged(maps: Tensor, size: tuple[int, int]) -> Tensor:
    """(n, h, w) to (n, H, W)."""
    return interpolate(maps[None].float(), size=size[::-1], mode="bilinear")[0]


def seen(renderer: SplatRenderer, size: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """Colours (3, H, W) in [0, 1] and relevance (1, H, W) of what is drawn."""
    rgb = renderer.frame().rgb.movedim(-1, 0).clamp(0, 1)
    return enlarged(rgb, size), enlarged(renderer.relevance(), size)


def measured(
    ctx: moderngl.Context,
    scene: Scene,
    phrase: str,
    size: tuple[int, int],
    scales: Sequence[float] = SCALES,
    shares: Sequence[float] | None = None,
    rounds: int = 4,
) -> list[Rung]:
    """All combinations, which take turns in every round.

    shares: None: `SHARES`; of a scene with levels the coarse ones and all, half, a quarter, none of the rest.
    """
    if shares is None:
        coarse = coarse_share(scene)
        shares = (
            SHARES if coarse == 1 else (1.0, *(coarse + part * (1 - coarse) for part in (0.5, 0.25, 0.0)))
        )
    query = compile_query(scene, language_space(scene.semantics.space), [phrase])
    twin, renderer = SplatRenderer(ctx, "float32"), moving_renderer(ctx)
    for each in (twin, renderer):
        each.set_scene(scene)
        each.ask(query)
    for share in shares:
        if share < 1:
            renderer.give_level(scene, share, *thin_with_rows(scene, share))
    plans = [(scale, share) for scale in scales for share in shares]

    def draw(place: float, scale: float, share: float) -> None:
        small = tuple(max(8, round(side * scale)) for side in size)
        renderer.draw(between(scene, place, (small[0], small[1])), fast=True, share=share)
        renderer.heat_texture()
        ctx.finish()

    exact = []
    for place in PLACES:
        twin.draw(between(scene, place, size))
        exact.append(seen(twin, size))
    twin.release()
    errors = {}
    for plan in plans:
        differences = []
        for place, (colours, relevance) in zip(PLACES, exact, strict=True):
            draw(place, *plan)
            found = seen(renderer, size)
            squares = (found[0] - colours).square().mean()
            differences.append((-10 * float(squares.log10()), float((found[1] - relevance).abs().mean())))
        errors[plan] = np.mean(differences, 0)
    times = dict.fromkeys(plans, (np.inf, np.inf))
    for number in range(rounds):
        for plan in plans:
            everything, own = time.process_time(), time.thread_time()
            draw((number + 1) / (rounds + 1), *plan)
            spent = 1000 * (time.process_time() - everything), 1000 * (time.thread_time() - own)
            times[plan] = min(times[plan][0], spent[0]), min(times[plan][1], spent[1])
    renderer.release()
    return [Rung(*plan, float(errors[plan][0]), float(errors[plan][1]), *times[plan]) for plan in plans]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--phrase", default="plant")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--rounds", type=int, default=4)
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    scene = lf.load(given.scene)
    say = sys.stdout.write
    say(f"{len(scene.gaussians):,} Gaussians, {width} x {height}\n")
    say("| size | share | PSNR, dB | relevance, mean error | all ms | own ms |\n" + 6 * "| --- " + "|\n")
    for rung in measured(offscreen_context(), scene, given.phrase, (width, height), rounds=given.rounds):
        error = f"{rung.decibels:.1f} | {rung.relevance:.4f}"
        say(f"| {rung.scale} | {rung.share:.3g} | {error} | {rung.all_ms:.0f} | {rung.own_ms:.0f} |\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
