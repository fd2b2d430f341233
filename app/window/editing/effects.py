"""What editing asks of the world: the worker for what must be computed, the picture for what is marked
in it and what the pointer is on."""

from dataclasses import replace

import numpy as np

from ...places import config_folder
from ..commands import Command, Notify
from ..effects import Effects, Hands
from ..requests import Job
from ..scene.commands import SceneArrived, room_of
from ..scene.mended import ClonePart, CopyPart, FillHole, HidePart
from ..scene.state import SceneInfo
from ..state import State
from ..viewport import Viewport
from .cleaning import LoadRecipe, ReadRecipe, SaveRecipe, WriteRecipe
from .commands import FindFloaters, StopWaiting
from .mending import (
    BringBack,
    CloneStroke,
    CopySelection,
    FillSelection,
    HiddenForGood,
    HideForGood,
    PickSource,
    RememberUnhidden,
)
from .pointing import CardOpened, Named, ReadingTaken, RulerPlaced, SetTool
from .state import Reading, Tool
from .teaching import WORDS, KeepWords, TakeWords
from .work import (
    DrawOutline,
    FindLessons,
    FindMargins,
    KeepLessons,
    NameAtoms,
    NamePlace,
    PrepareThings,
    ScoreFloaters,
    Weigh,
    request_for,
)


