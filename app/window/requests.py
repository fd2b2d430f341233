"""What the window asks of the worker: frozen snapshots, nothing shared. A request also says what
becomes of it: run on the worker's thread, it gives the commands that bring its result into the state.

The requests themselves are in each feature's `work`. They import nothing heavy before they run: the
window makes them before torch is loaded.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import ClassVar

from .commands import Command, Notify

Asked = Callable[[], bool]
"""Whether the work is still wanted, or the like; cheap, from any thread."""


class Job(ABC):
    """Makes a scene. The latest one wins and cancels the one under way."""

    @abstractmethod
    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Command:
        """What brings the scene, as number `serial`, into the state.

        Raises:
            LangFlashError: the scene cannot be made; Cancelled among them.
        """


class Task(ABC):
    """Short work, done between jobs and between the stages of one.

    saves: a person asked for it to be written, and the end of the program waits for it.
    newest_counts: a newer one of its kind makes an older one pointless.
    urgent: a picture waits for it, so it comes before what was asked earlier.
    light: needs nothing that the worker loads first, and is not kept waiting for it.
    """

    saves: ClassVar[bool] = False
    newest_counts: ClassVar[bool] = False
    urgent: ClassVar[bool] = False
    light: ClassVar[bool] = False

    @abstractmethod
    def run(self, stopping: Asked) -> Iterable[Command]:
        """What brings the result into the state, as it comes; `stopping`: the program ends.

        Raises:
            LangFlashError: what the library raises.
        """

    def failed(self, sentence: str) -> Iterable[Command]:
        """What to do instead, with a sentence for people."""
        return (Notify(sentence),)


@dataclass(frozen=True)
class SceneTask(Task):
    """A task about the scene with number `serial`; its commands hold for no other."""

    serial: int
