"""What can happen while editing. Every change of the scene is an entry of the history."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from langflash_core.base import pictures
from langflash_core.mending.recipes import Box, Recipe
from langflash_core.scene import edits
from langflash_core.scene.changes import Moved
from langflash_core.scene.edits import Combine, History, Marks
from langflash_core.scene.mask import Mask

from ..asking.commands import revise
from ..commands import Notify
from ..state import State
from .state import THINGS, Floaters, Point, Region

FELL_OFF = "The oldest edits can no longer be undone: the list keeps the last 1,000, or 32 MB of them."


def with_edit(state: State, label: str, marks: Marks) -> State:
    """The state after an edit, named for the list; the same where nothing has become of it. Says so when the
    first of the oldest edits can no longer be undone."""
    history = state.editing.history
    if history is None:
        return state
    after = history.edited(label, marks)
    state = _with_history(state, after)
    return Notify(FELL_OFF, "info").apply(state) if after.forgotten and not history.forgotten else state


# Selecting; what must be computed is asked of the worker, and comes back as `Found`


@dataclass(frozen=True)
class SelectRegion:
    """Find the Gaussians that a region of the picture shows."""

    region: Region
    combine: Combine = "replace"

    def apply(self, state: State) -> State:
        return state.with_editing(drag=(), waiting="" if state.scene.info is None else "Selecting")


@dataclass(frozen=True)
class SelectThing:
    """Find the thing that a pixel of the picture's place shows, its parts, and what it is part of."""

    at: Point
    combine: Combine = "replace"

    def apply(self, state: State) -> State:
        return state.with_editing(drag=(), waiting="" if state.scene.info is None else THINGS)


@dataclass(frozen=True)
class SelectSphere:
    """Find what lies in a ball around what a pixel shows. radius: pixels there."""

    at: Point
    radius: float
    combine: Combine = "replace"

    def apply(self, state: State) -> State:
        return state.with_editing(drag=(), waiting="" if state.scene.info is None else "Selecting")


@dataclass(frozen=True)
class SelectByPhrase:
    """Find the Gaussians that a prompt means, from its threshold on; a heat-map would cover them."""

    key: int
    combine: Combine = "replace"

    def apply(self, state: State) -> State:
        return state.with_scene(mode=pictures.RGB).with_editing(waiting="Selecting")


@dataclass(frozen=True)
class SelectAtom:
    """Find the Gaussians that carry an atom more than any other."""

    atom: int
    combine: Combine = "replace"

    def apply(self, state: State) -> State:
        return state.with_editing(waiting="Selecting")


@dataclass(frozen=True)
class Grow:
    """Add what lies around the selection; `phrase`: only what the active prompt means."""

    phrase: bool = False

    def apply(self, state: State) -> State:
        return state.with_editing(waiting="Growing" if state.editing.num_selected else "")


@dataclass(frozen=True)
class Found:
    """Gaussians that were looked for. what: how, for the list of edits."""

    mask: Mask
    combine: Combine
    what: str

    def apply(self, state: State) -> State:
        state = state.with_editing(waiting="")
        marks = state.editing.marks
        if marks is None or self.mask.count != marks.deleted.count:
            return state
        return selected(state, edits.select(marks, self.mask, self.combine), self.combine, self.what)


def selected(state: State, after: Marks, combine: Combine, what: str) -> State:
    """The state after a selection became another. what: how, for the list of edits."""
    marks = state.editing.marks
    assert marks is not None
    if not after.selected:
        return with_edit(state, "Deselect", after)
    changed = len(after.selected ^ marks.selected)
    count = len(after.selected) if combine == "replace" else changed
    verb = {"replace": "Select", "add": "Add", "remove": "Unselect"}[combine]
    return with_edit(state, f"{verb} {count:,} {what}", after)


@dataclass(frozen=True)
class StopWaiting:
    """Nothing is being looked for any more."""

    def apply(self, state: State) -> State:
        return state.with_editing(waiting="")


@dataclass(frozen=True)
class SelectAll:
    """Select everything that is shown."""

    def apply(self, state: State) -> State:
        return _edited(state, "Select all", lambda marks: edits.select(marks, marks.visible))


@dataclass(frozen=True)
class Deselect:
    """Select nothing."""

    def apply(self, state: State) -> State:
        return _edited(state, "Deselect", lambda marks: edits.select(marks, Mask.none(marks.deleted.count)))


@dataclass(frozen=True)
class Invert:
    """Select what is shown and not selected."""

    def apply(self, state: State) -> State:
        return _edited(state, "Invert the selection", edits.invert)


# Changing the scene


@dataclass(frozen=True)
class Delete:
    """Take the selection away."""

    def apply(self, state: State) -> State:
        return _on_selection(state, "Delete", edits.delete)


@dataclass(frozen=True)
class Hide:
    """Stop showing the selection."""

    def apply(self, state: State) -> State:
        return _on_selection(state, "Hide", edits.hide)


@dataclass(frozen=True)
class Isolate:
    """Show the selection alone."""

    def apply(self, state: State) -> State:
        return _on_selection(state, "Isolate", edits.isolate)


@dataclass(frozen=True)
class ShowAll:
    """Show what was hidden."""

    def apply(self, state: State) -> State:
        return _edited(state, "Show everything", edits.show_all)


@dataclass(frozen=True)
class RenameAtom:
    """Give an atom a name; an empty one takes it back."""

    atom: int
    name: str

    def apply(self, state: State) -> State:
        name = self.name.strip()
        label = f"Name group {self.atom} {name!r}" if name else f"Unname group {self.atom}"
        return _edited(state, label, lambda marks: edits.rename_atom(marks, self.atom, self.name), self.atom)


