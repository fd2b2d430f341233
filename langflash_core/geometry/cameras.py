"""Pinhole cameras, OpenCV axes: rays, rigid transforms, fields of view. Pixel centres at +0.5."""

import math

import torch
from jaxtyping import Float, Shaped
from torch import Tensor


def intrinsics_from_fov(fov_degrees: float, width: int, height: int) -> Float[Tensor, "3 3"]:
    """K (3, 3) of a centred camera whose *longer* image side spans `fov_degrees`.

    Raises:
        ValueError: the field of view is not in (1, 179) degrees.
    """
    if not 1.0 < fov_degrees < 179.0:
        raise ValueError(f"fov_degrees: expected 1 to 179, received {fov_degrees}")
    focal = 0.5 * max(width, height) / math.tan(math.radians(fov_degrees) / 2)
    return torch.tensor([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])


def fov_degrees(K: Float[Tensor, "3 3"], width: int, height: int) -> tuple[float, float]:
    """Horizontal and vertical field of view in degrees; the principal point may be off centre."""
    (fx, _, cx), (_, fy, cy) = K[0].tolist(), K[1].tolist()
    horizontal = math.atan(cx / fx) + math.atan((width - cx) / fx)
    vertical = math.atan(cy / fy) + math.atan((height - cy) / fy)
    return math.degrees(horizontal), math.degrees(vertical)


def pixel_grid(width: int, height: int, *, like: Shaped[Tensor, "..."]) -> Float[Tensor, "H W 2"]:
    """Pixel centres (H, W, 2) as (x, y), of `like`'s dtype and device."""
    ys = torch.arange(height, dtype=like.dtype, device=like.device) + 0.5
    xs = torch.arange(width, dtype=like.dtype, device=like.device) + 0.5
    grid_y, grid_x = torch.meshgrid(ys, xs, indexing="ij")
    return torch.stack((grid_x, grid_y), -1)


def rays(Ks: Float[Tensor, "*n 3 3"], width: int, height: int) -> Float[Tensor, "*n H W 3"]:
    """Viewing directions (..., H, W, 3) with z = 1 in the camera frame, for K (..., 3, 3)."""
    grid = pixel_grid(width, height, like=Ks)
    focal = torch.stack((Ks[..., 0, 0], Ks[..., 1, 1]), -1)[..., None, None, :]
    centre = Ks[..., None, None, :2, 2]
    xy = (grid - centre) / focal
    return torch.cat((xy, torch.ones_like(xy[..., :1])), -1)


def unproject(
    depths: Float[Tensor, "*n H W"], Ks: Float[Tensor, "... 3 3"], orthographic: bool = False
) -> Float[Tensor, "*n H W 3"]:
    """Points (..., H, W, 3) in the camera frame from z-depths (..., H, W)."""
    height, width = depths.shape[-2:]
    ahead = rays(Ks, width, height)
    if orthographic:
        return torch.cat((ahead[..., :2].expand(*depths.shape, 2), depths[..., None]), -1)
    return ahead * depths[..., None]


def transform(
    matrices: Float[Tensor, "... 4 4"], points: Float[Tensor, "... n 3"]
) -> Float[Tensor, "... n 3"]:
    """Rigid matrices (..., 4, 4) applied to points (..., n, 3)."""
    return points @ matrices[..., :3, :3].transpose(-1, -2) + matrices[..., None, :3, 3]


def invert_rigid(matrices: Float[Tensor, "*n 4 4"]) -> Float[Tensor, "*n 4 4"]:
    """Inverse of rigid (..., 4, 4) without a linear solve: [R^T, -R^T t]."""
    rotations = matrices[..., :3, :3].transpose(-1, -2)
    inverse = torch.zeros_like(matrices)
    inverse[..., :3, :3] = rotations
    inverse[..., :3, 3] = -(rotations @ matrices[..., :3, 3:]).squeeze(-1)
    inverse[..., 3, 3] = 1
    return inverse


_UPRIGHT = {
    1: ((1, 0), (0, 1)),
    2: ((-1, 0), (0, 1)),
    3: ((-1, 0), (0, -1)),
    4: ((1, 0), (0, -1)),
    5: ((0, 1), (1, 0)),
    6: ((0, -1), (1, 0)),
    7: ((0, -1), (-1, 0)),
    8: ((0, 1), (-1, 0)),
}
"""Where EXIF's orientations bring right and down of the stored pixels."""
MIRRORED = (2, 4, 5, 7)
"""Those of photos that are stored mirrored."""


def turned_camera(
    K: Float[Tensor, "3 3"], viewmat: Float[Tensor, "4 4"], size: tuple[int, int], orientation: int
) -> tuple[Float[Tensor, "3 3"], Float[Tensor, "4 4"], tuple[int, int]]:
    """The camera of a photo's stored pixels as that of the photo turned upright: the same rays.

    Args:
        K, size: pixels, (width, height), as stored. orientation: EXIF's, 1 to 8.

    Raises:
        ValueError: a mirrored photo (2, 4, 5, 7), of which no camera takes the same rays.
    """
    turn = torch.tensor(_UPRIGHT[orientation], dtype=K.dtype)
    if torch.linalg.det(turn) < 0:
        raise ValueError(f"orientation: expected 1, 3, 6 or 8, received {orientation}, which mirrors")
    to_upright, camera = torch.eye(3, dtype=K.dtype), torch.eye(4, dtype=viewmat.dtype)
    to_upright[:2, :2] = turn
    to_upright[:2, 2] = -turn.clamp(max=0) @ torch.tensor(size, dtype=K.dtype)
    camera[:2, :2] = turn
    upright = to_upright @ K
    upright[:, :2] = upright[:, :2] @ turn.T
    width, height = size
    return upright, camera @ viewmat, (height, width) if orientation >= 5 else (width, height)


def rotation_angle_degrees(
    left: Float[Tensor, "... 3 3"], right: Float[Tensor, "... 3 3"]
) -> Float[Tensor, "..."]:
    """Angle (...) in degrees between rotations (..., 3, 3).

    atan2 of the skew and symmetric parts keeps small angles exact where arccos would not.
    """
    relative = left.transpose(-1, -2) @ right
    skew = relative - relative.transpose(-1, -2)
    sine = torch.stack((skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]), -1).norm(dim=-1) / 2
    cosine = (relative.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2
    return torch.rad2deg(torch.atan2(sine, cosine))


_SAMPLES = 1000  # points that tell the median distance


def world_points(
    depths: Float[Tensor, "V H W"], viewmats: Float[Tensor, "V 4 4"], Ks: Float[Tensor, "V 3 3"]
) -> Float[Tensor, "V HW 3"]:
    """Points in the world of depth maps, row by row, in their unit.

    Args:
        depths: z of the cameras. viewmats: world to camera. Ks: pixels.
    """
    poses = invert_rigid(viewmats)
    pos_c = unproject(depths, Ks).flatten(1, 2)
    return pos_c @ poses[:, :3, :3].transpose(1, 2) + poses[:, None, :3, 3]


def median_distance(points: Float[Tensor, "N 3"], viewmat: Float[Tensor, "4 4"]) -> float:
    """Median, of some points in the world from a camera's place; 1 where there is none."""
    some = points[:: max(1, len(points) // _SAMPLES)].detach().cpu().double()
    centre = invert_rigid(viewmat.detach().cpu().double())[:3, 3]
    distances = (some - centre).norm(dim=-1)
    distances = distances[torch.isfinite(distances)]
    middle = float(distances.median()) if len(distances) else 0.0
    return middle if middle > 0 else 1.0
