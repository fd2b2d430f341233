"""Pictures for a screen, RGBA8 and opaque, each drawn once until its inputs change."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass

import moderngl
import numpy as np

from langflash_core.base.colormaps import colour_stops
from langflash_core.base.pictures import COUNT_COLOURS
from langflash_core.language.settings import ANSWERING
from langflash_core.scene.trust import COSINES
from langflash_core.types import Camera, Scene

from .gaps import Gaps
from .ordering import lens
from .packed import PackedMaps
from .painter import Painter, Textures, Uniforms
from .photos import MOST_PHOTOS, SAME, WORST, PhotoDepths, photo_places
from .targets import ColourTarget, LayerTarget
from .weights import Maps

_HEAT_OPACITY = 0.7
_LABEL_OPACITY = 0.6
_TRUST_OPACITY = 0.7
_COVERED: dict[str, float] = {"COVERED_ALPHA": ANSWERING.covered_alpha}
MASK_STYLES = ("flat", "isolate", "hide", "dim")
Background = tuple[float, float, float]
Span = tuple[float, float]


@dataclass(frozen=True)
class Drawn:
    """Colour and depth of a picture; `key` names their content. fill: colours show what is around gaps."""

    target: ColourTarget
    camera: Camera
    background: Background
    key: int
    fill: bool = False

    @property
    def colour(self) -> dict[str, moderngl.Texture]:
        return {"colour": self.target.colour}

    @property
    def depth(self) -> dict[str, moderngl.Texture]:
        return {"depth": self.target.depth}


@dataclass(frozen=True)
class Answer:
    """Relevance of P phrases, 4 a layer, over a picture; `key` names question, mode and picture."""

    layers: LayerTarget
    num_phrases: int
    key: tuple

    @property
    def relevance(self) -> dict[str, moderngl.TextureArray]:
        return {"relevance": self.layers.array}


class Display:
    """Owns one texture per kind of picture (and per prompt for heat-maps), of one size."""

    def __init__(self, painter: Painter, size: tuple[int, int], packed: PackedMaps):
        self._painter = painter
        self._size = size
        self._packed = packed
        self._pictures: dict[tuple, tuple[moderngl.Texture, moderngl.Framebuffer]] = {}
        self._keys: dict[tuple, Hashable] = {}
        self._label_ids: moderngl.Texture | None = None
        self._gaps: Gaps | None = None

    # --- of colour and depth --------------------------------------------------------------------

    def rgb(self, drawn: Drawn) -> moderngl.Texture:
        """The colours over their background."""
        return self._over_background("rgb", drawn, drawn.target.colour)

    def faded(self, drawn: Drawn, scene: Scene) -> moderngl.Texture:
        """The colours over their background, which takes over where no photo looked from about there."""
        return self._over_background("faded", drawn, self._fading(drawn, scene))

    def _over_background(self, kind: str, drawn: Drawn, colour: moderngl.Texture) -> moderngl.Texture:
        around, defines = self._around(drawn, colour, kind)
        return self._filled(
            (kind,),
            (drawn.key, drawn.background, drawn.fill),
            "show_rgb.frag",
            {"colour": colour, **drawn.depth, **around},
            {"background": drawn.background},
            defines,
        )

    def _fading(self, drawn: Drawn, scene: Scene) -> moderngl.Texture:
        """The colours, premultiplied, in which the background takes over."""

        def paint(into: moderngl.Framebuffer) -> None:
            places = photo_places(scene, drawn.camera)
            eyes = self._painter.ctx.texture((MOST_PHOTOS, 1), 4, dtype="f4")
            eyes.write(places, viewport=(0, 0, len(places), 1))
            eyes.filter = (moderngl.NEAREST, moderngl.NEAREST)
            low, high = COSINES
            self._painter.fill(
                into,
                "fade.frag",
                {**drawn.colour, **drawn.depth, "eyes": eyes},
                {"background": drawn.background, "num_photos": len(places), **lens(drawn.camera)},
                {**_COVERED, "COS_NONE": low, "COS_FULL": high},
            )
            eyes.release()

        faded = self._picture(("fading",), (drawn.key, drawn.background), paint, drawn.target.colour.dtype)
        faded.filter = drawn.target.colour.filter  # Mesa compiles what reads it anew for another one
        return faded

    def _around(
        self, drawn: Drawn, colour: moderngl.Texture | None = None, kind: str = "rgb"
    ) -> tuple[dict[str, moderngl.Texture], dict[str, float]]:
        """Textures and defines of gaps.glsl; none where gaps stay."""
        if not drawn.fill:
            return {}, {}
        key = (drawn.key, kind, drawn.background if kind == "faded" else None)
        return {"gaps": self.gaps.of(colour or drawn.target.colour, drawn.target.depth, key)}, {"GAPS": 1}

    @property
    def gaps(self) -> Gaps:
        """What shows through the gaps of a picture."""
        if self._gaps is None:
            self._gaps = Gaps(self._painter, self._size)
        return self._gaps

    def depth(self, drawn: Drawn, span: Span, colormap: str) -> moderngl.Texture:
        """Depth as a colour of a map; `span`: depths of its first and last colour."""
        return self._filled(
            ("depth",),
            (drawn.key, span, colormap),
            "show_depth.frag",
            drawn.depth,
            {"depth_range": span, "colour_stops": colour_stops(colormap)},
        )

    def shown(
        self, drawn: Drawn, kind: str, fragment: str, uniforms: Uniforms, key: tuple
    ) -> moderngl.Texture:
        """What a fragment shader makes of depth, transmittance and the camera (unproject.glsl); painted again
        where these, or `key`, are others."""
        uniforms = {**lens(drawn.camera), **uniforms}
        return self._filled((kind,), (drawn.key, *key), fragment, drawn.depth, uniforms, _COVERED)

    def trust(self, drawn: Drawn, photos: PhotoDepths, own: bool, colormap: str) -> moderngl.Texture:
        """Agreement of the photos' own depths, or else how many photos see each pixel."""
        limit = {"WORST": WORST} if own else {"SAME": SAME}
        return self._filled(
            ("trust", own),
            (drawn.key, colormap),
            "show_agreement.frag" if own else "show_coverage.frag",
            {**drawn.colour, **drawn.depth, "photo_depths": photos.texture},
            {
                "count_colours": np.array(COUNT_COLOURS),
                "colour_stops": colour_stops(colormap),
                "opacity": _TRUST_OPACITY,
                **photos.uniforms(drawn.camera),
            },
            {**_COVERED, "MAX_PHOTOS": photos.capacity, **limit},
        )

    # --- of answers -----------------------------------------------------------------------------

    def heat(
        self,
        drawn: Drawn,
        answer: Answer,
        prompt: int,
        threshold: float,
        span: Span,
        colormap: str,
        over_rgb: bool,
    ) -> moderngl.Texture:
        """One prompt's relevance from `threshold` on; `span`: that of the first and the last colour."""
        around, defines = self._around(drawn)
        return self._filled(
            ("heat", prompt),
            (*answer.key, threshold, span, colormap, over_rgb, drawn.fill),
            "show_heat.frag",
            {**drawn.colour, **answer.relevance, **around},
            {
                "prompt": prompt,
                "colour_stops": colour_stops(colormap),
                "threshold": threshold,
                "span": span,
                "opacity": _HEAT_OPACITY if over_rgb else 1.0,
            },
            {**_COVERED, **defines},
        )

    def labels(self, drawn: Drawn, answer: Answer, colours: np.ndarray, threshold: float) -> moderngl.Texture:
        """The best prompt's colour (P, 3) at each pixel; its number, 0 none, 1 + prompt, into `label_ids`."""
        capacity = _capacity(answer.num_phrases)
        around, defines = self._around(drawn)

        def paint(into: moderngl.Framebuffer) -> None:
            both = self._painter.ctx.framebuffer([into.color_attachments[0], self.label_ids])
            self._painter.fill(
                both,
                "show_labels.frag",
                {**drawn.colour, **answer.relevance, **around},
                {
                    "num_prompts": answer.num_phrases,
                    "threshold": threshold,
                    "opacity": _LABEL_OPACITY,
                    "label_colours": _padded(colours, capacity),
                },
                {**_COVERED, **defines, "MAX_PROMPTS": capacity},
            )
            both.release()

        return self._picture(("labels",), (*answer.key, threshold, colours.tobytes(), drawn.fill), paint)

    def masks(
        self, drawn: Drawn, answer: Answer, style: str, colours: np.ndarray, thresholds: np.ndarray
    ) -> moderngl.Texture:
        """What passes, in one of `MASK_STYLES`; colours (P, 3) and thresholds (P,) of the prompts."""
        capacity = _capacity(answer.num_phrases)
        around, defines = self._around(drawn)
        return self._filled(
            ("masks", style),
            (*answer.key, drawn.background, colours.tobytes(), thresholds.tobytes(), drawn.fill),
            "show_masks.frag",
            {**drawn.colour, **drawn.depth, **answer.relevance, **around},
            {
                "num_prompts": answer.num_phrases,
                "style": MASK_STYLES.index(style),
                "background": drawn.background,
                "thresholds": _padded(thresholds, capacity),
                "label_colours": _padded(colours, capacity),
            },
            {**_COVERED, **defines, "MAX_PROMPTS": capacity},
        )

    def margin(
        self, drawn: Drawn, answer: Answer, threshold: float, span: Span, colormap: str, over_rgb: bool
    ) -> moderngl.Texture:
        """The best prompt's relevance less the second best's; of one prompt, less `threshold`."""
        return self._filled(
            ("margin",),
            (*answer.key, threshold, span, colormap, over_rgb),
            "show_margin.frag",
            {**drawn.colour, **answer.relevance},
            {
                "num_prompts": answer.num_phrases,
                "threshold": threshold,
                "span": span,
                "colour_stops": colour_stops(colormap),
                "opacity": _TRUST_OPACITY if over_rgb else 1.0,
            },
            _COVERED,
        )

    # --- of weight maps -------------------------------------------------------------------------

    def weight(self, maps: Maps, atom: int, colormap: str) -> moderngl.Texture:
        """One atom's weight map, 0 to 1."""
        places = np.flatnonzero(maps.atoms == atom)

        def paint(into: moderngl.Framebuffer) -> None:
            into.clear(0.0, 0.0, 0.0, 1.0)
            if len(places):
                textures = {"weight_maps": maps.array}
                self._painter.fill(
                    into,
                    "show_weight.frag",
                    textures,
                    {"place": int(places[0]), "colour_stops": colour_stops(colormap)},
                )

        return self._picture(("weight",), (maps.version, atom, colormap), paint)

    def atoms(self, maps: Maps, colours: np.ndarray) -> moderngl.Texture:
        """sum_k W_k c_k for colours (K, 3), on black."""
        return self._combined(("atoms",), "show_atoms.frag", maps, colours)

    def features(self, maps: Maps, columns: np.ndarray) -> moderngl.Texture:
        """sum_k W_k c_k / sum_k W_k for columns (K, 4), the last of ones; empty pixels black."""
        return self._combined(("features",), "show_features.frag", maps, columns)

    def _combined(self, kind: tuple, fragment: str, maps: Maps, columns: np.ndarray) -> moderngl.Texture:
        def paint(into: moderngl.Framebuffer) -> None:
            into.clear(0.0, 0.0, 0.0, 1.0)
            if len(maps.atoms):
                self._packed.combine(into, fragment, maps, columns[maps.atoms])

        return self._picture(kind, (maps.version,), paint)

    def brought(self, kind: str, key: Hashable, make: Callable[[], np.ndarray]) -> moderngl.Texture:
        """A picture (H, W, 3) in [0, 1] that is not made by a shader."""

        def paint(into: moderngl.Framebuffer) -> None:
            rgba = np.full((self._size[1], self._size[0], 4), 255, np.uint8)
            rgba[..., :3] = np.clip(255 * make() + 0.5, 0, 255)
            texture = into.color_attachments[0]
            assert isinstance(texture, moderngl.Texture)
            texture.write(rgba)

        return self._picture((kind,), key, paint)

    # --- inside ---------------------------------------------------------------------------------

    def _filled(
        self,
        kind: tuple,
        key: tuple,
        fragment: str,
        textures: Textures,
        uniforms: Uniforms,
        defines: Mapping[str, float] | None = None,
    ) -> moderngl.Texture:
        """The picture of `kind` that a fragment shader makes of `textures`."""
        return self._picture(
            kind, key, lambda into: self._painter.fill(into, fragment, textures, uniforms, defines)
        )

    def _picture(
        self, kind: tuple, key: Hashable, paint: Callable[[moderngl.Framebuffer], None], dtype: str = "f1"
    ) -> moderngl.Texture:
        """The texture of `kind`; `paint` draws it where `key` differs from the last time."""
        if kind not in self._pictures:
            texture = self._painter.ctx.texture(self._size, 4, dtype=dtype)
            self._pictures[kind] = texture, self._painter.ctx.framebuffer([texture])
        texture, framebuffer = self._pictures[kind]
        if self._keys.get(kind) != key:
            paint(framebuffer)
            self._keys[kind] = key
            self._painter.passes["show"] += 1
        return texture

    @property
    def label_ids(self) -> moderngl.Texture:
        """(H, W) float16: 0 for none, 1 + prompt elsewhere; exact up to 2,048 prompts."""
        if self._label_ids is None:
            self._label_ids = self._painter.ctx.texture(self._size, 1, dtype="f2")
        return self._label_ids

    def release(self) -> None:
        for texture, framebuffer in self._pictures.values():
            framebuffer.release()
            texture.release()
        self._pictures.clear()
        self._keys.clear()
        if self._gaps is not None:
            self._gaps.release()
        self._gaps = None
        if self._label_ids is not None:
            self._label_ids.release()
        self._label_ids = None


def _capacity(num_prompts: int) -> int:
    """Prompts that a program is compiled for: a few sizes only."""
    return max(16, 1 << (num_prompts - 1).bit_length())


def _padded(values: np.ndarray, capacity: int) -> np.ndarray:
    """(P, ...) filled up with zeros to (capacity, ...)."""
    return np.pad(values, ((0, capacity - len(values)), *((0, 0),) * (values.ndim - 1)))
