"""Synthetic scenes, and the reference's own slow twin: one pixel and one Gaussian at a time."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch.nn.functional import normalize

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.types import Camera, Frame, Gaussians, Scene, Semantics


def camera(
    width: int = 48, height: int = 40, focal: float = 40.0, pose: torch.Tensor | None = None
) -> Camera:
    K = torch.tensor(
        [[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]], dtype=torch.float64
    )
    return Camera(torch.eye(4, dtype=torch.float64) if pose is None else pose, K, width, height)


def parallel(seen: Camera, depth: float = 2.0) -> Camera:
    """The orthographic camera that shows what lies at `depth` as large as a pinhole does."""
    K = seen.K / seen.K.new_tensor([[depth], [depth], [1.0]])
    K[:2, 2] = seen.K[:2, 2]
    return dataclasses.replace(seen, K=K, orthographic=True)


def turned(yaw: float, shift: tuple[float, float, float]) -> torch.Tensor:
    """A view matrix turned about y by `yaw` radians."""
    pose = torch.eye(4, dtype=torch.float64)
    pose[0, 0] = pose[2, 2] = math.cos(yaw)
    pose[0, 2], pose[2, 0] = math.sin(yaw), -math.sin(yaw)
    pose[:3, 3] = torch.tensor(shift, dtype=torch.float64)
    return pose


def cloud(
    count: int,
    num_atoms: int = 5,
    kept: int = 4,
    size: float = 0.03,
    seed: int = 0,
    degree: int = 1,
    dtype: torch.dtype = torch.float64,
) -> Scene:
    """Gaussians filling the view of `camera()` and more, with random sparse weights that sum to 1."""
    g = torch.Generator().manual_seed(seed)
    depth = 1 + 2 * torch.rand(count, 1, generator=g, dtype=torch.float64)
    slope = 1.4 * (torch.rand(count, 2, generator=g, dtype=torch.float64) - 0.5)
    gaussians = Gaussians(
        torch.cat((slope * depth, depth), 1),
        torch.randn(count, 4, generator=g, dtype=torch.float64),
        size * torch.exp(0.5 * torch.randn(count, 3, generator=g, dtype=torch.float64)),
        0.05 + 0.95 * torch.rand(count, generator=g, dtype=torch.float64),
        0.4 * torch.randn(count, (degree + 1) ** 2, 3, generator=g, dtype=torch.float64),
    )
    width = kept if num_atoms else 0
    ids = torch.randint(0, max(num_atoms, 1), (count, width), generator=g)
    values = torch.rand(count, width, generator=g, dtype=torch.float64)
    values = values / values.sum(1, keepdim=True) if num_atoms else values
    atoms = normalize(torch.randn(num_atoms, 16, generator=g, dtype=torch.float64), dim=-1)
    return scene_of(gaussians.map(lambda v: v.to(dtype)), ids, values.to(dtype), atoms.to(dtype))


def unturned(
    means: torch.Tensor, scales: float | torch.Tensor, opacity: float = 0.9, sh: torch.Tensor | None = None
) -> Gaussians:
    """Gaussians along the axes of the world, grey without `sh`. scales: (N, 3), or what becomes it."""
    count = len(means)
    quats = torch.tensor([1.0, 0, 0, 0]).repeat(count, 1)
    scales = torch.as_tensor(scales).expand(count, 3).clone()
    sh = torch.zeros(count, 1, 3) if sh is None else sh
    return Gaussians(means, quats, scales, torch.full((count,), opacity), sh)


def scene_of(
    gaussians: Gaussians,
    ids: torch.Tensor | None = None,
    values: torch.Tensor | None = None,
    atoms: torch.Tensor | None = None,
) -> Scene:
    """A scene around Gaussians; without weights, K = 0."""
    if ids is None or values is None or atoms is None:
        count = len(gaussians)
        ids, values = torch.zeros(count, 0, dtype=torch.long), gaussians.means.new_zeros(count, 0)
        atoms = gaussians.means.new_zeros(0, 16)
    seen = camera()
    semantics = Semantics(ids, values, atoms, "test")
    return Scene(gaussians, semantics, seen.viewmat[None], seen.K[None], (seen.width, seen.height))


def splats(
    means: list[tuple[float, float, float]],
    scales: float | Sequence[float | tuple[float, float, float]] = 0.05,
    opacities: float | list[float] = 0.8,
    colours: list[tuple[float, float, float]] | None = None,
    dtype: torch.dtype = torch.float64,
) -> Gaussians:
    """A few Gaussians by hand, unturned, of constant colours."""
    count = len(means)

    def tensor(values) -> torch.Tensor:
        return torch.tensor(values, dtype=torch.float64)

    given = scales if isinstance(scales, Sequence) else [scales] * count
    sizes = tensor([s if isinstance(s, tuple) else (s, s, s) for s in given])
    opaque = tensor([opacities] * count if isinstance(opacities, float) else opacities)
    sh = (tensor(colours or [[1.0] * 3] * count) - 0.5)[:, None] / SH_C0
    made = (tensor(means), tensor([[1.0, 0.0, 0.0, 0.0]] * count), sizes, opaque, sh)
    return Gaussians(*(v.to(dtype) for v in made))


def maps_of(frame: Frame) -> torch.Tensor:
    """The weight maps of a frame that has them."""
    assert frame.weight_maps is not None
    return frame.weight_maps


def brute_force(gaussians: Gaussians, features: np.ndarray, seen: Camera) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, F) and alphas (H, W): plain loops, the inverse covariance, no culling."""
    K, viewmat = seen.K.numpy(), seen.viewmat.numpy()
    means = gaussians.means.numpy() @ viewmat[:3, :3].T + viewmat[:3, 3]
    drawn = [
        _footprint(i, gaussians, means[i], viewmat, K, seen) for i in np.argsort(means[:, 2], kind="stable")
    ]
    image = np.zeros((seen.height, seen.width, features.shape[1]))
    passed = np.ones((seen.height, seen.width))
    for y, x in np.ndindex(seen.height, seen.width):
        for footprint in drawn:
            if footprint is None:
                continue
            i, centre, inverse, opacity = footprint
            offset = np.array([x + 0.5, y + 0.5]) - centre
            alpha = min(0.99, opacity * math.exp(-0.5 * offset @ inverse @ offset))
            if alpha >= 1 / 255:
                image[y, x] += passed[y, x] * alpha * features[i]
                passed[y, x] *= 1 - alpha
    return image, 1 - passed


