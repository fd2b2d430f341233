"""The worker's side of recovery: scenes and edits written where a crash cannot take them.

Heavy imports wait until they are needed.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from langflash_core.base.files import make_folder
from langflash_core.scene.edits import History, Marks

from ..commands import Command
from ..requests import Asked, SceneTask, Task
from . import edits, records
from .commands import CopyKept, EditsKept, OfferEdits, ProjectsRead
from .state import KeptPhoto

if TYPE_CHECKING:
    from langflash_core.types import Scene


@dataclass(frozen=True)
class KeepCopy(SceneTask):
    """Write a scene that nobody saved where a crash cannot take it; with `marks` as they edit it."""

    scene: "Scene" = field(repr=False)
    path: Path
    marks: Marks | None = None

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.scene.edited import edited_scene
        from langflash_core.scene.file import save

        make_folder(self.path.parent)
        save(self.scene if self.marks is None else edited_scene(self.scene, self.marks), self.path)
        yield CopyKept(self.path)


@dataclass(frozen=True)
class KeepEdits(SceneTask):
    """Write the edits where a crash cannot take them; `token` names the session."""

    scene: "Scene" = field(repr=False)
    history: History = field(repr=False)
    name: str
    path: Path | None
    token: str
    photos: tuple[KeptPhoto, ...] = ()

    def run(self, stopping: Asked) -> Iterator[Command]:
        kept = edits.keep(self.scene, self.history, self.name, self.path, self.token, self.photos)
        yield EditsKept(kept)


@dataclass(frozen=True)
class Forget(Task):
    """Remove what was kept."""

    remove: Callable[[], object]

    def run(self, stopping: Asked) -> Iterable[Command]:
        self.remove()
        return ()


@dataclass(frozen=True)
class LookForEdits(SceneTask):
    """Edits that an earlier session kept: of a scene, or the newest of all."""

    scene: "Scene | None" = field(default=None, repr=False)
    path: Path | None = None

    def run(self, stopping: Asked) -> Iterator[Command]:
        offer = edits.find(self.scene, self.path)
        if offer is not None:
            yield OfferEdits(offer)


@dataclass(frozen=True)
class ReadProjects(Task):
    """What is remembered of recent scenes; nothing of those that have gone."""

    recent: tuple[str, ...]

    light = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield ProjectsRead(tuple(map(records.project, records.sweep(self.recent))))
