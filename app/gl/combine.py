"""Everything computed from weight maps without touching a splat: norms, relevance, atom colours."""

from collections import Counter

import moderngl
import numpy as np

from langflash_core.query.relevance import EMPTY_NORM, CompiledQuery

from .programs import Programs, set_uniforms
from .targets import ADDED, MAXIMUM, LayerTarget, drawing

_MAX_LAYERS = 340  # 1,020 atoms: 1,020 of the 1,024 uniform vec4s every OpenGL 3.3 has
_BLOCKS = 4  # of four components of |F|^2 a pass, where the uniforms suffice


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


def layer_capacity(num_layers: int) -> int:
    """Uniform array length for so many layers: a few sizes, so that few programs are compiled.

    Raises:
        ValueError: more atoms than a shader's uniforms hold.
    """
    if num_layers > _MAX_LAYERS:
        raise ValueError(f"atoms in view: expected at most {3 * _MAX_LAYERS}, received {3 * num_layers}")
    return next(size for size in (8, 16, 48, _MAX_LAYERS // _BLOCKS, _MAX_LAYERS) if num_layers <= size)


def pack_columns(columns: np.ndarray, capacity: int) -> np.ndarray:
    """(Ka, up to 4) to the (3 * capacity, 4) floats of `columns` in combine.glsl."""
    packed = np.zeros((3 * capacity, 4), np.float32)
    packed[: columns.shape[0], : columns.shape[1]] = columns
    return packed


class QueryPasses:
    """Relevance of a compiled query over one set of weight maps.

    Three cached steps: |F|^2 (per view and dictionary), the best negative's cosine (per set of
    negatives), relevance (per prompts). Only what changed is drawn.
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
        self._squares = ctx.texture(size, 1, dtype="f4")
        self._largest = ctx.texture(size, 1, dtype="f4")
        self._squares_target = ctx.framebuffer([self._squares])
        self._largest_target = ctx.framebuffer([self._largest])
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
        factor = compiled.factor.detach().cpu().double().numpy()[atoms]  # (Ka, r)
        prompts = compiled.prompts.detach().cpu().double().numpy()
        negatives = compiled.negatives.detach().cpu().double().numpy()
        num_groups = max(1, -(-len(prompts) // 4))
        if self.relevance is None or self.relevance.num_layers != num_groups:
            self._drop_relevance()
            self.relevance = LayerTarget(self._ctx, self._size, num_groups, "f4")
        if weights is None or not len(atoms):
            for group in range(num_groups):
                self.relevance.layers(group, 1).clear()
            return self.relevance
        if self._stale("norm", (version, factor.tobytes())):
            self._norms(weights, factor)
        temperature = float(compiled.temperature) if compiled.mode == "relevancy" else 0.0
        if temperature and self._stale("negatives", (version, negatives.tobytes())):
            self._negatives(weights, factor @ negatives.T)
        key = (version, temperature, factor.tobytes(), prompts.tobytes(), negatives.tobytes())
        if self._stale("prompts", key):
            self._relevance(weights, factor @ prompts.T, temperature)
        return self.relevance

    def _stale(self, name: str, key: tuple) -> bool:
        changed = self._keys.get(name) != key
        self._keys[name] = key
        return changed

    def _program(
        self, weights: LayerTarget, num_atoms: int, fragment: str, defines: dict[str, float] | None = None
    ) -> tuple[moderngl.Program, int]:
        num_layers = -(-num_atoms // 3)
        capacity = layer_capacity(num_layers)
        program = self._programs.get("screen.vert", fragment, {"MAX_LAYERS": capacity, **(defines or {})})
        weights.array.use(0)
        set_uniforms(program, weight_maps=0, num_layers=num_layers, first_layer=0)
        return program, capacity

    def _norms(self, weights: LayerTarget, factor: np.ndarray) -> None:
        """|W R|^2. R = L Q with triangular L, so column j needs no atom before j."""
        blocks = _BLOCKS if -(-len(factor) // 3) <= _MAX_LAYERS // _BLOCKS else 1
        program, capacity = self._program(weights, len(factor), "norm.frag", {"BLOCKS": blocks})
        triangular = np.asarray(np.linalg.qr(factor.T, mode="r")).T  # (Ka, min(Ka, r))
        self._squares_target.clear()
        with drawing(self._squares_target, ADDED):
            for start in range(0, triangular.shape[1], 4 * blocks):
                parts = np.split(triangular[:, start : start + 4 * blocks], range(4, 4 * blocks, 4), axis=1)
                columns = np.concatenate([pack_columns(part, capacity) for part in parts])
                set_uniforms(program, columns=columns, first_layer=start // 3)
                self._screen.draw(program)
        self._passes["norm"] += 1

    def _negatives(self, weights: LayerTarget, dots: np.ndarray) -> None:
        program, capacity = self._program(
            weights, len(dots), "relevance.frag", {"LARGEST": 1, "EMPTY_NORM": EMPTY_NORM}
        )
        self._squares.use(1)
        set_uniforms(program, square_norms=1)
        self._largest_target.clear(-1.0, -1.0, -1.0, -1.0)
        with drawing(self._largest_target, ADDED, MAXIMUM):
            for group in range(0, dots.shape[1], 4):
                block = dots[:, group : group + 4]
                block = np.concatenate((block, np.repeat(block[:, :1], 4 - block.shape[1], 1)), 1)
                set_uniforms(program, columns=pack_columns(block, capacity))
                self._screen.draw(program)
        self._passes["negatives"] += 1

    def _relevance(self, weights: LayerTarget, dots: np.ndarray, temperature: float) -> None:
        assert self.relevance is not None
        program, capacity = self._program(weights, len(dots), "relevance.frag", {"EMPTY_NORM": EMPTY_NORM})
        self._squares.use(1)
        self._largest.use(2)
        set_uniforms(program, square_norms=1, negatives=2, temperature=temperature)
        for group in range(self.relevance.num_layers):
            block = pack_columns(dots[:, 4 * group : 4 * group + 4], capacity)
            set_uniforms(program, columns=block)
            with drawing(self.relevance.layers(group, 1)):
                self._screen.draw(program)
        self._passes["query"] += 1

    def paint_atoms(self, weights: LayerTarget, colours: np.ndarray, target: moderngl.Framebuffer) -> None:
        """sum_k W_k c_k into `target` for colours (Ka, 3) of the atoms in `weights`."""
        program, capacity = self._program(weights, len(colours), "show_atoms.frag")
        set_uniforms(program, columns=pack_columns(colours, capacity))
        with drawing(target):
            self._screen.draw(program)

    def _drop_relevance(self) -> None:
        if self.relevance is not None:
            self.relevance.release()
        self.relevance = None
        self._keys.pop("prompts", None)

    def release(self) -> None:
        self._drop_relevance()
        for owned in (self._squares_target, self._largest_target, self._squares, self._largest):
            owned.release()
