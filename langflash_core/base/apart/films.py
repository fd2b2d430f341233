"""Films, decoded by FFmpeg in OpenCV: what one says of itself, and its pictures one after another.

OpenCV 5 turns no interlaced picture into colours: what comes is what lay in that memory before, black or the
last good picture, and nothing tells so. Nor does every build decode AV1. So pictures that come equal to the
last bit, as no camera makes them, are not believed, and are decoded again by the program that imageio-ffmpeg
(the extra `video`) brings; it takes interlaced pictures apart.
"""

import os
import subprocess
from collections.abc import Iterable, Iterator
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
_SAME = (
    3  # equal pictures in a row that are not believed; a film of fewer pictures a second holds one for two
)
_APART = "yadif=deint=interlaced"  # of each interlaced picture the first of its two moments
_TURNS = {90.0: cv2.ROTATE_90_CLOCKWISE, 180.0: cv2.ROTATE_180, 270.0: cv2.ROTATE_90_COUNTERCLOCKWISE}


def answers(reader: str, request: dict[str, Any], content: bytes) -> Iterator[tuple[dict, dict]]:
    """For "film" facts width and height (of pictures, upright, in square pixels) and seconds (0: not said).
    For "film pictures" a part a picture, with `seconds`, `doubtful` (it came equal to those beside it, and
    nothing else could decode it) and (H, W, 3) uint8 "picture", blue, green, red; and a part without one now
    and then.

    Args:
        request: "path"; of pictures also "start" (seconds), "end" or
            None, "looks" (at most so many a second) and "pixels" (the most of one).

    Raises:
        ValueError: it cannot be decoded, or has too many pixels.
    """
    with _open_capture(request["path"]) as capture:
        film = _Film(request["path"], capture)
        if reader == "film":
            yield film.facts(), {}
            return
        yield from film.pictures(request["start"], request["end"], request["looks"], request["pixels"])


@contextmanager
def _open_capture(path: str) -> Iterator[cv2.VideoCapture]:
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

    def __init__(self, path: str, capture: cv2.VideoCapture) -> None:
        self._path, self._capture = path, capture
        rate = capture.get(cv2.CAP_PROP_FPS)
        self._rate = rate if 0 < rate < 1000 else 25.0
        stored = capture.get(cv2.CAP_PROP_SAR_NUM), capture.get(cv2.CAP_PROP_SAR_DEN)
        self._stretch = stored[0] / stored[1] if min(stored) > 0 and stored[0] != stored[1] else 1.0
        self._turn = _TURNS.get(capture.get(cv2.CAP_PROP_ORIENTATION_META))
        self._turned = self._turn is not None and self._turn != cv2.ROTATE_180

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
        """Of `answers`. None is given before it is clear whether it is believed."""
        held: list[tuple[float, np.ndarray]] = []  # the last ones, all equal
        doubtful, decoded = False, False
        for seconds, picture in self._decode(start, end, looks, most):
            decoded = True
            if picture is None:
                yield {"seconds": seconds}, {}
                continue
            if held and not np.array_equal(held[-1][1], picture):
                yield from _parts(held, doubtful)
                held, doubtful = [], False
            held.append((seconds, picture))
            if len(held) < _SAME and not doubtful:
                continue
            if not doubtful and (program := _program()):
                yield from _parts(self._again(program, held[0][0], end, looks), False)
                return
            doubtful = True
            yield from _parts(held[:-1], doubtful)
            held = held[-1:]
        yield from _parts(held, doubtful)
        if not decoded and (program := _program()):
            yield from _parts(self._again(program, start, end, looks), False)

    def _decode(
        self, start: float, end: float | None, looks: float, most: int
    ) -> Iterator[tuple[float, np.ndarray | None]]:
        """By OpenCV: seconds and pictures; None now and then."""
        capture = self._capture
        due, place, before = start, 0, -1.0
        while capture.grab():
            seconds = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            if seconds <= before:  # some containers keep no times
                seconds = before + 1 / self._rate
            before, place = seconds, place + 1
            if end is not None and seconds > end + _EARLY:
                return
            if place % _CHECKED == 1:
                yield seconds, None
            if seconds < due - _EARLY:
                continue
            came, picture = capture.retrieve()
            if not came or picture is None or picture.ndim != 3:
                continue
            if picture.shape[0] * picture.shape[1] * max(self._stretch, 1 / self._stretch) > most:
                raise ValueError(f"has pictures of more than {most:,} pixels")
            due = max(due + 1 / looks, seconds)
            yield seconds, self._resize(picture)

    def _again(
        self, program: str, start: float, end: float | None, looks: float
    ) -> Iterator[tuple[float, np.ndarray | None]]:
        """By an ffmpeg program, interlaced pictures taken apart: seconds and pictures; None now and then.

        It inherits this process's limits; when this one is ended, its pipe breaks, and it ends too.
        """
        facts = self.facts()
        width, height = int(facts["width"]), int(facts["height"])
        size = (height, width) if self._turned else (width, height)  # as it is stored
        words = [
            *("-nostdin", "-v", "quiet", "-threads", "4", "-noautorotate"),
            *("-protocol_whitelist", "file", "-format_whitelist", _CONTAINERS, "-i", f"file:{self._path}"),
            *(() if end is None else ("-t", f"{end + _EARLY:.6f}")),
            *("-map", "0:V:0", "-vf", f"{_APART},fps={self._rate}:start_time=0,scale={size[0]}:{size[1]}"),
            *("-protocol_whitelist", "pipe", "-f", "rawvideo", "-pix_fmt", "bgr24", "pipe:1"),
        ]  # fmt: skip
        nowhere, whole = subprocess.DEVNULL, 3 * width * height
        with subprocess.Popen(
            [program, *words], stdin=nowhere, stdout=subprocess.PIPE, stderr=nowhere,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        ) as process:  # fmt: skip
            assert process.stdout is not None
            due, place = start, -1
            while len(content := process.stdout.read(whole)) == whole:
                place += 1  # from the film's begin on: not every container can be sought in
                seconds = place / self._rate
                if place % _CHECKED == 0:
                    yield seconds, None
                if seconds < due - _EARLY:
                    continue
                due = max(due + 1 / looks, seconds)
                picture = np.frombuffer(content, np.uint8).reshape(size[1], size[0], 3)
                yield seconds, picture if self._turn is None else cv2.rotate(picture, self._turn)

    def _square(self, width: int, height: int) -> tuple[int, int]:
        """A picture's size in square pixels."""
        if self._turned:
            return width, round(height * self._stretch)
        return round(width * self._stretch), height

    def _resize(self, picture: np.ndarray) -> np.ndarray:
        size = self._square(picture.shape[1], picture.shape[0])
        if size != (picture.shape[1], picture.shape[0]):
            picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(picture)


def _parts(
    pictures: Iterable[tuple[float, np.ndarray | None]], doubtful: bool
) -> Iterator[tuple[dict, dict]]:
    for seconds, picture in pictures:
        yield {"seconds": seconds, "doubtful": doubtful}, {} if picture is None else {"picture": picture}


def _program() -> str | None:
    """Where an ffmpeg program is; None without one."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError):  # the package, or its program, is not there
        return None
