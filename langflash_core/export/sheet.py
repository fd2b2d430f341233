"""Contact sheets: pictures side by side, each under its caption."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from langflash_core.export.settings import SHEET


def add_caption(picture: UInt8[np.ndarray, "H W 3"], text: str) -> UInt8[np.ndarray, "h w 3"]:
    """A picture under its caption, on black; what does not fit of the caption ends in dots."""
    height, width = picture.shape[:2]
    cell = Image.new("RGB", (width + 2 * SHEET.gap, height + SHEET.caption + 2 * SHEET.gap))
    cell.paste(Image.fromarray(picture), (SHEET.gap, SHEET.caption))
    font, draw = ImageFont.load_default(13), ImageDraw.Draw(cell)
    shown = text
    while draw.textlength(shown, font) > width - SHEET.gap and len(shown) > 1:
        text = text[:-1]
        shown = text.rstrip() + "..."
    draw.text((2 * SHEET.gap, 1), shown, fill=SHEET.light, font=font)
    return np.asarray(cell)


def contact_sheet(
    tiles: Sequence[tuple[str, UInt8[np.ndarray, "_h _w 3"]]], columns: int | None = None
) -> UInt8[np.ndarray, "H W 3"]:
    """Pictures of one shape in rows, made smaller to 240 pixels wide; row by row as they come.

    Args:
        columns: None: as many as make the sheet about as wide as high.
    """
    cells = [add_caption(thumbnail(picture), caption) for caption, picture in tiles]
    wide = columns or math.ceil(math.sqrt(len(cells) * cells[0].shape[0] / cells[0].shape[1]))
    blank = np.zeros_like(cells[0])
    cells += [blank] * (-len(cells) % wide)
    rows = [np.concatenate(cells[first : first + wide], 1) for first in range(0, len(cells), wide)]
    return np.concatenate(rows)


def thumbnail(picture: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "h w 3"]:
    """As large as a sheet shows it; one of that width stays as it is."""
    height, width = picture.shape[:2]
    size = (SHEET.width, max(1, round(height * SHEET.width / width)))
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.LANCZOS))
