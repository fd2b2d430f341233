"""Colours solved for, not copied: those with which the pictures drawn at the photos' places are the
photos.

What a pixel shows is a mean of several Gaussians, so colours taken from the photo come out blurred. With
the contributions c_ip of every view (`mixing`), rounds of

    f_i += sum over views and p of t_iv c_ip (photo(p) - F(p)) / sum of t_iv c_ip

lessen sum |photo - F|^2 (Landweber's iteration, the normal matrix lumped onto its diagonal: SART of
Andersen and Kak 1984 with one subset), each begun a little ahead of the last (Beck and Teboulle 2009,
FISTA). Colours stay within [0, 1] or, with `ringing`, near what the photos show around a Gaussian.

Sizes: V views, N Gaussians, h w pixels of a photo.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import scipy.sparse
import torch
from torch import Tensor

from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import Footprints, project
from langflash_core.types import Camera, Gaussians

ROUNDS = 8
_LEAST = 0.5  # of a pixel's light, from which a picture says what is wrong there
_WINDOWS, _FINE = (5, 13), 1.5
"""Sides of what is around a Gaussian, pixels, below and from a deviation on."""
_STEP = 0.5 / 255  # to which the photo is rounded there
_OF_VIEWS = 0.75  # of the time, for which contributions are listed
_SEEN = 0.05  # contributions of a Gaussian over all pixels, below which its colour stays


@dataclass(frozen=True)
class Solved:
    """colours: (N, 3) in [0, 1]. psnr: dB of each view before the rounds and after them."""

    colours: Tensor
    psnr: tuple[tuple[float, float], ...]


@torch.no_grad()
def solved_colours(
    gaussians: Gaussians,
    start: Tensor,
    cameras: Sequence[Camera],
    photos: Sequence[Tensor],
    trusts: Sequence[Tensor] | None = None,
    rounds: int = ROUNDS,
    ringing: float | None = None,
    progress: Callable[[float], None] = lambda done: None,
) -> Solved:
    """Colours of Gaussians from all their photos.

    Args:
        gaussians: N of them, whose own colours are not looked at.
        start: (N, 3), colours to begin with.
        cameras: of the photos' size. photos: (3, h, w) in [0, 1]; pixels that are no numbers say nothing.
        trusts: (N,) >= 0 of each view, what its photo counts for a Gaussian; None: 1.
        ringing: how far colours may leave what the photos show around a Gaussian, in parts of how much that
            differs; None: within [0, 1], as far as they like.
        progress: called with the share that is done, before every view and every round; what it raises ends
            the work there.
    """
    given = list(zip(cameras, photos, trusts or [None] * len(photos), strict=True))
    views = []
    for camera, photo, trust in given:
        progress(_OF_VIEWS * len(views) / len(given))
        views.append(_View.of(gaussians, camera, photo, trust))
    colours = start.detach().cpu().numpy().astype(np.float32)
    total = np.sum([view.sums for view in views], axis=0)
    scale = np.where(total > _SEEN, 1 / np.maximum(total, _SEEN), 0.0)[:, None].astype(np.float32)
    low, high = _bounds(views, colours, ringing)
    before = [view.error(colours) for view in views]
    ahead, pace = colours, 1.0
    for number in range(rounds):
        progress(_OF_VIEWS + (1 - _OF_VIEWS) * number / rounds)
        step = np.sum([view.carried_back(ahead) for view in views], axis=0)
        found = np.clip(ahead + scale * step, low, high)
        following = (1 + math.sqrt(1 + 4 * pace * pace)) / 2
        ahead = found + ((pace - 1) / following) * (found - colours)
        colours, pace = found, following
    after = [view.error(colours) for view in views]
    return Solved(torch.from_numpy(colours), tuple(zip(before, after, strict=True)))


def _bounds(
    views: Sequence["_View"], start: np.ndarray, ringing: float | None
) -> tuple[np.ndarray | float, np.ndarray | float]:
    """The least and the most (N, 3) that colours may be."""
    if ringing is None:
        return 0.0, 1.0
    low, high = start.copy(), start.copy()
    for view in views:
        ids, least, most = view.around()
        low[ids], high[ids] = np.minimum(low[ids], least), np.maximum(high[ids], most)
    margin = ringing * (high - low) + _STEP
    return np.clip(low - margin, 0, 1), np.clip(high + margin, 0, 1)


@dataclass(frozen=True)
class _View:
    """contributions: (h w, N), of 1 a pixel where anything is drawn. back: its transpose, times the trust.
    photo: (h w, 3). sums: (N,) of `back`. shown: (h w, 1), 1 where something is drawn and the photo is a
    number, else 0. footprints: of the Gaussians. size: (h, w)."""

    contributions: scipy.sparse.csr_matrix
    back: scipy.sparse.csr_matrix
    photo: np.ndarray
    sums: np.ndarray
    shown: np.ndarray
    footprints: Footprints
    size: tuple[int, int]

    @staticmethod
    def of(gaussians: Gaussians, camera: Camera, photo: Tensor, trust: Tensor | None) -> "_View":
        footprints = project(gaussians.map(lambda values: values.float()), camera)
        matrix = mixing(footprints, camera, len(gaussians))
        light = np.asarray(matrix.sum(1)).ravel()
        flat = photo.movedim(0, -1).flatten(0, 1).cpu().numpy().astype(np.float32)
        shown = (light >= _LEAST) & np.isfinite(flat).all(1)
        flat[~shown] = 0
        rows = np.repeat(shown / np.maximum(light, _LEAST), np.diff(matrix.indptr)).astype(np.float32)
        matrix.data *= rows
        back = matrix.T.tocsr()
        if trust is not None:
            back.data *= np.repeat(trust.cpu().numpy().astype(np.float32), np.diff(back.indptr))
        sums, size = np.asarray(back.sum(1)).ravel(), (camera.height, camera.width)
        return _View(matrix, back, flat, sums, shown[:, None].astype(np.float32), footprints, size)

    def around(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows (n,) of the Gaussians that are seen, and least and most (n, 3) of the photo around each."""
        footprints, (height, width) = self.footprints, self.size
        x, y = footprints.centres.floor().long().numpy().T
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        inside &= self.sums[footprints.ids.numpy()] > _SEEN
        ids, x, y = footprints.ids.numpy()[inside], x[inside], y[inside]
        wide = footprints.roots[:, ::2].amax(1).numpy()[inside]
        picture = np.round(self.photo.reshape(height, width, 3) * 255).astype(np.uint8)
        least, most = np.empty((2, len(ids), 3), np.float32)
        for side, some in zip(_WINDOWS, (wide < _FINE, wide >= _FINE), strict=True):
            window = np.ones((side, side), np.uint8)
            least[some] = cv2.erode(picture, window)[y[some], x[some]]
            most[some] = cv2.dilate(picture, window)[y[some], x[some]]
        return ids, least / 255, most / 255

    def wrong(self, colours: np.ndarray) -> np.ndarray:
        """(h w, 3) the photo less the picture, 0 where nothing is drawn."""
        return (self.photo - self.contributions @ colours) * self.shown

    def carried_back(self, colours: np.ndarray) -> np.ndarray:
        return self.back @ self.wrong(colours)

    def error(self, colours: np.ndarray) -> float:
        """PSNR in dB of what is drawn."""
        off = self.wrong(colours)
        mean = float(np.square(off).sum(dtype=np.float64) / max(1.0, 3 * float(self.shown.sum())))
        return -10 * float(np.log10(max(mean, 1e-10)))
