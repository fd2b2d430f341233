"""Gaussians as small integers, as SOG and web pages hold them.

Positions x are sign(x) log(1 + |x|) in 16 bits between bounds: fine near the middle, coarse far away.
Rotations are the smallest three entries of wxyz in 8 bits each and the place of the largest. Log scales
and f_dc are places in books of 256 numbers, opacities 8 bits. Harmonics are a palette of at most 8,192
vectors, its numbers places in a book of 256 of their own.
"""

import math
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from langflash_core.export.codebooks import palette, scalar_codebook
from langflash_core.export.packing import smallest_three
from langflash_core.export.settings import QUANTISING
from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.types import Gaussians

_STEPS = 65535  # of positions: two bytes


@dataclass(frozen=True)
class Palette:
    """k vectors of B harmonics above degree 0: `places` (k, B, 3) in `book`; `labels` (n,) name vectors."""

    book: np.ndarray
    places: np.ndarray
    labels: np.ndarray


@dataclass(frozen=True)
class Quantised:
    """n Gaussians: `steps` (n, 3) of 65535 between `lowest` and `highest` (3,), logarithms as above;
    `largest` (n,) and `turns` (n, 3); `scales` and `colours` (n, 3), places in their books;
    `opacities` (n,) of 255; `harmonics` None where there are none."""

    lowest: np.ndarray
    highest: np.ndarray
    steps: np.ndarray
    largest: np.ndarray
    turns: np.ndarray
    scale_book: np.ndarray
    scales: np.ndarray
    colour_book: np.ndarray
    colours: np.ndarray
    opacities: np.ndarray
    harmonics: Palette | None


def quantise(gaussians: Gaussians, means: Tensor | None = None) -> Quantised:
    """Gaussians, at least one, in their own order; harmonics to degree 3.

    Args:
        means: (n, 3) positions instead, around another middle.
    """
    places = gaussians.means if means is None else means
    quats, scales, opacities, sh = (
        values.detach().cpu().float().numpy()
        for values in (gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh)
    )
    around = places.detach().cpu().double().numpy()
    logs = np.sign(around) * np.log1p(np.abs(around))
    lowest, highest = logs.min(0), logs.max(0)
    span = np.where(highest > lowest, highest - lowest, 1)
    largest, others = smallest_three(quats)
    scale_book, scale_places = scalar_codebook(np.log(scales), QUANTISING.book)
    colour_book, colour_places = scalar_codebook(sh[:, 0], QUANTISING.book)
    return Quantised(
        lowest=lowest,
        highest=highest,
        steps=np.round((logs - lowest) / span * _STEPS).astype(int),
        largest=largest,
        turns=np.clip(np.round((others * math.sqrt(2) * 0.5 + 0.5) * 255), 0, 255).astype(int),
        scale_book=scale_book,
        scales=scale_places,
        colour_book=colour_book,
        colours=colour_places,
        opacities=np.round(np.clip(opacities, 0, 1) * 255).astype(int),
        harmonics=_palette(sh[:, 1 : (MAX_SHOWN_DEGREE + 1) ** 2]) if sh.shape[1] > 1 else None,
    )


def _palette(rest: np.ndarray) -> Palette:
    """Of coefficients (n, B, 3)."""
    entries, labels = palette(rest.reshape(len(rest), -1), QUANTISING.palette)
    book, places = scalar_codebook(entries, QUANTISING.book)
    return Palette(book, places.reshape(len(entries), rest.shape[1], 3), labels)
