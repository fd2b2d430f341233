"""Pictures for a screen, RGBA8 and opaque, each drawn once until its inputs change."""

from collections import Counter
from collections.abc import Callable

import moderngl
import numpy as np

from langflash_core.query.answers import COVERED_ALPHA

from .combine import Screen
from .programs import Programs, set_uniforms
from .targets import ColourTarget, LayerTarget, drawing

COLOUR_MAPS = ("turbo", "inferno", "grey")
_HEAT_OPACITY = 0.7
_LABEL_OPACITY = 0.6


class Display:
    """Owns one texture per kind of picture (and per prompt for heat-maps), of one size."""

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        screen: Screen,
        size: tuple[int, int],
        passes: Counter,
    ):
        self._ctx = ctx
        self._programs = programs
        self._screen = screen
        self._size = size
        self._passes = passes
        self._pictures: dict[tuple, tuple[moderngl.Texture, moderngl.Framebuffer]] = {}
        self._keys: dict[tuple, tuple] = {}
        self._label_ids: moderngl.Texture | None = None

    def picture(
        self, kind: tuple, key: tuple, paint: Callable[[moderngl.Framebuffer], None]
    ) -> moderngl.Texture:
        """The texture of `kind`; `paint` draws it where `key` differs from the last time."""
        if kind not in self._pictures:
            texture = self._ctx.texture(self._size, 4)
            self._pictures[kind] = texture, self._ctx.framebuffer([texture])
        texture, framebuffer = self._pictures[kind]
        if self._keys.get(kind) != key:
            paint(framebuffer)
            self._keys[kind] = key
            self._passes["show"] += 1
        return texture

    def paint_rgb(
        self, target: moderngl.Framebuffer, colour: ColourTarget, background: tuple[float, float, float]
    ) -> None:
        program = self._programs.get("screen.vert", "show_rgb.frag")
        colour.colour.use(0)
        colour.depth.use(1)
        set_uniforms(program, colour=0, depth=1, background=background)
        with drawing(target):
            self._screen.draw(program)

    def paint_depth(
        self, target: moderngl.Framebuffer, colour: ColourTarget, span: tuple[float, float], which: int
    ) -> None:
        program = self._programs.get("screen.vert", "show_depth.frag")
        colour.depth.use(0)
        set_uniforms(program, depth=0, depth_range=span, which_map=which)
        with drawing(target):
            self._screen.draw(program)

    def paint_heat(
        self,
        target: moderngl.Framebuffer,
        colour: ColourTarget,
        relevance: LayerTarget,
        *,
        prompt: int,
        which: int,
        threshold: float,
        span: tuple[float, float],
        over_rgb: bool,
    ) -> None:
        program = self._programs.get("screen.vert", "show_heat.frag", {"COVERED_ALPHA": COVERED_ALPHA})
        colour.colour.use(0)
        relevance.array.use(1)
        set_uniforms(
            program,
            colour=0,
            relevance=1,
            prompt=prompt,
            which_map=which,
            threshold=threshold,
            span=span,
            opacity=_HEAT_OPACITY if over_rgb else 1.0,
        )
        with drawing(target):
            self._screen.draw(program)

    def paint_labels(
        self,
        into: moderngl.Framebuffer,
        colour: ColourTarget,
        relevance: LayerTarget,
        colours: np.ndarray,
        threshold: float,
    ) -> None:
        """Colours into `into` and label numbers (0 none, 1 + prompt) into `label_ids`."""
        capacity = max(16, 1 << (len(colours) - 1).bit_length())
        program = self._programs.get(
            "screen.vert", "show_labels.frag", {"COVERED_ALPHA": COVERED_ALPHA, "MAX_PROMPTS": capacity}
        )
        padded = np.zeros((capacity, 3), np.float32)
        padded[: len(colours)] = colours
        colour.colour.use(0)
        relevance.array.use(1)
        set_uniforms(
            program,
            colour=0,
            relevance=1,
            num_prompts=len(colours),
            threshold=threshold,
            opacity=_LABEL_OPACITY,
            label_colours=padded,
        )
        target = self._ctx.framebuffer([into.color_attachments[0], self.label_ids])
        with drawing(target):
            self._screen.draw(program)
        target.release()

    @property
    def label_ids(self) -> moderngl.Texture:
        """(H, W) float16: 0 for none, 1 + prompt elsewhere; exact up to 2,048 prompts."""
        if self._label_ids is None:
            self._label_ids = self._ctx.texture(self._size, 1, dtype="f2")
        return self._label_ids

    def release(self) -> None:
        for texture, framebuffer in self._pictures.values():
            framebuffer.release()
            texture.release()
        self._pictures.clear()
        self._keys.clear()
        if self._label_ids is not None:
            self._label_ids.release()
        self._label_ids = None


def atom_colours(dictionary: np.ndarray) -> np.ndarray:
    """Colours (K, 3) in [0.1, 0.95] from the first three principal axes of the atoms (K, C).

    Made from the whole dictionary, so that an atom has one colour in every view. Each axis'
    sign makes its largest entry positive. An atom that is not finite counts as one of length 0.
    """
    count = dictionary.shape[0]
    if count == 0:
        return np.zeros((0, 3), np.float32)
    dictionary = np.where(np.isfinite(dictionary).all(1, keepdims=True), dictionary, 0.0)
    centred = dictionary - dictionary.mean(0)
    left, values, _ = np.linalg.svd(centred, full_matrices=False)
    scores = np.zeros((count, 3))
    used = min(3, len(values))
    scores[:, :used] = left[:, :used] * values[:used]
    scores *= np.where(scores[np.abs(scores).argmax(0), range(3)] < 0, -1.0, 1.0)
    low, high = scores.min(0), scores.max(0)
    flat = high - low < 1e-9  # one atom, or all alike: mid grey on that axis
    shares = np.where(flat, 0.5, (scores - low) / np.where(flat, 1.0, high - low))
    return (0.1 + 0.85 * shares).astype(np.float32)
