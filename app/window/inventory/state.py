"""The inventory's half of the state. Names of things are edits, as key frames are."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from langflash_core.base.records import Guess
from langflash_core.scene.mask import Mask


@dataclass(frozen=True)
class Row:
    """A thing of the list, as `langflash_core.inventory.Thing` has it.

    rows: its Gaussians, of all of the scene. corners: (8, 3) of its box, in the scene's axes and unit, the
    lower four around it and then the upper four.
    """

    id: str
    kind: str
    sure: float
    place: tuple[float, float, float]
    size: tuple[float, float, float]
    bottom: float
    photos: tuple[int, ...]
    cut: bool
    rows: Mask = field(repr=False)
    corners: Float[np.ndarray, "8 3"] = field(repr=False, compare=False)
    thin: bool = False


@dataclass(frozen=True)
class Listing:
    """The inventory half of the state.

    open: the panel is there. looking: the worker is at it. rows: the things, the largest in a photo first;
    None: nobody looked yet. problem: why there are none. unit: "m", or "units" of the scene. guess: where
    metres are one. chosen: id of the thing that is boxed in the picture.
    """

    open: bool = False
    looking: bool = False
    rows: tuple[Row, ...] | None = None
    problem: str = ""
    unit: str = "units"
    guess: Guess | None = None
    chosen: str = ""

    @property
    def counts(self) -> dict[str, int]:
        """Things of each kind, the most first."""
        kinds = [row.kind for row in self.rows or ()]
        return {kind: kinds.count(kind) for kind in sorted(set(kinds), key=lambda k: (-kinds.count(k), k))}

    def without_scene(self) -> "Listing":
        """For another scene, whose things nobody looked for yet."""
        return Listing(open=self.open)

    def row(self, id: str) -> Row | None:
        """The thing of that name; None where there is none any more."""
        return next((row for row in self.rows or () if row.id == id), None)


NO_LISTING = Listing()
