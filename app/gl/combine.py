"""Everything computed from weight maps without touching a splat: norms, relevance, atom colours.

The maps are packed once a view into shares of the pixel's largest weight, sixteen bits each, eight
atoms a texel: a phrase then reads a third as many texels, of a format that is quick to read. Half
a step, 8e-6 of the peak, moves a cosine by some 1e-5; float16 maps are 30 times coarser.
"""

from collections import Counter

import moderngl
import numpy as np

from langflash_core.language.relevance import EMPTY_NORM, CompiledQuery

from .programs import Programs, set_uniforms
from .targets import ADDED, MAXIMUM, LayerTarget, drawing

PHRASES = 4  # a layer of relevance
_CAPACITIES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 120)  # few, so that few programs are compiled
_UNIFORMS = 960  # of the 1,024 vec4s that drivers have
_PACKED = 8  # atoms a texel
_MAX_COLUMNS = 16  # of |F|^2 a pass
_STEPS = 65535


class Screen:
    """Draws a full-screen triangle with any program."""

    def __init__(self, ctx: moderngl.Context):
        self._ctx = ctx
        self._vaos: dict[int, moderngl.VertexArray] = {}

    def draw(self, program: moderngl.Program) -> None:
        if program.glo not in self._vaos:
            self._vaos[program.glo] = self._ctx.vertex_array(program, [])
        self._vaos[program.glo].render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        for vao in self._vaos.values():
            vao.release()
        self._vaos.clear()


def layer_capacity(num_atoms: int) -> int:
    """Texels that so many atoms are given: a few sizes only.

    Raises:
        ValueError: more atoms than a shader's uniforms hold.
    """
    if num_atoms > _PACKED * _CAPACITIES[-1]:
        raise ValueError(f"atoms in view: expected at most {_PACKED * _CAPACITIES[-1]}, received {num_atoms}")
    return next(size for size in _CAPACITIES if num_atoms <= _PACKED * size)


def pack_columns(columns: np.ndarray, capacity: int) -> np.ndarray:
    """(Ka, n) to the (2 * capacity * n, 4) floats of `columns` in combine.glsl."""
    padded = np.zeros((_PACKED * capacity, columns.shape[1]), np.float32)
    padded[: len(columns)] = columns / _STEPS
    return padded.reshape(2 * capacity, 4, -1).transpose(0, 2, 1).reshape(-1, 4)


