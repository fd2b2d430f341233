"""Films, decoded by FFmpeg in OpenCV: what one says of itself, and its pictures one after another."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

# Containers that hold pictures themselves. FFmpeg also knows lists that name other files, and addresses.
_CONTAINERS = "mov,matroska,avi,mpegts,mpeg,mpegvideo,asf,ogg,flv,h264,hevc,m4v"
os.environ["OPENCV_FFMPEG_CAPTURE_OPTIONS"] = f"protocol_whitelist;file|format_whitelist;{_CONTAINERS}"
os.environ["OPENCV_FFMPEG_LOGLEVEL"] = "-8"

import cv2  # noqa: E402 - after what it reads at its first use

_EARLY = 0.002  # seconds that a picture may come before its time is due, by rounding
_CHECKED = 30  # frames that are passed by between two signs of life


def answers(reader: str, request: dict[str, Any], content: bytes) -> Iterator[tuple[dict, dict]]:
    """For "film" facts width and height (of pictures, upright, in square pixels) and seconds (0: not said).
    For "film pictures" a part a picture, with `seconds` and (H, W, 3) uint8 "picture", blue, green, red; and
    a part without one now and then.

    Args:
        request: "path"; of pictures also "start" (seconds), "end" or
            None, "looks" (at most so many a second) and "pixels" (the most of one).

    Raises:
        ValueError: it cannot be decoded, or has too many pixels.
    """
    with _opened(request["path"]) as capture:
        film = _Film(capture)
        if reader == "film":
            yield film.facts(), {}
            return
        yield from film.pictures(request["start"], request["end"], request["looks"], request["pixels"])


@contextmanager
def _opened(path: str) -> Iterator[cv2.VideoCapture]:
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    capture = cv2.VideoCapture(path, cv2.CAP_FFMPEG)
    try:
        if not capture.isOpened():
            raise ValueError("holds no film that can be decoded here")
        yield capture
    finally:
        capture.release()


class _Film:
    """An open film. It is turned as its rotation flag says, by OpenCV; pixels are made square here."""

    def __init__(self, capture: cv2.VideoCapture) -> None:
        self._capture = capture
        rate = capture.get(cv2.CAP_PROP_FPS)
        self._rate = rate if 0 < rate < 1000 else 25.0
        stored = capture.get(cv2.CAP_PROP_SAR_NUM), capture.get(cv2.CAP_PROP_SAR_DEN)
        self._stretch = stored[0] / stored[1] if min(stored) > 0 and stored[0] != stored[1] else 1.0
        self._turned = capture.get(cv2.CAP_PROP_ORIENTATION_META) in (90.0, 270.0)

    def facts(self) -> dict[str, float]:
        """Of `answers`."""
        get = self._capture.get
        width, height = self._square(
            *(int(get(p)) for p in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        )
        return {
            "width": width,
            "height": height,
            "seconds": max(get(cv2.CAP_PROP_FRAME_COUNT), 0.0) / self._rate,
        }

    def pictures(
        self, start: float, end: float | None, looks: float, most: int
    ) -> Iterator[tuple[dict, dict]]:
        """Of `answers`."""
        capture = self._capture
        due, place, before = start, 0, -1.0
        while capture.grab():
            seconds = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            if seconds <= before:  # some containers keep no times
                seconds = before + 1 / self._rate
            before, place = seconds, place + 1
            if end is not None and seconds > end + _EARLY:
                return
            if place % _CHECKED == 0:
                yield {"seconds": seconds}, {}
            if seconds < due - _EARLY:
                continue
            came, picture = capture.retrieve()
            if not came or picture is None or picture.ndim != 3:
                continue
            if picture.shape[0] * picture.shape[1] * max(self._stretch, 1 / self._stretch) > most:
                raise ValueError(f"has pictures of more than {most:,} pixels")
            due = max(due + 1 / looks, seconds)
            yield {"seconds": seconds}, {"picture": self._shaped(picture)}

    def _square(self, width: int, height: int) -> tuple[int, int]:
        """A picture's size in square pixels."""
        if self._turned:
            return width, round(height * self._stretch)
        return round(width * self._stretch), height

    def _shaped(self, picture: np.ndarray) -> np.ndarray:
        size = self._square(picture.shape[1], picture.shape[0])
        if size != (picture.shape[1], picture.shape[0]):
            picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(picture)
