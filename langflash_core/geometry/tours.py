"""The way of a film along key frames, for the window's preview and for files. Loads torch."""

import numpy as np
import torch

from langflash_core.types import Camera

RATE = 30  # pictures a second


def even(size: tuple[int, int]) -> tuple[int, int]:
    """Sides rounded down to even numbers of pixels, as encoders want them."""
    width, height = (max(2, side // 2 * 2) for side in size)
    return width, height


def along(cameras: list[Camera], times: list[float], size: tuple[int, int] | None = None) -> list[Camera]:
    """Smoothly through all key frames: splines of place and rotation, lenses in between without overshoot.
    All orthographic, or none.

    Speeds are continuous. Source: of the rotations, scipy's RotationSpline.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator  # .1 s, which a picture has not to wait for
    from scipy.spatial.transform import Rotation, RotationSpline

    width, height = even(size or (cameras[0].width, cameras[0].height))
    sized = [camera.with_size(width, height) for camera in cameras]
    turns = np.stack([camera.viewmat[:3, :3].double().numpy() for camera in sized])
    centres = np.stack([-R.T @ c.viewmat[:3, 3].double().numpy() for R, c in zip(turns, sized, strict=True)])
    lenses = PchipInterpolator(times, np.stack([camera.K.double().numpy() for camera in sized]))
    moments = np.arange(max(1, round(RATE * times[-1])) + 1) / RATE
    moments = np.minimum(moments, times[-1])
    rotations = RotationSpline(times, Rotation.from_matrix(turns))(moments).as_matrix()
    places = CubicSpline(times, centres)(moments)
    viewmats = np.tile(np.eye(4), (len(moments), 1, 1))
    viewmats[:, :3, :3] = rotations
    viewmats[:, :3, 3] = -(rotations @ places[..., None])[..., 0]
    found = zip(torch.from_numpy(viewmats).float(), torch.from_numpy(lenses(moments)).float(), strict=True)
    return [Camera(viewmat, K, width, height, cameras[0].orthographic) for viewmat, K in found]
