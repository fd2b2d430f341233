"""Niantic's .spz, versions 2 to 4: fixed-point numbers, about 20 bytes a Gaussian before compression.

Positions are 24-bit fixed point, log scales 8 bits in steps of 1/16 from -10, opacities 8 bits, colour
8 bits of 0.5 + 0.15 f_dc, spherical harmonics 8 bits of [-1, 1] (written with 5 significant bits in
degree 1 and 4 above, as the format's own writer does). Rotations: versions 3 and 4 store the smallest
three entries of xyzw as sign and 9 bits, version 2 stores x y z as 8 bits each. Versions 2 and 3 are one
gzip stream, version 4 is a zstd stream per attribute behind a plain header.

Axes: right, up, back, unless the extension SPZ_ADOBE_coordinate_system names others. SuperSplat and
splat-transform neither turn nor name them: their numbers are a PLY's, right, down, forward.
Source: nianticlabs/spz (MIT) at 21715c3: README.md, extensions/README.md.
"""

import gzip
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.base.formats import AXES
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export.packing import (
    check_some,
    from_smallest_three,
    has_zstd,
    inflate,
    smallest_three,
    to_bytes,
    transform_rows,
    zstd_inflated,
    zstd_packed,
)
from langflash_core.export.settings import PACKING, SPZ_FORMAT, STORED
from langflash_core.export.stored import ANTIALIASED, PLAIN, Gathering, Rows, parts, to_scene
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.geometry.turning import axes_matrix
from langflash_core.scene.standing import on_its_head
from langflash_core.types import Gaussians, Scene

_MAGIC = b"NGSP"
_HEAD = struct.Struct("<4sIIBBBB")  # magic, version, count, degree, fractional bits, flags, streams
_ZSTD_HEAD = 32  # bytes: the head, the place of the table of contents, 12 spare ones
_SMOOTHED, _EXTENDED = 1, 2  # flags: the scene was antialiased; there are extensions
_AXES_EXTENSION = 0xADBE0003
_COLOUR_SCALE = 0.15  # of harmonics of degree 0, in a byte
_STORED_AXES = "RUB"
_ON_ITS_HEAD = (
    "The scene seems to stand on its head; if SuperSplat or splat-transform wrote it, read it with --axes "
    "rdf."
)
_REMEDY = "export it again, or name a .ply"


@dataclass(frozen=True)
class _Header:
    """What both kinds of file say first; degree 4 may be stored, and is left out."""

    version: int
    count: int
    degree: int
    bits: int
    flags: int
    streams: int

    @property
    def num_shown(self) -> int:
        return (min(self.degree, MAX_SHOWN_DEGREE) + 1) ** 2

    def sizes(self) -> list[int]:
        """Bytes of positions, opacities, colours, scales, rotations and harmonics."""
        rest = 3 * ((self.degree + 1) ** 2 - 1)
        return [self.count * each for each in (9, 1, 3, 3, 3 if self.version == 2 else 4, rest)]


def read_spz(path: Path, *, axes: str | None = None) -> Scene:
    """A scene without language from a .spz.

    Args:
        axes: of `formats.AXES`, of a file that does not name its own; None: the format's.

    Raises:
        SceneFileError: missing, no .spz of these versions, cut off, or without a usable Gaussian; or
            version 4 where no zstd is installed.
    """
    content = path.read_bytes()
    if not content:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    unpack = _unpack_gzip if content[:2] == b"\x1f\x8b" else _unpack_zstd
    header, streams, extensions = unpack(content, path.name)
    named = _named_axes(extensions, path.name)
    matrix = axes_matrix(named or axes or _STORED_AXES).T  # to ours
    gathering = Gathering(header.count, header.num_shown, path.name)
    for first in range(0, header.count, STORED.rows_at_once):
        some = slice(first, first + STORED.rows_at_once)
        gathering.add(transform_rows(_rows(header, streams, some), matrix))
    model = ANTIALIASED if header.flags & _SMOOTHED else PLAIN
    scene = to_scene(gathering, path.name, [], logs=True, logits=False, model=model)
    return scene.with_record(warnings=(*scene.record.warnings, *_of_axes(scene.gaussians, named, axes)))


def write_spz(scene: Scene, path: Path, *, version: int | None = None, axes: str | None = None) -> None:
    """The Gaussians of a scene, in its own order.

    Args:
        version: 2 to 4; None: 4 where zstd is at hand, else 3.
        axes: of `formats.AXES`, which the file then names; None: the format's own, which it does not.

    Raises:
        OutputError: nothing to write, a Gaussian too far away for the format, no zstd for version 4, or
            an unwritable path.
    """
    check_some(scene.gaussians, path)
    if version is None:
        version = 4 if has_zstd() else 3
    header, streams = _encode(scene.gaussians, version, path.name, axes or _STORED_AXES)
    extensions = struct.pack("<III", _AXES_EXTENSION, 4, AXES.index(axes) + 1) if axes else b""
    flags = _SMOOTHED * scene.record.antialiased | _EXTENDED * bool(extensions)
    fields = (header.version, header.count, header.degree, header.bits, flags)
    if version < 4:
        plain = _HEAD.pack(_MAGIC, *fields, 0) + b"".join(streams) + extensions
        return write_atomically(path, gzip.compress(plain, mtime=0))
    streams = [stream for stream in streams if stream]
    packed = [zstd_packed(stream) for stream in streams]
    table = b"".join(struct.pack("<QQ", len(p), len(s)) for p, s in zip(packed, streams, strict=True))
    head = _HEAD.pack(_MAGIC, *fields, len(streams)) + struct.pack("<I12x", _ZSTD_HEAD + len(extensions))
    write_atomically(path, [head, extensions, table, *packed])


