"""From refined depth of photos in their places to one surface that all of them show: the stages after the
sweep, each a plain function of a rig to a rig. Nothing here is learned."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.many import in_groups
from langflash_core.base.running import Run
from langflash_core.cameras.structure import grey_photos
from langflash_core.depth.planes import flatten_ripples
from langflash_core.depth.planesweep import sweep_planes
from langflash_core.depth.registration import register_depths
from langflash_core.depth.sharpening import sharpen_depths
from langflash_core.rig.neighbours import source_views
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import (
    CHOICE,
    FLATTENING,
    PLANE_SWEEP,
    REGISTRATION,
    SHARPENING,
    Choice,
    Flattening,
    PlaneSweep,
    Registration,
    Sharpening,
)
from langflash_core.types import Views

_SWEPT = 0.3  # of the time of refinement, before photos are registered one by one


@dataclass(frozen=True)
class Surfaces:
    """Settings of all stages after the sweep."""

    sharpening: Sharpening = SHARPENING
    flattening: Flattening = FLATTENING
    choice: Choice = CHOICE
    plane_sweep: PlaneSweep = PLANE_SWEEP
    registration: Registration = REGISTRATION


SURFACES = Surfaces()


def one_surface(
    rig: Rig, guessed: Sequence[int], views: Views, run: Run, settings: Surfaces = SURFACES
) -> Rig:
    """The rig with depth that has the photos' edges and planes; where places are known, also what the
    sweep had missed, and photos that meet to a fraction of their pixels.

    Args:
        guessed: photos whose place is not known. views: the photos at their own size, where it is at hand.
    """
    rig = flatten(sharpen(rig, settings.sharpening), settings.flattening)
    placed = [view for view in range(len(rig)) if view not in guessed]
    if len(placed) < 2:
        return rig
    log_depths, greys = rig.log_depths.clone(), grey_photos(views)
    settled = _refine_depths(rig.some(placed), [greys[view] for view in placed], run, settings)
    log_depths[placed] = settled.log_depths
    return rig.with_logs(log_depths)


def _refine_depths(rig: Rig, greys: Sequence[np.ndarray], run: Run, settings: Surfaces) -> Rig:
    """Photos whose places are known."""
    near = source_views(rig, settings=settings.choice)
    rig = _beside(rig, lambda own: sweep_planes(own, greys, near, run.check, settings.plane_sweep))
    rig = sharpen(rig, settings.sharpening)
    told = run.counted("refinement", "photo", range(len(rig)), _SWEPT)

    def each(view: int, make: Callable[[], Tensor]) -> Tensor:
        next(told)
        found = run.kept(f"depth-{view}", lambda: {"log_depths": make().numpy()})
        return torch.from_numpy(np.array(found["log_depths"]))

    rig = _beside(rig, lambda own: register_depths(own, greys, near, run.check, each, settings.registration))
    return flatten(rig, settings.flattening)


def _beside(rig: Rig, work: Callable[[Rig], Rig]) -> Rig:
    """The rig with the depths that `work` finds; of OpenCV and scipy, it sees poses, lenses and depths, on
    the processor."""
    own = Rig.of_logs(rig.log_depths.cpu(), rig.viewmats.cpu(), rig.Ks.cpu())
    return rig.with_logs(work(own).log_depths.to(rig.depths))


def sharpen(rig: Rig, settings: Sharpening = SHARPENING) -> Rig:
    """Edges of depth where the photos have them."""
    assert rig.photos is not None, "edges are the photos'"
    return rig.with_logs(one_by_one(partial(sharpen_depths, settings=settings), rig.log_depths, rig.photos))


def flatten(rig: Rig, settings: Flattening = FLATTENING) -> Rig:
    """What is flat within its own uncertainty is flat."""
    return rig.with_logs(
        in_groups(partial(flatten_ripples, settings=settings), rig.log_depths, rig.log_errors)
    )


def one_by_one(work: Callable[..., Tensor], *of_views: Tensor) -> Tensor:
    """What `work` makes of all views (V, ...), view by view: a processor's caches hold one, not eight."""
    return torch.cat([work(*own) for own in zip(*(values.split(1) for values in of_views), strict=True)])
