"""What can happen while asking: phrases, their answers, the dictionary."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import repeat, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from langflash_core.base import pictures
from langflash_core.geometry.poses import Vector

from ..state import State
from .prompt_sets import MOST_PROMPTS, PromptSet
from .state import LEAST_SPAN, MOST_RECENT, Histogram, Insight, Prompt, free_colour

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery


def revise(state: State) -> State:
    """The state without scores: the Gaussians, the atoms or the negatives that they rest on are others."""
    prompts = tuple(replace(p, score=None) for p in state.asking.prompts)
    return state.with_asking(prompts=prompts, histograms=(), revision=state.asking.revision + 1)


# Phrases


@dataclass(frozen=True)
class AddPrompt:
    """A new, empty row in a colour of its own, where the next letters go."""

    def apply(self, state: State) -> State:
        prompt = Prompt(state.next_key, colour=free_colour(state.asking.prompts))
        return with_prompt(state, state.asking.prompts, prompt).with_asking(caret=prompt.key)


@dataclass(frozen=True)
class NextPrompt:
    """The phrase of `key` is typed: on to an empty row, or to a new one while there is room."""

    key: int

    def apply(self, state: State) -> State:
        empty = next((p for p in state.asking.prompts if not p.text.strip() and p.key != self.key), None)
        if empty is not None:
            return state.with_asking(active=empty.key, caret=empty.key)
        return state if len(state.asking.prompts) >= MOST_PROMPTS else AddPrompt().apply(state)


@dataclass(frozen=True)
class FocusPhrase:
    """The next letters go to the active phrase."""

    def apply(self, state: State) -> State:
        prompts, active = state.asking.prompts, state.asking.active
        there = any(p.key == active for p in prompts)
        return state.with_asking(caret=active if there else prompts[0].key)


@dataclass(frozen=True)
class CaretTaken:
    """The field has the keys."""

    def apply(self, state: State) -> State:
        return state.with_asking(caret=None)


@dataclass(frozen=True)
class RemovePrompt:
    """The last row is emptied, never removed."""

    key: int

    def apply(self, state: State) -> State:
        prompts = tuple(p for p in state.asking.prompts if p.key != self.key)
        if not prompts:
            prompts = (Prompt(state.next_key),)
            state = replace(state, next_key=state.next_key + 1)
        active = state.asking.active if any(p.key == state.asking.active for p in prompts) else prompts[0].key
        return state.with_asking(active=active, prompts=prompts)


@dataclass(frozen=True)
class EditPrompt:
    """New text; the old answer no longer holds. The first phrase turns the heat-map on."""

    key: int
    text: str

    def apply(self, state: State) -> State:
        after = _change_prompt(
            state, self.key, text=self.text, score=None, like=b"", place=None, photo=None, note="", reading=""
        )
        first = not state.asking.asked and bool(after.asking.asked)
        return (with_heat(after) if first else after).with_asking(active=self.key, named=False)


@dataclass(frozen=True)
class ColourPrompt:
    """Another colour, sRGB in [0, 1]."""

    key: int
    colour: tuple[float, float, float]

    def apply(self, state: State) -> State:
        return _change_prompt(state, self.key, colour=self.colour)


@dataclass(frozen=True)
class SetThreshold:
    """None goes back to the calibrated threshold."""

    key: int
    threshold: float | None

    def apply(self, state: State) -> State:
        return _change_prompt(state, self.key, threshold=self.threshold)


@dataclass(frozen=True)
class SetSpan:
    """Relevance of the first and the last colour of heat-maps; None: by the threshold."""

    span: tuple[float, float] | None

    def apply(self, state: State) -> State:
        if self.span is None:
            return state.with_asking(span=None)
        low, high = sorted(min(max(end, 0.0), 1.0) for end in self.span)
        return state.with_asking(span=(min(low, 1 - LEAST_SPAN), max(high, low + LEAST_SPAN)))


@dataclass(frozen=True)
class ShowPrompt:
    """Ask a phrase, or leave it out."""

    key: int
    visible: bool

    def apply(self, state: State) -> State:
        return _change_prompt(state, self.key, visible=self.visible)


@dataclass(frozen=True)
class SelectPrompt:
    """The prompt whose heat-map is on show."""

    key: int

    def apply(self, state: State) -> State:
        return state.with_asking(active=self.key)


@dataclass(frozen=True)
class SetNegatives:
    """What relevancy is measured against; nothing: what the scene's calibration says."""

    negatives: tuple[str, ...]

    def apply(self, state: State) -> State:
        return revise(state.with_asking(negatives=self.negatives))


