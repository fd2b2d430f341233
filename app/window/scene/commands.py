"""What can happen to the tray and to the scene: photos, files, the jobs that make scenes."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from langflash_core.geometry import poses
from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.images.still_names import shown_name
from langflash_core.scene.edits import Marks

from ..commands import NOTHING_TO_SAVE, Command, Notify, ShowDialog
from ..dialogs import Dialog
from ..editing.state import fresh
from ..filming.state import NO_FILMING
from ..governor import Around
from ..protocol import Outward
from ..state import State
from .memory import SceneMemory
from .near import first_stand
from .state import (
    MOMENTS,
    MOST_ROOMS,
    PAUSED,
    RECONSTRUCTING,
    RESTORING,
    Job,
    Photo,
    Room,
    SceneInfo,
    TakenOut,
    head_of,
)
from .unfinished import FEWEST

if TYPE_CHECKING:
    from langflash_core.types import Scene

    from ...gl.scene import Thinned as Fewer


# Photos


@dataclass(frozen=True)
class AddPhotos:
    """Append photos to the tray, each once, up to what the network takes."""

    paths: tuple[Path, ...]

    def apply(self, state: State) -> State:
        known = {p.path for p in state.scene.photos}
        fresh = tuple(Photo(p) for p in dict.fromkeys(self.paths) if p not in known)
        photos, most = (*state.scene.photos, *fresh), PHOTO_LIMITS.max_photos
        after, left = state.with_scene(photos=photos[:most]), len(photos) - most
        if left > 0:
            text = f"{left} photos were left out: a scene takes at most {most}; clear the tray first."
            after = Notify(text).apply(after)
        return after


@dataclass(frozen=True)
class RemovePhoto:
    """Take a photo out of the tray."""

    index: int

    def apply(self, state: State) -> State:
        photos = state.scene.photos
        return _with_fewer(state, photos[: self.index] + photos[self.index + 1 :])


@dataclass(frozen=True)
class ClearPhotos:
    """Empty the tray; the scene stays."""

    def apply(self, state: State) -> State:
        return _with_fewer(state, ())


def _with_fewer(state: State, photos: tuple[Photo, ...]) -> State:
    """These photos of the tray alone; the others can be put back."""
    old = state.scene
    if len(photos) == len(old.photos):
        return state
    before = old.taken_out if old.num_taken_out else None
    left = tuple(photo.path for photo in photos)
    taken = TakenOut(old.photos, left, state.editing.history, before)
    return state.with_scene(photos=photos, taken_out=taken)


@dataclass(frozen=True)
class PutPhotosBack:
    """The tray as it was before photos were last taken out of it."""

    def apply(self, state: State) -> State:
        taken = state.scene.taken_out
        if taken is None or not state.scene.num_taken_out:
            return state
        here = {photo.path: photo for photo in state.scene.photos}
        photos = tuple(here.get(photo.path, photo) for photo in taken.photos)
        return state.with_scene(photos=photos, taken_out=taken.before)


@dataclass(frozen=True)
class SetPhotosAside:
    """Empty the tray for a new room; the photos come back where it cannot be made."""

    def apply(self, state: State) -> State:
        return state.with_scene(photos=(), aside=scene_photos(state))


@dataclass(frozen=True)
class PhotoFailed:
    """A photo could not be read for its thumbnail."""

    path: Path
    problem: str

    def apply(self, state: State) -> State:
        return _change_photo(state, self.path, problem=self.problem)


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
        if not 0 <= self.index < len(state.scene.photos):
            return state
        fov = None if self.fov is None else min(max(self.fov, poses.FOV_RANGE[0]), poses.FOV_RANGE[1])
        return _change_photo(state, state.scene.photos[self.index].path, fov=fov)


@dataclass(frozen=True)
class MovePhoto:
    """Take the photo at `index` to `place`; the first one's camera becomes the world."""

    index: int
    place: int

    def apply(self, state: State) -> State:
        photos = list(state.scene.photos)
        if not 0 <= self.index < len(photos):
            return state
        photo = photos.pop(self.index)
        photos.insert(min(max(self.place, 0), len(photos)), photo)
        return state.with_scene(photos=tuple(photos))


