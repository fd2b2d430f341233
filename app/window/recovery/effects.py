"""What must last: preferences from one day to the next; the session and its unsaved edits over a crash.

Small files are written by a thread of one, because waiting for a disk is no business of a frame; scenes
and edits by the worker, which has the library.
"""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from langflash_core.errors import LangFlashError
from langflash_core.scene.edits import History

from ..commands import Command, Log, Notify
from ..effects import Effects, Hands
from ..requests import Task
from ..scene.commands import OpenScene, Reconstruct, SceneArrived, SceneSaved
from ..scene.drops import SCENE_SUFFIX
from ..scene.state import SceneInfo
from ..scene.work import MakeThumbnails
from ..state import State
from . import preferences, sessions
from .commands import (
    CopyAt,
    CopyKept,
    EditsKept,
    EndOffer,
    EndSessionOffer,
    OfferSession,
    Opened,
    Prefer,
    StandAgain,
    kept_photos,
    kept_session,
)
from .keeper import Keeper
from .preferences import Preferences
from .state import Kept, Offer
from .work import ForgetEdits, ForgetFile, ForgetScene, KeepCopy, KeepEdits, LookForEdits

KEEP_AFTER = 1.0  # seconds without a change before a session or edits are written, so that a burst is once
SAVE_AFTER = 0.5  # the same for preferences
NEVER = float("inf")


