"""Gaussians that hinder: without each of which alone the pictures are nearer to the photos.

Where depth jumps, some Gaussians of one photo hang before what others show, and no colour mends that.
With T_i the light that reaches i at a pixel, c_i = T_i alpha_i, colours f and F = sum_i c_i f_i, what lies
behind i gets 1 / (1 - alpha_i) times its light once i is gone, so that F becomes

    F + alpha_i / (1 - alpha_i) B_i - c_i f_i,     B_i = sum of c_j f_j over all j behind i

and the squared error falls by |F - photo|^2 less that of the new F. Where nothing is behind, the pixel
becomes darker, so that a hole does not pay in the photos; between them it may open, which is why only many
photos judge. Each is judged with all others there, though many go at once: holes open where each of two that
lie on one another could go alone. So only those go by which much is gained, in all and of what they show; the
others, nine of ten, gain nothing together. float32, sums of a picture in float64. Twin:
`reference.rasterize` without each of them, tests/splat/test_hindering.py.

Source: own; that of what is drawn is the compositing of Porter and Duff 1984.

Sizes: P pixels of a view, n Gaussians that it shows, M pairs of both, N Gaussians.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
from jaxtyping import Bool, Float, Int

from langflash_core.splat.projection import ALPHA_MAX

_PASSED = 1e-4  # of a pixel's light, the least that is taken to reach a pair which is listed
_WITNESSES = 4
"""Views that show a Gaussian which may go: two and three let whole panes of a window go."""
_LEAST, _OF_SHOWN = 0.1, 0.006
"""Squared errors that each must take away, over all pixels, and per contribution (11 steps of 255). Between
32 photos of a room nothing, .1, and both bring 31.53, 31.63, 32.21 dB: smudges on a plain wall are gone."""
_SEEN = 0.05  # contributions of a Gaussian over all pixels, from which a view shows it


@dataclass(frozen=True)
class Pairs:
    """A view's pairs of a pixel and a Gaussian, pixel by pixel and front to back: pixels, Gaussians,
    contributions of the light that stays at the pixel, alphas; starts: where each pixel's begin."""

    pixels: Int[np.ndarray, " M"]
    ids: Int[np.ndarray, " M"]
    shares: Float[np.ndarray, " M"]
    alphas: Float[np.ndarray, " M"]
    starts: Int[np.ndarray, " P1"]

    @staticmethod
    def of(contributions: scipy.sparse.csr_matrix, light: Float[np.ndarray, " P"]) -> "Pairs":
        """Of contributions (P, n), in parts of a pixel's sum, front to back.

        Args:
            light: (P,) in [0, 1] that stays at each pixel.
        """
        starts = contributions.indptr
        pixels = np.repeat(np.arange(len(light), dtype=np.int32), np.diff(starts))
        shares = (contributions.data * light[pixels]).astype(np.float32)
        sums = np.concatenate(([0.0], np.cumsum(shares, dtype=np.float64)))
        before = (sums[:-1] - sums[starts[:-1]][pixels]).astype(np.float32)
        alphas = np.clip(shares / np.maximum(1 - before, _PASSED), 0, ALPHA_MAX)
        return Pairs(pixels, contributions.indices, shares, alphas.astype(np.float32), starts)

    def gains(
        self,
        colours: Float[np.ndarray, "n 3"],
        photo: Float[np.ndarray, "P 3"],
        shown: Bool[np.ndarray, " P"],
    ) -> Float[np.ndarray, " n"]:
        """By how much the view's squared error over the pixels that are `shown` falls if each Gaussian alone
        goes."""
        kept, found = self.alphas / (1 - self.alphas), np.zeros(len(self.shares), np.float32)
        for channel in range(3):
            own = self.shares * colours[self.ids, channel]
            sums = np.concatenate(([0.0], np.cumsum(own, dtype=np.float64)))
            ends = sums[self.starts[1:]]
            wrong = (ends - sums[self.starts[:-1]]).astype(np.float32) - photo[:, channel]
            behind = (ends[self.pixels] - sums[1:]).astype(np.float32)
            change = behind * kept - own
            found -= change * (2 * wrong[self.pixels] + change)
        found[~shown[self.pixels]] = 0
        return np.bincount(self.ids, found, len(colours))

    def sums(self, count: int) -> Float[np.ndarray, " n"]:
        """What each of so many Gaussians contributes in all."""
        return np.bincount(self.ids, self.shares, count)

    def without(
        self, gone: Bool[np.ndarray, " n"]
    ) -> tuple[scipy.sparse.csr_matrix, Float[np.ndarray, " P"]]:
        """Contributions (P, n) once some Gaussians are gone, and the light (P,) that stays: what is listed
        behind them gets theirs."""
        count = len(self.starts) - 1
        stay = ~gone[self.ids]
        alphas, pixels = self.alphas[stay], self.pixels[stay]
        starts = np.concatenate(([0], np.cumsum(np.bincount(pixels, minlength=count))))
        passed = np.concatenate(([0.0], np.cumsum(np.log1p(-alphas), dtype=np.float64)))
        shares = alphas * np.exp(passed[:-1] - passed[starts[:-1]][pixels]).astype(np.float32)
        parts = (shares, self.ids[stay], starts.astype(self.starts.dtype))
        light = np.bincount(pixels, shares, count).astype(np.float32)
        return scipy.sparse.csr_matrix(parts, shape=(count, len(gone))), light


@dataclass
class Tally:
    """gains (N,): by how much the squared error of all views so far falls if each Gaussian alone goes;
    shown (N,): its contributions in all of them; witnesses (N,): how many of them show it."""

    gains: Float[np.ndarray, " N"]
    shown: Float[np.ndarray, " N"]
    witnesses: Int[np.ndarray, " N"]

    @staticmethod
    def of(count: int) -> "Tally":
        return Tally(np.zeros(count), np.zeros(count), np.zeros(count, np.int64))

    def take(
        self,
        ids: Int[np.ndarray, " n"],
        gains: Float[np.ndarray, " n"],
        sums: Float[np.ndarray, " n"],
    ) -> None:
        """What one view says of the Gaussians `ids` that it shows, as `Pairs` has it."""
        self.gains[ids] += gains
        self.shown[ids] += sums
        self.witnesses[ids] += sums > _SEEN

    @property
    def hindering(self) -> Bool[np.ndarray, " N"]:
        """Those without each of which the pictures are much nearer to the photos."""
        return (self.gains > np.maximum(_LEAST, _OF_SHOWN * self.shown)) & (self.witnesses >= _WITNESSES)
