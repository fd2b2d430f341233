"""Steps that learn from rendered rooms and labelled photos at once.

Photos have one view, other sizes and holes in their labels, so a step takes a batch of each and adds
their losses by their shares of the pictures.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import torch

from langflash_core.lab.training.batches import RoomSet, SceneBatch
from langflash_core.lab.training.outlined import OutlinedSet
from langflash_core.lab.training.stages.stage import Loss, StageLoss, Words
from langflash_core.network.model import LangFlashNet


@dataclass(frozen=True)
class Mixed:
    """photos, and rooms (None: not in this step), of one step; share: what the photos' loss counts for."""

    photos: SceneBatch
    rooms: SceneBatch | None
    share: float

    @property
    def seeds(self) -> tuple[int, ...]:
        return self.photos.seeds + (self.rooms.seeds if self.rooms is not None else ())

    def to(self, device: str | torch.device) -> "Mixed":
        rooms = None if self.rooms is None else self.rooms.to(device)
        return Mixed(self.photos.to(device), rooms, self.share)


@dataclass(frozen=True)
class MixedSet:
    """Draws `share` of the pictures of a step from photos, the rest from rooms."""

    rooms: RoomSet
    photos: RoomSet | OutlinedSet
    share: float

    def __post_init__(self) -> None:
        if not 0 < self.share <= 1:
            raise ValueError(f"share: expected more than 0 and at most 1, received {self.share}")

    def __len__(self) -> int:
        return len(self.rooms) + len(self.photos)

    def part(self, number: int, count: int) -> "MixedSet":
        """That of one of so many batches of a step, of both."""
        return MixedSet(self.rooms.part(number, count), self.photos.part(number, count), self.share)

    def draw(self, count: int, views: int, generator: torch.Generator) -> Mixed:
        """About `count` times `views` pictures; at least one photo, and one room unless the share is 1."""
        pictures = count * views
        photos = self.photos.draw(max(1, round(self.share * pictures)), 1, generator)
        if self.share == 1:
            return Mixed(photos, None, 1.0)
        rooms = self.rooms.draw(max(1, round((1 - self.share) * count)), views, generator)
        return Mixed(photos, rooms, self.share)


def each_of(batch: SceneBatch | Mixed, change: Callable[[SceneBatch], SceneBatch]) -> SceneBatch | Mixed:
    """The batch, or both of a mixed one, changed alike."""
    if not isinstance(batch, Mixed):
        return change(batch)
    rooms = None if batch.rooms is None else change(batch.rooms)
    return Mixed(change(batch.photos), rooms, batch.share)


@dataclass(frozen=True)
class ToldSet(ABC):
    """A set whose batches bring what `told` adds to them. inner: draws them."""

    inner: Any

    def part(self, number: int, count: int) -> "ToldSet":
        """That of one of so many batches of a step."""
        return replace(self, inner=self.inner.part(number, count))

    def draw(self, count: int, views: int, generator: torch.Generator) -> SceneBatch | Mixed:
        """As the inner set draws, with what is known of the views besides.

        Raises:
            OutputError: what is kept on disk cannot be written.
        """
        return each_of(self.inner.draw(count, views, generator), self.told)

    @abstractmethod
    def told(self, batch: SceneBatch) -> SceneBatch:
        """The batch with what this set knows of its views."""


def loss_of(loss: StageLoss, network: LangFlashNet, batch: Any, words: Words) -> Loss:
    """A stage's loss on a batch of either kind; of a mixed one the parts are told apart by name."""
    if not isinstance(batch, Mixed):
        return loss(network, batch, words)
    photos = loss(network, batch.photos, words)
    told = {f"photos_{name}": value for name, value in photos.parts.items()}
    if batch.rooms is None:
        return Loss(photos.total, told)
    rooms = loss(network, batch.rooms, words)
    return Loss(batch.share * photos.total + (1 - batch.share) * rooms.total, {**rooms.parts, **told})
