"""Commands of the tray, the export, the comparison, the preferences and the restored session."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from app.window import poses
from app.window.commands import FlyTo, Notify
from app.window.desk import MOST_LINES, Exporting, Line
from app.window.export_form import ExportForm, What
from app.window.poses import Pose
from app.window.preferences import PANEL_WIDTHS, SCALES, SPEEDS, Preferences
from app.window.recovery import Kept
from app.window.state import Photo, Prompt, State


def change(state: State, **changes: Any) -> State:
    """With another desk."""
    return replace(state, desk=replace(state.desk, **changes))


# The tray


@dataclass(frozen=True)
class PhotoRead:
    """What a photo's file says: field of view of the longer side in degrees, if any, and triage."""

    path: Path
    recorded: float | None
    notes: tuple[str, ...]

    def apply(self, state: State) -> State:
        return _change_photo(state, self.path, recorded=self.recorded, notes=self.notes)


@dataclass(frozen=True)
class SetPhotoFov:
    """The person's own field of view, degrees; None goes back to the photo's record."""

    index: int
    fov: float | None

    def apply(self, state: State) -> State:
        if not 0 <= self.index < len(state.photos):
            return state
        fov = None if self.fov is None else min(max(self.fov, poses.FOV_RANGE[0]), poses.FOV_RANGE[1])
        return _change_photo(state, state.photos[self.index].path, fov=fov)


@dataclass(frozen=True)
class MovePhoto:
    """Take the photo at `index` to `place`; the first one's camera becomes the world."""

    index: int
    place: int

    def apply(self, state: State) -> State:
        photos = list(state.photos)
        if not 0 <= self.index < len(photos):
            return state
        photo = photos.pop(self.index)
        photos.insert(min(max(self.place, 0), len(photos)), photo)
        return replace(state, photos=tuple(photos))


@dataclass(frozen=True)
class ChoosePair:
    """Look for the two photos that make the best scene."""

    def apply(self, state: State) -> State:
        if len(state.photos) < 3:
            text = "Choosing needs three photos or more; drop some on the window."
            return Notify(text).apply(state)
        return change(state, choosing=True)


@dataclass(frozen=True)
class PairChosen:
    """The best pair of `paths`, or none; the others leave the tray."""

    paths: tuple[Path, ...]
    pair: tuple[int, int] | None

    def apply(self, state: State) -> State:
        state = change(state, choosing=False)
        if tuple(photo.path for photo in state.photos) != self.paths:
            return state  # the tray has changed meanwhile: the answer is about other photos
        if self.pair is None:
            text = "No two of these photos match; take photos that share at least a third of the picture."
            return Notify(text).apply(state)
        chosen = tuple(state.photos[index] for index in self.pair)
        names = " and ".join(photo.path.name for photo in chosen)
        return Notify(f"Kept {names}.", "info").apply(replace(state, photos=chosen))


@dataclass(frozen=True)
class ChoosingFailed:
    """The search for a pair ended without an answer."""

    sentence: str

    def apply(self, state: State) -> State:
        return Notify(self.sentence).apply(change(state, choosing=False))


# Moving


@dataclass(frozen=True)
class FrameAll:
    """Fly back until the whole scene is in view, looking the same way."""

    def apply(self, state: State) -> State:
        info = state.info
        if info is None or info.extent is None:
            return state
        return FlyTo(poses.framing(state.pose, *info.extent)).apply(state)


@dataclass(frozen=True)
class Compare:
    """The photo of the view on show from `place` (0 to 1) on to the right; None: no photo."""

    place: float | None

    def apply(self, state: State) -> State:
        place = None if self.place is None else min(max(self.place, 0.0), 1.0)
        return change(state, compare=place)


# Preferences and the log


@dataclass(frozen=True)
class Prefer:
    """Other preferences; what is out of range is brought back into it."""

    preferences: Preferences

    def apply(self, state: State) -> State:
        wanted = self.preferences
        return change(
            state,
            preferences=replace(
                wanted,
                scale=_within(wanted.scale, SCALES),
                speed=_within(wanted.speed, SPEEDS),
                panel_width=_within(wanted.panel_width, PANEL_WIDTHS),
            ),
        )


@dataclass(frozen=True)
class Opened:
    """A file was opened or saved: it is the newest of the recent ones."""

    path: Path

    def apply(self, state: State) -> State:
        return change(state, preferences=state.desk.preferences.opened(self.path))


@dataclass(frozen=True)
class ForgetRecent:
    """Empty the list of recent files."""

    def apply(self, state: State) -> State:
        return change(state, preferences=replace(state.desk.preferences, recent=()))


@dataclass(frozen=True)
class Log:
    """One more line of the log; the oldest ones go."""

    kind: str
    text: str

    def apply(self, state: State) -> State:
        line = Line(state.now, self.kind, self.text)
        return change(state, lines=(*state.desk.lines, line)[-MOST_LINES:])


# Export


