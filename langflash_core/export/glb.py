"""Boxes and surfaces of phrases as binary glTF, for Blender, game engines and web viewers.

glTF has +x to the left, +y up and +z forward; scenes have +x to the right and +y down. One half turn
about z leads from one to the other, as for the splats (`gltf.py`), so that both lie together.

Colours of materials and of corners are linear, as glTF wants; the latter in 16 bits, for 8 would show steps
in the dark. No material is a metal.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from langflash_core.base.files import write_atomically
from langflash_core.errors import PromptError
from langflash_core.export.colours import label_colours, linear
from langflash_core.export.settings import BOXES
from langflash_core.geometry.fusion import Surface
from langflash_core.types import QueryResult

if TYPE_CHECKING:
    import trimesh

_TO_GLTF = np.diag([-1.0, -1.0, 1.0, 1.0])
_CORNERS = "_LINEAR"
"""An attribute of corners that becomes COLOR_0: trimesh writes that one in 8 bits alone."""


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
    import trimesh  # late: half a second that no other format needs

    scene, colours = trimesh.Scene(base_frame="langflash"), linear(label_colours(len(boxes)) / 255)
    for name, box in boxes:
        size = np.asarray(box["size"], float)
        body = trimesh.creation.box(np.maximum(size, BOXES.thinnest * max(size.max(), BOXES.thinnest)))
        body.visual = _no_metal(name, alphaMode="BLEND")
        scene.add_geometry(body, node_name=name, geom_name=name, transform=_TO_GLTF @ _pose(box))
    _write(scene, path, [[*colour.tolist(), BOXES.opacity] for colour in colours])


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
    import trimesh

    scene = trimesh.Scene(base_frame="langflash")
    for name, surface in surfaces:
        colours = np.full((len(surface.vertices), 4), 65535, np.uint16)
        colours[:, :3] = np.round(65535 * linear(surface.colours / 255))
        mesh = trimesh.Trimesh(scale * surface.vertices, surface.faces, process=False)
        mesh.visual = _no_metal(name)
        mesh.vertex_attributes[_CORNERS] = colours
        scene.add_geometry(mesh, node_name=name, geom_name=name, transform=_TO_GLTF)
    _write(scene, path)


def _no_metal(name: str, **more: str) -> Any:
    """A material seen from both sides; what says nothing is a metal to glTF, and dark."""
    from trimesh.visual.material import PBRMaterial
    from trimesh.visual.texture import TextureVisuals

    material = PBRMaterial(name=name, metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True, **more)
    return TextureVisuals(material=material)


def _write(scene: "trimesh.Scene", path: Path, colours: Sequence[list[float]] = ()) -> None:
    """colours: linear, of the materials in order; none: white."""

    def linearly(tree: dict[str, Any]) -> None:
        for material, colour in zip(tree["materials"], colours, strict=False):
            material["pbrMetallicRoughness"]["baseColorFactor"] = colour
        for mesh in tree["meshes"]:
            attributes = mesh["primitives"][0]["attributes"]
            if _CORNERS in attributes:
                attributes["COLOR_0"] = attributes.pop(_CORNERS)
                tree["accessors"][attributes["COLOR_0"]]["normalized"] = True

    content = scene.export(file_type="glb", tree_postprocessor=linearly)
    assert isinstance(content, bytes)
    write_atomically(path, content)


def _pose(box: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    """From a box around the origin to where it stands; without mirroring."""
    pose = np.eye(4)
    pose[:3, :3] = np.asarray(box["axes"], float).T
    if np.linalg.det(pose[:3, :3]) < 0:
        pose[:3, 2] *= -1
    pose[:3, 3] = box["center"]
    return pose
