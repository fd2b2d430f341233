"""What a judged scene looks like, for people: small pictures with a name and a few numbers.

Pictures are (H, W, 3) uint8.
"""

import colorsys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Integer, UInt8
from torch import Tensor

Picture = UInt8[np.ndarray, "H W 3"]
UNKNOWN = (38, 38, 42)
"""Colour of what nobody labelled, drew or saw."""


@dataclass(frozen=True)
class Sight:
    """One scene. key: of its tally; name: for people; pictures by title, in order, all of one size; numbers
    by title; worth: more is better, NaN where nothing was judged; legend: labels that occur, by colour."""

    key: str
    name: str
    pictures: Mapping[str, np.ndarray]
    numbers: Mapping[str, float]
    worth: float
    legend: Mapping[str, tuple[int, int, int]] = field(default_factory=dict)


Look = Callable[[Sight], None]


def photo_picture(rgb: Tensor) -> Picture:
    """(H, W, 3) values in [0, 1], clamped."""
    return (rgb.detach().cpu().float().clamp(0, 1) * 255).round().byte().numpy()


def error_picture(rgb: Tensor, photo: Tensor, seen: np.ndarray | None = None) -> Picture:
    """Mean absolute difference over the colours, black to white at .5; grey-blue where nothing is judged."""
    error = (rgb.detach().cpu().float().clamp(0, 1) - photo.cpu().float()).abs().mean(-1).numpy()
    picture = heat_picture(np.minimum(error * 2, 1))
    if seen is not None:
        picture[~seen] = UNKNOWN
    return picture


def heat_picture(values: Float[np.ndarray, "H W"]) -> Picture:
    """[0, 1] as black, purple, orange, pale yellow."""
    stops = np.array([[0, 0, 4], [87, 16, 110], [188, 55, 84], [249, 142, 9], [252, 255, 164]], dtype=float)
    places = np.clip(values, 0, 1) * (len(stops) - 1)
    low = np.floor(places).astype(int).clip(0, len(stops) - 2)
    share = (places - low)[..., None]
    return ((1 - share) * stops[low] + share * stops[low + 1]).round().astype(np.uint8)


def label_colour(row: int) -> tuple[int, int, int]:
    """Of a label: far from those of its neighbours in the list."""
    hue = (row * 0.61803398875) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.45 + 0.4 * ((row // 5) % 2), 0.95 - 0.25 * (row % 3) / 2)
    return round(red * 255), round(green * 255), round(blue * 255)


def label_picture(labels: Integer[np.ndarray, "H W"]) -> Picture:
    """Labels in their colours; -1 in `UNKNOWN`."""
    rows = int(labels.max(initial=0)) + 1
    colours = np.array([*(label_colour(row) for row in range(rows)), UNKNOWN], dtype=np.uint8)
    return colours[np.where(labels < 0, rows, labels)]


def legend_of(names: Sequence[str], *maps: Integer[np.ndarray, "H W"]) -> dict[str, tuple[int, int, int]]:
    """Colours of the labels that cover at least a hundredth of one of the maps; `names`: by label."""
    shares = [np.bincount(labels[labels >= 0], minlength=len(names)) / labels.size for labels in maps]
    common = np.max(shares, axis=0) >= 0.01
    return {names[row]: label_colour(row) for row in np.flatnonzero(common).tolist()}


def depth_picture(depths: Float[np.ndarray, "H W"], longest: float) -> Picture:
    """Near is bright; 0 in `UNKNOWN`."""
    picture = heat_picture(1 - np.clip(depths / max(longest, 1e-9), 0, 1))
    picture[depths <= 0] = UNKNOWN
    return picture
