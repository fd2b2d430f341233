"""What the session owes the desktop: preferences and sessions that last, a log, exports in a
process of their own. Follows the commands of the session; main thread only.

Files are written by a thread of one, because waiting for a disk is no business of a frame.
"""

import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.window import commands as do
from app.window import desk_commands as desk
from app.window import export_form, messages, preferences, recovery
from app.window.drops import SCENE_SUFFIX
from app.window.exporter import Exporter, camera_json
from app.window.preferences import Preferences
from app.window.recovery import Keeper, Kept
from app.window.state import SceneInfo, State
from langflash_core.errors import LangFlashError
from langflash_core.files import make_folder, write_atomically
from langflash_core.scene.edits import Marks, Mask

KEEP_AFTER = 1.0  # seconds without a change before the session is written
SAVE_AFTER = 0.5  # the same for preferences


class Citizen:
    """perform: a command, at once. dispatch: a command from any thread, for the next frame.
    submit: a request of the worker."""

    def __init__(
        self,
        perform: Callable[[do.Command], None],
        dispatch: Callable[[do.Command], None],
        submit: Callable[[messages.Job | messages.Errand], None],
    ) -> None:
        self._perform = perform
        self._dispatch = dispatch
        self._submit = submit
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="langflash-writer")
        self._keeper = Keeper()
        self._exporter = Exporter(self._progressed, self._ended)
        self._wanted: Kept | None = None  # the session whose scene is to be opened
        self._restoring: Kept | None = None  # and whose scene is being opened
        self._outlived: Path | None = None
        self._copied = False  # whether the copy of an unsaved scene is complete
        self._export_waits = False  # for a copy
        self._ready: set[Path] = set()  # copies for the export that are complete
        self._snapshot: tuple = ()
        self._keep_at = self._save_at = float("inf")
        self._log = _LogToWindow(dispatch)
        logging.getLogger("app").addHandler(self._log)

    def begin(self, loaded: Preferences, sentence: str) -> None:
        """The first commands of the session."""
        self._perform(desk.Prefer(loaded))
        self._save_at = float("inf")
        if sentence:
            self._perform(do.Notify(sentence))
        kept = recovery.left_behind()
        if kept is not None:
            self._perform(desk.OfferSession(kept))

    # Time

    @property
    def due(self) -> float:
        """When `tick` has something to do next, on the clock of the state."""
        return min(self._keep_at, self._save_at)

    def tick(self, state: State, now: float) -> None:
        """Write what has rested long enough."""
        if now >= self._save_at:
            self._save_at = float("inf")
            self._writer.submit(self._save, state.desk.preferences)
        if now >= self._keep_at:
            self._keep_at = float("inf")
            self._writer.submit(self._keep, self._kept(state))

    def close(self, state: State, crashed: bool) -> None:
        """Write what is still to write. After a crash the session stays, to be offered again."""
        logging.getLogger("app").removeHandler(self._log)
        self._exporter.close()
        if self._save_at < float("inf"):
            self._writer.submit(self._save, state.desk.preferences)
        if crashed:
            self._writer.submit(self._keep, self._kept(state))
        self._writer.shutdown()
        if not crashed:
            self._keeper.close()

    # Commands

    def follow(self, command: do.Command, before: State, state: State) -> None:
        """What a command asks of the world, after its pure change."""
        match command:
            case do.OpenScene() | do.Reconstruct():
                self._restoring = self._wanted
                self._wanted = None
            case do.SceneArrived(info):
                self._arrived(info)
            case do.SceneSaved(path):
                self._perform(desk.Opened(path))
            case desk.ChoosePair() if state.desk.choosing and not before.desk.choosing:
                self._submit(messages.FindPair(tuple(photo.path for photo in state.photos)))
            case desk.ShowExport() if state.dialog == "export":
                self._copy_for_export(state)
            case desk.Export():
                self._export(state)
            case desk.CancelExport():
                self._exporter.cancel()
            case desk.EndSessionOffer(restore) if before.desk.offer is not None:
                self._end_offer(before.desk.offer, restore)
            case _:
                pass
        if state.desk.preferences != before.desk.preferences:
            self._save_at = state.now + SAVE_AFTER
        snapshot = _snapshot(state)
        if snapshot != self._snapshot:
            self._snapshot, self._keep_at = snapshot, state.now + KEEP_AFTER
        known = {toast.key for toast in before.toasts}
        for toast in state.toasts:
            if toast.key not in known:
                self._perform(desk.Log(toast.kind, toast.text))

    def hear(self, result: messages.Result, serial: int) -> None:
        """A result of the worker."""
        match result:
            case messages.CopyKept(of, path) if of == serial:
                if path == self._keeper.scene_file:
                    self._copied = True
                    self._snapshot = ()  # the session now has a scene to name
                    self._drop_outlived()
                self._ready.add(path)
                if self._export_waits:
                    self._export_waits = False
                    self._dispatch(desk.Export())
            case messages.PairFound(paths, pair, problem):
                self._dispatch(desk.ChoosingFailed(problem) if problem else desk.PairChosen(paths, pair))
            case messages.Thumbnail(key, rgb, _, fov, notes) if rgb is not None:
                self._dispatch(desk.PhotoRead(Path(key), fov, notes))
            case _:
                pass

    def _arrived(self, info: SceneInfo) -> None:
        kept, self._restoring = self._restoring, None
        if kept is not None and (kept.edits or str(info.path) == kept.scene):
            self._perform(desk.StandAgain(kept.pose, kept.mode, kept.name, kept.saved))
            unsaved = not kept.saved
        else:
            unsaved = info.path is None
        if info.path is not None and not unsaved:
            self._perform(desk.Opened(info.path))
        self._copied = False
        self._ready.clear()
        if unsaved:
            self._perform(desk.CopyAt(self._keeper.scene_file))
            self._submit(messages.KeepCopy(info.serial, info.scene, self._keeper.scene_file))
        if kept is not None and kept.file is not None:
            self._outlived = kept.file
        if not unsaved:
            self._drop_outlived()

    def _drop_outlived(self) -> None:
        """The restored session's files go once this session has its own."""
        if self._outlived is not None:
            self._writer.submit(recovery.forget, self._outlived)
            self._outlived = None

    def _end_offer(self, kept: Kept, restore: bool) -> None:
        if not restore:
            if kept.file is not None:
                self._writer.submit(recovery.forget, kept.file)
            return
        if kept.photos:
            self._submit(messages.MakeThumbnails(tuple(map(Path, kept.photos))))
        if kept.scene:
            self._wanted = kept
            edits = Path(kept.edits) if kept.edits else None
            scene = Path(kept.scene) if edits is None else edits.with_suffix(SCENE_SUFFIX)
            self._perform(do.OpenScene(scene, edits))
        elif kept.file is not None:
            self._writer.submit(recovery.forget, kept.file)

    # Export

    def _copy_for_export(self, state: State) -> None:
        """Write what the scene's own file does not hold: unsaved edits, and the selection."""
        info, marks = state.info, state.editing.marks
        self._export_waits = False
        if info is None or marks is None:
            return
        edited, selection = self._keeper.edited_file, self._keeper.selection_file
        copies: dict[Path, Marks] = {}
        if state.editing.unsaved:
            copies[edited] = marks
        if marks.selected:
            rest = Mask.full(marks.selected.count) - marks.selected
            copies[selection] = replace(marks, deleted=rest)
        self._ready -= {edited, selection}
        for path, wanted in copies.items():
            self._submit(messages.KeepCopy(info.serial, info.scene, path, wanted))
        there = (path if path in copies else None for path in (edited, selection))
        self._perform(desk.CopiesAt(*there))

    def _export(self, state: State) -> None:
        if self._exporter.running:
            self._perform(do.Notify("An export is under way; wait for it, or stop it."))
            return
        order = export_form.order(state)
        if isinstance(order, str):
            self._perform(do.Notify(order))
            return
        source = export_form.source(state)
        if state.info is not None and source != state.info.path and source not in self._ready:
            self._export_waits = True  # goes on when the copy is complete
            return
        try:
            make_folder(order.target.parent)
            if order.camera_file is not None:
                size = export_form.pixels(state.desk.form.side, state.pose.aspect)
                write_atomically(order.camera_file, camera_json(state.pose, *size))
            self._exporter.start(order.words)
        except LangFlashError as error:
            self._perform(do.Notify(str(error)))
            return
        except OSError as error:
            self._perform(do.Notify(f"The export cannot be started: {error.strerror or error}."))
            return
        self._perform(desk.ExportBegan(order.target))

    def _progressed(self, stage: str, fraction: float) -> None:
        self._dispatch(desk.ExportProgressed(stage, fraction))

    def _ended(self, code: int, said: str, error: str) -> None:
        self._dispatch(desk.ExportEnded(code, said, error))

    # What lasts

    def _save(self, wanted: Preferences) -> None:
        problem = preferences.try_to_save(wanted)
        if problem:
            self._dispatch(do.Notify(problem))

    def _keep(self, kept: Kept) -> None:
        try:
            self._keeper.keep(kept)
        except LangFlashError as error:
            self._dispatch(desk.Log("error", f"The session is not kept: {error}."))

    def _kept(self, state: State) -> Kept:
        info = state.info
        path = None if info is None else info.path or (self._keeper.scene_file if self._copied else None)
        return Kept(
            photos=tuple(str(photo.path) for photo in state.photos),
            fovs=tuple(photo.fov for photo in state.photos),
            scene="" if path is None else str(path),
            edits="" if state.editing.kept is None else str(state.editing.kept),
            saved=info is None or info.path is not None,
            name="" if info is None else info.name,
            phrases=tuple(prompt.text for prompt in state.prompts if prompt.text.strip()),
            mode=state.mode.name,
            pose=None if info is None else state.pose,
        )


class _LogToWindow(logging.Handler):
    """Warnings and errors of the program as lines of the log panel."""

    def __init__(self, dispatch: Callable[[do.Command], None]) -> None:
        super().__init__(logging.WARNING)
        self._dispatch = dispatch

    def emit(self, record: logging.LogRecord) -> None:
        kind = "error" if record.levelno >= logging.ERROR else "info"
        self._dispatch(desk.Log(kind, record.getMessage()))


def _snapshot(state: State) -> tuple[Any, ...]:
    """What a change of must be kept."""
    where = None if state.info is None else (state.info.serial, state.info.path)
    phrases = tuple(prompt.text for prompt in state.prompts)
    photos = tuple((photo.path, photo.fov) for photo in state.photos)
    return photos, where, phrases, state.mode, state.pose, state.editing.kept
