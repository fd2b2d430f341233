"""MobileSAM or SAM 2 as proposer and refiner: a grid of points, or a rough mask as a prompt.

Sizes: N masks, H W pixels of a frame, P points.
"""

import math
from typing import Any, Protocol, runtime_checkable

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from langflash_core.lab.labels.protocols import Proposals
from langflash_core.network.semantics.mobile_sam.rough import agreement, box, middle

_AT_ONCE = 16  # prompts; more need more memory and are no quicker on a processor
_WOBBLE = 1.0  # by which the border's logit is moved to see whether a mask stands
_LOOKS_KEPT = 2


@runtime_checkable
class Prompted(Protocol):
    """A network of the SAM family, as `MobileSam` says it: what `look` gives is handed back with every
    question; q is the side of its masks, k how many it gives a prompt."""

    def look(self, image: UInt8[np.ndarray, "H W 3"]) -> Any: ...

    def by_points(self, looked: Any, points: Float[Tensor, "N 2"]) -> tuple[Tensor, Tensor]: ...

    def by_masks(
        self,
        looked: Any,
        masks: Float[Tensor, "N H W"],
        points: Float[Tensor, "N P 2"],
        boxes: Float[Tensor, "N 4"],
    ) -> tuple[Tensor, Tensor]: ...

    def on_photo(self, logits: Float[Tensor, "*N q q"], looked: Any) -> Float[Tensor, "*N H W"]: ...


class PromptedSam:
    """Both roles with one encoder: a frame is looked at once, whoever asks."""

    def __init__(
        self, model: Prompted, grid: int = 16, least_score: float = 0.8, least_stability: float = 0.9
    ) -> None:
        """Wraps a network.

        Args:
            grid: points along the frame's longer side. least_score: predicted IoU; least_stability: IoU of a
                mask with itself when its border moves; below, a proposal is dropped.
        """
        self.model = model
        self._grid, self._least_score, self._least_stability = grid, least_score, least_stability
        self._looks: list[tuple[np.ndarray, Any]] = []

    def propose(
        self, image: UInt8[np.ndarray, "H W 3"], where: Bool[np.ndarray, "H W"] | None = None
    ) -> Proposals:
        """What points of a grid (those inside `where`) belong to, three masks a point, sure and stable."""
        points = grid_points(image.shape[:2], self._grid, where)
        looked = self._looked(image)
        masks, scores = [np.zeros((0, *image.shape[:2]), bool)], [np.zeros(0)]
        for start in range(0, len(points), _AT_ONCE):
            asked = torch.from_numpy(points[start : start + _AT_ONCE]).float()
            logits, sure = (values.flatten(0, 1) for values in self.model.by_points(looked, asked))
            stable = stability(logits)
            keep = (sure >= self._least_score) & (stable >= self._least_stability)
            masks.append((self.model.on_photo(logits[keep], looked) > 0).numpy())
            scores.append((sure.clamp(0, 1) * stable)[keep].double().numpy())
        return Proposals(np.concatenate(masks), np.concatenate(scores))

    def refine(
        self,
        image: UInt8[np.ndarray, "H W 3"],
        masks: Bool[np.ndarray, "N H W"],
        known: Bool[np.ndarray, "H W"],
    ) -> Proposals:
        """The mask nearest to each rough one among those that its box, middle and shape ask for; the score is
        their IoU where something is known."""
        looked = self._looked(image)
        refined, scores = [np.zeros((0, *image.shape[:2]), bool)], [np.zeros(0)]
        for start in range(0, len(masks), _AT_ONCE):
            rough = masks[start : start + _AT_ONCE]
            points = torch.tensor(np.stack([middle(mask) for mask in rough])).float()[:, None]
            boxes = torch.tensor(np.stack([box(mask) for mask in rough])).float()
            given = torch.from_numpy(np.where(known, np.where(rough, 1.0, -1.0), 0.0)).float()
            logits, _ = self.model.by_masks(looked, given, points, boxes)
            found = (self.model.on_photo(logits, looked) > 0).numpy()  # (n, 4, H, W)
            agree = agreement(found, rough, known)
            best = agree.argmax(1)
            rows = np.arange(len(rough))
            refined.append(found[rows, best])
            scores.append(agree[rows, best])
        return Proposals(np.concatenate(refined), np.concatenate(scores))

    def _looked(self, image: np.ndarray) -> Any:
        """Of this very array, encoded once."""
        for seen, looked in self._looks:
            if seen is image:
                return looked
        looked = self.model.look(image)
        self._looks = [(image, looked), *self._looks][:_LOOKS_KEPT]
        return looked


def grid_points(size: tuple[int, int], grid: int, where: Bool[np.ndarray, "H W"] | None) -> np.ndarray:
    """Middles (P, 2), x and y, of the cells of a grid; with `where`, cells that show some of it have their
    point inside it, as deep as possible."""
    height, width = size
    cell = max(size) / grid
    rows, columns = max(1, math.ceil(height / cell)), max(1, math.ceil(width / cell))
    points = []
    deep = None if where is None else cv2.distanceTransform(np.pad(where, 1).astype(np.uint8), cv2.DIST_L2, 3)
    for row in range(rows):
        for column in range(columns):
            top, bottom = height * row // rows, max(height * (row + 1) // rows, height * row // rows + 1)
            left, right = width * column // columns, max(width * (column + 1) // columns, 1)
            if deep is None:
                points.append(((left + right) / 2, (top + bottom) / 2))
                continue
            inside = deep[1:-1, 1:-1][top:bottom, left:right]
            if inside.size and inside.max() >= 1.5:
                y, x = np.unravel_index(int(inside.argmax()), inside.shape)
                points.append((left + x + 0.5, top + y + 0.5))
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def stability(logits: Tensor) -> Tensor:
    """IoU (N,) of each mask of logits (N, h, w) cut a little higher and a little lower."""
    inner = (logits > _WOBBLE).flatten(1).sum(1)
    outer = (logits > -_WOBBLE).flatten(1).sum(1)
    return inner / outer.clamp_min(1)
