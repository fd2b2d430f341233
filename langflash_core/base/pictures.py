"""Every way to look at a scene, one record each: what all who offer, check, paint or explain it go by.

The window shows all of them; `langflash render` those with a `word`, painted on the processor by `painter`
(`module:function` below `langflash_core`, called with a `writing.drawn.Look`). The window's painters are
shaders and stand under the same names in `app/gl/paints.py`. Read without torch.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

Need = Literal["", "phrases", "atoms", "photos", "owners"]
Colour = tuple[float, float, float]

COUNT_COLOURS = ((0.86, 0.20, 0.55), (0.95, 0.70, 0.20), (0.25, 0.62, 0.55))
"""Coverage: no photo saw it, one, several."""
MISSING = {
    "atoms": "This scene has no groups",
    "photos": "This scene has no photos",
    "owners": "This scene does not say which photo made what, or has one photo only",
}
"""Why a scene cannot show a picture, by what it needs."""


class Facts(ABC):
    """What legends are made of, asked one by one, so that nothing is worked out that nobody tells."""

    @property
    @abstractmethod
    def phrases(self) -> Sequence[tuple[str, Colour, bool]]:
        """Text, colour, and whether it is there, of the phrases asked."""

    @property
    @abstractmethod
    def heat(self) -> tuple[str, float, float]:
        """The active phrase, and relevance of the first and the last colour."""

    @property
    @abstractmethod
    def depth_range(self) -> tuple[float, float]:
        """Depths of the first and the last colour, scene units."""

    @property
    @abstractmethod
    def atom(self) -> str:
        """The group whose weights are on show."""

    @property
    @abstractmethod
    def largest_atoms(self) -> Sequence[tuple[str, Colour]]:
        """Name and colour of the groups that cover most; none while that is not known."""

    @property
    @abstractmethod
    def worst(self) -> float:
        """Share of depth by which photos disagree at the last colour."""

    @property
    @abstractmethod
    def warnings(self) -> Sequence[str]:
        """What is doubtful about the scene."""


@dataclass(frozen=True)
class Legend:
    """What colours mean: a bar with a title and numbers evenly below it, patches with their names (text,
    colour, muted), and sentences."""

    title: str = ""
    numbers: tuple[str, ...] = ()
    patches: tuple[tuple[str, Colour, bool], ...] = ()
    sentences: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Picture:
    """One way to look. name: of the record, in files of sessions too, and of its painters. label, tip: on
    its button and under it. group: its heading in the menu. legend: made of facts; None: there is none.

    needs: "phrases" to show relevance; "atoms", "photos" or the "owners" of Gaussians, without which a scene
    cannot show it. maps: it shows weight maps whatever is asked. columns: of those, what they are mixed by.
    fills: it shows the scene's colours, whose gaps may be filled. usual: it has a button. word: for `render
    --what`; it ends in `:K` where it is of one atom. one: of one phrase. painter: what `render` paints by.
    """

    name: str
    label: str
    tip: str
    group: str
    legend: Callable[[Facts], Legend] | None
    needs: Need = ""
    maps: bool = False
    columns: Literal["", "atoms", "features"] = ""
    fills: bool = False
    usual: bool = False
    word: str = ""
    one: bool = False
    painter: str = ""

    @property
    def answers(self) -> bool:
        """Whether it shows relevance."""
        return self.needs == "phrases"

    @property
    def of_an_atom(self) -> bool:
        """Whether the word names one atom."""
        return self.word.endswith(":K")


def margin_span(num_prompts: int) -> tuple[float, float]:
    """Margins shown as the first and the last colour: of one prompt it may be negative."""
    return (-0.5, 0.5) if num_prompts == 1 else (0.0, 0.5)


def _evenly(low: float, high: float) -> tuple[str, ...]:
    return tuple(f"{value:.2f}" for value in (low, (low + high) / 2, high))


def _heat(facts: Facts) -> Legend:
    text, low, high = facts.heat
    return Legend(text, _evenly(low, high))


def _margin(facts: Facts) -> Legend:
    phrases = facts.phrases
    alone = f"{phrases[0][0]}, over its threshold"
    title = alone if len(phrases) == 1 else "Best phrase over the second best"
    return Legend(title, _evenly(*margin_span(len(phrases))))


def _phrases(facts: Facts) -> Legend:
    told = (
        (f"{text.strip()}{'' if found else '  (not found)'}", colour, not found)
        for text, colour, found in facts.phrases
    )
    return Legend(patches=tuple(told))


def _depth(facts: Facts) -> Legend:
    near, far = facts.depth_range
    middle = 2 / (1 / max(near, 1e-9) + 1 / max(far, 1e-9))
    return Legend("Depth, scene units", (f"{far:.2f}", f"{middle:.2f}", f"{near:.2f}"))


def _atoms(facts: Facts) -> Legend:
    if not facts.largest_atoms:
        return Legend(sentences=("Every group of the dictionary in its own colour.",))
    return Legend(patches=tuple((name, colour, False) for name, colour in facts.largest_atoms))


def _coverage(facts: Facts) -> Legend:
    names = ("seen by no photo", "by one photo", "by two or more")
    patches = tuple((name, colour, False) for name, colour in zip(names, COUNT_COLOURS, strict=True))
    return Legend(patches=patches, sentences=tuple(facts.warnings))


def _agreement(facts: Facts) -> Legend:
    numbers = ("0 %", f"{50 * facts.worst:.0f} %", f"{100 * facts.worst:.0f} %")
    grey = (("fewer than two can tell", (0.3, 0.3, 0.3), True),)
    return Legend("Photos disagree on depth by", numbers, grey, tuple(facts.warnings))


RGB = Picture(
    "rgb", "RGB", "Colour", "Picture", None, fills=True, usual=True,
    word="rgb", painter="writing.drawn:rgb",
)  # fmt: skip
HEAT = Picture(
    "heat", "Heat-map", "Where the active phrase fits, over the colours", "Answers", _heat,
    needs="phrases", fills=True, usual=True, word="relevance", one=True, painter="writing.drawn:relevance",
)  # fmt: skip
LABELS = Picture(
    "labels", "Labels", "Every phrase in its own colour", "Answers", _phrases,
    needs="phrases", fills=True, usual=True, word="labels", painter="writing.drawn:labels",
)  # fmt: skip
ATOMS = Picture(
    "atoms", "Groups", "The groups the scene is made of", "Dictionary", _atoms,
    maps=True, columns="atoms", usual=True, word="atoms", painter="writing.drawn:atoms",
)  # fmt: skip
DEPTH = Picture(
    "depth", "Depth", "Distance, near to far", "Picture", _depth,
    usual=True, word="depth", painter="writing.drawn:depth",
)  # fmt: skip
MASKS = Picture(
    "masks", "Masks", "What passes its threshold, as flat colours", "Answers", _phrases,
    needs="phrases", fills=True,
)  # fmt: skip
ISOLATE = Picture(
    "isolate", "Only these", "Only what passes", "Answers", _phrases, needs="phrases", fills=True
)
HIDE = Picture(
    "hide", "Without these", "Everything but what passes", "Answers", _phrases, needs="phrases", fills=True
)
DIM = Picture(
    "dim", "Dim the rest", "What passes in full colour, the rest dimmed", "Answers", _phrases,
    needs="phrases", fills=True,
)  # fmt: skip
FEATURES = Picture(
    "features", "Features", "Principal axes of the language features", "Dictionary",
    lambda _: Legend(sentences=("The three main axes of the language features, as red, green and blue.",)),
    needs="atoms", maps=True, columns="features",
)  # fmt: skip
WEIGHT = Picture(
    "weight", "One group", "How much of one group each pixel carries", "Dictionary",
    lambda facts: Legend(f"Weight of {facts.atom}", ("0", "0.5", "1")),
    needs="atoms", maps=True, word="weights:K", painter="writing.drawn:weight",
)  # fmt: skip
TRANSMITTANCE = Picture(
    "transmittance", "Transmittance", "The light that passes every splat", "Picture",
    lambda _: Legend("Light that passes every splat", ("0", "0.5", "1")),
)  # fmt: skip
COVERAGE = Picture(
    "coverage", "Coverage", "How many photos saw what is shown", "Trust", _coverage, needs="photos"
)
AGREEMENT = Picture(
    "agreement", "Agreement", "How well the photos agree on depth, where more than one covers a surface",
    "Trust", _agreement, needs="owners",
)  # fmt: skip
MARGIN = Picture("margin", "Margin", "How clear the answer is", "Trust", _margin, needs="phrases")

PICTURES = (
    RGB, HEAT, LABELS, ATOMS, DEPTH, MASKS, ISOLATE, HIDE, DIM, FEATURES, WEIGHT, TRANSMITTANCE, COVERAGE,
    AGREEMENT, MARGIN,
)  # fmt: skip
KEYED = PICTURES[:10]
"""On the keys 1 to 9 and 0."""
GROUPS = ("Picture", "Answers", "Dictionary", "Trust")
"""Headings of the menu."""
NAMED = {picture.name: picture for picture in PICTURES}
SPOKEN = {picture.word.removesuffix(":K"): picture for picture in PICTURES if picture.word}
"""By the words of `render --what`."""
WORDS = tuple(picture.word for picture in PICTURES if picture.word)


def in_group(group: str) -> tuple[Picture, ...]:
    """The pictures under one heading of the menu, the usual ones first."""
    return tuple(sorted((p for p in PICTURES if p.group == group), key=lambda p: not p.usual))
