"""The scene on show fitted to its photos: what can happen, and the worker's side.

The scene stays on show meanwhile, and edits go on: no Gaussian comes or goes, so they hold for the better
scene, too. The one before is a room to go back to.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from langflash_core.errors import Cancelled

from ..commands import Notify
from ..requests import Asked
from ..requests import Job as Work
from ..state import State
from .commands import SceneArrived
from .state import IMPROVING, Job, Room, SceneInfo

SECONDS = 60.0
_NAME = " (improved)"


def can_improve(state: State) -> bool:
    """Whether there is something to improve, and nothing else under way."""
    info = state.scene.info
    if info is None or state.scene.job is not None:
        return False
    scene = info.scene
    return len(info.views) > 1 and len(scene.photos) == len(info.views) and scene.view_ids is not None


@dataclass(frozen=True)
class Improve:
    """Fit the scene on show to its photos, for a minute."""

    def apply(self, state: State) -> State:
        if not can_improve(state):
            return state
        return state.with_scene(job=Job(IMPROVING, "refine", started=state.now))


@dataclass(frozen=True)
class Improved:
    """The scene with number `serial` as the fit left it, None: nothing was gained. said: what came of it."""

    serial: int
    info: SceneInfo | None
    said: str

    def fits(self, state: State) -> bool:
        """Whether the scene that was improved is on show."""
        return state.scene.info is not None and state.scene.info.serial == self.serial

    def apply(self, state: State) -> State:
        if not self.fits(state):
            text = "Nothing was improved, since another scene is on show by now; improve it again."
            return Notify(text).apply(state.with_scene(job=None))
        return Notify(self.said, "info").apply(state.with_scene(job=None))

    def arrival(self, state: State) -> SceneArrived | None:
        """What brings it into a state that it fits, with the edits that there are; from where one stands."""
        if self.info is None:
            return None
        editing, scene = state.editing, state.scene
        room = Room(self.info, scene.photos, editing.history, editing.saved, scene.pose)
        return SceneArrived(replace(self.info, history=editing.history), room=room)


@dataclass(frozen=True)
class ImproveScene(Work):
    """Runs `Improve`."""

    info: SceneInfo = field(repr=False)
    seconds: float = SECONDS

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> Improved:
        from langflash_core.mending.improving import improve
        from langflash_core.splat.refine import Budget

        from .work import describe_scene

        def told(what: str, fraction: float) -> None:
            if cancelled():
                raise Cancelled("stopped")
            progress(f"refine: {what}", fraction)

        own = self.info
        result = improve(own.scene, Budget(self.seconds), told)
        before, after = result.held_out
        judged = f"photo {result.view + 1}, held out, {before:.2f} dB, then {after:.2f} dB"
        if not result.kept:
            return Improved(own.serial, None, f"Nothing was gained ({judged}), so the scene stays as it is.")
        name = own.name.removesuffix(".langflash").removesuffix(_NAME) + _NAME
        said = f'Improved: {judged}. The scene before is one click away, beside "Photos".'
        return Improved(own.serial, describe_scene(result.scene, serial, name), said)
