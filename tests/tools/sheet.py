"""Screenshots with captions on one sheet, small enough for a README."""

import io
from dataclasses import dataclass
from pathlib import Path

import imgui_bundle
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from langflash_core.base.files import write_atomically

FONT = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
GAP, CAPTION = 12, 30  # pixels
GROUND, INK = (255, 255, 255), (40, 42, 46)


@dataclass(frozen=True)
class Shot:
    """A screenshot (h, w, 3) uint8 and what it shows."""

    caption: str
    picture: np.ndarray


def write_sheet(shots: list[Shot], path: Path, columns: int, width: int, numbered: bool = True) -> None:
    """One PNG of all shots, each `width` pixels wide; all have the same shape."""
    tall, wide = shots[0].picture.shape[:2]
    height = round(width * tall / wide)
    rows = -(-len(shots) // columns)
    cell = (width + GAP, height + CAPTION + GAP)
    sheet = Image.new("RGB", (columns * cell[0] + GAP, rows * cell[1] + GAP), GROUND)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.truetype(str(FONT), 17)
    for place, shot in enumerate(shots):
        x, y = GAP + place % columns * cell[0], GAP + place // columns * cell[1]
        words = f"{place + 1}. {shot.caption}" if numbered else shot.caption
        draw.text((x + 2, y + 3), words, INK, font)
        small = Image.fromarray(shot.picture).resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (x, y + CAPTION))
    _write(sheet, path)


def write_picture(picture: np.ndarray, path: Path, width: int = 960) -> None:
    """One PNG of one screenshot, `width` pixels wide."""
    tall, wide = picture.shape[:2]
    small = Image.fromarray(picture).resize((width, round(width * tall / wide)), Image.Resampling.LANCZOS)
    _write(small, path)


def _write(image: Image.Image, path: Path) -> None:
    """With a palette: a third of the bytes, and on such pictures hard to tell from all colours."""
    stream = io.BytesIO()
    small = image.quantize(256, Image.Quantize.MEDIANCUT, kmeans=3, dither=Image.Dither.NONE)
    small.save(stream, "PNG", optimize=True)
    write_atomically(path, stream.getvalue())
