"""The splat renderer: draws a scene once per camera and answers any phrase from what it drew.

Passes, back to front, premultiplied (tile by tile, front to back, by tiled/): colour + depth + transmittance,
then weight maps, 24 atoms a pass, only the atoms in view; of a layered scene so for each layer, and then
blended (blend.py).
Queries, heat-maps and labels read those and touch no splat.
Against the float64 reference (tests/app/gl/test_gl_against_reference.py): about 60 dB and a mean
relevance error of 1e-4 with float16 targets, 100 dB and 1e-7 with float32.

Composed of three lifetimes: the scene (scene.py), the picture's size (view.py), the question (question.py);
programs live as long as the context (canvas.py).
"""

from dataclasses import replace
from itertools import count
from typing import NamedTuple

import moderngl
import numpy as np
import torch
from torch import Tensor

from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.errors import GraphicsError
from langflash_core.language.relevance import CompiledQuery
from langflash_core.scene.changes import Change
from langflash_core.splat.projection import NEAR
from langflash_core.types import Camera, Frame, Scene

from .canvas import Canvas, Precision
from .colours import hues
from .display import Answer, Background, Drawn
from .hardware import Hardware
from .layered import Prepared
from .layout import PHRASES_A_LAYER
from .picture import DrawnPicture, Picture, StillPicture
from .processor.still import Still
from .question import Question
from .scene import LiveScene, Thinned
from .splats import MakeSplats
from .targets import context_lives, read
from .view import ViewTargets

_names = count(1)


class Answered(NamedTuple):
    """A picture, the answer over it, and the threshold that the question brings along."""

    picture: Picture
    answer: Answer
    threshold: float


