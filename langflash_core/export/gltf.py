"""glTF 2.0 with KHR_gaussian_splatting: points whose attributes are Gaussians, all values activated.

POSITION, KHR_gaussian_splatting:ROTATION (xyzw), :SCALE (lengths), :OPACITY, and
:SH_DEGREE_l_COEF_n, float32; COLOR_0 (linear, as glTF wants) for viewers that know no splats. Axes of
glTF are left, up, forward. Written as one .glb; read from .glb and .gltf, with the nodes' rotations,
translations and even scales. Language rides along as LANGFLASH_language (`language.py`) on the
primitive, which others ignore.

Source: KHR_gaussian_splatting, Release Candidate as of 2026-04-15 (KhronosGroup/glTF 63770cc7).
"""

import base64
import binascii
import json
import math
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from langflash_core.errors import SceneFileError
from langflash_core.export.language import packed_language, speaks, with_language
from langflash_core.export.packing import check_some, placed, told, turned
from langflash_core.export.stored import ROWS_AT_ONCE, Gathering, Rows, parts, to_scene
from langflash_core.files import write_atomically
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE, SH_C0
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.geometry.turning import axes_matrix
from langflash_core.limits import HEADER
from langflash_core.types import Gaussians, Scene

EXTENSION, LANGUAGE = "KHR_gaussian_splatting", "LANGFLASH_language"
_AXES = "LUF"
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_FLOAT, _ARRAY_BUFFER, _POINTS = 5126, 34962, 0
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_SPACES = ("srgb_rec709_display", "lin_rec709_display")
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, RecursionError, ArithmeticError, struct.error,
           binascii.Error, OSError)  # fmt: skip
_REMEDY = "export it again, or name a .ply"


def read_gltf(path: Path) -> Scene:
    """The Gaussians of a .glb or .gltf, of all its nodes together; with language where it carries some.

    Raises:
        SceneFileError: missing, damaged, compressed, or without a usable Gaussian.
    """
    content = path.read_bytes()
    if not content:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    try:
        document = _Document(content, path)
        scene, blocks = _gathered(document, path.name)
        block = document.view(blocks[0])[0] if len(blocks) == 1 else b""
    except _DAMAGE as error:
        raise SceneFileError(f"{path.name} is damaged or no glTF ({told(error)}); {_REMEDY}") from error
    return with_language(scene, bytes(block), f"the language in {path.name}") if block else scene


