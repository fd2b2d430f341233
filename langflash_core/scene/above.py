"""A scene from above: where its photos were taken, which way they look, and what stands there.

Up is the world's, where one is known; else the mean of what is up in the photos, and north is where the
first one looks. What is higher than the photos were taken from, a ceiling first of all, is not drawn.

Places are (east, south) in shares of the picture, from its upper left corner. Sizes: N Gaussians, V views.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, UInt8
from scipy.ndimage import gaussian_filter

from langflash_core.geometry import rotations
from langflash_core.geometry.harmonics import sh_to_colour
from langflash_core.scene.settings import FROM_ABOVE
from langflash_core.types import Gaussians, Scene


@dataclass(frozen=True)
class Above:
    """A map. axes: rows east, down, north, in the scene's axes. corner: (east, north) of the picture's upper
    left corner, scene units; size: (width, height), scene units. eyes: where the photos were taken; ways:
    which way each looks, unit vectors (0 straight down or up)."""

    axes: Float[np.ndarray, "3 3"]
    corner: tuple[float, float]
    size: tuple[float, float]
    eyes: Float[np.ndarray, "V 2"]
    ways: Float[np.ndarray, "V 2"]

    @property
    def aspect(self) -> float:
        """Width over height."""
        return self.size[0] / self.size[1]

    def places(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 2"]:
        """Of points of the scene."""
        east, _, north = (points @ self.axes.T).T
        x, y = (east - self.corner[0]) / self.size[0], (self.corner[1] - north) / self.size[1]
        return np.stack((x, y), axis=-1)


def seen_from_above(scene: Scene) -> Above:
    """The map of a scene.

    Source: own derivation; tests/scene/test_above.py has the same for one level camera by hand.
    """
    viewmats = scene.viewmats.double().numpy()
    axes, centres = _axes(scene, viewmats), _centres(viewmats)
    points = (scene.gaussians.means.double().numpy() @ axes.T)[:, [0, 2]]
    eyes = (centres @ axes.T)[:, [0, 2]]
    ends = [eyes.min(0), eyes.max(0)]
    if len(points):
        ends += list(np.percentile(points, [100 * share for share in FROM_ABOVE.core], axis=0))
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    longest = max(float((high - low).max()), 1e-6)
    size = np.maximum(high - low, FROM_ABOVE.least * longest) + 2 * FROM_ABOVE.margin * longest
    middle = (low + high) / 2
    corner = (float(middle[0] - size[0] / 2), float(middle[1] + size[1] / 2))
    looks = (viewmats[:, 2, :3] @ axes.T)[:, [0, 2]] * (1, -1)
    length = np.linalg.norm(looks, axis=1, keepdims=True)
    ways = np.where(length > 1e-6, looks / np.maximum(length, 1e-6), 0.0)
    empty = Above(axes, corner, (float(size[0]), float(size[1])), eyes, ways)
    return replace(empty, eyes=empty.places(centres))


def drawn_from_above(scene: Scene, above: Above, side: int = 256) -> UInt8[np.ndarray, "h w 3"]:
    """What stands lower than the photos were taken from, in its colours.

    Args:
        side: pixels of the longer side.
    """
    width = round(side * min(1.0, above.aspect))
    height = round(side * min(1.0, 1 / above.aspect))
    means, down = scene.gaussians.means.double().numpy(), above.axes[1]
    eyes = float((_centres(scene.viewmats.double().numpy()) @ down).mean())
    places = above.places(means)
    chosen = (means @ down > eyes) & (places >= 0).all(1) & (places < 1).all(1)
    cells = (places[chosen] * (width, height)).astype(np.int64) @ (1, width)
    weights, colours = _areas_and_colours(
        scene.gaussians.map(lambda each: each[torch.from_numpy(chosen)]), down
    )
    columns = (*(weights[:, None] * colours).T, weights)
    sums = (np.bincount(cells, column, width * height).reshape(height, width) for column in columns)
    *light, mass = (gaussian_filter(each, FROM_ABOVE.blur) for each in sums)
    full = FROM_ABOVE.full * np.quantile(mass, 0.99)
    share = np.minimum(mass / full, 1.0) if full > 0 else np.zeros_like(mass)
    rgb = np.stack(light, axis=-1) / np.maximum(mass, 1e-30)[..., None] * 255
    return (
        np.round(FROM_ABOVE.ground + share[..., None] * (rgb - FROM_ABOVE.ground))
        .clip(0, 255)
        .astype(np.uint8)
    )


def _areas_and_colours(
    gaussians: Gaussians, down: Float[np.ndarray, " 3"]
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, "N 3"]]:
    """What each covers, by its two longer axes, and its colour seen from above."""
    areas = gaussians.scales.double().sort(dim=1).values[:, 1:].prod(1) * gaussians.opacities
    ways = torch.from_numpy(down).to(gaussians.sh).expand(len(gaussians), 3)
    return areas.numpy(), sh_to_colour(gaussians.sh, ways).clamp(0, 1).double().numpy()


def _centres(viewmats: Float[np.ndarray, "V 4 4"]) -> Float[np.ndarray, "V 3"]:
    """Where cameras stand."""
    return -np.einsum("vji,vj->vi", viewmats[:, :3, :3], viewmats[:, :3, 3])


def _axes(scene: Scene, viewmats: Float[np.ndarray, "V 4 4"]) -> Float[np.ndarray, "3 3"]:
    """Rows east, down and north."""
    if scene.record.world is not None:
        return rotations.matrix(scene.record.world.turn)
    down = viewmats[:, 1, :3].mean(0)
    if np.linalg.norm(down) < 1e-6:  # photos that stand on their heads as often as not
        down = viewmats[0, 1, :3]
    down = down / np.linalg.norm(down)
    rows = (viewmats[0, 2, :3], -viewmats[0, 1, :3])  # the first one looks north, or down with its top north
    north = next(n for row in rows if np.linalg.norm(n := row - (row @ down) * down) > 0.1)
    north = north / np.linalg.norm(north)
    return np.stack((np.cross(down, north), down, north))
