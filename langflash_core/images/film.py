"""A film as upright pictures with their times, one after another: never more than two are in memory.

It is decoded in a process of its own (`langflash_core/base/apart/films.py`), which looks for the next picture
while the last one is judged here.
"""

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8

from langflash_core.base.apart import Ended, Part, Refused, ask
from langflash_core.base.limits import PIXELS
from langflash_core.errors import FilmError
from langflash_core.images.settings import LOOKING

_REMEDY = "convert it to H.264 in an .mp4 first, for example with HandBrake"

Picture = UInt8[np.ndarray, "H W 3"]  # blue, green, red, as OpenCV has them


@dataclass(frozen=True)
class Film:
    """What a film says of itself. width, height: of its pictures, upright, in square pixels. seconds: 0 where
    it does not say."""

    name: str
    width: int
    height: int
    seconds: float


class Reader:
    """An open film; see `open_film`. doubtful: pictures given so far that came equal to the last bit, as none
    of a camera are, from the only decoder that there is: it may not know the film's kind."""

    def __init__(self, path: Path, film: Film) -> None:
        self._path, self.film, self.doubtful = path, film, 0

    def pictures(
        self, start: float, end: float | None, check: Callable[[], None]
    ) -> Generator[tuple[float, Picture], None, None]:
        """Seconds from the film's begin, and what is seen then; at most `LOOKING.looks` a second.

        Args:
            end: the last picture's latest time; None: all of the rest.
            check: called now and then; what it raises ends the work.

        Raises:
            FilmError: its decoder broke, took too long, or wanted too much memory; a picture is too large.
        """
        bounds = {"start": start, "end": end, "looks": LOOKING.looks, "pixels": PIXELS.value}
        with closing(_ask_reader("film pictures", self._path, bounds)) as parts:
            for part in parts:
                check()
                if "picture" in part.arrays:
                    self.doubtful += bool(part.facts["doubtful"])
                    yield float(part.facts["seconds"]), part.arrays["picture"]


@contextmanager
def open_film(path: Path) -> Iterator[Reader]:
    """A film to read.

    Raises:
        FilmError: it is missing, no film, without pictures, too small, or of a kind that cannot be decoded.
    """
    name = path.name
    if not path.is_file():
        raise FilmError(
            f"{name} is a folder; name the film itself" if path.is_dir() else f"there is no film at {path}"
        )
    if not path.stat().st_size:
        raise FilmError(f"{name} is an empty file; copy it again, or {_REMEDY}")
    (part,) = _ask_reader("film", path, {})
    width, height = int(part.facts["width"]), int(part.facts["height"])
    if min(width, height) < LOOKING.min_side:
        raise FilmError(f"{name} is only {width} x {height} pixels; film at least 480 pixels a side")
    if PIXELS.passed_by(width * height):
        raise FilmError(f"{name} has pictures of {width:,} x {height:,} pixels; {PIXELS.remedy()}")
    yield Reader(path, Film(name, width, height, float(part.facts["seconds"])))


def _ask_reader(reader: str, path: Path, bounds: Mapping[str, Any]) -> Generator[Part, None, None]:
    """Raises:
    FilmError: it cannot be decoded, or its decoder broke.
    """
    try:
        yield from ask(reader, {"path": str(path.absolute()), **bounds})
    except Refused as error:
        raise FilmError(f"{path.name} {error}; copy it again, or {_REMEDY}") from error
    except Ended as error:
        raise FilmError(f"{path.name} cannot be read: its decoder {error}; {_REMEDY}") from error
