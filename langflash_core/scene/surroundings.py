"""What is around a camera that walks through a scene: how near surfaces are, how much of a picture is known.

Of every photo a grid of samples, each the place of what it shows there, of the size of its cell. A sample is
known from its photo's side alone: who comes from behind a wall is not held by it, and sees nothing that a
photo saw. Numpy alone, so that a hand asks it in every frame: a millisecond for `SURROUNDINGS.most` samples.

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
        """Share of the pose's picture, its box, that photos saw from about there, in [0, 1], and that nothing
        hides which they saw from aside: that fades; of a scene of layers as those that it shows agree."""
        some, layer, weights = self._layers_in(pose)
        depths, pixels, focal, inside = some._visible_samples(pose)
        nearer = np.argsort(-depths)  # of samples in one cell the last one stays
        depths, pixels, inside = depths[nearer], pixels[nearer], inside[nearer]
        across = focal * some.sizes[inside]
        if pose.span is None:
            across /= depths
        levels = np.ceil(np.log2(np.maximum(across, 1.0))).clip(max=SURROUNDINGS.levels - 1)
        at = some._faces(pose, inside).astype(int), layer[inside], *pixels.astype(int).T
        nearest = np.full((2, len(weights), *SURROUNDINGS.cells), np.inf)
        for level in range(SURROUNDINGS.levels):  # a sample covers the cell of about its size
            sure, number, x, y = (index[levels == level] for index in at)
            coarse = np.full((2, len(weights), *(-(-side >> level) for side in SURROUNDINGS.cells)), np.inf)
            coarse[sure, number, x >> level, y >> level] = depths[levels == level]
            grown = coarse.repeat(1 << level, 2).repeat(1 << level, 3)
            nearest = np.minimum(nearest, grown[:, :, : SURROUNDINGS.cells[0], : SURROUNDINGS.cells[1]])
        doubtful, sure = nearest
        shown = np.isfinite(sure) & (sure <= SURROUNDINGS.close * doubtful)
        hidden = np.isfinite(doubtful) & ~shown
        votes = [np.tensordot(weights, cells, 1) for cells in (shown, hidden)]
        return float(((votes[0] > 0) & (votes[0] >= votes[1])).mean())

    def _layers_in(
        self, pose: Pose
    ) -> tuple["Surroundings", Integer[np.ndarray, " m"], Float[np.ndarray, " L"]]:
        """The samples of the layers that a picture shows, the layer of each, and what layers count; all in
        one where the scene has none."""
        if self.layers is None:
            return self, np.zeros(len(self.views), int), np.ones(1)
        chosen = self.layers.seen(np.array(pose.centre), pose.axes[:, 2])
        owner = self.views[:, None] == np.array(chosen.views)
        return self._only(owner.any(1)), owner[owner.any(1)].argmax(1), chosen.weights

    def _faces(self, pose: Pose, some: Integer[np.ndarray, " m"]) -> Bool[np.ndarray, " m"]:
        """Whether samples are seen from about where their photos saw them."""
        places = self.places[some]
        ways, own = np.array(pose.centre) - places, self.eyes[some] - places
        lengths = np.sqrt(np.einsum("nc,nc->n", ways, ways) * np.einsum("nc,nc->n", own, own))
        return np.einsum("nc,nc->n", ways, own) > SURROUNDINGS.aside * lengths

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
