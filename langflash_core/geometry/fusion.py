"""Depth maps of several views to one surface: a truncated signed distance field, and its zero.

A voxel's centre x, seen by view v at depth z(x) where the map says d, is d - z before (> 0) or behind the
surface. Within a band of `tau` around it, the views' distances min(1, (d - z) / tau) are averaged; what
lies further behind is hidden and not counted, as is what a map says nothing of. Between voxels that were
seen by some view, the zero of the average is the surface: open where nobody looked.

Source: Curless and Levoy, "A Volumetric Method for Building Complex Models from Range Images", 1996;
marching cubes after Lewiner et al. 2003, of scikit-image.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Integer, UInt8

from langflash_core.base.optional import optional_packages
from langflash_core.geometry.pinhole import see
from langflash_core.geometry.settings import FUSION


@dataclass(frozen=True)
class DepthView:
    """Depths (H, W), world units, 0 for nothing; seen by viewmat (4, 4), K (3, 3)."""

    depths: Float[np.ndarray, "H W"]
    viewmat: Float[np.ndarray, "4 4"]
    K: Float[np.ndarray, "3 3"]

    def look(
        self, points: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Integer[np.ndarray, " n"]]:
        """Depth z of points, the map's depth there (0 for nothing, or beside it), and the pixel, flat."""
        height, width = self.depths.shape
        x, y, z, inside = see(points, self.viewmat, self.K, (width, height))
        pixels = np.where(inside, np.floor(y) * width + np.floor(x), 0).astype(np.int64)
        return z, np.where(inside, self.depths.reshape(-1)[pixels], 0.0), pixels


@dataclass(frozen=True)
class ColouredView(DepthView):
    """A depth map with its colours (H, W, 3)."""

    colours: UInt8[np.ndarray, "H W 3"]


@dataclass(frozen=True)
class Surface:
    """A mesh: vertices (V, 3) world, faces (F, 3) facing who looked, colours (V, 3)."""

    vertices: Float[np.ndarray, "V 3"]
    faces: Integer[np.ndarray, "F 3"]
    colours: UInt8[np.ndarray, "V 3"]


def fuse(
    views: Sequence[ColouredView], low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"], voxel: float
) -> Surface | None:
    """The surface inside a box.

    Args:
        low, high: corners of the box, world. voxel: side of a voxel, world units; larger where the box
            would hold more than three million.

    Returns:
        None where no view shows anything of it.

    Raises:
        MissingPackageError: scikit-image is not installed.
    """
    with optional_packages():
        from skimage.measure import marching_cubes  # pyright: ignore[reportMissingImports]
    voxel = max(voxel, float((np.prod(high - low + 2 * FUSION.band * voxel) / FUSION.most_voxels) ** (1 / 3)))
    low = low - FUSION.band * voxel
    shape = np.maximum(np.ceil((high - low) / voxel + FUSION.band).astype(int) + 1, 2)
    field, seen = _field(views, low, voxel, shape)
    if not (field[seen] > 0).any() or not (field[seen] < 0).any():
        return None
    places, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="descent", allow_degenerate=False)
    known = _known_cells(seen)
    cells = np.minimum(
        places[faces].mean(1).astype(int), np.array(known.shape) - 1
    )  # the last plane has none
    faces = faces[known[tuple(cells.T)]]
    if not len(faces):
        return None
    used, faces = np.unique(faces, return_inverse=True)
    vertices = low + voxel * places[used].astype(np.float64)
    return Surface(vertices, faces.reshape(-1, 3), _vertex_colours(views, vertices, FUSION.band * voxel))


def _known_cells(seen: Bool[np.ndarray, "X Y Z"]) -> Bool[np.ndarray, "x y z"]:
    """Cells between voxels whose eight corners were seen: elsewhere a zero is the rim of what is known."""
    for axis in range(3):
        seen = np.delete(seen, 0, axis) & np.delete(seen, -1, axis)
    return seen


def _field(
    views: Sequence[ColouredView],
    low: Float[np.ndarray, " 3"],
    voxel: float,
    shape: Integer[np.ndarray, " 3"],
) -> tuple[Float[np.ndarray, "X Y Z"], Bool[np.ndarray, "X Y Z"]]:
    """Mean distance over the band, 1 where unseen, and which voxels were seen."""
    total, count = np.zeros(int(shape.prod()), np.float32), np.zeros(int(shape.prod()), np.int32)
    for first in range(0, len(total), FUSION.slab):
        some = slice(first, min(first + FUSION.slab, len(total)))
        centres = low + voxel * np.stack(np.unravel_index(np.arange(some.start, some.stop), shape), -1)
        for view in views:
            depths, there, _ = view.look(centres)
            distances = (there - depths) / (FUSION.band * voxel)
            known = (there > 0) & (distances >= -1)
            total[some] += np.where(known, np.minimum(distances, 1), 0)
            count[some] += known
    seen = count > 0
    field = np.where(seen, total / np.maximum(count, 1), 1).astype(np.float32)
    return field.reshape(shape), seen.reshape(shape)


def _vertex_colours(
    views: Sequence[ColouredView], vertices: Float[np.ndarray, "V 3"], reach: float
) -> UInt8[np.ndarray, "V 3"]:
    """Mean colour of the pixels that show a vertex; grey where none does."""
    total, count = np.zeros((len(vertices), 3)), np.zeros(len(vertices))
    for view in views:
        depths, there, pixels = view.look(vertices)
        shown = (there > 0) & (abs(there - depths) < reach)
        total[shown] += view.colours.reshape(-1, 3)[pixels[shown]]
        count += shown
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], 128).round().astype(np.uint8)
