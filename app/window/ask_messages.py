"""What the asking half asks of the worker, and what it hears back."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.window.asking import Histogram, Insight
from app.window.prompt_sets import PromptSet

if TYPE_CHECKING:
    from langflash_core.types import Scene


@dataclass(frozen=True)
class WritePrompts:
    """Write a prompt set."""

    chosen: PromptSet
    path: Path


@dataclass(frozen=True)
class ReadPrompts:
    """Read a prompt set."""

    path: Path


@dataclass(frozen=True)
class DescribeAtoms:
    """Look the atoms over."""

    serial: int
    scene: "Scene" = field(repr=False)


Request = WritePrompts | ReadPrompts | DescribeAtoms


@dataclass(frozen=True)
class PromptsWritten:
    """A prompt set is complete."""

    path: Path


@dataclass(frozen=True)
class PromptsLoaded:
    """A prompt set was read."""

    path: Path
    chosen: PromptSet


@dataclass(frozen=True)
class Histograms:
    """Scores of the view's pixels."""

    serial: int
    histograms: tuple[Histogram, ...]


@dataclass(frozen=True)
class Described:
    """The atoms, with a small picture (h, w, 3) uint8 of each that some photo shows."""

    serial: int
    insight: Insight
    thumbnails: tuple[np.ndarray | None, ...] = field(repr=False)


Result = PromptsWritten | PromptsLoaded | Histograms | Described
