"""Ways of drawing that the renderer decided against, each the renderer's own with one part exchanged,
so that the decision can be measured. Splats go into `SplatRenderer(...)`, answers into `ask(...)`."""

import moderngl
import numpy as np

from langflash_core.base.graphics import Programs
from langflash_core.language.relevance import EMPTY_NORM, CompiledQuery
from langflash_core.types import Camera, Scene

from ..gl.answers import Answers, ShaderAnswers, in_numbers, temperature_of
from ..gl.layout import DEFINES, LAYERS_A_PASS, PHRASES_A_LAYER
from ..gl.packed import PackedMaps, blocks
from ..gl.painter import Painter
from ..gl.shapes import MakeShapes
from ..gl.splats import SplatBuffers
from ..gl.targets import ADDED, Layers, LayerTarget
from ..gl.weights import Maps


class ThreeSigma(SplatBuffers):
    """Quads end at three deviations: too early for the opaque, too late for the faint."""

    def __init__(self, ctx: moderngl.Context, programs: Programs, scene: Scene, shapes: MakeShapes):
        self._cut = Programs(ctx, "splat", {**DEFINES, "CUT": 3.0})
        super().__init__(ctx, self._cut, scene, shapes)

    def release(self) -> None:
        super().release()
        self._cut.release()


class StaleOrder(SplatBuffers):
    """Draws in the order of the last `sort_for`, as what moves does at worst: found quickly, and late."""

    def sort(self, camera: Camera) -> None:
        if not len(self.order):
            super().sort(camera)

    def sort_for(self, camera: Camera) -> None:
        self.draw_in(self._ordering.quick(camera))


def gram_answers(painter: Painter, size: tuple[int, int], packed: PackedMaps) -> Answers:
    """|F|^2 as w^T G w with the Gram matrix G = D D^T of the atoms in view."""
    return ShaderAnswers(painter, size, packed, _add_gram_squares)


def _add_gram_squares(packed: PackedMaps, maps: Maps, factor: np.ndarray, into: moderngl.Framebuffer) -> None:
    gram = factor @ factor.T
    lower = np.tril(2 * gram, -1) + np.diag(np.diag(gram))  # (Ka, Ka)
    for start, first, block in blocks(lower, triangular=True):
        packed.combine(
            into,
            "bench/gram.frag",
            maps,
            block,
            first,
            blend=ADDED,
            uniforms={"with_peak": float(start == 0), "first_column": start},
        )


class FullAnswers(Answers):
    """F formed in all its C channels at every pixel, for every question.

    Of a query whose factor is D (K, C) and whose phrases have C numbers.
    """

    def __init__(self, painter: Painter, size: tuple[int, int], packed: PackedMaps):
        super().__init__(painter, size, packed)
        self._sums = Layers(painter.ctx, size, "f4")

    def answer(self, compiled: CompiledQuery, maps: Maps, into: LayerTarget) -> None:
        """
        Raises:
            ValueError: more than 28 phrases and negatives.
        """
        dictionary, prompts, negatives = in_numbers(compiled, maps.atoms)
        phrases = np.concatenate((_whole_layers(prompts), _whole_layers(negatives)))
        most = PHRASES_A_LAYER * (LAYERS_A_PASS - 1)  # beside the layer of |F|^2
        if len(phrases) > most:
            raise ValueError(f"phrases: expected at most {most}, in fours")
        if self.stale("prompts", maps.version, into, phrases.tobytes()):
            sums = self._sums.exactly(1 + len(phrases) // PHRASES_A_LAYER)
            self._add_channels(maps, dictionary, phrases, sums)
            self._compare(sums, len(prompts), len(negatives), temperature_of(compiled), into)

    def _add_channels(
        self, maps: Maps, dictionary: np.ndarray, phrases: np.ndarray, sums: LayerTarget
    ) -> None:
        """|F|^2 and the products with `phrases` (4 * groups, C), over all channels."""
        target = sums.layers(0, sums.num_layers)
        target.clear()
        for start, _, block in blocks(dictionary):
            some = phrases[:, start : start + block.shape[1]]
            some = np.pad(some, ((0, 0), (0, block.shape[1] - some.shape[1])))  # (4 * groups, width)
            self.packed.combine(
                target,
                "bench/full.frag",
                maps,
                block,
                defines={"GROUPS": sums.num_layers - 1},
                blend=ADDED,
                uniforms={"phrases": some.T, "with_peak": float(start == 0)},
            )
        self.painter.passes["norm"] += 1

    def _compare(
        self, sums: LayerTarget, num_prompts: int, num_negatives: int, temperature: float, into: LayerTarget
    ) -> None:
        """The sums into relevance."""
        for group in range(into.num_layers):
            self.painter.fill(
                into.layers(group, 1),
                "bench/full_relevance.frag",
                {"sums": sums.array},
                {
                    "layer": 1 + group,
                    "first_negative": num_prompts + -num_prompts % PHRASES_A_LAYER,
                    "num_negatives": num_negatives,
                    "temperature": temperature,
                },
                {"EMPTY_NORM": EMPTY_NORM},
            )
        self.painter.passes["query"] += 1

    def release(self) -> None:
        super().release()
        self._sums.release()


def _whole_layers(phrases: np.ndarray) -> np.ndarray:
    """Rows filled up with zeros to a multiple of four, the phrases of a layer."""
    return np.pad(phrases, ((0, -len(phrases) % PHRASES_A_LAYER), (0, 0)))
