"""Wavefront OBJ and MTL as flat arrays. F triangles, three corners each.

Only what the furniture libraries use: polygons (fanned), `v`, `vt`, `vn`, `usemtl`, negative
indices, diffuse colour, opacity, gloss and the diffuse map.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

PANE = " (pane)"  # follows the material name of window panes
_PANE_GROUP = "sweethome3d_window_pane"


@dataclass(frozen=True)
class Material:
    """How a surface looks: sRGB colour, opacity and gloss in [0, 1], texture file or ""."""

    colour: tuple[float, float, float] = (0.7, 0.7, 0.7)
    opacity: float = 1.0
    gloss: float = 0.0
    texture: str = ""


@dataclass(frozen=True)
class Soup:
    """Triangles without sharing: every corner has its own attributes.

    Attributes:
        positions: model or metric units.
        normals: unit; zero where the file has none.
        uvs: texture coordinates, v upwards.
        materials: index into `material_names`, per triangle.
        material_names: names of `usemtl` statements.
    """

    positions: Float[np.ndarray, "F 3 3"]
    normals: Float[np.ndarray, "F 3 3"]
    uvs: Float[np.ndarray, "F 3 2"]
    materials: Int[np.ndarray, " F"]
    material_names: tuple[str, ...]


def parse_obj(text: str) -> tuple[Soup, tuple[str, ...]]:
    """Triangles of an OBJ file, and the MTL files that it names.

    Raises:
        ValueError: the file has no faces.
    """
    lines: dict[str, list[str]] = {"v": [], "vt": [], "vn": [], "f": []}
    libraries: list[str] = []
    names: dict[str, int] = {}
    current, pane, face_materials = "", False, []
    for line in text.splitlines():
        head, _, rest = line.strip().partition(" ")
        if head in lines:
            lines[head].append(rest)
            if head == "f":
                face_materials.append(names.setdefault(current + PANE * pane, len(names)))
        elif head == "usemtl":
            current = rest.strip()
        elif head == "g":
            pane = rest.strip().startswith(_PANE_GROUP)
        elif head == "mtllib":
            libraries.append(rest.strip())
    if not lines["f"]:
        raise ValueError("text: expected an OBJ file with faces, found none")
    corners, owners = _fan([line.split() for line in lines["f"]])
    return _gather(lines, corners, np.array(face_materials)[owners], tuple(names)), tuple(libraries)


def parse_mtl(text: str) -> dict[str, Material]:
    """Materials of an MTL file by name."""
    found: dict[str, dict] = {}
    fields: dict = {}
    for line in text.splitlines():
        head, _, rest = line.strip().partition(" ")
        rest = rest.strip()
        if head == "newmtl":
            fields = found.setdefault(rest, {})
        elif head == "Kd":
            fields["colour"] = tuple(min(float(v), 1.0) for v in rest.split()[:3])
        elif head == "d":
            fields["opacity"] = float(rest.split()[-1])
        elif head == "Ks":
            fields["gloss"] = min(float(np.mean([float(v) for v in rest.split()[:3]])), 1.0)
        elif head == "map_Kd":
            fields["texture"] = rest.replace("\\", "/").rpartition("/")[2]
    return {name: Material(**fields) for name, fields in found.items()}


def smooth_normals(
    positions: Float[np.ndarray, "F 3 3"], crease_cos: float = 0.77
) -> Float[np.ndarray, "F 3 3"]:
    """Corner normals: the mean of adjacent face normals within the crease angle, area-weighted.

    Args:
        positions: triangle corners, any unit.
        crease_cos: faces that differ by more than this cosine keep a hard edge.

    Returns:
        Unit normals; zero for degenerate triangles.
    """
    areas = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    faces = _unit(areas)
    extent = max(float(np.ptp(positions.reshape(-1, 3), axis=0).max()), 1e-9)
    cells = np.round((positions.reshape(-1, 3) - positions.reshape(-1, 3).min(0)) / extent * 1e5).astype(
        np.int64
    )
    _, point = np.unique(cells @ np.array([1, 200_003, 200_003**2]), return_inverse=True)
    order = np.argsort(point, kind="stable")
    counts = np.bincount(point)
    if counts.max() > 64:  # a fan hub: its quadratic pairing would explode
        counts = np.minimum(counts, 64)
    starts = np.concatenate([[0], np.cumsum(np.bincount(point))[:-1]])
    degree = counts[point]
    corner = np.repeat(np.arange(len(point)), degree)
    offset = np.arange(degree.sum()) - np.repeat(np.cumsum(degree) - degree, degree)
    other = order[starts[point[corner]] + offset] // 3
    near = np.einsum("nc,nc->n", faces[corner // 3], faces[other]) > crease_cos
    total = np.zeros((len(point), 3))
    for axis in range(3):
        total[:, axis] = np.bincount(corner[near], areas[other[near], axis], len(point))
    return _unit(total).reshape(-1, 3, 3)


def _fan(faces: list[list[str]]) -> tuple[Int[np.ndarray, "F 3 3"], Int[np.ndarray, " F"]]:
    """Corner index triples (v, vt, vn), 0 where absent, and the polygon each triangle came from."""
    tokens = [_three(token) for face in faces for token in face]
    flat = np.array(" ".join(tokens).replace("/", " ").split(), dtype=np.int64).reshape(-1, 3)
    sizes = np.array([len(face) for face in faces])
    starts = np.cumsum(sizes) - sizes
    triangles = np.maximum(sizes - 2, 0)
    owners = np.repeat(np.arange(len(faces)), triangles)
    step = np.arange(triangles.sum()) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    first = starts[owners]
    return flat[np.stack([first, first + step + 1, first + step + 2], axis=1)], owners


def _three(token: str) -> str:
    parts = token.split("/")
    return "/".join([(parts[k] if k < len(parts) and parts[k] else "0") for k in range(3)])


def _gather(
    lines: dict[str, list[str]],
    corners: Int[np.ndarray, "F 3 3"],
    materials: np.ndarray,
    names: tuple[str, ...],
) -> Soup:
    tables = [_table(lines["v"], 3), _table(lines["vt"], 2), _table(lines["vn"], 3)]
    picked = []
    for k, table in enumerate(tables):
        index = corners[..., k]
        index = np.where(index < 0, index + len(table), index)  # row 0 holds the "absent" zeros
        picked.append(table[np.clip(index, 0, len(table) - 1)])
    return Soup(picked[0], _unit(picked[2]), picked[1], materials, names)


def _table(rows: list[str], width: int) -> Float[np.ndarray, "M width"]:
    values = [row.split()[:width] for row in rows]
    values = [row + ["0"] * (width - len(row)) for row in values]
    flat = np.array([number for row in values for number in row], dtype=np.float64)
    return np.concatenate([np.zeros((1, width)), flat.reshape(-1, width)])


def _unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-12), 0.0)
