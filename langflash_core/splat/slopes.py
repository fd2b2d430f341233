"""Colours that change with the direction from which they are seen: f_i + A_i d, along unit directions d from
the camera.

What stands a little off its surface shows another part of it from elsewhere, and what shines another light;
to first order both are a slope of the colour. A_i lies across the mean direction m_i of the photos that see a
Gaussian, so that f_i is its colour in their middle, and all that is left where a format holds one colour.
Photos whose directions differ little tell little of A_i: a ridge holds it, as much as photos that differ by
`SPREAD` would pull, and four times as far what is not grey, since far aside of all photos streaks of any
colour are seen first.

Rounds lessen the squared error of all photos. As contributions of a pixel add to 1, by Jensen's inequality

    |sum_i c_ip phi_i^T x_i|^2 <= sum_i c_ip (phi_i^T x_i)^2,     phi = (1, d - m m^T d), x_i = (f_i, A_i)

so that blocks of one Gaussian each, sums of c_ip phi phi^T, bound the normal matrix, and a step by their
inverses never goes too far; of colours alone it is the lumped diagonal of `colours`. f and A are stepped
apart: their products add to nothing where m is the mean. float32; twin: ridge regression of all Gaussians
together in float64, tests/splat/test_slopes.py.

Source: surrogates as of De Pierro 1995; degree 1 of the harmonics of Kerbl et al. 2023.

Sizes: N Gaussians, n of them in one view; B = 1, or 4 with slopes: looks hold f and the three rows of A.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

SPREAD, COLOURED = 0.06, 0.24
"""Radians. Between 8 and 16 photos of two rooms .055 and .08 bring 1.8 and 1.6 dB, 15 degrees aside .6,
30 degrees aside -.1 and +.1; .04 1.9, .5 and -.3 (for all colours alike). That colours are held more takes .1
between and gives .02 aside."""

Sums = tuple[Int[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, "n _"]]
"""Of one view: rows of its Gaussians, sums of their contributions, and directions (n, 3) or bases (n, 4)."""


def directions(means: Float[np.ndarray, "n 3"], centre: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3"]:
    """Unit, from a camera's centre."""
    ways = means - centre
    return ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)


def middles(count: int, views: Iterable[Sums]) -> Float[np.ndarray, "N 3"]:
    """Mean directions from which views see each Gaussian, unit; 0 where none does."""
    total = np.zeros((count, 3), np.float32)
    for ids, sums, ways in views:
        total[ids] += sums[:, None] * ways
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-9)


def bases(ways: Float[np.ndarray, "n 3"], middle: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 4"]:
    """phi of each Gaussian."""
    along = (ways * middle).sum(1, keepdims=True)
    return np.concatenate((np.ones_like(along), ways - along * middle), 1)


def across(looks: Float[np.ndarray, "N B 3"], middle: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N B 3"]:
    """The same colours seen along the middle, and the same slopes across it."""
    along = np.einsum("nk,nkc->nc", middle, looks[:, 1:])
    return np.concatenate(
        ((looks[:, 0] + along)[:, None], looks[:, 1:] - middle[:, :, None] * along[:, None]), 1
    )


@dataclass(frozen=True)
class Steps:
    """Inverse blocks of colours (N, 1), and of slopes (N, 3, 3) with their ridge (N, 1, 1), twice: of what is
    grey, and of what is not; all 0 of what is not seen. Nothing: no slopes."""

    colours: Float[np.ndarray, "N 1"]
    slopes: tuple[tuple[np.ndarray, np.ndarray], ...] = ()

    @staticmethod
    def of(total: Float[np.ndarray, " N"], known: Bool[np.ndarray, " N"], views: Iterable[Sums]) -> "Steps":
        """total: sums of all views. known: whose looks may move. views: with bases; none: no slopes."""
        scale = np.where(known, 1 / np.where(known, total, 1), 0.0)[:, None].astype(np.float32)
        spread = None
        for ids, sums, phi in views:
            spread = np.zeros((len(total), 3, 3), np.float32) if spread is None else spread
            spread[ids] += (sums[:, None] * phi[:, 1:])[:, :, None] * phi[:, None, 1:]
        if spread is None:
            return Steps(scale)
        slopes = []
        for held in (SPREAD, COLOURED):
            ridge, inverse = (np.float32(held**2) * total)[:, None, None], np.zeros_like(spread)
            inverse[known] = np.linalg.inv(spread[known] + ridge[known] * np.eye(3, dtype=np.float32))
            slopes.append((inverse, ridge))
        return Steps(scale, tuple(slopes))

    def taken(self, looks: Float[np.ndarray, "N B 3"], said: Float[np.ndarray, "N B 3"]) -> np.ndarray:
        """Looks (N, B, 3) after a step towards what all views said."""
        colours = looks[:, :1] + self.colours[:, None] * said[:, :1]
        if not self.slopes:
            return colours
        found = looks[:, 1:].copy()
        parts = zip(self.slopes, _parts(looks[:, 1:]), _parts(said[:, 1:]), strict=True)
        for (inverse, ridge), own, told in parts:
            found += inverse @ (told - ridge * own)
        return np.concatenate((colours, found), 1)


def _parts(slopes: Float[np.ndarray, "N 3 3"]) -> tuple[np.ndarray, np.ndarray]:
    """What is grey of slopes (N, 3, 1), and the rest (N, 3, 3): across each other, so stepped apart."""
    grey = slopes.mean(2, keepdims=True)
    return grey, slopes - grey
