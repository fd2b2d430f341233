"""Edits of a scene: bit masks over its N Gaussians, a table of its K atoms, where Gaussians were moved to and
how they were recoloured, what people told it beside, and a history of all of it.

The scene itself never changes. `Marks` say what has become of it; an `Edit` is the difference of
two `Marks`: the exclusive-or of each mask, which is its own inverse, the old and new entry of each
atom, the changes of Gaussians that came and went, and the old and new value of what was told. Undoing is
therefore exact, and an edit takes some hundred bytes to a few kilobytes.

Memory is bounded: a history keeps the last `MOST_EDITS` edits, and fewer where they take more than
`MOST_BYTES`; older ones stay done and can no longer be undone.
"""

import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

from langflash_core.base.records import World
from langflash_core.scene.changes import Change, with_change
from langflash_core.scene.mask import Mask

MASKS = ("deleted", "hidden", "selected")
TOLD = ("camera_path", "metric_scale", "there", "tour", "world", "thing_names")
MOST_EDITS = 1000
MOST_BYTES = 32 * 2**20  # of the edits of one scene
Combine = Literal["replace", "add", "remove"]


@dataclass(frozen=True)
class Atom:
    """What edits made of one atom. into: the atom that it was merged into, or itself.

    name: the person's own, or none; it answers to that, too. on: whether it answers phrases. denied: words
    that it is not.
    """

    into: int
    name: str = ""
    on: bool = True
    denied: tuple[str, ...] = ()


@dataclass(frozen=True)
class Marks:
    """What edits made of a scene. A deleted or hidden Gaussian is never selected.

    camera_path, metric_scale, tour, thing_names: as in `Record`; plain values of JSON. world: as there.
    changes: of Gaussians, in order.
    there: how many of the scene's first Gaussians and atoms there are; others came with a merge that was
    undone.
    """

    deleted: Mask
    hidden: Mask
    selected: Mask
    atoms: tuple[Atom, ...]
    there: tuple[int, int]
    camera_path: tuple[Mapping[str, Any], ...] = ()
    metric_scale: float | None = None
    changes: tuple[Change, ...] = ()
    tour: Mapping[str, Any] = field(default_factory=dict)
    world: World | None = None
    thing_names: Mapping[str, str] = field(default_factory=dict)

    @staticmethod
    def without_edits(num_gaussians: int, num_atoms: int) -> "Marks":
        """Of a scene that nobody has edited."""
        nothing = Mask.none(num_gaussians)
        atoms = tuple(Atom(k) for k in range(num_atoms))
        return Marks(nothing, nothing, nothing, atoms, (num_gaussians, num_atoms))

    @cached_property
    def left(self) -> Mask:
        """Gaussians that there are and that are not deleted."""
        return Mask.first(self.deleted.count, self.there[0]) - self.deleted

    @cached_property
    def visible(self) -> Mask:
        """Gaussians that are shown."""
        return self.left - self.hidden

    @property
    def written(self) -> tuple[Any, ...]:
        """What a saved scene holds of them: all but what is hidden or selected."""
        told = self.camera_path, self.metric_scale, self.tour, self.world, self.thing_names
        return self.left, self.atoms[: self.there[1]], *told, self.changes

    def of_size(self, num_gaussians: int, atoms: tuple[Atom, ...]) -> "Marks":
        """The same marks where the scene has other Gaussians and atoms behind the ones they are about, which
        these marks do not know of. atoms: of that scene, as it was opened."""
        masks = {name: getattr(self, name).of_count(num_gaussians) for name in MASKS}
        atoms = (*self.atoms, *atoms[len(self.atoms) :])[: len(atoms)]
        return replace(self, **masks, atoms=atoms, changes=_resize_changes(self.changes, num_gaussians))


