"""What pose estimation reads of a view, and matches between two of them without their cameras."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from langflash_core.cameras.dense import match_cells
from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.cameras.matching import Matches
from langflash_core.geometry.pinhole import from_pixels, to_pixels
from langflash_core.rig.settings import MATCHING


@dataclass(frozen=True)
class PoseInput:
    """What pose estimation reads of one view.

    K: (3, 3) pixels of the network's image of `size` (width, height). depth: (H, W), z of the
    monocular map. local: unit descriptors (C, h', w') of `LocalFeatures`.
    """

    K: Float[np.ndarray, "3 3"]
    size: tuple[int, int]
    depth: Float[np.ndarray, "H W"]
    local: Float[np.ndarray, "C h w"]

    def through(self, growth: float) -> "PoseInput":
        """The same view through a lens of so many times the focal length."""
        return replace(self, K=scale_focal(self.K, growth))


def scale_focal(
    K: Float[np.ndarray, "... 3 3"], growth: float | Float[np.ndarray, "..."]
) -> Float[np.ndarray, "... 3 3"]:
    """Intrinsics (..., 3, 3) of so many times (...) the focal length."""
    ratio = np.ones_like(K)
    ratio[..., :2, :2] = np.asarray(growth)[..., None, None]
    return K * ratio


def key_point_matches(views: list[PoseInput], points: KeyPoints, i: int, j: int) -> Matches:
    """Those of two photos, as accurate as a pixel at the working size."""
    rows = points.pairs[i, j]
    x_i = without_camera(points.positions[i][rows[:, 0]], views[i])
    x_j = without_camera(points.positions[j][rows[:, 1]], views[j])
    return Matches(x_i, x_j, normalised_sigma(views[j], 1.0), rows)


def dense_matches(view_i: PoseInput, view_j: PoseInput) -> Matches:
    """Cells of local features that choose each other."""
    cells_i, cells_j = match_cells(view_i.local, view_j.local)
    x_i, x_j = (
        from_pixels(cells * (np.array(view.size) / view.local.shape[:0:-1]), view.K)
        for view, cells in ((view_i, cells_i), (view_j, cells_j))
    )
    return Matches(x_i, x_j, normalised_sigma(view_j, MATCHING.dense_sigma), np.full((len(x_i), 2), -1))


def with_dense(exact: Matches, dense: Matches) -> Matches:
    """Both sets, with the tolerance of the coarser."""
    x_i, x_j = (np.concatenate(both) for both in ((exact.x_i, dense.x_i), (exact.x_j, dense.x_j)))
    return Matches(x_i, x_j, dense.sigma, np.concatenate((exact.key_points, dense.key_points)))


def normalised_sigma(view: PoseInput, pixels: float) -> float:
    """`pixels` at the working size, as normalised coordinates."""
    return pixels * max(view.size) / MATCHING.working_side / view.K[0, 0]


def without_camera(pixels: Float[np.ndarray, "n 2"], view: PoseInput) -> Float[np.ndarray, "n 2"]:
    """Pixels of a picture whose longer side is `MATCHING.working_side` -> normalised coordinates (n, 2)."""
    return from_pixels(pixels * (max(view.size) / MATCHING.working_side), view.K)


def depths_at(view: PoseInput, x: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    """z (n,) of the monocular map at normalised coordinates (n, 2)."""
    pixels = np.array(to_pixels(x[:, 0], x[:, 1], 1.0, view.K)).astype(int)
    columns, rows = np.clip(pixels, 0, np.array(view.size)[:, None] - 1)
    return view.depth[rows, columns].astype(np.float64)
