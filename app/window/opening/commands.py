"""What can happen while photos and scenes are looked for."""

from dataclasses import dataclass, replace
from pathlib import Path

from ..commands import ShowDialog
from ..state import State
from .state import LOOKING, NO_OPENING, Folder, Opening


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
    """Our own dialog, at a folder; None: where one was last. It stays `dialog`, one of `LOOKING`, while it is
    open."""

    folder: Path | None = None
    dialog: str = "open"

    def apply(self, state: State) -> State:
        if state.dialog not in LOOKING:
            state = ShowDialog(self.dialog).apply(state)
        kept = state.opening if state.dialog == "place" else NO_OPENING
        return replace(state, opening=replace(kept, folder=None, chosen=()), dialog_path="")


@dataclass(frozen=True)
class LookForPlace:
    """Look for the folder that the file of the dialog on show is written to."""

    def apply(self, state: State) -> State:
        wanted = state.exporting.form.path if state.dialog == "export" else state.dialog_path
        asked = Opening(asker=state.dialog or "", name=Path(wanted).name, pending=state.pending)
        return replace(state, opening=asked)


@dataclass(frozen=True)
class PlaceFound:
    """Back in the dialog that asked, with its file in this folder; None: where it was."""

    folder: Path | None

    def apply(self, state: State) -> State:
        asked, form = state.opening, state.exporting.form
        if asked.asker != "export":
            state = ShowDialog(asked.asker).apply(state)
            path = Path(state.dialog_path) if self.folder is None else self.folder / asked.name
            return replace(state, dialog_path=str(path), pending=asked.pending)
        path = Path(form.path) if self.folder is None else self.folder / asked.name
        exporting = replace(state.exporting, form=replace(form, path=str(path)))
        return replace(state, exporting=exporting, dialog="export", dialog_path="")


@dataclass(frozen=True)
class FolderRead:
    """What lies in the folder; it is where to begin the next time."""

    folder: Folder

    def apply(self, state: State) -> State:
        if not self.folder.problem and state.dialog != "place":
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