@dataclass(frozen=True)
class Edit:
    """One step from some marks to others.

    label: for people. flips: (mask, zlib of its changed bits). swaps: (atom, before, after).
    told: (one of `TOLD`, before, after). changes: how many stayed, those that went, those that came.
    """

    label: str
    flips: tuple[tuple[str, bytes], ...] = field(default=(), repr=False)
    swaps: tuple[tuple[int, Atom, Atom], ...] = ()
    told: tuple[tuple[str, Any, Any], ...] = ()
    changes: tuple[int, tuple[Change, ...], tuple[Change, ...]] | None = None

    @property
    def num_bytes(self) -> int:
        """About what it takes in memory."""
        flips = sum(len(packed) for _, packed in self.flips)
        pairs = [(name, value) for name, *pair in self.told for value in pair]
        values = sum(300 * len(value) for _, value in pairs if isinstance(value, tuple))
        values += sum(len(str(value)) for name, value in pairs if name in ("tour", "thing_names"))
        moved = (
            0 if self.changes is None else sum(len(c.rows.bits) for c in self.changes[1] + self.changes[2])
        )
        return 500 + flips + values + moved + 500 * len(self.swaps)

    def apply(self, marks: Marks) -> Marks:
        """The marks after this edit.

        Raises:
            ValueError: the edit belongs to other marks.
        """
        changed: dict[str, Any] = {}
        for name, packed in self.flips:
            mask: Mask = getattr(marks, name)
            bits = zlib.decompress(packed)
            if len(bits) != len(mask.bits):
                raise ValueError(f"edit: expected a scene of {8 * len(bits)} rows, received {mask.count}")
            changed[name] = mask ^ Mask(mask.count, bits)
        atoms = list(marks.atoms)
        for k, before, after in self.swaps:
            if not 0 <= k < len(atoms) or atoms[k] != before:
                raise ValueError(f"edit: expected atom {k} to be {before}")
            atoms[k] = after
        for name, before, after in self.told:
            if getattr(marks, name) != before:
                raise ValueError(f"edit: expected {name} to be {before}")
            changed[name] = after
        if self.changes is not None:
            stayed, went, came = self.changes
            if marks.changes[stayed:] != went:
                raise ValueError(f"edit: expected {stayed + len(went)} changes of Gaussians")
            changed["changes"] = (*marks.changes[:stayed], *came)
        return replace(marks, atoms=tuple(atoms), **changed)

    def inverse(self) -> "Edit":
        """The edit that takes this one back, exactly."""
        swaps = tuple((k, after, before) for k, before, after in self.swaps)
        told = tuple((name, new, old) for name, old, new in self.told)
        changes = None if self.changes is None else (self.changes[0], self.changes[2], self.changes[1])
        return replace(self, swaps=swaps, told=told, changes=changes)

    def of_size(self, old: int, new: int) -> "Edit":
        """The same edit of a scene with `new` Gaussians, more or fewer behind the `old` that it is about."""
        if old == new:
            return self
        masks = ((name, Mask(old, zlib.decompress(packed)).of_count(new)) for name, packed in self.flips)
        changes = self.changes
        if changes is not None:
            changes = (changes[0], _resize_changes(changes[1], new), _resize_changes(changes[2], new))
        flips = tuple((name, zlib.compress(mask.bits, 1)) for name, mask in masks)
        return replace(self, flips=flips, changes=changes)


def _resize_changes(changes: tuple[Change, ...], count: int) -> tuple[Change, ...]:
    return tuple(replace(change, rows=change.rows.of_count(count)) for change in changes)


def difference(label: str, before: Marks, after: Marks) -> Edit:
    """The edit from `before` to `after`."""
    flips = tuple(
        (name, zlib.compress((getattr(before, name) ^ getattr(after, name)).bits, 1))
        for name in MASKS
        if getattr(before, name) != getattr(after, name)
    )
    pairs = enumerate(zip(before.atoms, after.atoms, strict=True))
    swaps = tuple((k, old, new) for k, (old, new) in pairs if old != new)
    values = ((name, getattr(before, name), getattr(after, name)) for name in TOLD)
    told = tuple((name, old, new) for name, old, new in values if old != new)
    return Edit(label, flips, swaps, told, _other_changes(before.changes, after.changes))


def _other_changes(
    before: tuple[Change, ...], after: tuple[Change, ...]
) -> tuple[int, tuple[Change, ...], tuple[Change, ...]] | None:
    """As `Edit.changes`; None where they are the same."""
    if before == after:
        return None
    pairs = enumerate(zip(before, after, strict=False))
    stayed = next((place for place, (old, new) in pairs if old != new), min(len(before), len(after)))
    return stayed, before[stayed:], after[stayed:]


