"""The picture in the middle: owns the renderer, and what draws the scene with it (`drawing`).

Draws a new picture only when the pose, the panel, the scene or what is asked for has changed; a new phrase on
a resting picture is a query pass and no splat pass. No torch before the first scene, or the first shader.
"""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import moderngl
import numpy as np
from jaxtyping import UInt8

from langflash_core.base.graphics import draws_in_software
from langflash_core.base.memory import peak_memory_mb
from langflash_core.errors import GraphicsError
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.changes import Change
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask

from .drawing.marked import Marked
from .drawing.picture import ScenePicture
from .drawing.values import Stand, View
from .editing.state import Point, Reading
from .governor import Around, Governor
from .scene.memory import SceneMemory
from .state import State, Stats

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Scene

    from ..gl import SplatRenderer
    from ..gl.scene import Thinned
    from ..gl.tiled.trial import Steps, Way

log = logging.getLogger(__name__)

_PATIENCE = 2.0  # seconds, at the end, for a picture that is being drawn


class Viewport:
    """Draws the scene into textures of `ctx`. Main thread only; `release` may be called twice.

    `picture`: who draws the present scene; None before the first one.
    """

    def __init__(self, ctx: moderngl.Context, notify: Callable[[], None] = lambda: None) -> None:
        """notify: called from a thread when `update` has something new to show."""
        self.picture: ScenePicture | None = None
        self._ctx = ctx
        self._notify = notify
        self._renderer: SplatRenderer | None = None
        self._before: moderngl.Texture | None = None  # shown until a changed scene has a picture
        self._warming: Iterator[None] | None = None
        self._stand = Stand()
        self._adjusting = False  # what is drawn changes with every frame
        self._fresh = False  # a scene has just been taken
        self._wanted, self._way = "measured", ""  # how splats are drawn: as preferred, and as they are
        self._trial: Steps | None = None  # which says how, under way
        self._awaited: tuple[int, Scene, Governor] | None = None  # a large scene, whose share is to come
        self._around: Around | None = None  # where the share of a huge scene was chosen
        self._choosing = False  # it anew, on the worker's thread
        self._asked: tuple[tuple[int, ...], CompiledQuery | None, int] | None = None  # of it, meanwhile

    def _made(self) -> "SplatRenderer":
        """The renderer, once torch is loaded."""
        if self._renderer is None:
            from ..gl import SplatRenderer, moving_renderer  # loads torch; the worker has by now

            make = moving_renderer if draws_in_software(self._ctx) else SplatRenderer
            self._renderer = make(self._ctx)
            self._choose(self._renderer)
        return self._renderer

    def draw_with(self, wanted: str) -> None:
        """How to draw splats from the next picture on, one of `preferences.RASTERISERS`."""
        self._wanted = wanted
        if self._renderer is not None:
            self._choose(self._renderer)

    def _choose(self, renderer: "SplatRenderer") -> None:
        from ..gl.tiled.trial import chosen, trying

        way = chosen(self._ctx, self._wanted)
        self._end_trial()
        if way is None:
            self._trial = trying(self._ctx)
        self._take(renderer, way or "quads")

    def _take(self, renderer: "SplatRenderer", way: "Way") -> None:
        from ..gl.tiled.trial import maker

        if way != self._way:
            self._way = way
            renderer.draw_with(maker(self._ctx, way))
            if self.picture is not None:
                self.picture.easel.drawn = None

    def _tried(self) -> bool:
        """Go on with the trial by a step; whether there was one to do."""
        trial, self._trial = self._trial, None
        if trial is None:
            return False
        with self._said():
            try:
                next(trial)
                self._trial = trial
            except StopIteration as end:
                self._take(self._made(), end.value)
        return True

    def _end_trial(self) -> None:
        if self._trial is not None:
            self._trial.close()
        self._trial = None

    # --- what to show -----------------------------------------------------------------------

    def warm(self) -> bool:
        """Compile shaders while there is no scene, one a call at the most; whether there is more to do."""
        if self.picture is not None:
            return False
        with self._said():
            from ..gl.warming import warm_up

            renderer = self._made()
            if self._tried():
                return True
            if self._warming is None:
                self._warming = warm_up(renderer.canvas, renderer.splats)
        return self._warmed()

    def _warmed(self) -> bool:
        """Go on with what is compiled ahead by a step; whether there is more to do."""
        more = False
        with self._said():
            more = self._warming is not None and next(self._warming, self) is not self
        return more

    @contextmanager
    def _said(self) -> Iterator[None]:
        try:
            yield
        except (GraphicsError, moderngl.Error):  # whoever needs that shader will say so
            log.exception("a shader could not be compiled ahead")

    def set_scene(self, serial: int, scene: "Scene", changed: bool = False) -> None:
        """Upload a scene; the first one builds the renderer. What pictures of another took is given back.
        A large one, where OpenGL runs on the processor, waits for `thin`. changed: it is the one on show as
        an edit left it, whose last picture stays until there is a new one.

        Raises:
            GraphicsError: the OpenGL here cannot do it.
        """
        self._warming = self._awaited = self._asked = self._around = None
        self._choosing = False
        renderer = self._made()
        self._keep_look(changed)
        if self.picture is not None:
            self.picture.release(patience=0.0)
        self.picture = None
        if draws_in_software(self._ctx):
            from .drawing.processor import ProcessorPicture, governor_of

            governor = governor_of(scene)
            if governor.waits:
                self._awaited = serial, scene, governor
                return
            self._begin(ProcessorPicture(renderer, serial, scene, self._notify), scene)
        else:
            from .drawing.card import CardPicture

            self._begin(CardPicture(renderer, serial, scene), scene)

    def _begin(self, picture: ScenePicture, scene: "Scene") -> None:
        self.picture, renderer = picture, self._made()
        if scene.layered:
            from ..gl.warming import warm_layers

            self._warming = warm_layers(renderer.canvas, renderer.splats)
        self._fresh = True

    def _keep_look(self, changed: bool) -> None:
        """A copy of what is shown, whose texture goes with its picture; none of another scene."""
        shown = self.texture if changed else None
        kept = None
        if shown is not None:
            with suppress(moderngl.Error):  # the new picture comes all the same
                kept = self._ctx.texture(shown.size, shown.components, shown.read(), dtype=shown.dtype)
        self._forget_look()
        self._before = kept

    def _forget_look(self) -> None:
        if self._before is not None:
            self._before.release()
        self._before = None

    def ask(self, keys: tuple[int, ...], query: "CompiledQuery | None", revision: int = 0) -> None:
        """Ask the prompts `keys`, in the order of `query`, compiled when `Asking.revision` was `revision`;
        None asks nothing."""
        self._asked = keys, query, revision
        if self.picture is not None:
            self.picture.ask(keys, query, revision)

    def mark(
        self,
        memory: SceneMemory | None,
        marks: Marks | None,
        doomed: Mask | None,
        gesture: Change | None = None,
    ) -> None:
        """Show the scene as marked: without what is deleted or hidden, the selection in a tint, things where
        they were moved to.

        doomed: what a preview would delete, in another tint. gesture: a change under way.
        """
        if self.picture is None or marks is None or memory is None:
            return
        marked = Marked(memory, marks, doomed, gesture)
        if marked != self.picture.easel.marked:
            self._adjusting = gesture is not None
            self.picture.mark(marked)

    @property
    def shares(self) -> tuple[float, ...]:
        """Of the scene's Gaussians, that moving through it wants; `thin` takes them."""
        governor = self._governor
        if governor is None or governor.huge:  # whose shares are chosen around the eye
            return ()
        return governor.wants if self._awaited is None else (governor.share,)

    @property
    def _governor(self) -> Governor | None:
        """Of the scene on show, or of the one that is to come."""
        if self._awaited is not None:
            return self._awaited[2]
        return None if self.picture is None else self.picture.governor

    def share_around(self, eye: Vector) -> float | None:
        """Of a huge scene's Gaussians, that is to be chosen for this eye; None while what there is serves."""
        governor = self._governor
        if governor is None or not governor.huge or self._choosing:
            return None
        if self._around is not None and self._around.serves(eye):
            return None
        self._choosing = True
        return governor.share

    def thin(self, scene: "Scene", share: float, thinned: "Thinned", around: Around | None = None) -> None:
        """A share of the scene's Gaussians is made, of a huge one around a place.

        Raises:
            GraphicsError: the OpenGL here cannot do it.
        """
        awaited = self._awaited
        if awaited is not None and awaited[1] is scene and awaited[2].share == share:
            from .drawing.processor import ProcessorPicture

            self._awaited = None
            picture = ProcessorPicture(self._made(), awaited[0], scene, self._notify, thinned)
            self._begin(picture, scene)
            if self._asked is not None:
                picture.ask(*self._asked)
        elif self.picture is not None:
            self.picture.easel.renderer.give_level(scene, share, thinned)
            self.picture.governor = self.picture.governor.with_share(share)
        if around is not None:
            self._around, self._choosing = around, False

    def update(self, state: State, size: tuple[int, int], touched: float) -> float:
        """Bring the picture up to date; returns seconds until it wants to be called again.

        size: of the panel in framebuffer pixels. touched: when the last key or pointer event came,
        on the clock of `state.now`.

        Raises:
            GraphicsError: the driver refused tiles; the next picture is of quads.
        """
        if self.picture is None or state.scene.info is None or min(size) < 8:
            return float("inf")
        if (state.scene.pose, size) != (self._stand.pose, self._stand.size) or self._adjusting:
            self._adjusting = False
            self._stand = Stand(state.scene.pose, size, state.now)
        if self._fresh:  # to take a scene took a frame's time
            self._fresh = False
            return 0.0
        if self._warming is not None:
            if self._warmed():
                return 0.0
            self._warming = None
        wait = self._drawn(self.picture, state, touched)
        if self._own is not None:
            self._forget_look()
        resting = wait == float("inf")  # a trial between frames of a moving camera would hold them up
        return 0.0 if resting and self._tried() else wait

    def _drawn(self, picture: ScenePicture, state: State, touched: float) -> float:
        try:
            return picture.update(state, self._stand, touched)
        except moderngl.Error as error:
            if self._way != "tiles":
                raise
            self._take(self._made(), "quads")
            raise GraphicsError(
                "the graphics driver refuses tiles, so quads are drawn; choose Quads under Drawing in the "
                "preferences"
            ) from error

    # --- what is shown ----------------------------------------------------------------------

    @property
    def texture(self) -> moderngl.Texture | None:
        """The picture to show, or None before the first scene, and where one that failed took its texture."""
        return self._before if self._own is None else self._own

    @property
    def _own(self) -> moderngl.Texture | None:
        """The scene's own picture, as it is."""
        shown = None if self.picture is None else self.picture.easel.texture
        return shown if shown is not None and hasattr(shown.mglo, "use") else None

    @property
    def whole(self) -> bool:
        """Whether the picture on show is the finest that there will be."""
        return self.picture is not None and self.picture.whole

    def seen(self) -> UInt8[np.ndarray, "H W 3"] | None:
        """The scene's own picture, read back; None where there is none: what was hidden for good may still be
        in the one before."""
        shown = self._own
        if shown is None:
            return None
        kind = {"f1": np.uint8, "f2": np.float16, "f4": np.float32}[shown.dtype]
        rgb = np.frombuffer(shown.read(), kind).reshape(shown.height, shown.width, -1)[..., :3]
        return rgb if kind is np.uint8 else (rgb.clip(0, 1) * 255 + 0.5).astype(np.uint8)

    @property
    def pose(self) -> Pose:
        """Where the picture was asked for from, last."""
        return self._stand.pose

    @property
    def size(self) -> tuple[int, int]:
        """Of the picture's place, framebuffer pixels."""
        return self._stand.size

    @property
    def drawn(self) -> object:
        """Names the picture that is drawn; another value, another picture."""
        return None if self.picture is None else self.picture.easel.drawn

    def read(self, at: Point) -> tuple[Reading, np.ndarray | None] | None:
        """What the picture shows at a point of its place, and the weights (K,) there.

        The weights are None where the weight maps are not drawn; all is None before a picture.
        """
        return None if self.picture is None else self.picture.easel.read(at)

    def view(self, state: State) -> View | None:
        """The resting view to score, once per picture and query; None when there is nothing new."""
        return None if self.picture is None else self.picture.view(state, self._stand)

    def narrow(self, name: tuple, relevance: "Tensor") -> None:
        """Show this relevance (P, H, W) of the phrases, if the view of that name (`View.name`) is on show."""
        if self.picture is not None:
            self.picture.easel.narrow(name, relevance)

    @property
    def settling(self) -> bool:
        """Whether a finer picture than the one on show is being drawn."""
        return self.picture is not None and self.picture.settling

    @property
    def failing(self) -> bool:
        """Whether the finer picture could not be drawn; it is tried again."""
        return self.picture is not None and self.picture.failing

    def stats(self, frame_seconds: float = 0.0, card: str = "") -> Stats:
        """Figures of the picture on show, beside these of the frame and the graphics device."""
        easel, renderer = None if self.picture is None else self.picture.easel, self._renderer
        return Stats(
            frame_seconds,
            0.0 if easel is None else easel.seconds,
            (0, 0) if easel is None else easel.size,
            f"{card}, {self._way}" if self._way else card,
            (0.0, 1.0) if renderer is None else renderer.depth_range,
            () if renderer is None else tuple(sorted(renderer.passes.items())),
            self.settling,
            self.failing,
            10**6 * (peak_memory_mb() or 0),
        )

    def release(self) -> None:
        """Free what the renderer holds."""
        if self.picture is not None:
            self.picture.release(_PATIENCE)
        self.picture = self._warming = self._awaited = None
        self._forget_look()
        self._end_trial()
        if self._renderer is not None:
            self._renderer.release()
        self._renderer = None
