"""Colours solved for, not copied: those with which the pictures drawn at the photos' places are the
photos.

What a pixel shows is a mean of several Gaussians, so colours taken from the photo come out blurred. With
the contributions c_ip of every view (`mixing`), rounds of

    f_i += sum over views and p of t_iv c_ip (photo(p) - F(p)) / sum of t_iv c_ip

lessen sum |photo - F|^2 (Landweber's iteration, the normal matrix lumped onto its diagonal: SART of
Andersen and Kak 1984 with one subset), each begun a little ahead of the last (Beck and Teboulle 2009,
FISTA). Colours stay within [0, 1] or, with `ringing`, near what the photos show around a Gaussian.

With slopes a colour also changes with the direction from which it is seen, and a block of the normal matrix
takes the place of its lumped diagonal (`slopes`).

Of a view only the Gaussians that it shows are held. Many photos say the same again and again: each of them
speaks in one block of its pixels in some, in another one than its neighbours, and in a low voice where much
of what it shows is its own, since nobody else may see that. So memory stays that of `_EVERY` photos, however
many there are.

What brings the pictures nearer to the photos by going is left out (`hindering`), and the rounds go on without
it.

Sizes: V views, N Gaussians, n of them in one view, h w pixels of a photo.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import methodcaller
from typing import TypeVar

import cv2
import numpy as np
import scipy.sparse
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from langflash_core.at_once import at_once
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.memory import give_back
from langflash_core.splat.frustum import Packs, reaches
from langflash_core.splat.hindering import Pairs, Tally
from langflash_core.splat.mixing import FAINT, mixed
from langflash_core.splat.projection import Footprints, project
from langflash_core.splat.slopes import Steps, across, bases, directions, middles
from langflash_core.types import Camera, Gaussians

ROUNDS = 8
_MANY, _EVERY = 8, 8
"""Photos up to which all speak everywhere; of more, those of which one speaks in a block. Eight hold half a
gigabyte at 672 x 672 pixels."""
_JUDGED = {"small": 0.004}
"""Contribution below which pairs are left out where what hinders is sought: with .01 half is found."""
_BLOCK, _OWN = (
    96,
    0.25,
)  # pixels, a block's side; share of own Gaussians in it, from which a photo speaks anyway
_LOW = 0.1  # what a photo's word counts where it speaks for its own alone
_TURN = 3  # blocks by which a row of them begins later than the one before
_LEAST = 0.5  # of a pixel's light, from which a picture says what is wrong there
_WINDOWS, _FINE = (5, 13), 1.5
"""Sides of what is around a Gaussian, pixels, below and from a deviation on."""
_STEP = 0.5 / 255  # to which the photo is rounded there
_OF_VIEWS = 0.75  # of the time, for which contributions are listed
_SEEN = 0.05  # contributions of a Gaussian over all pixels, below which its colour stays


Made = TypeVar("Made")


@dataclass(frozen=True)
class Solved:
    """colours: (N, 3) in [0, 1], seen from the middle of the photos. slopes: (N, 3, 3), what is added to them
    seen along a unit direction d, from the camera, is d @ slopes; None: nothing. psnr: dB of each view before
    the rounds and after them. hinders: (N,) bool, without which the pictures are nearer to the photos;
    colours and the later `psnr` are those without them."""

    colours: Float[Tensor, "N 3"]
    slopes: Float[Tensor, "N 3 3"] | None
    psnr: tuple[tuple[float, float], ...]
    hinders: Bool[Tensor, " N"]


@torch.no_grad()
def solved_colours(
    gaussians: Gaussians,
    start: Float[Tensor, "N 3"],
    cameras: Sequence[Camera],
    photos: Sequence[Float[Tensor, "3 _ _"]],
    trusts: Sequence[Float[Tensor, " N"]] | None = None,
    owners: Int[Tensor, " N"] | None = None,
    rounds: int = ROUNDS,
    ringing: float | None = None,
    slopes: bool = False,
    leave_out: bool = False,
    step: float = 1.0,
    progress: Callable[[float], None] = lambda done: None,
) -> Solved:
    """Colours of Gaussians from all their photos.

    Args:
        gaussians: N of them, whose own colours are not looked at.
        start: (N, 3), colours to begin with.
        cameras: of the photos' size. photos: (3, h, w) in [0, 1]; pixels that are no numbers say nothing.
        trusts: (N,) >= 0 of each view, what its photo counts for a Gaussian; None: 1.
        owners: (N,) int64, the view that made each Gaussian; None: every photo speaks in all its pixels.
        ringing: how far colours may leave what the photos show around a Gaussian, in parts of how much that
            differs; None: within [0, 1], as far as they like.
        slopes: colours change with the direction.
        leave_out: Gaussians that hinder are found after half of the rounds, and left out of the others.
        step: what 1 of the photos is worth, in sRGB, to what hinders.
        progress: called with the share that is done, before every view and every round; what it raises ends
            the work there.

    Raises:
        ValueError: there are not as many cameras, or trusts, as photos.

    Returns:
        Colours, and how near every photo they come where it speaks.
    """
    if len(cameras) != len(photos) or (trusts is not None and len(trusts) != len(photos)):
        raise ValueError(f"cameras, trusts: expected one for each of {len(photos)} photos, received others")
    gaussians = gaussians.map(lambda values: values.float())
    first = start.detach().cpu().numpy().astype(np.float32)
    packs, group = Packs.of(gaussians), _Group(len(first), progress, rounds)
    share = 1 if owners is None or len(photos) <= _MANY else -(-len(photos) // _EVERY)
    cuts = _JUDGED if leave_out else {}

    def seen(view: int) -> _View:
        rows = packs.before(cameras[view])
        own = None if owners is None or share == 1 else (owners[rows.to(owners.device)] == view)
        spoken = None if own is None else _Spoken(own.cpu().numpy(), view, share)
        trust = None if trusts is None else trusts[view]
        return _View.of(gaussians, rows, cameras[view], photos[view], trust, cuts, spoken)

    def turns() -> Iterator[int]:
        for view in range(len(photos)):
            progress(_OF_VIEWS * view / len(photos))
            yield view

    for view in at_once(seen, turns()):
        group.views.append(view)
        if len(photos) > _MANY:
            give_back()  # each view leaves holes of other sizes
    if slopes:
        group.look(gaussians.means.cpu().numpy(), [_centre(own) for own in cameras])
    before = [view.error(first[view.ids]) for view in group.views]
    tally, later = Tally.of(len(first)), rounds // 2 if leave_out else 0
    looks = group.solved(_looks(first, slopes), rounds - later, ringing)
    if leave_out:
        group.tell(tally, looks)
        tally.gains *= step**2
        group.leave(tally.hindering)
        looks = group.solved(looks, later, ringing)
    nearness = tuple(
        (was, view.error(view.colours(looks))) for was, view in zip(before, group.views, strict=True)
    )
    added = torch.from_numpy(looks[:, 1:]) if slopes else None
    return Solved(torch.from_numpy(looks[:, 0]), added, nearness, torch.from_numpy(tally.hindering))


def _looks(colours: np.ndarray, slopes: bool) -> np.ndarray:
    """(N, B, 3) of colours (N, 3) that are the same from everywhere."""
    return np.pad(colours[:, None], ((0, 0), (0, 3 if slopes else 0), (0, 0)))


def _centre(camera: Camera) -> np.ndarray:
    """(3,) where a camera stands."""
    return invert_rigid(camera.viewmat.double())[:3, 3].float().cpu().numpy()


class _Group:
    """All views, in so many rounds."""

    def __init__(self, count: int, progress: Callable[[float], None], rounds: int):
        self.views: list[_View] = []
        self._middle: np.ndarray | None = None
        self._count = count
        self._progress = progress
        self._done, self._rounds = 0, rounds

    @property
    def total(self) -> np.ndarray:
        """(N,) of all views' sums."""
        total = np.zeros(self._count, np.float32)
        for view in self.views:
            total[view.ids] += view.sums
        return total

    def look(self, means: np.ndarray, centres: Sequence[np.ndarray]) -> None:
        """Colours change with directions from now on: from each view's centre (3,) to the means (N, 3)."""
        ways = [directions(means[view.ids], own) for view, own in zip(self.views, centres, strict=True)]
        seen = zip(self.views, ways, strict=True)
        self._middle = middles(self._count, ((view.ids, view.sums, way) for view, way in seen))
        for number, (view, way) in enumerate(zip(self.views, ways, strict=True)):
            self.views[number] = replace(view, bases=bases(way, self._middle[view.ids]))

    def solved(self, start: np.ndarray, rounds: int, ringing: float | None) -> np.ndarray:
        """Looks (N, B, 3) after some rounds."""
        total = self.total
        sloped = ((view.ids, view.sums, view.bases) for view in self.views if view.bases is not None)
        steps = Steps.of(total, total > _SEEN, sloped)
        low, high = self._bounds(start[:, 0], ringing)
        looks = ahead = start if self._middle is None else across(start, self._middle)
        pace = 1.0
        for _ in range(rounds):
            self._progress(_OF_VIEWS + (1 - _OF_VIEWS) * self._done / self._rounds)
            self._done += 1
            said = np.zeros_like(start)
            for view, own in self._of_each(methodcaller("carried_back", ahead)):
                said[view.ids] += own
            found = steps.taken(ahead, said)
            found[:, 0] = np.clip(found[:, 0], low, high)
            following = (1 + math.sqrt(1 + 4 * pace * pace)) / 2
            ahead = found + ((pace - 1) / following) * (found - looks)
            looks, pace = found, following
        return looks

    def tell(self, tally: Tally, looks: np.ndarray) -> None:
        """What all views say of each Gaussian that looks so (N, B, 3)."""
        for view, own in self._of_each(methodcaller("told", looks)):
            tally.take(view.ids, *own)

    def leave(self, gone: np.ndarray) -> None:
        """Some Gaussians, (N,) bool, are not drawn any more."""
        self.views = [left for _, left in self._of_each(lambda view: view.without(gone[view.ids]))]

    def _of_each(self, make: Callable[["_View"], Made]) -> Iterator[tuple["_View", Made]]:
        """Each view, in order, and what is made of it."""
        return zip(self.views, at_once(make, self.views), strict=True)

    def _bounds(
        self, start: np.ndarray, ringing: float | None
    ) -> tuple[np.ndarray | float, np.ndarray | float]:
        """The least and the most (N, 3) that colours may be."""
        if ringing is None:
            return 0.0, 1.0
        low, high = start.copy(), start.copy()
        for view in self.views:
            ids, least, most = view.around
            low[ids] = np.minimum(low[ids], least / np.float32(255))
            high[ids] = np.maximum(high[ids], most / np.float32(255))
        margin = ringing * (high - low) + _STEP
        return np.clip(low - margin, 0, 1), np.clip(high + margin, 0, 1)


