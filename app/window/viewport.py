"""The picture in the middle: which splat passes to run, and which texture shows the result.

Owns the `SplatRenderer`. Draws a new picture only when the pose, the panel, the scene or what
is asked for has changed; a new phrase on a resting picture is a query pass and no splat pass.
"""

import logging
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from langflash_core import pictures
from langflash_core.errors import GraphicsError
from langflash_core.geometry.poses import START, Pose, to_camera
from langflash_core.graphics import draws_in_software
from langflash_core.pictures import Picture
from langflash_core.scene.changes import Change, Recoloured
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask

from .artist import Artist, Asked
from .asking.state import Prompt
from .editing.state import Point, Reading, strongest
from .governor import SETTLE_AFTER, Governor, Kind, Plan
from .scene.memory import SceneMemory
from .scene.near import fills_gaps, keeps_near
from .scene.state import possible
from .state import State

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Camera, Frame, Scene

    from ..gl import SplatRenderer
    from ..gl.still import Still


log = logging.getLogger(__name__)

BACKGROUND = (0.055, 0.06, 0.07)  # the theme's canvas
STILLS = (0.5, 1.0)
"""Scales of the still pictures that follow each other where OpenGL runs on the processor."""
LONG_SECONDS = 0.1  # a picture that took as long is painted in the next frame, and so is a scene's first
MOST_THREADS = 8  # of a still picture
RETRY_SECONDS = 5.0  # until a still picture that could not be drawn is tried again
SHOWN_ALPHA = 0.5  # as in the answers: from here on a pixel shows the scene


@dataclass(frozen=True)
class _Drawn:
    """What the renderer's buffers hold."""

    serial: int
    pose: Pose
    size: tuple[int, int]  # of the panel, pixels
    plan: Plan
    marked: int

    def at(self, kind: Kind, scale: float) -> "_Drawn":
        """The same seen in another plan."""
        return replace(self, plan=Plan(kind, scale))


@dataclass(frozen=True)
class View:
    """A picture at rest, read back for the worker to score. lapses: as `Asking.lapses` is."""

    serial: int
    keys: tuple[int, ...]
    frame: "Frame"
    relevance: "Tensor"
    camera: "Camera"
    query: "CompiledQuery"
    lapses: int


