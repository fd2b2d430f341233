"""A scene in the viewport where OpenGL runs on the processor: it draws what moves, small, and threads of
Python what rests (`stills`)."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from langflash_core.scene.thin import coarse_share

from ...gl import SplatRenderer
from ..governor import SETTLE_AFTER, Governor, Kind
from ..state import State
from .easel import Easel
from .picture import ScenePicture
from .stills import Stills
from .values import Drawn, Stand, View, kind_of

if TYPE_CHECKING:
    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Scene

    from ...gl.scene import Thinned

LONG_SECONDS = 0.1  # a picture that took as long is painted in the next frame, and so is a scene's first


def governor_of(scene: "Scene") -> Governor:
    """That a scene begins with."""
    return Governor(len(scene.gaussians), slow=True, coarse=coarse_share(scene))


class ProcessorPicture(ScenePicture):
    """Small pictures at once, still ones beside the frames."""

    def __init__(
        self,
        renderer: SplatRenderer,
        serial: int,
        scene: "Scene",
        notify: Callable[[], None],
        thinned: "Thinned | None" = None,
    ) -> None:
        """
        Args:
            notify: called from a thread when `update` has something new to show. thinned: of a huge scene, to
                `governor_of(scene).share`.

        Raises:
            GraphicsError: the OpenGL here cannot do it.
        """
        self.governor = governor_of(scene)
        self.easel = Easel(renderer, serial, scene, self.governor.share, thinned)
        self.stills = Stills(self.easel, scene, notify)
        self._unpainted = False  # a picture was drawn that the next frame paints
        self._carried = True  # whether Gaussians have their numbers for the query

    def ask(self, keys: tuple[int, ...], query: "CompiledQuery | None", revision: int) -> None:
        super().ask(keys, query, revision)
        self._carried = query is None

    def update(self, state: State, stand: Stand, touched: float) -> float:
        kind, still = kind_of(state), state.now - stand.moved
        moving = Kind.COLOUR if kind is Kind.FAST and self.easel.asked.query is None else kind
        wanted = self.easel.wanted(state, stand, self.governor.moving(moving))
        if not self._drew(wanted, late=still < SETTLE_AFTER):
            return 0.0
        self.stills.collect(stand.moved, state.now)
        self.stills.show(wanted, state)
        if still >= SETTLE_AFTER:
            self.stills.order(wanted, Kind.COLOUR if kind is Kind.COLOUR else Kind.MAPS, state)
        else:
            self.stills.drop()
        self.easel.paint(state, lambda: self.stills.ready(state))
        return max(SETTLE_AFTER - still, 0.0) if still < SETTLE_AFTER else self.stills.retry(state.now)

    def _drew(self, wanted: Drawn, late: bool) -> bool:
        """Whether what moves is there, and this frame has time left; else the next one goes on."""
        if self._unpainted or self.easel.covers(wanted, late):
            self._unpainted = False
            return True
        if not self._carried:
            self._carried = True
            if wanted.plan.kind is Kind.FAST:
                self.easel.renderer.carry(wanted.plan.share)
                return False
        if not self.easel.ready(wanted, True, late):
            return False
        first = self.easel.drawn is None
        self.easel.draw(wanted, True, late)
        self.stills.shown = None
        self.governor = self.governor.learn(wanted.plan, self.easel.seconds)
        self._unpainted = first or self.easel.seconds > LONG_SECONDS
        return not self._unpainted

    def view(self, state: State, stand: Stand) -> View | None:
        return self.easel.view(state, stand, lambda: self.stills.numbers(state))

    @property
    def whole(self) -> bool:
        return self.failing or (self.stills.shown is not None and self.easel.finest)

    @property
    def settling(self) -> bool:
        return self.stills.busy

    @property
    def failing(self) -> bool:
        return self.stills.failing

    def release(self, patience: float) -> None:
        self.stills.stop(patience)
