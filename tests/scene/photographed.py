"""A wall and a screen before it, photographed finer than the network's grid: a prediction whose truth is
known, and its photos."""

import io
from dataclasses import dataclass

import numpy as np
import torch
from PIL import Image
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, rays, transform
from langflash_core.types import Camera, Gaussians, Prediction, Views
from tests.scene.plane import NUM_ATOMS, poses, told

GRID = (30, 40)
WALL, SCREEN = 3.0, 2.0  # z in the world
_EDGES = (-0.2, 0.5, -0.3, 0.4)  # left, right, top, bottom of the screen


@dataclass(frozen=True)
class Photographed:
    """photos: (3, h, w) of each view, as its sources hold them."""

    prediction: Prediction
    views: Views
    photos: list[Tensor]


def photographed(
    num_views: int = 2,
    ratio: float | tuple[float, ...] = 3,
    *,
    screen: bool = True,
    busy: bool = False,
    gains: tuple[float, ...] | None = None,
) -> Photographed:
    """Photos of `ratio` pixels a cell, of a wall that is striped on its right side and plain on its left.

    Args:
        ratio: of all photos, or of each. busy: detail everywhere. gains: of the exposure of each photo.
    """
    viewmats, K = poses(num_views), intrinsics_from_fov(60, GRID[1], GRID[0])
    whole = [Camera(viewmat, K, GRID[1], GRID[0]) for viewmat in viewmats]
    ratios = ratio if isinstance(ratio, tuple) else (ratio,) * num_views
    photos = []
    for view, camera in enumerate(whole):
        finer = camera.with_size(round(GRID[1] * ratios[view]), round(GRID[0] * ratios[view]))
        photo = _colours(*_surface(finer, screen), busy) * (1.0 if gains is None else gains[view])
        photos.append((photo * 255).round() / 255)
    surfaces = [_surface(camera, screen) for camera in whole]
    depths = torch.stack([depth for depth, _ in surfaces])
    x, y = (torch.stack([points[..., k] for _, points in surfaces]) for k in (0, 1))
    logits = torch.stack([(x * (k + 1)).sin() * 4 + (y * (5 - k)).cos() * 3 for k in range(NUM_ATOMS)], 1)
    drawn = torch.Generator().manual_seed(0)
    prediction = told(Gaussians.none(), logits.softmax(1), viewmats, depths, drawn)
    images = torch.stack([F.interpolate(photo[None], GRID, mode="area")[0] for photo in photos])
    names = tuple(f"{view}.png" for view in range(num_views))
    sources = tuple(png(photo) for photo in photos)
    return Photographed(
        prediction, Views(images, K.repeat(num_views, 1, 1), names, sources, ("of triage",)), photos
    )


def _surface(camera: Camera, screen: bool) -> tuple[Tensor, Tensor]:
    """Depths (h, w) and world points (h, w, 3) of what a camera sees."""
    pose, ahead = invert_rigid(camera.viewmat), rays(camera.K, camera.width, camera.height)
    forwards = ahead @ pose[2, :3]
    found = (WALL - pose[2, 3]) / forwards
    if screen:
        nearer = (SCREEN - pose[2, 3]) / forwards
        points = transform(pose, ahead * nearer[..., None])
        left, right, top, bottom = _EDGES
        across = (points[..., 0] > left) & (points[..., 0] < right)
        found = torch.where(across & (points[..., 1] > top) & (points[..., 1] < bottom), nearer, found)
    return found, transform(pose, ahead * found[..., None])


def _colours(depths: Tensor, points: Tensor, busy: bool) -> Tensor:
    """(3, h, w): stripes of a few pixels on the wall's right side, plain else; the screen is dark."""
    x, y, z = points.unbind(-1)
    stripes = 0.25 * (x * 40).sin() * (y * 35).cos() * ((x > 0) | busy)
    wall = torch.stack((0.6 + stripes, 0.5 + 0.05 * y + stripes, 0.4 - stripes))
    thing = torch.stack((0.15 + 0.1 * (y * 30).sin(), torch.full_like(x, 0.2), 0.3 + 0.1 * x))
    return torch.where(z < (WALL + SCREEN) / 2, thing, wall).clamp(0, 1)


def png(photo: Tensor) -> bytes:
    stream = io.BytesIO()
    Image.fromarray((photo.movedim(0, -1) * 255).round().numpy().astype(np.uint8)).save(stream, "PNG")
    return stream.getvalue()
