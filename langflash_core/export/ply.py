"""3D Gaussian Splatting's PLY: x y z, f_dc, f_rest, logit opacity, log scales, rot wxyz.

f_rest is channel-major: f_rest_{c (S - 1) + b - 1} is basis b >= 1 of colour c. Read in either byte
order, with floats of any size, in any order, and with others between them; what else there is,
`ply_numbers.py` has. Written as binary_little_endian float32 with spherical harmonics up to degree 3, the
most that viewers show.
Source: Kerbl et al. 2023 (the layout of point_cloud.ply); Turk 1994 (the PLY format).
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.base.records import Shift
from langflash_core.errors import SceneFileError
from langflash_core.export.antialiased import apply_filter, filter_of, ply_comments, ply_model
from langflash_core.export.language import packed_language, side_car, speaks, with_language
from langflash_core.export.ply_numbers import (
    DC,
    MEANS,
    QUATS,
    SCALES,
    Numbers,
    block,
    missing_fields,
    numbers_of,
    shift_line,
)
from langflash_core.export.ply_numbers import REMEDY as _REMEDY
from langflash_core.export.settings import PLY_TEXT, STORED
from langflash_core.export.stored import ANTIALIASED, Gathering, Rows, logit, parts, to_scene
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.types import Gaussians, Scene

_NORMALS = ("nx", "ny", "nz")
_DEGREES = {0: 0, 9: 1, 24: 2, 45: 3, 72: 4}  # of spherical harmonics, by how many f_rest there are
_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("half", "float16"), "f2"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
HEADER_END = re.compile(rb"\nend_header[ \t]*\r?\n")
_OWN = "stored as logit opacity, log scales"  # a comment that leaves nothing to guess


@dataclass(frozen=True)
class _Layout:
    """Where the Gaussians are in a file: `count` rows of `row`, from byte `start`; `end` of the file."""

    count: int
    row: np.dtype
    start: int
    end: int | None  # not known where lists follow
    own: bool  # written by this program

    @property
    def num_rest(self) -> int:
        return sum(name.startswith("f_rest_") for name in self.row.names or ())


def read_ply(path: Path) -> Scene:
    """A scene from a 3DGS .ply, with the language of the side-car that `write_ply` put beside it.

    Raises:
        SceneFileError: missing, no such PLY, cut off, or without a usable Gaussian.
    """
    with path.open("rb") as stream:
        layout = _read_layout(stream, path.name)
        _check_size(path, layout)
        num_bases, filtered = 1 + layout.num_rest // 3, filter_of(layout.row.names)
        gathering = Gathering(layout.count, num_bases, path.name)
        stream.seek(0)
        head = stream.read(layout.start)
        rows = np.fromfile(stream, layout.row, min(STORED.rows_at_once, layout.count))
        numbers = numbers_of(rows, head, path.name)
        stream.seek(layout.start)
        for first in range(0, layout.count, STORED.rows_at_once):
            rows = np.fromfile(stream, numbers.row, min(STORED.rows_at_once, layout.count - first))
            stored = _columns(rows, num_bases, numbers)
            gathering.add(stored if filtered is None else apply_filter(stored, rows[filtered]))
    model = ANTIALIASED if filtered else ply_model(path)
    scene = _activate_rows(gathering, numbers, path.name, layout, model)
    beside = side_car(path)
    return with_language(scene, beside.read_bytes(), beside.name) if beside.is_file() else scene


def _activate_rows(gathering: Gathering, numbers: Numbers, name: str, layout: _Layout, model: str) -> Scene:
    """The scene of gathered rows. model: as `to_scene` takes it."""
    stored, warnings = gathering.stored(), list(numbers.said)
    known = layout.own or filter_of(layout.row.names) is not None  # whose writers leave nothing to guess
    # As logits, opacities in [0, 1] alone would be 0.5 to 0.73, which no capture has.
    activated = (
        len(stored.opacities) and 0 <= float(stored.opacities.min()) <= float(stored.opacities.max()) <= 1
    )
    logits = known or not activated
    logs = known or not _looks_linear(stored)
    if not logits:
        warnings.append("All opacities lie between 0 and 1, so they are taken as they are, not as logits.")
    if not logs:
        warnings.append("The scales are no logarithms (they would fill the scene); taken as lengths.")
    numbers.complete(stored, name, logs=logs)
    scene = to_scene(gathering, name, warnings, logs=logs, logits=logits, model=model)
    return scene if numbers.shift is None else scene.with_record(shift=numbers.shift)


def write_ply(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene, as viewers of 3D Gaussian Splatting read them; its language beside it.

    Positions of a scene that was shifted are written where they were, as doubles.

    Raises:
        OutputError: the path cannot be written.
    """
    write_atomically(path, _encode(scene.gaussians, scene.record.shift, ply_comments(scene)))
    if speaks(scene):
        write_atomically(side_car(path), packed_language(scene))


