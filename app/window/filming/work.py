"""The worker's side of filming: the way of a film along key frames."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from langflash_core.geometry.poses import Pose, alike, from_view, to_camera

from ..commands import Command
from ..requests import Asked, Task
from .commands import TourReady

_SIDE = 900  # pixels of the cameras that are computed with


@dataclass(frozen=True)
class PlanTour(Task):
    """The same splines that `langflash export --path` follows."""

    keys: tuple[Pose, ...]
    seconds: float

    newest_counts = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield TourReady(self.keys, way(self.keys, self.seconds), self.seconds)


def way(keys: Sequence[Pose], seconds: float) -> tuple[Pose, ...]:
    """Poses of a film of so many seconds along two or more key frames."""
    from langflash_core.geometry.tours import along  # loads torch; the worker has by now

    keys = alike(keys)
    width, height = _SIDE, max(2, round(_SIDE / keys[0].aspect))
    cameras = along(
        [to_camera(key, width, height) for key in keys], np.linspace(0, seconds, len(keys)).tolist()
    )
    size = (cameras[0].width, cameras[0].height)
    reaches = np.interp(
        np.linspace(0, len(keys) - 1, len(cameras)), range(len(keys)), [k.reach for k in keys]
    )
    lenses = ((c.viewmat.double().numpy(), c.K.double().numpy(), c.orthographic) for c in cameras)
    return tuple(
        from_view(viewmat, K, size, float(reach), flat)
        for (viewmat, K, flat), reach in zip(lenses, reaches, strict=True)
    )
