"""The splat renderer: draws a scene once per camera and answers any phrase from what it drew.

Passes, back to front, premultiplied: colour + depth + transmittance, then weight maps, 24 atoms
a pass, only the atoms in view. Queries, heat-maps and labels read those and touch no splat.
Against the float64 reference (tests/app/gl/test_gl_against_reference.py): about 60 dB and a mean
relevance error of 1e-4 with float16 targets, 100 dB and 1e-7 with float32.
"""

from collections import Counter
from typing import Literal

import moderngl
import numpy as np
import torch
from torch import Tensor

from langflash_core.errors import GraphicsError
from langflash_core.language.relevance import CompiledQuery, finite_atoms
from langflash_core.scene.thin import thin_with_rows
from langflash_core.splat.projection import ALPHA_MIN, NEAR
from langflash_core.types import Camera, Frame, Scene

from .combine import QueryPasses, Screen
from .display import COLOUR_MAPS, MASK_STYLES, Display, atom_colours, feature_axes
from .fast import MAX_PHRASES, NUMBERS, FastPasses, splat_norms, splat_numbers
from .host import HostQueryPasses, draws_in_software
from .photos import PhotoDepths
from .programs import Programs, set_uniforms
from .splats import SplatBuffers
from .targets import MAX_LAYERS_AT_ONCE, PREMULTIPLIED, ColourTarget, LayerTarget, context_lives, drawing

_DTYPES = {"float16": "f2", "float32": "f4"}
_NUMPY = {"f2": np.float16, "f4": np.float32}
_ATOMS_PER_LAYER = 3
Background = tuple[float, float, float]


