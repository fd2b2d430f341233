"""A share of a scene's Gaussians, ordered and projected."""

from itertools import count

import numpy as np
import torch

from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import Change
from langflash_core.types import Camera, Gaussians

from .ordering import camera_key
from .splats import SplatBuffers

_names = count(1)  # each given once, so that no two contents are ever taken for each other


class Level:
    """A share of a scene's Gaussians, ordered and projected for one camera at a time; its only part.

    `order_key` names the Gaussians and their order, `places_key` also their footprints and colours: what was
    drawn from another order or other places shows another key. exact: whether the order is that camera's, and
    not one that follows it. weights, halved: as of `LayeredLevel`.
    """

    weights: np.ndarray | None = None
    halved = False

    def __init__(self, splats: SplatBuffers, rows: np.ndarray, gaussians: Gaussians):
        """rows: of the scene's N Gaussians, that this level draws. gaussians: as it draws them."""
        self.splats = splats
        self.order_key = self.places_key = 0
        self.exact = False
        self._rows = rows
        self._gaussians = gaussians
        self._changes: tuple[Change, ...] | None = None  # to be brought to the card
        self._camera: tuple | None = None  # that the Gaussians are ordered for
        self._projected = False
        self._norms: tuple[bytes, np.ndarray] | None = None  # factor and |f_i|

    @property
    def parts(self) -> "tuple[Level, ...]":
        return (self,)

    def prepare(self, camera: Camera, quick: bool = False, late: bool = False) -> None:
        """Order and project the Gaussians, unless they are for this camera and these marks; the same
        where it is to be quick.

        Args:
            late: in an order that may be of a camera some frames before.
        """
        self._place()
        key = camera_key(camera)
        if key != self._camera or not (late or self.exact):
            if late:
                self.exact = self.splats.follow(camera)
            else:
                self.splats.sort(camera)
                self.exact = True
            self._camera, self._projected, self.order_key = key, False, new_name()
        if not self._projected:
            self.splats.project(camera)
            self._projected, self.places_key = True, new_name()

    def _place(self) -> None:
        if self._changes is not None:
            self.splats.place(apply_changes(self._gaussians, self._changes, torch.from_numpy(self._rows)))
            self._changes = None

    def ready(self, camera: Camera, quick: bool = False, late: bool = False) -> bool:
        """As `LayeredLevel.ready`: all that it draws is there but for an order, which is found beside the
        frames."""
        self._place()
        if late or (self.exact and camera_key(camera) == self._camera):
            return True
        return self.splats.found(camera)

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> None:
        """Bring the scene's marks to this level: shown (N,) bool, tints (N,) uint8."""
        if self.splats.mark(shown[self._rows], tints[self._rows]):
            self._camera = None
        self._projected = False

    def change(self, changes: tuple[Change, ...]) -> None:
        """Draw the Gaussians as edits moved and recoloured them, from the next picture on."""
        self._changes, self._camera = changes, None

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the middle 96 % of the Gaussians in view, scene units."""
        return self.splats.depth_range

    def norms(self, factor: np.ndarray) -> np.ndarray:
        """|f_i| (N,) of the level's Gaussians over a dictionary with factor R (K, r); kept for the last R."""
        named = factor.tobytes()
        if self._norms is None or self._norms[0] != named:
            self._norms = named, np.linalg.norm(self.splats.carried.mixed(factor), axis=1)
        return self._norms[1]

    def forget(self) -> None:
        """Order and project anew for the next picture."""
        self._camera = None

    def release(self) -> None:
        """Give every buffer back."""
        self.splats.release()


def new_name() -> int:
    """A key that no content has yet."""
    return next(_names)