def _encode(gaussians: Gaussians, shift: Shift | None, comments: list[str]) -> Iterator[bytes]:
    num_bases = min(gaussians.sh.shape[1], (MAX_SHOWN_DEGREE + 1) ** 2)
    rest = [f"f_rest_{index}" for index in range(3 * (num_bases - 1))]
    names = (*MEANS, *_NORMALS, *DC, *rest, "opacity", *SCALES, *QUATS)
    lines = ["ply", "format binary_little_endian 1.0", f"comment LangFlash: {_OWN}", *comments]
    lines += [] if shift is None else [shift_line(shift)]
    doubles = () if shift is None else MEANS
    properties = (f"property {'double' if name in doubles else 'float'} {name}" for name in names)
    lines += [f"element vertex {len(gaussians)}", *properties, "end_header"]
    yield ("\n".join(lines) + "\n").encode()
    for part in parts(gaussians):
        columns = (
            np.zeros_like(part.means),
            part.sh[:, 0],
            part.sh[:, 1:num_bases].transpose(0, 2, 1).reshape(len(part.means), -1),
            logit(part.opacities)[:, None],
            np.log(part.scales),
            part.quats,
        )
        means = part.means if shift is None else part.means.astype("<f8") + np.array(shift)
        stored = (np.ascontiguousarray(means), np.concatenate(columns, 1, dtype="<f4"))
        yield np.concatenate([values.view(np.uint8) for values in stored], 1).tobytes()


def _read_layout(stream: BinaryIO, name: str) -> _Layout:
    """Where the Gaussians are."""
    order, elements, body, own = read_elements(stream, name)
    before = 0
    for index, (element, count, fields) in enumerate(elements):
        if element == "vertex":
            row = _row(fields, order, name)
            after = [bytes_of(count, fields, order) for _, count, fields in elements[index:]]
            start = body + before
            end = None if None in after else start + sum(size or 0 for size in after)
            return _Layout(count, row, start, end, own)
        size = bytes_of(count, fields, order)
        if size is None:
            raise SceneFileError(f"{name} has lists ({element}) before its points; {_REMEDY}")
        before += size
    raise SceneFileError(f"{name} has no points (element vertex), so no Gaussians; {_REMEDY}")


def read_elements(stream: BinaryIO, name: str) -> tuple[str, list["_Element"], int, bool]:
    """A header: byte order, elements, the byte where they begin, and whether this program wrote it.

    Raises:
        SceneFileError: it is no binary PLY.
    """
    head = stream.read(PLY_TEXT.max_header)
    if not head:
        raise SceneFileError(f"{name} is an empty file; {_REMEDY}")
    if not re.match(rb"ply\s*\n", head):
        raise SceneFileError(f"{name} is not a PLY file, whatever its name says; {_REMEDY}")
    ended = HEADER_END.search(head)
    if ended is None:
        short = len(head) < PLY_TEXT.max_header
        state = "cut off inside its header" if short else "damaged: its header does not end"
        raise SceneFileError(f"{name} is {state}; {_REMEDY}")
    lines = [line.split() for line in head[: ended.start()].decode("latin-1").splitlines()]
    return *_elements(lines, name), ended.end(), _OWN.encode() in head[: ended.start()]


_Element = tuple[str, int, list[tuple[str, str]]]


