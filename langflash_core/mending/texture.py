"""A hole in a flat picture, filled by what is around it: colours run in from its edge, and patches of what is
known beside it make structure and texture go on.

Every patch of the hole is like some known one, but for a small difference of its mean: in turn the most alike
are sought, by trying what neighbours found and places at random, and each pixel becomes the mean of what all
patches over it say. The farther a pixel is from what is known the less it counts. Coarse pictures come first,
so lines meet across the hole.

Source: Wexler et al. 2007, "Space-time completion of video", with the search of Barnes et al. 2009,
"PatchMatch"; means differ as in Darabi et al. 2012, "Image melding".

Sizes: H W pixels, n patches of the hole, q numbers of a patch.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from scipy import ndimage

from langflash_core.mending.settings import TEXTURE
from langflash_core.scene.gaps import fill_gaps

_SIDE = 2 * TEXTURE.reach + 1


def heal(
    colours: Float[np.ndarray, "H W 3"],
    known: Bool[np.ndarray, "H W"],
    hole: Bool[np.ndarray, "H W"],
    copied: Bool[np.ndarray, "H W"] | None = None,
) -> Float[np.ndarray, "H W 3"]:
    """Colours with the hole filled; the rest as it was, and what is neither known nor hole as smooth as it.

    Args:
        colours: in [0, 1]; those that are not known are not looked at. copied: what patches are taken of;
            None: all that is known.
    """
    smooth = np.where(known[..., None], colours, diffuse(colours, known))
    pictures = [_Picture(smooth, known, hole, known if copied is None else known & copied)]
    while pictures[-1].deep and min(pictures[-1].hole.shape) >= 3 * _SIDE:
        pictures.append(pictures[-1].halved())
    draws, found = np.random.default_rng(int(hole.sum())), None
    for level, picture in reversed(list(enumerate(pictures))):
        patches = _Patches.of(picture)
        if patches is None:
            continue
        found = patches.begun(draws, found)
        patches = patches if level == len(pictures) - 1 else patches.voted(found)
        for _ in range(TEXTURE.rounds << level if len(patches.rows) <= TEXTURE.most else 0):
            found = patches.improved(found, draws)
            patches = patches.voted(found)
        pictures[level] = patches.evened(found)
    return np.where((known & ~hole)[..., None], colours, pictures[0].colours).astype(colours.dtype)


def diffuse(values: Float[np.ndarray, "H W n"], known: Bool[np.ndarray, "H W"]) -> Float[np.ndarray, "H W n"]:
    """Values carried from where they are known to everywhere, smoothly; 0 where nothing is known at all."""
    if not known.any():
        return np.zeros_like(values)
    side = 1 << int(np.ceil(np.log2(max(known.shape))))  # as many steps as reach across
    square = np.zeros((2 * side, 2 * side, 4), np.float32)
    square[: known.shape[0], : known.shape[1], 3] = known
    square[: known.shape[0], : known.shape[1], :3] = np.where(known[..., None], values, 0)
    whole = torch.from_numpy(square)
    near, weight = (
        fill_gaps(each, whole[..., 3]).numpy()[: known.shape[0], : known.shape[1]]
        for each in (whole[..., :3], whole[..., 3:].expand(-1, -1, 3))
    )
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    fallback = values[tuple(np.asarray(nearest))]
    return np.where(weight > 0.5, near / np.maximum(weight, 1e-6), fallback)


@dataclass(frozen=True)
class _Picture:
    """colours (H, W, 3), filled somehow; known, hole, copied (H, W)."""

    colours: Float[np.ndarray, "H W 3"]
    known: Bool[np.ndarray, "H W"]
    hole: Bool[np.ndarray, "H W"]
    copied: Bool[np.ndarray, "H W"]

    @property
    def deep(self) -> bool:
        """Whether the hole has pixels that no patch with known ones reaches."""
        return bool(np.asarray(ndimage.distance_transform_edt(self.hole)).max() > TEXTURE.reach)

    def halved(self) -> "_Picture":
        size = (self.hole.shape[1] // 2, self.hole.shape[0] // 2)
        known, hole, copied = (cv2.resize(each.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5
                       for each in (self.known, self.hole, self.copied))  # fmt: skip
        smaller = cv2.resize(self.colours, size, interpolation=cv2.INTER_AREA)
        return _Picture(smaller, known & ~hole, hole, copied & ~hole)


@dataclass(frozen=True)
class _Found:
    """source: (H, W) which pixel's patch each one's is like, row by row, -1 where nobody asked. means (n, 3):
    by how much that is too dark. sure (n,): what each counts."""

    source: Integer[np.ndarray, "H W"]
    means: Float[np.ndarray, "n 3"]
    sure: Float[np.ndarray, " n"]


@dataclass(frozen=True)
class _Patches:
    """table (H * W, q): the patch around each pixel; rows, columns (n,): of patches that reach into the hole;
    weights (n, q / 3): what their pixels count; whole: (H, W) those that are known from side to side."""

    picture: _Picture
    table: Float[np.ndarray, "p q"]
    rows: Integer[np.ndarray, " n"]
    columns: Integer[np.ndarray, " n"]
    weights: Float[np.ndarray, "n s"]
    whole: Bool[np.ndarray, "H W"]

    @staticmethod
    def of(picture: _Picture) -> "_Patches | None":
        """None where there is nothing to fill, or too little that is known."""
        square = np.ones((_SIDE, _SIDE), np.uint8)
        whole = cv2.erode((picture.copied & ~picture.hole).astype(np.uint8), square, borderValue=0) > 0
        rows, columns = np.nonzero(cv2.dilate(picture.hole.astype(np.uint8), square))
        if not len(rows) or whole.sum() < TEXTURE.fewest:
            return None
        far = np.asarray(ndimage.distance_transform_edt(picture.hole | ~picture.known))
        weights = _table((TEXTURE.decay**-far)[..., None])[rows * whole.shape[1] + columns]
        return _Patches(picture, _table(picture.colours), rows, columns, weights, whole)

    def begun(self, draws: np.random.Generator, before: _Found | None) -> _Found:
        """What the picture of half the size found, or any known patches."""
        places, shape = np.flatnonzero(self.whole), self.whole.shape
        source = draws.choice(places, len(self.rows))
        if before is not None:
            high, wide = before.source.shape
            coarse = before.source[(self.rows // 2).clip(0, high - 1), (self.columns // 2).clip(0, wide - 1)]
            rows, columns = 2 * (coarse // wide) + self.rows % 2, 2 * (coarse % wide) + self.columns % 2
            source = np.where(coarse >= 0, self._allowed(rows, columns, source), source)
        whole = np.full(shape, -1)
        whole[self.rows, self.columns] = source
        return _Found(whole, np.zeros((len(self.rows), 3)), np.ones(len(self.rows)))

    def improved(self, found: _Found, draws: np.random.Generator) -> _Found:
        """Better ones, if neighbours or chance know any."""
        own = self.table[self.rows * self.whole.shape[1] + self.columns]
        best = found.source[self.rows, self.columns]
        cost, means = _differences(own, self.table[best], self.weights)
        source, (height, width) = found.source.copy(), self.whole.shape
        radius = max(height, width)
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            rows, columns = (self.rows - down).clip(0, height - 1), (self.columns - right).clip(0, width - 1)
            theirs = source[rows, columns]
            best = self._better(own, best, cost, means, theirs // width + down, theirs % width + right)
            source[self.rows, self.columns] = best
        while radius >= 1:
            jumps = draws.integers(-radius, radius + 1, (2, len(best)))
            best = self._better(own, best, cost, means, best // width + jumps[0], best % width + jumps[1])
            radius //= 2
        source[self.rows, self.columns] = best
        usual = np.quantile(cost, TEXTURE.usual) + 1e-9
        return _Found(source, means, self.weights.mean(1) * np.exp(-cost / (2 * usual)) + 1e-9)

    def _better(
        self, own: np.ndarray, best: np.ndarray, cost: np.ndarray, means: np.ndarray,
        rows: np.ndarray, columns: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """The best of patches (n,) and others; their cost and means are put in place."""
        others = self._allowed(rows, columns, best)
        tried = np.flatnonzero(others != best)
        now, theirs = _differences(own[tried], self.table[others[tried]], self.weights[tried])
        won = now < cost[tried]
        some = tried[won]
        cost[some], means[some] = now[won], theirs[won]
        best = best.copy()
        best[some] = others[some]
        return best

    def _allowed(self, rows: np.ndarray, columns: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
        """Numbers of pixels, where their patches are known."""
        height, width = self.whole.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        numbers = np.where(inside, rows * width + columns, 0)
        return np.where(inside & self.whole.ravel()[numbers], numbers, otherwise)

    def voted(self, found: _Found) -> "_Patches":
        """With the hole as those patches have it."""
        hole, colours = self.picture.hole, self.picture.colours.copy()
        colours[hole] = self._votes(found)[0][hole].clip(0, None)
        return replace(self, picture=replace(self.picture, colours=colours), table=_table(colours))

    def evened(self, found: _Found) -> _Picture:
        """The picture, without a step at the hole's edge: what patches differ by there runs in from it."""
        votes, asked = self._votes(found)
        picture = self.picture
        edge = picture.known & ~picture.hole & asked
        missing = diffuse(picture.colours - votes + 1, edge) - 1 if edge.any() else 0.0  # as colours above 0
        return replace(picture, colours=np.where(picture.hole[..., None], votes + missing, picture.colours))

    def _votes(self, found: _Found) -> tuple[np.ndarray, np.ndarray]:
        """(H, W, 3) what patches say of each pixel, and (H, W) whether any does."""
        reach, (height, width) = TEXTURE.reach, self.whole.shape
        sums = np.zeros((height + 2 * reach, width + 2 * reach, 4))
        patches = self.table[found.source[self.rows, self.columns]].reshape(-1, _SIDE, _SIDE, 3)
        for down in range(_SIDE):
            for right in range(_SIDE):
                place = self.rows + down, self.columns + right  # each pixel has one patch there
                sums[place[0], place[1], :3] += found.sure[:, None] * (patches[:, down, right] + found.means)
                sums[place[0], place[1], 3] += found.sure
        sums = sums[reach : reach + height, reach : reach + width]
        return sums[..., :3] / np.maximum(sums[..., 3:], 1e-12), sums[..., 3] > 0


def _table(values: Float[np.ndarray, "H W c"]) -> Float[np.ndarray, "p q"]:
    """The patch around each pixel, (H * W, q), those at the border with the border's pixels."""
    reach = TEXTURE.reach
    wider = np.pad(values.astype(np.float32), ((reach, reach), (reach, reach), (0, 0)), "edge")
    windows = np.lib.stride_tricks.sliding_window_view(wider, (_SIDE, _SIDE), (0, 1))  # (H, W, c, s, s)
    return windows.transpose(0, 1, 3, 4, 2).reshape(-1, _SIDE * _SIDE * values.shape[2])


def _differences(
    own: Float[np.ndarray, "n q"], theirs: Float[np.ndarray, "n q"], weights: Float[np.ndarray, "n s"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """By how much patches differ but for their means, per pixel, and by how much, within limits, those do."""
    apart = (own - theirs).reshape(len(own), _SIDE * _SIDE, 3)
    shares = weights / weights.sum(1, keepdims=True)
    means = np.einsum("ns,nsc->nc", shares, apart).clip(-TEXTURE.means, TEXTURE.means)
    apart -= means[:, None]
    return np.einsum("ns,nsc,nsc->n", shares, apart, apart), means
