"""Colours by name, as people see them under the light of a room.

Colours are CIELAB under the room's own white: what is brightest in a picture, and has least colour itself, is
taken for white (as walls and ceilings are), and every colour is scaled by it in linear light (von Kries).
A name is a region of lightness L, chroma C and hue h with soft borders, so that a thing may be white and
light at once. L in [0, 100]; h in degrees.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from langflash_core.language.settings import LOOK

_TO_XYZ = np.array(  # sRGB, D65, IEC 61966-2-1
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
)
_WHITE = _TO_XYZ.sum(1)


@dataclass(frozen=True)
class Look:
    """A region of colours: ranges of L, C and h, the last from the first hue on upwards, over 360 where it
    wraps."""

    lightness: tuple[float, float] = (-100, 200)
    chroma: tuple[float, float] = (-100, 300)
    hue: tuple[float, float] | None = None


LOOKS: dict[str, Look] = {
    "white": Look((74, 200), (-100, 13)),
    "grey": Look((32, 76), (-100, 11)),
    "black": Look((-100, 27), (-100, 14)),
    "red": Look((6, 66), (20, 300), (-8, 52)),
    "orange": Look((42, 90), (26, 300), (44, 78)),
    "brown": Look((12, 60), (9, 45), (34, 92)),
    "yellow": Look((50, 200), (20, 300), (78, 112)),
    "green": Look((12, 95), (10, 300), (112, 188)),
    "turquoise": Look((25, 95), (10, 300), (170, 242)),
    "blue": Look((10, 92), (9, 300), (222, 306)),
    "purple": Look((10, 90), (13, 300), (292, 345)),
    "pink": Look((52, 96), (11, 75), (325, 395)),
    "beige": Look((56, 96), (6, 32), (52, 108)),
    "golden": Look((40, 88), (26, 80), (66, 98)),
    "wooden": Look((22, 82), (12, 58), (38, 90)),
    "metallic": Look((28, 90), (-100, 10)),
    "dark": Look((-100, 38)),
    "light": Look((62, 200)),
    "colourful": Look((25, 200), (38, 300)),
}
"""By name, under the room's white. The regions are those of the eleven basic colour terms (Berlin and Kay
1969) as people point at them in CIELAB (Sturges and Whitfield 1995), widened to surfaces in shade; wood from
maple to walnut."""
TONES = {
    "gray": "grey", "silver": "metallic", "silvery": "metallic", "steel": "metallic", "metal": "metallic",
    "chrome": "metallic", "stainless": "metallic", "gold": "golden", "brass": "golden", "wood": "wooden",
    "oak": "wooden", "cream": "beige", "ivory": "beige", "tan": "beige", "violet": "purple",
    "lilac": "purple", "magenta": "pink", "teal": "turquoise", "cyan": "turquoise", "navy": "blue",
    "crimson": "red", "bright": "light", "pale": "light", "colorful": "colourful",
}  # fmt: skip
"""Other words for them."""


def linear(rgb: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Linear light in [0, 1] of sRGB values; what lies outside [0, 1] is clipped."""
    clipped = np.clip(np.nan_to_num(rgb), 0.0, 1.0)
    return np.where(clipped <= 0.04045, clipped / 12.92, ((clipped + 0.055) / 1.055) ** 2.4)


def room_white(rgb: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"]:
    """The white (3,) of a room in linear light, from what its pictures show; ones where they show nothing."""
    if not len(rgb):
        return np.ones(3)
    light = linear(rgb)
    brightness = light @ np.array(LOOK.luma)
    low, high = np.quantile(brightness, LOOK.bright)
    bright = light[(brightness >= low) & (brightness <= high)]
    bright = bright if len(bright) else light
    colour = np.ptp(bright, axis=1) / np.maximum(bright.max(1), 1e-6)
    white = np.median(bright[colour <= np.quantile(colour, LOOK.plain)], axis=0)
    top = max(float(white.max()), 1e-6)
    return np.maximum(white, top / LOOK.most_gain) * max(1.0, LOOK.dimmest / top)


def lab(rgb: Float[np.ndarray, "*n 3"], white: Float[np.ndarray, "3"]) -> Float[np.ndarray, "*n 3"]:
    """CIELAB (L, a, b) of sRGB colours, where `white`, in linear light, is white. What is brighter in some
    channel stands in more light, since nothing reflects more than all: it is scaled down to that."""
    reflected = linear(rgb) / white
    reflected = reflected / np.maximum(reflected.max(-1, keepdims=True), 1.0)
    relative = reflected @ _TO_XYZ.T / _WHITE
    cut = 6 / 29
    f = np.where(relative > cut**3, np.cbrt(relative), relative / (3 * cut**2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack((116 * y - 16, 500 * (x - y), 200 * (y - z)), -1)


def looking(colours: Float[np.ndarray, "*n 3"], name: str) -> Float[np.ndarray, "*n"]:
    """How well CIELAB colours are called so, in [0, 1].

    Raises:
        KeyError: there is no such look in `LOOKS`.
    """
    return _fitting(colours, LOOKS[name])


def tinted(colours: Float[np.ndarray, "*n 3"], name: str) -> Float[np.ndarray, "*n"]:
    """The same by hue alone, of what has one: in dim or misty light colours are dark or pale."""
    look = LOOKS[name]
    if look.hue is None:
        return looking(colours, name)
    low, high = look.hue
    hue = (low - LOOK.soft_h / 2, high + LOOK.soft_h / 2)
    return _fitting(colours, Look(chroma=(LOOK.tint, look.chroma[1]), hue=hue))


def _fitting(colours: Float[np.ndarray, "*n 3"], look: Look) -> Float[np.ndarray, "*n"]:
    lightness, chroma = colours[..., 0], np.hypot(colours[..., 1], colours[..., 2])
    well = _within(lightness, look.lightness, LOOK.soft_l) * _within(chroma, look.chroma, LOOK.soft_c)
    if look.hue is None:
        return well
    middle, half = sum(look.hue) / 2, (look.hue[1] - look.hue[0]) / 2
    hue = np.degrees(np.arctan2(colours[..., 2], colours[..., 1]))
    away = abs((hue - middle + 180) % 360 - 180) - half
    return well * np.clip(0.5 - away / LOOK.soft_h, 0, 1)


def _within(
    values: Float[np.ndarray, "*n"], ends: tuple[float, float], soft: float
) -> Float[np.ndarray, "*n"]:
    """1 inside, 0 outside, 0.5 at the ends."""
    inside = np.minimum(values - ends[0], ends[1] - values)
    return np.clip(0.5 + inside / soft, 0, 1)
