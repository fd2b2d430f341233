"""Relevance of phrases, computed from weight maps without touching a splat.

Whoever answers is a class or function of the form `MakeAnswers`: shaders here, numpy in host.py.
"""

from collections.abc import Callable, Hashable

import numpy as np

from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import RELEVANCE

from .layout import PHRASES_A_LAYER, num_groups
from .packed import PackedMaps, blocks
from .painter import Painter
from .targets import ADDED, MAXIMUM, Layers, LayerTarget
from .weights import Maps


class Answers:
    """Owns the relevance of one picture size: 4 phrases a layer, float32. Subclasses have the three steps: of
    a dictionary, of a set of negatives, of prompts. Those whose inputs are as the last time are passed over.
    """

    def __init__(self, painter: Painter, size: tuple[int, int], packed: PackedMaps):
        """packed: shared by all who answer over these maps; its maker releases it."""
        self.painter = painter
        self.packed = packed
        self._relevance = Layers(painter.ctx, size, "f4")
        self._keys: dict[str, Hashable] = {}

    def run(self, compiled: CompiledQuery, maps: Maps) -> LayerTarget:
        """Relevance of `compiled` over `maps`; 0 where no atom is in view."""
        relevance = self._relevance.exactly(num_groups(len(compiled.prompts)))
        if len(maps.atoms):
            self._answer(compiled, maps, relevance)
            return relevance
        for group in range(relevance.num_layers):
            relevance.layers(group, 1).clear()
        self.forget()
        return relevance

    def _answer(self, compiled: CompiledQuery, maps: Maps, into: LayerTarget) -> None:
        """Fill `into` over maps of at least one atom."""
        factor, prompts, negatives = in_numbers(compiled, maps.atoms)
        temperature = temperature_of(compiled)
        against = (maps.version, factor.tobytes(), negatives.tobytes())
        if self._stale("norm", *against[:2]):
            self.measure(maps, factor)
        if self._stale("negatives", *against):
            self.scale(maps, factor @ negatives.T)
        if self._stale("query", *against, into, temperature, prompts.tobytes()):
            self.compare(maps, factor @ prompts.T, temperature, into)

    def _stale(self, step: str, *inputs: Hashable) -> bool:
        """Whether a step's inputs differ from the last time; it is taken and counted then."""
        changed = self._keys.get(step) != inputs
        self._keys[step] = inputs
        if changed:
            self.painter.passes[step] += 1
        return changed

    def measure(self, maps: Maps, factor: np.ndarray) -> None:
        """|w R| for a factor R (Ka, r)."""
        raise NotImplementedError

    def scale(self, maps: Maps, dots: np.ndarray) -> None:
        """1 / |w R| and the largest of the negatives' cosines, by products (Ka, M) with the atoms; of none
        where M = 0."""
        raise NotImplementedError

    def compare(self, maps: Maps, dots: np.ndarray, temperature: float, into: LayerTarget) -> None:
        """Relevance of prompts by their products (Ka, P) with the atoms."""
        raise NotImplementedError

    def forget(self) -> None:
        """Nothing counts as computed."""
        self._keys.clear()

    def release(self) -> None:
        self._relevance.release()
        self.forget()


MakeAnswers = Callable[[Painter, tuple[int, int], PackedMaps], Answers]


class ShaderAnswers(Answers):
    """In shaders, from packed maps: the packing is of a view, |F|^2 of a dictionary, its inverse root and the
    best negative's cosine of a set of negatives, relevance of the prompts. Only what changed is drawn."""

    def __init__(self, painter: Painter, size: tuple[int, int], packed: PackedMaps):
        super().__init__(painter, size, packed)
        self._squares = painter.ctx.texture(size, 2, dtype="f4")
        self._scales = painter.ctx.texture(size, 2, dtype="f4")
        self._squares_target = painter.ctx.framebuffer([self._squares])
        self._scales_target = painter.ctx.framebuffer([self._scales])

    def measure(self, maps: Maps, factor: np.ndarray) -> None:
        """|w R|^2, and the peak. R = L Q with triangular L: column j needs no atom before j."""
        self._squares_target.clear()
        triangular = np.asarray(np.linalg.qr(factor.T, mode="r")).T  # (Ka, min(Ka, r))
        for start, first, block in blocks(triangular):
            self.packed.combine(
                self._squares_target,
                "norm.frag",
                maps,
                block,
                first,
                uniforms={"with_peak": float(start == 0)},
                blend=ADDED,
            )

    def scale(self, maps: Maps, dots: np.ndarray) -> None:
        self._scales_target.clear(0.0, -1.0)
        for group in range(num_groups(dots.shape[1])):
            block = dots[:, PHRASES_A_LAYER * group :][:, :PHRASES_A_LAYER]
            filler = block[:, :1] if block.shape[1] else np.zeros((len(dots), 1))
            block = np.concatenate((block, np.repeat(filler, PHRASES_A_LAYER - block.shape[1], 1)), 1)
            self.packed.combine(
                self._scales_target,
                "scale.frag",
                maps,
                block,
                textures={"squares": self._squares},
                defines={"EMPTY_NORM": RELEVANCE.empty_norm},
                blend=ADDED,
                equation=MAXIMUM,
            )

    def compare(self, maps: Maps, dots: np.ndarray, temperature: float, into: LayerTarget) -> None:
        for group in range(into.num_layers):
            self.packed.combine(
                into.layers(group, 1),
                "relevance.frag",
                maps,
                dots[:, PHRASES_A_LAYER * group :][:, :PHRASES_A_LAYER],
                textures={"scales": self._scales},
                uniforms={"temperature": temperature},
            )

    def release(self) -> None:
        super().release()
        for owned in (self._squares_target, self._scales_target, self._squares, self._scales):
            owned.release()


def in_numbers(
    compiled: CompiledQuery, atoms: np.ndarray | slice = slice(None)
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Factor (Ka, r) of the atoms, prompts (P, r) and negatives (M, r) in float64."""
    tensors = (compiled.factor, compiled.prompts, compiled.negatives)
    factor, prompts, negatives = (values.detach().cpu().double().numpy() for values in tensors)
    return factor[atoms], prompts, negatives


def temperature_of(compiled: CompiledQuery) -> float:
    """As shaders and numpy take it: 0 is the cosine mode."""
    return float(compiled.temperature) if compiled.mode == "relevancy" else 0.0
