"""What collection is made of: who proposes masks, who follows them, who says what they are.

Sizes: N masks, M objects of a clip, H W pixels of a frame, C channels of a language space. *Ids* are maps
(H, W) uint16: 0 nobody's, else the object's number, from 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, UInt8, UInt16
from torch import Tensor

from langflash_core.lab.labels.clips import Clip


@dataclass(frozen=True)
class Proposals:
    """Masks (N, H, W) bool of one frame; scores (N,) in [0, 1], how sure the proposer is of each."""

    masks: Bool[np.ndarray, "N H W"]
    scores: Float[np.ndarray, " N"]

    def __len__(self) -> int:
        return len(self.masks)

    def rows(self, keep: np.ndarray) -> "Proposals":
        """Some of them, by a mask or by numbers."""
        return Proposals(self.masks[keep], self.scores[keep])


@runtime_checkable
class MaskProposer(Protocol):
    """Masks of what could be an object in a frame."""

    def propose(
        self, image: UInt8[np.ndarray, "H W 3"], where: Bool[np.ndarray, "H W"] | None = None
    ) -> Proposals:
        """All that is good enough by the proposer's own measure; may overlap and repeat itself.

        Args:
            where: only things that show here are wanted; None: everywhere.
        """
        ...


@runtime_checkable
class MaskRefiner(Protocol):
    """Makes rough masks good."""

    def refine(
        self,
        image: UInt8[np.ndarray, "H W 3"],
        masks: Bool[np.ndarray, "N H W"],
        known: Bool[np.ndarray, "H W"],
    ) -> Proposals:
        """One mask for each, in order; score 0 where the refiner sees nothing like it.

        Args:
            known: where the rough masks say something; elsewhere a thing may go on.
        """
        ...


@runtime_checkable
class Following(Protocol):
    """Objects on their way through one clip, frame after frame."""

    def add(self, frame: int, ids: UInt16[np.ndarray, "H W"]) -> None:
        """Follow these from the current frame on: new numbers, or more of known ones; where nobody is yet."""
        ...

    def to(self, frame: int) -> UInt16[np.ndarray, "H W"]:
        """Where all objects are in this frame, the one after the current."""
        ...


@runtime_checkable
class MaskPropagator(Protocol):
    """Carries masks from frame to frame."""

    def follow(self, clip: Clip) -> Following:
        """Begin at the clip's first frame, without objects."""
        ...


@runtime_checkable
class ImageTextEncoder(Protocol):
    """Cut-outs and phrases to one space. space: its name, as scenes name it; dimension: C."""

    space: str
    dimension: int

    def embed(
        self, image: UInt8[np.ndarray, "H W 3"], masks: Bool[np.ndarray, "N H W"]
    ) -> Float[Tensor, "N C"]:
        """Unit vectors of what masks show."""
        ...

    def texts(self, phrases: Sequence[str]) -> Float[Tensor, "P C"]:
        """Unit vectors of phrases."""
        ...
