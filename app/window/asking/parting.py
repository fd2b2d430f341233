"""What can happen to the parts of an answer: they are listed, taken out of it, and taken back.

A part that is taken out gets an atom of its own, which is denied the phrase (`langflash_core.scene.lone`): so
masks, exports and pages follow, and it is one edit. Taking it back allows the atom the phrase again.
"""

from dataclasses import dataclass

import numpy as np

from langflash_core.scene.edits import allow_atom, deny_atom

from ..commands import Notify
from ..editing.commands import with_edit
from ..editing.state import Point
from ..scene.state import Job
from ..state import State
from .commands import revise
from .state import Part, Parts, Prompt, plain

TAKING_OUT = "Removing a part"
"""Title of the job."""
NEAR = 0.03
"""Of the distance that one looks from: how near to a part a click must be."""


@dataclass(frozen=True)
class PartsListed:
    """What the answer to a phrase is made of."""

    parts: Parts

    def apply(self, state: State) -> State:
        prompt = divided(state)
        holds = prompt is not None and (prompt.text.strip(), prompt.cut) == (self.parts.text, self.parts.cut)
        return state.with_asking(parts=self.parts) if holds else state


@dataclass(frozen=True)
class TakePartOut:
    """A part no longer answers the phrase."""

    text: str
    part: Part

    def apply(self, state: State) -> State:
        k = own_atom(state, self.part)
        if k is not None:  # it was taken out and back before
            return denied(state, k, self.text)
        return state.with_scene(job=Job(TAKING_OUT, "removing it", started=state.now))


@dataclass(frozen=True)
class TakePartBack:
    """A part that was taken out answers the phrase again."""

    text: str
    atom: int

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None or self.atom >= len(marks.atoms):
            return state
        after = with_edit(state, f"Put a part back into {self.text}", allow_atom(marks, self.atom, self.text))
        return revise(after)


@dataclass(frozen=True)
class TakePartAt:
    """The part at a point of the picture's place, out of the answer or back into it (effects know which)."""

    at: Point

    def apply(self, state: State) -> State:
        if divided(state) is None:
            text = "Ask for something first; Ctrl+click then removes a part of its answer."
            return Notify(text, "info").apply(state)
        return state


def divided(state: State) -> Prompt | None:
    """The phrase whose answer has parts: the active one, if it is plain words."""
    prompt = state.asking.active_prompt
    return prompt if prompt is not None and not prompt.like and plain(prompt.text) else None


def denied(state: State, k: int, text: str) -> State:
    """The state in which an atom is not what the text means."""
    marks = state.editing.marks
    assert marks is not None
    return revise(with_edit(state, f"Remove a part of {text}", deny_atom(marks, k, text)))


def own_atom(state: State, part: Part) -> int | None:
    """The lone atom that all of a part carries; None where it shares its atoms."""
    info = state.scene.info
    if info is None or not info.scene.record.lone_atoms:
        return None
    first = info.scene.semantics.weight_ids[:, 0].numpy()[part.rows.rows()]
    found = np.unique(first)
    return int(found[0]) if len(found) == 1 and int(found[0]) in info.scene.record.lone_atoms else None


def taken_out(state: State, text: str) -> tuple[int, ...]:
    """Lone atoms that do not answer the text any more."""
    info, marks = state.scene.info, state.editing.marks
    if info is None or marks is None:
        return ()
    lone = (k for k in info.scene.record.lone_atoms if k < marks.there[1])
    return tuple(k for k in lone if text.strip() in marks.atoms[k].denied)


def at_point(state: State, point: tuple[float, float, float]) -> TakePartOut | TakePartBack | None:
    """What a click on a point of the scene means: the nearest part of the answer goes, or comes back."""
    info, marks, prompt = state.scene.info, state.editing.marks, divided(state)
    if info is None or marks is None or prompt is None:
        return None
    text, parts = prompt.text.strip(), state.asking.parts
    means = info.memory.changed(marks).gaussians.means.numpy()
    distances = np.linalg.norm(means - np.array(point, np.float32), axis=1)
    distances[~marks.left.rows()] = np.inf
    found: list[tuple[float, TakePartOut | TakePartBack]] = []
    if parts is not None and parts.text == text:
        found += [(_least(distances, part.rows.rows()), TakePartOut(text, part)) for part in parts.parts]
    first = info.scene.semantics.weight_ids[:, 0].numpy() if taken_out(state, text) else None
    for k in taken_out(state, text):
        found.append((_least(distances, first == k), TakePartBack(text, k)))
    if not found:
        return None
    nearest, command = min(found, key=lambda one: one[0])
    far = float(np.linalg.norm(np.array(state.scene.pose.centre) - np.array(point)))
    return command if nearest <= NEAR * max(far, 1e-6) else None


def _least(distances: np.ndarray, rows: np.ndarray) -> float:
    return float(distances[rows].min(initial=np.inf))