@dataclass(frozen=True)
class EditForm:
    """The export dialog as the person left it; a new kind takes its own ending."""

    form: ExportForm

    def apply(self, state: State) -> State:
        old, form = state.desk.form, self.form
        if form.what is not old.what and form.path.lower().endswith(old.what.suffix):
            form = replace(form, path=form.path[: -len(old.what.suffix)] + form.what.suffix)
        return change(state, form=form)


@dataclass(frozen=True)
class ShowExport:
    """Open the export dialog, with a place to write to."""

    def apply(self, state: State) -> State:
        if state.info is None:
            text = "There is no scene to export; drop photos on the window first."
            return Notify(text).apply(state)
        form = state.desk.form
        if not form.path:
            form = replace(form, path=str(_place(state).with_suffix(What.RGB.suffix)))
        selected = form.only_selected and state.editing.num_selected > 0
        state = change(state, form=replace(form, only_selected=selected))
        return replace(state, dialog="export")


@dataclass(frozen=True)
class Export:
    """Do what the form says."""

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class ExportBegan:
    """The command runs."""

    target: Path

    def apply(self, state: State) -> State:
        return change(replace(state, dialog=None), exporting=Exporting(self.target))


@dataclass(frozen=True)
class ExportProgressed:
    """A stage and the fraction of the whole."""

    stage: str
    fraction: float

    def apply(self, state: State) -> State:
        now = state.desk.exporting
        if now is None:
            return state
        fraction = min(max(self.fraction, 0.0), 1.0)
        return change(state, exporting=replace(now, stage=self.stage, fraction=fraction))


@dataclass(frozen=True)
class CancelExport:
    """Stop it; nothing is written."""

    def apply(self, state: State) -> State:
        now = state.desk.exporting
        return state if now is None else change(state, exporting=replace(now, cancelling=True))


@dataclass(frozen=True)
class ExportEnded:
    """code: 0 done. said: the command's own words. error: its sentence."""

    code: int
    said: str
    error: str

    def apply(self, state: State) -> State:
        was = state.desk.exporting
        state = change(state, exporting=None)
        if was is not None and was.cancelling and self.code != 0:
            return Notify("The export was stopped; nothing was written.", "info").apply(state)
        if self.code == 0:
            return Notify(f"Exported {self.said}", "info").apply(state)
        return Notify(self.error or f"The export failed (code {self.code}).").apply(state)


@dataclass(frozen=True)
class CopyAt:
    """Where the scene on show is kept until somebody saves it."""

    path: Path

    def apply(self, state: State) -> State:
        return change(state, copy=self.path)


@dataclass(frozen=True)
class CopiesAt:
    """Where the export reads a scene with unsaved edits, and its selection; None: there are none."""

    edited: Path | None
    selection: Path | None

    def apply(self, state: State) -> State:
        return change(state, edited=self.edited, selection=self.selection)


# A session that ended badly


@dataclass(frozen=True)
class OfferSession:
    """It can be had back."""

    kept: Kept

    def apply(self, state: State) -> State:
        return change(state, offer=self.kept)


@dataclass(frozen=True)
class EndSessionOffer:
    """Take the offer, or turn it down for good."""

    restore: bool

    def apply(self, state: State) -> State:
        kept = state.desk.offer
        state = change(state, offer=None)
        if kept is None or not self.restore:
            return state
        photos = tuple(Photo(Path(path), fov=fov) for path, fov in zip(kept.photos, kept.fovs, strict=True))
        return restored_phrases(replace(state, photos=photos), kept)


def restored_phrases(state: State, kept: Kept) -> State:
    """The phrases of a kept session in rows of their own."""
    from app.window.state import PALETTE

    rows = []
    for text in kept.phrases:
        colour = PALETTE[len(rows) % len(PALETTE)]
        rows.append(Prompt(state.next_key + len(rows), text, colour))
    if not rows:
        return state
    return replace(state, prompts=tuple(rows), active=rows[0].key, next_key=state.next_key + len(rows))


@dataclass(frozen=True)
class StandAgain:
    """The camera and the mode of a kept session, once its scene is there. name: what it was called;
    saved: whether its file is the person's own."""

    pose: Pose | None
    mode: str
    name: str
    saved: bool

    def apply(self, state: State) -> State:
        from app.window.state import Mode

        if state.info is None:
            return state
        info = state.info if self.saved else replace(state.info, name=self.name, path=None)
        mode = Mode[self.mode] if self.mode in Mode.__members__ else state.mode
        pose = self.pose or state.pose
        view = state.view if pose == state.pose else None
        return replace(state, info=info, mode=mode, pose=pose, view=view)


def _place(state: State) -> Path:
    """Beside the scene, or beside its first photo, by a name of its own."""
    assert state.info is not None
    beside = state.info.path
    if beside is None:
        beside = state.photos[0].path if state.photos else Path.home() / "scene"
    return beside.with_name(f"{beside.stem}_view")


def _change_photo(state: State, path: Path, **changes: Any) -> State:
    photos = (replace(photo, **changes) if photo.path == path else photo for photo in state.photos)
    return replace(state, photos=tuple(photos))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
