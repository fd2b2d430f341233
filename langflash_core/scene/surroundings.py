"""What is around a camera that walks through a scene: how near surfaces are, how much of a picture is known.

Of every photo a grid of samples, each the place of what it shows there, of the size of its cell. A sample is
known from its photo's side alone: who comes from behind a wall is not held by it, and sees nothing that a
photo saw. Numpy alone, so that a hand asks it in every frame: some .2 ms for `SURROUNDINGS.most` samples.

Sizes: n samples, V photos, N Gaussians.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Integer

from langflash_core.geometry.nearness import Nearness
from langflash_core.geometry.pinhole import see
from langflash_core.geometry.poses import NEAREST, Pose, intrinsics, viewmat
from langflash_core.scene.settings import SURROUNDINGS

if TYPE_CHECKING:
    from langflash_core.types import Scene


@dataclass(frozen=True)
class Surroundings:
    """places (n, 3), eyes (n, 3): of samples and of the photos that saw them, world. sizes (n,): across,
    scene units. rows (n,): their Gaussians; views (n,): their photos, of which `layers` says where they
    stand. depth: median from photo to sample, scene units."""

    places: Float[np.ndarray, "n 3"]
    eyes: Float[np.ndarray, "n 3"]
    sizes: Float[np.ndarray, " n"]
    rows: Integer[np.ndarray, " n"]
    views: Integer[np.ndarray, " n"]
    depth: float
    layers: Nearness | None = None

    def of(self, there: Bool[np.ndarray, " N"]) -> "Surroundings":
        """Those whose Gaussians are there; the depth stays."""
        kept = there[self.rows]
        return self._only(kept)

    def _only(self, kept: Bool[np.ndarray, " n"]) -> "Surroundings":
        names = ("places", "eyes", "sizes", "rows", "views")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})

    @property
    def clear(self) -> float:
        """Scene units that a camera keeps from surfaces."""
        return SURROUNDINGS.clear * self.depth

    def nearest(self, centre: Float[np.ndarray, "3"]) -> tuple[float, Float[np.ndarray, "3"]]:
        """Distance of the nearest surface that faces a place, and the way there (3,); infinity and 0 where
        there is none."""
        ways = self.places - centre
        far = np.einsum("nc,nc->n", ways, ways)
        faces = np.einsum("nc,nc->n", ways, self.places - self.eyes) > 0
        far = np.where(faces, far, np.inf)
        if not faces.any():
            return math.inf, np.zeros(3)
        first = int(far.argmin())
        return math.sqrt(far[first]), ways[first]

    def known(self, pose: Pose) -> float:
        """Share of the pose's picture, its box, that photos saw from about there, in [0, 1]; of a scene of
        layers those photos alone whose layers it shows."""
        if self.layers is not None:
            drawn = np.isin(self.views, self.layers.seen(np.array(pose.centre), pose.axes[:, 2]).views)
            return replace(self._only(drawn), layers=None).known(pose)
        depths, pixels, focal, inside = self._visible_samples(pose)
        places, own = self.places[inside], self.eyes[inside] - self.places[inside]
        ways = np.array(pose.centre) - places
        lengths = np.sqrt(np.einsum("nc,nc->n", ways, ways) * np.einsum("nc,nc->n", own, own))
        near = np.einsum("nc,nc->n", ways, own) > SURROUNDINGS.aside * lengths
        across = focal * self.sizes[inside][near]
        if pose.span is None:
            across /= depths[near]
        levels = np.ceil(np.log2(np.maximum(across, 1.0))).clip(max=SURROUNDINGS.levels - 1)
        x, y = pixels[near].astype(int).T
        shown = np.zeros(SURROUNDINGS.cells, bool)
        for level in range(SURROUNDINGS.levels):  # a sample covers the cell of about its size
            some = levels == level
            coarse = np.zeros([math.ceil(side / 2**level) for side in SURROUNDINGS.cells], bool)
            coarse[x[some] >> level, y[some] >> level] = True
            grown = coarse.repeat(1 << level, 0).repeat(1 << level, 1)
            shown |= grown[: SURROUNDINGS.cells[0], : SURROUNDINGS.cells[1]]
        return float(shown.mean())

    def middle(self, pose: Pose) -> float | None:
        """Depth of the middle of what is near in a pose's picture: the median of the nearer half; None where
        it shows nothing."""
        depths = self._visible_samples(pose)[0]
        return float(np.quantile(depths, 0.25)) if len(depths) else None

    def _visible_samples(
        self, pose: Pose
    ) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m 2"], float, Integer[np.ndarray, " m"]]:
        """Depths and cells of the samples in a picture, cells per unit at depth 1, and which samples."""
        wide = 1000 if pose.aspect >= 1 else round(1000 * pose.aspect)
        high = round(wide / pose.aspect)
        cells = SURROUNDINGS.cells
        K = intrinsics(pose, wide, high) * np.array([[cells[0] / wide], [cells[1] / high], [1.0]])
        x, y, z, within = see(self.places, viewmat(pose), K, cells, NEAREST, pose.span is not None)
        inside = np.flatnonzero(within)
        return z[inside], np.stack((x[inside], y[inside]), 1), float(K[0, 0]), inside


def surroundings_of(scene: "Scene") -> Surroundings | None:
    """Samples of all photos; None where nobody knows which photo made what, or nothing is there."""
    if scene.view_ids is None:
        return None
    ids = scene.view_ids.cpu().numpy()
    solid = scene.gaussians.opacities.detach().cpu().numpy() > SURROUNDINGS.solid
    means = scene.gaussians.means.detach().cpu().double().numpy()
    views = [view for view in np.unique(ids[solid]).tolist() if view >= 0]
    found = [
        _sample_photo(scene, view, np.flatnonzero((ids == view) & solid), means, len(views)) for view in views
    ]
    if not any(len(rows) for rows, _, _ in found):
        return None
    rows, sizes, eyes = (np.concatenate(part) for part in zip(*found, strict=True))
    layers = Nearness.of(scene) if scene.layered else None
    depth = float(np.median(np.linalg.norm(means[rows] - eyes, axis=1)))
    return Surroundings(means[rows], eyes, sizes, rows, ids[rows], depth, layers)


def _sample_photo(
    scene: "Scene", view: int, own: Integer[np.ndarray, " m"], means: Float[np.ndarray, "N 3"], count: int
) -> tuple[Integer[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
    """Rows, sizes and eyes of a photo's samples, of `count` photos: of each cell of its grid the Gaussians at
    `SURROUNDINGS.quantiles` of depth."""
    matrix, K = scene.viewmats[view].double().numpy(), scene.Ks[view].double().numpy()
    width, height = scene.view_size
    cells_each = min(SURROUNDINGS.a_photo, SURROUNDINGS.most / len(SURROUNDINGS.quantiles) / count)
    wide = round(math.sqrt(cells_each * width / height)) or 1
    cell = width / wide
    high = math.ceil(height / cell)
    x, y, z, inside = see(means[own], matrix, K, (wide * cell, high * cell), NEAREST)
    seen = np.flatnonzero(inside)
    cells = (y[seen] / cell).astype(int) * wide + (x[seen] / cell).astype(int)
    order = np.lexsort((z[seen], cells))
    _, starts, counts = np.unique(cells[order], return_index=True, return_counts=True)
    picked = seen[
        order[np.unique([starts + (share * counts).astype(int) for share in SURROUNDINGS.quantiles])]
    ]
    centre = -matrix[:3, :3].T @ matrix[:3, 3]
    return own[picked], z[picked] * cell / float(K[0, 0]), np.tile(centre, (len(picked), 1))
