"""SuperSplat's compressed PLY: 16 bytes a Gaussian, relative to the bounds of its chunk of 256.

Element `chunk` holds 18 floats: lowest and highest position, log scale and colour (0.5 + SH_C0 f_dc)
of 256 Gaussians. Element `vertex` holds four words: position and log scale as 11, 10 and 11 bits
between those bounds, rotation as the place of the largest of wxyz in 2 bits and the other three in 10
bits each, colour and opacity as 8 bits each. Element `sh`, where there is one, holds f_rest_* in the
order of an ordinary PLY, 8 bits of [-4, 4].

Written along a Z curve, so that chunks are small; bounds must not be wide. Source: the layout as
SuperSplat and splat-transform (both MIT, PlayCanvas) write it.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.errors import SceneFileError
from langflash_core.export.antialiased import ply_comments, ply_model
from langflash_core.export.packing import check_some, from_smallest_three, morton_order, smallest_three
from langflash_core.export.ply import HEADER_END, bytes_of, only_blanks, read_elements, read_ply
from langflash_core.export.settings import CHUNKS
from langflash_core.export.stored import Gathering, Rows, parts, to_scene
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE, SH_C0
from langflash_core.types import Gaussians, Scene

_BOUNDS = tuple(
    f"{end}_{name}"
    for names in (("x", "y", "z"), ("scale_x", "scale_y", "scale_z"), ("r", "g", "b"))
    for end in ("min", "max")
    for name in names
)
_WORDS = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
_ELEMENTS = ("chunk", "vertex", "sh")
_CHUNK = 256  # Gaussians
_SH_SPAN = 8.0  # width of the range of harmonics
_DEGREES = {0: 0, 9: 1, 24: 2, 45: 3}  # by how many f_rest there are
_MARK = re.compile(rb"\nproperty\s+\S+\s+packed_position(?!\S)")
_REMEDY = "save it again, or name an uncompressed .ply"
_Place = tuple[int, int, np.dtype]  # of an element: its first byte, its rows, their type


def is_compressed(path: Path) -> bool:
    """Whether the header of a .ply declares packed numbers."""
    with path.open("rb") as stream:
        return _MARK.search(HEADER_END.split(stream.read(1 << 16), maxsplit=1)[0]) is not None


def read_compressed_ply(path: Path) -> Scene:
    """A scene without language from a compressed PLY.

    Raises:
        SceneFileError: missing, cut off, contradictory, or without a usable Gaussian.
    """
    with path.open("rb") as stream:
        order, elements, start, _ = read_elements(stream, path.name)
        places: dict[str, _Place] = {}
        for name, count, fields in elements:
            size = bytes_of(count, fields, order)
            if size is None or len({field for _, field in fields}) < len(fields):
                raise SceneFileError(f"{path.name} has an element {name} that is not plain; {_REMEDY}")
            if name in _ELEMENTS:
                row = np.dtype([(field, order + kind) for kind, field in fields])
                places[name] = (start, count, row)
            start += size
        found = path.stat().st_size
        if found < start or not only_blanks(path, start):
            state = "cut off" if found < start else "damaged"
            raise SceneFileError(
                f"{path.name} is {state}: it needs {start:,} bytes, found {found:,}; {_REMEDY}"
            )
        num_rest = _check_elements(places, path.name)
        count = places["vertex"][1]
        gathering = Gathering(count, 1 + num_rest // 3, path.name)
        for first in range(0, count, CHUNKS.at_once * _CHUNK):
            gathering.add(_rows(stream, places, first, num_rest))
    return to_scene(gathering, path.name, [], logs=True, logits=False, model=ply_model(path))


def write_compressed_ply(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene, along a Z curve.

    Raises:
        OutputError: there is nothing to write, or the path cannot be written.
    """
    check_some(scene.gaussians, path)
    write_atomically(path, _encode(scene.gaussians, ply_comments(scene)))


