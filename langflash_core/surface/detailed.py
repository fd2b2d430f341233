"""From a network's `Prediction` to a `Scene` as fine as its photos: elements where there is detail.

Depth, poses and groups stay those of the network's grid. Every photo covers all that it shows, by
elements of the size that it asks for (`blocks`, `elements`): a layer of its own, whatever the others see.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.detail import Detail
from langflash_core.base.lazy import Lazy
from langflash_core.base.memory import give_back
from langflash_core.geometry.cameras import world_points
from langflash_core.scene.weights import sparse_weights
from langflash_core.surface.assemble import (
    has_direction,
    mean_distance,
    normalise_gaussians,
    placed_views,
    scaled_poses,
    semantics_of,
    unplaced_photos,
)
from langflash_core.surface.blocks import LEVELS, Tree, grow_tree, leaves, threshold
from langflash_core.surface.borders import refined_weights
from langflash_core.surface.clearance import clearances
from langflash_core.surface.elements import (
    COARSE,
    Elements,
    drawn_in,
    ground,
    join_elements,
    of_squares,
    place_elements,
    under,
)
from langflash_core.surface.settings import LAYERS
from langflash_core.surface.upsampling import Upsampled, upsample_depths
from langflash_core.types import Camera, Cost, Gaussians, Prediction, Record, Scene, Views


def working_size(photo: tuple[int, int], grid: tuple[int, int]) -> tuple[int, int]:
    """(height, width) at which a photo of that (height, width) is used: its own, within one and three times
    the grid's."""
    high = [min(max(p, g), LAYERS.most_enlarged * g) for p, g in zip(photo, grid, strict=True)]
    return high[0], high[1]


def working_photo(photo: Float[Tensor, "3 h w"], grid: tuple[int, int]) -> Float[Tensor, "3 H W"]:
    """A photo (3, h, w) in [0, 1] at its working size."""
    size = working_size((photo.shape[-2], photo.shape[-1]), grid)
    if size == (photo.shape[-2], photo.shape[-1]):
        return photo
    return F.interpolate(photo[None], size=size, mode="bicubic", antialias=True)[0].clamp(0, 1)


def assemble_detailed(
    prediction: Prediction,
    views: Views,
    photos: Sequence[Float[Tensor, "3 _ _"]],
    detail: Detail,
    *,
    gaussians: int | None = None,
    transients: Bool[Tensor, "V H W"] | None = None,
    top_m: int = 8,
    preset: str = "mini",
    progress: Callable[[float], None] = lambda done: None,
) -> Scene:
    """A scene in scene units, as `assemble` makes it, of elements as fine as the photos.

    Args:
        photos: (3, h, w) in [0, 1] of every view, `working_photo`; each may have its own size. Of many
            each is asked for several times and not kept.
        gaussians: about as many; None: as `detail` has it.
        transients: (V, H, W) bool, of the placed views: what gets no Gaussians; None: nothing.
        progress: called with the share that is done, twice a photo; what it raises ends the work.

    Returns:
        Scene with `levels`, `confidences`, `view_ids` and, in its record, `detail`; of several photos one of
        layers (`splat.compose`).

    Raises:
        InputError: not one usable point in view 0.
        ValueError: the prediction's poses are not finite.
    """
    start = time.perf_counter()
    left_out = unplaced_photos(prediction, views)
    if prediction.unplaced:
        photos = [photos[v] for v in range(len(photos)) if v not in prediction.unplaced]
    prediction, views = placed_views(prediction, views)
    if not bool(torch.isfinite(prediction.viewmats).all()):
        raise ValueError("viewmats: expected finite poses, received others")
    known, keep, unit = _valid_depths(prediction, views, transients)
    sights = Lazy(
        lambda v: _Sight.of(photos[v], views.images[v], known[v].log(), keep[v]), len(photos), LAYERS.held
    )
    budget = gaussians or min(round(detail.most * int(keep.sum())), LAYERS.most_gaussians)
    covers, limit = _covers(sights, detail, budget, 0.0 if gaussians else detail.gain, progress)
    made, weights, parts = _make_gaussians(
        prediction, views, _with_progress(sights, progress, 0.5), covers, limit, top_m
    )
    size = sights[0].size
    scene = Scene(
        gaussians=normalise_gaussians(made, unit),
        semantics=semantics_of(prediction, weights),
        viewmats=scaled_poses(prediction.viewmats, unit),
        Ks=views.Ks.clone(),
        view_size=views.size,
        photos=views.sources,
        view_ids=torch.arange(len(parts)).repeat_interleave(torch.tensor([len(p) for p in parts])),
        levels=torch.cat([part.levels for part in parts]),
        confidences=_confidences(prediction, parts),
        record=Record(
            preset=preset,
            layered=len(parts) > 1,
            photos=views.names,
            warnings=(*views.warnings, *prediction.warnings),
            counts={"predicted": keep.numel(), "covered": int(keep.sum())},
            detail=_spending_record(join_elements(parts), detail, budget, size),
            left_out=left_out,
            network_unit=unit,
        ),
    )
    timings = {**prediction.timings, "assembly": time.perf_counter() - start}
    return scene.with_record(cost=Cost(timings))


T = TypeVar("T")


def _with_progress(photos: Sequence[T], progress: Callable[[float], None], begin: float) -> Iterator[T]:
    """One after the other, each told before; half of the whole from `begin` on."""
    for number in range(len(photos)):
        progress(begin + number / len(photos) / 2)
        yield photos[number]


