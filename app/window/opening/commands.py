"""What can happen while photos and scenes are looked for."""

from dataclasses import dataclass, replace
from pathlib import Path

from ..commands import ShowDialog
from ..state import State
from .state import LOOKING, NO_OPENING, Folder


@dataclass(frozen=True)
class OpenFiles:
    """Look for files: with the desktop's own dialog where there is one (the effects know), else with ours.

    merging: for a scene that is to be merged into the one on show.
    """

    merging: bool = False

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class LookInto:
    """Our own dialog, at a folder; None: where one was last. merging: as in `OpenFiles`; it stays so while
    the dialog is open."""

    folder: Path | None = None
    merging: bool = False

    def apply(self, state: State) -> State:
        if state.dialog not in LOOKING:
            state = ShowDialog("merge" if self.merging else "open").apply(state)
        return replace(state, opening=NO_OPENING, dialog_path="")


@dataclass(frozen=True)
class FolderRead:
    """What lies in the folder; it is where to begin the next time."""

    folder: Folder

    def apply(self, state: State) -> State:
        if not self.folder.problem:
            wanted = replace(state.preferences, folder=str(self.folder.path))
            state = replace(state, preferences=wanted)
        return replace(state, opening=replace(state.opening, folder=self.folder))


@dataclass(frozen=True)
class MorePictures:
    """These photos of a folder are still to be made small, if one is still there."""

    folder: Path
    paths: tuple[Path, ...]

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class Choose:
    """Take a file with the others, or no longer."""

    path: Path

    def apply(self, state: State) -> State:
        others = tuple(path for path in state.opening.chosen if path != self.path)
        chosen = others if self.path in state.opening.chosen else (*others, self.path)
        return replace(state, opening=replace(state.opening, chosen=chosen))


@dataclass(frozen=True)
class Paste:
    """Open what the clipboard holds: paths, files or a picture."""

    def apply(self, state: State) -> State:
        return state
