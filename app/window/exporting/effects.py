"""What exporting asks of the world: the files that the command reads, and the process that writes."""

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import LangFlashError
from langflash_core.scene.edits import Marks, Mask

from ..commands import Command, Notify
from ..dialogs import Dialog
from ..effects import Effects, Hands
from ..recovery.commands import CopyKept
from ..recovery.records import Keeper
from ..recovery.work import KeepCopy
from ..scene.commands import SceneArrived
from ..state import State
from .commands import (
    AskToReplace,
    CancelExport,
    CopiesAt,
    Export,
    ExportBegan,
    ExportEnded,
    ExportProgressed,
    ShowExport,
    TargetLookedUp,
)
from .order import Order, look_up, order, pixels, shape, source, there
from .process import Exporter, camera_json, keys_json


class ExportingEffects(Effects):
    """keeper: knows where the copies that an export reads may lie."""

    def __init__(self, hands: Hands, keeper: Keeper) -> None:
        self._hands = hands
        self._keeper = keeper
        self._exporter = Exporter(
            lambda *said: hands.dispatch(ExportProgressed(*said)),
            lambda *told: hands.dispatch(ExportEnded(*told)),
        )
        self._waits = False  # for a copy
        self._ready: set[Path] = set()  # copies that are complete
        self._camera: Path | None = None  # a file that the export under way alone is for

    def follow(self, command: Command, before: State, state: State) -> None:
        """The dialog has copies made, its button starts the process."""
        if state.dialog is Dialog.EXPORT and (target := look_up(state)) != state.exporting.target:
            self._hands.perform(TargetLookedUp(target))  # other programs write files too
        match command:
            case SceneArrived():
                self._ready.clear()
            case ShowExport() if state.dialog is Dialog.EXPORT:
                self._make_copies(state)
            case CopyKept(path):
                self._ready.add(path)
                if self._waits:
                    self._waits = False
                    self._hands.dispatch(Export(sure=True))  # the question, if any, is answered
            case Export(sure):
                self._export(state, sure)
            case CancelExport():
                self._exporter.cancel()
            case ExportEnded(code) if code:
                self._leave_nothing()
            case _:
                pass

    def close(self, state: State, crashed: bool) -> None:
        """End the export under way."""
        running = self._exporter.running
        self._exporter.close()
        if running:
            self._leave_nothing()

    def _make_copies(self, state: State) -> None:
        """Write what the scene's own file does not hold: unsaved edits, and the selection."""
        info, marks = state.scene.info, state.editing.marks
        self._waits = False
        if info is None or marks is None:
            return
        edited, selection = self._keeper.edited_file, self._keeper.selection_file
        copies: dict[Path, Marks] = {}
        if state.editing.exported_anew:
            copies[edited] = marks
        if marks.selected:
            rest = Mask.full(marks.selected.count) - marks.selected
            copies[selection] = replace(marks, deleted=rest)
        self._ready -= {edited, selection}
        for path, wanted in copies.items():
            self._hands.submit(KeepCopy(info.serial, info.scene, path, wanted))
        there = (path if path in copies else None for path in (edited, selection))
        self._hands.perform(CopiesAt(*there))

    def _export(self, state: State, sure: bool) -> None:
        perform = self._hands.perform
        if self._exporter.running:
            perform(Notify("An export is running; wait for it, or stop it."))
            return
        state = TargetLookedUp(look_up(state)).apply(state)
        wanted = order(state)
        if isinstance(wanted, str):
            perform(Notify(wanted))
            return
        found = there(wanted)
        if found and not sure:
            perform(AskToReplace(found))
            return
        read = source(state)
        if state.scene.info is not None and read != state.scene.info.path and read not in self._ready:
            self._waits = True  # goes on when the copy is complete
            return
        try:
            self._start(wanted, state, bool(found))
        except LangFlashError as error:
            self._leave_nothing()
            perform(Notify(str(error)))
        except OSError as error:
            self._leave_nothing()
            perform(Notify(f"The export cannot be started: {error.strerror or error}."))
        else:
            perform(ExportBegan(wanted.request.output))

    def _start(self, wanted: Order, state: State, replaces: bool) -> None:
        """Raises:
        LangFlashError: the folder or the camera file cannot be written.
        OSError: the process cannot be started.
        """
        self._camera = None
        make_folder(wanted.request.output.parent)
        if wanted.camera_file is not None:
            size = pixels(state.exporting.form.side, shape(state))
            keys = state.keys if state.exporting.form.what.moves else ()
            content = keys_json(keys, *size) if keys else camera_json(state.scene.pose, *size)
            if not wanted.camera_file.exists():
                self._camera = wanted.camera_file
            write_atomically(wanted.camera_file, content)
        self._exporter.start(replace(wanted.request, replace=replaces).words())

    def _leave_nothing(self) -> None:
        """Of an export that wrote nothing: a camera file would be in the next one's way."""
        if self._camera is not None:
            with suppress(OSError):
                self._camera.unlink()
