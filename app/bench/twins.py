"""Ways of drawing that the renderer decided against, each the renderer's own with one thing changed,
so that the decision can be measured."""

import moderngl
import numpy as np

from app.gl.combine import QueryPasses, layer_capacity
from app.gl.programs import Programs, set_uniforms
from app.gl.renderer import SplatRenderer
from app.gl.splats import SplatBuffers
from app.gl.targets import ADDED, LayerTarget, drawing
from langflash_core.language.relevance import EMPTY_NORM, CompiledQuery
from langflash_core.types import Camera, Scene

_UNIFORMS = 960  # vec4s of columns in one program, of the 1,024 that drivers have
_PACKED = 8  # atoms a texel of the packed maps
_GROUP = 4  # phrases a layer
_MAX_GROUPS = 7  # layers of products drawn at once, beside that of |F|^2


class SwitchedRenderer(SplatRenderer):
    """The renderer with exchangeable parts; they share its targets, so that many fit in memory."""

    def __init__(self, ctx: moderngl.Context, precision):
        super().__init__(ctx, precision)
        self._kept_buffers: dict[tuple, SplatBuffers] = {}
        self._kept_queries: dict[type, QueryPasses] = {}

    def switch(
        self,
        scene: Scene,
        camera: Camera,
        buffers: type[SplatBuffers] = SplatBuffers,
        query: type[QueryPasses] | None = None,
    ) -> SplatBuffers:
        """Draw `scene` with these parts from now on, at the camera's size; nothing counts as drawn.

        Args:
            query: None: the one that the renderer has chosen for this OpenGL.
        """
        query = query or self._query_passes
        if self._size != (camera.width, camera.height):
            self._drop_queries()
        key = (id(scene), buffers)
        if key not in self._kept_buffers:
            self._kept_buffers[key] = buffers(self._ctx, self._programs, scene)
        if scene is not self._scene:
            self._compiled = None
        self._scene, self._splats = scene, self._kept_buffers[key]
        self._levels = {1.0: self._splats}
        self._resize(camera)
        assert self._query is not None and self._size is not None
        self._kept_queries.setdefault(type(self._query), self._query)
        if query not in self._kept_queries:
            made = query(self._ctx, self._programs, self._screen, self._size, self.passes)
            self._kept_queries[query] = made
        self._query = self._kept_queries[query]
        self._drawn = {}
        self._numbers = self._norms = None
        return self._splats

    def carry(self) -> None:
        """Make what the fast mode's Gaussians carry for this question, as a camera that moves finds it."""
        self._carried()

    def forget_answers(self) -> None:
        """The next question is answered from the weight maps alone, as the first of a view."""
        assert self._query is not None
        self._query._keys.clear()

    def _drop_queries(self) -> None:
        for kept in self._kept_queries.values():
            if kept is not self._query:
                kept.release()
        self._kept_queries.clear()

    def release(self) -> None:
        """Give back the parts in use and those laid aside."""
        self._drop_queries()
        for kept in self._kept_buffers.values():
            kept.release()
        self._kept_buffers.clear()
        super().release()


class _ThreeSigmaPrograms(Programs):
    def get(self, vertex, fragment=None, defines=None, varyings=()):
        cut = {"CUT": 3.0} if vertex == "project.vert" else {}
        return super().get(vertex, fragment, {**(defines or {}), **cut}, varyings)


class ThreeSigma(SplatBuffers):
    """Quads end at three deviations: too early for the opaque, too late for the faint."""

    def __init__(self, ctx: moderngl.Context, programs: Programs, scene: Scene):
        self._own_programs = _ThreeSigmaPrograms(ctx)
        super().__init__(ctx, self._own_programs, scene)

    def release(self) -> None:
        super().release()
        self._own_programs.release()


class StaleOrder(SplatBuffers):
    """Draws in the order of the last `sort_for`, as if the sort came one frame late."""

    def sort(self, camera: Camera) -> None:
        if not len(self.order):
            super().sort(camera)

    def sort_for(self, camera: Camera) -> None:
        super().sort(camera)


