"""Camera paths: between a scene's own views, or an arc where it has one only, as splat files do."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.transform import Rotation, Slerp
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, rotation_angle_degrees, transform
from langflash_core.types import Camera, Scene

ARC_STEP = 2.0  # degrees a frame: a turn of 60 degrees a second at 30 frames a second


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
    """Through all views in order at even places; with one view, an arc about what it looks at.

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
        start, pivot = scene.camera(0), _pivot(scene)
        kind = "on an arc about what its view shows"
        cameras = [
            Camera(
                _turned(start.viewmat.double(), pivot, ARC_STEP * (i - num_frames / 2)),
                start.K,
                start.width,
                start.height,
            )
            for i in range(num_frames + 1)
        ]
    return Path(tuple(camera.with_size(*size) for camera in cameras), kind)


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


def _pivot(scene: Scene) -> Tensor:
    """The point (3,) straight ahead of view 0, at the median depth of what lies there."""
    viewmat, means = scene.viewmats[0].double(), scene.gaussians.means.double()
    depths = transform(viewmat, means)[:, 2]
    ahead = depths[torch.isfinite(depths) & (depths > 0)]
    depth = float(ahead.median()) if len(ahead) else 1.0
    return transform(invert_rigid(viewmat), torch.tensor([[0.0, 0.0, depth]], dtype=torch.float64))[0]


def _turned(viewmat: Tensor, pivot: Tensor, degrees: float) -> Tensor:
    """The pose moved on a circle about `pivot`, around the camera's own upright axis."""
    pose = invert_rigid(viewmat)
    turn = torch.from_numpy(Rotation.from_rotvec(np.radians(degrees) * pose[:3, 1].numpy()).as_matrix())
    moved = pose.clone()
    moved[:3, :3] = turn @ pose[:3, :3]
    moved[:3, 3] = turn @ (pose[:3, 3] - pivot) + pivot
    return invert_rigid(moved)
