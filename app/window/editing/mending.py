"""What can happen while a part is hidden for good, or taken out and its hole filled.

Hiding makes another scene: with the history of the one before, what was hidden could be brought back. That
one is remembered until the hidden one is saved (`Showing.unhidden`), and can be gone back to until then.
"""

from dataclasses import dataclass, field, replace

from langflash_core.mending.recipes import HOWS
from langflash_core.mending.settings import RECIPE_DEFAULTS
from langflash_core.scene.edits import Marks

from ..scene.merging import Remade
from ..scene.state import Job, Room
from ..state import State
from .state import Hiding, Region, Spot

HIDING, FILLING, COPYING, CLONING = "Hiding", "Filling", "Copying", "Cloning"
"""Titles of the jobs."""


@dataclass(frozen=True)
class AskToHide:
    """Show the ways to hide the selection; another way; or "" for none."""

    how: str = HOWS[0]

    def apply(self, state: State) -> State:
        if not state.editing.num_selected or self.how not in HOWS:
            return state.with_editing(hiding=None)
        before = state.editing.hiding or Hiding(self.how, state.editing.margin)
        return state.with_editing(hiding=replace(before, how=self.how))


@dataclass(frozen=True)
class SetMargin:
    """How far around the selection is hidden with it, of a photo's longer side."""

    margin: float

    def apply(self, state: State) -> State:
        if state.editing.hiding is None:
            return state
        margin = min(max(self.margin, 0.0), RECIPE_DEFAULTS.most_margin)
        return state.with_editing(hiding=replace(state.editing.hiding, margin=margin), margin=margin)


@dataclass(frozen=True)
class MarginsFound:
    """The margin from which on each Gaussian is hidden with what `marks` select: (N,) float32 bytes."""

    marks: Marks = field(repr=False)
    least: bytes = field(repr=False)

    def apply(self, state: State) -> State:
        asked = state.editing.hiding
        if asked is None or state.editing.marks != self.marks:
            return state  # what is to be hidden now is on its way
        return state.with_editing(hiding=replace(asked, least=self.least, of=self.marks))


@dataclass(frozen=True)
class HideForGood:
    """Hide the selection in scene and photos, as was chosen."""

    how: str
    margin: float

    def apply(self, state: State) -> State:
        if not state.editing.num_selected:
            return state
        job = Job(HIDING, "looking", started=state.now)
        return state.with_editing(hiding=None).with_scene(job=job)


@dataclass(frozen=True)
class HiddenForGood(Remade):
    """With what its marks had selected hidden. said: what was done."""

    REFUSED = "Nothing was hidden, since the scene was edited in the meantime; hide it again."

    said: str


@dataclass(frozen=True)
class RememberUnhidden:
    """The scene as it was before something in it was hidden, until it is saved without that."""

    room: Room

    def apply(self, state: State) -> State:
        path, files = self.room.info.path, state.scene.shown_by
        files = files if path is None or path in files else (*files, path)
        return state.with_scene(unhidden=replace(self.room, unhidden=None), shown_by=files)


@dataclass(frozen=True)
class BringBack:
    """Go back to the scene as it was before something was hidden."""

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class CopySelection:
    """Copy the selection; the copy is selected, with the gizmo in hand."""

    def apply(self, state: State) -> State:
        if not state.editing.num_selected:
            return state
        return state.with_scene(job=Job(COPYING, "copying", started=state.now))


@dataclass(frozen=True)
class FillSelection:
    """Take the selection away, and fill its hole from what is around it."""

    def apply(self, state: State) -> State:
        if not state.editing.num_selected:
            return state
        return state.with_scene(job=Job(FILLING, "looking", started=state.now))


@dataclass(frozen=True)
class PickSource:
    """What the clone brush copies is at this place; None: nothing was there."""

    spot: Spot | None

    def apply(self, state: State) -> State:
        return state.with_editing(asked=None, source=self.spot or state.editing.source)


@dataclass(frozen=True)
class ForgetSource:
    """The next click says what the clone brush copies."""

    def apply(self, state: State) -> State:
        return state.with_editing(source=None)


@dataclass(frozen=True)
class SetFit:
    """Whether copies are scaled until they lie as close together as what they cover."""

    fit: bool

    def apply(self, state: State) -> State:
        return state.with_editing(fit=self.fit)


@dataclass(frozen=True)
class CloneStroke:
    """Lay what is round the source where the brush went; one stroke after the other."""

    region: Region

    def apply(self, state: State) -> State:
        state = state.with_editing(drag=())
        if state.editing.source is None or state.scene.job is not None:
            return state
        return state.with_scene(job=Job(CLONING, "looking", started=state.now))
