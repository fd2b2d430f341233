"""The photos of one scene and all that is known of their geometry, in one frozen record.

Sizes: V photos, H W pixels of their depth maps, n points.
"""

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
        log_depths: Float[Tensor, "V H W"], viewmats: Float[Tensor, "V 4 4"], Ks: Float[Tensor, "V 3 3"]
    ) -> "Rig":
        """With `log_depths` bit by bit: a logarithm of what was raised again is another number."""
        rig = Rig(viewmats, Ks, log_depths.exp())
        rig.__dict__["log_depths"] = log_depths
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

    def map(self, change: Callable[[Tensor], Tensor]) -> "Rig":
        """Apply `change` to every field (casting, moving)."""
        fields = (self.viewmats, self.Ks, self.depths, self.confidences, self.photos)
        return Rig(*(None if values is None else change(values) for values in fields))

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