@dataclass(frozen=True)
class Remember:
    """A phrase was asked: the first of the recent ones."""

    text: str

    def apply(self, state: State) -> State:
        text = " ".join(self.text.split())
        if not text:
            return state
        others = (t for t in state.asking.recent if t != text)
        return state.with_asking(recent=(text, *others)[:MOST_RECENT])


@dataclass(frozen=True)
class AskAgain:
    """A recent phrase, in the first empty row or in a new one."""

    text: str

    def apply(self, state: State) -> State:
        prompts = state.asking.prompts
        empty = next((p for p in prompts if not p.text.strip()), None)
        if empty is None and len(prompts) >= MOST_PROMPTS:
            return state
        after = state if state.asking.asked else with_heat(state)
        if empty is None:
            calibrated = prompts[0].calibrated
            prompt = Prompt(state.next_key, self.text, free_colour(prompts), calibrated=calibrated)
            after = with_prompt(after, prompts, prompt)
        else:
            after = _change_prompt(after, empty.key, text=self.text, score=None, visible=True)
            after = after.with_asking(active=empty.key)
        return Remember(self.text).apply(after.with_asking(named=False))


@dataclass(frozen=True)
class SavePrompts:
    """Write the prompts to `path` (the worker does)."""

    path: Path

    def apply(self, state: State) -> State:
        return replace(state.with_asking(prompts_path=self.path), dialog=None)


@dataclass(frozen=True)
class LoadPrompts:
    """Read prompts from `path` (the worker does)."""

    path: Path

    def apply(self, state: State) -> State:
        return replace(state, dialog=None)


@dataclass(frozen=True)
class PromptsRead:
    """A prompt set takes the place of the present prompts."""

    path: Path
    chosen: PromptSet

    def apply(self, state: State) -> State:
        first, calibrated = state.next_key, state.asking.prompts[0].calibrated
        prompts = tuple(
            replace(p, key=first + place, calibrated=calibrated)
            for place, p in enumerate(self.chosen.prompts)
        )
        mode = pictures.LABELS if state.scene.mode is pictures.RGB else state.scene.mode
        negatives = self.chosen.negatives or state.asking.negatives
        state = state.with_asking(prompts=prompts, active=first, negatives=negatives, prompts_path=self.path)
        return replace(state.with_scene(mode=mode), next_key=first + len(prompts))


# Answers


@dataclass(frozen=True)
class Answered:
    """Scores in the view on show: (key, text, score); a prompt edited meanwhile keeps none.

    revision: as `Asking.revision` was; scores of an earlier one are dropped. places: where each fits best.
    """

    scores: tuple[tuple[int, str, float], ...]
    revision: int = 0
    places: tuple[Vector | None, ...] = ()

    def apply(self, state: State) -> State:
        told = zip_longest(self.scores, self.places)
        return _told(
            state, self.revision, (((k, text), {"score": s, "place": at}) for (k, text, s), at in told)
        )


@dataclass(frozen=True)
class Narrowed:
    """Relevance (P, H, W) of the view so named, of what the phrases mean alone. notes: (key, text, note)
    of the phrases that choose. revision: as of `Answered`."""

    name: tuple = field(repr=False)
    relevance: "Tensor" = field(compare=False, repr=False)
    notes: tuple[tuple[int, str, str], ...] = ()
    revision: int = 0

    def apply(self, state: State) -> State:
        return _told(state, self.revision, (((key, text), {"note": note}) for key, text, note in self.notes))


@dataclass(frozen=True)
class AskWhole:
    """A phrase is asked as it stands: within quotes."""

    key: int

    def apply(self, state: State) -> State:
        text = next((p.text for p in state.asking.prompts if p.key == self.key), "")
        plain = text.replace('"', "").strip()
        return EditPrompt(self.key, f'"{plain}"').apply(state) if plain else state


@dataclass(frozen=True)
class Calibrated:
    """The threshold that the scene and its language space were calibrated to."""

    threshold: float

    def apply(self, state: State) -> State:
        prompts = tuple(replace(p, calibrated=self.threshold) for p in state.asking.prompts)
        return state.with_asking(prompts=prompts)