def write_glb(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene, in its own order, and its language.

    Raises:
        OutputError: there is nothing to write, or the path cannot be written.
    """
    check_some(scene.gaussians, path)
    block = packed_language(scene) if speaks(scene) else b""
    write_atomically(path, _encoded(scene.gaussians, block))


def _gathered(document: "_Document", name: str) -> tuple[Scene, list[int]]:
    """The scene of every primitive of splats, and the buffer views with language."""
    found = [
        (primitive, matrix)
        for mesh, matrix in document.placed_meshes()
        for primitive in document.json["meshes"][mesh]["primitives"]
        if EXTENSION in primitive.get("extensions", {})
    ]
    if not found:
        raise SceneFileError(f"{name} holds no Gaussians (no primitive with {EXTENSION}); {_REMEDY}")
    counts = [document.count(primitive["attributes"]["POSITION"]) for primitive, _ in found]
    num_bases = max(_num_bases(primitive["attributes"]) for primitive, _ in found)
    gathering = Gathering(sum(counts), num_bases, name)
    warnings: list[str] = []
    for (primitive, matrix), count in zip(found, counts, strict=True):
        own = primitive["extensions"][EXTENSION]
        if own.get("extensions"):
            raise SceneFileError(f"{name} is compressed ({', '.join(own['extensions'])}); save it plain")
        linear = own.get("colorSpace") == _SPACES[1]
        if own.get("kernel") != "ellipse" or own.get("colorSpace") not in _SPACES:
            warnings.append(f"{name} has Gaussians of an unknown kind; they are drawn as usual ones.")
        for rows in _rows(document, primitive["attributes"], count, num_bases):
            gathering.add(placed(_as_srgb(rows) if linear else rows, matrix, _AXES))
    warnings = list(dict.fromkeys(warnings))
    languages = [p["extensions"][LANGUAGE]["bufferView"] for p, _ in found if LANGUAGE in p["extensions"]]
    return to_scene(gathering, name, warnings, logs=False, logits=False), languages if len(found) == 1 else []


class _Document:
    """A glTF file: its JSON, and numbers out of its buffers, every size checked against the bytes there."""

    def __init__(self, content: bytes, path: Path):
        self._folder, self._own = path.parent, memoryview(b"")
        text: bytes | memoryview = content
        if content[:4] == b"glTF":
            version, length = struct.unpack_from("<II", content, 4)
            if version != 2 or length != len(content):
                raise ValueError(f"version {version} of {length:,} bytes, found {len(content):,}")
            text = self._chunks(content)
        HEADER.check(len(text), path.name, SceneFileError)
        self.json = json.loads(bytes(text))
        self._buffers: dict[int, memoryview] = {}

    def _chunks(self, content: bytes) -> memoryview:
        """The JSON chunk; the binary one is kept."""
        view, start, text = memoryview(content), 12, None
        while start + 8 <= len(content):
            size, kind = struct.unpack_from("<II", content, start)
            chunk = view[start + 8 : start + 8 + size]
            if len(chunk) < size:
                raise ValueError(f"a chunk says {size:,} bytes, found {len(chunk):,}")
            if kind == _JSON and text is None:
                text = chunk
            elif kind == _BIN and not len(self._own):
                self._own = chunk
            start += 8 + size
        if text is None:
            raise ValueError("it has no JSON")
        return text

    def placed_meshes(self) -> Iterator[tuple[int, np.ndarray]]:
        """Each mesh of the scene with its node's place in the world (4, 4); all nodes where none is named."""
        nodes, scenes = self.json.get("nodes", []), self.json.get("scenes")
        inner = {child for node in nodes for child in node.get("children", ())}
        roots = set(range(len(nodes))) - inner
        shown = scenes[self.json.get("scene", 0)]["nodes"] if scenes else roots
        queue = [(root, np.eye(4)) for root in shown]
        for _ in range(len(nodes)):
            if not queue:
                return
            index, above = queue.pop()
            place = above @ _matrix(nodes[index])
            queue += [(child, place) for child in nodes[index].get("children", ())]
            if "mesh" in nodes[index]:
                yield nodes[index]["mesh"], place
        if queue:
            raise ValueError("its nodes go round in circles")

    def view(self, index: int) -> tuple[memoryview, int]:
        """The bytes of a buffer view, and their stride (0: packed)."""
        described = self.json["bufferViews"][index]
        start, size = described.get("byteOffset", 0), described["byteLength"]
        buffer = self._buffer(described["buffer"])
        if min(start, size) < 0 or start + size > len(buffer):
            raise ValueError(f"view {index} ends at byte {start + size:,} of {len(buffer):,}")
        return buffer[start : start + size], described.get("byteStride", 0)

    def count(self, accessor: int) -> int:
        """Rows of an accessor, as many as its bytes have."""
        return len(self._stored(accessor)[0])

    def numbers(self, accessor: int, width: int, some: slice) -> np.ndarray:
        """Rows (n, width) float32 of an accessor."""
        stored, normalised = self._stored(accessor)
        if stored.shape[1] != width:
            raise ValueError(f"accessor {accessor} is {stored.shape[1]} wide, expected {width}")
        values = stored[some]
        if not normalised or values.dtype.kind == "f":
            return values.astype(np.float32)
        return np.maximum(values / np.float32(np.iinfo(values.dtype).max), -1).astype(np.float32)

    def _stored(self, accessor: int) -> tuple[np.ndarray, bool]:
        described = self.json["accessors"][accessor]
        if "sparse" in described:
            raise ValueError(f"accessor {accessor} is sparse")
        dtype, width = np.dtype(_TYPES[described["componentType"]]), _WIDTHS[described["type"]]
        content, stride = self.view(described["bufferView"])
        start, count, row = described.get("byteOffset", 0), described["count"], dtype.itemsize * width
        stride = stride or row
        if count < 1 or start < 0 or stride < row or start + (count - 1) * stride + row > len(content):
            raise ValueError(f"accessor {accessor}, {count:,} rows, does not fit into {len(content):,} bytes")
        strides = (stride, dtype.itemsize)
        rows = np.ndarray((count, width), dtype, content, start, strides)
        return rows, bool(described.get("normalized", False))

    def _buffer(self, index: int) -> memoryview:
        if index not in self._buffers:
            described = self.json["buffers"][index]
            uri = described.get("uri")
            content = self._own if uri is None else memoryview(self._fetched(uri))
            if len(content) < described["byteLength"]:
                needed = described["byteLength"]
                raise ValueError(f"buffer {index} needs {needed:,} bytes, found {len(content):,}")
            self._buffers[index] = content
        return self._buffers[index]

    def _fetched(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(";base64,")[2], validate=True)
        if Path(uri).name != uri:
            raise ValueError(f"it names a file elsewhere, {uri[:40]!r}")
        return (self._folder / uri).read_bytes()


def _matrix(node: dict) -> np.ndarray:
    """A node's own transformation (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = quats_to_matrices(torch.tensor([w, x, y, z], dtype=torch.float64)).numpy()
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _num_bases(attributes: dict) -> int:
    degree = 0
    while degree < MAX_SHOWN_DEGREE and f"{EXTENSION}:SH_DEGREE_{degree + 1}_COEF_0" in attributes:
        degree += 1
    return (degree + 1) ** 2


def _harmonics(num_bases: int) -> list[str]:
    """Attribute names in the order of the bases."""
    degrees = range(math.isqrt(num_bases))
    return [f"{EXTENSION}:SH_DEGREE_{each}_COEF_{n}" for each in degrees for n in range(2 * each + 1)]


def _rows(document: _Document, attributes: dict, count: int, num_bases: int) -> Iterator[Rows]:
    """Rows in the primitive's own axes."""
    names = _harmonics(_num_bases(attributes))
    for first in range(0, count, ROWS_AT_ONCE):
        some = slice(first, min(first + ROWS_AT_ONCE, count))

        def numbers(name: str, width: int, some: slice = some) -> np.ndarray:
            return document.numbers(attributes[name], width, some)

        sh = np.zeros((some.stop - first, num_bases, 3), np.float32)
        for basis, name in enumerate(names):
            sh[:, basis] = numbers(name, 3)
        quats = numbers(f"{EXTENSION}:ROTATION", 4)[:, [3, 0, 1, 2]]
        opacities = numbers(f"{EXTENSION}:OPACITY", 1)[:, 0]
        yield Rows(numbers("POSITION", 3), quats, numbers(f"{EXTENSION}:SCALE", 3), opacities, sh)


def _as_srgb(rows: Rows) -> Rows:
    """Linear colours as sRGB values: the base colour exactly, what depends on direction to first order."""
    base = np.clip(0.5 + SH_C0 * rows.sh[:, :1], 0, None)
    low = base <= 0.0031308
    power = np.maximum(base, 0.0031308)
    slope = np.where(low, 12.92, 1.055 / 2.4 * power ** (1 / 2.4 - 1))
    sh = rows.sh * slope
    sh[:, :1] = (np.where(low, 12.92 * base, 1.055 * power ** (1 / 2.4) - 0.055) - 0.5) / SH_C0
    return Rows(rows.means, rows.quats, rows.scales, rows.opacities, sh.astype(np.float32))


def _linear(colours: np.ndarray) -> np.ndarray:
    """Linear values of sRGB ones in [0, 1]."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


def _encoded(gaussians: Gaussians, block: bytes) -> Iterator[bytes]:
    """The chunks of a .glb; positions need their bounds first, so rows are turned once and kept."""
    num_bases = min(gaussians.sh.shape[1], (MAX_SHOWN_DEGREE + 1) ** 2)
    matrix = axes_matrix(_AXES)
    rows = [turned(part, matrix) for part in parts(gaussians)]
    columns: list[tuple[str, str, int]] = [
        ("POSITION", "VEC3", _FLOAT), ("COLOR_0", "VEC4", 5123), (f"{EXTENSION}:ROTATION", "VEC4", _FLOAT),
        (f"{EXTENSION}:SCALE", "VEC3", _FLOAT), (f"{EXTENSION}:OPACITY", "SCALAR", _FLOAT),
        *((name, "VEC3", _FLOAT) for name in _harmonics(num_bases)),
    ]  # fmt: skip
    document, length = _described(columns, rows, len(gaussians), len(block))
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    padding = b"\0" * (-length % 4)
    total = 12 + 8 + len(text) + 8 + length + len(padding)
    yield struct.pack("<4sIIII", b"glTF", 2, total, len(text), _JSON) + text
    yield struct.pack("<II", length + len(padding), _BIN)
    for index in range(len(columns)):
        yield from (_column(part, index) for part in rows)
    yield block + padding


def _described(
    columns: list[tuple[str, str, int]], rows: list[Rows], count: int, block: int
) -> tuple[dict, int]:
    """The JSON, and the bytes of its buffer."""
    views, accessors, start = [], [], 0
    for index, (_, kind, component) in enumerate(columns):
        size = count * _WIDTHS[kind] * np.dtype(_TYPES[component]).itemsize
        views.append({"buffer": 0, "byteOffset": start, "byteLength": size, "target": _ARRAY_BUFFER})
        accessors.append({"bufferView": index, "componentType": component, "count": count, "type": kind})
        start += size
    accessors[0]["min"] = np.min([part.means.min(0) for part in rows], 0).tolist()
    accessors[0]["max"] = np.max([part.means.max(0) for part in rows], 0).tolist()
    accessors[1]["normalized"] = True
    own: dict[str, dict] = {EXTENSION: {"kernel": "ellipse", "colorSpace": _SPACES[0]}}
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
    """Bytes of one attribute, in the order of `_encoded`."""
    if index == 1:
        colours = _linear(np.clip(0.5 + SH_C0 * rows.sh[:, 0], 0, 1))
        shown = np.concatenate((colours, rows.opacities[:, None]), 1)
        return np.round(shown * 65535).astype("<u2").tobytes()
    values = (rows.means, None, rows.quats[:, [1, 2, 3, 0]], rows.scales, rows.opacities)
    column = values[index] if index < len(values) else rows.sh[:, index - len(values)]
    return np.ascontiguousarray(column, "<f4").tobytes()