def _unpack_gzip(content: bytes, name: str) -> tuple[_Header, list[bytes], bytes]:
    """Header, attribute streams and extensions of version 2 or 3."""
    head = inflate(content, _HEAD.size, name, wbits=31)
    header = _header(head, name, (2, 3))
    needed = sum(header.sizes())
    _check_shrinking(needed, len(content), name)
    after = SPZ_FORMAT.most_extensions if header.flags & _EXTENDED else 1  # 1: so a missing end shows
    plain = inflate(content, _HEAD.size + needed + after, name, wbits=31)
    if len(plain) < _HEAD.size + needed:
        raise SceneFileError(
            f"{name} is cut off: {header.count:,} Gaussians need {_HEAD.size + needed:,} bytes unpacked, "
            f"found {len(plain):,}; {_REMEDY}"
        )
    streams, start = [], _HEAD.size
    for size in header.sizes():
        streams.append(plain[start : start + size])
        start += size
    return header, streams, plain[start:]


def _unpack_zstd(content: bytes, name: str) -> tuple[_Header, list[bytes], bytes]:
    """Header, attribute streams and extensions of version 4."""
    header = _header(content, name, (4,))
    sizes = [size for size in header.sizes() if size]
    table = int.from_bytes(content[_HEAD.size : _HEAD.size + 4], "little")
    start = table + 16 * len(sizes)
    if header.streams != len(sizes) or table < _ZSTD_HEAD or start > len(content):
        raise SceneFileError(f"{name} is cut off or damaged: its table of contents does not fit; {_REMEDY}")
    _check_shrinking(sum(sizes), len(content), name)
    streams = []
    for (packed, said), size in zip(struct.iter_unpack("<QQ", content[table:start]), sizes, strict=True):
        if said != size or start + packed > len(content):
            raise SceneFileError(f"{name} is cut off or damaged: a stream of it does not fit; {_REMEDY}")
        streams.append(zstd_inflated(content[start : start + packed], size, name))
        start += packed
    streams += [b""] * (len(header.sizes()) - len(streams))
    return header, streams, content[_ZSTD_HEAD:table] if header.flags & _EXTENDED else b""


def _header(head: bytes, name: str, versions: tuple[int, ...]) -> _Header:
    """Raises SceneFileError: it is no .spz header of these versions, or one of no Gaussians."""
    if len(head) < _HEAD.size or head[:4] != _MAGIC:
        raise SceneFileError(f"{name} is not a .spz file, whatever its name says; {_REMEDY}")
    header = _Header(*_HEAD.unpack(head[: _HEAD.size])[1:])
    if header.degree > 4 or header.bits > 24:
        found = f"harmonics of degree {header.degree}, {header.bits} bits of fraction"
        raise SceneFileError(f"{name} is damaged: {found}; {_REMEDY}")
    if not header.count:
        raise SceneFileError(f"{name} holds no Gaussians; {_REMEDY}")
    if header.version not in versions:
        raise SceneFileError(
            f"{name} is a .spz of version {header.version}, this program reads 2 to 4; {_REMEDY}"
        )
    return header


def _check_shrinking(needed: int, found: int, name: str) -> None:
    """Raises SceneFileError: no packer could have made so much so small."""
    if needed > PACKING.most_shrinking * found:
        raise SceneFileError(
            f"{name} is damaged: it says to hold {needed:,} bytes and has {found:,}; {_REMEDY}"
        )


def _named_axes(extensions: bytes, name: str) -> str | None:
    """The axes that the records of an extension area name."""
    start = 0
    while start + 8 <= len(extensions):
        kind, size = struct.unpack_from("<II", extensions, start)
        value = extensions[start + 8 : start + 8 + size]
        if len(value) < size:
            raise SceneFileError(f"{name} has an extension {kind:#x} of {size:,} bytes, cut off; {_REMEDY}")
        number = int.from_bytes(value[:4], "little")
        if kind == _AXES_EXTENSION and (size != 4 or number > len(AXES)):
            raise SceneFileError(f"{name} names axes {number}, this program knows 1 to 16; {_REMEDY}")
        if kind == _AXES_EXTENSION and number:  # 0: unspecified
            return AXES[number - 1]
        start += 8 + size
    return None


def _of_axes(gaussians: Gaussians, named: str | None, told: str | None) -> list[str]:
    """What is to be said of the axes that a file was read by."""
    if named and told and named != told:
        return [f"The file names its own axes, {named}, and was read by those, not by {told}."]
    return [_ON_ITS_HEAD] if not named and not told and on_its_head(gaussians) else []


