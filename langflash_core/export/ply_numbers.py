"""How the numbers of a .ply are meant where its header alone does not say it.

Halves: whole numbers have no scale in a .ply, so whole positions, scales or rotations mean nothing; some
exporters write half floats and call them ushort. Flat: 2D Gaussian Splatting has no third scale. Plain
colours: red, green, blue instead of f_dc. Shifted: surveyed positions are doubles far from 0, of which
float32 keeps half a metre; a whole number is taken off them, and put back by `write_ply`.
Source: BabylonJS/Babylon.js#18816 (halves as ushort), playcanvas/supersplat (flat ones, log(1e-6)), and
nerfstudio's `--ply-color-mode rgb`.
"""

import math
import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured

from langflash_core.base.records import Shift, told_shift
from langflash_core.errors import SceneFileError
from langflash_core.export.antialiased import filter_of
from langflash_core.export.settings import PLY_NUMBERS
from langflash_core.export.stored import Rows
from langflash_core.geometry.harmonics import SH_C0

MEANS = ("x", "y", "z")
DC = ("f_dc_0", "f_dc_1", "f_dc_2")
SCALES = ("scale_0", "scale_1", "scale_2")
QUATS = ("rot_0", "rot_1", "rot_2", "rot_3")
REMEDY = "export it again as a binary 3D Gaussian Splatting .ply"

_OWN = frozenset((*MEANS, *DC, "opacity", *SCALES, *QUATS, "filter_3D"))
_RGB = ("red", "green", "blue")
_TOLD = re.compile(rb"\ncomment LangFlash: shift (\S+) (\S+) (\S+)\r?\n")


@dataclass(frozen=True)
class Numbers:
    """What a file's rows hold. row: with the types that are meant. shift: what is taken off positions.
    flat: no scale_2. rgb: red, green, blue instead of f_dc. said: a sentence for each guess."""

    row: np.dtype
    shift: Shift | None
    flat: bool
    rgb: bool
    said: tuple[str, ...]

    def means(self, rows: np.ndarray) -> np.ndarray:
        """Positions (n, 3) float32, without the shift."""
        if self.shift is None:
            return block(rows, MEANS)
        with np.errstate(over="ignore", invalid="ignore"):
            return (block(rows, MEANS, np.float64) - np.array(self.shift)).astype(np.float32)

    def scales(self, rows: np.ndarray) -> np.ndarray:
        """Scales (n, 3) as stored; the third of flat ones is the second again until `complete`."""
        if not self.flat:
            return block(rows, SCALES)
        return block(rows, SCALES[:2])[:, [0, 1, 1]]

    def colours(self, rows: np.ndarray) -> np.ndarray:
        """f_dc (n, 3), or red, green, blue as stored until `complete`."""
        return block(rows, _RGB if self.rgb else DC)

    def complete(self, stored: Rows, name: str, *, logs: bool) -> None:
        """Fill in, in place, what all rows together tell: the third axis, and the range of plain colours.

        Args:
            logs: scales are logarithms.

        Raises:
            SceneFileError: colours that are neither in [0, 1] nor in [0, 255].
        """
        if self.flat:
            stored.scales[:, 2] = math.log(PLY_NUMBERS.thin) if logs else PLY_NUMBERS.thin
        if self.rgb and len(stored.sh):
            most = _brightest(stored.sh[:, 0], {self.row[field].name for field in _RGB}, name)
            stored.sh[:, 0] = (stored.sh[:, 0] / np.float32(most) - 0.5) / SH_C0


def numbers_of(rows: np.ndarray, head: bytes, name: str) -> Numbers:
    """How the rows of a file are meant, by its first ones.

    Args:
        rows: structured (n,), as the header types them. head: the file's beginning, with its header.

    Raises:
        SceneFileError: whole numbers that make no sense.
    """
    names = rows.dtype.names or ()
    row, said = _halves(rows, name)
    rows = rows.view(row)
    numbers = Numbers(row, None, SCALES[2] not in names, DC[0] not in names, said)
    if numbers.flat:
        said = (*said, f"Its Gaussians are flat (no scale_2); their third axis is {PLY_NUMBERS.thin:g}.")
    shift = _shift(rows, head)
    if shift is not None and all(row[field].itemsize < 8 for field in MEANS):
        step = float(np.spacing(np.float32(max(map(abs, shift)))))
        blurred = f"so far from 0 ({told_shift(shift)}) that they have steps of {step:.2g}"
        said = (*said, f"Its coordinates are {blurred}, in which small Gaussians are lost; write doubles.")
        return replace(numbers, said=said)
    if shift is not None:
        off = f"{told_shift(shift)} is taken off them, and put back in a .ply"
        said = (*said, f"Its coordinates are far from 0: {off}.")
    return replace(numbers, shift=shift, said=said)