class SplatRenderer:
    """Splats one scene into textures of one context; call from the context's thread only.

    Row 0 of every texture is the top of the image: show them with the usual (0, 0)-(1, 1)
    texture coordinates of a window library, or read them without flipping.

    `passes` counts what was drawn: "colour", "weights" (24 atoms each) touch splats; "norm",
    "negatives", "query", "show" do not.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        precision: Literal["float16", "float32"] = "float16",
        queries: Literal["shader", "host"] | None = None,
    ):
        """
        Args:
            precision: of colour and weight maps; alphas, depth and relevance are always float32.
            queries: where phrases are multiplied with weight maps; None: on the processor where
                OpenGL runs there too (app/gl/host.py), else in shaders.

        Raises:
            GraphicsError: the context is older than OpenGL 3.3.
            ValueError: another precision, another place.
        """
        if precision not in _DTYPES:
            raise ValueError(f"precision: expected float16 or float32, received {precision!r}")
        if queries not in ("shader", "host", None):
            raise ValueError(f"queries: expected shader, host or None, received {queries!r}")
        if ctx.version_code < 330:
            raise GraphicsError(
                f"OpenGL {ctx.version_code / 100:.1f} is too old for splatting, 3.3 is needed; "
                "update the graphics driver"
            )
        self.passes: Counter[str] = Counter()
        self._ctx = ctx
        self._dtype = _DTYPES[precision]
        on_host = draws_in_software(ctx) if queries is None else queries == "host"
        self._query_passes = HostQueryPasses if on_host else QueryPasses
        self._programs = Programs(ctx)
        self._screen = Screen(ctx)
        self._scene: Scene | None = None
        self._levels: dict[float, SplatBuffers] = {}  # by share of the Gaussians
        self._rows: dict[float, np.ndarray] = {}  # of the scene, that a level draws
        self._splats: SplatBuffers | None = None  # the level in use
        self._background: Background = (0.0, 0.0, 0.0)
        self._compiled: CompiledQuery | None = None
        self._asked = 0  # how often; names the current query in keys
        self._drawn: dict[str, tuple] = {}  # what the colour and weight textures show
        self._version = 0  # of the weight maps
        self._marks: tuple[np.ndarray, np.ndarray] | None = None  # shown, tints
        self._marked = 0  # how often; names the current marks in keys
        self._atoms = np.zeros(0, np.int64)
        self._atom_colours = np.zeros((0, 3), np.float32)
        self._size: tuple[int, int] | None = None
        self._target: ColourTarget | None = None
        self._weights: LayerTarget | None = None
        self._query: QueryPasses | None = None
        self._fast: FastPasses | None = None
        self._is_fast = False  # relevance comes from the fast mode
        self._numbers: tuple[int, np.ndarray] | None = None  # `_asked` and what its Gaussians carry
        self._norms: tuple[bytes, np.ndarray] | None = None  # factor and |f_i|
        self._display: Display | None = None
        self._camera: Camera | None = None
        self._photos: dict[bool, PhotoDepths] = {}  # by whether each sees its own Gaussians alone

    # --- what to draw -----------------------------------------------------------------------

    def set_scene(self, scene: Scene) -> None:
        """Upload a scene; the same object again does nothing. The query is kept if it still fits."""
        if scene is self._scene:
            return
        self._release_scene()
        self._splats = SplatBuffers(self._ctx, self._programs, scene)
        self._levels, self._rows = {1.0: self._splats}, {1.0: np.arange(len(scene.gaussians))}
        self._marks = None
        self._scene = scene
        self._atom_colours = atom_colours(scene.semantics.dictionary.detach().cpu().double().numpy())
        if self._compiled is not None and self._compiled.factor.shape[0] != scene.semantics.num_atoms:
            self._compiled = None

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> None:
        """Draw only some Gaussians, and some in a tint (`splats.TINTS`); holds until `set_scene`.

        Args:
            shown: (N,) bool. tints: (N,) uint8, 0 for the own colour.

        Raises:
            ValueError: there is no scene, or N is another.
        """
        count = len(self._scene.gaussians) if self._scene else 0
        if self._splats is None or shown.shape != (count,) or tints.shape != (count,):
            raise ValueError(f"mark: expected {count} rows, received {shown.shape} and {tints.shape}")
        self._marks = (shown, tints)
        changed = [self._mark_level(share) for share in self._levels]
        if any(changed):
            self._drawn = {}
        self._marked += 1

    def _mark_level(self, share: float) -> bool:
        """Bring the marks to a level; returns whether it shows other Gaussians now."""
        rows = self._rows[share]
        return self._marks is not None and self._levels[share].mark(*(part[rows] for part in self._marks))

    @property
    def num_dropped(self) -> int:
        """Gaussians of the scene left out because a value or a weight was NaN or infinite."""
        return self._levels[1.0].num_dropped if self._levels else 0

    @property
    def num_dropped_atoms(self) -> int:
        """Atoms of the scene that say nothing because a number was NaN or infinite."""
        return int((~finite_atoms(self._scene.semantics.dictionary)).sum()) if self._scene else 0

    def draw(
        self,
        camera: Camera,
        background: Background = (0.0, 0.0, 0.0),
        weight_maps: bool = True,
        fast: bool = False,
        share: float = 1.0,
    ) -> None:
        """Draw the scene; nothing is drawn again for the same scene, camera and size.

        Args:
            weight_maps: draw them at once; else the first question that needs them does.
            fast: until the next call, answer from numbers splatted beside the colour (app/gl/fast.py)
                instead of weight maps, unless those are drawn already: for a moving camera. Serves
                up to 17 phrases; more are answered exactly.
            share: in (0, 1], of the Gaussians to draw, wider in return (scene/thin.py). A level is
                made once and kept with the scene: use few values.

        Raises:
            ValueError: there is no scene, or the image has no pixels.
            GraphicsError: the image is larger than the driver's textures, or the context is gone.
        """
        if not context_lives(self._ctx):
            raise GraphicsError("the OpenGL context of this view is gone; open the scene again")
        if self._splats is None:
            raise ValueError("draw: expected set_scene before, received no scene")
        self._resize(camera)
        self._camera = camera
        self._use_level(share)
        key = _camera_key(camera)
        if self._drawn.get("sorted") != key:
            self._splats.sort(camera)
            self._drawn = {"sorted": key}
        self._background = background
        if self._drawn.get("projected") != (key, self._marked):
            if len(self._splats.order):
                self._splats.project(camera)
            self._drawn.pop("colour", None)
            self._drawn.pop("numbers", None)
            self._drawn["projected"] = (key, self._marked)
        self._is_fast = fast
        if self._answers_fast():
            self._ensure_numbers()
        if "colour" not in self._drawn:
            self._draw_colour()
        if weight_maps and not fast:
            self._ensure_weights()

    def ask(self, compiled: CompiledQuery | None) -> None:
        """Set the phrases; costs no splat pass while the weight maps are drawn.

        Raises:
            ValueError: the query was compiled for a dictionary of another size.
        """
        if compiled is not None and self._scene is not None:
            expected = self._scene.semantics.num_atoms
            if compiled.factor.shape[0] != expected:
                raise ValueError(f"compiled: expected {expected} atoms, received {compiled.factor.shape[0]}")
        self._compiled = compiled
        self._asked += 1

    # --- numbers ------------------------------------------------------------------------------

    def frame(self, weight_maps: bool = False) -> Frame:
        """The view as tensors on the CPU, float32; weight maps (H, W, K) on request."""
        target = self._drawn_target()
        width, height = target.colour.size
        colour = _read(target.colour).reshape(height, width, 4)
        sums, alphas = np.moveaxis(_read(target.depth).reshape(height, width, 2), -1, 0)
        covered = alphas >= ALPHA_MIN
        depths = np.where(covered, sums / np.where(covered, alphas, 1.0), 0.0).astype(np.float32)
        maps = torch.from_numpy(self._read_weights(height, width)) if weight_maps else None
        under = np.asarray(self._background, np.float32)
        rgb = torch.from_numpy(colour[..., :3] + (1 - alphas[..., None]) * under)
        return Frame(rgb, torch.from_numpy(alphas.copy()), torch.from_numpy(depths), maps)

    def pixel(self, x: int, y: int) -> tuple[float, float, np.ndarray | None]:
        """Alpha, depth (scene units, 0 where empty) and weights (K,) of one pixel of the view.

        The weights are None until the weight maps of this view are drawn. Reads a few texels.
        """
        viewport = (x, y, 1, 1)
        content = self._drawn_target().framebuffer.read(viewport, 2, attachment=1, dtype="f4")
        total, alpha = np.frombuffer(content, np.float32).tolist()
        depth = total / alpha if alpha >= ALPHA_MIN else 0.0
        if self._drawn.get("weights") != self._drawn["sorted"]:
            return alpha, depth, None
        assert self._scene is not None
        weights = np.zeros(self._scene.semantics.num_atoms, np.float32)
        num_layers = -(-len(self._atoms) // _ATOMS_PER_LAYER)
        texels: list[np.ndarray] = []
        for first in range(0, num_layers, MAX_LAYERS_AT_ONCE):
            count = min(MAX_LAYERS_AT_ONCE, num_layers - first)
            assert self._weights is not None
            layers = self._weights.layers(first, count)
            for layer in range(count):
                read = layers.read(viewport, 4, attachment=layer, dtype=self._dtype)
                texels.append(np.frombuffer(read, _NUMPY[self._dtype])[:_ATOMS_PER_LAYER])
        if texels:
            weights[self._atoms] = np.concatenate(texels)[: len(self._atoms)]
        return alpha, depth, weights

    def relevance(self) -> Tensor:
        """Relevance (P, H, W) float32 of the phrases asked, 0 where the view is empty.

        Exact, unless the view was drawn with `fast`.

        Raises:
            ValueError: nothing was asked or drawn.
        """
        layers, compiled, _ = self._ensure_relevance()
        width, height, num_layers = layers.array.size[0], layers.array.size[1], layers.num_layers
        values = _read(layers.array).reshape(num_layers, height, width, 4)
        maps = np.moveaxis(values, -1, 1).reshape(4 * num_layers, height, width)
        return torch.from_numpy(maps[: compiled.prompts.shape[0]].copy())

    def labels(self, threshold: float | None = None) -> Tensor:
        """The best prompt per pixel (H, W) int64, -1 for none."""
        self.label_texture(threshold=threshold)
        ids = self._shown().label_ids
        width, height = ids.size
        return torch.from_numpy(_read(ids).reshape(height, width).round().astype(np.int64) - 1)

    # --- pictures -----------------------------------------------------------------------------

    @property
    def rgb_texture(self) -> moderngl.Texture:
        """The view's colours, RGBA8, opaque."""
        target, display = self._drawn_target(), self._shown()
        key = (self._drawn["colour"], self._background)
        return display.picture(("rgb",), key, lambda into: display.paint_rgb(into, target, self._background))

    def heat_texture(
        self,
        prompt: int = 0,
        colormap: str = "turbo",
        threshold: float | None = None,
        over_rgb: bool = True,
        span: tuple[float, float] | None = None,
    ) -> moderngl.Texture:
        """One prompt's heat-map.

        Args:
            prompt: from 0, in the order asked.
            colormap: turbo, inferno or grey.
            threshold: relevance below it is not shown; None: the query's own.
            over_rgb: over the dimmed photo colours, or alone on black.
            span: relevance of the first and last colour; None: threshold to 1.

        Raises:
            ValueError: nothing was asked or drawn, no such prompt or colour map.
        """
        if colormap not in COLOUR_MAPS:
            raise ValueError(f"colormap: expected one of {COLOUR_MAPS}, received {colormap!r}")
        layers, compiled, key = self._ensure_relevance()
        if not 0 <= prompt < compiled.prompts.shape[0]:
            raise ValueError(f"prompt: expected 0 to {compiled.prompts.shape[0] - 1}, received {prompt}")
        limit = compiled.threshold if threshold is None else threshold
        chosen = (min(limit, 0.999), 1.0) if span is None else span
        target, display = self._drawn_target(), self._shown()
        key = (*key, colormap, limit, over_rgb, chosen)
        return display.picture(
            ("heat", prompt),
            key,
            lambda into: display.paint_heat(
                into,
                target,
                layers,
                prompt=prompt,
                which=COLOUR_MAPS.index(colormap),
                threshold=limit,
                span=chosen,
                over_rgb=over_rgb,
            ),
        )

    def label_texture(
        self, colours: np.ndarray | None = None, threshold: float | None = None
    ) -> moderngl.Texture:
        """Every pixel in the colour of its best prompt; dim where none reaches the threshold.

        Args:
            colours: (P, 3) in [0, 1]; None: hues spread by the golden ratio.
        """
        layers, compiled, key = self._ensure_relevance()
        count = compiled.prompts.shape[0]
        chosen = _hues(count) if colours is None else np.asarray(colours, np.float32)
        if chosen.shape != (count, 3):
            raise ValueError(f"colours: expected ({count}, 3), received {chosen.shape}")
        limit = compiled.threshold if threshold is None else threshold
        target, display = self._drawn_target(), self._shown()
        key = (*key, limit, chosen.tobytes())
        return display.picture(
            ("labels",),
            key,
            lambda into: display.paint_labels(into, target, layers, chosen, limit),
        )

    def atom_texture(self) -> moderngl.Texture:
        """Every atom in its own colour (principal axes of the dictionary), on black."""
        self._drawn_target()
        self._ensure_weights()
        display = self._shown()
        return display.picture(("atoms",), (self._version,), self._paint_atoms)

    def depth_texture(self, colormap: str = "turbo") -> moderngl.Texture:
        """Depth as a colour, near to far over the middle 96 % of the Gaussians in view."""
        if colormap not in COLOUR_MAPS:
            raise ValueError(f"colormap: expected one of {COLOUR_MAPS}, received {colormap!r}")
        target, display = self._drawn_target(), self._shown()
        assert self._splats is not None
        near, far = self._splats.depth_range
        span = (float(near), float(max(far, near * 1.001)))
        which = COLOUR_MAPS.index(colormap)
        key = (self._drawn["colour"], colormap)
        return display.picture(("depth",), key, lambda into: display.paint_depth(into, target, span, which))

    def mask_texture(self, style: str, colours: np.ndarray, thresholds: np.ndarray) -> moderngl.Texture:
        """What passes its own prompt's threshold.

        Args:
            style: "flat" in the prompt's colour, "isolate" alone, "hide" left out, "dim" the rest dimmed.
            colours: (P, 3) in [0, 1]. thresholds: (P,).
        """
        layers, compiled, key = self._ensure_relevance()
        expected = ((compiled.prompts.shape[0], 3), (compiled.prompts.shape[0],))
        if (colours.shape, thresholds.shape) != expected or style not in MASK_STYLES:
            raise ValueError(f"masks: expected {expected} and one of {MASK_STYLES}, received {style!r}")
        target, display, background = self._drawn_target(), self._shown(), self._background
        key = (*key, background, colours.tobytes(), thresholds.tobytes())
        return display.picture(
            ("masks", style),
            key,
            lambda into: display.paint_masks(into, target, layers, style, colours, thresholds, background),
        )

    def margin_texture(
        self,
        threshold: float,
        span: tuple[float, float],
        colormap: str = "turbo",
        over_rgb: bool = True,
    ) -> moderngl.Texture:
        """The best prompt's relevance less the second best's; of one prompt, less `threshold`."""
        layers, compiled, key = self._ensure_relevance()
        target, display, which = self._drawn_target(), self._shown(), COLOUR_MAPS.index(colormap)
        count = compiled.prompts.shape[0]
        return display.picture(
            ("margin",),
            (*key, threshold, span, which, over_rgb),
            lambda into: display.paint_margin(into, target, layers, count, threshold, span, which, over_rgb),
        )

    def weight_texture(self, atom: int, colormap: str = "inferno") -> moderngl.Texture:
        """One atom's weight map, 0 to 1.

        Raises:
            ValueError: there is no such atom.
        """
        self._drawn_target()
        self._ensure_weights()
        count = 0 if self._scene is None else self._scene.semantics.num_atoms
        if not 0 <= atom < count:
            raise ValueError(f"atom: expected 0 to {count - 1}, received {atom}")
        weights, display, which = self._weights, self._shown(), COLOUR_MAPS.index(colormap)
        places = np.flatnonzero(self._atoms == atom)

        def paint(into: moderngl.Framebuffer) -> None:
            into.clear(0.0, 0.0, 0.0, 1.0)
            if len(places) and weights is not None:
                display.paint_weight(into, weights, int(places[0]), which)

        return display.picture(("weight",), (self._version, atom, which), paint)

    def transmittance_texture(self, colormap: str = "inferno") -> moderngl.Texture:
        """What passes every splat, 0 to 1."""
        target, display, which = self._drawn_target(), self._shown(), COLOUR_MAPS.index(colormap)
        key = (self._drawn["colour"], which)
        return display.picture(
            ("transmittance",), key, lambda into: display.paint_transmittance(into, target, which)
        )

    def feature_texture(self) -> moderngl.Texture:
        """Principal axes of F(p) = W D as colours, the same in every view; empty pixels black."""
        self._drawn_target()
        self._ensure_weights()
        return self._shown().picture(("features",), (self._version,), self._paint_features)

    def coverage_texture(self) -> moderngl.Texture:
        """How many photos saw what each pixel shows, in `COUNT_COLOURS`; the first call draws their views."""
        return self._trust_texture(own=False)

    def agreement_texture(self) -> moderngl.Texture:
        """How well the photos' own depths agree at each pixel; grey where fewer than two can tell.

        Raises:
            ValueError: the scene does not say which photo made which Gaussian.
        """
        return self._trust_texture(own=True)

    def colour_bar(self, colormap: str) -> np.ndarray:
        """A colour map from left to right, (1, 256, 3) uint8."""
        texture = self._ctx.texture((256, 1), 4)
        framebuffer = self._ctx.framebuffer([texture])
        program = self._programs.get("screen.vert", "show_bar.frag")
        set_uniforms(program, width=256.0, which_map=COLOUR_MAPS.index(colormap))
        with drawing(framebuffer):
            self._screen.draw(program)
        shown = np.frombuffer(texture.read(), np.uint8).reshape(1, 256, 4)[..., :3].copy()
        framebuffer.release()
        texture.release()
        return shown

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the first and the last colour of `depth_texture`, scene units."""
        return (NEAR, 1.0) if self._splats is None else self._splats.depth_range

    # --- inside -------------------------------------------------------------------------------

    def _resize(self, camera: Camera) -> None:
        size = (camera.width, camera.height)
        if size == self._size:
            return
        limit = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        if min(size) < 1:
            raise ValueError(f"camera: expected at least 1 x 1 pixels, received {size[0]} x {size[1]}")
        if max(size) > limit:
            raise GraphicsError(
                f"an image of {size[0]} x {size[1]} is larger than this driver's {limit} pixels a side; "
                "choose a smaller size"
            )
        self._release_targets()
        self._target = ColourTarget(self._ctx, size, self._dtype)
        self._query = self._query_passes(self._ctx, self._programs, self._screen, size, self.passes)
        self._display = Display(self._ctx, self._programs, self._screen, size, self.passes)
        self._size = size

    def _use_level(self, share: float) -> None:
        assert self._scene is not None
        if share not in self._levels:
            thinner, rows = thin_with_rows(self._scene, share)
            self._levels[share] = SplatBuffers(self._ctx, self._programs, thinner)
            self._rows[share] = rows
            self._mark_level(share)
        if self._levels[share] is not self._splats:
            self._splats = self._levels[share]
            self._drawn = {}
            self._numbers = self._norms = None

    def _draw_colour(self, numbers: np.ndarray | None = None) -> None:
        """Colour and depth, and with `numbers` (N, 3 L) the layers of the fast mode."""
        assert self._target is not None and self._splats is not None
        defines: dict[str, float] = {"COLOUR": 1}
        framebuffer = self._target.framebuffer
        layers = 0 if numbers is None else numbers.shape[1] // NUMBERS
        if layers:
            assert self._fast is not None
            defines["LAYERS"], framebuffer = layers, self._fast.framebuffer
        program = self._programs.get("quad.vert", "colour.frag", defines)
        set_uniforms(program, image_size=tuple(float(n) for n in self._target.colour.size))
        framebuffer.clear()
        with drawing(framebuffer, PREMULTIPLIED):
            if len(self._splats.order):
                carried = None if numbers is None else self._splats.in_order(numbers)
                self._splats.draw(program, carried, layers)
        self._drawn["colour"] = self._drawn["projected"]
        self.passes["colour"] += 1

    def _answers_fast(self) -> bool:
        """Whether the next answer comes from the fast mode."""
        assert self._scene is not None
        if not self._is_fast or self._compiled is None or self._drawn.get("weights") == self._drawn["sorted"]:
            return False
        return self._scene.semantics.num_atoms > 0 and len(self._compiled.prompts) <= MAX_PHRASES

    def _ensure_numbers(self) -> None:
        """Colour, depth and the numbers of the phrases asked, in one splat pass, unless they are there."""
        assert self._splats is not None and self._compiled is not None and self._target is not None
        key = (self._drawn["sorted"], self._asked)
        if self._drawn.get("numbers") == key:
            return
        if self._fast is None or not self._fast.fits(self._compiled):
            self._release_fast()
            self._fast = FastPasses(
                self._ctx, self._programs, self._screen, self._target, self._compiled, self._dtype
            )
        self._draw_colour(self._carried())
        self._fast.run(self._compiled)
        self._drawn["numbers"] = key

    def _carried(self) -> np.ndarray:
        """What each Gaussian carries for the phrases asked; made once a question, norms once a dictionary."""
        assert self._splats is not None and self._compiled is not None
        if self._numbers is None or self._numbers[0] != self._asked:
            factor = self._compiled.factor.detach().cpu().double().numpy()
            if self._norms is None or self._norms[0] != factor.tobytes():
                self._norms = factor.tobytes(), splat_norms(self._splats, factor)
            self._numbers = self._asked, splat_numbers(self._splats, self._compiled, self._norms[1])
        return self._numbers[1]

    def _ensure_weights(self) -> None:
        """Draw the weight maps of the current view unless they are there."""
        assert self._splats is not None and self._size is not None
        key = self._drawn["sorted"]
        if self._drawn.get("weights") == key:
            return
        self._atoms = self._splats.active_atoms()
        self._version += 1
        num_layers = -(-len(self._atoms) // _ATOMS_PER_LAYER)
        if num_layers and (self._weights is None or self._weights.num_layers < num_layers):
            self._release_weights()
            whole_passes = -(-num_layers // MAX_LAYERS_AT_ONCE) * MAX_LAYERS_AT_ONCE
            self._weights = LayerTarget(self._ctx, self._size, whole_passes, self._dtype)
        for first in range(0, num_layers, MAX_LAYERS_AT_ONCE):
            self._draw_weights(first, min(MAX_LAYERS_AT_ONCE, num_layers - first))
        self._drawn["weights"] = key

    def _draw_weights(self, first: int, count: int) -> None:
        assert self._splats is not None and self._weights is not None and self._size is not None
        expanded = self._splats.expand(self._atoms, _ATOMS_PER_LAYER * first, count)
        program = self._programs.get("quad.vert", "weights.frag", {"LAYERS": count})
        set_uniforms(program, image_size=tuple(float(n) for n in self._size))
        target = self._weights.layers(first, count)
        target.clear()
        with drawing(target, PREMULTIPLIED):
            self._splats.draw(program, expanded, count, colour=False)
        self.passes["weights"] += 1

    def _ensure_relevance(self) -> tuple[LayerTarget, CompiledQuery, tuple]:
        """Relevance of the query, the query, and what names both."""
        self._drawn_target()
        if self._compiled is None:
            raise ValueError("relevance: expected ask(...) before, received no query")
        key = (self._drawn["colour"], self._asked)
        if self._answers_fast():
            self._ensure_numbers()
            assert self._fast is not None
            return self._fast.relevance, self._compiled, (*key, "fast")
        self._ensure_weights()
        assert self._query is not None
        weights = self._weights if len(self._atoms) else None
        layers = self._query.run(self._compiled, weights, self._atoms, self._version)
        return layers, self._compiled, (*key, "exact")

    def _paint_atoms(self, into: moderngl.Framebuffer) -> None:
        assert self._query is not None
        into.clear(0.0, 0.0, 0.0, 1.0)
        if len(self._atoms) and self._weights is not None:
            self._query.paint_atoms(self._weights, self._atom_colours[self._atoms], self._version, into)

    def _paint_features(self, into: moderngl.Framebuffer) -> None:
        assert self._query is not None and self._scene is not None
        into.clear(0.0, 0.0, 0.0, 1.0)
        if not len(self._atoms) or self._weights is None:
            return
        semantics = self._scene.semantics
        masses = np.zeros(semantics.num_atoms)
        carried = semantics.weight_values.double() * self._scene.gaussians.opacities.double()[:, None]
        np.add.at(masses, semantics.weight_ids.numpy(), carried.nan_to_num(0, 0, 0).numpy())
        columns = feature_axes(semantics.dictionary.double().numpy(), masses)[self._atoms]
        self._query.paint_features(self._weights, columns, self._version, into)

    def _trust_texture(self, own: bool) -> moderngl.Texture:
        target, display, camera = self._drawn_target(), self._shown(), self._camera
        assert self._scene is not None and camera is not None
        if own not in self._photos:
            self._photos[own] = PhotoDepths(self._ctx, self._programs, self._scene, own)
        photos = self._photos[own]
        which = COLOUR_MAPS.index("turbo")
        return display.picture(
            ("trust", own),
            (self._drawn["colour"],),
            lambda into: display.paint_trust(into, target, photos, camera, own, which),
        )

    def _read_weights(self, height: int, width: int) -> np.ndarray:
        self._ensure_weights()
        assert self._scene is not None
        maps = np.zeros((height, width, self._scene.semantics.num_atoms), np.float32)
        if len(self._atoms) and self._weights is not None:
            layers = _read(self._weights.array).reshape(-1, height, width, 4)[..., :_ATOMS_PER_LAYER]
            flat = np.moveaxis(layers, 0, 2).reshape(height, width, -1)
            maps[..., self._atoms] = flat[..., : len(self._atoms)]
        return maps

    def _drawn_target(self) -> ColourTarget:
        if self._target is None or "colour" not in self._drawn:
            raise ValueError("renderer: expected draw(...) before, received no view")
        return self._target

    def _shown(self) -> Display:
        assert self._display is not None
        return self._display

    # --- the end ------------------------------------------------------------------------------

    def _release_weights(self) -> None:
        if self._weights is not None:
            self._weights.release()
        self._weights = None

    def _release_fast(self) -> None:
        if self._fast is not None:
            self._fast.release()
        self._fast = None

    def _release_targets(self) -> None:
        self._release_weights()
        self._release_fast()
        for owned in (self._display, self._query, self._target):
            if owned is not None:
                owned.release()
        self._display = self._query = self._target = None
        self._size = None
        self._drawn = {}

    def _release_scene(self) -> None:
        for level in self._levels.values():
            level.release()
        self._levels = {}
        for photos in self._photos.values():
            photos.release()
        self._photos = {}
        self._splats = self._scene = self._numbers = self._norms = None
        self._drawn = {}

    def release(self) -> None:
        """Give every GL object back; harmless twice, and after the context went.

        A context takes its objects along. Their names may belong to a newer context's by then,
        which must not lose them.
        """
        if not context_lives(self._ctx):
            return
        self._release_targets()
        self._release_scene()
        self._screen.release()
        self._programs.release()


def _camera_key(camera: Camera) -> tuple:
    pose = camera.viewmat.detach().cpu().double().numpy().tobytes()
    return pose, camera.K.detach().cpu().double().numpy().tobytes(), camera.width, camera.height


def _read(texture: moderngl.Texture | moderngl.TextureArray) -> np.ndarray:
    """Every value of a float texture, flat, as float32."""
    return np.frombuffer(texture.read(), _NUMPY[texture.dtype]).astype(np.float32)


def _hues(count: int) -> np.ndarray:
    """Colours (count, 3): hues a golden angle apart, so that neighbours differ."""
    angles = 2 * np.pi * (0.05 + 0.618034 * np.arange(count)[:, None] + np.array([0.0, 1.0, 2.0]) / 3)
    return (0.55 + 0.4 * np.cos(angles)).astype(np.float32)