def _check_elements(places: dict[str, _Place], name: str) -> int:
    """How many f_rest there are."""
    empty = (0, 0, np.dtype([]))
    (_, chunks, bounds), (_, count, words) = places.get("chunk", empty), places.get("vertex", empty)
    _, rest_count, rest = places.get("sh", empty)
    if not count:
        raise SceneFileError(f"{name} holds no Gaussians; {_REMEDY}")
    missing = [field for field in _BOUNDS[:12] if field not in (bounds.names or ())]
    missing += [field for field in _WORDS if field not in (words.names or ())]
    if missing:
        raise SceneFileError(f"{name} is incomplete: it has no {', '.join(missing[:3])}; {_REMEDY}")
    harmonics = [field for field in rest.names or () if field.startswith("f_rest_")]
    for row, fields, kind in ((bounds, _BOUNDS, "f4"), (words, _WORDS, "u4"), (rest, harmonics, "u1")):
        other = [field for field in fields if field in (row.names or ()) and row[field].str[1:] != kind]
        if other:
            found = f"{other[0]} as {row[other[0]].name}"
            raise SceneFileError(f"{name} stores {found}, expected {np.dtype(kind).name}; {_REMEDY}")
    num_rest = len(harmonics)
    names_hold = all(f"f_rest_{index}" in (rest.names or ()) for index in range(num_rest))
    if num_rest not in _DEGREES or not names_hold or (num_rest and rest_count != count):
        raise SceneFileError(f"{name} has harmonics that do not fit its Gaussians; {_REMEDY}")
    if chunks != -(-count // _CHUNK):
        raise SceneFileError(f"{name} has {chunks:,} chunks for {count:,} Gaussians; {_REMEDY}")
    return num_rest


def _rows(stream, places: dict[str, _Place], first: int, num_rest: int) -> Rows:
    """`CHUNKS.at_once` chunks of Gaussians: log scales, opacities in [0, 1]."""

    def some(name: str, skip: int, most: int) -> np.ndarray:
        start, count, row = places[name]
        stream.seek(start + skip * row.itemsize)
        return np.fromfile(stream, row, min(most, count - skip))

    words = some("vertex", first, CHUNKS.at_once * _CHUNK)
    chunks = some("chunk", first // _CHUNK, CHUNKS.at_once)
    own = np.arange(len(words)) // _CHUNK

    def between(names: tuple[str, ...], shares: np.ndarray) -> np.ndarray:
        low, high = (np.stack([chunks[name] for name in part], 1)[own] for part in (names[:3], names[3:]))
        return (low + shares * (high - low)).astype(np.float32)

    quats = _fields(words["packed_rotation"], (20, 10, 0), (10, 10, 10))
    colours = _fields(words["packed_color"], (24, 16, 8, 0), (8, 8, 8, 8))
    coloured = all(name in (chunks.dtype.names or ()) for name in _BOUNDS[12:])
    sh = np.empty((len(words), 1 + num_rest // 3, 3), np.float32)
    sh[:, 0] = ((between(_BOUNDS[12:], colours[:, :3]) if coloured else colours[:, :3]) - 0.5) / SH_C0
    if num_rest:
        stored = some("sh", first, CHUNKS.at_once * _CHUNK)
        rest = np.stack([stored[f"f_rest_{index}"] for index in range(num_rest)], 1).astype(np.float32)
        centred = np.where(rest == 0, 0, np.where(rest == 255, 1, (rest + 0.5) / 256)) - 0.5
        sh[:, 1:] = (centred * _SH_SPAN).reshape(len(words), 3, -1).transpose(0, 2, 1)
    return Rows(
        between(_BOUNDS[:6], _fields(words["packed_position"], (21, 11, 0), (11, 10, 11))),
        from_smallest_three(words["packed_rotation"] >> 30, (quats - 0.5) * np.sqrt(2)),
        between(_BOUNDS[6:12], _fields(words["packed_scale"], (21, 11, 0), (11, 10, 11))),
        colours[:, 3].astype(np.float32),
        sh,
    )


def _fields(words: np.ndarray, shifts: tuple[int, ...], bits: tuple[int, ...]) -> np.ndarray:
    """Fractions (n, k) in [0, 1] of the bit fields of words (n,)."""
    tops = (1 << np.array(bits, np.uint32)) - 1
    return ((words[:, None].astype(np.uint32) >> np.array(shifts, np.uint32)) & tops) / tops


def _encode(gaussians: Gaussians, comments: list[str]) -> Iterator[bytes]:
    num_bases = min(gaussians.sh.shape[1], (MAX_SHOWN_DEGREE + 1) ** 2)
    count, num_rest = len(gaussians), 3 * (num_bases - 1)
    order = morton_order(gaussians.means.detach().cpu().double().numpy())
    bounds, words, rest = [], [], []
    for part in parts(gaussians.map(lambda values: values.detach().cpu()[order])):
        for first in range(0, len(part.means), _CHUNK):
            low_high, packed = _pack_chunk(part.some(slice(first, first + _CHUNK)))
            bounds.append(low_high)
            words.append(packed)
        flat = part.sh[:, 1:num_bases].transpose(0, 2, 1).reshape(len(part.means), num_rest)
        rest.append(np.clip(np.trunc((flat / _SH_SPAN + 0.5) * 256), 0, 255).astype(np.uint8).tobytes())
    lines = ["ply", "format binary_little_endian 1.0", "comment LangFlash", *comments]
    lines += [f"element chunk {len(bounds)}"]
    lines += [f"property float {name}" for name in _BOUNDS]
    lines += [f"element vertex {count}", *(f"property uint {name}" for name in _WORDS)]
    if num_rest:
        lines += [f"element sh {count}", *(f"property uchar f_rest_{index}" for index in range(num_rest))]
    yield ("\n".join([*lines, "end_header"]) + "\n").encode()
    yield from (*bounds, *words, *rest)


def _pack_chunk(rows: Rows) -> tuple[bytes, bytes]:
    """Bounds and words of one chunk."""
    scales = np.clip(np.log(rows.scales), -CHUNKS.widest, CHUNKS.widest)
    low_high, shares = [], []
    for values in (rows.means, scales, 0.5 + SH_C0 * rows.sh[:, 0]):
        low, high = values.min(0).astype("<f4"), values.max(0).astype("<f4")
        low_high += [low, high]
        shares.append((values - low) / np.where(high > low, high - low, 1))
    largest, others = smallest_three(rows.quats)
    colour_fields = np.concatenate((shares[2], rows.opacities[:, None]), 1)
    words = (
        _word(shares[0], (21, 11, 0), (11, 10, 11)),
        _word(others / np.sqrt(2) + 0.5, (20, 10, 0), (10, 10, 10)) | largest.astype(np.uint32) << 30,
        _word(shares[1], (21, 11, 0), (11, 10, 11)),
        _word(colour_fields, (24, 16, 8, 0), (8, 8, 8, 8)),
    )
    return np.concatenate(low_high).tobytes(), np.stack(words, 1).astype("<u4").tobytes()


def _word(shares: np.ndarray, shifts: tuple[int, ...], bits: tuple[int, ...]) -> np.ndarray:
    """Words (n,) of fractions (n, k) in [0, 1]."""
    tops = (1 << np.array(bits)) - 1
    fields = np.clip(np.floor(shares.astype(np.float64) * tops + 0.5), 0, tops).astype(np.uint32)
    return np.bitwise_or.reduce(fields << np.array(shifts, np.uint32), 1)


def read_any_ply(path: Path) -> Scene:
    """A .ply by what its header declares, whatever stands before the suffix.

    Raises:
        SceneFileError: what the reader of its kind finds wrong.
    """
    return read_compressed_ply(path) if is_compressed(path) else read_ply(path)