class EditingEffects(Effects):
    """Marks in the picture, readings from it, requests for what takes long."""

    def __init__(self, hands: Hands, viewport: Viewport) -> None:
        self._hands = hands
        self._viewport = viewport
        self._read: tuple | None = None  # what the last reading under the pointer was of
        self._seen: tuple | None = None  # selection and place of the last frame
        self._lined: tuple | None = None  # of the last outline that was asked for

    # Every picture

    def before_picture(self, state: State) -> None:
        """Bring deletions, selection and preview into the picture."""
        marks, preview = state.editing.marks, state.editing.floaters
        doomed = preview.mask(marks.visible) if marks is not None and preview is not None else None
        if marks is not None and state.editing.hiding is not None:
            doomed = state.editing.hiding.mask(marks)
        memory = None if state.scene.info is None else state.scene.info.memory
        self._viewport.mark(memory, marks, doomed, state.editing.gesture)

    def after_picture(self, state: State) -> None:
        """Read what is under the pointer, and what a click asked about once the picture rests."""
        editing, info = state.editing, state.scene.info
        if info is None:
            return
        hover = editing.hover
        key = None if hover is None else (hover.at, self._viewport.drawn)
        if hover is not None and key != self._read:
            found = self._viewport.read(hover.at)
            if found is not None:
                reading, weights = found
                self._hands.perform(ReadingTaken(reading))
                if weights is None and reading.point is not None and editing.tool is Tool.POINT:
                    self._weigh(state, info, reading)
        self._read = key
        if editing.asked is not None and state.scene.pose == self._viewport.pose:
            self._ask(state, info)
        self._outline(state, info)

    def _outline(self, state: State, info: SceneInfo) -> None:
        """Ask for the line around the selection once that, and the place, are those of the last frame."""
        marks, pose, size = state.editing.marks, state.scene.pose, self._viewport.size
        if marks is None or not marks.selected or min(size) < 1:
            return
        seen = (info.serial, marks.selected, marks.visible, marks.changes, pose, size)
        if seen == self._seen and seen != self._lined:
            self._lined = seen
            self._hands.submit(DrawOutline(info.serial, info.memory, marks, pose, size))
        self._seen = seen

    def _weigh(self, state: State, info: SceneInfo, reading: Reading) -> None:
        marks, size = state.editing.marks, self._viewport.size
        if marks is not None and info.num_atoms and state.scene.pose == self._viewport.pose:
            self._hands.submit(Weigh(info.serial, info.memory, marks, reading, state.scene.pose, size))

    def _ask(self, state: State, info: SceneInfo) -> None:
        """Send the place that was clicked on."""
        assert state.editing.asked is not None and state.editing.marks is not None
        found = self._viewport.read(state.editing.asked)
        if found is None:
            return
        reading, weights = found
        if state.editing.tool is Tool.RULER:
            self._hands.perform(RulerPlaced(reading))
            return
        if state.editing.tool is Tool.CLONE:
            self._hands.perform(PickSource(reading.point))
            return
        self._hands.perform(CardOpened(reading))
        if reading.point is None or not info.num_atoms:
            self._hands.perform(Named(reading, reading, (), b""))
            return
        extra = tuple(p.text.strip() for p in state.asking.asked if not p.like)
        content = b"" if weights is None else weights.astype(np.float32).tobytes()
        scene = (info.serial, info.memory, state.editing.marks)
        place = (reading, state.scene.pose, self._viewport.size)
        self._hands.submit(NamePlace(*scene, *place, content, extra, state.asking.negatives))

    # Commands

    def follow(self, command: Command, before: State, state: State) -> None:
        """What must be computed for a command goes to the worker."""
        info, marks = state.scene.info, state.editing.marks
        match command:
            case SceneArrived():
                if info is not None and info.num_atoms and marks is not None:
                    self._hands.submit(NameAtoms(info.serial, info.memory, marks))
            case SetTool(Tool.PICK) if info is not None and marks is not None:
                self._hands.submit(PrepareThings(info.serial, info.memory, marks))
            case KeepWords() if info is not None and marks is not None:
                self._hands.submit(KeepLessons(info.serial, info.memory, marks, config_folder() / WORDS))
            case TakeWords() if info is not None and marks is not None:
                self._hands.submit(FindLessons(info.serial, info.memory, marks, config_folder() / WORDS))
            case SaveRecipe(path) if state.editing.floaters is not None:
                self._hands.submit(WriteRecipe(state.editing.floaters.recipe, path))
            case LoadRecipe(path):
                self._hands.submit(ReadRecipe(path))
            case _ if info is not None and marks is not None:
                request = request_for(command, state, info, marks, self._viewport.size)
                if request is not None:
                    self._hands.submit(request)
                elif state.editing.waiting and not before.editing.waiting:
                    self._hands.perform(StopWaiting())
        self._find_floaters(command, before, state)
        self._find_margins(before, state)
        self._mend(command, before, state)
        if marks != before.editing.marks and state.scene.info is before.scene.info:
            self._atoms_changed(before, state)

    def _find_floaters(self, command: Command, before: State, state: State) -> None:
        """Look again once the preview is new, or its recipe is another in more than its strength."""
        info, marks = state.scene.info, state.editing.marks
        old, new = before.editing.floaters, state.editing.floaters
        if info is None or marks is None or new is None:
            return
        same = old is not None and replace(old.recipe, strength=new.strength) == new.recipe
        if not same or isinstance(command, FindFloaters):
            self._hands.submit(ScoreFloaters(info.serial, info.memory, marks, new.recipe))

    def _find_margins(self, before: State, state: State) -> None:
        """Look at what lies around the selection once it is to be hidden, and where it became another."""
        info, marks = state.scene.info, state.editing.marks
        if info is None or marks is None or state.editing.hiding is None or not marks.selected:
            return
        if before.editing.hiding is None or before.editing.marks != marks:
            self._hands.submit(FindMargins(info.serial, info.memory, marks))

    def _mend(self, command: Command, before: State, state: State) -> None:
        """What makes another scene of the one on show, and what goes back to that."""
        info, marks, unhidden = state.scene.info, state.editing.marks, before.scene.unhidden
        jobs: dict[type, Job] = {}
        if info is not None and marks is not None and marks.selected:
            jobs = {FillSelection: FillHole(info, marks), CopySelection: CopyPart(info, marks)}
            if isinstance(command, HideForGood):
                jobs[HideForGood] = HidePart(info, marks, command.how, command.margin)
        match command:
            case FillSelection() | CopySelection() | HideForGood() if type(command) in jobs:
                self._hands.submit(jobs[type(command)])
            case CloneStroke(region) if info is not None and marks is not None:
                source, place = before.editing.source, (state.scene.pose, self._viewport.size)
                if source is not None and before.scene.job is None:
                    self._hands.submit(ClonePart(info, marks, source, region, *place, before.editing.fit))
            case HiddenForGood() if command.fits(before):
                self._take_hidden(command, before)
            case BringBack() if unhidden is not None:
                arrival = replace(unhidden.info, history=unhidden.history)
                self._hands.perform(SceneArrived(arrival, room=unhidden, replaces=True))

    def _take_hidden(self, command: HiddenForGood, before: State) -> None:
        """Show it, and remember what was on show until it is saved."""
        assert before.scene.info is not None
        self._hands.perform(command.arrival(before))
        self._hands.perform(RememberUnhidden(room_of(before, before.scene.info)))
        self._hands.perform(Notify(command.said, "info"))

    def _atoms_changed(self, before: State, state: State) -> None:
        """Merged and corrected atoms have other words."""
        old, new = before.editing.marks, state.editing.marks
        if old is None or new is None or state.scene.info is None:
            return
        if [(atom.into, atom.denied) for atom in old.atoms] != [
            (atom.into, atom.denied) for atom in new.atoms
        ]:
            self._hands.submit(NameAtoms(state.scene.info.serial, state.scene.info.memory, new))
