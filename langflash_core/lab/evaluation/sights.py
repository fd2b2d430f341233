"""What a judged scene looks like, for people: small pictures with a name and a few numbers.

Pictures are (H, W, 3) uint8.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from jaxtyping import Float, Integer, UInt8
from torch import Tensor
from torch.nn import functional as F

from langflash_core.export.colours import heat, label_colours
from langflash_core.export.png import to_8bit
from langflash_core.lab.evaluation.sharp_measures import fine, grey_of

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
TIMES = 3
"""A close-up shows a third of the picture's width and height, each pixel as 3 x 3."""


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
    """[0, 1] in the program's own scale, night blue to pale yellow."""
    return to_8bit(heat(torch.from_numpy(values)))


def label_picture(labels: Integer[np.ndarray, "H W"]) -> Picture:
    """Labels in their colours; -1 in `UNKNOWN`."""
    rows = int(labels.max(initial=0)) + 1
    colours = np.array([*label_colours(rows), UNKNOWN], dtype=np.uint8)
    return colours[np.where(labels < 0, rows, labels)]


def legend_of(names: Sequence[str], *maps: Integer[np.ndarray, "H W"]) -> dict[str, tuple[int, int, int]]:
    """Colours of the labels that cover at least a hundredth of one of the maps; `names`: by label."""
    shares = [np.bincount(labels[labels >= 0], minlength=len(names)) / labels.size for labels in maps]
    common = np.max(shares, axis=0) >= 0.01
    colours = label_colours(len(names)).tolist()
    return {names[row]: tuple(colours[row]) for row in np.flatnonzero(common).tolist()}


def depth_picture(depths: Float[np.ndarray, "H W"], longest: float) -> Picture:
    """Near is bright; 0 in `UNKNOWN`."""
    picture = heat_picture(1 - np.clip(depths / max(longest, 1e-9), 0, 1))
    picture[depths <= 0] = UNKNOWN
    return picture


def busiest_corner(photo: Float[Tensor, "H W 3"], height: int, width: int) -> tuple[int, int]:
    """(top, left) of the window of that size, at least 3 x 3 pixels, with the most fine detail."""
    energy = fine(grey_of(photo)).square()[None, None]
    means = F.avg_pool2d(energy, (height - 2, width - 2), stride=1)[0, 0]
    place = int(means.argmax())
    return place // means.shape[1], place % means.shape[1]


def closeups(pictures: Mapping[str, Tensor], times: int = TIMES) -> dict[str, UInt8[np.ndarray, "H W 3"]]:
    """The same window of every picture, where the first one has the most detail, each pixel `times` wide.

    Args:
        pictures: (H, W, 3) in [0, 1] by title, of one size, the photo first.
    """
    photo = next(iter(pictures.values()))
    height, width = (max(3, side // TIMES) for side in photo.shape[:2])
    top, left = busiest_corner(photo, height, width)
    return {
        title: photo_picture(rgb[top : top + height, left : left + width])
        .repeat(times, axis=0)
        .repeat(times, axis=1)
        for title, rgb in pictures.items()
    }
