"""Colours of pictures: a heat scale of rising brightness, and hues that tell labels apart; and encodings.

Scenes, pictures and nearly all splat files hold sRGB values. Materials and corners of glTF, and splats that
say so, are linear.
"""

import colorsys
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.colormaps import colour_stops
from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.export.stored import Rows
from langflash_core.geometry.harmonics import SH_C0

# How glTF and OpenUSD call them (of a display, of a scene; to photos that is one), and drafts of glTF's.
_SRGB = ("srgb_rec709_display", "srgb_rec709_scene", "BT.709-sRGB")
_LINEAR = ("lin_rec709_display", "lin_rec709_scene", "BT.709-linear")
_UNSAID = (None, "", "raw", "data", "identity", "unknown")  # the last four as OpenUSD has them
_GOLDEN = 0.61803398875  # successive hues stay far apart for any number of labels


def heat(values: Tensor, colormap: str = COLOUR_MAPS[0]) -> Tensor:
    """Colours (..., 3) in [0, 1] of values (...) in [0, 1]; outside is clamped, NaN is 0.

    Raises:
        ValueError: there is no such colour map.
    """
    stops = torch.tensor(colour_stops(colormap), device=values.device)
    position = torch.nan_to_num(values.float(), nan=0.0).clamp(0, 1) * (len(stops) - 1)
    lower = position.floor().clamp_max(len(stops) - 2).long()
    share = (position - lower)[..., None]
    return stops[lower] * (1 - share) + stops[lower + 1] * share


def linear(colours: np.ndarray) -> np.ndarray:
    """Linear values of sRGB ones in [0, 1]. Source: IEC 61966-2-1."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True)
class Encoding:
    """How the colours of a file's splats are encoded. said: what a person is told of it; "" is nothing."""

    linear: bool
    said: str = ""


def encoding_of(space: str | None, name: str) -> Encoding:
    """The encoding of a colour space that a file called `name` names, or names none: trainers' is sRGB."""
    if space in _LINEAR:
        seen = "what is seen through others may look a little different"
        return Encoding(True, f"{name} has linear colours; each became an sRGB one, so {seen}.")
    if space in _SRGB + _UNSAID:
        return Encoding(False)
    shown = f"'{str(space)[:60]}', which this program does not know"
    return Encoding(False, f"{name} has colours in {shown}; they are taken for sRGB.")


def with_srgb_colours(rows: Rows) -> Rows:
    """Rows of linear colours with sRGB ones: the base colour exactly, what depends on direction to first
    order."""
    base = np.clip(0.5 + SH_C0 * rows.sh[:, :1], 0, None)
    low = base <= 0.0031308
    power = np.maximum(base, 0.0031308)
    slope = np.where(low, 12.92, 1.055 / 2.4 * power ** (1 / 2.4 - 1))
    sh = rows.sh * slope
    sh[:, :1] = (np.where(low, 12.92 * base, 1.055 * power ** (1 / 2.4) - 0.055) - 0.5) / SH_C0
    return replace(rows, sh=sh.astype(np.float32))


def label_colours(count: int) -> np.ndarray:
    """(count, 3) uint8, distinct from each other and from black."""
    # Five shades, because hues come near each other again after 8, 13 and 21 labels.
    shades = [(0.7, 1.0), (0.65, 0.75), (0.4, 1.0), (0.85, 0.95), (0.4, 0.7)]
    hues = [(0.08 + index * _GOLDEN) % 1 for index in range(count)]
    colours = [colorsys.hsv_to_rgb(hue, *shades[index % 5]) for index, hue in enumerate(hues)]
    return np.round(np.array(colours).reshape(count, 3) * 255).astype(np.uint8)


def atom_colours(dictionary: np.ndarray) -> np.ndarray:
    """Colours (K, 3) in [0.1, 0.95] from the first three principal axes of the atoms (K, C).

    Made from the whole dictionary, so that an atom has one colour in every view. Each axis'
    sign makes its largest entry positive. An atom that is not finite counts as one of length 0.
    """
    count = dictionary.shape[0]
    if count == 0:
        return np.zeros((0, 3), np.float32)
    dictionary = np.where(np.isfinite(dictionary).all(1, keepdims=True), dictionary, 0.0)
    centred = dictionary - dictionary.mean(0)
    left, values, _ = np.linalg.svd(centred, full_matrices=False)
    scores = np.zeros((count, 3))
    used = min(3, len(values))
    scores[:, :used] = left[:, :used] * values[:used]
    scores *= np.where(scores[np.abs(scores).argmax(0), range(3)] < 0, -1.0, 1.0)
    low, high = scores.min(0), scores.max(0)
    flat = high - low < 1e-9  # one atom, or all alike: mid grey on that axis
    shares = np.where(flat, 0.5, (scores - low) / np.where(flat, 1.0, high - low))
    return (0.1 + 0.85 * shares).astype(np.float32)
