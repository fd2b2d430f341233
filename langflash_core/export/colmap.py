"""COLMAP's sparse models, in: photos with their cameras, from text or binary files.

cameras.txt: CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]. images.txt: IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ,
CAMERA_ID, NAME, then a line of points (X, Y, POINT3D_ID)[], which some writers leave away. Others write a
byte order mark, backslashes in names, commas between numbers or in them: what can be told apart is read.

Source: COLMAP's documentation (output format), and its scene/reconstruction_io for the binary files.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.base.limits import TEXT, VIEWS
from langflash_core.errors import SceneFileError
from langflash_core.export.settings import COLMAP_TEXT
from langflash_core.geometry.quaternions import quats_to_matrices

Lens = tuple[Tensor, tuple[int, int]]
"""K (3, 3) float64 in pixels of photos of a size (width, height)."""
_PINHOLES = {
    "SIMPLE_PINHOLE": (0, 0, 1, 2),
    "PINHOLE": (0, 1, 2, 3),
    "SIMPLE_RADIAL": (0, 0, 1, 2),
    "RADIAL": (0, 0, 1, 2),
    "OPENCV": (0, 1, 2, 3),
    "FULL_OPENCV": (0, 1, 2, 3),
}
"""Models that are pinholes where the rest of their numbers is 0, and where fx, fy, cx, cy are."""
_NUMBERED = (
    ("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8), ("FULL_OPENCV", 12), ("FOV", 5), ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5), ("THIN_PRISM_FISHEYE", 12), ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
)  # fmt: skip
"""Names of the models, and how many numbers they have, by their number in binary files."""
_COUNTS = dict(_NUMBERED)
_WORDS = 9  # of a line of images.txt before the name


@dataclass(frozen=True)
class Seen:
    """A photo of a model: its name, its pose (4, 4) float64, world to camera, and its lens."""

    name: str
    viewmat: Tensor
    lens: Lens


def read_model(path: Path) -> list[Seen]:
    """All photos of a model.

    Args:
        path: one of its files: text, or binary where it is or there is no cameras.txt.

    Raises:
        OSError: a file is missing. SceneFileError: more than is let in. ValueError, LookupError, TypeError,
        struct.error and others: damaged, or of lenses that bend straight lines.
    """
    folder = path.parent
    if path.suffix == ".bin" or (
        (folder / "cameras.bin").is_file() and not (folder / "cameras.txt").is_file()
    ):
        return _of_binary(folder)
    lenses = {}
    for line in text_lines(folder / "cameras.txt"):
        if line.strip():
            words = _split_line(line, 4 + _COUNTS.get(_model_of(line), 0))
            lenses[words[0]] = _lens(words[0], words[1], words[2:4], words[4:])
    return list(_photos(text_lines(folder / "images.txt"), lenses))


def text_lines(path: Path) -> list[str]:
    """Of a text file, with neither comments nor a byte order mark.

    Raises:
        OSError: it is missing. SceneFileError: it is too long. ValueError: it is no UTF-8.
    """
    TEXT.check(path.stat().st_size, path.name, SceneFileError)
    return [line for line in path.read_text("utf-8-sig").splitlines() if not line.startswith("#")]


def pinhole(fx: float, fy: float, cx: float, cy: float) -> Tensor:
    """K (3, 3) float64."""
    return torch.tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], dtype=torch.float64)


def check_pinhole(model: str, bends: list[float], what: str) -> None:
    """Refuse what is no pinhole.

    Args:
        bends: numbers beside focal lengths and the principal point. what: whose model it is.

    Raises:
        ValueError: the model is another, or a number is not 0.
    """
    if model not in _PINHOLES:
        raise ValueError(f"{what} is of model {model}, which is no pinhole")
    if not all(abs(number) <= COLMAP_TEXT.straight for number in bends):
        raise ValueError(f"{what} of model {model} bends straight lines")


def _model_of(line: str) -> str:
    """The second word of a line of cameras.txt."""
    return [*re.split(r"[,\s]+", line.strip(), maxsplit=2), ""][1]


def _split_line(line: str, count: int) -> list[str]:
    """A line's words, its numbers with decimal points: commas part words, or are decimal where blanks do.

    Args:
        count: of words that are expected; a name behind them keeps its commas and blanks.
    """
    words = line.split(maxsplit=count if count == _WORDS else -1)
    if len(words) >= count:
        return [*(word.rstrip(",").replace(",", ".") for word in words[:count]), *words[count:]]
    return re.split(r"\s*,\s*|\s+", line.strip(), maxsplit=count if count == _WORDS else 0)


def _lens(number: str, model: str, size: list[str] | list[int], params: list[str] | list[float]) -> Lens:
    numbers = [float(word) for word in params]
    check_pinhole(model, [], f"camera {number}")
    if len(numbers) != _COUNTS[model]:
        raise ValueError(f"camera {number} of model {model} has {len(numbers)} numbers, not {_COUNTS[model]}")
    places = _PINHOLES[model]
    check_pinhole(model, numbers[max(places) + 1 :], f"camera {number}")
    return pinhole(*(numbers[place] for place in places)), (int(size[0]), int(size[1]))


def _photos(lines: list[str], lenses: dict[str, Lens]) -> Iterator[Seen]:
    """Those of images.txt; lines of points may be there, empty, or missing."""
    after_photo = False
    for line in lines:
        if not line.strip():
            continue
        if after_photo and _is_points(line, lenses):
            after_photo = False
            continue
        words = _split_line(line, _WORDS)
        if len(words) != _WORDS + 1:
            raise ValueError(f"a line of images.txt has {len(words)} words, not {_WORDS + 1}")
        numbers = [float(word) for word in words[1:8]]
        yield Seen(words[9].strip(), _viewmat(numbers), lenses[words[8]])
        after_photo = True


def _is_points(line: str, lenses: dict[str, Lens]) -> bool:
    """Whether a line behind one of a photo is its points: numbers alone, and not those of a photo whose name
    is a number. Of long lines the beginning and the end are looked at."""
    words = _split_line(line, _WORDS)
    behind = [*words[_WORDS:], ""][0]
    try:
        numbers = [
            float(word) for word in (*words[:_WORDS], *behind[:40].split()[:1], *behind[-40:].split()[-1:])
        ]
    except ValueError:
        return False
    if len(behind.split(maxsplit=1)) != 1 or words[8] not in lenses:
        return True
    return abs(sum(number**2 for number in numbers[1:5]) - 1) > 1e-2


def _viewmat(numbers: list[float] | tuple[float, ...]) -> Tensor:
    """(4, 4) float64 of a quaternion wxyz and a translation."""
    values = torch.tensor(numbers, dtype=torch.float64)
    viewmat = torch.eye(4, dtype=torch.float64)
    viewmat[:3, :3], viewmat[:3, 3] = quats_to_matrices(values[:4]), values[4:7]
    return viewmat


class _Bytes:
    """A binary file, little-endian, taken from its beginning to its end."""

    def __init__(self, path: Path) -> None:
        TEXT.check(path.stat().st_size, path.name, SceneFileError)
        self.name, self._content, self._at = path.name, path.read_bytes(), 0

    def take(self, layout: str) -> tuple:
        """Raises struct.error: the file ends before."""
        values = struct.unpack_from("<" + layout, self._content, self._at)
        self._at += struct.calcsize("<" + layout)
        return values

    def count(self, smallest: int) -> int:
        """How many records of at least so many bytes follow.

        Raises:
            SceneFileError: more than are let in. ValueError: more than the file can hold.
        """
        (count,) = self.take("Q")
        if count > (len(self._content) - self._at) // smallest:
            raise ValueError(f"{self.name} ends before the {count:,} records that it promises")
        VIEWS.check(count, self.name, SceneFileError)
        return count

    def text(self) -> str:
        """Up to a zero byte."""
        end = self._content.index(b"\0", self._at, self._at + COLMAP_TEXT.longest_name)
        start, self._at = self._at, end + 1
        return self._content[start:end].decode("utf-8")

    def skip(self, count: int, size: int) -> None:
        """Raises ValueError: the file ends before."""
        if count > (len(self._content) - self._at) // size:
            raise ValueError(f"{self.name} ends before the {count:,} points that it promises")
        self._at += count * size

    def check_end(self) -> None:
        """Raises ValueError: something follows, so what was read is in doubt."""
        if self._at != len(self._content):
            raise ValueError(f"{self.name} goes on after its last record")


def _of_binary(folder: Path) -> list[Seen]:
    """Raises: as `read_model`."""
    cameras, images = _Bytes(folder / "cameras.bin"), _Bytes(folder / "images.bin")
    lenses, seen = {}, []
    for _ in range(cameras.count(smallest=24 + 8 * 3)):
        number, kind, width, height = cameras.take("IiQQ")
        model, count = _NUMBERED[kind] if 0 <= kind < len(_NUMBERED) else (f"number {kind}", 0)
        check_pinhole(model, [], f"camera {number}")
        lenses[number] = _lens(str(number), model, [width, height], list(cameras.take(f"{count}d")))
    cameras.check_end()
    for _ in range(images.count(smallest=64 + 1 + 8)):
        numbers, name = images.take("I7dI"), images.text()
        seen.append(Seen(name, _viewmat(numbers[1:8]), lenses[numbers[8]]))
        images.skip(images.take("Q")[0], 24)
    images.check_end()
    return seen
