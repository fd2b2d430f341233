"""What walls are made of: what answers "wall", "door" or "window" and is upright, and how it is turned.

A piece weighs its area over its distance from the nearest photo, since depth errs with that. The common turn
of walls is the mean of the normals' azimuths, modulo a quarter. Sizes: N Gaussians, n pieces.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from langflash_core.base.records import World
from langflash_core.geometry.rotations import turn_of
from langflash_core.geometry.surfels import covered_areas, normals_of
from langflash_core.inventory.pieces import KINDS, OPENINGS, kinds_of
from langflash_core.inventory.settings import FLOOR_PLAN
from langflash_core.types import Scene


@dataclass(frozen=True)
class Upright:
    """Places and unit normals (n, 2), east and north; heights; weights."""

    places: Float[np.ndarray, "n 2"]
    normals: Float[np.ndarray, "n 2"]
    heights: Float[np.ndarray, " n"]
    weights: Float[np.ndarray, " n"]

    @property
    def turn(self) -> float:
        """Radians in [-pi/4, pi/4): the azimuth that most share, modulo a quarter; 0 of nothing."""
        azimuths = 4 * np.arctan2(self.normals[:, 1], self.normals[:, 0])
        mean = complex(self.weights @ np.exp(1j * azimuths)) if len(azimuths) else 0j
        return 0.0 if abs(mean) < 1e-12 else math.atan2(mean.imag, mean.real) / 4

    def along(self, matrix: Float[np.ndarray, "2 2"]) -> "Upright":
        """Seen along other axes of the floor."""
        return Upright(self.places @ matrix.T, self.normals @ matrix.T, self.heights, self.weights)


def upright_of(
    scene: Scene,
    world: World,
    stands: Float[np.ndarray, "N 3"],
    eyes: Sequence[tuple[float, float]],
    metre: float,
) -> Upright:
    """What the walls of a scene are made of. stands: where its Gaussians are in the world; eyes: east and
    north of its photos; metre: one in the unit of both."""
    normals = normals_of(scene.gaussians) @ turn_of(world).T
    flat = normals[:, [0, 2]]
    length = np.linalg.norm(flat, axis=1)
    kinds, areas = kinds_of(scene), covered_areas(scene.gaussians)
    upright = (np.abs(normals[:, 1]) < FLOOR_PLAN.upright) & (length > 0.5)
    walls = np.isin(kinds, [KINDS.index(name) for name in ("wall", *OPENINGS)])
    chosen = walls & upright & (areas > 0) & np.isfinite(stands).all(1)
    places, weights = stands[chosen][:, [0, 2]], areas[chosen]
    if len(eyes):
        weights = weights / np.maximum(KDTree(eyes).query(places)[0], FLOOR_PLAN.nearest * metre)
    return Upright(places, flat[chosen] / length[chosen, None], -stands[chosen, 1], weights)
