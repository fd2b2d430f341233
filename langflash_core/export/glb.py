"""Boxes and surfaces of phrases as binary glTF, for Blender, game engines and web viewers.

glTF has +x to the left, +y up and +z forward; scenes have +x to the right and +y down. One half turn
about z leads from one to the other, as for the splats (`gltf.py`), so that both lie together.

Colours of materials and of corners are linear, as glTF wants; the latter in 16 bits, for 8 would show steps
in the dark. No material is a metal: what says nothing is one to glTF, and dark.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Integer, UInt16

from langflash_core.errors import PromptError
from langflash_core.export.colours import label_colours, linear
from langflash_core.export.gltf_document import ARRAY, FLOAT, INDICES, UINT, USHORT, glb_head
from langflash_core.files import write_atomically
from langflash_core.geometry.fusion import Surface
from langflash_core.types import QueryResult

_TO_GLTF = np.diag([-1.0, -1.0, 1.0, 1.0])
_OPACITY = 0.35  # what stands in the box stays visible
_THINNEST = 1e-3  # of the longest side: a flat thing still gets a body
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_FACES = np.array([face for a, b, c, d in _SIDES for face in ((a, b, c), (a, c, d))])  # seen from outside


@dataclass(frozen=True)
class _Body:
    """A mesh below a node of its name: vertices (V, 3) in its own axes, faces (F, 3), pose to glTF's world.

    material: of glTF. colours: (V, 4) linear, of corners.
    """

    name: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Integer[np.ndarray, "F 3"]
    pose: Float[np.ndarray, "4 4"]
    material: Mapping[str, Any]
    colours: UInt16[np.ndarray, "V 4"] | None = None


def write_answer(result: QueryResult, path: Path) -> None:
    """The boxes of what was found, in scene units.

    Raises:
        OutputError: the path cannot be written.
        PromptError: nothing was found.
    """
    write_boxes([(a.prompt, a.box) for a in result.answers if a.box is not None], path)


def write_boxes(boxes: Sequence[tuple[str, dict[str, Any]]], path: Path) -> None:
    """Translucent boxes, a node and a colour each, called what they are called here.

    Args:
        boxes: name, and box with `center` (3,), `axes` (3, 3) rows and `size` (3,), in the unit that
            the file is to have; glTF's own is the metre.

    Raises:
        OutputError: the path cannot be written.
        PromptError: there are none.
    """
    if not boxes:
        raise PromptError("nothing was found, so there is no box to write; lower the threshold")
    bodies = []
    for (name, box), colour in zip(boxes, linear(label_colours(len(boxes)) / 255), strict=True):
        size = np.asarray(box["size"], float)
        sides = np.maximum(size, _THINNEST * max(size.max(), _THINNEST))
        material = _material(name, baseColorFactor=[*colour.tolist(), _OPACITY]) | {"alphaMode": "BLEND"}
        bodies.append(_Body(name, _CORNERS * sides, _FACES, _TO_GLTF @ _pose(box), material))
    write_atomically(path, _packed(bodies))


def write_surfaces(surfaces: Sequence[tuple[str, Surface]], path: Path, scale: float = 1.0) -> None:
    """Coloured meshes, a node each, called what they are called here; seen from both sides.

    Args:
        scale: of lengths, to the unit that the file is to have.

    Raises:
        OutputError: the path cannot be written.
        PromptError: there are none.
    """
    if not surfaces:
        raise PromptError("no view shows a surface of it, so there is none to write; lower the threshold")
    bodies = []
    for name, surface in surfaces:
        colours = np.full((len(surface.vertices), 4), 65535, np.uint16)
        colours[:, :3] = np.round(65535 * linear(surface.colours / 255))
        vertices = scale * surface.vertices
        bodies.append(_Body(name, vertices, surface.faces, _TO_GLTF, _material(name), colours))
    write_atomically(path, _packed(bodies))


def _material(name: str, **more: Any) -> dict[str, Any]:
    plain = {"metallicFactor": 0.0, "roughnessFactor": 1.0, **more}
    return {"name": name, "pbrMetallicRoughness": plain, "doubleSided": True}


class _Buffer:
    """Rows of numbers one after the other, each column's bytes a multiple of four."""

    def __init__(self) -> None:
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.content = b""

    def add(self, values: np.ndarray, component: int, kind: str, target: int, **more: Any) -> int:
        """The accessor of rows; component, kind, target: as glTF has them."""
        view = {"byteOffset": len(self.content), "byteLength": values.nbytes, "target": target}
        own = {"bufferView": len(self.views), "componentType": component, "count": len(values), "type": kind}
        self.views.append({"buffer": 0, **view})
        self.accessors.append({**own, **more})
        self.content += values.tobytes()
        return len(self.accessors) - 1

    def body(self, body: _Body, material: int) -> dict[str, Any]:
        """The mesh of a body."""
        places, faces = np.ascontiguousarray(body.vertices, "<f4"), np.ascontiguousarray(body.faces, "<u4")
        bounds = {"min": places.min(0).tolist(), "max": places.max(0).tolist()}
        attributes = {"POSITION": self.add(places, FLOAT, "VEC3", ARRAY, **bounds)}
        if body.colours is not None:
            colours = np.ascontiguousarray(body.colours, "<u2")
            attributes["COLOR_0"] = self.add(colours, USHORT, "VEC4", ARRAY, normalized=True)
        corners = self.add(faces.reshape(-1), UINT, "SCALAR", INDICES)
        primitive = {"attributes": attributes, "indices": corners, "material": material}
        return {"name": body.name, "primitives": [primitive]}


def _packed(bodies: Sequence[_Body]) -> bytes:
    """A whole .glb."""
    buffer = _Buffer()
    document = {
        "asset": {"version": "2.0", "generator": "LangFlash"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(bodies)))}],
        "nodes": [
            {"name": body.name, "mesh": index, "matrix": body.pose.T.reshape(-1).tolist()}
            for index, body in enumerate(bodies)
        ],
        "meshes": [buffer.body(body, index) for index, body in enumerate(bodies)],
        "materials": [dict(body.material) for body in bodies],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.content)}],
    }
    return glb_head(document, len(buffer.content)) + buffer.content


def _pose(box: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    """From a box around the origin to where it stands; without mirroring."""
    pose = np.eye(4)
    pose[:3, :3] = np.asarray(box["axes"], float).T
    if np.linalg.det(pose[:3, :3]) < 0:
        pose[:3, 2] *= -1
    pose[:3, 3] = box["center"]
    return pose