def _rows(header: _Header, streams: list[bytes], some: slice) -> Rows:
    """Some Gaussians in the file's axes: log scales, opacities in [0, 1]."""
    places, opacities, colours, scales, quats, rest = (
        np.frombuffer(stream, np.uint8).reshape(header.count, -1)[some] for stream in streams
    )
    sh = np.empty((len(places), header.num_shown, 3), np.float32)
    sh[:, 0] = (colours / np.float32(255) - 0.5) / _COLOUR_SCALE
    sh[:, 1:] = (rest.reshape(len(places), -1, 3)[:, : header.num_shown - 1] - np.float32(128)) / 128
    return Rows(
        _fixed_point(places) / np.float32(1 << header.bits),
        _first_three(quats) if header.version == 2 else _signed_three(quats),
        scales / np.float32(16) - 10,
        opacities[:, 0] / np.float32(255),
        sh,
    )


def _fixed_point(places: np.ndarray) -> np.ndarray:
    """Signed integers (n, 3) float32 of little-endian bytes (n, 9): exact, they have 24 bits."""
    low, middle, high = places.reshape(len(places), 3, 3).transpose(2, 0, 1).astype(np.int32)
    whole = low | middle << 8 | high << 16
    return (whole - ((whole & 0x800000) << 1)).astype(np.float32)


def _first_three(stored: np.ndarray) -> np.ndarray:
    """wxyz of x y z in 8 bits each."""
    xyz = stored / np.float32(127.5) - 1
    w = np.sqrt(np.maximum(0, 1 - (xyz**2).sum(1, keepdims=True)))
    return np.concatenate((w, xyz), 1, dtype=np.float32)


def _signed_three(stored: np.ndarray) -> np.ndarray:
    """wxyz of the smallest three of xyzw, each a sign and 9 bits, the first uppermost."""
    words = np.ascontiguousarray(stored).view("<u4")[:, 0]
    fields = words[:, None] >> np.array([20, 10, 0], np.uint32)
    sizes = (fields & 511) / np.float32(511) * np.float32(np.sqrt(0.5))
    xyzw = from_smallest_three(words >> 30, np.where(fields & 512, -sizes, sizes))
    return xyzw[:, [3, 0, 1, 2]]


def _encode(gaussians: Gaussians, version: int, name: str, axes: str) -> tuple[_Header, list[bytes]]:
    """Header and attribute streams."""
    furthest = float(gaussians.means.abs().max())
    if furthest >= 1 << 23:
        raise OutputError(
            f"cannot write {name}: a Gaussian lies {furthest:.3g} away, a .spz ends at {1 << 23:,}; "
            "remove it, or name a .ply"
        )
    finest = range(SPZ_FORMAT.most_bits, -1, -1)
    bits = next(b for b in finest if round(furthest * (1 << b)) < 1 << 23 or not b)
    degree = min(int(gaussians.sh.shape[1] ** 0.5) - 1, MAX_SHOWN_DEGREE)
    header = _Header(version, len(gaussians), degree, bits, 0, 0)
    matrix, columns = axes_matrix(axes), []
    for part in parts(gaussians):
        columns.append(_columns(transform_rows(part, matrix), version, bits))
    return header, [b"".join(pieces) for pieces in zip(*columns, strict=True)]


def _columns(rows: Rows, version: int, bits: int) -> tuple[bytes, ...]:
    """Rows in the file's axes as bytes of each attribute."""
    whole = np.clip(np.round(rows.means.astype(np.float64) * (1 << bits)), -(1 << 23), (1 << 23) - 1)
    places = whole.astype("<i4").view(np.uint8).reshape(-1, 4)[:, :3]
    sh = np.round(rows.sh[:, 1:] * np.float32(128)) + 128
    steps = np.where(np.arange(sh.shape[1]) < 3, *SPZ_FORMAT.sh_steps)[:, None]
    # The lowest bits are zero for the packer's sake; 0 stays 128.
    rest = np.clip((sh + steps // 2) // steps * steps, 0, 255)
    upright = np.where(rows.quats[:, :1] < 0, -rows.quats, rows.quats)
    return (
        places.tobytes(),
        to_bytes(rows.opacities * 255).tobytes(),
        to_bytes((rows.sh[:, 0] * _COLOUR_SCALE + 0.5) * 255).tobytes(),
        to_bytes((np.log(rows.scales) + 10) * 16).tobytes(),
        to_bytes(upright[:, 1:] * 127.5 + 127.5).tobytes() if version == 2 else _signed_words(rows.quats),
        rest.astype(np.uint8).tobytes(),
    )


def _signed_words(quats: np.ndarray) -> bytes:
    largest, others = smallest_three(quats[:, [1, 2, 3, 0]])
    sizes = np.round(np.abs(others) * (511 * np.sqrt(2))).astype(np.uint32)
    fields = np.minimum(sizes, 511) | np.where(others < 0, 512, 0).astype(np.uint32)
    words = largest.astype(np.uint32) << 30 | fields[:, 0] << 20 | fields[:, 1] << 10 | fields[:, 2]
    return words.astype("<u4").tobytes()