def _footprint(
    i: int, gaussians: Gaussians, mean: np.ndarray, viewmat: np.ndarray, K: np.ndarray, seen: Camera
):
    x, y, z = mean
    if z < 0.01:
        return None
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    w, *xyz = gaussians.quats[i].tolist()
    turn = viewmat[:3, :3] @ Rotation.from_quat([*xyz, w]).as_matrix()
    covariance = turn @ np.diag(gaussians.scales[i].numpy() ** 2) @ turn.T
    if seen.orthographic:
        J = np.array([[fx, 0, 0], [0, fy, 0]])
        centre = np.array([fx * x + cx, fy * y + cy])
        spread = J @ covariance @ J.T + 0.3 * np.eye(2)
        return i, centre, np.linalg.inv(spread), float(gaussians.opacities[i])
    slack_x, slack_y = 0.3 * 0.5 * seen.width / fx, 0.3 * 0.5 * seen.height / fy
    tx = z * np.clip(x / z, -cx / fx - slack_x, (seen.width - cx) / fx + slack_x)
    ty = z * np.clip(y / z, -cy / fy - slack_y, (seen.height - cy) / fy + slack_y)
    J = np.array([[fx / z, 0, -fx * tx / z**2], [0, fy / z, -fy * ty / z**2]])
    spread = J @ covariance @ J.T + 0.3 * np.eye(2)
    centre = np.array([fx * x / z + cx, fy * y / z + cy])
    return i, centre, np.linalg.inv(spread), float(gaussians.opacities[i])