@dataclass(frozen=True)
class ChoosePair:
    """Look for the two photos that make the best scene."""

    def apply(self, state: State) -> State:
        if len(state.scene.photos) < 3:
            text = "Choosing needs three or more photos; drop some on the window."
            return Notify(text).apply(state)
        return state.with_scene(choosing=True)


@dataclass(frozen=True)
class PairChosen:
    """The best pair of `paths`, or none; the others leave the tray, and can be put back."""

    paths: tuple[Path, ...]
    pair: tuple[int, int] | None

    def apply(self, state: State) -> State:
        state = state.with_scene(choosing=False)
        if state.scene.paths != self.paths:
            return state  # the tray has changed meanwhile: the answer is about other photos
        if self.pair is None:
            text = "No two of these photos match; take photos that share at least a third of the picture."
            return Notify(text).apply(state)
        chosen = tuple(state.scene.photos[index] for index in self.pair)
        names, others = " and ".join(shown_name(photo.path.name) for photo in chosen), len(self.paths) - 2
        text = f"Kept {names}. Ctrl+Z puts the other {'one' if others == 1 else others} back."
        return Notify(text, "info").apply(_with_fewer(state, chosen))


@dataclass(frozen=True)
class ChoosingFailed:
    """The search for a pair ended without an answer."""

    sentence: str

    def apply(self, state: State) -> State:
        return Notify(self.sentence).apply(state.with_scene(choosing=False))


# Scenes


@dataclass(frozen=True)
class Reconstruct:
    """Make a scene of the photos in the tray; replaces a job under way."""

    def apply(self, state: State) -> State:
        if not state.scene.photos:
            return Notify("There is no photo to reconstruct; drop two photos on the window.").apply(state)
        pausable = len(state.scene.photos) >= FEWEST
        resumed = pausable and state.scene.goes_on
        job = Job(RECONSTRUCTING, "starting", started=state.now, pausable=pausable, resumed=resumed)
        return state.with_scene(job=job, unfinished=())


@dataclass(frozen=True)
class OpenScene:
    """Read a scene file; replaces a job under way. edits: kept by an earlier session. alone: the photos in
    the tray are not its own and go when it comes."""

    path: Path
    edits: Path | None = None
    alone: bool = False

    def apply(self, state: State) -> State:
        title = RESTORING if self.edits else f"Opening {self.path.name}"
        return state.with_scene(job=Job(title, "reading", started=state.now))


@dataclass(frozen=True)
class SaveScene:
    """Write the scene on show to `path`."""

    path: Path

    def apply(self, state: State) -> State:
        if state.scene.info is None:
            return Notify(NOTHING_TO_SAVE).apply(state)
        return replace(state, dialog=None)


@dataclass(frozen=True)
class OpenPaths:
    """Paths from the open dialog, the command line, the clipboard; or dropped on the window: a scene that was
    `dropped` on another may belong to it."""

    paths: tuple[str, ...]
    dropped: bool = False

    def apply(self, state: State) -> State:
        return replace(state, dialog=None)


@dataclass(frozen=True)
class Loaded(Outward):
    """The worker has loaded what drawing needs: while there is no scene, shaders can be compiled."""


