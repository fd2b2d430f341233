"""glTF 2.0 with KHR_gaussian_splatting: points whose attributes are Gaussians, all values activated.

POSITION, KHR_gaussian_splatting:ROTATION (xyzw), :SCALE (lengths), :OPACITY, and
:SH_DEGREE_l_COEF_n, float32; COLOR_0 (linear, as glTF wants) for viewers that know no splats. Axes of
glTF are left, up, forward. Written as one .glb; read from .glb and .gltf (`gltf_document.py`), with the
nodes' rotations, translations and even scales. Language rides along as LANGFLASH_language (`language.py`)
on the primitive, which others ignore.

Drafts of the extension stored logarithms of scales: where most are below 0, they are taken for such.

Source: KHR_gaussian_splatting, Release Candidate as of 2026-04-15 (KhronosGroup/glTF 63770cc7).
"""

import binascii
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.errors import SceneFileError
from langflash_core.export.colours import encoding_of, linear, with_srgb_colours
from langflash_core.export.gltf_document import COMPONENTS, REMEDY, WIDTHS, Document, extensions, glb_head
from langflash_core.export.language import packed_language, speaks, with_language
from langflash_core.export.packing import check_some, error_line, place_rows, transform_rows
from langflash_core.export.settings import STORED
from langflash_core.export.stored import Gathering, Rows, parts, to_scene
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE, SH_C0
from langflash_core.geometry.turning import axes_matrix
from langflash_core.types import Gaussians, Scene

EXTENSION, LANGUAGE = "KHR_gaussian_splatting", "LANGFLASH_language"
_KNOWN = (EXTENSION, LANGUAGE, "KHR_mesh_quantization", "KHR_node_visibility")  # of what a file may require
_AXES = "LUF"
_POINTS, _ATTRIBUTES = 0, 34962  # a mode of primitives, a target of buffer views
_SPACE, _KERNEL, _PROJECTION = "srgb_rec709_display", "ellipse", "perspective"
_NAMES = {part: f"{EXTENSION}:{part}" for part in ("ROTATION", "SCALE", "OPACITY")}
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, RecursionError, ArithmeticError, struct.error,
           binascii.Error, OSError)  # fmt: skip


@np.errstate(all="ignore")  # numbers that are not finite are left out, and said
def read_gltf(path: Path) -> Scene:
    """The Gaussians of a .glb or .gltf, of all its nodes together; with language where it carries some.

    Raises:
        SceneFileError: missing, damaged, compressed, without a usable Gaussian, or in need of the unknown.
    """
    content = path.read_bytes()
    if not content:
        raise SceneFileError(f"{path.name} is an empty file; {REMEDY}")
    try:
        document = Document(content, path, _KNOWN)
        found = _primitives(document)
        if not found:
            raise SceneFileError(f"{path.name} holds no Gaussians (no primitive with {EXTENSION}); {REMEDY}")
        scene = _gather_primitives(document, found, path.name)
        return _speaking(scene, document, found, path.name)
    except _DAMAGE as error:
        raise SceneFileError(f"{path.name} is damaged or no glTF ({error_line(error)}); {REMEDY}") from error


