"""What editing asks of the world: the worker for what must be computed, the disk for what must last."""

import secrets
from collections.abc import Callable
from pathlib import Path

import numpy as np

from app.window import autosave, edit_messages, messages
from app.window import commands as do
from app.window import edit_commands as edit
from app.window.editing import Offer, Reading, Tool
from app.window.state import SceneInfo, State
from app.window.viewport import Viewport
from langflash_core.errors import LangFlashError
from langflash_core.scene.edits import Combine, History, Marks

KEEP_AFTER = 1.0  # seconds after an edit that it is written, so that a burst is written once


class Editor:
    """Follows the commands of the session that owns it. Main thread only.

    submit: queues a request of the worker. perform: a command, at once.
    """

    def __init__(
        self,
        submit: Callable[[messages.Job | messages.Errand], None],
        viewport: Viewport,
        perform: Callable[[do.Command], None],
    ) -> None:
        self._submit = submit
        self._viewport = viewport
        self._perform = perform
        self._token = secrets.token_hex(4)
        self._kept = False  # whether edits of the scene on show lie on the disk
        self._wrote = False  # or have ever, and what removes them may not have come to it
        self._restoring: Path | None = None  # a file of edits
        self._read: tuple | None = None  # what the last reading under the pointer was of
        self.keep_at = float("inf")

    # Every frame

    def mark(self, state: State) -> None:
        """Bring deletions, selection and preview into the picture."""
        marks, preview = state.editing.marks, state.editing.floaters
        doomed = preview.mask(marks.visible) if marks is not None and preview is not None else None
        self._viewport.mark(marks, doomed)

    def point(self, state: State) -> None:
        """Read what is under the pointer, and what a click asked about once the picture rests."""
        editing, info = state.editing, state.info
        if info is None:
            return
        hover = editing.hover
        key = None if hover is None else (hover.at, self._viewport.drawn)
        if hover is not None and key != self._read:
            found = self._viewport.read(hover.at)
            if found is not None:
                reading, weights = found
                self._perform(edit.ReadingTaken(reading))
                if weights is None and reading.point is not None and editing.tool is Tool.POINT:
                    self._weigh(state, info, reading)
        self._read = key
        if editing.asked is not None and state.pose == self._viewport.pose:
            self._ask(state, info)

    def _weigh(self, state: State, info: SceneInfo, reading: Reading) -> None:
        marks, size = state.editing.marks, self._viewport.size
        if marks is not None and info.num_atoms and state.pose == self._viewport.pose:
            self._submit(edit_messages.Weigh(info.serial, info.scene, marks, reading, state.pose, size))

    def _ask(self, state: State, info: SceneInfo) -> None:
        """Send the place that was clicked on."""
        assert state.editing.asked is not None and state.editing.marks is not None
        found = self._viewport.read(state.editing.asked)
        if found is None:
            return
        reading, weights = found
        self._perform(edit.CardOpened(reading))
        if reading.point is None or not info.num_atoms:
            self._perform(edit.Named(reading, reading, (), b""))
            return
        extra = tuple(p.text.strip() for p in state.asked if not p.like)
        content = b"" if weights is None else weights.astype(np.float32).tobytes()
        scene = (info.serial, info.scene, state.editing.marks)
        place = (reading, state.pose, self._viewport.size)
        self._submit(edit_messages.NamePlace(*scene, *place, content, extra))

    # Commands

    def follow(self, command: do.Command, before: State, state: State) -> None:
        """What a command asks of the world, after its pure change."""
        match command:
            case do.OpenScene(_, edits):
                self._restoring = edits
            case do.SceneArrived(info):
                self._arrived(info, before)
            case do.SceneSaved():
                self._settle(state)
            case edit.FindFloaters() if state.info is not None and state.editing.marks is not None:
                errand = edit_messages.ScoreFloaters(state.info.serial, state.info.scene, state.editing.marks)
                self._submit(errand)
            case edit.EndOffer(restore, forget) if before.editing.offer is not None:
                self._end_offer(before.editing.offer, restore, forget)
            case _ if state.info is not None and state.editing.marks is not None:
                errand = _errand(command, state, state.info, state.editing.marks, self._viewport.size)
                if errand is not None:
                    self._submit(errand)
                elif state.editing.waiting and not before.editing.waiting:
                    self._perform(edit.StopWaiting())
        if state.editing.marks != before.editing.marks and state.info is before.info:
            self.keep_at = state.now + KEEP_AFTER
            self._atoms_changed(before, state)

    def _arrived(self, info: SceneInfo, before: State) -> None:
        if before.info is not None and before.editing.unsaved and before.editing.dirty:
            self._keep(before)
            if before.info.path is None or before.editing.history is None or before.editing.history.done:
                text = f"The edits of {before.info.name} are kept; open it again to go on with them."
                self._perform(do.Notify(text, "info"))
        self._kept, self._wrote, self.keep_at = False, False, float("inf")
        if info.num_atoms and info.history is not None:
            self._submit(edit_messages.NameAtoms(info.serial, info.scene, info.history.marks))
        if self._restoring is not None and info.history is not None and info.history.done:
            self._write(info, info.history)
            if not self._restoring.name.endswith(f"-{self._token}{autosave.SUFFIX}"):
                self._submit(edit_messages.ForgetFile(self._restoring))
        else:
            self._submit(edit_messages.LookForEdits(info.serial, info.scene, info.path))
        self._restoring = None

    def _end_offer(self, offer: Offer, restore: bool, forget: bool) -> None:
        if restore:
            self._perform(do.OpenScene(offer.scene, offer.edits))
        elif forget:
            self._submit(edit_messages.ForgetFile(offer.edits))

    def _atoms_changed(self, before: State, state: State) -> None:
        """Merged atoms have other words."""
        old, new = before.editing.marks, state.editing.marks
        if old is None or new is None or state.info is None:
            return
        if [atom.into for atom in old.atoms] != [atom.into for atom in new.atoms]:
            self._submit(edit_messages.NameAtoms(state.info.serial, state.info.scene, new))

    # What must last

    def keep_if_due(self, state: State, now: float) -> None:
        """Write the edits a moment after the last one."""
        if now >= self.keep_at:
            self._settle(state)

    def _settle(self, state: State) -> None:
        """On the disk lies what is not saved, and nothing once all is."""
        self.keep_at = float("inf")
        if state.editing.dirty:
            self._keep(state)
        elif self._kept and state.info is not None:
            self._submit(edit_messages.ForgetEdits(state.info.scene, self._token))
            self._perform(edit.EditsKept(None))
            self._kept = False

    def _keep(self, state: State) -> None:
        info, history = state.info, state.editing.history
        if info is not None and history is not None and history.done:
            self._write(info, history)

    def _write(self, info: SceneInfo, history: History) -> None:
        place = (info.name, info.path, self._token)
        self._submit(edit_messages.KeepEdits(info.serial, info.scene, history, *place))
        self._kept = self._wrote = True

    def close(self, state: State) -> None:
        """At the end, when the worker is gone: edits that a saved file would miss are kept."""
        info, history = state.info, state.editing.history
        if info is None or history is None:
            return
        try:
            if state.editing.unsaved and history.done:
                autosave.keep(info.scene, history, info.name, info.path, self._token)
            elif self._wrote or history.done:
                autosave.forget(info.scene, self._token)
        except LangFlashError:
            return  # there is no window left to say it in


