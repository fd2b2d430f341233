"""What asking adds to the state: phrases, the scores behind an answer, the dictionary."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from langflash_core.geometry.poses import Vector
from langflash_core.language.settings import ANSWERING
from langflash_core.scene.mask import Mask

# Told apart by people with the common colour-vision deficiencies, on dark ground.
PALETTE = (
    (0.96, 0.62, 0.16),
    (0.35, 0.71, 0.98),
    (0.30, 0.80, 0.55),
    (0.94, 0.45, 0.62),
    (0.95, 0.88, 0.35),
    (0.66, 0.55, 0.95),
    (0.88, 0.36, 0.24),
    (0.70, 0.85, 0.82),
)

MOST_RECENT = 20
LEAST_SPAN = 0.01  # of relevance, between the first and the last colour
PROMPTS_SUFFIX = ".prompts.json"
BINS = 50  # of a histogram of scores, over [0, 1]
_OPERATOR = re.compile(r"\s+[+-]\s+")  # as langflash_core/language/algebra.py, which loads torch


@dataclass(frozen=True)
class Prompt:
    """One phrase. `key` never changes; `score` is None until the view on show is answered.

    threshold: the person's own, or None for the calibrated one. calibrated: what None means.
    like: a language vector as float32 bytes that is asked instead of the words. place: where in the scene it
    fits best; photo: which shows most of it, from 0. note: what a person should know of its words, or "".
    reading: how they are understood, or "" where they are asked as they stand.
    """

    key: int
    text: str = ""
    colour: tuple[float, float, float] = PALETTE[0]
    threshold: float | None = None
    calibrated: float = 0.5
    visible: bool = True
    score: float | None = None
    like: bytes = field(default=b"", repr=False)
    place: Vector | None = None
    photo: int | None = None
    note: str = ""
    reading: str = ""

    @property
    def otherwise(self) -> bool:
        """Whether what it names is here, and none of it is as it says: a wall that is not red."""
        return bool(self.reading) and self.score == 0

    @property
    def found(self) -> bool | None:
        """Whether the view on show holds it; None until it is answered."""
        return None if self.score is None else self.score >= self.cut

    @property
    def maybe(self) -> bool:
        """Whether the view shows something that nearly passes."""
        return self.score is not None and self.lowest <= self.score < self.cut

    @property
    def cut(self) -> float:
        """The threshold in force."""
        return self.calibrated if self.threshold is None else self.threshold

    @property
    def lowest(self) -> float:
        """The score from which a phrase may be there, below the threshold."""
        return ANSWERING.maybe_from(self.cut)

    @property
    def shown_from(self) -> float:
        """Relevance from which its heat-map shows something: of a near miss, what comes nearest."""
        return self.lowest if self.maybe else self.lit_from

    @property
    def lit_from(self) -> float:
        """Relevance from which a pixel belongs to it: the person's own threshold, else by its score."""
        if self.threshold is not None or self.score is None:
            return self.cut
        return ANSWERING.lit_from(self.score, self.cut)


def free_colour(prompts: Sequence[Prompt]) -> tuple[float, float, float]:
    """One that none of these has, while there is one."""
    used = {prompt.colour for prompt in prompts}
    return next((colour for colour in PALETTE if colour not in used), PALETTE[len(prompts) % len(PALETTE)])


FIRST_PROMPT = Prompt(key=0)


@dataclass(frozen=True)
class Insight:
    """What the worker says about the K atoms of the scene on show.

    shares: of the opacity that is left, sum 1. colours: as in the atoms picture. order: alike atoms side
    by side. similarity: (K, K) cosines. places: of each in the scene, world.
    """

    shares: tuple[float, ...]
    colours: tuple[tuple[float, float, float], ...]
    order: tuple[int, ...]
    similarity: np.ndarray = field(compare=False, repr=False)
    places: tuple[Vector | None, ...] = ()


@dataclass(frozen=True)
class Part:
    """A connected part of an answer that looks like one kind of thing.

    kind: of the vocabulary, "" where it is like none. sure: mean relevancy of its surface to the phrase.
    share: of the photo that shows most of it. place: in the middle of it, in the scene. rows: its Gaussians.
    """

    kind: str
    sure: float
    share: float
    place: Vector
    rows: Mask = field(repr=False)


@dataclass(frozen=True)
class Parts:
    """The parts of the answer to a phrase above a threshold, the largest first."""

    text: str
    cut: float
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Histogram:
    """How many covered pixels of the view on show score how high. counts: (BINS,) over [0, 1]."""

    key: int
    text: str
    counts: tuple[int, ...] = field(repr=False)


@dataclass(frozen=True)
class Asking:
    """The asking half of the state.

    active: key of the prompt in hand. negatives: the person's own; none: those of the scene. recent: phrases
    asked, the newest first. atom: whose weight map is on show. chosen: atoms to merge. prompts_path: where
    the last set was. usual: what the scene compares phrases with, by its own calibration, once it has said
    so. revision: of what scores rest on. caret: the prompt whose field takes the keys next.
    span: relevance of the first and the last colour of a heat-map, the person's own; None: by the threshold.
    named: names of things stand in the picture. parts: of the answer to the active phrase.
    """

    prompts: tuple[Prompt, ...] = (FIRST_PROMPT,)
    active: int = 0
    negatives: tuple[str, ...] = ()
    recent: tuple[str, ...] = ()
    histograms: tuple[Histogram, ...] = ()
    insight: Insight | None = None
    atom: int = 0
    chosen: tuple[int, ...] = ()
    prompts_path: Path | None = None
    usual: tuple[str, ...] = ()
    revision: int = 0
    caret: int | None = None
    span: tuple[float, float] | None = None
    named: bool = False
    parts: Parts | None = None

    @property
    def asked(self) -> tuple[Prompt, ...]:
        """Prompts to answer: visible ones that say something whole."""
        return tuple(p for p in self.prompts if p.visible and usable(p.text))

    @property
    def active_prompt(self) -> Prompt | None:
        """The prompt whose heat-map is on show: the active one, or else the first that is asked."""
        asked = self.asked
        return next((p for p in asked if p.key == self.active), asked[0] if asked else None)

    def histogram(self, key: int, text: str) -> Histogram | None:
        """Of a prompt as it reads now; None until it is answered."""
        return next((h for h in self.histograms if h.key == key and h.text == text.strip()), None)

    def without_scene(self) -> "Asking":
        """For another scene: what belongs to the old one goes."""
        prompts = tuple(replace(prompt, score=None, photo=None) for prompt in self.prompts)
        return replace(
            self,
            prompts=prompts,
            histograms=(),
            insight=None,
            atom=0,
            chosen=(),
            usual=(),
            named=False,
            parts=None,
        )


NO_ASKING = Asking()


def unfinished(text: str) -> bool:
    """Whether a phrase is still missing beside a + or -, as while one is being typed."""
    parts = _OPERATOR.split(f" {text} ")
    return len(parts) > 1 and not all(part.strip() for part in parts)


def plain(text: str) -> bool:
    """Whether a prompt is one phrase, with nothing added or taken away."""
    return usable(text) and len(_OPERATOR.split(f" {text} ")) == 1


def usable(text: str) -> bool:
    """Whether a prompt can be asked as it reads."""
    return bool(text.strip()) and not unfinished(text)