@dataclass(frozen=True)
class PhrasesCompiled:
    """The phrases `keys`, in the order of `query`, are ready to be asked. revision: as `Asking.revision` was.
    notes: on each, or "" (`langflash_core/language/hints.py`). readings: of each, "" where it is asked as it
    stands (`langflash_core/language/grammar.py`).
    """

    keys: tuple[int, ...]
    query: "CompiledQuery" = field(compare=False, repr=False)
    revision: int = 0
    notes: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()

    def apply(self, state: State) -> State:
        state = Calibrated(self.query.threshold).apply(state)
        told = zip(self.keys, self.notes or repeat(""), self.readings or repeat(""), strict=False)
        for key, note, reading in told:
            state = _change_prompt(state, key, note=note, reading=reading)
        return state if state.asking.negatives else state.with_asking(usual=self.query.negative_texts)


@dataclass(frozen=True)
class PhrasesPlaced:
    """Which photo shows most of the phrases `keys`, as they read then. revision: as for `Answered`."""

    keys: tuple[int, ...]
    texts: tuple[str, ...]
    photos: tuple[int | None, ...]
    revision: int = 0

    def apply(self, state: State) -> State:
        phrases = zip(self.keys, self.texts, strict=True)
        told = ((phrase, {"photo": k}) for phrase, k in zip(phrases, self.photos, strict=True))
        return _told(state, self.revision, told)


@dataclass(frozen=True)
class Binned:
    """How the pixels of the view on show score. revision: as for `Answered`."""

    histograms: tuple[Histogram, ...]
    revision: int = 0

    def apply(self, state: State) -> State:
        if self.revision != state.asking.revision:
            return state
        return state.with_asking(histograms=self.histograms)


@dataclass(frozen=True)
class NameThings:
    """Names of the things that the scene knows stand in the picture, or no longer."""

    named: bool

    def apply(self, state: State) -> State:
        return state.with_asking(named=self.named and state.scene.info is not None)


# The dictionary


@dataclass(frozen=True)
class OpenDictionary:
    """Show the atoms, or no longer; the next session begins so too."""

    opened: bool

    def apply(self, state: State) -> State:
        return replace(state, preferences=replace(state.preferences, dictionary_open=self.opened))


@dataclass(frozen=True)
class AtomsDescribed:
    """The worker has looked the atoms over."""

    insight: Insight

    def apply(self, state: State) -> State:
        return state.with_asking(insight=self.insight)


@dataclass(frozen=True)
class AtomsWeighed:
    """Shares (K,) of what is left of the scene, and where each atom is, world."""

    shares: tuple[float, ...]
    places: tuple[Vector | None, ...] = ()

    def apply(self, state: State) -> State:
        insight = state.asking.insight
        if insight is None:
            return state
        places = self.places or insight.places
        return state.with_asking(insight=replace(insight, shares=self.shares, places=places))


@dataclass(frozen=True)
class ShowAtom:
    """Show one atom's weight map."""

    atom: int

    def apply(self, state: State) -> State:
        if state.scene.info is None or not 0 <= self.atom < state.scene.info.num_atoms:
            return state
        return state.with_asking(atom=self.atom).with_scene(mode=pictures.WEIGHT)


@dataclass(frozen=True)
class ChooseAtom:
    """Mark an atom for merging, or no longer; the first marked keeps its name."""

    atom: int
    chosen: bool

    def apply(self, state: State) -> State:
        others = tuple(k for k in state.asking.chosen if k != self.atom)
        return state.with_asking(chosen=(*others, self.atom) if self.chosen else others)


@dataclass(frozen=True)
class ChooseNone:
    """No atom is marked for merging."""

    def apply(self, state: State) -> State:
        return state.with_asking(chosen=())


def with_prompt(state: State, others: tuple[Prompt, ...], prompt: Prompt) -> State:
    """With a new prompt, which is the active one, after others."""
    state = state.with_asking(prompts=(*others, prompt), active=prompt.key)
    return replace(state, next_key=prompt.key + 1)


def with_heat(state: State) -> State:
    """With the heat-map on, where colours are."""
    return state.with_scene(mode=pictures.HEAT) if state.scene.mode is pictures.RGB else state


def _told(state: State, revision: int, told: Iterable[tuple[tuple[int, str], dict[str, Any]]]) -> State:
    """What was found of prompts, by key and text; nothing of another revision, or of one edited meanwhile."""
    if revision != state.asking.revision:
        return state
    current = {(p.key, p.text.strip()) for p in state.asking.prompts}
    for phrase, changes in told:
        if phrase in current:
            state = _change_prompt(state, phrase[0], **changes)
    return state


def _change_prompt(state: State, key: int, **changes) -> State:
    prompts = (replace(p, **changes) if p.key == key else p for p in state.asking.prompts)
    return state.with_asking(prompts=tuple(prompts))
