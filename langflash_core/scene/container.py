"""A scene file as named arrays and strings, found whole or refused. Imports no torch, so that what is
wrong with a file is told at once. The format is described in `file.py`.
"""

import hashlib
import json
import math
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

import numpy as np
import safetensors.numpy
from jaxtyping import Shaped

from langflash_core.base.files import write_atomically
from langflash_core.base.limits import ATOMS, GAUSSIANS, HEADER, VIEWS
from langflash_core.base.memory import check_room
from langflash_core.errors import SceneFileError

FORMAT, VERSION = "langflash-scene", 3
_TYPES = {
    **{f"{kind}{8 * size}": f"<{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)},
    **{f"F{8 * size}": f"<f{size}" for size in (2, 4, 8)},
    "BOOL": "?",
}
"""What safetensors calls the types of numbers, as numpy does."""
_REMEDY = "reconstruct the scene again or copy the whole file"
_FOREIGN = {
    b"\xff\xd8\xff": "a JPEG photo",
    b"\x89PNG": "a PNG picture",
    b"ply": "a PLY file",
    b"PK\x03\x04": "a zip archive or PyTorch checkpoint",
    b"\x1f\x8b": "a gzip archive",
    b"glTF": "a glTF file",
}


@dataclass(frozen=True)
class Container:
    """version: of the format. space, view_size, metadata: as the header has them. arrays: the tensors."""

    version: int
    space: str
    view_size: tuple[int, int]
    metadata: dict
    arrays: dict[str, Shaped[np.ndarray, "..."]]


def read_container(path: Path) -> Container:
    """What a scene file holds, its checksum found right.

    Raises:
        SceneFileError: missing, truncated, damaged, foreign, or of a newer version; says what was
            expected and what was found.
    """
    header, arrays = _read_file(path)
    version = _version(path, header)
    try:
        text = header["scene"]
        if digest(text, arrays) != header["digest"]:
            raise ValueError("its content does not match its checksum")
        described = json.loads(text)
        width, height = (int(side) for side in described["view_size"])
        return Container(
            version, str(described["space"]), (width, height), dict(described["metadata"]), arrays
        )
    except (ValueError, LookupError, TypeError, RuntimeError, ArithmeticError) as error:
        raise damage_error(path, error) from error


def write_container(found: Container, path: Path) -> None:
    """A scene file of the same arrays, bit by bit, and of what else a container says.

    Raises:
        OutputError: the path cannot be written.
    """
    described = {"space": found.space, "view_size": found.view_size, "metadata": found.metadata}
    text = json.dumps(described, allow_nan=False)
    said = {"version": str(found.version), "scene": text, "digest": digest(text, found.arrays)}
    write_atomically(path, in_order(safetensors.numpy.save(found.arrays, {"format": FORMAT, **said})))


def in_order(content: bytes) -> bytes:
    """The same safetensors file with its strings sorted, which its library writes in any order."""
    length = struct.unpack("<Q", content[:8])[0]
    header = json.loads(content[8 : 8 + length])
    header["__metadata__"] = dict(sorted(header["__metadata__"].items()))
    head = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 8)
    return struct.pack("<Q", len(head)) + head + content[8 + length :]


def check_container(path: Path) -> None:
    """Read no more than tells a whole scene file of a known version from everything else.

    Raises:
        SceneFileError: as `read_container`, but for what only the checksum shows.
    """
    _version(path, _read_file(path, whole=False)[0])


def damage_error(path: Path, reason: object) -> SceneFileError:
    """The error that says so."""
    said = " ".join(str(reason).split())[:200]  # errors repeat what a file holds
    return SceneFileError(f"{path.name} is damaged ({said}); {_REMEDY}")


def digest(text: str, arrays: Mapping[str, Shaped[np.ndarray, "..."]]) -> str:
    """SHA-256 of the header's JSON and of every array with its name, type (as torch spells it) and shape."""
    total = hashlib.sha256(text.encode())
    for name in sorted(arrays):
        values = arrays[name]
        total.update(f"{name} torch.{values.dtype} {tuple(values.shape)}\n".encode())
        total.update(_bytes_of(np.ascontiguousarray(values)))
    return total.hexdigest()


