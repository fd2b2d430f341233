"""What can happen while editing. Every change of the scene is an entry of the history."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.window import poses
from app.window.editing import (
    RADIUS_RANGE,
    REACH_RANGE,
    STRICTNESS_RANGE,
    Card,
    Editing,
    Floaters,
    Offer,
    Point,
    Reading,
    Region,
    Tool,
)
from app.window.poses import Vector
from app.window.state import PALETTE, Flight, Mode, Prompt
from langflash_core.scene import edits
from langflash_core.scene.edits import Combine, History, Marks, Mask

if TYPE_CHECKING:
    from app.window.state import State

LIKE_THIS = "like this"
LIKE_THRESHOLD = 0.97  # relevancy; a look at one spot is sharper than a word, see the README


def change(state: "State", **changes) -> "State":
    """The state with another editing half."""
    return replace(state, editing=replace(state.editing, **changes))


def _edit(state: "State", label: str, marks: Marks) -> "State":
    history = state.editing.history
    return state if history is None else change(state, history=history.edited(label, marks))


# The tool in hand


@dataclass(frozen=True)
class SetTool:
    """Take another tool; what the last one was doing ends."""

    tool: Tool

    def apply(self, state: "State") -> "State":
        return change(state, tool=self.tool, drag=(), hover=None, asked=None, card=None)


@dataclass(frozen=True)
class SetCombine:
    """Whether a selection replaces, adds or removes without a modifier key."""

    combine: Combine

    def apply(self, state: "State") -> "State":
        return change(state, combine=self.combine)


@dataclass(frozen=True)
class SetRadius:
    """Another brush, design pixels."""

    radius: float

    def apply(self, state: "State") -> "State":
        return change(state, radius=min(max(self.radius, RADIUS_RANGE[0]), RADIUS_RANGE[1]))


@dataclass(frozen=True)
class SetThrough:
    """Whether regions select what is hidden behind other things, too."""

    through: bool

    def apply(self, state: "State") -> "State":
        return change(state, through=self.through)


@dataclass(frozen=True)
class SetReach:
    """How far growing goes, in spacings of the Gaussians."""

    reach: float

    def apply(self, state: "State") -> "State":
        return change(state, reach=min(max(self.reach, REACH_RANGE[0]), REACH_RANGE[1]))


# Selecting; what must be computed is asked of the worker, and comes back as `Found`


@dataclass(frozen=True)
class Drag:
    """The region being drawn; an empty one ends it."""

    points: tuple[Point, ...]

    def apply(self, state: "State") -> "State":
        return change(state, drag=self.points)


@dataclass(frozen=True)
class SelectRegion:
    """Find the Gaussians that a region of the picture shows."""

    region: Region
    combine: Combine = "replace"

    def apply(self, state: "State") -> "State":
        return change(state, drag=(), waiting="" if state.info is None else "Selecting")


@dataclass(frozen=True)
class SelectByPhrase:
    """Find the Gaussians that a prompt means, from its threshold on; a heat-map would cover them."""

    key: int
    combine: Combine = "replace"

    def apply(self, state: "State") -> "State":
        return change(replace(state, mode=Mode.RGB), waiting="Selecting")


@dataclass(frozen=True)
class SelectAtom:
    """Find the Gaussians that carry an atom more than any other."""

    atom: int
    combine: Combine = "replace"

    def apply(self, state: "State") -> "State":
        return change(state, waiting="Selecting")


@dataclass(frozen=True)
class Grow:
    """Add what lies around the selection; `phrase`: only what the active prompt means."""

    phrase: bool = False

    def apply(self, state: "State") -> "State":
        return change(state, waiting="Growing" if state.editing.num_selected else "")


@dataclass(frozen=True)
class Found:
    """Gaussians that were looked for. what: how, for the list of edits."""

    mask: Mask
    combine: Combine
    what: str

    def apply(self, state: "State") -> "State":
        state = change(state, waiting="")
        marks = state.editing.marks
        if marks is None or self.mask.count != marks.deleted.count:
            return state
        after = edits.select(marks, self.mask, self.combine)
        changed = len(after.selected ^ marks.selected)
        count = len(after.selected) if self.combine == "replace" else changed
        verb = {"replace": "Select", "add": "Add", "remove": "Unselect"}[self.combine]
        return _edit(state, f"{verb} {count:,} {self.what}", after)


@dataclass(frozen=True)
class StopWaiting:
    """Nothing is being looked for any more."""

    def apply(self, state: "State") -> "State":
        return change(state, waiting="")


@dataclass(frozen=True)
class SelectAll:
    """Select everything that is shown."""

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        return state if marks is None else _edit(state, "Select all", edits.select(marks, marks.visible))


@dataclass(frozen=True)
class Deselect:
    """Select nothing."""

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        if marks is None:
            return state
        return _edit(state, "Deselect", edits.select(marks, Mask.none(marks.deleted.count)))


@dataclass(frozen=True)
class Invert:
    """Select what is shown and not selected."""

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        return state if marks is None else _edit(state, "Invert the selection", edits.invert(marks))


# Changing the scene


@dataclass(frozen=True)
class Delete:
    """Take the selection away."""

    def apply(self, state: "State") -> "State":
        return _on_selection(state, "Delete", edits.delete)


@dataclass(frozen=True)
class Hide:
    """Stop showing the selection."""

    def apply(self, state: "State") -> "State":
        return _on_selection(state, "Hide", edits.hide)


@dataclass(frozen=True)
class Isolate:
    """Show the selection alone."""

    def apply(self, state: "State") -> "State":
        return _on_selection(state, "Isolate", edits.isolate)


@dataclass(frozen=True)
class ShowAll:
    """Show what was hidden."""

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        return state if marks is None else _edit(state, "Show everything", edits.show_all(marks))


@dataclass(frozen=True)
class RenameAtom:
    """Give an atom a name; an empty one takes it back."""

    atom: int
    name: str

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        if marks is None or not 0 <= self.atom < len(marks.atoms):
            return state
        label = (
            f"Name atom {self.atom} {self.name.strip()!r}"
            if self.name.strip()
            else f"Unname atom {self.atom}"
        )
        return _edit(state, label, edits.rename_atom(marks, self.atom, self.name))


@dataclass(frozen=True)
class MergeAtoms:
    """Make one of several atoms; the first keeps its number."""

    atoms: tuple[int, ...]

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        if marks is None or not self.atoms or not all(0 <= k < len(marks.atoms) for k in self.atoms):
            return state
        label = "Merge atoms " + ", ".join(map(str, self.atoms))
        return _edit(state, label, edits.merge_atoms(marks, self.atoms))


@dataclass(frozen=True)
class ToggleAtom:
    """Let an atom answer phrases, or no longer."""

    atom: int

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        if marks is None or not 0 <= self.atom < len(marks.atoms):
            return state
        verb = "Silence" if marks.atoms[self.atom].on else "Wake"
        return _edit(state, f"{verb} atom {self.atom}", edits.toggle_atom(marks, self.atom))


@dataclass(frozen=True)
class Undo:
    """Take the last edit back."""

    def apply(self, state: "State") -> "State":
        return _rewound(state, lambda history: history.undo())


@dataclass(frozen=True)
class Redo:
    """Make the edit again that was taken back last."""

    def apply(self, state: "State") -> "State":
        return _rewound(state, lambda history: history.redo())


@dataclass(frozen=True)
class GoTo:
    """Undo or redo until `position` edits are done."""

    position: int

    def apply(self, state: "State") -> "State":
        return _rewound(state, lambda history: history.moved_to(self.position))


# Floaters


@dataclass(frozen=True)
class FindFloaters:
    """Look for floaters and preview them in red."""

    def apply(self, state: "State") -> "State":
        if state.editing.history is None:
            return state
        strictness = state.editing.floaters.strictness if state.editing.floaters else Floaters().strictness
        return change(state, floaters=Floaters(strictness=strictness))


@dataclass(frozen=True)
class FloatersFound:
    """Scores (N,) of the preview that is open."""

    scores: bytes

    def apply(self, state: "State") -> "State":
        marks, preview = state.editing.marks, state.editing.floaters
        if marks is None or preview is None or len(self.scores) != 4 * marks.deleted.count:
            return state
        return change(state, floaters=replace(preview, scores=self.scores))


@dataclass(frozen=True)
class SetStrictness:
    """How far a Gaussian must stand out to count as a floater."""

    strictness: float

    def apply(self, state: "State") -> "State":
        if state.editing.floaters is None:
            return state
        strictness = min(max(self.strictness, STRICTNESS_RANGE[0]), STRICTNESS_RANGE[1])
        return change(state, floaters=replace(state.editing.floaters, strictness=strictness))


@dataclass(frozen=True)
class EndFloaters:
    """Close the preview: "delete" them, "select" them, or "" leave all as it is."""

    then: str = ""

    def apply(self, state: "State") -> "State":
        marks, preview = state.editing.marks, state.editing.floaters
        if marks is None or preview is None:
            return state
        found = preview.mask(marks.visible)
        state = change(state, floaters=None)
        if self.then == "delete":
            return _edit(state, f"Delete {len(found):,} floaters", edits.delete(marks, found))
        if self.then == "select":
            return _edit(state, f"Select {len(found):,} floaters", edits.select(marks, found))
        return state


# Pointing


@dataclass(frozen=True)
class Hover:
    """The pointer is at a pixel of the picture's place, framebuffer pixels; None: it left."""

    at: Point | None

    def apply(self, state: "State") -> "State":
        hover = None if self.at is None else Reading(self.at)
        return change(state, hover=hover)


