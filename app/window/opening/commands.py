"""What can happen while photos and scenes are looked for."""

from dataclasses import dataclass, replace
from pathlib import Path

from langflash_core.errors import FilmError
from langflash_core.images.settings import CHOOSING, PHOTO_LIMITS
from langflash_core.images.strip import REPEAT, Choice, Still, Strip, choose, notes_on

from ..commands import Notify, ShowDialog
from ..dialogs import Dialog
from ..protocol import Outward
from ..scene.drops import NOT_TYPED, Typed
from ..scene.state import LOOKING_THROUGH, Job, Photo
from ..state import State
from .state import NO_OPENING, Film, Folder, Opening, told_film


@dataclass(frozen=True)
class OpenFiles(Outward):
    """Look for files: with the desktop's own dialog where there is one (the effects know), else with ours.

    merging: for a scene that is to be merged into the one on show.
    """

    merging: bool = False


@dataclass(frozen=True)
class LookInto:
    """Our own dialog, at a folder; None: where one was last. `dialog` is one that shows a folder; where such
    a one is open already it stays."""

    folder: Path | None = None
    dialog: Dialog = Dialog.OPEN

    def apply(self, state: State) -> State:
        if state.dialog is None or not state.dialog.looks:
            state = ShowDialog(self.dialog).apply(state)
        kept = state.opening if state.dialog is Dialog.PLACE else replace(NO_OPENING, film=state.opening.film)
        return replace(state, opening=replace(kept, folder=None, chosen=()), typed=NOT_TYPED)


@dataclass(frozen=True)
class LookForPlace:
    """Look for the folder that the file of the dialog on show is written to."""

    def apply(self, state: State) -> State:
        wanted = state.exporting.form.path if state.dialog is Dialog.EXPORT else state.typed.text
        pending, film = state.scene.pending, state.opening.film
        asked = Opening(asker=state.dialog, name=Path(wanted).name, pending=pending, film=film)
        return replace(state, opening=asked)


@dataclass(frozen=True)
class PlaceFound:
    """Back in the dialog that asked, with its file in this folder; None: where it was."""

    folder: Path | None

    def apply(self, state: State) -> State:
        asked, form = state.opening, state.exporting.form
        if asked.asker is not Dialog.EXPORT:
            state = ShowDialog(asked.asker).apply(state)
            path = Path(state.typed.text) if self.folder is None else self.folder / asked.name
            return replace(state.with_scene(pending=asked.pending), typed=Typed(str(path)))
        path = Path(form.path) if self.folder is None else self.folder / asked.name
        state = state.with_exporting(form=replace(form, path=str(path)))
        return replace(state, dialog=Dialog.EXPORT, typed=NOT_TYPED)


@dataclass(frozen=True)
class FolderRead:
    """What lies in the folder."""

    folder: Folder

    def apply(self, state: State) -> State:
        return state.with_opening(folder=self.folder)


@dataclass(frozen=True)
class FolderUsed:
    """Something was opened from this folder or saved there: it is where to begin the next time."""

    folder: Path

    def apply(self, state: State) -> State:
        return replace(state, preferences=replace(state.preferences, folder=str(self.folder)))


@dataclass(frozen=True)
class MorePictures(Outward):
    """These photos of a folder are still to be made small, if one is still there."""

    folder: Path
    paths: tuple[Path, ...]


@dataclass(frozen=True)
class Choose:
    """Take a file with the others, or no longer."""

    path: Path

    def apply(self, state: State) -> State:
        several = state.dialog is not Dialog.MERGE  # one scene is merged at a time
        others = tuple(path for path in state.opening.chosen if path != self.path and several)
        chosen = others if self.path in state.opening.chosen else (*others, self.path)
        return replace(state.with_opening(chosen=chosen), typed=NOT_TYPED)  # what was done last counts


@dataclass(frozen=True)
class Paste(Outward):
    """Open what the clipboard holds: paths, files or a picture."""