class GramQuery(QueryPasses):
    """|F|^2 as w^T G w with the Gram matrix G = D D^T of the atoms in view."""

    def _norms(self, factor: np.ndarray) -> None:
        gram = factor @ factor.T
        lower = np.tril(2 * gram, -1) + np.diag(np.diag(gram))  # (Ka, Ka)
        width = _width(len(factor))
        self._peaks.use(1)
        self._squares_target.clear()
        with drawing(self._squares_target, ADDED):
            for start in range(0, len(lower), width):
                first = start // _PACKED
                columns = _padded(lower[_PACKED * first :, start : start + width], width)
                program = self._program("bench/gram.frag", columns, first)
                set_uniforms(program, peaks=1, with_peak=float(start == 0), first_atom=start)
                self._screen.draw(program)
        self._passes["norm"] += 1


class FullQuery(QueryPasses):
    """F formed in all its C channels at every pixel, for every question."""

    _sums: LayerTarget | None = None

    def _answer(
        self,
        compiled: CompiledQuery,
        weights: LayerTarget,
        atoms: np.ndarray,
        version: int,
        temperature: float,
    ) -> None:
        """Of a query whose factor is D (K, C) and whose phrases have C numbers.

        Raises:
            ValueError: more than 28 phrases and negatives.
        """
        prompts, negatives = compiled.prompts.double().numpy(), compiled.negatives.double().numpy()
        phrases = np.concatenate((_in_fours(prompts), _in_fours(negatives)))
        if len(phrases) > _GROUP * _MAX_GROUPS:
            raise ValueError(f"phrases: expected at most {_GROUP * _MAX_GROUPS}, in fours")
        self._pack(weights, len(atoms), version)
        if self._stale("prompts", (version, phrases.tobytes())):
            self._add_channels(compiled.factor.double().numpy()[atoms], phrases)
            self._compare(len(prompts), len(negatives), temperature)

    def _add_channels(self, dictionary: np.ndarray, phrases: np.ndarray) -> None:
        """|F|^2 and the products with `phrases` (4 * groups, C), over all channels."""
        groups = len(phrases) // _GROUP
        if self._sums is None or self._sums.num_layers != 1 + groups:
            self._drop_sums()
            self._sums = LayerTarget(self._ctx, self._size, 1 + groups, "f4")
        width = _width(len(dictionary))
        target = self._sums.layers(0, 1 + groups)
        self._peaks.use(1)
        target.clear()
        with drawing(target, ADDED):
            for start in range(0, dictionary.shape[1], width):
                columns = _padded(dictionary[:, start : start + width], width)
                program = self._program("bench/full.frag", columns, GROUPS=groups)
                block = _padded(phrases[:, start : start + width], width)  # (4 * groups, width)
                set_uniforms(program, phrases=block.T, peaks=1, with_peak=float(start == 0))
                self._screen.draw(program)
        self._passes["norm"] += 1

    def _compare(self, num_prompts: int, num_negatives: int, temperature: float) -> None:
        """The sums into relevance."""
        assert self.relevance is not None and self._sums is not None
        program = self._programs.get("screen.vert", "bench/full_relevance.frag", {"EMPTY_NORM": EMPTY_NORM})
        self._sums.array.use(0)
        for group in range(self.relevance.num_layers):
            set_uniforms(
                program,
                sums=0,
                layer=1 + group,
                first_negative=num_prompts + -num_prompts % _GROUP,
                num_negatives=num_negatives,
                temperature=temperature,
            )
            with drawing(self.relevance.layers(group, 1)):
                self._screen.draw(program)
        self._passes["query"] += 1

    def _drop_sums(self) -> None:
        if self._sums is not None:
            self._sums.release()
        self._sums = None

    def release(self) -> None:
        self._drop_sums()
        super().release()


def _width(num_atoms: int) -> int:
    """Columns a pass: as many as the uniforms hold, a power of two up to 16."""
    together = _UNIFORMS // (2 * layer_capacity(num_atoms))
    return min(16, 1 << (together.bit_length() - 1))


def _padded(columns: np.ndarray, width: int) -> np.ndarray:
    return np.pad(columns, ((0, 0), (0, width - columns.shape[1])))


def _in_fours(phrases: np.ndarray) -> np.ndarray:
    """Rows filled up with zeros to a multiple of four."""
    return np.pad(phrases, ((0, -len(phrases) % _GROUP), (0, 0)))
