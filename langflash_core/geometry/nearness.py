"""Which layers of a scene a camera sees, and how much each counts (langflash_core/splat/compose.py).

V photos, L of them chosen. Numpy alone, so that a hand asks it in every frame.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from langflash_core.types import Camera, Scene

NEAREST = 4
"""Layers of a picture. Of 16 frames held back from two real films 3 give .1 dB less, 6 give .03 more."""
FLOOR = 0.05
"""Median distances and radians, together, within which no photo is nearer than another: what poses err."""


@dataclass(frozen=True)
class Chosen:
    """views: the layers of a picture, the nearest first. weights: (L,) what each counts, in sum 1."""

    views: tuple[int, ...]
    weights: Float[np.ndarray, " L"]


@dataclass(frozen=True)
class Nearness:
    """What is near to a camera. centres (V, 3), axes (V, 3): of the photos that have a layer, in the world;
    views: which these are. distance: median, of the Gaussians from the first photo, scene units."""

    centres: Float[np.ndarray, "V 3"]
    axes: Float[np.ndarray, "V 3"]
    distance: float
    views: tuple[int, ...]

    @staticmethod
    def of(scene: "Scene") -> "Nearness":
        import torch

        from langflash_core.geometry.cameras import invert_rigid, median_distance

        assert scene.view_ids is not None
        poses = scene.viewmats.detach().cpu().double()
        there = torch.bincount(scene.view_ids[scene.view_ids >= 0]).nonzero()[:, 0].tolist()
        centres = invert_rigid(poses)[:, :3, 3].numpy()
        distance = median_distance(scene.gaussians.means, scene.viewmats[0])
        return Nearness(centres[there], poses[there, 2, :3].numpy(), distance, tuple(there))

    def chosen(self, camera: "Camera", most: int = NEAREST) -> Chosen:
        """The layers that a camera sees, at most so many."""
        viewmat = camera.viewmat.detach().cpu().double().numpy()
        return self.seen(-viewmat[:3, :3].T @ viewmat[:3, 3], viewmat[2, :3], most)

    def seen(
        self, centre: Float[np.ndarray, " 3"], axis: Float[np.ndarray, " 3"], most: int = NEAREST
    ) -> Chosen:
        """As `chosen`, of a camera at `centre` that looks along unit `axis`."""
        far = self._apart(centre, axis) + FLOOR
        order = np.argsort(far, kind="stable")
        near = order[:most]
        weights = far[near] ** -2.0 - (far[order[most]] ** -2.0 if len(order) > most else 0.0)
        if not weights.sum() > 0:  # all are as far
            weights = np.ones(len(near))
        kept = weights > 0
        return Chosen(tuple(self.views[v] for v in near[kept]), weights[kept] / weights.sum())

    def spread(self, most: int) -> tuple[int, ...]:
        """At most so many of the views that lie all over the walk: the first, then each time the one that is
        farthest from those chosen so far; in the scene's order."""
        nearest = np.full(len(self.views), np.inf)
        chosen: list[int] = []
        while len(chosen) < min(most, len(self.views)):
            chosen.append(int(nearest.argmax()))
            nearest = np.minimum(nearest, self._apart(self.centres[chosen[-1]], self.axes[chosen[-1]]))
            nearest[chosen] = -1
        return tuple(self.views[v] for v in sorted(chosen))

    def _apart(
        self, centre: Float[np.ndarray, " 3"], axis: Float[np.ndarray, " 3"]
    ) -> Float[np.ndarray, " V"]:
        """d_v + a_v of that camera."""
        ways = np.linalg.norm(self.centres - centre, axis=1) / self.distance
        # |a - a'| = 2 sin(angle / 2) of unit axes: small angles keep their digits, which arccos loses
        chords = np.linalg.norm(self.axes - axis, axis=1)
        return ways + 2 * np.arcsin(np.minimum(chords / 2, 1))