def missing_fields(names: list[str]) -> list[str]:
    """What a file's properties lack of a Gaussian's; flat ones need no third scale, plain colours no f_dc."""
    plain = set(_RGB) <= set(names) and not any(field.startswith("f_") for field in names)
    flat = SCALES[0] in names and SCALES[1] in names
    needed = (*MEANS, *(() if plain else DC), "opacity", *SCALES[: 2 if flat else 3], *QUATS)
    return [field for field in needed if field not in names]


def shift_line(shift: Shift) -> str:
    """A header's comment, which `numbers_of` reads back to the last bit."""
    return "comment LangFlash: shift " + " ".join(map(repr, shift))


def block(rows: np.ndarray, names: tuple[str, ...], kind: type = np.float32) -> np.ndarray:
    """Columns (n, k) of structured rows; a number too large for `kind` is infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return structured_to_unstructured(rows[list(names)], dtype=kind)


def _halves(rows: np.ndarray, name: str) -> tuple[np.dtype, tuple[str, ...]]:
    """The type of rows with ushort as halves where a Gaussian's numbers are so, and what is to be said."""
    row = rows.dtype
    names = row.names or ()
    own = [each for each in names if each in _OWN or each.startswith("f_rest_") or filter_of((each,))]
    whole = [field for field in own if row[field].kind in "iu"]
    if not whole:
        return row, ()
    meant = np.dtype([(f, row[f].str.replace("u2", "f2") if f in whole else row[f]) for f in names])
    alike = all(row[field].str[1:] == "u2" for field in whole) and set(QUATS) <= set(whole)
    if not alike or not _sensible(rows.view(meant), own):
        kind = f"{whole[0]} as whole numbers ({row[whole[0]].name})"
        raise SceneFileError(f"{name} stores {kind}, whose unit a .ply does not say; {REMEDY}")
    return meant, ("Its numbers are typed ushort and make sense as half floats, so they are read as these.",)


def _sensible(rows: np.ndarray, own: list[str]) -> bool:
    """Whether nearly all rows are finite and have a quaternion of some usual length."""
    finite = np.isfinite(block(rows, tuple(own))).all(1)
    norms = np.linalg.norm(block(rows[finite], QUATS, np.float64), axis=1)
    usual = (norms > PLY_NUMBERS.norms[0]) & (norms < PLY_NUMBERS.norms[1])
    return float(usual.sum()) >= PLY_NUMBERS.most * len(rows)


def _shift(rows: np.ndarray, head: bytes) -> Shift | None:
    """What this program took off once, or what must be taken off so that float32 blurs no Gaussian."""
    told = _TOLD.search(head)
    if told is not None:
        try:
            x, y, z = (float(value) for value in told.groups())
        except ValueError:
            x = y = z = math.nan
        if math.isfinite(x + y + z):
            return (x, y, z)
    places, scales = block(rows, MEANS, np.float64), block(rows, SCALES[:2], np.float64)
    usable = np.isfinite(places).all(1) & np.isfinite(scales).all(1)
    if not usable.any():
        return None
    low, centre, high = np.percentile(places[usable], (5, 50, 95), axis=0)
    farthest, logs = float(np.abs(centre).max()), float(np.median(scales[usable]))
    size = logs if float(scales[usable].min()) > 0 else math.exp(min(logs, 80.0))
    step = farthest * float(np.finfo(np.float32).eps)
    if step < PLY_NUMBERS.blur * size or farthest < PLY_NUMBERS.far * float(np.linalg.norm(high - low)):
        return None
    x, y, z = np.round(centre).tolist()
    return (x, y, z) if any((x, y, z)) else None


def _brightest(colours: np.ndarray, kinds: set[str], name: str) -> float:
    """What white is among plain colours (n, 3) of these types."""
    low, high = float(colours.min()), float(colours.max())
    floats = all(kind.startswith("float") for kind in kinds) and low >= 0
    if floats and high <= 1:
        return 1.0
    if kinds == {"uint8"} or (floats and high <= 255 and bool((colours == np.round(colours)).all())):
        return 255.0
    found = f"red, green and blue from {low:g} to {high:g} ({', '.join(sorted(kinds))})"
    raise SceneFileError(f"{name} has {found}, expected bytes, or floats up to 1; {REMEDY}")