def write_glb(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene, in its own order, and its language.

    Raises:
        OutputError: there is nothing to write, or the path cannot be written.
    """
    check_some(scene.gaussians, path)
    block = packed_language(scene) if speaks(scene) else b""
    write_atomically(path, _encode(scene.gaussians, block))


@dataclass(frozen=True)
class _Splats:
    """A primitive of Gaussians. own: what the extension says of it. matrix: (4, 4) to the world. some: which
    rows of its accessors are drawn, in order."""

    primitive: dict[str, Any]
    matrix: np.ndarray
    some: np.ndarray | range

    @property
    def own(self) -> dict[str, Any]:
        return self.primitive["extensions"][EXTENSION]

    @property
    def attributes(self) -> dict[str, int]:
        return self.primitive["attributes"]


def _primitives(document: Document) -> list[_Splats]:
    """Every primitive of Gaussians, of which all is understood that says where they are and how they look."""
    found = []
    for mesh, node, matrix in document.placed_meshes():
        for primitive in mesh["primitives"]:
            if EXTENSION in extensions(primitive):
                document.check_drawn_once(mesh, node)
                _check_understood(document, primitive)
                found.append(_Splats(primitive, matrix, _drawn_rows(document, primitive)))
    return found


def _check_understood(document: Document, primitive: dict[str, Any]) -> None:
    """Raises SceneFileError: an extension of the Gaussians' own, a part that is missing, or one that is not
    known."""
    attributes = primitive["attributes"]
    others = [name for name in extensions(primitive) if name not in (EXTENSION, LANGUAGE)]
    inner = list(extensions(primitive["extensions"][EXTENSION]))
    absent = any("bufferView" not in document.item("accessors", index) for index in attributes.values())
    if inner or (absent and others):
        raise document.refused(
            f"is compressed, or has Gaussians of another kind ({', '.join(inner or others)})"
        )
    needed = ["POSITION", *_NAMES.values(), *_harmonics(max(1, _num_bases(attributes)))]
    missing = [name for name in needed if name not in attributes]
    if missing:
        raise document.refused(f"has Gaussians without {missing[0]}, which this program needs")
    unknown = [name for name in attributes if name.startswith(f"{EXTENSION}:") and name not in needed]
    if unknown:
        raise document.refused(f"has Gaussians with {unknown[0][:60]}, which this program does not know")


def _drawn_rows(document: Document, primitive: dict[str, Any]) -> np.ndarray | range:
    """Rows that are drawn: all, or those that the primitive's indices name."""
    count = document.count(primitive["attributes"]["POSITION"])
    if "indices" not in primitive:
        return range(count)
    indices = document.rows(primitive["indices"], 1, slice(None))[:, 0]
    if indices.dtype.kind != "u" or int(indices.max()) >= count:
        raise ValueError(f"its indices name rows that are not there, of {count:,}")
    return indices


def _gather_primitives(document: Document, found: list[_Splats], name: str) -> Scene:
    """The scene of all primitives."""
    num_bases = max(_num_bases(splats.attributes) for splats in found)
    gathering = Gathering(sum(len(splats.some) for splats in found), num_bases, name)
    warnings: list[str] = []
    for splats in found:
        encoding, logs = encoding_of(splats.own.get("colorSpace"), name), _stores_logarithms(document, splats)
        warnings += [*_oddities(splats, name, logs), *filter(None, [encoding.said])]
        for rows in _rows(document, splats, num_bases, logs):
            srgb = with_srgb_colours(rows) if encoding.linear else rows
            gathering.add(place_rows(srgb, splats.matrix, _AXES))
    return to_scene(gathering, name, list(dict.fromkeys(warnings)), logs=False, logits=False)


def _oddities(splats: _Splats, name: str, logs: bool) -> Iterator[str]:
    """What a person is told about a primitive's shapes."""
    said = (splats.own.get("kernel"), splats.own.get("projection", _PROJECTION))
    odd = [str(own)[:60] for own, usual in zip(said, (_KERNEL, _PROJECTION), strict=True) if own != usual]
    if odd:
        yield f"{name} has Gaussians of an unknown kind ({', '.join(odd)}); they are drawn as usual ones."
    if logs:
        yield f"{name} stores logarithms of scales, as drafts of {EXTENSION} did; they are read as such."


def _stores_logarithms(document: Document, splats: _Splats) -> bool:
    """Whether scales are logarithms: most are below 0, which no length is."""
    index = splats.attributes[_NAMES["SCALE"]]
    below = sum(int((document.numbers(index, 3, some) < 0).sum()) for some in _parts(splats))
    if 0 < below <= 1.5 * len(splats.some):
        raise document.refused(f"has scales below 0 ({below:,} of {3 * len(splats.some):,})")
    return below > 0


def _parts(splats: _Splats) -> Iterator[slice | np.ndarray]:
    """Which rows are drawn, `STORED.rows_at_once` at a time."""
    for first in range(0, len(splats.some), STORED.rows_at_once):
        some = splats.some[first : first + STORED.rows_at_once]
        yield slice(some.start, some.stop) if isinstance(some, range) else some


def _speaking(scene: Scene, document: Document, found: list[_Splats], name: str) -> Scene:
    """The scene with the language that its one primitive carries."""
    blocks = [extensions(s.primitive)[LANGUAGE] for s in found if LANGUAGE in extensions(s.primitive)]
    if not blocks:
        return scene
    if len(found) > 1:
        said = f"{name} holds several sets of Gaussians; they were read without the language of one."
        return scene.with_record(warnings=(*scene.record.warnings, said))
    block, _ = document.view(blocks[0]["bufferView"])
    return with_language(scene, bytes(block), f"the language in {name}")


def _num_bases(attributes: dict) -> int:
    degree = 0
    while degree < MAX_SHOWN_DEGREE and f"{EXTENSION}:SH_DEGREE_{degree + 1}_COEF_0" in attributes:
        degree += 1
    return (degree + 1) ** 2


def _harmonics(num_bases: int) -> list[str]:
    """Attribute names in the order of the bases."""
    degrees = range(math.isqrt(num_bases))
    return [f"{EXTENSION}:SH_DEGREE_{each}_COEF_{n}" for each in degrees for n in range(2 * each + 1)]


def _rows(document: Document, splats: _Splats, num_bases: int, logs: bool) -> Iterator[Rows]:
    """Rows in the primitive's own axes. logs: scales are stored as logarithms."""
    names = _harmonics(_num_bases(splats.attributes))
    for some in _parts(splats):

        def numbers(name: str, width: int, some: slice | np.ndarray = some) -> np.ndarray:
            return document.numbers(splats.attributes[name], width, some)

        means, scales = numbers("POSITION", 3), numbers(_NAMES["SCALE"], 3)
        sh = np.zeros((len(means), num_bases, 3), np.float32)
        for basis, name in enumerate(names):
            sh[:, basis] = numbers(name, 3)
        quats = numbers(_NAMES["ROTATION"], 4)[:, [3, 0, 1, 2]]
        opacities = numbers(_NAMES["OPACITY"], 1)[:, 0]
        yield Rows(means, quats, np.exp(scales) if logs else scales, opacities, sh)


def _encode(gaussians: Gaussians, block: bytes) -> Iterator[bytes]:
    """The chunks of a .glb; positions need their bounds first, so rows are turned once and kept."""
    num_bases = min(gaussians.sh.shape[1], (MAX_SHOWN_DEGREE + 1) ** 2)
    matrix = axes_matrix(_AXES)
    rows = [transform_rows(part, matrix) for part in parts(gaussians)]
    columns: list[tuple[str, str, str]] = [
        ("POSITION", "VEC3", "<f4"), ("COLOR_0", "VEC4", "<u2"), (_NAMES["ROTATION"], "VEC4", "<f4"),
        (_NAMES["SCALE"], "VEC3", "<f4"), (_NAMES["OPACITY"], "SCALAR", "<f4"),
        *((name, "VEC3", "<f4") for name in _harmonics(num_bases)),
    ]  # fmt: skip
    document, length = _describe_document(columns, rows, len(gaussians), len(block))
    padding = b"\0" * (-length % 4)
    yield glb_head(document, length + len(padding))
    for index in range(len(columns)):
        yield from (_column(part, index) for part in rows)
    yield block + padding


def _describe_document(
    columns: list[tuple[str, str, str]], rows: list[Rows], count: int, block: int
) -> tuple[dict, int]:
    """The JSON, and the bytes of its buffer."""
    views, accessors, start = [], [], 0
    for index, (_, kind, number) in enumerate(columns):
        size, component = count * WIDTHS[kind] * np.dtype(number).itemsize, COMPONENTS[number]
        views.append({"buffer": 0, "byteOffset": start, "byteLength": size, "target": _ATTRIBUTES})
        accessors.append({"bufferView": index, "componentType": component, "count": count, "type": kind})
        start += size
    accessors[0]["min"] = np.min([part.means.min(0) for part in rows], 0).tolist()
    accessors[0]["max"] = np.max([part.means.max(0) for part in rows], 0).tolist()
    accessors[1]["normalized"] = True
    own: dict[str, dict] = {EXTENSION: {"kernel": _KERNEL, "colorSpace": _SPACE}}
    if block:
        own[LANGUAGE] = {"bufferView": len(views)}
        views.append({"buffer": 0, "byteOffset": start, "byteLength": block})
        start += block
    attributes = {name: index for index, (name, _, _) in enumerate(columns)}
    return {
        "asset": {"version": "2.0", "generator": "LangFlash"},
        "extensionsUsed": list(own),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "mode": _POINTS, "extensions": own}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": start}],
    }, start


def _column(rows: Rows, index: int) -> bytes:
    """Bytes of one attribute, in the order of `_encode`."""
    if index == 1:
        colours = linear(np.clip(0.5 + SH_C0 * rows.sh[:, 0], 0, 1))
        shown = np.concatenate((colours, rows.opacities[:, None]), 1)
        return np.round(shown * 65535).astype("<u2").tobytes()
    values = (rows.means, None, rows.quats[:, [1, 2, 3, 0]], rows.scales, rows.opacities)
    column = values[index] if index < len(values) else rows.sh[:, index - len(values)]
    return np.ascontiguousarray(column, "<f4").tobytes()
