"""One model made compact: posed, scaled, decimated, indexed. Metres, y up, front +z.

The foot of the bounding box is the origin in y; x and z are centred.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from langflash_core.lab.rooms.objfile import Soup, smooth_normals

HEIGHT_CELLS = 24


@dataclass(frozen=True)
class Mesh:
    """Indexed triangles.

    Attributes:
        positions: m, inside the box of the item's size.
        normals: unit.
        uvs: texture coordinates, v upwards.
        materials: index into the material names of its soup, per vertex.
        faces: vertex indices.
        heights: highest surface seen from above over a grid (z rows, x columns), m; 0 where empty.
    """

    positions: Float[np.ndarray, "N 3"]
    normals: Float[np.ndarray, "N 3"]
    uvs: Float[np.ndarray, "N 2"]
    materials: Int[np.ndarray, " N"]
    faces: Int[np.ndarray, "F 3"]
    heights: Float[np.ndarray, "R R"]


def pose(soup: Soup, size: tuple[float, float, float], rotation: tuple[float, ...]) -> Soup:
    """Rotate by `modelRotation`, then scale the bounding box per axis to `size`, m.

    Normals go by the inverse transpose; where the file has none they are computed.
    """
    turn = np.array(rotation).reshape(3, 3)
    turned = soup.positions @ turn.T
    low, high = turned.reshape(-1, 3).min(0), turned.reshape(-1, 3).max(0)
    scale = np.array(size) / np.maximum(high - low, 1e-9)
    centre = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    positions = (turned - centre) * scale
    missing = np.abs(soup.normals).sum(-1, keepdims=True) < 1e-6
    given = (soup.normals @ turn.T) / np.maximum(scale, 1e-9) * scale.max()
    given /= np.maximum(np.linalg.norm(given, axis=-1, keepdims=True), 1e-9)
    normals = np.where(missing, smooth_normals(positions), given) if missing.any() else given
    return replace(soup, positions=positions, normals=normals)


def index(soup: Soup, max_faces: int) -> Mesh:
    """Share equal vertices, and merge near ones until at most about `max_faces` remain.

    Decimation is vertex clustering: corners in one grid cell take their mean position; their
    normals and texture coordinates merge only within a material and a rough direction, so that
    hard edges stay hard and no crack opens.
    """
    points = soup.positions.reshape(-1, 3)
    low = points.min(0)
    extent = max(float(np.ptp(points, axis=0).max()), 1e-6)
    exact = np.round((points - low) / extent * 2**16).astype(np.int64)
    cells, fine = exact, True
    if len(soup.positions) > max_faces:
        for resolution in (128, 96, 72, 54, 40, 30, 22, 16):
            cells = np.floor((points - low) / extent * (resolution - 1e-6)).astype(np.int64)
            fine = False
            if _alive(cells).sum() <= max_faces:
                break
    return _merge(soup, cells, fine)


def height_map(
    positions: Float[np.ndarray, "F 3 3"], size: tuple[float, float, float], seed: int = 0
) -> Float[np.ndarray, "R R"]:
    """Highest point above every cell of the footprint, from points strewn evenly over the surface."""
    rng = np.random.default_rng(seed)
    areas = np.linalg.norm(
        np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]), axis=1
    )
    heights = np.zeros((HEIGHT_CELLS, HEIGHT_CELLS))
    if areas.sum() <= 0:
        return heights
    chosen = rng.choice(len(areas), 24_000, p=areas / areas.sum())
    u, v = rng.random((2, 24_000))
    flip = u + v > 1
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    corner = positions[chosen]
    points = (
        corner[:, 0] + u[:, None] * (corner[:, 1] - corner[:, 0]) + v[:, None] * (corner[:, 2] - corner[:, 0])
    )
    column = np.clip((points[:, 0] / max(size[0], 1e-6) + 0.5) * HEIGHT_CELLS, 0, HEIGHT_CELLS - 1).astype(
        int
    )
    row = np.clip((points[:, 2] / max(size[2], 1e-6) + 0.5) * HEIGHT_CELLS, 0, HEIGHT_CELLS - 1).astype(int)
    np.maximum.at(heights, (row, column), points[:, 1])
    return heights


def _alive(cells: Int[np.ndarray, "C 3"]) -> np.ndarray:
    """Triangles whose three corners lie in different cells."""
    key = _key(cells).reshape(-1, 3)
    return (key[:, 0] != key[:, 1]) & (key[:, 1] != key[:, 2]) & (key[:, 0] != key[:, 2])


def _key(cells: Int[np.ndarray, "C D"]) -> Int[np.ndarray, " C"]:
    """A 64-bit mix of integer columns; collisions are negligible at these sizes."""
    key = np.zeros(len(cells), dtype=np.uint64)
    for column in cells.T:
        key = (key ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        key ^= key >> np.uint64(29)
    return key.astype(np.int64)


def _merge(soup: Soup, cells: Int[np.ndarray, "C 3"], fine: bool) -> Mesh:
    alive = _alive(cells)
    corners = np.repeat(alive, 3)
    points, normals, uvs = (
        a.reshape(-1, a.shape[-1])[corners] for a in (soup.positions, soup.normals, soup.uvs)
    )
    materials = np.repeat(soup.materials, 3)[corners]
    cells = cells[corners]
    _, place = np.unique(_key(cells), return_inverse=True)
    points = _means(points, place)[place]
    rough = np.round(normals * (50 if fine else 1.2)).astype(np.int64)
    parts = [cells, rough, materials[:, None]] + ([np.round(uvs * 4096).astype(np.int64)] if fine else [])
    _, first, vertex = np.unique(_key(np.concatenate(parts, axis=1)), return_index=True, return_inverse=True)
    mean_normals = _means(normals, vertex)
    mean_normals /= np.maximum(np.linalg.norm(mean_normals, axis=1, keepdims=True), 1e-9)
    faces = vertex.reshape(-1, 3)
    size = tuple(np.ptp(soup.positions.reshape(-1, 3), axis=0))
    heights = height_map(soup.positions, size)
    vertices = _refit(points[first], soup.positions.reshape(-1, 3))
    return Mesh(vertices, mean_normals, uvs[first], materials[first], faces, heights)


def _refit(points: Float[np.ndarray, "N 3"], original: Float[np.ndarray, "C 3"]) -> Float[np.ndarray, "N 3"]:
    """Stretch to the bounding box of the original: means of cells lie inside it."""
    if not len(points):
        return points
    low, high = points.min(0), points.max(0)
    target_low, target_high = original.min(0), original.max(0)
    stretch = np.where(high - low > 1e-9, (target_high - target_low) / np.maximum(high - low, 1e-9), 1.0)
    return target_low + (points - low) * stretch


def _means(values: Float[np.ndarray, "C D"], groups: Int[np.ndarray, " C"]) -> Float[np.ndarray, "G D"]:
    counts = np.maximum(np.bincount(groups), 1)
    return np.stack([np.bincount(groups, column) / counts for column in values.T], axis=1)
