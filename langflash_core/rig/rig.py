"""The photos of one scene and all that is known of their geometry, in one frozen record.

Sizes: V photos, H W pixels of their depth maps, n points.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.rig.projected import Projected, project_points

Some = int | slice | Sequence[int]
"""One photo, by its number, or several."""


CONFIDENT_ERROR = 0.1
"""Relative error of depth that counts as a confidence of 1/2."""


def confidences_of(log_errors: Float[Tensor, "*n"]) -> Float[Tensor, "*n"]:
    """1 / (1 + b / `CONFIDENT_ERROR`), in (0, 1), of log b, the expected absolute error of log depth."""
    return torch.sigmoid(torch.log(torch.tensor(CONFIDENT_ERROR)) - log_errors)


@dataclass(frozen=True)
class DepthMaps:
    """log_depths and log_errors (..., H, W): log z, and log b of its expected error."""

    log_depths: Float[Tensor, "... H W"]
    log_errors: Float[Tensor, "... H W"]

    @property
    def depths(self) -> Float[Tensor, "... H W"]:
        return self.log_depths.exp()

    @property
    def confidences(self) -> Float[Tensor, "... H W"]:
        """1 / (1 + b / `CONFIDENT_ERROR`), in (0, 1)."""
        return confidences_of(self.log_errors)


@dataclass(frozen=True)
class Rig:
    """viewmats: world to camera, OpenCV axes, in any unit. Ks: pixels of the depth maps. depths: z > 0, in
    that unit. confidences: in [0, 1]; None: nobody asks. photos: in [0, 1], sRGB; None: nobody looks at them.

    Raises:
        ValueError: a field is of another number of photos, or of another size.
    """

    viewmats: Float[Tensor, "V 4 4"]
    Ks: Float[Tensor, "V 3 3"]
    depths: Float[Tensor, "V H W"]
    confidences: Float[Tensor, "V H W"] | None = None
    photos: Float[Tensor, "V 3 H W"] | None = None

    def __post_init__(self) -> None:
        count, height, width = self.depths.shape
        expected = {
            "viewmats": (count, 4, 4),
            "Ks": (count, 3, 3),
            "confidences": (count, height, width),
            "photos": (count, 3, height, width),
        }
        for name, shape in expected.items():
            values = getattr(self, name)
            if values is not None and values.shape != shape:
                raise ValueError(f"{name}: expected shape {shape}, received {tuple(values.shape)}")

    def __len__(self) -> int:
        return len(self.depths)

    @staticmethod
    def of_logs(
        log_depths: Float[Tensor, "V H W"],
        viewmats: Float[Tensor, "V 4 4"],
        Ks: Float[Tensor, "V 3 3"],
        log_errors: Float[Tensor, "V H W"] | None = None,
        photos: Float[Tensor, "V 3 H W"] | None = None,
    ) -> "Rig":
        """With `log_depths` and `log_errors` bit by bit: a logarithm of what was raised again is another
        number."""
        confidences = None if log_errors is None else confidences_of(log_errors)
        rig = Rig(viewmats, Ks, log_depths.exp(), confidences, photos)
        rig.__dict__["log_depths"] = log_depths
        if log_errors is not None:
            rig.__dict__["log_errors"] = log_errors
        return rig

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the depth maps."""
        return self.depths.shape[1], self.depths.shape[2]

    @cached_property
    def poses(self) -> Float[Tensor, "V 4 4"]:
        """Camera to world."""
        return torch.stack([invert_rigid(own) for own in self.viewmats])

    @cached_property
    def log_depths(self) -> Float[Tensor, "V H W"]:
        """Natural logarithms."""
        return self.depths.log()

    @cached_property
    def log_errors(self) -> Float[Tensor, "V H W"]:
        """Natural logarithm of b, the expected absolute error of log depth (`confidences_of`)."""
        assert self.confidences is not None, "whoever asks knows them"
        return math.log(CONFIDENT_ERROR) - self.confidences.logit()

    def with_logs(self, log_depths: Float[Tensor, "V H W"]) -> "Rig":
        """The same photos with other depths."""
        errors = None if self.confidences is None else self.log_errors
        return Rig.of_logs(log_depths, self.viewmats, self.Ks, errors, self.photos)

    def some(self, views: Sequence[int]) -> "Rig":
        """Some of the photos, bit by bit."""
        chosen = torch.tensor(list(views), device=self.depths.device)
        errors = None if self.confidences is None else self.log_errors[chosen]
        photos = None if self.photos is None else self.photos[chosen]
        logs, viewmats, Ks = (values[chosen] for values in (self.log_depths, self.viewmats, self.Ks))
        return Rig.of_logs(logs, viewmats, Ks, errors, photos)

    def map(self, change: Callable[[Tensor], Tensor]) -> "Rig":
        """Apply `change` to every field (casting, moving)."""
        confidences, photos = (None if v is None else change(v) for v in (self.confidences, self.photos))
        return Rig(change(self.viewmats), change(self.Ks), change(self.depths), confidences, photos)

    def in_camera(self, view: int) -> Float[Tensor, "H W 3"]:
        """What the pixels of a photo show, in the frame of its camera."""
        return unproject(self.depths[view], self.Ks[view])

    def points(self, view: int) -> Float[Tensor, "3 HW"]:
        """What the pixels of a photo show, in the world, row by row."""
        return self.in_world(self.in_camera(view).flatten(0, 1).T, view)

    def in_world(self, points: Float[Tensor, "3 n"], view: int) -> Float[Tensor, "3 n"]:
        """Points in the frame of a photo's camera, in the world."""
        return self.poses[view, :3, :3] @ points + self.poses[view, :3, 3:]

    def project(self, points: Float[Tensor, "*#b 3 n"], views: Some) -> Projected:
        """Points of the world in one photo, or in several at once."""
        return project_points(points, self.viewmats[views], self.Ks[views], self.size)

    def reproject(self, view: int, others: Some, points: Float[Tensor, "3 n"] | None = None) -> Projected:
        """What the pixels of a photo show, in another photo, or in several at once.

        Args:
            points: in the frame of the photo's camera; None: of all its pixels, row by row.
        """
        if points is None:
            points = self.in_camera(view).flatten(0, 1).T
        relative = self.viewmats[others] @ invert_rigid(self.viewmats[view])
        return project_points(points, relative, self.Ks[others], self.size)
