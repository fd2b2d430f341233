"""Options that are more than a word: text to checked values, for argparse's `type=`."""

import math
import re
from argparse import ArgumentTypeError
from collections.abc import Callable

from langflash_core.base.detail import FEWEST, MOST
from langflash_core.base.formats import LARGEST_SIDE
from langflash_core.base.pictures import SPOKEN, WORDS, Picture


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ArgumentTypeError(f"expected a number, received {text!r}") from None
    if not math.isfinite(value):
        raise ArgumentTypeError(f"expected a finite number, received {text}")
    return value


def _whole(text: str, smallest: int, largest: int) -> int:
    if not re.fullmatch(r"[+-]?\d+", text) or not smallest <= int(text) <= largest:
        raise ArgumentTypeError(f"expected a whole number from {smallest} to {largest}, received {text!r}")
    return int(text)


def _number_of(said: str, fits: Callable[[float], bool]) -> Callable[[str], float]:
    """Reads a number that fits; said: what is expected."""

    def read(text: str) -> float:
        value = _number(text)
        if not fits(value):
            raise ArgumentTypeError(f"expected {said}, received {text}")
        return value

    return read


def _whole_from(smallest: int, largest: int) -> Callable[[str], int]:
    return lambda text: _whole(text, smallest, largest)


above_zero = _number_of("a number above 0", lambda value: value > 0)
share = _number_of("a number from 0 to 1", lambda value: 0 <= value <= 1)
kept_fraction = _number_of("a number between 0 and 1", lambda value: 0 < value < 1)  # a threshold
open_fov = _number_of("degrees between 1 and 179", lambda value: 1 < value < 179)
minutes = _number_of("minutes above 0", lambda value: value > 0)
film_seconds = _number_of("seconds above 0, at most 600", lambda value: 0 < value <= 600)
film_time = _number_of("seconds, not below 0", lambda value: value >= 0)

whole_count = _whole_from(1, 10**9)
frame_count = _whole_from(2, 10_000)
gaussian_count = _whole_from(FEWEST, MOST)
atom_count = _whole_from(1, 960)  # as many as a query's shader holds
pixel_side = _whole_from(56, 1024)  # of the square that has as many pixels as the network is to see
seed = _whole_from(0, 2**31 - 1)  # of a room, or of a run


def size(text: str) -> tuple[int, int]:
    """`WxH` to (width, height) in pixels, each 1 to 8192."""
    match = re.fullmatch(r"(\d{1,5})[xX×](\d{1,5})", text)
    if not match:
        raise ArgumentTypeError(f"expected WIDTHxHEIGHT such as 640x480, received {text!r}")
    width, height = int(match[1]), int(match[2])
    if not (1 <= width <= LARGEST_SIDE and 1 <= height <= LARGEST_SIDE):
        raise ArgumentTypeError(f"expected sides of 1 to {LARGEST_SIDE} pixels, received {text}")
    return width, height


def point(text: str) -> tuple[float, float, float]:
    """`X,Y,Z` in scene units."""
    parts = text.split(",")
    if len(parts) != 3:
        raise ArgumentTypeError(f"expected X,Y,Z such as 0.2,-0.1,1.4, received {text!r}")
    x, y, z = map(_number, parts)
    return x, y, z


def spot(text: str) -> tuple[float, float, float]:
    """`X,Y,Z`: a point or a direction."""
    words = text.split(",")
    if len(words) != 3:
        raise ArgumentTypeError(f"expected three numbers X,Y,Z, received {text!r}")
    x, y, z = (_number(word) for word in words)
    return x, y, z


def photo_index(text: str) -> int:
    """Index of a photo, from 0; people count from 1."""
    if text.strip() == "0":
        raise ArgumentTypeError("photos count from 1; 1 is the first photo")
    return _whole(text, 1, 10**6) - 1


def part(text: str) -> tuple[int, int]:
    """`I/N`: the I-th of N parts, from 0."""
    index, slash, count = text.partition("/")
    if not slash:
        raise ArgumentTypeError(f"expected I/N such as 0/2, received {text!r}")
    parts = _whole(count, 1, 1000)
    return _whole(index, 0, parts - 1), parts


def intrinsics(text: str) -> tuple[float, float, float, float]:
    """`FX,FY,CX,CY` in pixels; focal lengths above 0."""
    words = text.split(",")
    if len(words) != 4:
        raise ArgumentTypeError(f"expected four numbers FX,FY,CX,CY, received {text!r}")
    fx, fy, cx, cy = (_number(word) for word in words)
    if fx <= 0 or fy <= 0:
        raise ArgumentTypeError(f"expected focal lengths above 0, received {text}")
    return fx, fy, cx, cy


def crop(text: str) -> tuple[int, int, int, int]:
    """`LEFT,TOP,RIGHT,BOTTOM` in whole pixels."""
    words = text.split(",")
    if len(words) != 4:
        raise ArgumentTypeError(f"expected four numbers LEFT,TOP,RIGHT,BOTTOM, received {text!r}")
    left, top, right, bottom = (_whole(word, 0, 10**6) for word in words)
    if left >= right or top >= bottom:
        raise ArgumentTypeError(f"expected LEFT below RIGHT and TOP below BOTTOM, received {text}")
    return left, top, right, bottom


def numbers(text: str) -> tuple[tuple[int, int], ...]:
    """`100-200,307`: numbers and ranges of numbers, ends included."""
    ranges = []
    for word in text.split(","):
        low, _, high = word.partition("-")
        first = _whole(low, 0, 10**12)
        ranges.append((first, _whole(high or low, first, 10**12)))
    return tuple(ranges)


def span(text: str) -> tuple[float, float]:
    """`LOW,HIGH`: two numbers from -1 to 1, the first below the second."""
    low, comma, high = text.partition(",")
    if not comma:
        raise ArgumentTypeError(f"expected LOW,HIGH such as 0.5,1, received {text!r}")
    ends = _number(low), _number(high)
    if not -1 <= ends[0] < ends[1] <= 1:
        raise ArgumentTypeError(f"expected LOW below HIGH, both from -1 to 1, received {text}")
    return ends


def what(text: str) -> tuple[Picture, str, int | None]:
    """A picture, the word for it, and for `weights:K` the atom K."""
    word, colon, atom = text.partition(":")
    picture = SPOKEN.get(word)
    if picture is None or bool(colon) != picture.of_an_atom:
        known = f"{', '.join(WORDS[:-1])} or {WORDS[-1]}"
        raise ArgumentTypeError(f"expected {known}, received {text!r}")
    return picture, word, _whole(atom, 0, 10**6) if colon else None
