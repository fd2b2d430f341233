"""A level of a layered scene: every photo's layer a level of its own, of which a camera sees the nearest."""

from collections.abc import Callable

import numpy as np
import torch

from langflash_core.scene.changes import Change
from langflash_core.splat.compose import NEAREST, Nearness
from langflash_core.types import Camera, Scene

from .level import Level, new_name

KEPT = 2 * NEAREST
"""Layers on the card, those that were drawn last: of a walk past 32 photos eight, not all."""
MOVING = 2
"""Layers of a moving picture: the nearest, and the next one where that has holes."""


class LayeredLevel:
    """Owns the layers of a share of a scene's Gaussians; made as they come into view.

    parts: as prepared, the nearest first; in a moving picture one over the other. weights: (L,) by which the
    parts of one at rest are blended; None of a moving one, or of one layer alone.
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

    def prepare(self, camera: Camera, moving: bool = False) -> None:
        """Choose the layers, and order and project theirs."""
        chosen = self._nearness().chosen(camera)
        views = chosen.views[:MOVING] if moving else chosen.views
        self.parts = tuple(self._layer(view) for view in views)
        for part in self.parts:
            part.prepare(camera)
        self.weights = None if moving or len(views) == 1 else chosen.weights
        if len(self.parts) == 1:
            self.order_key, self.places_key = self.parts[0].order_key, self.parts[0].places_key
            self._named = self._placed = ()
        else:
            self._name(None if self.weights is None else self.weights.tobytes())

    def _name(self, weights: bytes | None) -> None:
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
        seen = [part for part in self.parts if len(part.splats.order)] or self.parts
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
