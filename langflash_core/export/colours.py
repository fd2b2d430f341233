"""Colours of pictures: a heat scale of rising brightness, and hues that tell labels apart."""

import colorsys

import numpy as np
import torch
from torch import Tensor

from langflash_core.colormaps import colour_stops
from langflash_core.formats import COLOUR_MAPS

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
