"""A prediction to a scene as fine as its photos: one light, elements of the size that each photo asks
for, weights with the photo's borders, colours solved for. Composes stages; nothing is learned or fitted
in shape.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import torch
from jaxtyping import Bool
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.at_once import at_once
from langflash_core.base.detail import Detail
from langflash_core.base.lazy import Lazy
from langflash_core.base.running import Progress
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.harmonics import colour_to_sh, sh_to_colour
from langflash_core.geometry.nearness import Nearness
from langflash_core.images.views import source_picture
from langflash_core.rig.rig import Rig
from langflash_core.scene.report import left_out_line
from langflash_core.surface.assemble import placed_views, rig_of
from langflash_core.surface.colours import solved_colours
from langflash_core.surface.detailed import assemble_detailed, working_photo
from langflash_core.surface.exposure_compensation import ExposureCompensation, compensate_exposure
from langflash_core.surface.foreseen import foresight
from langflash_core.surface.prune import prune
from langflash_core.surface.settings import COLOURS, LAYERS
from langflash_core.surface.transients import transient_masks
from langflash_core.types import Cost, Prediction, Scene, Views

_LEFT_OUT = "{} disagrees with the other photos and was left out"
_LEFT_OUT_OF_SOME = "{} disagree with the other photos and were left out"


@dataclass(frozen=True)
class Covered:
    """A scene in its photos' own colours; the photos, all their light in [0, 1]; where they say nothing; and
    the light of all."""

    scene: Scene
    photos: Sequence[Tensor]
    left: Bool[Tensor, "V H W"]
    light: ExposureCompensation


@torch.no_grad()
def covered_scene(
    prediction: Prediction,
    views: Views,
    detail: Detail,
    *,
    gaussians: int | None,
    preset: str,
    progress: Progress = lambda stage, fraction: None,
) -> Covered:
    """The scene of a prediction whose depth maps are surfaces, before colours are solved for: all that needs
    the prediction, whose maps of many photos are much memory.

    Args:
        gaussians: about so many; None: as `detail` has it. preset: recorded.
        progress: called before each step; what it raises ends the work there.

    Raises:
        InputError: not one usable point in view 0.
        ValueError: the prediction's sizes disagree, or its poses are not finite.
    """
    start = time.perf_counter()
    progress("light", 0.0)
    prediction, views = placed_views(prediction, views)
    rig = rig_of(prediction, views)
    light = compensate_exposure(rig)
    photos, whole = _lit_photos(views, light), _lit_photos(views, light.whole)
    views = replace(views, images=light.correct_photos(views.images).clamp(0, 1))
    rig = rig_of(prediction, views)  # in the light of all
    left = transient_masks(rig)
    bare = left | (False if gaussians else ~_with_layers(prediction)[:, None, None])
    scene = assemble_detailed(
        prediction,
        views,
        photos,
        detail,
        gaussians=gaussians,
        transients=bare if bool(bare.any()) else None,
        preset=preset,
        progress=lambda done: progress("elements", 0.1 + 0.3 * done),
    )
    foreseen = _foreseen(rig)
    timings = {**prediction.timings, "assembly": time.perf_counter() - start}
    return Covered(scene.with_record(foreseen=foreseen, cost=Cost(timings)), whole, left, light)


@torch.no_grad()
def coloured_scene(covered: Covered, progress: Progress = lambda stage, fraction: None) -> Scene:
    """The scene in the colours of all its photos, without what nobody sees; `progress` as `covered_scene`."""
    solving, left, light = time.perf_counter(), covered.left, covered.light
    silent = Lazy(lambda view: _silenced(covered.photos[view], left[view]), len(left))
    scene = _colour_layers(covered.scene, silent, light, lambda done: progress("colours", 0.4 + 0.5 * done))
    timings = {**scene.record.cost.timings, "colours": time.perf_counter() - solving}
    shares = _shares(left)
    said = (*scene.record.warnings, *_overlap_notes(shares, scene.record.photos))
    left_out = {**scene.record.left_out, **shares}
    record = {"light": covered.light.stored(), "left_out": left_out, "warnings": said}
    scene = scene.with_record(**record, cost=Cost(timings))
    progress("prune", 0.9)
    return prune(scene, merge=False)


def _lit_photos(views: Views, light: ExposureCompensation) -> Lazy[Tensor]:
    """Photos (3, h, w) at their working size, in the light of all; many are decoded anew whenever they are
    asked for."""
    grid = (views.images.shape[-2], views.images.shape[-1])

    def photo(view: int) -> Tensor:
        own = working_photo(source_picture(views, view), grid)
        return light.correct_photos(own, view=view).clamp(0, 1)

    return Lazy(photo, views.num_views, LAYERS.held)


def _silenced(photo: Tensor, left: Tensor) -> Tensor:
    """A photo (3, h, w) that says nothing, is no number, where `left` (H, W) is."""
    if not bool(left.any()):
        return photo
    there = F.interpolate(left[None, None].float(), size=photo.shape[-2:], mode="nearest")[0] > 0
    return torch.where(there, torch.nan, photo)


def _foreseen(rig: Rig) -> dict[str, list]:
    """What a record says of how much of each photo its neighbours foresee: nothing of a single one."""
    return {} if len(rig) < 2 else foresight(rig).stored()


def _shares(left: Tensor) -> dict[str, list[float]]:
    """What a record says of what was left out of photos (V, H, W): nothing of nothing."""
    shares = [round(share, 4) for share in left.flatten(1).float().mean(1).tolist()]
    return {"shares": shares} if any(shares) else {}


def _overlap_notes(left_out: dict[str, list[float]], names: tuple[str, ...]) -> list[str]:
    """Which photos show what others do not, and how much of them that is; nothing of none."""
    count, line = sum(share > 0 for share in left_out.get("shares", ())), left_out_line(left_out, names)
    if count < 2:
        return [_LEFT_OUT.format(line)] if count else []
    return [_LEFT_OUT_OF_SOME.format(line)]


def _with_layers(prediction: Prediction) -> Bool[Tensor, " V"]:
    """Which photos keep a layer: all, or `LAYERS.most` that lie all over the walk."""
    poses = prediction.viewmats.cpu().double()
    depths = prediction.depths[0]
    usable = depths[torch.isfinite(depths) & (depths > 0)]
    distance = float(usable.median()) if len(usable) else 1.0
    centres, axes = invert_rigid(poses)[:, :3, 3].numpy(), poses[:, 2, :3].numpy()
    kept = Nearness(centres, axes, distance, tuple(range(len(poses)))).spread(LAYERS.most)
    return torch.zeros(len(poses), dtype=torch.bool).index_fill(0, torch.tensor(kept), True)


def _colour_layers(
    scene: Scene, photos: Sequence[Tensor], light: ExposureCompensation, progress: Callable[[float], None]
) -> Scene:
    """Each photo's layer in the colours that make that photo (3, h, w) again; the record says how near they
    come.

    What the brightest and the darkest photos show beyond black and white in the light of all is kept:
    at their places it is seen (`scene.exposure`).
    """
    assert scene.view_ids is not None
    low, high = (ends.float() for ends in light.span)
    start = sh_to_colour(scene.gaussians.sh, scene.gaussians.means)
    own = light.whole.gains.square().mean(1).sqrt().tolist()
    starts = torch.searchsorted(scene.view_ids, torch.arange(len(photos) + 1)).tolist()  # in order of views

    def solved(view: int) -> tuple[Tensor, float]:
        rows, photo = slice(starts[view], starts[view + 1]), photos[view]
        found = solved_colours(
            scene.gaussians.map(lambda values: values[rows]),
            (start[rows] - low) / (high - low),
            scene.camera(view, photo.shape[-1], photo.shape[-2]),
            photo,
        )
        return found.colours, found.psnr[1] + 20 * math.log10(own[view])

    def turns() -> Iterator[int]:
        for view in range(len(photos)):
            progress(view / len(photos))
            if starts[view] < starts[view + 1]:  # it has a layer
                yield view

    colours, near = zip(*at_once(solved, turns()), strict=True)
    sh = colour_to_sh(low + (high - low) * torch.cat(colours))[:, None]
    bought = {
        **scene.record.detail,
        "rounds": COLOURS.rounds,
        "photos_psnr_db": [round(db, 2) for db in near],
    }
    return replace(scene, gaussians=replace(scene.gaussians, sh=sh)).with_record(detail=bought)
