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
from langflash_core.query.relevance import CompiledQuery, finite_atoms
from langflash_core.splat.projection import ALPHA_MIN
from langflash_core.types import Camera, Frame, Scene

from .combine import QueryPasses, Screen
from .display import COLOUR_MAPS, Display, atom_colours
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

    def __init__(self, ctx: moderngl.Context, precision: Literal["float16", "float32"] = "float16"):
        """Args: precision of colour and weight maps; alphas, depth and relevance are always float32.

        Raises:
            GraphicsError: the context is older than OpenGL 3.3.
            ValueError: another precision.
        """
        if precision not in _DTYPES:
            raise ValueError(f"precision: expected float16 or float32, received {precision!r}")
        if ctx.version_code < 330:
            raise GraphicsError(
                f"OpenGL {ctx.version_code / 100:.1f} is too old for splatting, 3.3 is needed: "
                "update the graphics driver."
            )
        self.passes: Counter[str] = Counter()
        self._ctx = ctx
        self._dtype = _DTYPES[precision]
        self._programs = Programs(ctx)
        self._screen = Screen(ctx)
        self._scene: Scene | None = None
        self._splats: SplatBuffers | None = None
        self._background: Background = (0.0, 0.0, 0.0)
        self._compiled: CompiledQuery | None = None
        self._asked = 0  # how often; names the current query in keys
        self._drawn: dict[str, tuple] = {}  # what the colour and weight textures show
        self._version = 0  # of the weight maps
        self._marked = 0  # how often; names the current tints in keys
        self._atoms = np.zeros(0, np.int64)
        self._atom_colours = np.zeros((0, 3), np.float32)
        self._size: tuple[int, int] | None = None
        self._target: ColourTarget | None = None
        self._weights: LayerTarget | None = None
        self._query: QueryPasses | None = None
        self._display: Display | None = None

    # --- what to draw -----------------------------------------------------------------------

    def set_scene(self, scene: Scene) -> None:
        """Upload a scene; the same object again does nothing. The query is kept if it still fits."""
        if scene is self._scene:
            return
        self._release_scene()
        self._splats = SplatBuffers(self._ctx, self._programs, scene)
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
        if self._splats.mark(shown, tints):
            self._drawn = {}
        self._marked += 1

    @property
    def num_dropped(self) -> int:
        """Gaussians of the scene left out because a value or a weight was NaN or infinite."""
        return self._splats.num_dropped if self._splats else 0

    @property
    def num_dropped_atoms(self) -> int:
        """Atoms of the scene that say nothing because a number was NaN or infinite."""
        return int((~finite_atoms(self._scene.semantics.dictionary)).sum()) if self._scene else 0

    def draw(
        self, camera: Camera, background: Background = (0.0, 0.0, 0.0), weight_maps: bool = True
    ) -> None:
        """Draw the scene; nothing is drawn again for the same scene, camera and size.

        Raises:
            ValueError: there is no scene, or the image has no pixels.
            GraphicsError: the image is larger than the driver's textures, or the context is gone.
        """
        if not context_lives(self._ctx):
            raise GraphicsError("The OpenGL context of this view is gone: open the scene again.")
        if self._splats is None:
            raise ValueError("draw: expected set_scene before, received no scene")
        self._resize(camera)
        key = _camera_key(camera)
        if self._drawn.get("sorted") != key:
            self._splats.sort(camera)
            self._drawn = {"sorted": key}
        self._background = background
        if self._drawn.get("colour") != (key, self._marked):
            if len(self._splats.order):
                self._splats.project(camera)
            self._draw_colour()
            self._drawn["colour"] = (key, self._marked)
        if weight_maps:
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

        Raises:
            ValueError: nothing was asked or drawn.
        """
        layers, compiled = self._ensure_relevance()
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
        layers, compiled = self._ensure_relevance()
        if not 0 <= prompt < compiled.prompts.shape[0]:
            raise ValueError(f"prompt: expected 0 to {compiled.prompts.shape[0] - 1}, received {prompt}")
        limit = compiled.threshold if threshold is None else threshold
        chosen = (min(limit, 0.999), 1.0) if span is None else span
        target, display = self._drawn_target(), self._shown()
        key = (self._drawn["colour"], self._asked, colormap, limit, over_rgb, chosen)
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
        layers, compiled = self._ensure_relevance()
        count = compiled.prompts.shape[0]
        chosen = _hues(count) if colours is None else np.asarray(colours, np.float32)
        if chosen.shape != (count, 3):
            raise ValueError(f"colours: expected ({count}, 3), received {chosen.shape}")
        limit = compiled.threshold if threshold is None else threshold
        target, display = self._drawn_target(), self._shown()
        key = (self._drawn["colour"], self._asked, limit, chosen.tobytes())
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
                f"An image of {size[0]} x {size[1]} is larger than this driver's {limit} pixels a side: "
                "choose a smaller size."
            )
        self._release_targets()
        self._target = ColourTarget(self._ctx, size, self._dtype)
        self._query = QueryPasses(self._ctx, self._programs, self._screen, size, self.passes)
        self._display = Display(self._ctx, self._programs, self._screen, size, self.passes)
        self._size = size

    def _draw_colour(self) -> None:
        assert self._target is not None and self._splats is not None
        program = self._programs.get("quad.vert", "colour.frag")
        set_uniforms(program, image_size=tuple(float(n) for n in self._target.colour.size))
        self._target.framebuffer.clear()
        with drawing(self._target.framebuffer, PREMULTIPLIED):
            if len(self._splats.order):
                self._splats.draw(program)
        self.passes["colour"] += 1

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
            self._splats.draw(program, expanded, count)
        self.passes["weights"] += 1

    def _ensure_relevance(self) -> tuple[LayerTarget, CompiledQuery]:
        self._drawn_target()
        if self._compiled is None:
            raise ValueError("relevance: expected ask(...) before, received no query")
        self._ensure_weights()
        assert self._query is not None
        weights = self._weights if len(self._atoms) else None
        return self._query.run(self._compiled, weights, self._atoms, self._version), self._compiled

    def _paint_atoms(self, into: moderngl.Framebuffer) -> None:
        assert self._query is not None
        into.clear(0.0, 0.0, 0.0, 1.0)
        if len(self._atoms) and self._weights is not None:
            self._query.paint_atoms(self._weights, self._atom_colours[self._atoms], self._version, into)

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

    def _release_targets(self) -> None:
        self._release_weights()
        for owned in (self._display, self._query, self._target):
            if owned is not None:
                owned.release()
        self._display = self._query = self._target = None
        self._size = None
        self._drawn = {}

    def _release_scene(self) -> None:
        if self._splats is not None:
            self._splats.release()
        self._splats = self._scene = None
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
