"""Pictures for a screen, RGBA8 and opaque, each drawn once until its inputs change."""

from collections import Counter
from collections.abc import Callable

import moderngl
import numpy as np

from langflash_core.language.answers import COVERED_ALPHA
from langflash_core.types import Camera

from .combine import Screen
from .photos import SAME, WORST, PhotoDepths
from .programs import Programs, set_uniforms
from .targets import ColourTarget, LayerTarget, drawing

COLOUR_MAPS = ("turbo", "inferno", "grey")
_HEAT_OPACITY = 0.7
_LABEL_OPACITY = 0.6
_TRUST_OPACITY = 0.7
MASK_STYLES = ("flat", "isolate", "hide", "dim")
COUNT_COLOURS = ((0.86, 0.20, 0.55), (0.95, 0.70, 0.20), (0.25, 0.62, 0.55))
"""Coverage: no photo saw it, one, several."""


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

    def paint_masks(
        self,
        into: moderngl.Framebuffer,
        target: ColourTarget,
        relevance: LayerTarget,
        style: str,
        colours: np.ndarray,
        thresholds: np.ndarray,
        background: tuple[float, float, float],
    ) -> None:
        """What passes, in one of `MASK_STYLES`; colours (P, 3) and thresholds (P,) of the prompts."""
        count = len(thresholds)
        capacity = max(16, 1 << (count - 1).bit_length())
        defines = {"COVERED_ALPHA": COVERED_ALPHA, "MAX_PROMPTS": capacity}
        self._paint(
            into,
            "show_masks.frag",
            defines,
            {"colour": target.colour, "depth": target.depth, "relevance": relevance.array},
            num_prompts=count,
            style=MASK_STYLES.index(style),
            background=background,
            thresholds=np.pad(thresholds, (0, capacity - count)),
            label_colours=np.pad(colours, ((0, capacity - count), (0, 0))),
        )

    def paint_margin(
        self,
        into: moderngl.Framebuffer,
        target: ColourTarget,
        relevance: LayerTarget,
        num_prompts: int,
        threshold: float,
        span: tuple[float, float],
        which: int,
        over_rgb: bool,
    ) -> None:
        self._paint(
            into,
            "show_margin.frag",
            {"COVERED_ALPHA": COVERED_ALPHA},
            {"colour": target.colour, "relevance": relevance.array},
            num_prompts=num_prompts,
            threshold=threshold,
            span=span,
            which_map=which,
            opacity=_TRUST_OPACITY if over_rgb else 1.0,
        )

    def paint_weight(self, into: moderngl.Framebuffer, weights: LayerTarget, place: int, which: int) -> None:
        self._paint(
            into, "show_weight.frag", {}, {"weight_maps": weights.array}, place=place, which_map=which
        )

    def paint_transmittance(self, into: moderngl.Framebuffer, target: ColourTarget, which: int) -> None:
        self._paint(into, "show_transmittance.frag", {}, {"depth": target.depth}, which_map=which)

    def paint_trust(
        self,
        into: moderngl.Framebuffer,
        target: ColourTarget,
        photos: PhotoDepths,
        camera: Camera,
        own: bool,
        which: int,
    ) -> None:
        """Agreement of the photos' own depths, or else how many photos see each pixel."""
        defines: dict[str, float] = {"COVERED_ALPHA": COVERED_ALPHA, "MAX_PHOTOS": photos.capacity}
        name = "show_agreement.frag" if own else "show_coverage.frag"
        self._paint(
            into,
            name,
            {**defines, **({"WORST": WORST} if own else {"SAME": SAME})},
            {"colour": target.colour, "depth": target.depth, "photo_depths": photos.texture},
            count_colours=np.array(COUNT_COLOURS),
            which_map=which,
            opacity=_TRUST_OPACITY,
            **photos.uniforms(camera),
        )

    def _paint(
        self,
        into: moderngl.Framebuffer,
        fragment: str,
        defines: dict[str, float],
        textures: dict[str, moderngl.Texture | moderngl.TextureArray],
        **uniforms: float | int | tuple | np.ndarray,
    ) -> None:
        """Fill `into` by a fragment shader that reads `textures` by their names."""
        program = self._programs.get("screen.vert", fragment, defines)
        for unit, texture in enumerate(textures.values()):
            texture.use(unit)
        set_uniforms(program, **{name: unit for unit, name in enumerate(textures)}, **uniforms)
        with drawing(into):
            self._screen.draw(program)

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


def feature_axes(dictionary: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Affine colours (K, 4) of atoms (K, C): three principal axes, and ones for `show_features.frag`.

    The axes are of the atoms as often as the scene carries them, masses (K,) >= 0. Two deviations
    along an axis span its colour; each axis' sign makes its largest entry positive.
    """
    finite = np.where(np.isfinite(dictionary).all(1, keepdims=True), dictionary, 0.0)
    shares = masses / max(masses.sum(), 1e-12)
    centred = finite - shares @ finite
    _, values, axes = np.linalg.svd(np.sqrt(shares)[:, None] * centred, full_matrices=False)
    columns = np.ones((len(finite), 4))
    columns[:, :3] = 0.5
    for place in range(min(3, len(values))):
        if values[place] < 1e-9:  # fewer directions than colours: mid grey
            continue
        along = centred @ axes[place]
        sign = np.sign(along[np.abs(along).argmax()])
        columns[:, place] += sign * along / (4 * values[place])
    return columns
