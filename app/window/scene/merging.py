"""What takes the place of the scene on show and goes on from it: two scenes as one, or the same made anew."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from langflash_core.scene.edits import Marks, delete, deny_atom
from langflash_core.scene.mask import Mask

from ..commands import Notify
from ..state import State
from .commands import SceneArrived, room_of
from .state import Job, SceneInfo

_UNSEEN, _ALL_UNSEEN = 0.1, 0.995  # shares of what fills a hole, from which people are told
NOTHING_TO_MERGE = "There is no scene to merge into; open one first."


@dataclass(frozen=True)
class Remade:
    """The scene with number `serial`, as its marks had edited it, made anew. REFUSED: what is said where it
    was edited meanwhile."""

    REFUSED: ClassVar[str]

    serial: int
    marks: Marks
    info: SceneInfo

    def fits(self, state: State) -> bool:
        """Whether nothing has been edited meanwhile."""
        info = state.scene.info
        return info is not None and info.serial == self.serial and state.editing.marks == self.marks

    def apply(self, state: State) -> State:
        if self.fits(state):
            return state
        return Notify(self.REFUSED).apply(state.with_scene(job=None))

    def arrival(self, state: State) -> SceneArrived:
        """What brings it into a state that it fits: the view stays."""
        room = replace(room_of(state, self.info), history=None, saved=None)
        return SceneArrived(self.info, room=room, replaces=True)


@dataclass(frozen=True)
class MergeScene:
    """Put what a scene file holds beside what is on show; replaces a job under way."""

    path: Path

    def apply(self, state: State) -> State:
        if state.scene.info is None:
            return Notify(NOTHING_TO_MERGE).apply(state)
        job = Job(f"Merging {self.path.name}", "reading", started=state.now)
        return replace(state.with_scene(job=job), dialog=None)


@dataclass(frozen=True)
class AddToScene:
    """Make the scene on show, as it is edited, with a layer of each of these photos; it is left as it is, one
    click away. Replaces a job under way."""

    photos: tuple[Path, ...]

    def apply(self, state: State) -> State:
        job = Job(f"Adding {called_photos(self.photos)}", "photos", started=state.now)
        return replace(state.with_scene(job=job), dialog=None)


def called_photos(photos: tuple[Path, ...]) -> str:
    """The one photo's name, or how many there are."""
    return photos[0].name if len(photos) == 1 else f"{len(photos)} photos"


def can_grow(state: State, count: int) -> bool:
    """Whether so many photos can be added to the scene on show as it is: it has layers, keeps its photos, and
    not most of it would be new."""
    scene = None if state.scene.info is None else state.scene.info.scene
    return scene is not None and scene.layered and bool(scene.photos) and count < scene.num_views


@dataclass(frozen=True)
class Merged:
    """The scene with number `serial`, of which there was so much, and another as one scene; or, where `gone`
    says what was taken away, what fills its hole, or stands for it but is not what is `denied`; or `copied`,
    copies of what was selected, or laid over what is `gone`. beyond: how much of `gone` was not selected.
    unseen: share of what fills the hole that no photo saw."""

    serial: int
    there: tuple[int, int]
    info: SceneInfo
    name: str
    gone: Mask | None = None
    copied: bool = False
    denied: str = ""
    beyond: int = 0
    unseen: float = 0.0

    @property
    def said(self) -> str:
        """What people should know of it, or nothing."""
        if self.gone is None:
            return ""
        own, told = len(self.gone) - self.beyond, []
        if self.beyond:
            why = "along its edge, or in its place in other photos,"
            told.append(f"{self.beyond:,} Gaussians {why} went with the {own:,} selected.")
        if self.unseen >= _UNSEEN:
            share = f"{self.unseen:.0%} of " if self.unseen < _ALL_UNSEEN else ""
            told.append(f"No photo shows {share}what was behind it, so what is around goes on there.")
        return " ".join(told)

    def fits(self, state: State) -> bool:
        """Whether it still holds the scene on show."""
        marks = state.editing.marks
        return (
            state.scene.info is not None
            and state.scene.info.serial == self.serial
            and (marks is not None and marks.there == self.there)
        )

    def apply(self, state: State) -> State:
        if self.fits(state):
            return state
        text = f"{self.name} was not merged, since another scene is open now; merge it again."
        if self.denied:
            text = "Nothing was removed, since the scene has changed; click it again."
        elif self.copied:
            text = "Nothing was copied, since the scene has changed; copy it again."
        elif self.gone is not None:
            text = "Nothing was filled, since the scene has changed; fill it again."
        return Notify(text).apply(state.with_scene(job=None))

    def arrival(self, state: State) -> SceneArrived:
        """What brings it into a state that it fits: the merge is one more edit, its things selected."""
        history, saved = state.editing.history, state.editing.saved
        assert self.info.history is not None and history is not None
        whole = self.info.history.marks
        count = whole.there[0]
        before = history.of_size(self.there[0], history.marks.atoms[: self.there[1]])
        before = before.of_size(count, whole.atoms)
        brought = Mask.full(count) - Mask.first(count, self.there[0])
        after, label = replace(before.marks, there=whole.there, selected=brought), f"Merge {self.name}"
        if self.gone is not None:
            kept = before.marks.selected if self.denied or self.copied else Mask.none(count)
            after = delete(replace(after, selected=kept), self.gone.of_count(count))
            label = f"Clone {len(brought):,}" if self.copied else f"Delete and fill {len(self.gone):,}"
            if self.denied:
                after = deny_atom(after, whole.there[1] - 1, self.denied)
                label = f"Remove a part of {self.denied}"
        elif self.copied:
            label = f"Copy {len(brought):,}"
        history = before.edited(label, after)
        if saved is not None:
            saved = saved.of_size(self.there[0], saved.atoms[: self.there[1]]).of_size(count, whole.atoms)
        room = replace(room_of(state, self.info), history=history, saved=saved)
        return SceneArrived(replace(self.info, history=history), room=room, replaces=True)
