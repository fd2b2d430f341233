"""Reading of GaussianSplats3D's .ksplat: sections of Gaussians, whole or compressed to 1/2 or less.

A header of 4096 bytes, a header of 1024 for each section that there is room for, then the sections:
for levels 1 and 2 the centres of their buckets (cubes that the positions are relative to, 16 bits an
axis) and the Gaussians in the order of their buckets, full ones first. Scales are lengths, rotations
wxyz, colour and opacity 8 bits each; harmonics are colour-major within a degree, and 32, 16 or 8 bits.

Source: mkkellogg/GaussianSplats3D (MIT), the layout in src/loaders/SplatBuffer.js.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from langflash_core.errors import SceneFileError
from langflash_core.export.settings import STORED
from langflash_core.export.stored import Gathering, Rows, to_scene
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.types import Scene

_MAIN = struct.Struct("<BBxxII4xIH14xff")  # version, sections room and used, count, level, range of SH
_PART = struct.Struct("<IIIIfHxxI4xIIH")
_HEADER, _SECTION_HEADER = 4096, 1024  # bytes
_SH_RANGE = 1.5  # of 8-bit harmonics, where the header says 0
_STEPS = (1, 32767, 32767)  # of half a bucket, by the level of compression, where the section says 0
_REMEDY = "export it again, or name a .ply"


@dataclass(frozen=True)
class _Section:
    """One section's header, and where its parts begin in the file."""

    count: int
    room: int
    capacity: int  # Gaussians in a full bucket
    buckets: int
    side: float  # of a bucket
    bucket_bytes: int
    steps: int
    full: int
    partial: int
    degree: int
    start: int

    @property
    def rows_start(self) -> int:
        return self.start + 4 * self.partial + self.bucket_bytes * self.buckets


def read_ksplat(path: Path) -> Scene:
    """A scene without language from a .ksplat.

    Raises:
        SceneFileError: missing, something else, of a newer version, cut off, or without a usable Gaussian.
    """
    size = path.stat().st_size
    if not size:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    if size < _HEADER:
        raise SceneFileError(f"{path.name} is cut off or no .ksplat file; {_REMEDY}")
    with path.open("rb") as stream:
        major, minor, room, used, count, level, *limits = _MAIN.unpack(stream.read(_MAIN.size))
        if (major, minor > 0) != (0, True) or level > 2 or used > room:
            found = f"version {major}.{minor}, compressed {level}"
            read = "this program reads version 0.1, compressed 0 to 2"
            raise SceneFileError(f"{path.name} is no .ksplat, or one of {found}, {read}; {_REMEDY}")
        if _HEADER + room * _SECTION_HEADER > size:
            raise SceneFileError(f"{path.name} is cut off: {room:,} sections have no room in it; {_REMEDY}")
        stream.seek(_HEADER)
        sections = _sections(stream.read(room * _SECTION_HEADER), room, level, size, path.name)
        if not count or count != sum(section.count for section in sections):
            raise SceneFileError(f"{path.name} holds no Gaussians, or not as many as it says; {_REMEDY}")
        low, high = limits[0] or -_SH_RANGE, limits[1] or _SH_RANGE
        num_bases = (max(section.degree for section in sections) + 1) ** 2
        gathering = Gathering(count, num_bases, path.name)
        for section in sections:
            for rows in _rows(stream, section, level, (low, high), num_bases):
                gathering.add(rows)
    return to_scene(gathering, path.name, [], logs=False, logits=False)


def _sections(headers: bytes, room: int, level: int, size: int, name: str) -> list[_Section]:
    """Raises SceneFileError: one does not fit into the file."""
    sections, start = [], _HEADER + room * _SECTION_HEADER
    for index in range(room):
        if not any(headers[index * _SECTION_HEADER : (index + 1) * _SECTION_HEADER]):
            continue  # room that was not needed
        values = _PART.unpack_from(headers, index * _SECTION_HEADER)
        count, most, capacity, buckets, side, bucket_bytes, steps, full, partial, degree = values
        steps = steps or _STEPS[level]
        section = _Section(
            count, most, capacity, buckets, side, bucket_bytes, steps, full, partial, degree, start
        )
        if degree > 3:
            raise SceneFileError(
                f"{name} has harmonics of degree {degree}, this program reads 0 to 3; {_REMEDY}"
            )
        if count > most or full + partial > buckets or (level and bucket_bytes != 12):
            raise SceneFileError(f"{name} is damaged: section {index} contradicts itself; {_REMEDY}")
        start = section.rows_start + most * _row(level, degree).itemsize
        if start > size:
            raise SceneFileError(
                f"{name} is cut off: section {index} ends at byte {start:,} of {size:,}; {_REMEDY}"
            )
        sections.append(section)
    return sections


def _row(level: int, degree: int) -> np.dtype:
    place, number, harmonic = (("<f4", "<f4", "<f4"), ("<u2", "<f2", "<f2"), ("<u2", "<f2", "u1"))[level]
    return np.dtype(
        [
            ("mean", place, 3),
            ("scale", number, 3),
            ("quat", number, 4),
            ("rgba", "u1", 4),
            ("rest", harmonic, (3 * ((degree + 1) ** 2 - 1),)),
        ]
    )


def _rows(stream, section: _Section, level: int, limits: tuple[float, float], num_bases: int):
    """The Gaussians of a section, some at a time."""
    centres = _centres(stream, section) if level else None
    row = _row(level, section.degree)
    stream.seek(section.rows_start)
    for first in range(0, section.count, STORED.rows_at_once):
        rows = np.fromfile(stream, row, min(STORED.rows_at_once, section.count - first))
        means = rows["mean"].astype(np.float32)
        if centres is not None:
            own = centres[first : first + len(rows)]
            means = (means - section.steps) * np.float32(section.side / 2 / section.steps) + own
        colours = rows["rgba"].astype(np.float32) / 255
        sh = np.zeros((len(rows), num_bases, 3), np.float32)
        sh[:, 0] = (colours[:, :3] - 0.5) / SH_C0
        _fill_rest(sh, rows["rest"], section.degree, limits if level == 2 else None)
        quats, scales = rows["quat"].astype(np.float32), rows["scale"].astype(np.float32)
        yield Rows(means, quats, scales, colours[:, 3], sh)


def _centres(stream, section: _Section) -> np.ndarray:
    """The centre (count, 3) of the bucket that each Gaussian of a section lies in."""
    stream.seek(section.start)
    sizes = np.fromfile(stream, "<u4", section.partial)
    centres = np.fromfile(stream, "<f4", 3 * section.buckets).reshape(-1, 3)
    ends = np.cumsum(np.concatenate((np.full(section.full, section.capacity), sizes)).astype(np.uint64))
    # The last bucket takes what a header that counts too few leaves over; without any all are at 0.
    if not len(ends) or not len(centres):
        return np.zeros((section.count, 3), np.float32)
    places = np.searchsorted(ends, np.arange(section.count, dtype=np.uint64), side="right")
    return centres[np.minimum(places, len(ends) - 1)]


def _fill_rest(sh: np.ndarray, rest: np.ndarray, degree: int, limits: tuple[float, float] | None) -> None:
    """Degrees above 0 into sh (n, S, 3), from numbers that are colour-major within each degree."""
    values = rest.astype(np.float32)
    if limits is not None:
        values = limits[0] + values / 255 * (limits[1] - limits[0])
    for each in range(1, degree + 1):
        first, bases = each**2 - 1, 2 * each + 1
        block = values[:, 3 * first : 3 * (first + bases)].reshape(-1, 3, bases)
        sh[:, first + 1 : first + 1 + bases] = block.transpose(0, 2, 1)