@dataclass(frozen=True)
class DenyAtom:
    """An atom is not what `text` means, and neither are those that look like it."""

    atom: int
    text: str

    def apply(self, state: State) -> State:
        label = f"Group {self.atom} is not {self.text.strip()!r}"
        return _edited(state, label, lambda marks: edits.deny_atom(marks, self.atom, self.text), self.atom)


@dataclass(frozen=True)
class MergeAtoms:
    """Make one of several atoms; the first keeps its number."""

    atoms: tuple[int, ...]

    def apply(self, state: State) -> State:
        if not self.atoms:
            return state
        label = "Merge groups " + ", ".join(map(str, self.atoms))
        return _edited(state, label, lambda marks: edits.merge_atoms(marks, self.atoms), *self.atoms)


@dataclass(frozen=True)
class ToggleAtom:
    """Let an atom answer phrases, or no longer."""

    atom: int

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None or not 0 <= self.atom < len(marks.atoms):
            return state
        verb = "Silence" if marks.atoms[self.atom].on else "Wake"
        return with_edit(state, f"{verb} group {self.atom}", edits.toggle_atom(marks, self.atom))


@dataclass(frozen=True)
class Undo:
    """Take the last edit back."""

    def apply(self, state: State) -> State:
        return _rewound(state, lambda history: history.undo())


@dataclass(frozen=True)
class Redo:
    """Make the edit again that was taken back last."""

    def apply(self, state: State) -> State:
        return _rewound(state, lambda history: history.redo())


@dataclass(frozen=True)
class GoTo:
    """Undo or redo until `position` edits are done."""

    position: int

    def apply(self, state: State) -> State:
        return _rewound(state, lambda history: history.moved_to(self.position))


# Floaters


@dataclass(frozen=True)
class FindFloaters:
    """Look for floaters and preview them in red; within the selection, where there is one."""

    def apply(self, state: State) -> State:
        marks = state.editing.marks
        if marks is None:
            return state
        before = state.editing.floaters or Floaters()
        within = marks.selected if marks.selected else None
        return state.with_editing(floaters=Floaters(recipe=before.recipe, within=within, open=before.open))


@dataclass(frozen=True)
class FloatersFound:
    """Of the preview that is open the least strengths (N,), and what else `recipe` finds at any strength;
    None: that of the preview."""

    least: bytes
    recipe: Recipe | None = None
    ruled: Mask | None = None
    answering: Mask | None = None
    outside: Mask | None = None
    box: Box | None = None

    def apply(self, state: State) -> State:
        marks, preview = state.editing.marks, state.editing.floaters
        if marks is None or preview is None or len(self.least) != 4 * marks.deleted.count:
            return state
        if self.recipe is not None and replace(self.recipe, strength=preview.strength) != preview.recipe:
            return state  # another is on its way
        return state.with_editing(
            floaters=replace(
                preview, least=self.least, ruled=self.ruled, answering=self.answering,
                outside=self.outside, box=self.box,
            )
        )  # fmt: skip


@dataclass(frozen=True)
class SetStrength:
    """How much is to be cleaned up, 0 to 1."""

    strength: float

    def apply(self, state: State) -> State:
        if state.editing.floaters is None:
            return state
        strength = min(max(self.strength, 0.0), 1.0)
        preview = state.editing.floaters
        recipe = replace(preview.recipe, strength=strength)
        return state.with_editing(floaters=replace(preview, recipe=recipe))


@dataclass(frozen=True)
class EndFloaters:
    """Close the preview: "delete" them, "select" them, or "" leave all as it is."""

    then: str = ""

    def apply(self, state: State) -> State:
        marks, preview = state.editing.marks, state.editing.floaters
        if marks is None or preview is None:
            return state
        found = preview.mask(marks.visible)
        if self.then == "delete" and found and not marks.left - found:
            return Notify("Nothing would be left of the scene; choose less.").apply(state)
        state = state.with_editing(floaters=None)
        what = f"{len(found):,} " + ("by rules" if preview.by_rules else "floaters")
        if self.then == "delete":
            return with_edit(state, f"Delete {what}", edits.delete(marks, found))
        if self.then == "select":
            return with_edit(state, f"Select {what}", edits.select(marks, found))
        return state


def _edited(state: State, label: str, make: Callable[[Marks], Marks], *atoms: int) -> State:
    """After an edit of the marks, those of these atoms where they are known."""
    marks = state.editing.marks
    if marks is None or not all(0 <= k < len(marks.atoms) for k in atoms):
        return state
    return with_edit(state, label, make(marks))


def _on_selection(state: State, verb: str, make) -> State:
    marks = state.editing.marks
    if marks is None or not marks.selected:
        return state
    return with_edit(state, f"{verb} {len(marks.selected):,}", make(marks, marks.selected))


def _rewound(state: State, step) -> State:
    history = state.editing.history
    return state if history is None else _with_history(state, step(history))


def _with_history(state: State, history: History) -> State:
    """Another history; scores hold on only while it shows the same Gaussians with the same atoms."""
    before = state.editing.marks
    state = state.with_editing(history=history, gesture=None, tint=None)
    return state if _spoken_of(before) == _spoken_of(history.marks) else revise(state)


def _spoken_of(marks: Marks | None) -> tuple | None:
    """What of the marks a score rests on."""
    if marks is None:
        return None
    return marks.visible, marks.atoms, tuple(each for each in marks.changes if isinstance(each, Moved))
