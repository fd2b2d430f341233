"""A finished scene fitted to the photos inside it, kept only where that brings a photo closer that was held
out (`langflash_core/splat/refine.py`)."""

import cv2
import torch

from langflash_core.errors import InputError
from langflash_core.running import Progress
from langflash_core.scene.light import Light
from langflash_core.splat.refine import Budget, Refinement, refine
from langflash_core.types import Scene

from .photos import decoded


def improvable(scene: Scene) -> bool:
    """Whether a scene has two photos and more in it, and knows which of them made what."""
    return scene.num_views > 1 and len(scene.photos) == scene.num_views and scene.view_ids is not None


def improve(scene: Scene, budget: Budget, report: Progress | None = None) -> Refinement:
    """The scene fitted to its own photos, in the light that it was made in.

    Its record says what came of it; where it is not kept, scene and record are as they were.

    Args:
        report: as `refine` has it; what it raises ends the work.

    Raises:
        InputError: there are no photos in it, or they overlap too little to judge.
        SceneFileError: a photo in it cannot be read.
    """
    if not improvable(scene):
        raise InputError(
            "this scene cannot be improved: it holds no two photos, or does not say which made what; "
            "reconstruct it from its photos"
        )
    size = scene.view_size
    whole = (decoded(scene, view) for view in range(len(scene.photos)))
    small = (cv2.resize(photo, size, interpolation=cv2.INTER_AREA) for photo in whole)
    photos = torch.stack([torch.from_numpy(each).movedim(-1, 0).float() / 255 for each in small])
    if told := scene.record.light:
        light = Light(torch.tensor(told["gains"]), torch.tensor(told["offsets"]))
        photos = light.corrected(photos).clamp(0, 1)
    result = refine(scene, photos, budget, report)
    return result.recorded() if result.kept else result
