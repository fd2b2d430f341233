"""A level of a layered scene: every photo's layer a level of its own, of which a camera sees the nearest."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch

from langflash_core.geometry.nearness import NEAREST, Chosen, Nearness
from langflash_core.scene.changes import Change
from langflash_core.types import Camera, Scene

from .level import Level, new_name

KEPT = 2 * NEAREST
"""Layers on the card, those that were drawn last: of a walk past 32 photos eight, not all."""
MOVING = 2
"""Layers of a picture that is to be quick. The second in half the size takes two thirds of the first's time,
at a loss of .3 to .9 dB; without it pictures jump where another layer becomes the nearest."""


class LayeredLevel:
    """Owns the layers of a share of a scene's Gaussians; made as they come into view.

    parts: as prepared, the nearest first, each splatted into a picture of its own and blended by `weights`
    (langflash_core/splat/compose.py): (L,), in sum 1; None of one layer alone. halved: whether all parts but
    the first are projected for half the picture's sides. Keys as of `Level`.
    """

    def __init__(
        self,
        scene: Scene,
        rows: np.ndarray,
        make: Callable[[Scene, np.ndarray], Level],
        nearness: Callable[[], Nearness],
    ):
        """
        Args:
            scene: of n Gaussians. rows: (n,), which of the whole scene's these are.
            make: the level of a scene of one layer, and its rows. nearness: of the whole scene as it stands.
        """
        assert scene.view_ids is not None
        self.parts: tuple[Level, ...] = ()
        self.weights: np.ndarray | None = None
        self.halved = False
        self.order_key = self.places_key = 0
        self._scene = scene
        self._views = scene.view_ids.cpu().numpy()
        self._rows = rows
        self._make = make
        self._nearness = nearness
        self._layers: dict[int, Level] = {}  # by view, the last drawn last
        self._marks: tuple[np.ndarray, np.ndarray] | None = None
        self._changes: tuple[Change, ...] = ()
        self._named: tuple = ()  # what each key names
        self._placed: tuple = ()

    def prepare(self, camera: Camera, quick: bool = False, late: bool = False) -> None:
        """Choose the layers, and order and project theirs.

        Args:
            quick: `MOVING` of them, all but the nearest in half the size. late: as `Level.prepare` has it.
        """
        chosen = self._chosen(camera, quick)
        first, *others = parts = [self._layer(view) for view in chosen.views]
        for part, own in zip(parts, _cameras(camera, len(parts), quick), strict=True):
            part.prepare(own, late=late)
        self.parts, self.halved = tuple(parts), quick and bool(others)
        self.weights = chosen.weights if others else None
        if self.weights is None:
            self.order_key, self.places_key = first.order_key, first.places_key
            self._named = self._placed = ()
        else:
            self._name(self.weights.tobytes())

    @property
    def exact(self) -> bool:
        """Whether all its parts are."""
        return all(part.exact for part in self.parts)

    def ready(self, camera: Camera, quick: bool = False, late: bool = False) -> bool:
        """Make one of the layers that `prepare` would have to make, which takes a frame's time, or else begin
        to find their orders beside the frames; whether nothing is missing any more."""
        views = self._chosen(camera, quick).views
        for view in views:
            if view in self._layers:
                self._layer(view)  # so that it is not given back for another
        missing = [view for view in views if view not in self._layers]
        if missing:
            self._layer(missing[0])
        if len(missing) > 1:
            return False
        cameras = _cameras(camera, len(views), quick)
        ready = [self._layers[view].ready(own, late=late) for view, own in zip(views, cameras, strict=True)]
        return all(ready)

    def _chosen(self, camera: Camera, quick: bool) -> Chosen:
        return self._nearness().chosen(camera, MOVING if quick else NEAREST)

    def _name(self, weights: bytes) -> None:
        named = (weights, *(part.order_key for part in self.parts))
        placed = (named, *(part.places_key for part in self.parts))
        if named != self._named:
            self._named, self.order_key = named, new_name()
        if placed != self._placed:
            self._placed, self.places_key = placed, new_name()

    def _layer(self, view: int) -> Level:
        layer = self._layers.pop(view, None) or self._made(view)
        self._layers[view] = layer
        while len(self._layers) > KEPT:
            self._layers.pop(next(iter(self._layers))).release()
        return layer

    def _made(self, view: int) -> Level:
        own = np.flatnonzero((self._views == view) | (self._views < 0))
        layer = self._make(self._scene.rows(torch.from_numpy(own)), self._rows[own])
        if self._changes:
            layer.change(self._changes)
        if self._marks is not None:
            layer.mark(*self._marks)
        return layer

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> None:
        """As `Level.mark`."""
        self._marks = shown, tints
        for layer in self._layers.values():
            layer.mark(shown, tints)

    def change(self, changes: tuple[Change, ...]) -> None:
        """As `Level.change`."""
        self._changes = changes
        for layer in self._layers.values():
            layer.change(changes)

    @property
    def depth_range(self) -> tuple[float, float]:
        """From the nearest to the farthest of its parts', of those that are in view."""
        seen = [part for part in self.parts if part.splats.num_chosen] or self.parts
        near, far = zip(*(part.depth_range for part in seen), strict=True)
        return min(near), max(far)

    def forget(self) -> None:
        """As `Level.forget`."""
        for layer in self._layers.values():
            layer.forget()

    def release(self) -> None:
        """Give every buffer back."""
        for layer in self._layers.values():
            layer.release()
        self._layers.clear()
        self.parts = ()


Prepared = Level | LayeredLevel
"""What a view draws."""


def _cameras(camera: Camera, num_parts: int, quick: bool) -> list[Camera]:
    """Of each part, the nearest first."""
    return [camera] + (num_parts - 1) * [half(camera) if quick else camera]


def half(camera: Camera) -> Camera:
    """The same view in half the sides, of which the last pixel may be cut."""
    K = camera.K * torch.tensor([0.5, 0.5, 1.0]).to(camera.K)[:, None]
    return replace(camera, K=K, width=-(-camera.width // 2), height=-(-camera.height // 2))