class Viewport:
    """Draws the scene into textures of `ctx`. Main thread only; `release` may be called twice."""

    def __init__(self, ctx: moderngl.Context, notify: Callable[[], None] = lambda: None) -> None:
        """notify: called from a thread when `update` has something new to show."""
        self._ctx = ctx
        self._notify = notify
        self._artist: Artist | None = None  # where OpenGL runs on the processor
        self._failed: tuple[object, float] | None = None  # the order that came to nothing, and when
        self._fresh = False  # a scene has just been taken
        self._unpainted = False  # a picture was drawn that the next frame paints
        self._carried = True  # whether Gaussians have their numbers for the query
        self._warming: Iterator[None] | None = None
        self._still: Still | None = None  # that is on show
        self._finished: tuple[_Drawn, Still, float] | None = None  # to be shown; seconds that it took
        self._renderer: SplatRenderer | None = None
        self._serial = 0
        self._query: CompiledQuery | None = None
        self._question = 0  # how many were asked so far; names the query
        self._keys: tuple[int, ...] = ()
        self._lapses = 0  # when the query was compiled
        self._drawn: _Drawn | None = None
        self._camera: Camera | None = None
        self._pose = START
        self._size = (0, 0)  # of the panel, pixels
        self._moved = 0.0
        self._marks: tuple[Marks | None, Mask | None, Change | None] = (None, None, None)
        self._scene: Scene | None = None  # as edits moved and recoloured it
        self._adjusting = False  # what is drawn changes with every frame
        self._shown: tuple[np.ndarray, np.ndarray] | None = None  # and tints, as the renderer has them
        self._marked = 0  # how often; names the marks in what is drawn
        self._answered: tuple | None = None
        self._colouring: tuple | None = None
        self._texture: moderngl.Texture | None = None
        self.governor = Governor()
        self.picture_seconds = 0.0
        self.picture_size = (0, 0)

    @property
    def texture(self) -> moderngl.Texture | None:
        """The picture to show, or None before the first scene, and where one that failed took its texture."""
        shown = self._texture
        return shown if shown is not None and hasattr(shown.mglo, "use") else None

    @property
    def passes(self) -> tuple[tuple[str, int], ...]:
        """Passes run so far, by kind."""
        return () if self._renderer is None else tuple(sorted(self._renderer.passes.items()))

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the first and the last colour of the depth picture, scene units."""
        return (0.0, 1.0) if self._renderer is None else self._renderer.depth_range

    def _made(self) -> "SplatRenderer":
        """The renderer, once torch is loaded."""
        if self._renderer is None:
            from ..gl import SplatRenderer, moving_renderer  # loads torch; the worker has by now

            make = moving_renderer if draws_in_software(self._ctx) else SplatRenderer
            self._renderer = make(self._ctx)
        return self._renderer

    def warm(self) -> bool:
        """Compile shaders while there is no scene, one a call at the most; whether there is more to do."""
        if self._serial:
            return False
        try:
            if self._warming is None:
                from ..gl.warming import warm_up

                renderer = self._made()
                self._warming = warm_up(renderer.canvas, renderer.splats)
            return next(self._warming, self) is not self
        except (GraphicsError, moderngl.Error):  # whoever needs that shader will say so
            log.exception("a shader could not be compiled ahead")
            return False

    def set_scene(self, serial: int, scene: "Scene") -> None:
        """Upload a scene; the first one builds the renderer. What pictures of another took is given back.

        Raises:
            GraphicsError: the OpenGL here cannot do it.
        """
        from langflash_core.scene.thin import coarse_share

        self._warming = None
        renderer = self._made()
        governor = Governor(len(scene.gaussians), renderer.in_software, coarse_share(scene))
        renderer.set_scene(scene, governor.share)
        renderer.canvas.forget()
        renderer.ask(None)
        self._serial, self._query, self._keys = serial, None, ()
        self._drawn = self._texture = self._colouring = self._answered = None
        self._marks, self._scene = (None, None, None), scene
        self._shown: tuple[np.ndarray, np.ndarray] | None = None
        self._still = self._finished = self._failed = None
        self._fresh, self._unpainted = True, False
        if self._artist is not None:
            self._artist.drop()
        elif renderer.in_software:
            self._artist = Artist(self._notify)
        self.governor = governor

    @property
    def shares(self) -> tuple[float, ...]:
        """Of the scene's Gaussians, that moving through it wants; `thin` takes them."""
        return self.governor.wants

    def thin(self, scene: "Scene", share: float, thinned: "Scene", rows: np.ndarray) -> None:
        """A share of the scene's Gaussians is made."""
        if self._renderer is not None:
            self._renderer.give_level(scene, share, thinned, rows)
            self.governor = self.governor.with_share(share)

    def ask(self, keys: tuple[int, ...], query: "CompiledQuery | None", lapses: int = 0) -> None:
        """Ask the prompts `keys`, in the order of `query`, compiled when `Asking.lapses` was `lapses`;
        None asks nothing."""
        self._keys, self._query, self._lapses = keys, query, lapses
        self._question += 1
        self._colouring = self._answered = None
        self._carried = query is None
        if self._renderer is not None:
            self._renderer.ask(query)

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
        if self._renderer is None or marks is None or memory is None:
            return
        if (marks, doomed, gesture) == self._marks:
            return
        before, _, adjusted = self._marks
        self._marks, self._adjusting = (marks, doomed, gesture), gesture is not None
        if (marks.changes, gesture) != (before.changes if before else (), adjusted):
            self._scene = memory.changed(marks, gesture)
            self._renderer.change((*marks.changes, *(() if gesture is None else (gesture,))))
        tints = np.zeros(marks.selected.count, np.uint8)
        if not isinstance(gesture, Recoloured):  # its colour is to be seen
            tints[marks.selected.rows()] = 1
        if doomed is not None:
            tints[doomed.rows()] = 2
        self._shown = marks.visible.rows(), tints
        self._renderer.mark(*self._shown)
        self._marked += 1

    @property
    def pose(self) -> Pose:
        """Where the picture was asked for from, last."""
        return self._pose

    @property
    def size(self) -> tuple[int, int]:
        """Of the picture's place, framebuffer pixels."""
        return self._size

    @property
    def drawn(self) -> object:
        """Names the picture that is drawn; another value, another picture."""
        return self._drawn

    def read(self, at: Point) -> tuple[Reading, np.ndarray | None] | None:
        """What the picture shows at a point of its place, and the weights (K,) there.

        The weights are None where the weight maps are not drawn; all is None before a picture.
        """
        if self._renderer is None or self._drawn is None or self._camera is None:
            return None
        width, height = self.picture_size
        x = min(max(int(at[0] * width / self._drawn.size[0]), 0), width - 1)
        y = min(max(int(at[1] * height / self._drawn.size[1]), 0), height - 1)
        alpha, depth, weights = self._renderer.pixel(x, y)
        if alpha < SHOWN_ALPHA:
            return Reading(at, atoms=None if weights is None else ()), weights
        K, viewmat = self._camera.K.double().numpy(), self._camera.viewmat.double().numpy()
        across = np.array([(x + 0.5 - K[0, 2]) / K[0, 0], (y + 0.5 - K[1, 2]) / K[1, 1]])
        pos_c = np.array([*(across * (1.0 if self._camera.orthographic else depth)), depth])
        place = viewmat[:3, :3].T @ (pos_c - viewmat[:3, 3])
        point = (float(place[0]), float(place[1]), float(place[2]))
        return Reading(at, point, depth, None if weights is None else strongest(weights)), weights

    def update(self, state: State, size: tuple[int, int], touched: float) -> float:
        """Bring the picture up to date; returns seconds until it wants to be called again.

        size: of the panel in framebuffer pixels. touched: when the last key or pointer event came,
        on the clock of `state.now`.
        """
        if self._renderer is None or state.scene.info is None or min(size) < 8:
            return float("inf")
        if (state.scene.pose, size) != (self._pose, self._size) or self._adjusting:
            self._adjusting = False
            self._pose, self._size, self._moved = state.scene.pose, size, state.now
            self._failed = None
        if self._fresh:  # to take a scene took a frame's time
            self._fresh = False
            return 0.0
        kind = _kind(state)
        if self._artist is not None:
            return self._update_beside(self._artist, state, size, kind)
        still = state.now - max(self._moved, touched)
        resting = self.governor.resting(kind, still)
        wanted = _Drawn(
            self._serial, state.scene.pose, size, resting or self.governor.moving(kind), self._marked
        )
        if not self._covers(wanted):
            self._draw(wanted, moving=resting is None)
        self._colour(state)
        return self.governor.next_rest(still)

    def _update_beside(self, artist: Artist, state: State, size: tuple[int, int], kind: Kind) -> float:
        """`update` where OpenGL runs on the processor: small pictures at once, still ones by the artist."""
        still = state.now - self._moved
        moving = Kind.COLOUR if kind is Kind.FAST and self._query is None else kind
        wanted = _Drawn(self._serial, state.scene.pose, size, self.governor.moving(moving), self._marked)
        if self._unpainted:
            self._unpainted = False
        elif not self._covers(wanted):
            if not self._carried and self._renderer is not None:
                self._carried = True
                if wanted.plan.kind is Kind.FAST:
                    self._renderer.carry(wanted.plan.share)
                    return 0.0
            first = self._drawn is None
            self._draw(wanted, moving=True)
            self._unpainted = first or self.picture_seconds > LONG_SECONDS
            if self._unpainted:
                return 0.0
        done = artist.take()
        if done is not None:
            self._failed = (done[0], state.now) if done[1] is None else None
        if done is not None and done[1] is not None and isinstance(done[0], _Drawn):
            self._finished = done[0], *done[1]
        self._bring(wanted, state)
        if still >= SETTLE_AFTER:
            self._order(artist, wanted, Kind.COLOUR if kind is Kind.COLOUR else Kind.MAPS, state)
        else:
            artist.drop()
        self._colour(state)
        if still < SETTLE_AFTER:
            return max(SETTLE_AFTER - still, 0.0)
        return float("inf") if self._failed is None else max(self._failed[1] + RETRY_SECONDS - state.now, 0.0)

    def _order(self, artist: Artist, wanted: _Drawn, kind: Kind, state: State) -> None:
        """The next still picture, or what the one on show does not tell yet. A moving one is none, however
        large it is: it ends footprints early."""
        finer = (scale for scale in STILLS if scale >= wanted.plan.scale)  # a coarser one would be drawn over
        moving = self._still is None
        scales = (scale for scale in finer if moving or not self._covers(wanted.at(kind, scale)))
        scale = next(scales, None)
        if scale is None or self._finished is not None:
            still = self._still if self._finished is None else self._finished[1]
            if still is not None and not self._tells(still, state):
                asked, name = self._questions(state), (still.key, self._question, state.scene.mode)
                if not self._waits(name, state.now):
                    artist.order(name, lambda stopping: asked(still) or True)
            else:
                self._failed = None  # there is all that is wanted
            return
        name = wanted.at(kind, scale)
        if self._waits(name, state.now):
            return
        width, height = (max(8, round(side * scale)) for side in wanted.size)
        camera, info, shown = to_camera(wanted.pose, width, height), state.scene.info, self._shown
        assert info is not None
        asked, scene, maps = self._questions(state), self._scene or info.scene, kind is Kind.MAPS

        def work(stopping: Asked) -> "tuple[Still, float]":
            from ..gl.still import draw_still

            start = time.perf_counter()
            threads = min(os.cpu_count() or 1, MOST_THREADS)
            drawn = draw_still(
                scene, camera, marks=shown, weight_maps=maps, threads=threads, stopping=stopping
            )
            asked(drawn)
            return drawn, time.perf_counter() - start

        artist.order(name, work)

    def _waits(self, name: object, now: float) -> bool:
        """Whether an order came to nothing a moment ago, in whatever plan, and is not tried again yet."""
        if self._failed is None or now >= self._failed[1] + RETRY_SECONDS:
            return False
        failed = self._failed[0]
        if isinstance(name, _Drawn) and isinstance(failed, _Drawn):
            return name == replace(failed, plan=name.plan)
        return name == failed

    def _questions(self, state: State) -> "Callable[[Still], None]":
        """What is to be made of a still picture on the artist's thread, so that showing it is quick."""
        query, columns = self._query, None
        if state.scene.mode.columns and self._renderer is not None:
            columns = self._renderer.columns(state.scene.mode.columns == "features")

        def ask(still: "Still") -> None:
            if still.maps is not None:
                if query is not None:
                    still.maps.relevance(query)
                if columns is not None:
                    still.maps.mixed(columns)
            _ = still.frame

        return ask

    def _tells(self, still: "Still", state: State) -> bool:
        """Whether showing a still picture in the present mode needs no long work."""
        if still.maps is None:
            return True
        if self._query is not None and not still.maps.answers(self._query):
            return False
        if not state.scene.mode.columns or self._renderer is None:
            return True
        return still.maps.mixes(self._renderer.columns(state.scene.mode.columns == "features"))

    def _bring(self, wanted: _Drawn, state: State) -> None:
        """Show the still picture that is finished, once it tells all that is asked of it."""
        if self._finished is None:
            return
        name, still, seconds = self._finished
        if replace(name, plan=wanted.plan) != wanted:
            self._finished = None  # of what is no longer on show
        if self._finished is None or not self._tells(still, state) or self._renderer is None:
            return
        self._finished = self._drawn = None
        self._renderer.bring(still, BACKGROUND)
        self._camera, self._drawn, self._still, self._colouring = still.camera, name, still, None
        self.picture_seconds = seconds
        self.picture_size = (still.camera.width, still.camera.height)

    @property
    def settling(self) -> bool:
        """Whether a finer picture than the one on show is being drawn."""
        return self._artist is not None and self._artist.busy

    def view(self, state: State) -> View | None:
        """The resting view to score, once per picture and query; None when there is nothing new."""
        drawn = self._drawn
        if self._renderer is None or self._query is None or drawn is None or self._camera is None:
            return None
        if drawn.plan.kind is not Kind.MAPS or state.now - self._moved < SETTLE_AFTER:
            return None
        if self._lapses != state.asking.lapses:
            return None  # the query that holds now is on its way
        if (drawn.pose, drawn.size, drawn.marked) != (state.scene.pose, self._size, self._marked):
            return None  # and so is the picture
        key = (drawn, self._question)
        if key == self._answered:
            return None
        if self._still is not None and not self._tells(self._still, state):
            return None
        self._answered = key
        if self._still is not None and self._still.maps is not None:
            frame, relevance = self._still.frame, torch_of(self._still.maps.relevance(self._query))
        else:
            frame, relevance = self._renderer.frame(), self._renderer.relevance()
        return View(drawn.serial, self._keys, frame, relevance, self._camera, self._query, self._lapses)

    @property
    def failing(self) -> bool:
        """Whether the finer picture could not be drawn; it is tried again."""
        return self._failed is not None

    def release(self) -> None:
        """Free what the renderer holds."""
        if self._artist is not None:
            self._artist.stop()
            self._artist = None
        self._warming = None
        if self._renderer is not None:
            self._renderer.release()
            self._renderer = None
        self._texture = None

    def _covers(self, wanted: _Drawn) -> bool:
        """Whether the buffers already hold at least what is wanted."""
        drawn = self._drawn
        if drawn is None or drawn != replace(wanted, plan=drawn.plan):
            return False
        return drawn.plan.covers(wanted.plan)

    def _draw(self, wanted: _Drawn, moving: bool) -> None:
        assert self._renderer is not None
        plan = wanted.plan
        width, height = (max(8, round(side * plan.scale)) for side in wanted.size)
        self._camera = to_camera(wanted.pose, width, height)
        self._renderer.upload(plan.share)  # once, and no matter of what pictures cost
        start = time.perf_counter()
        self._drawn = None  # should it fail: what was drawn may have made room for it
        self._renderer.draw(
            self._camera,
            background=BACKGROUND,
            weight_maps=plan.kind is Kind.MAPS,
            fast=plan.kind is Kind.FAST,
            share=plan.share,
        )
        self._ctx.finish()  # software and hardware alike: the time of the picture, not of the call
        seconds = time.perf_counter() - start
        self.governor = self.governor.learn(plan, seconds, moving)
        self.picture_seconds, self.picture_size = seconds, (width, height)
        self._drawn, self._colouring, self._still = wanted, None, None

    def _colour(self, state: State) -> None:
        """Choose the texture for the mode; repaint it only when something it shows has changed."""
        renderer, drawn = self._renderer, self._drawn
        if renderer is None or drawn is None:
            return
        fill = fills_gaps(state)
        shown = {p.key: p for p in state.asking.prompts}
        asked = [shown[key] for key in self._keys if key in shown]
        mode = state.scene.mode if drawn.plan.covers(replace(drawn.plan, kind=_kind(state))) else pictures.RGB
        if (mode.answers and (not asked or len(asked) != len(self._keys))) or not possible(
            mode, state.scene.info
        ):
            mode = pictures.RGB
        answers = mode.answers or bool(mode.columns)
        if answers and self._still is not None and not self._tells(self._still, state):
            return  # what is on show stays until the answer is there
        active = next((i for i, p in enumerate(asked) if p.key == state.asking.active), 0)
        colours = state.heat_colours
        faded = mode is pictures.RGB and keeps_near(state, drawn.pose)
        colouring = (
            mode,
            active,
            state.asking.atom,
            faded,
            fill,
            tuple((p.colour, p.cut, p.shown_from) for p in asked),
            colours,
        )
        if colouring != self._colouring:
            self._colouring = colouring
            renderer.fill(fill)
            self._texture = (
                renderer.faded_texture() if faded else self._painted(renderer, mode, asked, active, state)
            )

    def _painted(
        self, renderer: "SplatRenderer", mode: Picture, asked: list[Prompt], active: int, state: State
    ) -> moderngl.Texture:
        """The texture that shows a mode; `asked` in the order of the query, not empty where it `answers`."""
        from ..gl.paints import PAINTS, Wanted  # loads torch; the worker has by now

        shown_from = asked[active].shown_from if asked else 0.0
        colours, cuts = np.array([p.colour for p in asked]), np.array([p.cut for p in asked])
        wanted = Wanted(colours, cuts, active, shown_from, state.asking.atom, state.heat_colours)
        return PAINTS[mode](renderer, wanted)


def torch_of(values: np.ndarray) -> "Tensor":
    """The same numbers as a tensor."""
    import torch

    return torch.from_numpy(values)


def _kind(state: State) -> Kind:
    """What a picture must hold to show what is wanted while the camera moves."""
    if not state.wants_maps or state.scene.info is None or state.scene.info.num_atoms == 0:
        return Kind.COLOUR
    return Kind.MAPS if state.scene.mode.maps else Kind.FAST
