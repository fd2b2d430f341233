"""What must last: preferences from one day to the next; the session and its unsaved edits over a crash.

Small files are written by a thread of one, because waiting for a disk is no business of a frame; scenes
and edits by the worker, which has the library.
"""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from langflash_core.errors import LangFlashError
from langflash_core.scene.edits import History

from ..commands import Command, Log, Notify
from ..effects import Effects, Hands
from ..requests import Task
from ..scene.commands import (
    Instead,
    JobCancelled,
    JobFailed,
    OpenPaths,
    OpenScene,
    Reconstruct,
    SceneArrived,
    SceneSaved,
    scene_photos,
)
from ..scene.drops import SCENE_SUFFIX
from ..scene.state import SceneInfo
from ..scene.work import MakeThumbnails
from ..state import State
from . import edits, preferences, records
from .commands import (
    CopyAt,
    CopyKept,
    EditsKept,
    EndOffer,
    EndSessionOffer,
    GoOnWith,
    OfferSession,
    Opened,
    OpenProject,
    Prefer,
    StandAgain,
    StandAsLeft,
    kept_photos,
    kept_session,
)
from .preferences import Preferences
from .records import Keeper
from .state import Kept, Offer
from .work import Forget, KeepCopy, KeepEdits, LookForEdits, ReadProjects

KEEP_AFTER = 1.0  # seconds without a change before a record or edits are written, so that a burst is once
SAVE_AFTER = 0.5  # the same for preferences
NEVER = float("inf")
NOT_SAVED, NOT_REMEMBERED = "The session could not be saved", "What was open could not be remembered"


class Writer:
    """A thread of one that writes small files."""

    def __init__(self, hands: Hands) -> None:
        self._hands = hands
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="langflash-writer")

    def __call__(self, work: Callable[..., object], *of: Any, failed: str = NOT_SAVED) -> Future:
        """Do `work` in turn; what goes wrong is logged."""
        return self._thread.submit(self._done, failed, work, *of)

    def _done(self, failed: str, work: Callable[..., object], *of: Any) -> None:
        try:
            work(*of)
        except LangFlashError as error:
            self._hands.dispatch(Log("error", f"{failed}: {error}."))

    def close(self) -> None:
        """Once all is written."""
        self._thread.shutdown()