@dataclass(frozen=True)
class _Spoken:
    """Where a photo speaks. own: (n,) bool, which of the Gaussians that it may see it made; view: its number;
    share: it speaks in one block of so many."""

    own: np.ndarray
    view: int
    share: int

    def blocks(self, centres: Tensor, size: tuple[int, int]) -> np.ndarray:
        """(h', w') of the blocks of a picture of `size`: 1 where it speaks, less where it does for its own
        Gaussians, else 0. centres: (n, 2) pixels of all that it may see."""
        high, wide = (-(-side // _BLOCK) for side in size)
        x, y = (centres // _BLOCK).clamp(-1, max(high, wide)).long().cpu().numpy().T
        inside = (x >= 0) & (y >= 0) & (x < wide) & (y < high)
        places, own = (y * wide + x)[inside], self.own[inside]
        counts, mine = (np.bincount(places, of, minlength=high * wide) for of in (None, own))
        turn = min(_TURN, wide)
        turns = np.arange(high)[:, None] * turn + np.arange(wide) + self.view
        known = ((mine >= _OWN * counts) & (mine > 0)).reshape(high, wide)
        share = min(self.share, (high - 1) * turn + wide)  # nobody is silent, however many there are
        return np.where(turns % share == 0, 1, np.where(known, _LOW, 0)).astype(np.float32)

    def heard(self, gaussians: Gaussians, camera: Camera) -> tuple[Tensor, np.ndarray]:
        """(n,) bool, which of the Gaussians that the photo may see touch a block where it speaks; and (h, w)
        how loud it is in each pixel."""
        centres, reach = reaches(gaussians, camera, FAINT)
        told = self.blocks(centres, (camera.height, camera.width))
        loud = told.repeat(_BLOCK, 0).repeat(_BLOCK, 1)
        return _meets(told > 0, centres, reach), loud[: camera.height, : camera.width]


def _meets(blocks: np.ndarray, centres: Tensor, reach: Tensor) -> Tensor:
    """(n,) bool: the rectangle that goes so far (n, 2) from each centre (n, 2), pixels, has a part in one of
    the blocks (h', w') bool."""
    high, wide = blocks.shape
    sums = torch.zeros(high + 1, wide + 1, dtype=torch.int64)
    sums[1:, 1:] = torch.from_numpy(blocks).long().cumsum(0).cumsum(1)
    last = torch.tensor([wide, high])
    low = ((centres - reach) / _BLOCK).floor().clamp_min(0).minimum(last).long()
    end = ((centres + reach) / _BLOCK).floor().add(1).clamp_min(0).minimum(last).long()
    (left, top), (right, bottom) = low.T, end.T
    rows = sums.flatten()
    corners = (
        rows[y * (wide + 1) + x] for y, x in ((bottom, right), (top, left), (top, right), (bottom, left))
    )
    whole, outer, above, before = corners
    return (whole + outer - above - before > 0) & (low < end).all(1)


@dataclass(frozen=True)
class _View:
    """ids: (n,) rows of the Gaussians that are shown. contributions: (h w, n), of 1 a pixel where anything is
    drawn, each pixel's front to back. light: (h w,) that stays there. photo: (h w, 3). trust: (n, 1), None:
    1. sums: (n,) of contributions, times the trust. shown: (h w, 1), 1 where something is drawn and the photo
    is a number, else 0. around: rows of some Gaussians, and least and most of the photo around each, uint8.
    counts: (h w, 1), what each pixel's word counts, None: 1. bases: (n, 4), of `slopes`, None: 1. Of a photo
    that speaks in some pixels alone, h w is how many these are."""

    ids: np.ndarray
    contributions: scipy.sparse.csr_matrix
    light: np.ndarray
    photo: np.ndarray
    trust: np.ndarray | None
    sums: np.ndarray
    shown: np.ndarray
    around: tuple[np.ndarray, np.ndarray, np.ndarray]
    counts: np.ndarray | None = None
    bases: np.ndarray | None = None

    @staticmethod
    def of(
        gaussians: Gaussians,
        seen: Tensor,
        camera: Camera,
        photo: Tensor,
        trust: Tensor | None,
        cuts: Mapping[str, float],
        spoken: _Spoken | None = None,
    ) -> "_View":
        """seen: rows of the Gaussians that the camera may see. cuts: as `mixing` takes them, or nothing.
        spoken: where the photo speaks; None: everywhere."""
        loudness = None
        if spoken is not None:
            some, loudness = spoken.heard(gaussians.rows(seen), camera)
            seen = seen[some]
        footprints = project(gaussians.rows(seen), camera)
        wanted = None if loudness is None else loudness > 0
        matrix, stays = mixed(footprints, camera, len(seen), **cuts, wanted=wanted)
        matrix, some = _narrowed(matrix, len(seen))
        light = np.asarray(matrix.sum(1)).ravel()
        flat = photo.movedim(0, -1).flatten(0, 1).cpu().numpy().astype(np.float32)
        shown = (light >= _LEAST) & np.isfinite(flat).all(1)
        flat[~shown] = 0
        matrix.data *= np.repeat(shown / np.maximum(light, _LEAST), np.diff(matrix.indptr)).astype(np.float32)
        ids = seen.cpu().numpy()[some]
        counts = np.ones(len(flat), np.float32) if loudness is None else loudness.ravel()
        sums = matrix.T @ counts
        told = None if trust is None else trust.cpu().numpy().astype(np.float32)[ids]
        if told is not None:
            sums = sums * told
        placed = np.full(len(seen), -1)
        placed[some] = np.arange(len(some))
        around = _around(footprints, placed, sums, flat.reshape(camera.height, camera.width, 3))
        view = _View(
            ids, matrix, stays.astype(np.float32), flat, None if told is None else told[:, None], sums,
            shown[:, None].astype(np.float32), (ids[around[0]], *around[1:]),
        )  # fmt: skip
        if loudness is None:
            return view
        spoken_of = np.flatnonzero(loudness)  # the rows of other pixels are empty
        return replace(view.at(spoken_of), counts=counts[spoken_of, None])

    def at(self, kept: np.ndarray) -> "_View":
        """The same of some pixels."""
        return replace(
            self,
            contributions=self.contributions[kept],
            light=self.light[kept],
            photo=self.photo[kept],
            shown=self.shown[kept],
            counts=None if self.counts is None else self.counts[kept],
        )

    def colours(self, looks: np.ndarray) -> np.ndarray:
        """(n, 3) of its Gaussians, of looks (N, B, 3)."""
        own = looks[self.ids]
        return own[:, 0] if self.bases is None else np.einsum("nb,nbc->nc", self.bases, own)

    def told(self, looks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n,) by how much the picture is nearer to the photo without each Gaussian; (n,) what each
        contributes."""
        pairs = Pairs.of(self.contributions, self.light)
        return pairs.gains(self.colours(looks), self.photo, self.shown[:, 0] > 0), pairs.sums(len(self.ids))

    def without(self, gone: np.ndarray) -> "_View":
        """The same without some of its Gaussians, (n,) bool."""
        if not gone.any():
            return self
        matrix, light = Pairs.of(self.contributions, self.light).without(gone)
        shown = self.shown * (light >= _LEAST)[:, None]
        scale = shown[:, 0] / np.maximum(light, _LEAST)
        matrix.data *= np.repeat(scale, np.diff(matrix.indptr)).astype(np.float32)
        sums = matrix.T @ (np.ones(len(light), np.float32) if self.counts is None else self.counts[:, 0])
        sums = sums if self.trust is None else sums * self.trust[:, 0]
        return replace(self, contributions=matrix, light=light, shown=shown, sums=sums)

    def wrong(self, colours: np.ndarray) -> np.ndarray:
        """(h w, 3) the photo less the picture in colours (n, 3), 0 where nothing is drawn."""
        return (self.photo - self.contributions @ colours) * self.shown

    def carried_back(self, looks: np.ndarray) -> np.ndarray:
        """(n, B, 3) of what is wrong."""
        wrong = self.wrong(self.colours(looks))
        back = self.contributions.T @ (wrong if self.counts is None else wrong * self.counts)
        back = back if self.trust is None else back * self.trust
        return back[:, None] if self.bases is None else self.bases[:, :, None] * back[:, None]

    def error(self, colours: np.ndarray) -> float:
        """PSNR in dB of what is drawn in colours (n, 3)."""
        off = self.wrong(colours)
        mean = float(np.square(off).sum(dtype=np.float64) / max(1.0, 3 * float(self.shown.sum())))
        return -10 * float(np.log10(max(mean, 1e-10)))


def _narrowed(matrix: scipy.sparse.csr_matrix, width: int) -> tuple[scipy.sparse.csr_matrix, np.ndarray]:
    """The matrix, so many columns wide, without those that are empty, and which columns are left."""
    used = np.zeros(width, bool)
    used[matrix.indices] = True
    some = np.flatnonzero(used)
    places = (np.cumsum(used, dtype=np.int32) - 1).astype(np.int32)
    parts = (matrix.data, places[matrix.indices], matrix.indptr)
    return scipy.sparse.csr_matrix(parts, shape=(len(matrix.indptr) - 1, len(some))), some


def _around(
    footprints: Footprints, placed: np.ndarray, sums: np.ndarray, photo: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which Gaussians (k,) of those that are shown have their centre in the picture, and least and most
    (k, 3) uint8 of the photo (h, w, 3) around each. placed: which of these each footprint's Gaussian is, -1:
    none."""
    height, width = photo.shape[:2]
    x, y = footprints.centres.floor().long().cpu().numpy().T
    columns = placed[footprints.ids.cpu().numpy()]
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height) & (columns >= 0)
    inside[inside] = sums[columns[inside]] > _SEEN
    columns, x, y = columns[inside], x[inside], y[inside]
    wide = footprints.roots[:, ::2].amax(1).cpu().numpy()[inside]
    picture = np.round(photo * 255).astype(np.uint8)
    least, most = np.empty((2, len(columns), 3), np.uint8)
    for side, some in zip(_WINDOWS, (wide < _FINE, wide >= _FINE), strict=True):
        window = np.ones((side, side), np.uint8)
        least[some] = cv2.erode(picture, window)[y[some], x[some]]
        most[some] = cv2.dilate(picture, window)[y[some], x[some]]
    return columns, least, most