class SplatRenderer:
    """Splats one scene into textures of one context; call from the context's thread only.

    Row 0 of every texture is the top of the image: show them with the usual (0, 0)-(1, 1)
    texture coordinates of a window library, or read them without flipping.

    `canvas`: what it draws with and on. `splats`: makes the buffers of a scene.
    `passes` counts what was drawn: "colour", "weights" (24 atoms each) touch splats, those of every layer on
    its own; "blend", "norm", "negatives", "query", "show" do not. `exact`: whether what was drawn last is in
    its own camera's order.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        precision: Precision = "float16",
        splats: MakeSplats | None = None,
        canvas: Canvas | None = None,
        maps: Precision | None = None,
        hardware: Hardware | None = None,
    ):
        """
        Args:
            splats: makes the buffers of a scene; None: as `hardware` has it.
            canvas: of this context and precision, to share with other renderers; None: one of its own, of
                `precision`, `maps` and `hardware` (canvas.py).

        Raises:
            GraphicsError: the context is older than OpenGL 3.3.
            ValueError: another precision, a canvas of another precision.
        """
        if canvas is not None and canvas.precision != precision:
            raise ValueError(f"canvas: expected {precision}, received {canvas.precision}")
        self._ctx = ctx
        self._own_canvas = canvas is None
        self.canvas = Canvas(ctx, precision, maps, hardware) if canvas is None else canvas
        self.splats = self.canvas.hardware.splats if splats is None else splats
        self.passes = self.canvas.painter.passes
        self.exact = True
        self._fill = False
        self._scene: LiveScene | None = None
        self._question: Question | None = None
        self._picture: Picture | None = None
        self._narrowed: tuple[tuple, np.ndarray, int] | None = None  # of which answer, what, and its name

    # --- what to draw -----------------------------------------------------------------------

    def set_scene(self, scene: Scene, share: float = 1.0, thinned: Thinned | None = None) -> None:
        """Upload a scene, this share of it now, as thinned where that is given; the same object again does
        nothing. The query is kept if it still fits."""
        if self._scene is not None and self._scene.scene is scene:
            return
        self._release_scene()
        self._scene = LiveScene(self.canvas.painter, scene, self.splats, share, thinned)
        asked, self._question = self._question, None
        if asked is not None and asked.compiled.factor.shape[0] == scene.semantics.num_atoms:
            self._question = Question(asked.compiled, asked.answers)

    def give_level(self, scene: Scene, share: float, thinned: Thinned) -> None:
        """A level of `scene` that was thinned elsewhere (scene/thin.py), if that is on show; the next picture
        has it in place of one that is there."""
        if self._scene is not None and self._scene.scene is scene:
            self._scene.give(share, thinned)

    def draw_with(self, splats: MakeSplats) -> None:
        """Draw by other buffers from the next picture on."""
        self.splats = splats
        if self._scene is not None:
            self._scene.draw_with(splats)

    def upload(self, camera: Camera, share: float = 1.0, moving: bool = False, late: bool = False) -> bool:
        """Bring what a picture so drawn lacks to the card, one layer of the scene at the most, and find its
        order beside the frames; whether all of it is there."""
        if self._scene is None:
            return True
        return self._scene.level(share).ready(camera, self._quick(moving or share < 1), late)

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> None:
        """Draw only some Gaussians, and some in a tint (`splats.TINTS`); holds until `set_scene`.

        Args:
            shown: (N,) bool. tints: (N,) uint8, 0 for the own colour.

        Raises:
            ValueError: there is no scene, or N is another.
        """
        count = len(self._scene.scene.gaussians) if self._scene else 0
        if self._scene is None or shown.shape != (count,) or tints.shape != (count,):
            raise ValueError(f"mark: expected {count} rows, received {shown.shape} and {tints.shape}")
        self._scene.mark(shown, tints)

    def change(self, changes: tuple[Change, ...]) -> None:
        """Draw Gaussians as edits moved and recoloured them; all of them, in order; holds until `set_scene`.

        Raises:
            ValueError: there is no scene.
        """
        self._live("change").change(changes)

    def columns(self, features: bool) -> np.ndarray:
        """Of the atoms: colours (K, 3), or those of the features picture (K, 4)."""
        scene = self._live("columns")
        return scene.feature_columns if features else scene.atom_colours

    def draw(
        self,
        camera: Camera,
        background: Background = (0.0, 0.0, 0.0),
        weight_maps: bool = True,
        fast: bool = False,
        share: float = 1.0,
        moving: bool = False,
        late: bool = False,
    ) -> None:
        """Draw the scene; nothing is drawn again for the same scene, camera and size.

        A layered scene is blended of the layers nearest to the camera (langflash_core/splat/compose.py).

        Args:
            weight_maps: draw them at once; else the first question that needs them does.
            fast: until the next call, answer from numbers splatted beside the colour (app/gl/fast.py)
                instead of weight maps, unless those are drawn already: for a moving camera. Serves
                up to 17 phrases; more are answered exactly.
            share: in (0, 1], of the Gaussians to draw, wider in return (scene/thin.py). A level is
                made once and kept with the scene: use few values.
            moving: the picture is gone in a moment, as one that is `fast` or of a share is: on a processor
                it is blended of two layers, the farther one in half the size.
            late: its order may be that of a camera up to two frames before, while the next is found beside
                (app/gl/ordering.py); `exact` says whether it is.

        Raises:
            ValueError: there is no scene, or the image has no pixels.
            GraphicsError: the image is larger than the driver's textures, or the context is gone.
        """
        scene, level, view = self._prepared(camera, share, self._quick(moving or fast or share < 1), late)
        self.exact = level.exact
        drawn = Drawn(view.colour, camera, background, level.places_key, self._fill)
        picture = DrawnPicture(scene, view, drawn, level, fast, level.depth_range)
        if self._question is not None and fast and self._question.fits_fast:
            picture.answer(self._question)
        view.draw_colour(level)
        if weight_maps and not fast:
            view.weight_maps(level)
        self._picture = picture
        scene.forget_past()

    def colours(self, camera: Camera, *, fade: bool = False, fill: bool = False) -> np.ndarray:
        """(H, W, 3) uint8, the scene's colours over black and nothing else: for pictures one after the other.

        What `draw` showed before is gone.

        Args:
            fade: as `faded_texture`. fill: as `fill` has it, for this picture.

        Raises:
            as `draw`.
        """
        self._picture = None
        if not (fade or fill):
            _, level, view = self._prepared(camera, 1.0)
            return view.colours(level)
        asked, self._question = self._question, None
        before, self._fill = self._fill, fill
        try:
            self.draw(camera, weight_maps=False)
            shown = self.faded_texture() if fade else self.rgb_texture
        finally:
            self._picture, self._question, self._fill = None, asked, before
        return np.frombuffer(shown.read(), np.uint8).reshape(shown.height, shown.width, 4)[..., :3]

    def bring(self, still: Still, background: Background = (0.0, 0.0, 0.0)) -> None:
        """Take a picture of the scene that was drawn elsewhere (still.py) instead of drawing one.

        Raises:
            ValueError: there is no scene.
            GraphicsError: the image is larger than the driver's textures.
        """
        scene = self._live("bring")
        view = self.canvas.view((still.camera.width, still.camera.height))
        view.take(still.key, still.colour, still.depth)
        view.forget_maps()  # it has its own
        drawn = Drawn(view.colour, still.camera, background, still.key, self._fill)
        self._picture = StillPicture(scene, view, drawn, still)
        scene.forget_past()

    def fill(self, gaps: bool) -> None:
        """Whether pictures of colours show what is around their gaps (scene/gaps.py), from now on and in the
        one that is drawn; `frame`, answers and depth never do."""
        self._fill = gaps
        if self._picture is not None:
            self._picture = replace(self._picture, drawn=replace(self._picture.drawn, fill=gaps))

    def ask(self, compiled: CompiledQuery | None) -> None:
        """Set the phrases; costs no splat pass while the weight maps are drawn.

        Raises:
            ValueError: the query was compiled for a dictionary of another size.
        """
        if compiled is None:
            self._question = None
            return
        received = compiled.factor.shape[0]
        if self._scene is not None and received != self._scene.num_atoms:
            raise ValueError(f"compiled: expected {self._scene.num_atoms} atoms, received {received}")
        self._question = Question(compiled, self.canvas.hardware.answers)

    # --- for who measures -------------------------------------------------------------------

    def finish(self) -> None:
        """Wait until all that was asked of OpenGL is drawn."""
        self._ctx.finish()

    def forget(self, answers_only: bool = False) -> None:
        """Nothing counts as drawn or answered: the next picture and question go through every pass.

        Args:
            answers_only: the picture and its weight maps stay.
        """
        if self._picture is not None:
            self._picture.view.forget_answers()
        if self._scene is not None and not answers_only:
            self._picture = None
            self._scene.forget()

    def carry(self, share: float = 1.0) -> None:
        """Make what this share of the Gaussians carries for the phrases in the fast mode now, not with the
        next picture."""
        if self._scene is not None and self._question is not None and self._question.fits_fast:
            for part in self._scene.level(share).parts:
                self._question.numbers(part)

    # --- numbers ------------------------------------------------------------------------------

    def frame(self, weight_maps: bool = False) -> Frame:
        """The view as tensors on the CPU, float32; weight maps (H, W, K) on request."""
        return self.picture().frame(weight_maps)

    def pixel(self, x: int, y: int) -> tuple[float, float, np.ndarray | None]:
        """Alpha, depth (scene units, 0 where empty) and weights (K,) of one pixel of the view.

        The weights are None until the weight maps of this view are drawn. Reads a few texels.
        """
        return self.picture().pixel(x, y)

    def relevance(self) -> Tensor:
        """Relevance (P, H, W) float32 of the phrases asked, 0 where the view is empty.

        Exact, unless the view was drawn with `fast`.

        Raises:
            ValueError: nothing was asked or drawn.
        """
        answer = self._asked().answer
        width, height, num_layers = answer.layers.array.size
        values = read(answer.layers.array).reshape(num_layers, height, width, PHRASES_A_LAYER)
        maps = np.moveaxis(values, -1, 1).reshape(-1, height, width)
        return torch.from_numpy(maps[: answer.num_phrases].copy())

    def relevance_of(self, compiled: CompiledQuery) -> Tensor:
        """As `relevance`, of phrases that are not asked beside.

        Raises:
            as `ask` and `relevance`.
        """
        asked = self._question
        try:
            self.ask(compiled)
            return self.relevance()
        finally:
            self._question = asked

    def narrow(self, relevance: Tensor) -> None:
        """Show this relevance (P, H, W) of the phrases instead of their own, as long as this picture and this
        question stay.

        Raises:
            ValueError: nothing was asked or drawn, or the size is another.
        """
        picture, answer, _ = self._asked()
        expected = (answer.num_phrases, *reversed(picture.view.size))
        if tuple(relevance.shape) != expected:
            raise ValueError(f"relevance: expected {expected}, received {tuple(relevance.shape)}")
        self._narrowed = answer.key, relevance.float().numpy(), next(_names)

    def labels(self, threshold: float | None = None) -> Tensor:
        """The best prompt per pixel (H, W) int64, -1 for none."""
        self.label_texture(threshold=threshold)
        ids = self.picture().view.display.label_ids
        width, height = ids.size
        return torch.from_numpy(read(ids).reshape(height, width).round().astype(np.int64) - 1)

    # --- pictures -----------------------------------------------------------------------------

    def picture(self) -> Picture:
        """The picture asked for last; drawn again where another renderer of this canvas drew since."""
        picture = self._picture
        if picture is None or not self.canvas.holds(picture.view):
            raise ValueError("renderer: expected draw(...) before, received no view")
        picture.lay()
        return picture

    def answered(self) -> Answered:
        """The picture asked for last and the answer over it, narrowed where that was told."""
        asked = self._asked()
        if self._narrowed is None or self._narrowed[0] != asked.answer.key:
            return asked
        key, relevance, name = self._narrowed
        layers = asked.picture.view.brought("narrowed", name, len(relevance), lambda: relevance)
        return asked._replace(answer=Answer(layers, asked.answer.num_phrases, (*key, name)))

    @property
    def rgb_texture(self) -> moderngl.Texture:
        """The view's colours, RGBA8, opaque."""
        picture = self.picture()
        return picture.view.display.rgb(picture.drawn)

    def faded_texture(self) -> moderngl.Texture:
        """`rgb_texture` that fades where no photo looked from about there; the same where nobody knows of
        the photos, and from their own places."""
        picture = self.picture()
        scene = picture.scene.scene
        display = picture.view.display
        return display.rgb(picture.drawn) if scene.view_ids is None else display.faded(picture.drawn, scene)

    def heat_texture(
        self,
        prompt: int = 0,
        colormap: str = COLOUR_MAPS[0],
        threshold: float | None = None,
        over_rgb: bool = True,
        span: tuple[float, float] | None = None,
    ) -> moderngl.Texture:
        """One prompt's heat-map.

        Args:
            prompt: from 0, in the order asked.
            colormap: of langflash_core/export/colours.py.
            threshold: relevance below it is not shown; None: the query's own.
            over_rgb: over the dimmed photo colours, or alone on black.
            span: relevance of the first and last colour; None: threshold to 1.

        Raises:
            ValueError: nothing was asked or drawn, no such prompt or colour map.
        """
        picture, answer, usual = self.answered()
        if not 0 <= prompt < answer.num_phrases:
            raise ValueError(f"prompt: expected 0 to {answer.num_phrases - 1}, received {prompt}")
        limit = usual if threshold is None else threshold
        chosen = (min(limit, 0.999), 1.0) if span is None else span
        return picture.view.display.heat(picture.drawn, answer, prompt, limit, chosen, colormap, over_rgb)

    def label_texture(
        self, colours: np.ndarray | None = None, threshold: float | None = None
    ) -> moderngl.Texture:
        """Every pixel in the colour of its best prompt; dim where none reaches the threshold.

        Args:
            colours: (P, 3) in [0, 1]; None: hues spread by the golden ratio.
        """
        picture, answer, usual = self.answered()
        count = answer.num_phrases
        chosen = hues(count) if colours is None else np.asarray(colours, np.float32)
        if chosen.shape != (count, 3):
            raise ValueError(f"colours: expected ({count}, 3), received {chosen.shape}")
        limit = usual if threshold is None else threshold
        return picture.view.display.labels(picture.drawn, answer, chosen, limit)

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the first and the last colour of a picture of depths, scene units."""
        if self._picture is not None:
            return self._picture.depth_range
        return (NEAR, 1.0)

    # --- inside -------------------------------------------------------------------------------

    def _prepared(
        self, camera: Camera, share: float, quick: bool = False, late: bool = False
    ) -> tuple[LiveScene, Prepared, ViewTargets]:
        """What to draw, sorted and projected, and where.

        Raises:
            as `draw`.
        """
        if not context_lives(self._ctx):
            raise GraphicsError("the OpenGL context of this view is gone; open the scene again")
        scene = self._live("draw")
        view = self.canvas.view((camera.width, camera.height))
        level = scene.level(share)
        level.prepare(camera, quick, late)
        return scene, level, view

    def _live(self, who: str) -> LiveScene:
        """The scene.

        Raises:
            ValueError: there is none.
        """
        if self._scene is None:
            raise ValueError(f"{who}: expected set_scene before, received no scene")
        return self._scene

    def _quick(self, moving: bool) -> bool:
        """Whether a moving picture has fewer and smaller layers than one at rest."""
        return moving and not self.canvas.hardware.blends_all

    def _asked(self) -> Answered:
        """As `answered`, whatever was narrowed."""
        picture, question = self.picture(), self._question
        if question is None:
            raise ValueError("relevance: expected ask(...) before, received no query")
        return Answered(picture, picture.answer(question), question.compiled.threshold)

    # --- the end ------------------------------------------------------------------------------

    def _release_scene(self) -> None:
        if self._scene is not None:
            self._scene.release()
        self._scene = self._picture = None

    def release(self) -> None:
        """Give every GL object back; harmless twice, and after the context went.

        A context takes its objects along. Their names may belong to a newer context's by then,
        which must not lose them.
        """
        if not context_lives(self._ctx):
            return
        self._release_scene()
        if self._own_canvas:
            self.canvas.release()
