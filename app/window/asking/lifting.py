"""A splat file of another program answers no phrases until it is taught some: what can happen then, and the
worker's side of it.

Teaching makes another scene, with its own history; the one before is remembered (`Showing.mute`), and Undo
goes back to it. Heavy imports wait until they are needed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from langflash_core.scene.edits import Marks

from ..requests import Asked
from ..requests import Job as Request
from ..scene.merging import Remade
from ..scene.state import Job, Room, SceneInfo
from ..scene.work import describe_scene
from ..state import State

TEACHING = "Teaching it to answer phrases"
"""Title of the job."""
CANNOT = "This file cannot answer phrases yet."
ABOUT = "about 30 s"
"""Without a graphics card: 345,000 Gaussians take 25 s of one core, and the network is read before."""


def can_learn(state: State) -> bool:
    """Whether the scene on show has no language, and nothing else is being made."""
    return state.scene.info is not None and not state.scene.info.num_atoms and state.scene.job is None


@dataclass(frozen=True)
class TeachPhrases:
    """Have the network look at the scene from all over it."""

    def apply(self, state: State) -> State:
        if not can_learn(state):
            return state
        return state.with_scene(job=Job(TEACHING, "drawing", started=state.now))


@dataclass(frozen=True)
class PhrasesTaught(Remade):
    """With language."""

    REFUSED = "It was not taught, since the scene was edited meanwhile; teach it again."


@dataclass(frozen=True)
class RememberMute:
    """The scene as it was before it was taught."""

    room: Room

    def apply(self, state: State) -> State:
        return state.with_scene(mute=self.room)


@dataclass(frozen=True)
class ForgetPhrases:
    """Go back to the scene as it was before it was taught."""

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class LiftScene(Request):
    """The scene as edited, with what the network sees in it."""

    info: SceneInfo
    marks: Marks = field(repr=False)

    def run(self, serial: int, progress: Callable[[str, float], None], cancelled: Asked) -> PhrasesTaught:
        from langflash_core.lift import lift
        from langflash_core.mending.looks import draw_scene
        from langflash_core.scene.edited import edited_scene

        own = self.info
        scene = lift(
            edited_scene(own.scene, self.marks),
            render=lambda scene, camera: draw_scene(scene, camera, weight_maps=False),
            progress=progress,
            cancelled=cancelled,
        )
        return PhrasesTaught(own.serial, self.marks, describe_scene(scene, serial, own.name))
