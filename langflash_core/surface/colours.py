"""Colours solved for, not copied: those with which the picture drawn at a photo's place is the photo.

What a pixel shows is a mean of several Gaussians, so colours taken from the photo come out blurred. With
the contributions c_ip of every Gaussian to every pixel (`mixing`), rounds of

    f_i += sum_p c_ip (photo(p) - F(p)) / sum_p c_ip

lessen sum |photo - F|^2 (Landweber's iteration, the normal matrix lumped onto its diagonal: SART of
Andersen and Kak 1984 with one subset), each begun a little ahead of the last (Beck and Teboulle 2009,
FISTA). Colours stay within [0, 1].

Sizes: N Gaussians, n of them seen, h w pixels of the photo.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import project
from langflash_core.surface.settings import COLOURS
from langflash_core.types import Camera, Gaussians


@dataclass(frozen=True)
class Solved:
    """colours: (N, 3) in [0, 1]. seen: (N,) what each contributes to the picture, pixels. psnr: dB of the
    picture beside the photo before the rounds and after them, where something is drawn."""

    colours: Float[Tensor, "N 3"]
    seen: Float[Tensor, " N"]
    psnr: tuple[float, float]


@torch.no_grad()
def solved_colours(
    gaussians: Gaussians,
    start: Float[Tensor, "N 3"],
    camera: Camera,
    photo: Float[Tensor, "3 h w"],
    rounds: int = COLOURS.rounds,
) -> Solved:
    """Colours of Gaussians from the photo that a camera took.

    Args:
        gaussians: N of them, whose own colours are not looked at.
        start: (N, 3), colours to begin with.
        camera: of the photo's size. photo: (3, h, w) in [0, 1]; pixels that are no numbers say nothing.
    """
    first = start.detach().cpu().numpy().astype(np.float32)
    footprints = project(gaussians.map(lambda values: values.float()), camera)
    some, matrix = _drop_empty_columns(mixing(footprints, camera, len(first)))
    drawn = _Drawn.of(matrix, photo)
    colours, seen = first.copy(), np.zeros(len(first), np.float32)
    colours[some], seen[some] = drawn.solve(first[some], rounds), drawn.sums[:, 0]
    psnr = drawn.psnr(first[some]), drawn.psnr(colours[some])
    return Solved(torch.from_numpy(colours), torch.from_numpy(seen), psnr)


@dataclass(frozen=True)
class _Drawn:
    """contributions: (h w, n), of 1 a pixel where at least half of its light is drawn and the photo is a
    number, else of 0. photo: (h w, 3), 0 there. shown: (h w, 1), 1 or 0. sums: (n, 1) of contributions."""

    contributions: scipy.sparse.csr_matrix
    photo: np.ndarray
    shown: np.ndarray
    sums: np.ndarray

    @staticmethod
    def of(matrix: scipy.sparse.csr_matrix, photo: Tensor) -> "_Drawn":
        light = np.asarray(matrix.sum(1)).ravel()
        flat = photo.movedim(0, -1).flatten(0, 1).cpu().numpy().astype(np.float32)
        shown = (light >= COLOURS.least) & np.isfinite(flat).all(1)
        flat[~shown] = 0
        matrix.data *= np.repeat(shown / np.maximum(light, COLOURS.least), np.diff(matrix.indptr)).astype(
            np.float32
        )
        sums = matrix.T @ np.ones((len(flat), 1), np.float32)
        return _Drawn(matrix, flat, shown[:, None].astype(np.float32), sums)

    def solve(self, start: np.ndarray, rounds: int) -> np.ndarray:
        """Colours (n, 3) after some rounds."""
        steps = np.where(self.sums > COLOURS.seen, 1 / np.maximum(self.sums, COLOURS.seen), 0)
        colours = ahead = start
        pace = 1.0
        for _ in range(rounds):
            found = np.clip(ahead + steps * (self.contributions.T @ self._wrong(ahead)), 0, 1)
            following = (1 + math.sqrt(1 + 4 * pace * pace)) / 2
            ahead = found + np.float32((pace - 1) / following) * (found - colours)
            colours, pace = found, following
        return colours

    def _wrong(self, colours: np.ndarray) -> np.ndarray:
        """(h w, 3) the photo less the picture, 0 where nothing is drawn."""
        return (self.photo - self.contributions @ colours) * self.shown

    def psnr(self, colours: np.ndarray) -> float:
        """dB of what is drawn in colours (n, 3)."""
        square = np.square(self._wrong(colours)).sum(dtype=np.float64)
        mean = float(square / max(1.0, 3 * float(self.shown.sum())))
        return -10 * math.log10(max(mean, 1e-10))


def _drop_empty_columns(matrix: scipy.sparse.csr_matrix) -> tuple[np.ndarray, scipy.sparse.csr_matrix]:
    """Which columns of a matrix are not empty, and the matrix of these."""
    rows, columns = matrix.get_shape()
    used = np.zeros(columns, bool)
    used[matrix.indices] = True
    places = (np.cumsum(used, dtype=np.int32) - 1).astype(np.int32)
    seen = np.flatnonzero(used)
    parts = (matrix.data, places[matrix.indices], matrix.indptr)
    return seen, scipy.sparse.csr_matrix(parts, shape=(rows, len(seen)))
