"""A film as upright pictures with their times, one after another: never more than one is in memory.

OpenCV decodes, through FFmpeg in its wheels. It turns pictures as the film's rotation flag says; pixels that
are not square are made so here.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from langflash_core.errors import FilmError

LOOKS = 15.0  # pictures a second that are looked at, at most
MIN_SIDE = 64  # pixels
_EARLY = 0.002  # seconds that a picture may come before its time is due, by rounding
_CHECKED = 30  # frames that are passed by between two questions whether to go on
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
    """An open film; see `opened`."""

    def __init__(self, capture, cv2, name: str) -> None:
        self._capture, self._cv2 = capture, cv2
        rate, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self._rate = rate if 0 < rate < 1000 else 25.0
        stored = capture.get(cv2.CAP_PROP_SAR_NUM), capture.get(cv2.CAP_PROP_SAR_DEN)
        self._stretch = stored[0] / stored[1] if min(stored) > 0 and stored[0] != stored[1] else 1.0
        self._turned = capture.get(cv2.CAP_PROP_ORIENTATION_META) in (90.0, 270.0)
        wide, high = capture.get(cv2.CAP_PROP_FRAME_WIDTH), capture.get(cv2.CAP_PROP_FRAME_HEIGHT)
        self.film = Film(name, *self._square(int(wide), int(high)), max(count, 0.0) / self._rate)

    def pictures(
        self, start: float, end: float | None, check: Callable[[], None]
    ) -> Iterator[tuple[float, Picture]]:
        """Seconds from the film's begin, and what is seen then; at most `LOOKS` a second.

        Args:
            end: the last picture's latest time; None: all of the rest.
            check: called now and then; what it raises ends the work.
        """
        cv2, capture = self._cv2, self._capture
        due, place, before = start, 0, -1.0
        while capture.grab():
            seconds = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            if seconds <= before:  # some containers keep no times
                seconds = before + 1 / self._rate
            before, place = seconds, place + 1
            if end is not None and seconds > end + _EARLY:
                return
            if place % _CHECKED == 0:
                check()
            if seconds < due - _EARLY:
                continue
            came, picture = capture.retrieve()
            if not came or picture is None or picture.ndim != 3:
                continue
            due = max(due + 1 / LOOKS, seconds)
            check()
            yield seconds, self._shaped(picture)

    def _square(self, width: int, height: int) -> tuple[int, int]:
        """A picture's size in square pixels."""
        if self._turned:
            return width, round(height * self._stretch)
        return round(width * self._stretch), height

    def _shaped(self, picture: np.ndarray) -> np.ndarray:
        size = self._square(picture.shape[1], picture.shape[0])
        if size == (picture.shape[1], picture.shape[0]):
            return picture
        return self._cv2.resize(picture, size, interpolation=self._cv2.INTER_AREA)


@contextmanager
def opened(path: Path) -> Iterator[Reader]:
    """A film to read.

    Raises:
        FilmError: it is missing, no film, without pictures, too small, or of a kind that cannot be decoded.
    """
    name = path.name
    if not path.is_file():
        raise FilmError(
            f"{name} is a folder; name the film itself" if path.is_dir() else f"there is no film at {path}"
        )
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # what is wrong is told once, in the error
    import cv2

    log = cv2.utils.logging
    level = log.setLogLevel(log.LOG_LEVEL_SILENT)
    capture = cv2.VideoCapture(str(path.absolute()), cv2.CAP_FFMPEG)
    try:
        if not capture.isOpened():
            why = "is an empty file" if not path.stat().st_size else "holds no film that can be decoded here"
            raise FilmError(f"{name} {why}; copy it again, or {_REMEDY}")
        reader = Reader(capture, cv2, name)
        film = reader.film
        if min(film.width, film.height) < MIN_SIDE:
            raise FilmError(
                f"{name} is only {film.width} x {film.height} pixels; film at least 480 pixels a side"
            )
        yield reader
    finally:
        capture.release()
        log.setLogLevel(level)
