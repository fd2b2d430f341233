"""What can happen while asking: phrases, their answers, the dictionary."""

from dataclasses import dataclass, field, replace
from itertools import repeat, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from langflash_core.base import pictures
from langflash_core.geometry.poses import Vector

from ..state import State
from .prompt_sets import MOST_PROMPTS, PromptSet
from .state import LEAST_SPAN, MOST_RECENT, PALETTE, Histogram, Insight, Prompt

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery


def revise(state: State) -> State:
    """The state without scores: the Gaussians, the atoms or the negatives that they rest on are others."""
    prompts = tuple(replace(p, score=None) for p in state.asking.prompts)
    return state.with_asking(prompts=prompts).with_asking(histograms=(), revision=state.asking.revision + 1)


# Phrases


@dataclass(frozen=True)
class AddPrompt:
    """A new, empty row in a colour of its own, where the next letters go."""

    def apply(self, state: State) -> State:
        used = {p.colour for p in state.asking.prompts}
        free = [c for c in PALETTE if c not in used] or [PALETTE[len(state.asking.prompts) % len(PALETTE)]]
        prompt = Prompt(state.next_key, colour=free[0])
        prompts = (*state.asking.prompts, prompt)
        state = replace(state.with_asking(prompts=prompts, active=prompt.key), next_key=state.next_key + 1)
        return state.with_asking(caret=prompt.key)


@dataclass(frozen=True)
class NextPrompt:
    """The phrase of `key` is typed: on to an empty row, or to a new one while there is room."""

    key: int

    def apply(self, state: State) -> State:
        empty = next((p for p in state.asking.prompts if not p.text.strip() and p.key != self.key), None)
        if empty is not None:
            return state.with_asking(active=empty.key).with_asking(caret=empty.key)
        return state if len(state.asking.prompts) >= MOST_PROMPTS else AddPrompt().apply(state)


@dataclass(frozen=True)
class FocusPhrase:
    """The next letters go to the active phrase."""

    def apply(self, state: State) -> State:
        chosen = next(
            (p for p in state.asking.prompts if p.key == state.asking.active), state.asking.prompts[0]
        )
        return state.with_asking(caret=chosen.key)


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
        return _with_prompts(state.with_asking(active=active), prompts)


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
        mode = pictures.HEAT if first and state.scene.mode is pictures.RGB else after.scene.mode
        return after.with_scene(mode=mode).with_asking(active=self.key).with_asking(named=False)


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
        empty = next((p for p in state.asking.prompts if not p.text.strip()), None)
        if empty is None and len(state.asking.prompts) >= MOST_PROMPTS:
            return state
        prompts, key = state.asking.prompts, state.next_key
        if empty is None:
            used = {p.colour for p in prompts}
            colour = next((c for c in PALETTE if c not in used), PALETTE[len(prompts) % len(PALETTE)])
            calibrated = prompts[0].calibrated
            prompts = (*prompts, Prompt(key, self.text, colour, calibrated=calibrated))
        else:
            key = empty.key
            asked = replace(empty, text=self.text, score=None, visible=True)
            prompts = tuple(asked if p.key == key else p for p in prompts)
        mode = (
            pictures.HEAT if state.scene.mode is pictures.RGB and not state.asking.asked else state.scene.mode
        )
        after = replace(
            state.with_asking(prompts=prompts, active=key).with_scene(mode=mode), next_key=state.next_key + 1
        )
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
        state = replace(
            state.with_asking(
                prompts=prompts, active=first, negatives=self.chosen.negatives or state.asking.negatives
            ).with_scene(mode=mode),
            next_key=first + len(prompts),
        )
        return state.with_asking(prompts_path=self.path)


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
        if self.revision != state.asking.revision:
            return state
        current = {p.key: p.text.strip() for p in state.asking.prompts}
        for (key, text, score), place in zip_longest(self.scores, self.places):
            if current.get(key) == text:
                state = _change_prompt(state, key, score=score, place=place)
        return state


@dataclass(frozen=True)
class Narrowed:
    """Relevance (P, H, W) of the view so named, of what the phrases mean alone. notes: (key, text, note)
    of the phrases that choose. revision: as of `Answered`."""

    name: tuple = field(repr=False)
    relevance: "Tensor" = field(compare=False, repr=False)
    notes: tuple[tuple[int, str, str], ...] = ()
    revision: int = 0

    def apply(self, state: State) -> State:
        if self.revision != state.asking.revision:
            return state
        current = {p.key: p.text.strip() for p in state.asking.prompts}
        for key, text, note in self.notes:
            if current.get(key) == text:
                state = _change_prompt(state, key, note=note)
        return state


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
        return _with_prompts(
            state, tuple(replace(p, calibrated=self.threshold) for p in state.asking.prompts)
        )


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
        if self.revision != state.asking.revision:
            return state
        current = {p.key: p.text.strip() for p in state.asking.prompts}
        for key, text, photo in zip(self.keys, self.texts, self.photos, strict=True):
            if current.get(key) == text:
                state = _change_prompt(state, key, photo=photo)
        return state


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
        wanted = replace(state.preferences, dictionary_open=self.opened)
        return replace(state, preferences=wanted)


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


def _with_prompts(state: State, prompts: tuple[Prompt, ...]) -> State:
    return state.with_asking(prompts=prompts)


def _change_prompt(state: State, key: int, **changes) -> State:
    return _with_prompts(
        state, tuple(replace(p, **changes) if p.key == key else p for p in state.asking.prompts)
    )
