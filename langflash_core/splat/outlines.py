"""Outlines of a part of a scene in a picture: fast enough to follow a selection, and for the eye alone.

Gaussians are squares as wide as their discs on a small grid. A pixel is of the part where the nearest of its
squares is as near as the nearest of all, but for `OUTLINES.beside`. In a scene of layers those count that the
picture is blended of.

Sizes: N Gaussians, H W pixels of the grid, n points of a line.
"""

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float

from langflash_core.geometry.nearness import Nearness
from langflash_core.geometry.pinhole import see
from langflash_core.splat.settings import OUTLINES
from langflash_core.types import Camera, Scene

from .frustum import may_touch
from .projection import NEAR


def outlines(
    scene: Scene, visible: Bool[np.ndarray, " N"], part: Bool[np.ndarray, " N"], camera: Camera
) -> tuple[Float[np.ndarray, "n 2"], ...]:
    """Closed lines x, y, pixels of the camera's picture, around what it shows of a part.

    Args:
        visible: (N,) bool, what takes part, and covers.
    """
    ratio = min(1.0, OUTLINES.side / max(camera.width, camera.height))
    size = max(1, round(camera.width * ratio)), max(1, round(camera.height * ratio))
    mask = silhouette(scene, visible, part, camera.with_size(*size))
    found, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    scale = np.array([camera.width / size[0], camera.height / size[1]])
    lines = [
        cv2.approxPolyDP(line, OUTLINES.smooth, True)[:, 0] for line in found if len(line) >= OUTLINES.least
    ]
    return tuple((line + 0.5) * scale for line in lines if len(line) > 2)


def silhouette(
    scene: Scene, visible: Bool[np.ndarray, " N"], part: Bool[np.ndarray, " N"], camera: Camera
) -> Bool[np.ndarray, "H W"]:
    """The camera's pixels (H, W) that show a part."""
    none = np.zeros((camera.height, camera.width), bool)
    if not (part & visible).any():
        return none
    rows = np.flatnonzero(visible & _drawn_gaussians(scene, camera) & may_touch(scene.gaussians, camera))
    viewmat, K = camera.viewmat.cpu().double().numpy(), camera.K.cpu().double().numpy()
    means = scene.gaussians.means.detach().cpu().numpy()[rows]
    with np.errstate(all="ignore"):
        size = camera.width, camera.height
        x, y, z, inside = see(means, viewmat, K, size, NEAR, camera.orthographic)
        depths = 1.0 if camera.orthographic else np.maximum(z, NEAR)
        scales = np.partition(scene.gaussians.scales.detach().cpu().numpy()[rows], 1, axis=1)
        wide = (scales[:, 1] / depths * K[0, 0]).clip(0, OUTLINES.widest)
    lines, columns = y[inside].astype(int), x[inside].astype(int)
    own, z, steps = part[rows][inside], z[inside], np.round(np.nan_to_num(wide[inside])).astype(int)
    whole = _nearest(z, lines, columns, steps, none.shape)
    some = _nearest(z[own], lines[own], columns[own], steps[own], none.shape)
    shown = np.isfinite(some) & (some <= OUTLINES.beside * whole)
    closed = cv2.morphologyEx(shown.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return cv2.medianBlur(closed, 3) > 0


def _nearest(
    z: np.ndarray, lines: np.ndarray, columns: np.ndarray, steps: np.ndarray, shape: tuple[int, int]
) -> Float[np.ndarray, "H W"]:
    """Depth of the nearest square at each pixel, endless where there is none."""
    depths = np.full(shape, np.inf, np.float32)
    for step in range(OUTLINES.widest + 1):
        some = steps == step
        if not some.any():
            continue
        own = np.full(shape, np.inf, np.float32)
        np.minimum.at(own, (lines[some], columns[some]), z[some].astype(np.float32))
        side = 2 * step + 1
        largest = np.where(np.isfinite(own), own, np.float32(3e38))
        depths = np.minimum(depths, cv2.erode(largest, np.ones((side, side), np.uint8)))
    return np.where(depths < 3e38, depths, np.inf)


def _drawn_gaussians(scene: Scene, camera: Camera) -> Bool[np.ndarray, " N"]:
    """What a picture is made of."""
    near = Nearness.of(scene) if scene.layered else None
    if near is None or not near.views or scene.view_ids is None:
        return np.ones(len(scene.gaussians), bool)
    views = torch.tensor([-1, *near.chosen(camera).views])
    return torch.isin(scene.view_ids.cpu(), views).numpy()