@dataclass(frozen=True)
class History:
    """Marks with the edits that led to them; `undone` are those taken back, the next to redo last.

    forgotten: how many older edits are done for good. opened: the marks before those, None where there are
    none: see `first`.
    """

    marks: Marks
    done: tuple[Edit, ...] = ()
    undone: tuple[Edit, ...] = ()
    forgotten: int = 0
    opened: Marks | None = None

    @property
    def first(self) -> Marks:
        """The marks of the scene as it was opened."""
        return self.moved_to(0).marks if self.opened is None else self.opened

    def edited(self, label: str, after: Marks) -> "History":
        """With one more edit, if it changes anything; what was undone is forgotten."""
        if after == self.marks:
            return self
        done = (*self.done, difference(label, self.marks, after))
        return replace(self, marks=after, done=done, undone=()).drop_oldest()

    def drop_oldest(self, most_edits: int = MOST_EDITS, most_bytes: int = MOST_BYTES) -> "History":
        """Without the oldest edits where there are too many; the last one always stays."""
        kept, total = 0, 0
        for edit in reversed(self.done):
            total += edit.num_bytes
            if kept and (kept >= most_edits or total > most_bytes):
                break
            kept += 1
        lost = len(self.done) - kept
        if not lost:
            return self
        return replace(self, done=self.done[lost:], forgotten=self.forgotten + lost, opened=self.first)

    def of_size(self, num_gaussians: int, atoms: tuple[Atom, ...]) -> "History":
        """The same history of a scene with other Gaussians and atoms behind its own: see `Marks.of_size`.
        What was undone is forgotten."""
        old = self.marks.deleted.count
        return replace(
            self,
            marks=self.marks.of_size(num_gaussians, atoms),
            done=tuple(edit.of_size(old, num_gaussians) for edit in self.done),
            undone=(),
            opened=None if self.opened is None else self.opened.of_size(num_gaussians, atoms),
        )

    def undo(self) -> "History":
        """One edit back; the same where there is none."""
        if not self.done:
            return self
        *earlier, last = self.done
        marks = last.inverse().apply(self.marks)
        return replace(self, marks=marks, done=tuple(earlier), undone=(*self.undone, last))

    def redo(self) -> "History":
        """One edit forth; the same where there is none."""
        if not self.undone:
            return self
        *rest, following = self.undone
        marks = following.apply(self.marks)
        return replace(self, marks=marks, done=(*self.done, following), undone=tuple(rest))

    def moved_to(self, position: int) -> "History":
        """With `position` edits done, 0 to all."""
        history = self
        while len(history.done) > max(position, 0):
            history = history.undo()
        while len(history.done) < position and history.undone:
            history = history.redo()
        return history


# What edits do to marks


def select(marks: Marks, found: Mask, combine: Combine = "replace") -> Marks:
    """Select what was found, of what is shown; or add it to the selection, or remove it."""
    found = found & marks.visible
    if combine == "add":
        found = marks.selected | found
    elif combine == "remove":
        found = marks.selected - found
    return replace(marks, selected=found)


def invert(marks: Marks) -> Marks:
    """Select what is shown and not selected."""
    return replace(marks, selected=marks.visible - marks.selected)


def delete(marks: Marks, rows: Mask) -> Marks:
    """Take Gaussians away."""
    return replace(marks, deleted=marks.deleted | rows, selected=marks.selected - rows)


def hide(marks: Marks, rows: Mask) -> Marks:
    """Stop showing Gaussians; they stay in the scene."""
    return replace(marks, hidden=marks.hidden | (rows - marks.deleted), selected=marks.selected - rows)


def isolate(marks: Marks, rows: Mask) -> Marks:
    """Show only these Gaussians."""
    return hide(marks, marks.visible - rows)


def show_all(marks: Marks) -> Marks:
    """Show what was hidden; what was deleted stays away."""
    return replace(marks, hidden=Mask.none(marks.hidden.count))


def change(marks: Marks, one: Change) -> Marks:
    """Move or recolour Gaussians."""
    return replace(marks, changes=with_change(marks.changes, one))


def rename_atom(marks: Marks, k: int, name: str) -> Marks:
    """Give an atom, with those merged with it, a name; an empty one takes it back. It ends a denial."""
    name = name.strip()
    denied = tuple(text for text in marks.atoms[k].denied if text.lower() != name.lower())
    return _with_atoms(marks, _merged_with(marks, k), name=name, denied=denied)


def deny_atom(marks: Marks, k: int, text: str) -> Marks:
    """Say that an atom, with those merged with it, is not what `text` means; a name of that text goes."""
    text, atom = text.strip(), marks.atoms[k]
    if not text or text in atom.denied:
        return marks
    name = "" if atom.name.lower() == text.lower() else atom.name
    return _with_atoms(marks, _merged_with(marks, k), name=name, denied=(*atom.denied, text))


def allow_atom(marks: Marks, k: int, text: str) -> Marks:
    """Take back that an atom, with those merged with it, is not what `text` means."""
    denied = tuple(word for word in marks.atoms[k].denied if word != text.strip())
    return _with_atoms(marks, _merged_with(marks, k), denied=denied)


def toggle_atom(marks: Marks, k: int) -> Marks:
    """Let an atom, with those merged with it, answer phrases, or no longer."""
    return _with_atoms(marks, _merged_with(marks, k), on=not marks.atoms[k].on)


def merge_atoms(marks: Marks, ks: Iterable[int]) -> Marks:
    """Make one of several atoms: the first keeps its number and name."""
    first, *others = ks
    head = marks.atoms[first]
    joined = [j for k in others for j in _merged_with(marks, k)]
    return _with_atoms(marks, joined, into=head.into, name=head.name, on=head.on, denied=head.denied)


def _merged_with(marks: Marks, k: int) -> list[int]:
    into = marks.atoms[k].into
    return [j for j, atom in enumerate(marks.atoms) if atom.into == into]


def _with_atoms(marks: Marks, ks: Iterable[int], **changes) -> Marks:
    atoms = list(marks.atoms)
    for k in ks:
        atoms[k] = replace(atoms[k], **changes)
    return replace(marks, atoms=tuple(atoms))
