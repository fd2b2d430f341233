"""A prediction to a scene as fine as its photos: one light, elements of the size that each photo asks
for, weights with the photo's borders, colours solved for. Composes stages; nothing is learned or fitted
in shape.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import torch
from torch import Tensor

from langflash_core.detail import Detail
from langflash_core.geometry.harmonics import colour_to_sh, sh_to_colour
from langflash_core.images.views import source_pictures
from langflash_core.running import Progress
from langflash_core.scene.assemble import placed_views
from langflash_core.scene.detailed import assemble_detailed, working_photos
from langflash_core.scene.light import Light, photo_light
from langflash_core.scene.prune import prune
from langflash_core.splat.colours import ROUNDS, solved_colours
from langflash_core.types import Cost, Prediction, Scene, Views

_RINGING = 0.3
"""Of what a photo varies by around a Gaussian, how far its colour may go beyond: blur needs some of it."""


@torch.no_grad()
def fine_scene(
    prediction: Prediction,
    views: Views,
    detail: Detail,
    *,
    gaussians: int | None,
    preset: str,
    progress: Progress = lambda stage, fraction: None,
) -> tuple[Scene, Light]:
    """The scene of a prediction whose depth maps are surfaces, and the light its photos were brought to.

    Args:
        gaussians: about so many; None: as `detail` has it. preset: recorded.
        progress: called before each step; what it raises ends the work there.

    Raises:
        InputError: not one usable point in view 0.
        ValueError: the prediction's sizes disagree, or its poses are not finite.
    """
    start = time.perf_counter()
    progress("light", 0.0)
    prediction, views = placed_views(prediction, views)
    light = photo_light(
        views.images, prediction.depths, prediction.confidences, prediction.viewmats, views.Ks
    )
    grid = (views.images.shape[-2], views.images.shape[-1])
    photos = [
        light.corrected(photo, view=v).clamp(0, 1)
        for v, photo in enumerate(working_photos(source_pictures(views), grid))
    ]
    views = replace(views, images=light.corrected(views.images).clamp(0, 1))
    scene = assemble_detailed(
        prediction,
        views,
        photos,
        detail,
        gaussians=gaussians,
        preset=preset,
        progress=lambda done: progress("elements", 0.1 + 0.3 * done),
    )
    solving = time.perf_counter()
    scene = _coloured(scene, photos, lambda done: progress("colours", 0.4 + 0.5 * done))
    timings = {
        **prediction.timings,
        "assembly": solving - start,
        "colours": time.perf_counter() - solving,
    }
    scene = scene.with_record(light=light.stored(), cost=Cost(timings))
    progress("prune", 0.9)
    return prune(scene, merge=False), light


def _coloured(scene: Scene, photos: list[Tensor], progress: Callable[[float], None]) -> Scene:
    """The scene in the colours that make its photos (3, h, w) again; its record says how near they come."""
    solved = solved_colours(
        scene.gaussians,
        sh_to_colour(scene.gaussians.sh, scene.gaussians.means),
        [scene.camera(v, photo.shape[-1], photo.shape[-2]) for v, photo in enumerate(photos)],
        photos,
        ringing=_RINGING,
        progress=progress,
    )
    sh = colour_to_sh(solved.colours)[:, None]
    near = [round(after, 2) for _, after in solved.psnr]
    bought = {**scene.record.detail, "rounds": ROUNDS, "photos_psnr_db": near}
    return replace(scene, gaussians=replace(scene.gaussians, sh=sh)).with_record(detail=bought)