@dataclass(frozen=True)
class _Sight:
    """One photo (3, h, w), its image (3, H, W) and log depths (H, W) of the grid, those at the photo's size,
    how far surfaces go on there (h, w), and what it covers itself, (h, w) bool."""

    photo: Tensor
    image: Tensor
    log_depths: Tensor
    depth: Upsampled
    clear: Tensor
    wanted: Tensor

    @staticmethod
    def of(photo: Tensor, image: Tensor, log_depths: Tensor, keep: Tensor) -> "_Sight":
        wanted = F.interpolate(keep[None, None].float(), size=photo.shape[-2:], mode="nearest")[0, 0] > 0
        depth = upsample_depths(log_depths, image, photo)
        return _Sight(photo, image, log_depths, depth, clearances(depth.log_depths), wanted)

    @property
    def size(self) -> tuple[int, int]:
        return self.photo.shape[-2], self.photo.shape[-1]


def _valid_depths(
    prediction: Prediction, views: Views, transients: Tensor | None
) -> tuple[Tensor, Tensor, float]:
    """Depths (V, H, W) with what is no number put right; cells (V, H, W) bool that get elements; the scene's
    unit."""
    usable = torch.isfinite(prediction.depths) & (prediction.depths > 0)
    middle = prediction.depths[usable].median() if bool(usable.any()) else torch.tensor(1.0)
    depths = torch.where(usable, prediction.depths, middle)
    points = world_points(depths[:1], prediction.viewmats[:1], views.Ks[:1].to(depths))[0]
    nowhere = torch.where(usable[0].flatten()[:, None], points, torch.nan)
    unit = mean_distance(nowhere, prediction.viewmats[0])
    return depths, usable if transients is None else usable & ~transients, unit


@dataclass(frozen=True)
class _Cover:
    """The tree of one photo's squares, and what goes on behind its edges."""

    tree: Tree
    behind: Elements

    @staticmethod
    def of(sight: _Sight, finest: int) -> "_Cover":
        tree = grow_tree(sight.photo, sight.depth.log_depths, sight.clear, sight.wanted, finest)
        behind = under(sight.log_depths, sight.image, sight.size)
        grid = sight.image.shape[1:]
        row, column = behind.cells // grid[1], behind.cells % grid[1]
        ratio = [p / g for p, g in zip(sight.size, grid, strict=True)]
        own = sight.wanted[((row + 0.5) * ratio[0]).long(), ((column + 0.5) * ratio[1]).long()]
        return _Cover(tree, behind.rows(own))


def _covers(
    sights: Sequence[_Sight], detail: Detail, budget: int, least: float, progress: Callable[[float], None]
) -> tuple[list[_Cover], float]:
    """What covers each photo, and the threshold by which all together have at most about `budget` elements,
    each of which gains `least`."""
    covers = [_Cover.of(sight, detail.finest) for sight in _with_progress(sights, progress, 0.0)]
    left = budget - sum(len(cover.behind) for cover in covers)
    return covers, threshold([cover.tree for cover in covers], left, least)


def _make_gaussians(
    prediction: Prediction,
    views: Views,
    sights: Iterable[_Sight],
    covers: list[_Cover],
    limit: float,
    top_m: int,
) -> tuple[Gaussians, list[tuple[Tensor, Tensor]], list[Elements]]:
    """All photos' Gaussians in the world, in the prediction's unit; weights of each photo's, which end where
    it has borders (`borders`); and its elements. A photo at a time."""
    known = has_direction(prediction.dictionary)
    made, weights, parts = [], [], []
    for view, (sight, cover) in enumerate(zip(sights, covers, strict=True)):
        part = _of_view(sight, cover, limit)
        camera = Camera(prediction.viewmats[view], views.Ks[view], *views.size)
        made.append(place_elements(part, sight.log_depths, sight.depth.slopes, camera, sight.size))
        refined = refined_weights(prediction.weights[view][known].float(), sight.image, sight.photo)
        width = sight.size[1]
        ids, values = sparse_weights(refined.at(part.pixels // width, part.pixels % width), top_m)
        weights.append((ids.short(), values))  # of many photos: a quarter of the memory
        parts.append(part)
        if len(covers) > LAYERS.held:
            give_back()
    names = ("means", "quats", "scales", "opacities", "sh")
    whole = Gaussians(*(torch.cat([getattr(some, name) for some in made]) for name in names))
    return whole, weights, parts


def _of_view(sight: _Sight, cover: _Cover, limit: float) -> Elements:
    squares, beneath = leaves(cover.tree, limit)
    parts = [of_squares(some, sight.photo, sight.depth) for some in squares if len(some)]
    parts.append(ground(beneath, sight.photo, sight.depth))
    return join_elements([*(drawn_in(part, sight.clear) for part in parts), cover.behind])


def _confidences(prediction: Prediction, parts: list[Elements]) -> Tensor:
    maps = prediction.confidences.flatten(1)
    return torch.cat([own[part.cells] for own, part in zip(maps, parts, strict=True)]).clamp(0, 1)


def _spending_record(elements: Elements, detail: Detail, budget: int, size: tuple[int, int]) -> dict:
    """What the record says of it."""
    coarse = int((elements.levels == COARSE).sum())
    squares = elements.sides[
        ~elements.hidden | (elements.sides <= LAYERS.ground)
    ]  # not what goes on under others
    sides = {str(2**level): int((squares == 2**level).sum()) for level in range(LEVELS + 1)}
    return {
        "level": detail.name,
        "asked": budget,
        "elements": len(elements),
        "coarse": coarse,
        "fine": len(elements) - coarse,
        "by_size": sides,
        "photo_size": [size[1], size[0]],
    }
