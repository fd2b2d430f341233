"""Pictures to judge by eye: a scene from its first photo's place and ever farther aside. H W pixels."""

import numpy as np
import torch
from torch import Tensor

from langflash_core.geometry.fusion import DepthView
from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.evaluation.side_measures import as_array
from langflash_core.lab.evaluation.side_subjects import Case, carried
from langflash_core.lab.evaluation.sides import aligned, camera_of, covered_depths
from langflash_core.scene.gaps import filled
from langflash_core.types import Camera, Frame, Scene

SHOWN = (0, 15, 30, 45)
"""Degrees around what the first photo looks at."""
BEHIND = 0.25
"""Grey of what nothing covers, nor is near what is, so that it is told from dark things."""
UP = np.array([0.0, -1.0, 0.0])
"""Of a scene's world: its first photo was held roughly level."""


@torch.no_grad()
def scene_pictures(scene: Scene, render: Render) -> list[Tensor]:
    """One picture (H, W, 3) for each of `SHOWN`, to the right."""
    own = scene.camera(0)
    first = render(scene, own)
    view = DepthView(covered_depths(first), as_array(own.viewmat), as_array(own.K))
    pictures = [_over_grey(first)]
    for degrees in SHOWN[1:]:
        viewmat = torch.from_numpy(carried(view, "right", degrees, UP)).to(own.viewmat)
        pictures.append(_over_grey(render(scene, Camera(viewmat, own.K, own.width, own.height))))
    return pictures


@torch.no_grad()
def room_pictures(scene: Scene, case: Case, render: Render) -> tuple[list[Tensor], list[Tensor]]:
    """One picture for each of `SHOWN`, to the side where the room has more space, and the true ones."""
    assert case.showing is not None, "a room can be shown from anywhere"
    placed = case.truth(scene.view_size).photos[: scene.num_views]
    frames = [render(scene, scene.camera(view)) for view in range(len(placed))]
    fit = aligned(scene, placed, [covered_depths(frame) for frame in frames])
    looks = [case.showing(degrees) for degrees in SHOWN[1:]]
    drawn = [frames[0], *(render(scene, camera_of(look, fit)) for look in looks)]
    return [_over_grey(frame) for frame in drawn], [placed[0].rgb, *(look.rgb for look in looks)]


def _over_grey(frame: Frame) -> Tensor:
    """The picture of a frame, which was drawn over black, with its gaps filled."""
    return filled(frame.rgb, frame.alphas, BEHIND)