@dataclass(frozen=True)
class SceneArrived:
    """A scene is ready: show it from its first view, ask every prompt again; the one before is a room to go
    back to. alone: see `OpenScene`. room: as it was left, where it was on show before. replaces: it is the
    scene on show with more in it, and that one is no room."""

    info: SceneInfo
    alone: bool = False
    room: Room | None = None
    replaces: bool = False

    def apply(self, state: State) -> State:
        others = state.scene.rooms if self.replaces else _rooms(state, self.info)
        state = self._shown(state).with_scene(rooms=others)
        if self.room is None:
            return state
        room, views = self.room, self.info.views
        view = views.index(room.pose) if room.pose in views else None
        return state.with_editing(saved=room.saved).with_scene(
            photos=room.photos, pose=room.pose, view=view, unhidden=room.unhidden, shown_by=room.shown_by
        )

    def _shown(self, state: State) -> State:
        old, info, asking = state.scene, self.info, state.asking.without_scene()
        made = old.job is not None and old.job.title == RECONSTRUCTING
        saved = None if info.history is None else info.history.first
        start = first_stand(info, None if info.history is None else info.history.marks.world)
        return replace(
            state,
            scene=replace(
                old,
                info=info,
                photos=() if self.alone else old.photos,
                taken_out=old.taken_out if made or self.replaces else None,
                aside=None,
                pose=start,
                flight=None,
                hold=None,
                view=0 if info.views and start == info.views[0] else None,
                unhidden=None,
                shown_by=(),
                mute=None,
                job=None,
            ),
            asking=replace(asking, named=made and not asking.asked),
            editing=fresh(state.editing, info.history, saved, same=self.replaces),
            filming=NO_FILMING,
            listing=state.listing.without_scene(),
            recovery=replace(state.recovery, edits=None, kept=None),
        )


def room_of(state: State, info: SceneInfo) -> Room:
    """The scene on show as it is left, `info`, to go back to."""
    scene, editing = state.scene, state.editing
    hidden = scene.unhidden, scene.shown_by
    return Room(info, scene.photos, editing.history, editing.saved, scene.pose, *hidden)


def _rooms(state: State, coming: SceneInfo) -> tuple[Room, ...]:
    """Those to go back to once `coming` is on show; the same file twice only where there are edits."""
    info, left = state.scene.info, ()
    if info is not None:
        rested = replace(info, memory=SceneMemory(info.scene))  # one not on show holds its scene alone
        left = (replace(room_of(state, rested), photos=scene_photos(state)),)
    rooms = (room for room in (*left, *state.scene.rooms) if room.info.serial != coming.serial)
    kept = (room for room in rooms if room.edited or room.info.path is None or room.info.path != coming.path)
    return tuple(kept)[:MOST_ROOMS]


@dataclass(frozen=True)
class Thinned(Outward):
    """A share of the scene's Gaussians for a moving camera is made (scene/thin.py), of a huge scene around
    a place."""

    scene: "Scene" = field(compare=False, repr=False)
    share: float
    thinned: "Fewer" = field(compare=False, repr=False)
    around: Around | None = None


@dataclass(frozen=True)
class GoToRoom(Outward):
    """Back to the scene with this number, which was on show before."""

    serial: int


# What takes the place of the scene on show


@dataclass(frozen=True)
class Instead:
    """Commands that replace the scene on show; asks first where edits are not saved."""

    commands: tuple[Command, ...]

    def apply(self, state: State) -> State:
        asks = state.scene.info is not None and state.editing.unsaved
        return replace(state.with_scene(pending=self.commands), dialog=Dialog.UNSAVED if asks else None)


@dataclass(frozen=True)
class GoOn:
    """Do what has waited, edits saved or not."""

    def apply(self, state: State) -> State:
        return replace(state.with_scene(pending=()), dialog=None)


@dataclass(frozen=True)
class SaveFirst:
    """Save, and go on once that is done."""

    def apply(self, state: State) -> State:
        return ShowDialog(Dialog.SAVE).apply(state).with_scene(pending=state.scene.pending)


@dataclass(frozen=True)
class AskAboutDrop:
    """Photos were dropped on a scene: do they belong to it? Or a scene: is it to be opened, or merged?"""

    paths: tuple[Path, ...]
    dialog: Dialog

    def apply(self, state: State) -> State:
        return replace(state.with_scene(dropped=self.paths), dialog=self.dialog)


def try_out(photos: tuple[Path, ...]) -> Command:
    """A new room of these photos."""
    return Instead((SetPhotosAside(), AddPhotos(photos), Reconstruct()))


def dropped(state: State, photos: tuple[Path, ...], new: bool) -> Command:
    """What takes dropped photos into the tray, alone for a `new` room, and reconstructs where the person
    wants that at once."""
    taken: tuple[Command, ...] = (*((SetPhotosAside(),) if new else ()), AddPhotos(photos))
    return Instead((*taken, Reconstruct())) if state.preferences.start_at_once else All(taken)