@dataclass(frozen=True)
class ReadingTaken:
    """What the pixel under the pointer shows."""

    reading: Reading

    def apply(self, state: "State") -> "State":
        hover = state.editing.hover
        if hover is None or hover.at != self.reading.at:
            return state
        return change(state, hover=self.reading)


@dataclass(frozen=True)
class Ask:
    """What is this, at a pixel?"""

    at: Point

    def apply(self, state: "State") -> "State":
        return change(state, asked=self.at, card=None)


@dataclass(frozen=True)
class CardOpened:
    """The place is read; its words follow."""

    reading: Reading

    def apply(self, state: "State") -> "State":
        return change(state, asked=None, card=Card(self.reading))


@dataclass(frozen=True)
class Named:
    """Nearest words (word, cosine) and language vector of the place that was asked about."""

    asked: Reading
    reading: Reading
    words: tuple[tuple[str, float], ...]
    vector: bytes

    def apply(self, state: "State") -> "State":
        card = state.editing.card
        if card is None or card.reading != self.asked:
            return state
        return change(state, card=Card(self.reading, self.words, self.vector))


@dataclass(frozen=True)
class CloseCard:
    """Take the answer away."""

    def apply(self, state: "State") -> "State":
        return change(state, card=None, asked=None)


@dataclass(frozen=True)
class AtomsNamed:
    """The nearest words of every atom."""

    names: tuple[tuple[str, ...], ...]

    def apply(self, state: "State") -> "State":
        return change(state, names=self.names)


