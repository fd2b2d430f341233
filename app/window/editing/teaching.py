"""What a person taught a scene, kept for other scenes, and taken from there."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from langflash_core.base.files import make_folder
from langflash_core.scene import edits

from ..commands import Notify
from ..recovery.locks import one_at_a_time
from ..state import State
from .commands import with_edit

if TYPE_CHECKING:
    from langflash_core.language.lessons import Lessons

WORDS = "mine.words.json"
"""In the folder of preferences; `langflash words` reads it, too."""


def with_kept(lessons: "Lessons", path: Path) -> "Lessons":
    """Add lessons to a vocabulary, which other windows add to as well; what it holds then.

    Raises:
        LangFlashError: it is damaged, of another network or full, or cannot be written.
    """
    from langflash_core.language.lessons import read_lessons, write_lessons

    make_folder(path.parent)
    with one_at_a_time(path.with_suffix(".lock")):
        known = read_lessons(path).joined(lessons) if path.exists() else lessons
        write_lessons(known, path)
    return known


@dataclass(frozen=True)
class KeepWords:
    """Keep names and denials for other scenes (the worker does)."""

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class TakeWords:
    """Find the groups that look like what was taught in other scenes (the worker does)."""

    def apply(self, state: State) -> State:
        return state.with_editing(waiting="" if state.scene.info is None else "Looking for what you taught")


@dataclass(frozen=True)
class WordsFound:
    """What groups take: number, name or "", denied words. One step to undo."""

    lessons: tuple[tuple[int, str, tuple[str, ...]], ...]

    def apply(self, state: State) -> State:
        state = state.with_editing(waiting="")
        marks = state.editing.marks
        if marks is None:
            return state
        taken = [lesson for lesson in self.lessons if lesson[0] < len(marks.atoms)]
        if not taken:
            return Notify("No group here looks like what you taught in other scenes.", "info").apply(state)
        for k, name, denied in taken:
            for word in denied:
                marks = edits.deny_atom(marks, k, word)
            marks = edits.rename_atom(marks, k, name) if name else marks
        count = f"{len(taken)} group{'' if len(taken) == 1 else 's'}"
        state = with_edit(state, f"Take what you taught: {count}", marks)
        said = ", ".join(dict.fromkeys(name for _, name, _ in taken if name))
        return Notify(f"{count} took what you taught{': ' + said if said else ''}.", "info").apply(state)