@dataclass(frozen=True)
class All:
    """Several commands, one after the other."""

    commands: tuple[Command, ...]

    def apply(self, state: State) -> State:
        return replace(state, dialog=None)


@dataclass(frozen=True)
class SceneSaved:
    """The scene on show, edited up to `marks`, now lives at `path`."""

    path: Path
    marks: Marks | None = None

    def apply(self, state: State) -> State:
        info = state.scene.info
        info = None if info is None else replace(info, path=self.path, name=self.path.name)
        state = state.with_scene(info=info, rooms=self._others(state), unhidden=None, shown_by=())
        state = state.with_editing(saved=self.marks or state.editing.saved)
        return Notify(f"Saved {self.path}", "info").apply(state)

    def _others(self, state: State) -> tuple[Room, ...]:
        """Rooms without those that show what is hidden in the file."""
        if state.scene.unhidden is None and not state.scene.shown_by:
            return state.scene.rooms
        paths = {*state.scene.shown_by, self.path}
        return tuple(room for room in state.scene.rooms if room.info.path not in paths)


# The job under way


@dataclass(frozen=True)
class CancelJob:
    """Ask the job to stop; it ends after its present stage. What was resumed moments ago is paused again:
    nobody means to lose at once what they kept."""

    def apply(self, state: State) -> State:
        job = state.scene.job
        if job is None:
            return state
        pausing = job.pausing or (job.resumed and job.age(state.now) < MOMENTS)
        return state.with_scene(job=replace(job, cancelling=True, pausing=pausing))


@dataclass(frozen=True)
class PauseJob:
    """As `CancelJob`, but what is done stays, and the photos in the tray."""

    def apply(self, state: State) -> State:
        job = state.scene.job
        if job is None or not job.pausable:
            return state
        return state.with_scene(job=replace(job, cancelling=True, pausing=True))


@dataclass(frozen=True)
class WorkFound:
    """Whether work on these photos was begun and kept."""

    paths: tuple[Path, ...]
    there: bool

    def apply(self, state: State) -> State:
        if state.scene.paths != self.paths:
            return state
        return state.with_scene(unfinished=self.paths if self.there else ())


@dataclass(frozen=True)
class Progressed:
    """A stage of the job, 0 to 1; a new stage files the last one with its seconds."""

    stage: str
    fraction: float

    def apply(self, state: State) -> State:
        job = state.scene.job
        if job is None:
            return state
        fraction = min(max(self.fraction, 0.0), 1.0)
        if head_of(self.stage) != head_of(job.stage):  # not the same at another of its photos
            done = (*job.done, (head_of(job.stage), state.now - job.started))
            job = replace(job, started=state.now, done=done)
        return state.with_scene(job=replace(job, stage=self.stage, fraction=fraction))


@dataclass(frozen=True)
class JobFailed:
    """The job ended without a scene; a sentence with a remedy."""

    sentence: str

    def apply(self, state: State) -> State:
        return Notify(self.sentence).apply(_ended(state))


@dataclass(frozen=True)
class JobCancelled:
    """The job ended because the person stopped it."""

    def apply(self, state: State) -> State:
        job = state.scene.job
        if job is None or not job.pausing:
            return Notify("Stopped.", "info").apply(_ended(state.with_scene(unfinished=())))
        return Notify(PAUSED, "info").apply(state.with_scene(job=None, unfinished=state.scene.paths))


def _ended(state: State) -> State:
    """Without its job; where that was to make a new room, or to restore one, the tray is that of the scene on
    show again."""
    if state.scene.job is not None and state.scene.job.title not in (RECONSTRUCTING, RESTORING):
        return state.with_scene(job=None)
    return state.with_scene(job=None, photos=scene_photos(state), aside=None)


def scene_photos(state: State) -> tuple[Photo, ...]:
    """Those of the scene on show, while the tray may hold a new room's."""
    return state.scene.photos if state.scene.aside is None else state.scene.aside


def _change_photo(state: State, path: Path, **changes: Any) -> State:
    photos = (replace(photo, **changes) if photo.path == path else photo for photo in state.scene.photos)
    return state.with_scene(photos=tuple(photos))
