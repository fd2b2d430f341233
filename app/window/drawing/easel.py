"""The picture on show of one scene: drawn by the renderer to a plan, painted as the mode wants it, read."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from langflash_core.base import pictures
from langflash_core.base.pictures import Picture
from langflash_core.geometry.poses import to_camera
from langflash_core.scene.exposure import PlaceLight
from langflash_core.scene.world import upward

from ...gl import SplatRenderer
from ...gl.paints import PAINTS, Wanted
from ...gl.scene import Thinned
from ..asking.state import Prompt
from ..editing.state import Point, Reading, strongest
from ..governor import SETTLE_AFTER, Kind, Plan
from ..scene.near import fills_gaps, keeps_near
from ..scene.state import possible
from ..state import State
from .marked import Marked
from .values import BACKGROUND, Asked, Drawn, Numbers, Stand, View, kind_of

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Camera, Scene

    from ...gl.processor.still import Still

SHOWN_ALPHA = 0.5  # as in the answers: from here on a pixel shows the scene


class Easel:
    """Holds one picture after the other. drawn: its name; camera: that it was drawn for; exact: whether its
    order is that camera's; seconds: that it took; size: its pixels; texture: to show, None before the first
    one is painted."""

    def __init__(
        self,
        renderer: SplatRenderer,
        serial: int,
        scene: "Scene",
        share: float,
        thinned: Thinned | None = None,
    ):
        """Bring a scene to the renderer, this share of it at once, as thinned where that is given; what
        pictures of another took goes back.

        Raises:
            GraphicsError: the OpenGL here cannot do it.
        """
        renderer.set_scene(scene, share, thinned)
        renderer.canvas.forget()
        renderer.ask(None)
        self.renderer = renderer
        self._light = PlaceLight.of(scene)
        self._up = tuple(upward(scene.record.world).tolist())
        self.drawn: Drawn | None = None
        self.camera: Camera | None = None
        self.exact = True
        self.seconds = 0.0
        self.size = (0, 0)
        self.texture: moderngl.Texture | None = None
        self.asked = Asked()
        self.marked: Marked | None = None
        self._serial = serial
        self._times_marked = 0
        self._painted: tuple | None = None  # all that the texture shows
        self._scored: tuple | None = None  # picture and question of the last view
        self._told: tuple[Drawn, Asked] | None = None  # of this place, picture and question narrowed last
        self._narrowed = False  # whether these are on show

    # --- what to show -----------------------------------------------------------------------

    def ask(self, keys: tuple[int, ...], query: "CompiledQuery | None", revision: int) -> None:
        """Ask other phrases, as `Asked` has them."""
        self.asked = Asked(keys, query, revision, self.asked.number + 1)
        self._painted = self._scored = None
        self._narrowed = False
        self.renderer.ask(query)

    def mark(self, marked: Marked) -> None:
        """Bring edits to the renderer."""
        before, self.marked = self.marked, marked
        if marked.changes != (before.changes if before else ()):
            self.renderer.change(marked.changes)
        self.renderer.mark(*marked.shown)
        self._times_marked += 1

    def wanted(self, state: State, stand: Stand, plan: Plan) -> Drawn:
        """The name of the picture that a plan makes now."""
        return Drawn(self._serial, state.scene.pose, stand.size, plan, self._times_marked)

    def covers(self, wanted: Drawn, late: bool = True) -> bool:
        """Whether what is on show is at least what is wanted. late: also where its order is not exact."""
        return self.drawn is not None and (late or self.exact) and self.drawn.covers(wanted)

    @property
    def finest(self) -> bool:
        """Whether what is on show leaves out no pixel and no Gaussian."""
        return self.drawn is not None and self.drawn.plan.covers(Plan(self.drawn.plan.kind))

    def _seen(self, wanted: Drawn) -> "Camera":
        width, height = (max(8, round(side * wanted.plan.scale)) for side in wanted.size)
        return self._light.lit(to_camera(wanted.pose, width, height))

    def ready(self, wanted: Drawn, moving: bool, late: bool) -> bool:
        """Bring what that picture lacks to the renderer, as much as a frame has time for; whether it can be
        drawn now. moving, late: as `SplatRenderer.draw` has them."""
        return self.renderer.upload(self._seen(wanted), wanted.plan.share, moving, late)

    def draw(self, wanted: Drawn, moving: bool, late: bool) -> None:
        """Draw that picture, by the renderer. moving, late: as `SplatRenderer.draw` has them."""
        plan, renderer = wanted.plan, self.renderer
        self.camera = self._seen(wanted)
        start = time.perf_counter()
        self.drawn = None  # should it fail: what was drawn may have made room for it
        renderer.draw(
            self.camera,
            background=BACKGROUND,
            weight_maps=plan.kind is Kind.MAPS,
            fast=plan.kind is Kind.FAST,
            share=plan.share,
            moving=moving,
            late=late,
        )
        self.exact = renderer.exact
        renderer.finish()  # software and hardware alike: the time of the picture, not of the call
        self._takes(wanted, time.perf_counter() - start, (self.camera.width, self.camera.height))

    def bring(self, still: "Still", name: Drawn, seconds: float) -> None:
        """Show a picture so named that was drawn elsewhere."""
        self.drawn = None  # as above
        self.renderer.bring(still, BACKGROUND)
        self.camera, self.exact = still.camera, True
        self._takes(name, seconds, (still.camera.width, still.camera.height))

    def _takes(self, name: Drawn, seconds: float, size: tuple[int, int]) -> None:
        self.drawn, self.seconds, self.size, self._painted = name, seconds, size, None
        self._scored, self._narrowed = None, False
        if self._told is not None and replace(self._told[0], plan=name.plan) != name:
            self._told = None

    # --- how it is shown --------------------------------------------------------------------

    def paint(self, state: State, tells: Callable[[], bool] = lambda: True) -> None:
        """Choose the texture for the mode; repaint it only when something it shows has changed.

        tells: whether answers can be shown at once; while they cannot, what is on show stays.
        """
        if self.drawn is None:
            return
        shown = {p.key: p for p in state.asking.prompts}
        asked = [shown[key] for key in self.asked.keys if key in shown]
        mode = self._mode(state, self.drawn, asked)
        if (mode.answers or mode.columns) and not tells():
            return
        active = next((i for i, p in enumerate(asked) if p.key == state.asking.active), 0)
        if mode.answers and not self._chosen(mode, active):
            if self._stays(active):
                return
            mode = pictures.RGB
        fill, faded = fills_gaps(state), mode is pictures.RGB and keeps_near(state, self.drawn.pose)
        shown_from = asked[active].shown_from if asked else 0.0
        colours, cuts = tuple(p.colour for p in asked), tuple(p.lit_from for p in asked)
        wanted = Wanted(colours, cuts, active, shown_from, state.asking.atom, state.heat_colours)
        painted = (mode, faded, fill, wanted)
        if painted == self._painted:
            return
        self._painted = painted
        self.renderer.fill(fill)
        self.texture = self.renderer.faded_texture() if faded else PAINTS[mode](self.renderer, wanted)

    def _mode(self, state: State, drawn: Drawn, asked: list[Prompt]) -> Picture:
        """That is wanted, or colours where the picture, the question or the scene lack what it needs."""
        if not drawn.plan.covers(replace(drawn.plan, kind=kind_of(state))):
            return pictures.RGB
        if state.scene.mode.answers and (not asked or len(asked) != len(self.asked.keys)):
            return pictures.RGB
        return state.scene.mode if possible(state.scene.mode, state.scene.info) else pictures.RGB

    def _chosen(self, mode: Picture, active: int) -> bool:
        """Whether what the mode shows of this picture is told from all that answers a phrase's head, "red
        armchair" from every armchair."""
        readings = self.asked.query.readings if self.asked.query else ()
        meant = readings[active : active + 1] if mode.one else readings
        return self._narrowed or not any(each.narrows for each in meant)

    def _stays(self, active: int) -> bool:
        """Whether what was told last of this place is of the same phrase, and stays on show until this is."""
        before, now = self._told[1].query if self._told else None, self.asked.query
        return before is not None and now is not None and now.texts[active] in before.texts

    # --- what it says -----------------------------------------------------------------------

    def read(self, at: Point) -> tuple[Reading, np.ndarray | None] | None:
        """What the picture shows at a point of its place, and the weights (K,) there.

        The weights are None where the weight maps are not drawn; all is None before a picture.
        """
        if self.drawn is None or self.camera is None:
            return None
        width, height = self.size
        x = min(max(int(at[0] * width / self.drawn.size[0]), 0), width - 1)
        y = min(max(int(at[1] * height / self.drawn.size[1]), 0), height - 1)
        alpha, depth, weights = self.renderer.pixel(x, y)
        if alpha < SHOWN_ALPHA:
            return Reading(at, atoms=None if weights is None else ()), weights
        point = _place(self.camera, x, y, depth)
        return Reading(at, point, depth, None if weights is None else strongest(weights)), weights

    def view(self, state: State, stand: Stand, numbers: Callable[[], Numbers | None]) -> View | None:
        """The resting view to score, once per picture and query; None when there is nothing new.

        numbers: of what is on show, None while they are not there.
        """
        drawn, asked, camera = self.drawn, self.asked, self.camera
        if asked.query is None or drawn is None or camera is None:
            return None
        if drawn.plan.kind is not Kind.MAPS or state.now - stand.moved < SETTLE_AFTER:
            return None
        if asked.revision != state.asking.revision:
            return None  # the query that holds now is on its way
        if drawn != self.wanted(state, stand, drawn.plan):
            return None  # and so is the picture
        shown = {prompt.key: prompt.cut for prompt in state.asking.prompts}
        cuts = tuple(shown.get(key, asked.query.threshold) for key in asked.keys)
        name = (drawn, asked.number, cuts if asked.query.narrows else ())
        found = None if name == self._scored else numbers()
        if found is None:
            return None
        self._scored = name
        return View(
            drawn.serial,
            asked.keys,
            found.frame,
            found.relevance,
            camera,
            asked.query,
            asked.revision,
            found.others,
            self._up,
            name,
            cuts,
        )

    def numbers(self) -> Numbers:
        """Of what the renderer drew."""
        query, renderer = self.asked.query, self.renderer
        others = None if query is None or query.others is None else renderer.relevance_of(query.others)
        return Numbers(renderer.frame(), renderer.relevance(), others)

    def narrow(self, name: tuple, relevance: "Tensor") -> None:
        """Show this relevance (P, H, W), if the picture and the question of `View.name` are still on show."""
        if name == self._scored and self.drawn is not None:
            self.renderer.narrow(relevance)
            self._told, self._narrowed, self._painted = (self.drawn, self.asked), True, None


def _place(camera: "Camera", x: int, y: int, depth: float) -> tuple[float, float, float]:
    """Where a pixel's surface is, in the world."""
    K, viewmat = camera.K.double().numpy(), camera.viewmat.double().numpy()
    across = np.array([(x + 0.5 - K[0, 2]) / K[0, 0], (y + 0.5 - K[1, 2]) / K[1, 1]])
    pos_c = np.array([*(across * (1.0 if camera.orthographic else depth)), depth])
    place = viewmat[:3, :3].T @ (pos_c - viewmat[:3, 3])
    return float(place[0]), float(place[1]), float(place[2])