# Films


@dataclass(frozen=True)
class OpenFilm:
    """Look through a film; replaces a job under way."""

    path: Path

    def apply(self, state: State) -> State:
        job = Job(f"Opening {self.path.name}", LOOKING_THROUGH, started=state.now)
        return replace(state.with_scene(job=job), dialog=None)


@dataclass(frozen=True)
class FilmRead:
    """A film was looked through: its strip is shown, with the frames that are proposed."""

    path: Path
    strip: Strip

    def apply(self, state: State) -> State:
        state = state.with_scene(job=None)
        try:
            film = proposed(self.path, self.strip, min(room_for_frames(state), PHOTO_LIMITS.film_photos))
        except FilmError as error:
            return Notify(str(error)).apply(state)
        return ShowDialog(Dialog.FILM).apply(state.with_opening(film=film))


@dataclass(frozen=True)
class ProposeFrames:
    """Choose the film's frames anew: at most so many, or exactly."""

    most: int
    exactly: bool = False

    def apply(self, state: State) -> State:
        film = state.opening.film
        if film is None:
            return state
        most = min(max(2, self.most), room_for_frames(state))
        chosen = proposed(film.path, film.strip, most, most if self.exactly else 2)
        return state.with_opening(film=chosen)


@dataclass(frozen=True)
class SwitchFrame:
    """Take a frame of the film with the others, or no longer."""

    index: int

    def apply(self, state: State) -> State:
        film = state.opening.film
        if film is None or not 0 <= self.index < len(film.strip.stills):
            return state
        chosen = set(film.chosen) ^ {self.index}
        if len(chosen) > room_for_frames(state):
            text = f"At most {room_for_frames(state)} frames fit into one scene; exclude another one first."
            return Notify(text).apply(state)
        return state.with_opening(film=replace(film, chosen=tuple(sorted(chosen))))


@dataclass(frozen=True)
class TakeFrames:
    """The chosen frames become photos in the tray, beside those that are not of this film, or alone for a new
    room where a scene is on show; and a scene is made of them."""

    def apply(self, state: State) -> State:
        if state.scene.info is None:
            state = state.with_scene(photos=beside_frames(state))
        return replace(state, dialog=None)


def proposed(path: Path, strip: Strip, most: int, fewest: int = 2) -> Film:
    """The film with the frames that the program would take.

    Raises:
        FilmError: it has none to take.
    """
    choice = choose(strip, most, fewest)
    reasons = tuple(_reason(still, choice, index) for index, still in enumerate(strip.stills))
    left, notes = tuple(choice.left.items()), notes_on(strip, choice)
    return Film(path, strip, choice.chosen, left, notes, choice.chosen, reasons)


def _reason(still: Still, choice: Choice, index: int) -> str:
    """Why a still is left out where it is, a key of `REASONS`."""
    if still.why_not:
        return "repeats" if still.why_not == REPEAT else "other_shots"
    if choice.until is not None and still.seconds > choice.until:
        return "beyond"
    blurred = choice.relative[index] < CHOOSING.blurred or still.smear > CHOOSING.smeared
    return "blurred" if blurred else "between"


def room_for_frames(state: State) -> int:
    """How many frames of a film fit into one scene with the photos in the tray."""
    return max(PHOTO_LIMITS.max_photos - len(beside_frames(state)), 2)


def films_of(state: State) -> tuple[dict, ...]:
    """Of the film that photos in the tray are frames of, what a scene's record says."""
    film = state.opening.film
    if film is None or film.strip.folder not in {path.parent for path in state.scene.paths}:
        return ()
    return (told_film(film),)


def beside_frames(state: State) -> tuple[Photo, ...]:
    """Photos in the tray that stay with a film's frames: none where these make a new room."""
    film = state.opening.film
    if state.scene.info is not None:
        return ()
    return tuple(
        photo for photo in state.scene.photos if film is None or photo.path.parent != film.strip.folder
    )
