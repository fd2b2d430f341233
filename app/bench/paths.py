"""Camera paths: between a scene's own views, or an arc where it has fewer than two."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.transform import Rotation, Slerp
from torch import Tensor

from langflash_core.geometry.cameras import (
    intrinsics_from_fov,
    invert_rigid,
    rotation_angle_degrees,
    transform,
)
from langflash_core.types import Camera, Scene

ARC_STEP = 2.0  # degrees a frame: a turn of 60 degrees a second at 30 frames a second
_FOV = 60.0  # degrees, for a scene without photos


@dataclass(frozen=True)
class Path:
    """Cameras of one size along a smooth way; the first is only where the second frame comes from.

    cameras: N + 1 of them. kind: the way in words.
    """

    cameras: tuple[Camera, ...]
    kind: str

    @property
    def num_frames(self) -> int:
        return len(self.cameras) - 1

    def step(self) -> tuple[float, float]:
        """Median turn in degrees and median way in scene units from one frame to the next."""
        poses = torch.stack([invert_rigid(camera.viewmat) for camera in self.cameras])
        turns = rotation_angle_degrees(poses[:-1, :3, :3], poses[1:, :3, :3])
        ways = (poses[1:, :3, 3] - poses[:-1, :3, 3]).norm(dim=-1)
        return float(turns.median()), float(ways.median())


def camera_path(scene: Scene, size: tuple[int, int], num_frames: int) -> Path:
    """Through all views in order, turning evenly; with one view an arc about what it looks at, with
    none an arc about the scene's middle.

    Args:
        size: (width, height) in pixels; the field of view of each axis is kept.
    """
    if scene.num_views > 1:
        poses, kind = _between(scene.viewmats.double(), num_frames), "between its views"
        Ks = scene.Ks.double()
        places = torch.linspace(0, scene.num_views - 1, num_frames + 1, dtype=torch.float64)
        lower = places.long().clamp_max(scene.num_views - 2)
        share = (places - lower)[:, None, None]
        lenses = (1 - share) * Ks[lower] + share * Ks[lower + 1]
        cameras = [Camera(pose, K, *scene.view_size) for pose, K in zip(poses, lenses, strict=True)]
    else:
        start, pivot = _first(scene, size)
        kind = "an arc about its middle" if scene.num_views == 0 else "an arc about what its view shows"
        cameras = [
            Camera(
                _turned(start.viewmat, pivot, ARC_STEP * (i - num_frames / 2)),
                start.K,
                start.width,
                start.height,
            )
            for i in range(num_frames + 1)
        ]
    return Path(tuple(camera.resized(*size) for camera in cameras), kind)


def _between(viewmats: Tensor, num_frames: int) -> Tensor:
    """World-to-camera poses (num_frames + 1, 4, 4) at even places from the first view to the last."""
    poses = invert_rigid(viewmats).numpy()
    stops = np.arange(len(poses))
    places = np.linspace(0, len(poses) - 1, num_frames + 1)
    made = np.tile(np.eye(4), (num_frames + 1, 1, 1))
    made[:, :3, :3] = Slerp(stops, Rotation.from_matrix(poses[:, :3, :3]))(places).as_matrix()
    for axis in range(3):
        made[:, axis, 3] = np.interp(places, stops, poses[:, axis, 3])
    return invert_rigid(torch.from_numpy(made))


def _first(scene: Scene, size: tuple[int, int]) -> tuple[Camera, Tensor]:
    """The camera in the middle of the arc, and the point (3,) it turns about."""
    means = scene.gaussians.means.double()
    means = means[torch.isfinite(means).all(-1)]
    if scene.num_views:
        seen = scene.camera(0)
        viewmat = seen.viewmat.double()
        depths = transform(viewmat, means)[:, 2]
        depth = depths[depths > 0].median() if bool((depths > 0).any()) else torch.tensor(1.0)
        pivot = transform(invert_rigid(viewmat), torch.stack((depth * 0, depth * 0, depth))[None])[0]
        return Camera(viewmat, seen.K.double(), seen.width, seen.height), pivot
    middle = means.median(0).values if len(means) else torch.zeros(3, dtype=torch.float64)
    reach = float((means - middle).norm(dim=-1).median()) if len(means) else 1.0
    viewmat = torch.eye(4, dtype=torch.float64)
    viewmat[:3, 3] = -middle + torch.tensor([0.0, 0.0, 2.0 * max(reach, 1e-3)])
    return Camera(viewmat, intrinsics_from_fov(_FOV, *size).double(), *size), middle


def _turned(viewmat: Tensor, pivot: Tensor, degrees: float) -> Tensor:
    """The pose moved on a circle about `pivot`, around the camera's own upright axis."""
    pose = invert_rigid(viewmat)
    turn = torch.from_numpy(Rotation.from_rotvec(np.radians(degrees) * pose[:3, 1].numpy()).as_matrix())
    moved = pose.clone()
    moved[:3, :3] = turn @ pose[:3, :3]
    moved[:3, 3] = turn @ (pose[:3, 3] - pivot) + pivot
    return invert_rigid(moved)
