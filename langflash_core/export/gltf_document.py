"""A glTF 2.0 file as such: JSON, buffers, accessors, nodes; what is read is understood or refused by name.

What a file requires (`extensionsRequired`) and this program does not know is refused, as glTF asks for. What
it merely uses may be passed over, for such a file makes sense without it, but where its numbers are not
there: those of a compressed buffer view, or of a buffer that only an extension could fill.

Source: the glTF 2.0 specification, KhronosGroup/glTF, sections 3.6 and 4.4.
"""

import base64
import json
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote_to_bytes

import numpy as np
import torch

from langflash_core.base.limits import HEADER
from langflash_core.errors import SceneFileError
from langflash_core.geometry.quaternions import quats_to_matrices

TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
COMPONENTS = {kind: number for number, kind in TYPES.items()}
_JSON, _BIN = 0x4E4F534A, 0x004E4942  # chunks of a .glb
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
REMEDY = "export it again, or name a .ply"
_MULTIPLYING, _HIDING = "EXT_mesh_gpu_instancing", "KHR_node_visibility"  # what nodes may say
_Rows = slice | np.ndarray


def glb_head(document: dict[str, Any], length: int) -> bytes:
    """What a .glb begins with, up to the first byte of its buffer of `length`, a multiple of four, bytes."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 12 + 8 + len(text) + 8 + length, len(text), _JSON)
    return head + text + struct.pack("<II", length, _BIN)


class Document:
    """A glTF file: its JSON, and numbers out of its buffers, every size checked against the bytes there."""

    def __init__(self, content: bytes, path: Path, known: Sequence[str]):
        """known: extensions that a file may require.

        Raises:
            SceneFileError: it requires another, or is of another version. ValueError: it is damaged.
        """
        self._folder, self._name, self._own = path.parent, path.name, None
        text = self._chunks(content) if content[:4] == b"glTF" else content
        HEADER.check(len(text), path.name, SceneFileError)
        self.json = json.loads(bytes(text))
        self._buffers: dict[int, memoryview] = {}
        self._check(known)

    def _chunks(self, content: bytes) -> memoryview:
        """The JSON chunk; the binary one is kept."""
        version, length = struct.unpack_from("<II", content, 4)
        if version != 2 or length != len(content):
            raise ValueError(f"version {version} of {length:,} bytes, found {len(content):,}")
        view, start, text = memoryview(content), 12, None
        while start + 8 <= len(content):
            size, kind = struct.unpack_from("<II", content, start)
            chunk = view[start + 8 : start + 8 + size]
            if len(chunk) < size:
                raise ValueError(f"a chunk says {size:,} bytes, found {len(chunk):,}")
            if kind == _JSON and text is None:
                text = chunk
            elif kind == _BIN and self._own is None:
                self._own = chunk
            start += 8 + size
        if text is None:
            raise ValueError("it has no JSON")
        return text

    def _check(self, known: Sequence[str]) -> None:
        asset = self.json["asset"]
        needed = str(asset.get("minVersion", asset["version"]))
        if needed.partition(".")[0] != "2" or ("minVersion" in asset and needed != "2.0"):
            raise SceneFileError(f"{self._name} is glTF {needed[:20]}, this program reads 2.0; {REMEDY}")
        unknown = [str(name) for name in self.json.get("extensionsRequired", ()) if name not in known]
        if unknown:
            raise self.refused(f"needs {_list_names(unknown)}, which this program does not know")

    def refused(self, why: str) -> SceneFileError:
        """The sentence about this file; it is whole, and cannot be read here."""
        return SceneFileError(f"{self._name} {why}; save it plain, or name a .ply")

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """An entry of one of the lists.

        Raises:
            ValueError: there is none.
        """
        entries = self.json.get(kind, [])
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise ValueError(f"it names {kind} {str(index)[:20]} of {len(entries)}")
        return entries[index]

    def placed_meshes(self) -> Iterator[tuple[dict[str, Any], dict[str, Any], np.ndarray]]:
        """Each mesh of the scene, its node, and the node's place in the world (4, 4).

        Of all nodes where no scene is named. Those that are said to be hidden stay out, with all below them.
        """
        nodes, scenes = self.json.get("nodes", []), self.json.get("scenes")
        inner = {child for node in nodes for child in node.get("children", ())}
        roots = set(range(len(nodes))) - inner
        shown = self.item("scenes", self.json.get("scene", 0)).get("nodes", ()) if scenes else roots
        queue = [(root, np.eye(4)) for root in shown]
        for _ in range(len(nodes)):
            if not queue:
                return
            index, above = queue.pop()
            node = self.item("nodes", index)
            if not extensions(node).get(_HIDING, {}).get("visible", True):
                continue
            place = above @ _matrix(node)
            queue += [(child, place) for child in node.get("children", ())]
            if "mesh" in node:
                yield self.item("meshes", node["mesh"]), node, place
        if queue:
            raise ValueError("its nodes go round in circles")

    def check_drawn_once(self, mesh: dict[str, Any], node: dict[str, Any]) -> None:
        """Raises SceneFileError: it is bent by joints or targets, or repeated: its numbers alone are another
        thing."""
        weights = node.get("weights") or mesh.get("weights") or ()
        for there, what in (
            ("skin" in node, "a skin"),
            (any(weights), "weights of morph targets"),
            (_MULTIPLYING in extensions(node), _MULTIPLYING),
        ):
            if there:
                raise self.refused(f"has {what} on its Gaussians, which this program does not know")

    def view(self, index: int) -> tuple[memoryview, int]:
        """The bytes of a buffer view, and their stride (0: packed)."""
        described = self.item("bufferViews", index)
        start, size = described.get("byteOffset", 0), described["byteLength"]
        buffer = self._buffer(described["buffer"], list(extensions(described)))
        if min(start, size) < 0 or start + size > len(buffer):
            raise ValueError(f"view {index} ends at byte {start + size:,} of {len(buffer):,}")
        return buffer[start : start + size], described.get("byteStride", 0)

    def count(self, accessor: int) -> int:
        """Rows of an accessor, as many as its bytes have."""
        return len(self._read_buffer(accessor))

    def numbers(self, accessor: int, width: int, some: _Rows) -> np.ndarray:
        """Rows (n, width) float32 of an accessor; normalised integers in [0, 1] or [-1, 1]."""
        values = self.rows(accessor, width, some)
        if values.dtype.kind == "f" or not self.item("accessors", accessor).get("normalized", False):
            return values.astype(np.float32)
        return np.maximum(values / np.float32(np.iinfo(values.dtype).max), -1).astype(np.float32)

    def rows(self, accessor: int, width: int, some: _Rows) -> np.ndarray:
        """Rows (n, width) of an accessor as they are stored, with those that a sparse one replaces."""
        stored = self._read_buffer(accessor)
        if stored.shape[1] != width:
            raise ValueError(f"accessor {accessor} is {stored.shape[1]} wide, expected {width}")
        sparse = self.item("accessors", accessor).get("sparse")
        return stored[some] if sparse is None else self._replace_sparse(stored, sparse, some)

    def _replace_sparse(self, stored: np.ndarray, sparse: dict[str, Any], some: _Rows) -> np.ndarray:
        count, (places, values) = sparse["count"], (sparse["indices"], sparse["values"])
        at = self._array(places["bufferView"], places, places["componentType"], 1, count)[:, 0]
        new = self._array(values["bufferView"], values, stored.dtype, stored.shape[1], count)
        if at.dtype.kind != "u" or (np.diff(at.astype(np.int64)) <= 0).any() or at[-1] >= len(stored):
            raise ValueError("the places of a sparse accessor are not in order")
        asked = np.arange(len(stored))[some] if isinstance(some, slice) else some
        found = np.minimum(np.searchsorted(at, asked), count - 1)
        return np.where((at[found] == asked)[:, None], new[found], stored[some])

    def _read_buffer(self, accessor: int) -> np.ndarray:
        """Rows (count, width) of an accessor's buffer view."""
        described = self.item("accessors", accessor)
        if "bufferView" not in described:
            raise ValueError(f"accessor {accessor} holds no numbers")
        count, width = described["count"], WIDTHS[described["type"]]
        return self._array(described["bufferView"], described, described["componentType"], width, count)

    def _array(
        self, view: int, described: dict[str, Any], kind: int | np.dtype, width: int, count: int
    ) -> np.ndarray:
        """Rows (count, width) in a buffer view, not copied. kind: a key of `TYPES`, or what it stands for."""
        if not isinstance(kind, np.dtype) and kind not in TYPES:
            raise ValueError(f"numbers of type {str(kind)[:20]}, which glTF 2.0 does not know")
        dtype = kind if isinstance(kind, np.dtype) else np.dtype(TYPES[kind])
        content, stride = self.view(view)
        start, row = described.get("byteOffset", 0), dtype.itemsize * width
        stride = stride or row
        if count < 1 or start < 0 or stride < row or start + (count - 1) * stride + row > len(content):
            raise ValueError(f"{count:,} rows of buffer view {view} do not fit into {len(content):,} bytes")
        return np.ndarray((count, width), dtype, content, start, (stride, dtype.itemsize))

    def _buffer(self, index: int, filled_by: Sequence[str]) -> memoryview:
        """The bytes of a buffer. filled_by: extensions that would have them, where it has none itself."""
        described = self.item("buffers", index)
        if index not in self._buffers:
            uri, own = described.get("uri"), self._own if index == 0 else None
            content = own if uri is None else memoryview(self._fetch(uri))
            if content is None:
                names = _list_names([*filled_by, *extensions(described)])
                if names:
                    raise self.refused(f"is compressed ({names}): buffer {index} has no bytes")
                raise ValueError(f"buffer {index} has no bytes")
            self._buffers[index] = content
        content, needed = self._buffers[index], described["byteLength"]
        if len(content) < needed:
            raise ValueError(f"buffer {index} needs {needed:,} bytes, found {len(content):,}")
        return content

    def _fetch(self, uri: str) -> bytes:
        """What an address names: bytes in it, or a file beside this one; percent-encoded as addresses are."""
        if uri[:5].lower() == "data:":
            kind, _, packed = uri.partition(",")
            plain = unquote_to_bytes(packed)
            return base64.b64decode(plain, validate=True) if kind.lower().endswith(";base64") else plain
        place = unquote_to_bytes(uri).decode()
        if "\\" in place or ":" in place or len(PurePosixPath(place).parts) != 1 or place in (".", ".."):
            raise ValueError(f"it names a file elsewhere, {uri[:40]!r}")
        try:
            return (self._folder / place).read_bytes()
        except FileNotFoundError as error:
            why = f"{self._name} keeps its numbers in '{place[:60]}', which is not beside it"
            raise SceneFileError(f"{why}; copy it there") from error


def extensions(described: dict[str, Any]) -> dict[str, Any]:
    """What extensions say of an entry, by their names."""
    return described.get("extensions", {})


def _list_names(names: Sequence[str]) -> str:
    """Names once each, a few, in one line."""
    plain = [" ".join(str(name).split())[:60] for name in dict.fromkeys(names)]
    return ", ".join([*plain[:4], *(["others"] if len(plain) > 4 else [])])


def _matrix(node: dict[str, Any]) -> np.ndarray:
    """A node's own transformation (4, 4)."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = quats_to_matrices(torch.tensor([w, x, y, z], dtype=torch.float64)).numpy()
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