@dataclass(frozen=True)
class FindSimilar:
    """Ask for what the card's place says, as a prompt of its own."""

    def apply(self, state: "State") -> "State":
        card = state.editing.card
        if card is None or not card.vector:
            return state
        word = card.words[0][0] if card.words else ""
        text = f"{LIKE_THIS} ({word})" if word else LIKE_THIS
        empty = next((p for p in state.prompts if not p.text.strip()), None)
        used = {p.colour for p in state.prompts if p is not empty}
        free = [c for c in PALETTE if c not in used] or [PALETTE[len(state.prompts) % len(PALETTE)]]
        prompt = Prompt(state.next_key, text, free[0], LIKE_THRESHOLD, like=card.vector)
        prompts = (*(p for p in state.prompts if p is not empty), prompt)
        mode = Mode.HEAT if state.mode is Mode.RGB else state.mode
        state = replace(state, prompts=prompts, active=prompt.key, next_key=state.next_key + 1, mode=mode)
        return change(state, card=None)


@dataclass(frozen=True)
class FrameSelection:
    """Fly to where the selection, or everything where nothing is selected, fills the view."""

    def apply(self, state: "State") -> "State":
        marks = state.editing.marks
        if marks is None or state.info is None:
            return state
        rows = (marks.selected or marks.visible).rows()
        points = state.info.scene.gaussians.means.numpy()[rows]
        if not len(points):
            return state
        low, high = np.quantile(points, (0.02, 0.98), axis=0)
        pose = poses.framing(state.pose, Vector(*low.tolist()), Vector(*high.tolist()))
        return replace(state, flight=Flight(state.pose, pose, state.now), view=None)


# Edits of an earlier session


@dataclass(frozen=True)
class EditsKept:
    """Where the edits lie until they are saved; None: nowhere."""

    file: Path | None

    def apply(self, state: "State") -> "State":
        return change(state, kept=self.file)


@dataclass(frozen=True)
class OfferEdits:
    """Edits were found that nobody saved."""

    offer: Offer

    def apply(self, state: "State") -> "State":
        return change(state, offer=self.offer)


@dataclass(frozen=True)
class EndOffer:
    """Restore the edits, or `forget` them for good; otherwise they are offered again next time."""

    restore: bool = False
    forget: bool = False

    def apply(self, state: "State") -> "State":
        return change(state, offer=None)


def fresh(editing: Editing, history: History | None, saved: Marks | None) -> Editing:
    """Editing of a scene that has just come; tool and settings stay in the hand."""
    return Editing(
        history=history, saved=saved, tool=editing.tool, combine=editing.combine, radius=editing.radius,
        through=editing.through, reach=editing.reach,
    )  # fmt: skip


def _on_selection(state: "State", verb: str, make) -> "State":
    marks = state.editing.marks
    if marks is None or not marks.selected:
        return state
    return _edit(state, f"{verb} {len(marks.selected):,}", make(marks, marks.selected))


def _rewound(state: "State", step) -> "State":
    history = state.editing.history
    return state if history is None else change(state, history=step(history))
