"""What opening asks of the world: the desktop's dialog, folders, the clipboard."""

import os
from collections.abc import Callable
from pathlib import Path

from ..commands import Command, EditDialogPath
from ..dialogs import Dialog
from ..effects import Effects, Hands
from ..kit.textures import Thumbnails
from ..scene import samples
from ..scene.commands import (
    AddPhotos,
    Instead,
    OpenPaths,
    OpenScene,
    Reconstruct,
    SceneSaved,
    SetPhotosAside,
)
from ..scene.drops import typed_folder, typed_path
from ..scene.merging import MergeScene
from ..state import State
from . import native
from .commands import (
    FolderRead,
    FolderUsed,
    LookForPlace,
    LookInto,
    MorePictures,
    OpenFiles,
    OpenFilm,
    Paste,
    PlaceFound,
    TakeFrames,
)
from .pasted import pasted_paths, same_text
from .state import small
from .work import LookThrough, PastePicture, ReadFolder, SampleTiles, SmallPictures

POLL_SECONDS = 0.1  # of the desktop's dialog


class OpeningEffects(Effects):
    """clipboard: gives its text."""

    def __init__(self, hands: Hands, thumbnails: Thumbnails, clipboard: Callable[[], str]) -> None:
        self._hands = hands
        self._thumbnails = thumbnails
        self._clipboard = clipboard
        self._dialog: native.NativeDialog | native.NativePlace | None = None
        self._merging = False  # what was looked for last is to be merged
        self._polled = 0.0

    def begin(self) -> None:
        """The samples' pictures, the first thing that the worker does."""
        self._hands.submit(SampleTiles())

    @property
    def due(self) -> float:
        """When the desktop's dialog is asked again."""
        return float("inf") if self._dialog is None else self._polled + POLL_SECONDS

    def tick(self, state: State, now: float) -> None:
        """Open what was chosen in the desktop's dialog."""
        if self._dialog is None or now < self.due:
            return
        self._polled = now
        chosen = self._dialog.chosen()
        if chosen is not None:
            self._dialog = None
            if chosen:
                self._hands.dispatch(self._wanted(chosen, state))

    def _wanted(self, chosen: tuple[str, ...], state: State) -> Command:
        """What is to be done with what was chosen in the desktop's dialog."""
        if state.opening.asker:
            return PlaceFound(Path(chosen[0]))
        merging = self._merging and state.scene.info is not None
        return MergeScene(Path(chosen[0])) if merging else OpenPaths(chosen)

    def follow(self, command: Command, before: State, state: State) -> None:
        """Folders are read by the worker; small pictures of one go with its dialog."""
        match command:
            case OpenFiles(merging) if self._dialog is None:
                self._merging = merging
                if native.is_there():
                    self._dialog = native.NativeDialog(state.preferences.folder, merging)
                else:
                    self._hands.perform(LookInto(dialog=Dialog.MERGE if merging else Dialog.OPEN))
            case LookForPlace() if self._dialog is None:
                beside = _beside(before)
                if native.is_there():
                    self._dialog = native.NativePlace(str(beside))
                else:
                    self._hands.perform(LookInto(beside, dialog=Dialog.PLACE))
            case LookInto(folder):
                self._forget(before)
                self._hands.submit(ReadFolder(folder or _start(state)))
            case FolderRead(folder):
                self._forget(before)
                self._hands.submit(SmallPictures(folder.path, folder.photos))
            case MorePictures(folder, paths) if _shows(state, folder):
                self._hands.submit(SmallPictures(folder, paths))
            case Paste():
                self._paste()
            case EditDialogPath(text) if _looks(state):
                if state.dialog is Dialog.OPEN and len(text) > len(before.typed.text) + 1:  # more than a key
                    self._paste_into_field(text)
                self._list_typed(text, state)
            case OpenFilm(path):
                self._hands.submit(LookThrough(path))
            case TakeFrames() if before.opening.film is not None:
                self._take(state)
            case _:
                if _looks(before) and not _looks(state):
                    self._forget(before)
        self._show_film(before, state)
        self._note_folder(command, state)

    def _list_typed(self, text: str, state: State) -> None:
        """What lies where the path leads that is being typed."""
        folder, shown = typed_folder(text), state.opening.folder
        if folder is not None and (shown is None or shown.path != folder):
            self._hands.submit(ReadFolder(folder))

    def _note_folder(self, command: Command, state: State) -> None:
        """Where a file was opened or saved, if that folder is a person's."""
        folder = _used(command)
        known = folder is None or str(folder) == state.preferences.folder
        if folder is not None and not known and os.path.isdir(folder) and not samples.is_ours(folder):
            self._hands.perform(FolderUsed(folder))

    def _take(self, state: State) -> None:
        """Frames into the tray, and a scene of them."""
        film = state.opening.film
        assert film is not None
        aside = () if state.scene.info is None else (SetPhotosAside(),)
        self._hands.perform(Instead((*aside, AddPhotos(film.frames), Reconstruct())))

    def _show_film(self, before: State, state: State) -> None:
        """Small pictures of a film's frames, as long as its dialog is open."""
        film, was = state.opening.film, before.opening.film
        opened = state.dialog is Dialog.FILM and (before.dialog is not Dialog.FILM or film != was)
        same = (
            was is not None and film is not None and was.strip is film.strip and before.dialog is Dialog.FILM
        )
        if opened and film is not None and not same:
            paths = tuple(map(film.strip.path, range(len(film.strip.stills))))
            self._hands.submit(SmallPictures(film.strip.folder, paths))
        if before.dialog is Dialog.FILM and state.dialog is not Dialog.FILM and was is not None:
            for index in range(len(was.strip.stills)):
                self._thumbnails.drop(small(was.strip.path(index)))

    def _paste(self) -> None:
        paths = pasted_paths(self._clipboard())
        if paths:
            self._hands.dispatch(OpenPaths(paths))
        else:
            self._hands.submit(PastePicture())

    def _paste_into_field(self, text: str) -> None:
        """Several files that are copied into the field for a path, where they would be one long name."""
        copied = self._clipboard()
        paths = pasted_paths(copied) if same_text(text, copied) else ()
        if len(paths) > 1:
            self._hands.dispatch(OpenPaths(paths))

    def _forget(self, before: State) -> None:
        for path in before.opening.folder.photos if before.opening.folder else ():
            self._thumbnails.drop(small(path))