class RecoveryEffects(Effects):
    """The one keeper of sessions, edits and preferences."""

    def __init__(self, hands: Hands, keeper: Keeper) -> None:
        self._hands = hands
        self._keeper = keeper
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="langflash-writer")
        self._wanted: Kept | None = None  # the session whose scene is to be opened
        self._restoring: Kept | None = None  # and whose scene is being opened
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
        kept = sessions.left_behind()
        if kept is not None:
            self._hands.perform(OfferSession(kept))
        elif empty:  # a session holds its edits
            self._hands.submit(LookForEdits(0))

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
            self._writer.submit(self._save, state.preferences)
        if now >= self._keep_at:
            self._keep_at = NEVER
            self._writer.submit(self._keep, self._kept(state))

    def close(self, state: State, crashed: bool) -> None:
        """Write what is still to write: edits that a saved file would miss, always; the session after a
        crash, to be offered again."""
        self._close_edits(state)
        if self._save_at < NEVER:
            self._writer.submit(self._save, state.preferences)
        if crashed:
            self._writer.submit(self._keep, self._kept(state))
        self._writer.shutdown()
        if not crashed:
            self._keeper.close()

    def _close_edits(self, state: State) -> None:
        info, history = state.scene.info, state.editing.history
        if info is None or history is None:
            return
        try:
            if state.editing.unsaved and history.done:
                self._keeper.keep_edits(info, history, kept_photos(state))
            elif self._edits_wrote or history.done:
                self._keeper.forget_edits(info)
        except LangFlashError:
            return  # there is no window left to say it in

    # Commands

    def follow(self, command: Command, before: State, state: State) -> None:
        """What a command asks of the disk, at once or a while after the last change."""
        match command:
            case OpenScene(_, edits):
                self._restoring, self._wanted, self._restoring_edits = self._wanted, None, edits
            case Reconstruct():
                self._restoring, self._wanted = self._wanted, None
            case SceneArrived(info, replaces=replaces):
                self._arrived(info, before, state, replaces)
            case SceneSaved(path):
                self._settle(state)
                self._forget_unhidden(before)
                self._hands.perform(Opened(path))
            case CopyKept(path) if path == self._keeper.scene_file:
                self._copied = True
                self._snapshot = ()  # the session now has a scene to name
                self._drop_outlived(state)
            case EditsKept(file) if file is not None and self._outlived is None:
                for task in self._replaced:
                    self._hands.submit(task)
                self._replaced = []
            case EndSessionOffer(restore) if before.recovery.session is not None:
                self._end_session_offer(before.recovery.session, restore)
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
        copies = tuple(self._keeper.copies)
        self._hands.submit(ForgetScene(None if room is None else room.info.scene, files, copies))

    def _note_changes(self, before: State, state: State) -> None:
        if state.editing.marks != before.editing.marks and state.scene.info is before.scene.info:
            self._keep_edits_at = state.now + KEEP_AFTER
        if state.preferences != before.preferences:
            self._save_at = state.now + SAVE_AFTER
        snapshot = _snapshot(state)
        if snapshot != self._snapshot:
            self._snapshot, self._keep_at = snapshot, state.now + KEEP_AFTER

    def _arrived(self, info: SceneInfo, before: State, state: State, replaces: bool) -> None:
        self._take_edits(info, before, state, replaces)
        self._take_session(info, state)

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
        if info.history is not None and info.history.done:  # restored, or a room of this session
            self._write_edits(info, info.history, state)
            if restored is not None and not self._keeper.own(restored):
                self._replaced.append(ForgetFile(restored))
        else:
            self._hands.submit(LookForEdits(info.serial, info.scene, info.path))
        if replaces and before.scene.info is not None:
            task = ForgetEdits(before.scene.info.scene, self._keeper.token)
            if info.history is not None and info.history.done:  # the same edits are to lie beside this scene
                self._replaced.append(task)
            else:  # something was hidden for good: nothing is kept that shows it
                self._hands.submit(task)

    def _end_offer(self, offer: Offer, restore: bool, forget: bool) -> None:
        if restore:
            if offer.photos:
                self._hands.submit(MakeThumbnails(tuple(Path(path) for path, _ in offer.photos)))
            self._hands.perform(OpenScene(offer.scene, offer.edits))
        elif forget:
            self._hands.submit(ForgetFile(offer.edits))

    def _settle(self, state: State) -> None:
        """On the disk lies what is not saved, and nothing once all is."""
        self._keep_edits_at = NEVER
        if state.editing.dirty:
            self._keep_edits(state)
        elif self._edits_kept and state.scene.info is not None:
            self._hands.submit(ForgetEdits(state.scene.info.scene, self._keeper.token))
            self._hands.perform(EditsKept(None))
            self._edits_kept = False

    def _keep_edits(self, state: State) -> None:
        info, history = state.scene.info, state.editing.history
        if info is not None and history is not None and history.done:
            self._write_edits(info, history, state)

    def _write_edits(self, info: SceneInfo, history: History, state: State) -> None:
        place = (info.name, info.path, self._keeper.token, kept_photos(state))
        self._hands.submit(KeepEdits(info.serial, info.scene, history, *place))
        self._edits_kept = self._edits_wrote = True

    # The session

    def _take_session(self, info: SceneInfo, state: State) -> None:
        """Stand where a restored session stood; a scene that has no file of its own gets a copy."""
        kept, self._restoring = self._restoring, None
        if kept is not None and (kept.edits or str(info.path) == kept.scene):
            self._hands.perform(StandAgain(kept.pose, kept.mode, kept.name, kept.saved))
            unsaved = not kept.saved
        else:
            unsaved = info.path is None
        if info.path is not None and not unsaved:
            self._hands.perform(Opened(info.path))
        self._copied = False
        if unsaved:
            self._hands.perform(CopyAt(self._keeper.scene_file))
            first = None if info.history is None else info.history.first
            self._hands.submit(KeepCopy(info.serial, info.scene, self._keeper.scene_file, first))
        if kept is not None and kept.file is not None:
            self._outlived = kept.file
        if not unsaved:
            self._drop_outlived(state)

    def _drop_outlived(self, state: State) -> None:
        """The restored session's files go once this session has its own, which is written first; so do edits
        that it names, once they are kept anew."""
        if self._outlived is not None:
            kept = self._kept(state)
            replaced, self._replaced = (self._replaced, []) if kept.edits else ([], self._replaced)
            self._writer.submit(self._keep, kept, self._outlived, replaced)
            self._outlived = None

    def _end_session_offer(self, kept: Kept, restore: bool) -> None:
        if not restore:
            if kept.file is not None:
                self._writer.submit(sessions.forget, kept.file)
            return
        if kept.photos:
            self._hands.submit(MakeThumbnails(tuple(map(Path, kept.photos))))
        if kept.scene:
            self._wanted = kept
            edits = Path(kept.edits) if kept.edits else None
            scene = Path(kept.scene) if edits is None else edits.with_suffix(SCENE_SUFFIX)
            self._hands.perform(OpenScene(scene, edits))
        elif kept.file is not None:
            self._writer.submit(sessions.forget, kept.file)

    # What the writer's thread does

    def _save(self, wanted: Preferences) -> None:
        problem = preferences.try_to_save(wanted, self._saved)
        if problem:
            self._hands.dispatch(Notify(problem))
        else:
            self._saved = wanted

    def _keep(self, kept: Kept, outlived: Path | None = None, replaced: Iterable[Task] = ()) -> None:
        try:
            self._keeper.keep(kept)
        except LangFlashError as error:
            self._hands.dispatch(Log("error", f"The session could not be saved: {error}."))
            return
        if outlived is not None:
            sessions.forget(outlived)
        for task in replaced:
            list(task.run(lambda: False))

    def _kept(self, state: State) -> Kept:
        info = state.scene.info
        path = None if info is None else info.path or (self._keeper.scene_file if self._copied else None)
        edits = "" if state.recovery.kept is None else str(state.recovery.kept)
        return replace(kept_session(state, path), edits=edits)


def _snapshot(state: State) -> tuple[Any, ...]:
    """What a change of must be kept."""
    where = None if state.scene.info is None else (state.scene.info.serial, state.scene.info.path)
    phrases = tuple((p.text, p.like, p.threshold, p.colour, p.visible) for p in state.asking.prompts)
    photos = tuple((photo.path, photo.fov) for photo in state.scene.photos)
    return photos, where, phrases, state.scene.mode, state.scene.pose, state.recovery.kept
