"""How much of each photo its neighbours foresee: what would be drawn at its place of their layers alone.

Between photos a view is blended of the layers next to it (`splat.compose`). Where these do not meet, since a
pose or a depth is wrong, or where a photo has no neighbour, the way past that photo looks torn, however good
its own layer is. So the points of its nearest neighbours are seen from its place, in their colours, blended
as layers are, and their edges compared with the photo's.

Sizes: V views, L neighbours, n points, H W pixels of the grid, h w cells of `CELL` x `CELL` pixels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.nearness import Chosen
from langflash_core.rig.neighbours import beside
from langflash_core.rig.projected import project_points
from langflash_core.rig.rig import Rig
from langflash_core.splat.compose import shares
from langflash_core.surface.settings import FORESEEING
from langflash_core.types import Camera

CELL = FORESEEING.cell


@dataclass(frozen=True)
class Foresight:
    """Of each photo (V,). covered: share of it that its neighbours show. alike: correlation there of its
    edges with theirs, in [-1, 1], 1 of the photo itself; None where there are no edges. nearest: of the other
    photos the one beside it."""

    covered: tuple[float, ...]
    alike: tuple[float | None, ...]
    nearest: tuple[int, ...]

    def stored(self) -> dict[str, list]:
        """As `Record.foreseen` has it."""
        alike = [None if value is None else round(value, 3) for value in self.alike]
        covered = [round(share, 3) for share in self.covered]
        return {"covered": covered, "alike": alike, "nearest": list(self.nearest)}


@torch.no_grad()
def foresight(rig: Rig) -> Foresight:
    """What the nearest photos foresee of each one, of two and more.

    Args:
        rig: with photos in one light, whose places are known; depths are finite.
    """
    assert rig.photos is not None, "whoever compares photos has them"
    found, (height, width) = [], rig.size
    for view, image in enumerate(rig.photos):
        camera = Camera(rig.viewmats[view], rig.Ks[view], width, height)
        chosen = beside(rig, view)
        pictures = [
            draw_points(rig.points(other), rig.photos[other].flatten(1), camera) for other in chosen.views
        ]
        picture, shown = _blend_pictures(pictures, chosen)
        alike = _alike(picture, F.avg_pool2d(image, CELL), shown)
        found.append((float(shown.float().mean()), alike, chosen.views[0]))
    return Foresight(*(tuple(column) for column in zip(*found, strict=True)))


def _blend_pictures(
    pictures: Sequence[tuple[Float[Tensor, "3 h w"], Float[Tensor, "h w"]]], chosen: Chosen
) -> tuple[Float[Tensor, "3 h w"], Bool[Tensor, "h w"]]:
    """One picture of several, as layers are blended, and where it shows anything."""
    colours, depths = (torch.stack(some) for some in zip(*pictures, strict=True))
    there = torch.isfinite(depths)
    counts = shares(there.to(colours), torch.where(there, depths, 1.0), chosen.weights)
    return (counts[:, None] * colours).sum(0), there.any(0)


def draw_points(
    points: Float[Tensor, "3 n"], colours: Float[Tensor, "3 n"], camera: Camera
) -> tuple[Float[Tensor, "3 h w"], Float[Tensor, "h w"]]:
    """Mean colours of the nearest points in each cell of a picture, and their depth; endless where there are
    none."""
    height, width = camera.height // CELL, camera.width // CELL
    there = project_points(points, camera.viewmat, camera.K, (CELL * height, CELL * width))
    some = there.inside.nonzero()[:, 0]
    z, places = there.z[some], there.y[some].long() // CELL * width + there.x[some].long() // CELL
    nearest = z.new_full((height * width,), torch.inf).scatter_reduce(0, places, z, "amin")
    front = z < (1 + FORESEEING.front) * nearest[places]
    some, places = some[front], places[front]
    sums = z.new_zeros(3, height * width).index_add_(1, places, colours[:, some])
    counts = torch.bincount(places, minlength=height * width).clamp_min(1)
    return (sums / counts).view(3, height, width), nearest.view(height, width)


def _alike(
    picture: Float[Tensor, "3 h w"], photo: Float[Tensor, "3 h w"], shown: Bool[Tensor, "h w"]
) -> float | None:
    """Correlation of the differences of grey from cell to cell, across and down, where both are shown: light
    and contrast do not matter; None where one has none."""
    grey = picture.new_tensor(FORESEEING.grey)
    greys = torch.einsum("c,pchw->phw", grey, torch.stack((picture, photo))).double()
    across = greys.diff(dim=2)[:, shown[:, 1:] & shown[:, :-1]]
    down = greys.diff(dim=1)[:, shown[1:] & shown[:-1]]
    ours, theirs = torch.cat((across, down), 1)
    norms = float(ours.norm() * theirs.norm())
    return float(ours @ theirs) / norms if norms > 0 and math.isfinite(norms) else None