class RecoveryEffects(Effects):
    """The one keeper of records, edits and preferences."""

    def __init__(self, hands: Hands, keeper: Keeper) -> None:
        self._hands = hands
        self._keeper = keeper
        self._write = Writer(hands)
        self._wanted: Kept | None = None  # the record whose scene is being opened
        self._restoring_edits: Path | None = None  # a file of edits that comes with it
        self._outlived: Path | None = None  # a restored session that goes once this one has its own
        self._copied = False  # whether the copy of an unsaved scene is complete
        self._edits_kept = False  # whether edits of the scene on show lie on the disk
        self._edits_wrote = False  # or have ever, and what removes them may not have come to it
        self._replaced: list[Task] = []  # forget what goes once the same edits are written elsewhere
        self._snapshot: tuple = ()
        self._saved: Preferences | None = None  # the preferences that this window found, or wrote last
        self._keep_at = self._keep_edits_at = self._save_at = NEVER

    def begin(self, loaded: Preferences, sentence: str, empty: bool) -> None:
        """The first commands of a window. empty: it opens without photos or a scene."""
        self._hands.perform(Prefer(loaded))
        self._saved, self._save_at = loaded, NEVER
        if sentence:
            self._hands.perform(Notify(sentence))
        kept = records.left_behind(loaded.recent)
        if kept is not None:
            self._hands.perform(OfferSession(kept))
        elif empty:  # a session holds its edits
            self._hands.submit(LookForEdits(0))
        self._hands.submit(ReadProjects(loaded.recent))

    # Time

    @property
    def due(self) -> float:
        """When the next thing has rested long enough."""
        return min(self._keep_at, self._keep_edits_at, self._save_at)

    def tick(self, state: State, now: float) -> None:
        """Write what has rested long enough."""
        if now >= self._keep_edits_at:
            self._settle(state)
        if now >= self._save_at:
            self._save_at = NEVER
            self._write(self._save, state.preferences)
        if now >= self._keep_at:
            self._keep_at = NEVER
            self._write(self._keeper.keep, self._kept(state))

    def close(self, state: State, crashed: bool) -> None:
        """Write what is still to write: edits that a saved file would miss, always; the record after a
        crash, to be offered again, or else how the scene was left."""
        self._close_edits(state)
        if self._save_at < NEVER:
            self._write(self._save, state.preferences)
        if crashed:
            self._write(self._keeper.keep, self._kept(state))
        else:
            self._leave(state)
        self._write.close()
        if not crashed:
            self._keeper.close()

    def _close_edits(self, state: State) -> None:
        info, history = state.scene.info, state.editing.history
        if info is None or history is None:
            return
        try:
            if state.editing.unsaved and history.done:
                edits.keep(info.scene, history, info.name, info.path, self._keeper.token, _photos(state))
            elif self._edits_wrote or history.done:
                edits.forget_edits(info.scene, self._keeper.token)
        except LangFlashError:
            return  # there is no window left to say it in

    # Commands

    def follow(self, command: Command, before: State, state: State) -> None:
        """What a command asks of the disk, at once or a while after the last change."""
        if before.scene.info is not None and _path(before) != _path(state):
            self._leave(before)
        match command:
            case OpenProject(path):
                known = os.path.isfile(path)
                self._hands.perform(
                    Instead((GoOnWith(records.project(path)),)) if known else OpenPaths((path,))
                )
            case GoOnWith(kept):
                self._open(kept, alone=True)
            case OpenScene(_, kept_edits):
                self._wanted, self._restoring_edits = None, kept_edits
            case Reconstruct() | JobFailed() | JobCancelled():
                self._wanted = None
            case SceneArrived(info, replaces=replaces):
                self._take_edits(info, before, state, replaces)
                self._take_record(info, state)
            case SceneSaved(path):
                self._settle(state)
                self._forget_unhidden(before)
                self._hands.perform(Opened(path))
            case CopyKept(path) if path == self._keeper.scene_file:
                self._copied = True
                self._snapshot = ()  # the record now has a scene to name
                self._drop_outlived(state)
            case EditsKept(file) if file is not None and self._outlived is None:
                for task in self._replaced:
                    self._hands.submit(task)
                self._replaced = []
            case EndSessionOffer(restore) if before.recovery.session is not None:
                self._end_session_offer(before.recovery.session, restore, state)
            case EndOffer(restore, forget) if before.recovery.edits is not None:
                self._end_offer(before.recovery.edits, restore, forget)
            case _:
                pass
        self._note_changes(before, state)

    def _forget_unhidden(self, before: State) -> None:
        """With what was hidden saved, nothing that this program keeps shows it any more."""
        room, files = before.scene.unhidden, before.scene.shown_by
        if room is None and not files:
            return
        self._copied = False
        shown = None if room is None else room.info.scene
        self._hands.submit(Forget(partial(edits.forget_scene, shown, files, self._keeper.copies)))

    def _note_changes(self, before: State, state: State) -> None:
        if state.editing.marks != before.editing.marks and state.scene.info is before.scene.info:
            self._keep_edits_at = state.now + KEEP_AFTER
        if state.preferences != before.preferences:
            self._save_at = state.now + SAVE_AFTER
            if set(before.preferences.recent) - set(state.preferences.recent):
                self._write(records.forget_others, state.preferences.recent, records.RECORD)
        snapshot = _snapshot(state)
        if snapshot != self._snapshot:
            self._snapshot, self._keep_at = snapshot, state.now + KEEP_AFTER

    # Edits

    def _take_edits(self, info: SceneInfo, before: State, state: State, replaces: bool) -> None:
        """Keep those of the scene before, unless they are those of the scene that has come as well; those are
        restored or looked for."""
        if not replaces and before.scene.info is not None and before.editing.unsaved and before.editing.dirty:
            self._keep_edits(before)
            if (
                before.scene.info.path is None
                or before.editing.history is None
                or before.editing.history.done
            ):
                text = f"The edits of {before.scene.info.name} are kept; go back to it to continue."
                self._hands.perform(Notify(text, "info"))
        self._edits_kept, self._edits_wrote, self._keep_edits_at = False, False, NEVER
        self._replaced = []
        restored, self._restoring_edits = self._restoring_edits, None
        edited = info.history is not None and bool(info.history.done)  # restored, or a room of this session
        if info.history is not None and edited:
            self._write_edits(info, info.history, state)
            if restored is not None and not self._keeper.own(restored):
                self._replaced.append(Forget(partial(records.forget, restored)))
        else:
            self._hands.submit(LookForEdits(info.serial, info.scene, info.path))
        if replaces and before.scene.info is not None:
            task = self._forget_edits(before.scene.info)
            if edited:  # the same edits are to lie beside this scene
                self._replaced.append(task)
            else:  # something was hidden for good: nothing is kept that shows it
                self._hands.submit(task)

    def _end_offer(self, offer: Offer, restore: bool, forget: bool) -> None:
        if restore:
            self._make_thumbnails(path for path, _ in offer.photos)
            self._hands.perform(OpenScene(offer.scene, offer.edits))
        elif forget:
            self._hands.submit(Forget(partial(records.forget, offer.edits)))

    def _settle(self, state: State) -> None:
        """On the disk lies what is not saved, and nothing once all is."""
        self._keep_edits_at = NEVER
        if state.editing.dirty:
            self._keep_edits(state)
        elif self._edits_kept and state.scene.info is not None:
            self._hands.submit(self._forget_edits(state.scene.info))
            self._hands.perform(EditsKept(None))
            self._edits_kept = False

    def _forget_edits(self, info: SceneInfo) -> Forget:
        return Forget(partial(edits.forget_edits, info.scene, self._keeper.token))

    def _keep_edits(self, state: State) -> None:
        info, history = state.scene.info, state.editing.history
        if info is not None and history is not None and history.done:
            self._write_edits(info, history, state)

    def _write_edits(self, info: SceneInfo, history: History, state: State) -> None:
        place = (info.name, info.path, self._keeper.token, _photos(state))
        self._hands.submit(KeepEdits(info.serial, info.scene, history, *place))
        self._edits_kept = self._edits_wrote = True

    # Records

    def _open(self, kept: Kept, alone: bool = False) -> None:
        """Read the scene of a record, to stand in it as it says."""
        kept_edits = Path(kept.edits) if kept.edits else None
        scene = Path(kept.scene) if kept_edits is None else kept_edits.with_suffix(SCENE_SUFFIX)
        self._hands.perform(OpenScene(scene, kept_edits, alone))
        self._wanted = kept

    def _take_record(self, info: SceneInfo, state: State) -> None:
        """Stand where the record stood; a scene that has no file of its own gets a copy."""
        kept, self._wanted = self._wanted, None
        session = None if kept is None else kept.file
        unsaved = info.path is None
        if kept is not None and (kept.edits or str(info.path) == kept.scene):
            self._hands.perform(StandAsLeft(kept) if session is None else StandAgain(kept))
            unsaved = not kept.saved
            if session is None:
                self._make_thumbnails(kept.photos)
        if info.path is not None and not unsaved:
            self._hands.perform(Opened(info.path))
        self._copied = False
        if unsaved:
            self._hands.perform(CopyAt(self._keeper.scene_file))
            first = None if info.history is None else info.history.first
            self._hands.submit(KeepCopy(info.serial, info.scene, self._keeper.scene_file, first))
        if session is not None:
            self._outlived = session
        if not unsaved:
            self._drop_outlived(state)

    def _drop_outlived(self, state: State) -> None:
        """The restored session's files go once this one has its own, which is written first; so do edits
        that it names, once they are kept anew."""
        if self._outlived is not None:
            kept = self._kept(state)
            replaced, self._replaced = (self._replaced, []) if kept.edits else ([], self._replaced)
            self._write(self._replace, kept, self._outlived, replaced)
            self._outlived = None

    def _end_session_offer(self, kept: Kept, restore: bool, state: State) -> None:
        if restore:
            self._make_thumbnails(kept.photos)
        if restore and kept.scene:
            self._open(kept)
        else:
            self._write(records.close, kept, state.preferences.recent)

    def _leave(self, state: State) -> None:
        """The scene on show is left: so its project is opened again."""
        if str(_path(state)) in state.preferences.recent:
            left = kept_session(state, _path(state)).closed()
            self._write(records.keep_project, left, failed=NOT_REMEMBERED)

    def _kept(self, state: State) -> Kept:
        return kept_session(state, _path(state) or (self._keeper.scene_file if self._copied else None))

    def _make_thumbnails(self, photos: Iterable[str]) -> None:
        paths = tuple(map(Path, photos))
        if paths:
            self._hands.submit(MakeThumbnails(paths))

    # What the writer's thread does

    def _save(self, wanted: Preferences) -> None:
        problem = preferences.try_to_save(wanted, self._saved)
        if problem:
            self._hands.dispatch(Notify(problem))
        else:
            self._saved = wanted

    def _replace(self, kept: Kept, outlived: Path, replaced: Iterable[Task]) -> None:
        self._keeper.keep(kept)
        records.forget(outlived)
        for task in replaced:
            list(task.run(lambda: False))


def _path(state: State) -> Path | None:
    return None if state.scene.info is None else state.scene.info.path


def _photos(state: State) -> tuple[tuple[str, float | None], ...]:
    """Of the scene on show, to be kept with its edits."""
    return kept_photos(scene_photos(state))


def _snapshot(state: State) -> tuple[Any, ...]:
    """What a change of must be kept."""
    where = None if state.scene.info is None else (state.scene.info.serial, state.scene.info.path)
    phrases = tuple((p.text, p.like, p.threshold, p.colour, p.visible) for p in state.asking.prompts)
    photos = tuple((photo.path, photo.fov) for photo in state.scene.photos)
    return photos, where, phrases, state.scene.mode, state.scene.pose, state.recovery.kept