def _read_file(path: Path, whole: bool = True) -> tuple[dict[str, str], dict[str, Shaped[np.ndarray, "..."]]]:
    """The `__metadata__` strings and, of the whole file, the tensors, after its size was found right."""
    if path.is_dir():
        raise SceneFileError(f"{path} is a folder; name a scene file (.langflash)")
    try:
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size  # of this very file: another may be saved onto its path
            start = stream.read(8)
            length = struct.unpack("<Q", start)[0] if len(start) == 8 else 0
            if length <= size:  # else it is none
                HEADER.check(length, path.name, SceneFileError)
            head = stream.read(length) if 2 <= length <= HEADER.value else b""
            header = _parse_header(path, start + head[:8], head)
            _check_counts(path, header)
            _check_size(path, 8 + length, header, size)
            return header.pop("__metadata__"), _read_arrays(path, stream, header) if whole else {}
    except FileNotFoundError as error:
        remedy = "check the path, or make it with: langflash reconstruct"
        raise SceneFileError(f"scene {path} does not exist; {remedy}") from error
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read ({error.strerror}); check its permissions") from error


def _read_arrays(
    path: Path, stream: BufferedReader, entries: dict[str, dict]
) -> dict[str, Shaped[np.ndarray, "..."]]:
    """The tensors, each into memory of its own while other threads go on: safetensors copies all of them
    under Python's lock, for which frames wait.

    Raises:
        SceneFileError: the header says something else than the bytes, or they do not fit into memory.
    """
    try:
        layout = _layout(entries)
    except (ValueError, LookupError, TypeError, ArithmeticError) as error:
        raise damage_error(path, error) from error
    arrays = {}
    opened = sum(opened_bytes(name, math.prod(shape)) for name, (shape, _) in layout.items())
    check_room(layout["means"][0][0] if "means" in layout else 0, opened, path.name, SceneFileError)
    for name, (shape, kind) in layout.items():
        arrays[name] = np.empty(shape, kind)
        stream.readinto(_bytes_of(arrays[name]))
    return arrays


def _layout(entries: dict[str, dict]) -> dict[str, tuple[tuple[int, ...], np.dtype]]:
    """Shapes and types of the tensors, in the order of the file.

    Raises:
        ValueError, LookupError, TypeError: the header says something else than the bytes.
    """
    layout, end = {}, 0
    for name, entry in sorted(entries.items(), key=lambda pair: pair[1]["data_offsets"]):
        start, stop = (int(offset) for offset in entry["data_offsets"])
        shape, kind = tuple(int(side) for side in entry["shape"]), np.dtype(_TYPES[entry["dtype"]])
        if start != end or min(shape, default=0) < 0 or stop - start != kind.itemsize * math.prod(shape):
            raise ValueError(f"the bytes of {name} are not those of {entry['dtype']} {shape}")
        layout[name], end = (shape, kind), stop
    return layout


_OPENED = {"weight_ids": 8, "view_ids": 8, "levels": 1}
_PHOTO = "photo_"


def opened_bytes(name: str, count: int) -> int:
    """That so many numbers of a field take in an opened scene: float32, numbers of others int64."""
    return count * (1 if name.startswith(_PHOTO) else _OPENED.get(name, 4))


def _bytes_of(values: Shaped[np.ndarray, "..."]) -> memoryview:
    """Those of a contiguous array themselves, no copy."""
    return values.reshape(-1).view(np.uint8).data


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


def _check_counts(path: Path, header: dict) -> None:
    """Raises:
    SceneFileError: it has more of something than is let in, or says nothing about it.
    """
    for name, limit in (("means", GAUSSIANS), ("dictionary", ATOMS), ("viewmats", VIEWS)):
        try:
            count = int(header[name]["shape"][0]) if name in header else 0
        except (ValueError, LookupError, TypeError) as error:
            raise SceneFileError(f"{path.name} is damaged: its {name} have no shape; {_REMEDY}") from error
        limit.check(count, path.name, SceneFileError)


_DIGITS = 9  # of a version; int() itself refuses some thousand with an error of its own


def _version(path: Path, header: dict[str, str]) -> int:
    version = header.get("version", "")
    if not version.isdecimal() or len(version) > _DIGITS or int(version) < 1:
        raise SceneFileError(f"{path.name} is damaged: its version reads {version[:60]!r}; {_REMEDY}")
    if int(version) > VERSION:
        raise SceneFileError(
            f"{path.name} is a scene of format {version}, this program reads format {VERSION}; "
            "update LangFlash"
        )
    return int(version)