def _elements(lines: list[list[str]], name: str) -> tuple[str, list[_Element]]:
    """The byte order, and per element its name, count, and (type, name) of each property."""
    order, elements = "", []
    for words in lines[1:]:
        match words:
            case ["format", "ascii", *_]:
                raise SceneFileError(f"{name} is an ascii PLY, this program reads binary ones; {_REMEDY}")
            case ["format", kind, *_] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", element, _] if element in [name for name, *_ in elements]:
                raise SceneFileError(f"{name} has two elements {element}; {_REMEDY}")
            case ["element", element, count] if count.isdecimal() and len(count) <= PLY_TEXT.digits:
                elements.append((element, int(count), []))
            case ["property", "list", *_, field] if elements:
                elements[-1][2].append(("list", field))
            case ["property", kind, field] if elements and kind in _TYPES:
                elements[-1][2].append((_TYPES[kind], field))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise SceneFileError(f"{name} has a header line '{' '.join(words)[:60]}'; {_REMEDY}")
    if not order:
        raise SceneFileError(f"{name} does not say how it is stored (no format line); {_REMEDY}")
    return order, elements


def _row(fields: list[tuple[str, str]], order: str, name: str) -> np.dtype:
    names = [field for _, field in fields]
    lists = [field for kind, field in fields if kind == "list"]
    missing = missing_fields(names)
    num_rest = sum(field.startswith("f_rest_") for field in names)
    if lists:
        raise SceneFileError(f"{name} has a list ({lists[0]}) among the points' numbers; {_REMEDY}")
    if missing:
        kind = "a mesh or point cloud" if "opacity" in missing else "incomplete"
        raise SceneFileError(f"{name} is {kind}: its points have no {', '.join(missing[:3])}; {_REMEDY}")
    if len(set(names)) < len(names):
        raise SceneFileError(f"{name} names a property twice; {_REMEDY}")
    if num_rest not in _DEGREES or any(f"f_rest_{index}" not in names for index in range(num_rest)):
        raise SceneFileError(f"{name} has {num_rest} f_rest, expected 0, 9, 24, 45 or 72; {_REMEDY}")
    return np.dtype([(field, order + kind) for kind, field in fields])


def bytes_of(count: int, fields: list[tuple[str, str]], order: str) -> int | None:
    """Bytes of an element, None where lists make it unknown."""
    if any(kind == "list" for kind, _ in fields):
        return None if count else 0
    return count * sum(np.dtype(order + kind).itemsize for kind, _ in fields)


def _check_size(path: Path, layout: _Layout) -> None:
    if layout.count == 0:
        raise SceneFileError(f"{path.name} holds no Gaussians; {_REMEDY}")
    found, needed = path.stat().st_size, layout.start + layout.count * layout.row.itemsize
    expected = needed if layout.end is None else layout.end
    if found < expected or (layout.end is not None and not only_blanks(path, expected)):
        state = "cut off" if found < expected else "damaged"
        raise SceneFileError(
            f"{path.name} is {state}: {layout.count:,} Gaussians need {expected:,} bytes, "
            f"found {found:,}; {_REMEDY}"
        )


def only_blanks(path: Path, end: int) -> bool:
    """Whether nothing but a little white space, as writers of text leave it, lies behind byte `end`."""
    with path.open("rb") as stream:
        stream.seek(end)
        after = stream.read(PLY_TEXT.blanks + 1)
    return len(after) <= PLY_TEXT.blanks and not after.strip()


def _columns(rows: np.ndarray, num_bases: int, numbers: Numbers) -> Rows:
    """The numbers of structured rows (n,), float32."""
    sh = np.empty((len(rows), num_bases, 3), np.float32)
    sh[:, 0] = numbers.colours(rows)
    if num_bases > 1:
        rest = block(rows, tuple(f"f_rest_{index}" for index in range(3 * (num_bases - 1))))
        sh[:, 1:] = rest.reshape(-1, 3, num_bases - 1).transpose(0, 2, 1)
    opacities = block(rows, ("opacity",))[:, 0]
    return Rows(numbers.means(rows), block(rows, QUATS), numbers.scales(rows), opacities, sh)


def _looks_linear(stored: Rows) -> bool:
    """Whether scales are lengths: all above 0, and as logarithms half would be as wide as the scene."""
    if not len(stored.scales) or float(stored.scales.min()) <= 0:
        return False
    low, high = np.percentile(stored.means, (5, 95), axis=0)
    extent = float(np.linalg.norm(high - low))
    return math.exp(min(float(np.median(stored.scales)), 80.0)) > PLY_TEXT.too_wide * extent
