"""A scene in the viewport, drawn by a graphics card: everything, on the thread of its context."""

from typing import TYPE_CHECKING

from langflash_core.scene.thin import coarse_share

from ...gl import SplatRenderer
from ..governor import Governor
from ..state import State
from .easel import Easel
from .picture import ScenePicture
from .values import Stand, View, kind_of

if TYPE_CHECKING:
    from langflash_core.types import Scene


class CardPicture(ScenePicture):
    """Smaller pictures while something moves, and finer ones step by step at rest."""

    def __init__(self, renderer: SplatRenderer, serial: int, scene: "Scene") -> None:
        """
        Raises:
            GraphicsError: the OpenGL here cannot do it.
        """
        self.governor = Governor(len(scene.gaussians), slow=False, coarse=coarse_share(scene))
        self.easel = Easel(renderer, serial, scene, self.governor.share)

    def update(self, state: State, stand: Stand, touched: float) -> float:
        kind = kind_of(state)
        still = state.now - max(stand.moved, touched)
        resting = self.governor.resting(kind, still)
        wanted = self.easel.wanted(state, stand, resting or self.governor.moving(kind))
        moving = resting is None
        if not self.easel.covers(wanted, late=moving):
            if not self.easel.ready(wanted, moving, late=moving):
                return 0.0
            self.easel.draw(wanted, moving, late=moving)
            self.governor = self.governor.learn(wanted.plan, self.easel.seconds, moving)
        self.easel.paint(state)
        return self.governor.next_rest(still)

    def view(self, state: State, stand: Stand) -> View | None:
        return self.easel.view(state, stand, self.easel.numbers)
