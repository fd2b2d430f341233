"""A scene as edits left it, as those who draw it take it."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from langflash_core.scene.changes import Change, Recoloured
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask

from ..scene.memory import SceneMemory

if TYPE_CHECKING:
    from langflash_core.types import Scene


@dataclass(frozen=True)
class Marked:
    """N Gaussians. memory: of the scene. doomed: what a preview would delete. gesture: a change under way."""

    memory: SceneMemory = field(compare=False)
    marks: Marks
    doomed: Mask | None = None
    gesture: Change | None = None

    @property
    def changes(self) -> tuple[Change, ...]:
        """All of them, in order."""
        return self.marks.changes if self.gesture is None else (*self.marks.changes, self.gesture)

    @cached_property
    def shown(self) -> tuple[np.ndarray, np.ndarray]:
        """Which Gaussians are there (N,) bool, and their tints (N,) uint8 (`splats.TINTS`), 0 for none."""
        recoloured = isinstance(self.gesture, Recoloured)  # its colour is to be seen
        tints = np.zeros(self.marks.selected.count, np.uint8) if recoloured else _ones(self.marks.selected)
        if self.doomed is not None:
            np.maximum(tints, 2 * _ones(self.doomed), out=tints)
        return self.marks.visible.rows(), tints

    @cached_property
    def edited(self) -> "Scene":
        """All Gaussians, moved and recoloured."""
        return self.memory.changed(self.marks, self.gesture)


def _ones(mask: Mask) -> np.ndarray:
    """(N,) uint8, 1 for those of a set."""
    return mask.rows().view(np.uint8)
