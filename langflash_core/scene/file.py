"""`scene.langflash`: one safetensors file, no pickle, whole or refused.

The safetensors header's `__metadata__` holds four strings: `format` ("langflash-scene"),
`version` ("2"), `scene` (JSON: space, view_size, metadata) and `digest`, the SHA-256 of the JSON
and of every tensor with its name, type and shape. Tensors: `fields.py`; `metadata`: `record.py`.

Equal scenes give equal bytes: the header is in one order, and nothing of the run that made the
scene is in the file. Version 1 said in its metadata how many Gaussians each view made, where
version 2 has the tensor `view_ids`, and held what the run cost.
"""

import hashlib
import json
import struct
from dataclasses import replace
from pathlib import Path

import safetensors.torch
import torch
from safetensors import SafetensorError
from torch import Tensor

from langflash_core.errors import SceneFileError
from langflash_core.files import write_atomically
from langflash_core.scene.checks import check_scene
from langflash_core.scene.fields import from_fields, to_fields
from langflash_core.scene.record import counts_per_view, from_json, to_json
from langflash_core.types import Scene

FORMAT, VERSION = "langflash-scene", 2
_MAX_HEADER = 64 * 2**20
_REMEDY = "reconstruct the scene again or copy the whole file"
_FOREIGN = {
    b"\xff\xd8\xff": "a JPEG photo",
    b"\x89PNG": "a PNG picture",
    b"ply": "a PLY file",
    b"PK\x03\x04": "a zip archive or PyTorch checkpoint",
    b"\x1f\x8b": "a gzip archive",
    b"glTF": "a glTF file",
}


def save(scene: Scene, path: Path | str) -> None:
    """Write a scene; the file is whole or not there.

    Raises:
        OutputError: the path cannot be written.
        ValueError: the scene is not whole (`check_scene`), or its record is not plain JSON.
    """
    check_scene(scene)
    fields = to_fields(scene)
    described = {
        "space": scene.semantics.space,
        "view_size": scene.view_size,
        "metadata": to_json(scene.record),
    }
    text = json.dumps(described, allow_nan=False)
    header = {"format": FORMAT, "version": str(VERSION), "scene": text, "digest": _digest(text, fields)}
    write_atomically(Path(path), _in_order(safetensors.torch.save(fields, header)))


def _in_order(content: bytes) -> bytes:
    """The same safetensors file with its strings sorted, which its library writes in any order."""
    length = struct.unpack("<Q", content[:8])[0]
    header = json.loads(content[8 : 8 + length])
    header["__metadata__"] = dict(sorted(header["__metadata__"].items()))
    head = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 8)
    return struct.pack("<Q", len(head)) + head + content[8 + length :]


def load(path: Path | str) -> Scene:
    """Read a scene onto the CPU.

    Raises:
        SceneFileError: missing, truncated, damaged, foreign, or of a newer version; says what was
            expected and what was found.
    """
    path = Path(path)
    header, content = _read(path)
    version = header.get("version", "")
    if not version.isdecimal() or int(version) < 1:
        raise SceneFileError(f"{path.name} is damaged: its version reads {version!r}; {_REMEDY}")
    if int(version) > VERSION:
        raise SceneFileError(
            f"{path.name} is a scene of format {version}, this program reads format {VERSION}; "
            "update LangFlash"
        )
    try:
        fields = safetensors.torch.load(content)
        text = header["scene"]
        if _digest(text, fields) != header["digest"]:
            raise ValueError("its content does not match its checksum")
        described = json.loads(text)
        width, height = (int(side) for side in described["view_size"])
        metadata = dict(described["metadata"])
        record = from_json(metadata)
        scene = from_fields(fields, str(described["space"]), (width, height), record)
        if version == "1":
            scene = replace(scene, view_ids=_view_ids(scene, counts_per_view(metadata)))
        check_scene(scene)
    except (SafetensorError, ValueError, LookupError, TypeError, RuntimeError, ArithmeticError) as error:
        raise SceneFileError(f"{path.name} is damaged ({error}); {_REMEDY}") from error
    return scene


def _view_ids(scene: Scene, counts: list[int]) -> Tensor | None:
    """(N,) of Gaussians in the order of the views that made them; None where the counts do not fit."""
    if len(counts) != scene.num_views or sum(counts) != len(scene.gaussians):
        return None
    return torch.arange(len(counts)).repeat_interleave(torch.tensor(counts))


def _read(path: Path) -> tuple[dict[str, str], bytes]:
    """The `__metadata__` strings and the whole file, after its size was found right."""
    if path.is_dir():
        raise SceneFileError(f"{path} is a folder; name a scene file (.langflash)")
    try:
        with path.open("rb") as stream:
            start = stream.read(8)
            length = struct.unpack("<Q", start)[0] if len(start) == 8 else 0
            head = stream.read(length) if 2 <= length <= _MAX_HEADER else b""
            header = _parse_header(path, start + head[:8], head)
            _check_size(path, 8 + length, header, path.stat().st_size)
            return header["__metadata__"], start + head + stream.read()
    except FileNotFoundError as error:
        remedy = "check the path, or make it with: langflash reconstruct"
        raise SceneFileError(f"scene {path} does not exist; {remedy}") from error
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read ({error.strerror}); check its permissions") from error


def _parse_header(path: Path, first: bytes, head: bytes) -> dict:
    if not first:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    if f'"format":"{FORMAT}"'.encode() in head and not head.rstrip().endswith(b"}"):
        raise SceneFileError(f"{path.name} is cut off inside its header; {_REMEDY}")
    try:
        header = json.loads(head)
        strings = header["__metadata__"]
        known = strings["format"] == FORMAT and all(isinstance(text, str) for text in strings.values())
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        known, header = False, {}
    if known:
        return header
    found = next((kind for mark, kind in _FOREIGN.items() if first.startswith(mark)), "something else")
    found = "another safetensors file" if first[8:10] == b'{"' and found == "something else" else found
    raise SceneFileError(
        f"{path.name} is not a LangFlash scene: expected a {FORMAT} file, found {found}; "
        "name a file made by langflash reconstruct"
    )


def _check_size(path: Path, body_start: int, header: dict, found: int) -> None:
    try:
        ends = [int(entry["data_offsets"][1]) for name, entry in header.items() if name != "__metadata__"]
        expected = body_start + max(ends, default=0)
    except (ValueError, LookupError, TypeError) as error:
        raise SceneFileError(f"{path.name} is damaged: its header lists no tensors; {_REMEDY}") from error
    if found != expected:
        kind = "cut off" if found < expected else "damaged"
        raise SceneFileError(f"{path.name} is {kind}: expected {expected} bytes, found {found}; {_REMEDY}")


def _digest(text: str, fields: dict[str, Tensor]) -> str:
    total = hashlib.sha256(text.encode())
    for name in sorted(fields):
        values = fields[name]
        total.update(f"{name} {values.dtype} {tuple(values.shape)}\n".encode())
        total.update(values.flatten().view(torch.uint8).numpy().tobytes() if values.numel() else b"")
    return total.hexdigest()