class QueryPasses:
    """Relevance of a compiled query over one set of weight maps.

    Cached steps: packing (per view), |F|^2 (per dictionary), its inverse root and the best
    negative's cosine (per set of negatives), relevance (per prompts). Only what changed is drawn.
    """

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
        self._squares = ctx.texture(size, 2, dtype="f4")
        self._scales = ctx.texture(size, 2, dtype="f4")
        self._peaks = ctx.texture(size, 1, dtype="f4")
        self._peaks_target = ctx.framebuffer([self._peaks])
        self._squares_target = ctx.framebuffer([self._squares])
        self._scales_target = ctx.framebuffer([self._scales])
        self._packed: LayerTarget | None = None
        self.relevance: LayerTarget | None = None
        self._keys: dict[str, tuple] = {}

    def run(
        self, compiled: CompiledQuery, weights: LayerTarget | None, atoms: np.ndarray, version: int
    ) -> LayerTarget:
        """Relevance (4 prompts a layer, float32) of `compiled` over `weights`, which hold `atoms`.

        Args:
            weights: None where no atom is in view: relevance is 0.
            version: changes whenever the weight maps do.
        """
        num_groups = max(1, -(-len(compiled.prompts) // PHRASES))
        if self.relevance is None or self.relevance.num_layers != num_groups:
            self._drop_relevance()
            self.relevance = LayerTarget(self._ctx, self._size, num_groups, "f4")
        if weights is None or not len(atoms):
            for group in range(num_groups):
                self.relevance.layers(group, 1).clear()
            return self.relevance
        temperature = float(compiled.temperature) if compiled.mode == "relevancy" else 0.0
        self._answer(compiled, weights, atoms, version, temperature)
        return self.relevance

    def _answer(
        self,
        compiled: CompiledQuery,
        weights: LayerTarget,
        atoms: np.ndarray,
        version: int,
        temperature: float,
    ) -> None:
        """Fill `relevance`; temperature 0 is the cosine mode."""
        factor = compiled.factor.detach().cpu().double().numpy()[atoms]  # (Ka, r)
        prompts = compiled.prompts.detach().cpu().double().numpy()
        negatives = compiled.negatives.detach().cpu().double().numpy()
        self._pack(weights, len(atoms), version)
        if self._stale("norm", (version, factor.tobytes())):
            self._norms(factor)
            self._forget("scales")
        if self._stale("scales", (version, negatives.tobytes())):
            self._scale(factor @ negatives.T)
            self._forget("prompts")
        if self._stale("prompts", (version, temperature, prompts.tobytes())):
            self._relevance(factor @ prompts.T, temperature)

    def _stale(self, name: str, key: tuple) -> bool:
        changed = self._keys.get(name) != key
        self._keys[name] = key
        return changed

    def _forget(self, name: str) -> None:
        self._keys.pop(name, None)

    def _pack(self, weights: LayerTarget, num_atoms: int, version: int) -> None:
        """The weight maps as shares of their peaks, once for each version of them."""
        if not self._stale("packed", (version,)):
            return
        chunks = -(-num_atoms // 24)
        needed = max(3 * chunks, layer_capacity(num_atoms))
        if self._packed is None or self._packed.num_layers < needed:
            self._drop_packed()
            self._packed = LayerTarget(self._ctx, self._size, needed, "u4")
        num_layers = -(-num_atoms // 3)
        weights.array.use(0)
        self._peaks.use(1)
        program = self._programs.get("screen.vert", "peak.frag")
        set_uniforms(program, weight_maps=0, num_layers=num_layers)
        with drawing(self._peaks_target):
            self._screen.draw(program)
        program = self._programs.get("screen.vert", "pack.frag")
        for chunk in range(chunks):
            set_uniforms(program, weight_maps=0, peaks=1, first_layer=8 * chunk, num_layers=num_layers)
            with drawing(self._packed.layers(3 * chunk, 3)):
                self._screen.draw(program)
        self._passes["pack"] += 1

    def _program(self, fragment: str, columns: np.ndarray, first_layer: int = 0, **defines: float):
        """The program that combines `columns` (Ka, n) of the atoms from `first_layer` on, ready to draw."""
        assert self._packed is not None
        capacity = layer_capacity(len(columns))
        settings = {"LAYERS": capacity, "COLUMNS": columns.shape[1], **defines}
        program = self._programs.get("screen.vert", fragment, settings)
        self._packed.array.use(0)
        set_uniforms(program, packed_maps=0, first_layer=first_layer, columns=pack_columns(columns, capacity))
        return program

    def _norms(self, factor: np.ndarray) -> None:
        """|w R|^2. R = L Q with triangular L, so column j needs no atom before j."""
        triangular = np.asarray(np.linalg.qr(factor.T, mode="r")).T  # (Ka, min(Ka, r))
        together = _UNIFORMS // (2 * layer_capacity(len(factor)))
        width = min(_MAX_COLUMNS, 1 << (together.bit_length() - 1))
        self._peaks.use(1)
        self._squares_target.clear()
        with drawing(self._squares_target, ADDED):
            for start in range(0, triangular.shape[1], width):
                first = start // _PACKED
                columns = triangular[_PACKED * first :, start : start + width]
                columns = np.pad(columns, ((0, 0), (0, width - columns.shape[1])))
                program = self._program("norm.frag", columns, first)
                set_uniforms(program, peaks=1, with_peak=float(start == 0))
                self._screen.draw(program)
        self._passes["norm"] += 1

    def _scale(self, dots: np.ndarray) -> None:
        """1 / |w R| and the largest of the negatives' cosines (Ka, M); of none where M = 0."""
        groups = range(0, max(1, dots.shape[1]), PHRASES)
        self._squares.use(1)
        self._scales_target.clear(0.0, -1.0)
        with drawing(self._scales_target, ADDED, MAXIMUM):
            for group in groups:
                block = dots[:, group : group + PHRASES]
                filler = block[:, :1] if block.shape[1] else np.zeros((len(dots), 1))
                block = np.concatenate((block, np.repeat(filler, PHRASES - block.shape[1], 1)), 1)
                program = self._program("scale.frag", block, EMPTY_NORM=EMPTY_NORM)
                set_uniforms(program, squares=1)
                self._screen.draw(program)
        self._passes["negatives"] += 1

    def _relevance(self, dots: np.ndarray, temperature: float) -> None:
        assert self.relevance is not None
        self._scales.use(1)
        for group in range(self.relevance.num_layers):
            program = self._program("relevance.frag", dots[:, PHRASES * group : PHRASES * (group + 1)])
            set_uniforms(program, scales=1, temperature=temperature)
            with drawing(self.relevance.layers(group, 1)):
                self._screen.draw(program)
        self._passes["query"] += 1

    def paint_atoms(
        self, weights: LayerTarget, colours: np.ndarray, version: int, target: moderngl.Framebuffer
    ) -> None:
        """sum_k W_k c_k into `target` for colours (Ka, 3) of the atoms in `weights`."""
        self._pack(weights, len(colours), version)
        program = self._program("show_atoms.frag", colours)
        self._peaks.use(1)
        set_uniforms(program, peaks=1)
        with drawing(target):
            self._screen.draw(program)

    def paint_features(
        self, weights: LayerTarget, columns: np.ndarray, version: int, target: moderngl.Framebuffer
    ) -> None:
        """sum_k W_k c_k / sum_k W_k into `target` for columns (Ka, 4), the last of ones."""
        self._pack(weights, len(columns), version)
        program = self._program("show_features.frag", columns)
        self._peaks.use(1)
        set_uniforms(program, peaks=1)
        with drawing(target):
            self._screen.draw(program)

    def _drop_relevance(self) -> None:
        if self.relevance is not None:
            self.relevance.release()
        self.relevance = None
        self._forget("prompts")

    def _drop_packed(self) -> None:
        if self._packed is not None:
            self._packed.release()
        self._packed = None

    def release(self) -> None:
        self._drop_relevance()
        self._drop_packed()
        for owned in (
            self._squares_target,
            self._scales_target,
            self._peaks_target,
            self._squares,
            self._scales,
            self._peaks,
        ):
            owned.release()
