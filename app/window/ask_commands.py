"""What can happen while asking, beside what `commands` has for every prompt."""

from dataclasses import dataclass, replace
from pathlib import Path

from app.window.asking import MOST_RECENT, Histogram, Insight
from app.window.prompt_sets import MOST_PROMPTS, PromptSet
from app.window.state import PALETTE, Mode, Prompt, State


def change(state: State, **changes) -> State:
    """The state with another asking half."""
    return replace(state, asking=replace(state.asking, **changes))


# Phrases


@dataclass(frozen=True)
class Remember:
    """A phrase was asked: the first of the recent ones."""

    text: str

    def apply(self, state: State) -> State:
        text = " ".join(self.text.split())
        if not text:
            return state
        others = (t for t in state.asking.recent if t != text)
        return change(state, recent=(text, *others)[:MOST_RECENT])


@dataclass(frozen=True)
class AskAgain:
    """A recent phrase, in the first empty row or in a new one."""

    text: str

    def apply(self, state: State) -> State:
        empty = next((p for p in state.prompts if not p.text.strip()), None)
        if empty is None and len(state.prompts) >= MOST_PROMPTS:
            return state
        prompts, key = state.prompts, state.next_key
        if empty is None:
            used = {p.colour for p in prompts}
            colour = next((c for c in PALETTE if c not in used), PALETTE[len(prompts) % len(PALETTE)])
            calibrated = prompts[0].calibrated
            prompts = (*prompts, Prompt(key, self.text, colour, calibrated=calibrated))
        else:
            key = empty.key
            asked = replace(empty, text=self.text, score=None, visible=True)
            prompts = tuple(asked if p.key == key else p for p in prompts)
        mode = Mode.HEAT if state.mode is Mode.RGB and not state.asked else state.mode
        after = replace(state, prompts=prompts, active=key, mode=mode, next_key=state.next_key + 1)
        return Remember(self.text).apply(after)


@dataclass(frozen=True)
class SavePrompts:
    """Write the prompts to `path` (the worker does)."""

    path: Path

    def apply(self, state: State) -> State:
        return replace(change(state, prompts_path=self.path), dialog=None)


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
        first, calibrated = state.next_key, state.prompts[0].calibrated
        prompts = tuple(
            replace(p, key=first + place, calibrated=calibrated)
            for place, p in enumerate(self.chosen.prompts)
        )
        mode = Mode.LABELS if state.mode is Mode.RGB else state.mode
        state = replace(
            state,
            prompts=prompts,
            active=first,
            next_key=first + len(prompts),
            negatives=self.chosen.negatives or state.negatives,
            mode=mode,
        )
        return change(state, prompts_path=self.path)


@dataclass(frozen=True)
class Binned:
    """How the pixels of the view on show score."""

    histograms: tuple[Histogram, ...]

    def apply(self, state: State) -> State:
        return change(state, histograms=self.histograms)


# The dictionary


@dataclass(frozen=True)
class OpenDictionary:
    """Show the atoms, or no longer; the next session begins so too."""

    opened: bool

    def apply(self, state: State) -> State:
        wanted = replace(state.desk.preferences, dictionary_open=self.opened)
        return replace(state, desk=replace(state.desk, preferences=wanted))


@dataclass(frozen=True)
class AtomsDescribed:
    """The worker has looked the atoms over."""

    insight: Insight

    def apply(self, state: State) -> State:
        return change(state, insight=self.insight)


@dataclass(frozen=True)
class ShowAtom:
    """Show one atom's weight map."""

    atom: int

    def apply(self, state: State) -> State:
        if state.info is None or not 0 <= self.atom < state.info.num_atoms:
            return state
        return replace(change(state, atom=self.atom), mode=Mode.WEIGHT)


@dataclass(frozen=True)
class ChooseAtom:
    """Mark an atom for merging, or no longer; the first marked keeps its name."""

    atom: int
    chosen: bool

    def apply(self, state: State) -> State:
        others = tuple(k for k in state.asking.chosen if k != self.atom)
        return change(state, chosen=(*others, self.atom) if self.chosen else others)


@dataclass(frozen=True)
class ChooseNone:
    """No atom is marked for merging."""

    def apply(self, state: State) -> State:
        return change(state, chosen=())
