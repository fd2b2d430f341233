"""Films for tests: a window that moves over a large picture full of things, encoded as H.264."""

import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import cv2
import imageio_ffmpeg
import numpy as np

SIZE, RATE = (320, 240), 15


@cache
def wall(seed: int = 0) -> np.ndarray:
    """(480, 1600, 3) uint8, BGR: boxes and discs before each other, with grain that the encoder keeps."""
    rng = np.random.default_rng(seed)
    picture = np.full((480, 1600, 3), 120, np.uint8)
    for _ in range(900):
        x, y = (int(rng.integers(side)) for side in (1600, 480))
        colour = tuple(int(each) for each in rng.integers(20, 236, 3))
        if rng.random() < 0.5:
            corner = x + int(rng.integers(8, 50)), y + int(rng.integers(8, 50))
            cv2.rectangle(picture, (x, y), corner, colour, -1)
        else:
            cv2.circle(picture, (x, y), int(rng.integers(4, 24)), colour, -1)
    return picture


def seen(x: float, y: float = 100.0, picture: np.ndarray | None = None) -> np.ndarray:
    """(240, 320, 3): the wall from (x, y) on, between pixels too."""
    moved = np.array([[1, 0, -x], [0, 1, -y]], np.float32)
    return cv2.warpAffine(wall() if picture is None else picture, moved, SIZE)


def smeared(frame: np.ndarray, width: int = 17) -> np.ndarray:
    """As a hand that moves would blur it."""
    return cv2.blur(frame, (width, 1))


def write(path: Path, frames: Sequence[np.ndarray], rate: int = RATE, *options: str) -> Path:
    """Frames (BGR) as H.264."""
    height, width = frames[0].shape[:2]
    writer = imageio_ffmpeg.write_frames(
        str(path), (width, height), pix_fmt_in="bgr24", fps=rate, quality=8, macro_block_size=2,
        output_params=["-preset", "veryfast", *options],
    )  # fmt: skip
    writer.send(None)
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
    return path


def ffmpeg(*words: str | Path) -> None:
    """The encoder with words of one's own."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", *map(str, words)]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL)


def turned(path: Path, degrees: int) -> Path:
    """The same film with a flag that says how it is to be turned, anticlockwise."""
    out = path.with_stem(f"{path.stem}_{degrees}")
    ffmpeg("-display_rotation", str(degrees), "-i", path, "-c", "copy", out)
    return out


def walk(count: int = 60, step: float = 8.0) -> list[np.ndarray]:
    """A steady way along the wall."""
    return [seen(step * index) for index in range(count)]


MPEG2, H264 = ("-c:v", "mpeg2video", "-q:v", "2"), ("-c:v", "libx264", "-preset", "veryfast")


def interlaced(path: Path, out: Path, *codec: str) -> Path:
    """The same film at half its rate, each picture's two fields of two moments, as a camcorder writes it."""
    fields = "tinterlace=interleave_top,setfield=tff"
    ffmpeg("-i", path, "-vf", fields, *codec, "-flags", "+ildct+ilme", out)
    return out


def mixed(path: Path, whole: float) -> Path:
    """A film of 50 pictures a second with so many seconds of whole pictures, then interlaced ones."""
    names = [path.with_name(name) for name in ("one.ts", "rest.mkv", "two.ts", "list.txt", "mixed.mkv")]
    one, rest, two, both, out = names
    ffmpeg("-i", path, "-t", str(whole), "-r", "25", *MPEG2, one)
    ffmpeg("-ss", str(whole), "-i", path, "-c:v", "ffv1", rest)
    interlaced(rest, two, *MPEG2)
    both.write_text("file one.ts\nfile two.ts\n")
    ffmpeg("-f", "concat", "-i", both, "-c", "copy", out)
    return out
