"""Small pictures made on the spot, with and without the marks of real cameras."""

import io
from pathlib import Path

import numpy as np
from PIL import Image

EXIF_IFD = 0x8769


def room_picture(width: int = 320, height: int = 240, seed: int = 0) -> Image.Image:
    """Flat coloured rectangles with sharp edges: furniture enough for triage."""
    rng = np.random.default_rng(seed)
    pixels = np.full((height, width, 3), 150, np.uint8)
    for _ in range(40):
        x, y = int(rng.integers(0, width)), int(rng.integers(0, height))
        wide, high = int(rng.integers(10, width // 3)), int(rng.integers(10, height // 3))
        pixels[y : y + high, x : x + wide] = rng.integers(30, 230, 3)
    return Image.fromarray(pixels)


def exif(**tags) -> Image.Exif:
    """EXIF with orientation (main block) and lens tags (Exif block) by their numbers' names."""
    numbers = {
        "focal_35mm": 0xA405, "focal": 0x920A, "plane_x": 0xA20E, "plane_unit": 0xA210, "pixel_x": 0xA002,
        "pixel_y": 0xA003,
    }  # fmt: skip
    block = Image.Exif()
    if "orientation" in tags:
        block[0x0112] = tags.pop("orientation")
    block.get_ifd(EXIF_IFD).update({numbers[name]: value for name, value in tags.items()})
    return block


def saved(image: Image.Image, path: Path, **options) -> Path:
    image.save(path, **options)
    return path


def encoded(image: Image.Image, kind: str, **options) -> bytes:
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()