def _errand(
    command: do.Command, state: State, info: SceneInfo, marks: Marks, size: tuple[int, int]
) -> edit_messages.Request | None:
    """What the worker must compute for a command."""
    scene = (info.serial, info.scene, marks)
    match command:
        case edit.SelectRegion(region, combine) if min(size) > 0:
            through = state.editing.through
            return edit_messages.FindInRegion(*scene, region, state.pose, size, through, combine)
        case edit.SelectByPhrase(key, combine):
            return _phrase(state, info, marks, key, combine)
        case edit.SelectAtom(atom, combine) if 0 <= atom < len(marks.atoms):
            return edit_messages.FindAtom(*scene, atom, combine)
        case edit.Grow(phrase) if marks.selected:
            active = state.active_prompt
            within = _phrase(state, info, marks, active.key, "add") if phrase and active else None
            return edit_messages.GrowSelection(*scene, state.editing.reach, within)
    return None


def _phrase(
    state: State, info: SceneInfo, marks: Marks, key: int, combine: Combine
) -> edit_messages.FindByPhrase | None:
    prompt = next((p for p in state.prompts if p.key == key and p.text.strip()), None)
    if prompt is None or not info.num_atoms:
        return None
    return edit_messages.FindByPhrase(
        info.serial, info.scene, marks, prompt.text.strip(), prompt.like, state.negatives, prompt.cut, combine
    )
