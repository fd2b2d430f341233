"""What the tour reads from the picture: which of its notes lie behind what is drawn there, as on the page."""

import numpy as np

from langflash_core.geometry.poses import Vector, project
from langflash_core.scene.tour import Note

from ..effects import Effects, Hands
from ..state import State
from ..viewport import Viewport
from .commands import NotesJudged

SURFACE = 0.03  # of a note's depth: what is nearer to it than that is its own surface


class TouringEffects(Effects):
    """Judges notes once for each picture that they are shown on."""

    def __init__(self, hands: Hands, viewport: Viewport) -> None:
        self._hands = hands
        self._viewport = viewport
        self._judged: tuple | None = None  # picture and notes that were judged last

    def after_picture(self, state: State) -> None:
        """Ask the depth of the picture at every note."""
        drawn, notes = self._viewport.drawn, state.tour.notes if state.shows_notes else ()
        if notes and (drawn is None or state.scene.pose != self._viewport.pose):
            return  # the picture is on its way
        judged = (drawn, notes) if notes else None
        if judged == self._judged:
            return
        self._judged = judged
        behind = frozenset(note for note in notes if self._is_behind(note, state))
        if behind != state.touring.behind:
            self._hands.perform(NotesJudged(behind))

    def _is_behind(self, note: Note, state: State) -> bool:
        """Whether something lies before all of its ends; nobody knows of what is not in the picture."""
        ends = [note.at] if note.to is None else [note.at, note.to]
        return all(self._covered(end, state) for end in ends)

    def _covered(self, end: Vector, state: State) -> bool:
        size = self._viewport.size
        found = project(np.array([end]), state.scene.pose, size)
        if found is None:
            return False
        (depth, (x, y)) = float(found[0][0]), found[1][0].tolist()
        if not (0 <= x < size[0] and 0 <= y < size[1]):
            return False
        read = self._viewport.read((x, y))
        return read is not None and read[0].point is not None and read[0].depth < (1 - SURFACE) * depth
