"""Edits of a scene: bit masks over its N Gaussians, a table of its K atoms, what people told it beside, and
a history of all three.

The scene itself never changes. `Marks` say what has become of it; an `Edit` is the difference of
two `Marks`: the exclusive-or of each mask, which is its own inverse, the old and new entry of each
atom, and the old and new value of what was told. Undoing is therefore exact, and an edit takes some
hundred bytes to a few kilobytes.
"""

import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

MASKS = ("deleted", "hidden", "selected")
TOLD = ("camera_path", "metric_scale")
Combine = Literal["replace", "add", "remove"]


@dataclass(frozen=True)
class Mask:
    """A set of rows 0 to count - 1. bits: one each, lowest first, the last byte filled with 0."""

    count: int
    bits: bytes = field(repr=False)

    @staticmethod
    def none(count: int) -> "Mask":
        """The empty set."""
        return Mask(count, bytes(-(-count // 8)))

    @staticmethod
    def of(rows: np.ndarray) -> "Mask":
        """The rows that are true in a boolean (count,)."""
        return Mask(len(rows), np.packbits(np.asarray(rows, bool), bitorder="little").tobytes())

    @staticmethod
    def full(count: int) -> "Mask":
        """Every row."""
        return Mask.of(np.ones(count, bool))

    def rows(self) -> np.ndarray:
        """Boolean (count,)."""
        packed = np.frombuffer(self.bits, np.uint8)
        return np.unpackbits(packed, count=self.count, bitorder="little").astype(bool)

    def __len__(self) -> int:
        """How many rows are in the set."""
        return int.from_bytes(self.bits, "little").bit_count()

    def __or__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_or, other)

    def __and__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_and, other)

    def __xor__(self, other: "Mask") -> "Mask":
        return self._with(np.bitwise_xor, other)

    def __sub__(self, other: "Mask") -> "Mask":
        return self & (other ^ Mask.full(self.count))

    def _with(self, combine: np.ufunc, other: "Mask") -> "Mask":
        if other.count != self.count:
            raise ValueError(f"mask: expected {self.count} rows, received {other.count}")
        ours, theirs = np.frombuffer(self.bits, np.uint8), np.frombuffer(other.bits, np.uint8)
        return Mask(self.count, combine(ours, theirs).tobytes())


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

    camera_path, metric_scale: as in `Record`; plain values of JSON.
    """

    deleted: Mask
    hidden: Mask
    selected: Mask
    atoms: tuple[Atom, ...]
    camera_path: tuple[Mapping[str, Any], ...] = ()
    metric_scale: float | None = None

    @staticmethod
    def untouched(num_gaussians: int, num_atoms: int) -> "Marks":
        """Of a scene that nobody has edited."""
        nothing = Mask.none(num_gaussians)
        return Marks(nothing, nothing, nothing, tuple(Atom(k) for k in range(num_atoms)))

    @property
    def visible(self) -> Mask:
        """Gaussians that are shown."""
        return Mask.full(self.deleted.count) - (self.deleted | self.hidden)

    @property
    def written(self) -> tuple[Any, ...]:
        """What a saved scene holds of them: all but what is hidden or selected."""
        return self.deleted, self.atoms, self.camera_path, self.metric_scale


@dataclass(frozen=True)
class Edit:
    """One step from some marks to others.

    label: for people. flips: (mask, zlib of its changed bits). swaps: (atom, before, after).
    told: (one of `TOLD`, before, after).
    """

    label: str
    flips: tuple[tuple[str, bytes], ...] = field(default=(), repr=False)
    swaps: tuple[tuple[int, Atom, Atom], ...] = ()
    told: tuple[tuple[str, Any, Any], ...] = ()

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
        return replace(marks, atoms=tuple(atoms), **changed)

    def inverse(self) -> "Edit":
        """The edit that takes this one back, exactly."""
        swaps = tuple((k, after, before) for k, before, after in self.swaps)
        return replace(self, swaps=swaps, told=tuple((name, new, old) for name, old, new in self.told))


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
    return Edit(label, flips, swaps, tuple((name, old, new) for name, old, new in values if old != new))


@dataclass(frozen=True)
class History:
    """Marks with the edits that led to them; `undone` are those taken back, the next to redo last."""

    marks: Marks
    done: tuple[Edit, ...] = ()
    undone: tuple[Edit, ...] = ()

    def edited(self, label: str, after: Marks) -> "History":
        """With one more edit, if it changes anything; what was undone is forgotten."""
        if after == self.marks:
            return self
        return History(after, (*self.done, difference(label, self.marks, after)))

    def undo(self) -> "History":
        """One edit back; the same where there is none."""
        if not self.done:
            return self
        *earlier, last = self.done
        return History(last.inverse().apply(self.marks), tuple(earlier), (*self.undone, last))

    def redo(self) -> "History":
        """One edit forth; the same where there is none."""
        if not self.undone:
            return self
        *rest, following = self.undone
        return History(following.apply(self.marks), (*self.done, following), tuple(rest))

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