def _used(command: Command) -> Path | None:
    """The folder of the file that was opened or saved."""
    match command:
        case OpenPaths((first, *_)):
            path = Path(first).absolute()
            return path if os.path.isdir(path) else path.parent
        case OpenScene(path) | SceneSaved(path) | MergeScene(path):
            return path.absolute().parent
        case _:
            return None


def _shows(state: State, folder: Path) -> bool:
    """Whether small pictures of what lies in a folder are on show."""
    looked, film = state.opening.folder, state.opening.film
    if state.dialog is Dialog.FILM:
        return film is not None and film.strip.folder == folder
    return _looks(state) and looked is not None and looked.path == folder


def _looks(state: State) -> bool:
    """Whether a dialog that shows a folder is open."""
    return state.dialog is not None and state.dialog.looks


def _start(state: State) -> Path:
    """Where to begin: where something was last opened or saved, beside the photos at hand, or at home."""
    last = Path(state.preferences.folder)
    if state.preferences.folder and last.is_dir():
        return last
    return samples.beside(state.scene.photos).parent


def _beside(state: State) -> Path:
    """The folder of the file that the dialog on show writes; at home where it is not there yet."""
    wanted = state.exporting.form.path if state.dialog is Dialog.EXPORT else state.typed.text
    folder = typed_path(wanted).parent
    return folder if folder.is_dir() else Path.home()
