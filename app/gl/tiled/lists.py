"""Which Gaussians each tile of a picture may show, nearest first: projected, ordered and dealt out by compute
shaders. Of an order nothing crosses the bus but its length."""

from collections.abc import Iterator, Mapping

import moderngl
import numpy as np

from langflash_core.base.graphics import Programs, set_uniforms
from langflash_core.splat.projection import NEAR
from langflash_core.types import Camera

from ..buffers import Brought, Growing
from ..ordering import matrices
from ..vertices import Vertices

TILE = 16  # pixels a side
HIDDEN = 255  # a tint: not to be drawn
MOST_PAIRS = 1 << 24  # of Gaussians and tiles: 268 MB; a picture with more is drawn as quads
GROUP = 256  # threads that work together
_SCANNING = 1024  # those of the one group that sums up counts: as many as OpenGL 4.3 grants
_MOST_GROUPS = 65_535  # a shader runs, as many as OpenGL 4.3 grants
_EACH = 8  # elements a thread sorts
_DIGIT = 4  # bits of a key, sorted at once: counters of a group fill 16 KB, half of what OpenGL 4.3 grants
_HIGH_BITS = 28  # of a depth key's upper word: eleven of the exponent, less what no depth has, and mantissa
_SLACK = 0.02  # deviations, of quad.vert
_DEFINES = {"GROUP": GROUP, "EACH": _EACH, "DIGITS": 1 << _DIGIT, "TILE": TILE}
_PROJECTING = {"SLACK": _SLACK, "HIDDEN": HIDDEN}
_SUMMING = {"GROUP": _SCANNING}
_SPLAT = 64  # bytes: footprint, place, colour, tiles and key
_KEY_BASE = 0x3F800000 << 32  # of project.comp


class TileLists:
    """Owns them, of N Gaussians, for one camera at a time: `splats`, `pairs` and `ranges`, as
    shaders/splat/tiled/splat.frag reads them.

    num_seen: Gaussians that touch a tile. num_pairs: of Gaussians and tiles. size: (width, height) pixels.
    """

    def __init__(
        self, ctx: moderngl.Context, programs: Programs, vertices: Vertices, count: int, beside: int
    ):
        """beside: bytes of each Gaussian in any buffer that shaders read beside the lists."""
        self.num_seen = self.num_pairs = 0
        self.size = (0, 0)
        self._ctx = ctx
        self._programs = programs
        self._vertices = vertices
        self._count = count
        self._made = {name: Growing(ctx) for name in ("splats", "ranges", "counts", "totals")}
        self._atoms = Brought(ctx)
        self._elements = [Growing(ctx), Growing(ctx)]  # keys and rows, by turns
        self._pairs = [Growing(ctx), Growing(ctx)]
        self._bytes = max(_SPLAT, vertices.most_bytes, beside)
        self._most_bytes = ctx.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"]

    def find(self, camera: Camera, projection: tuple[Mapping, Mapping], exact: bool) -> bool:
        """The lists of what a camera sees; False where the card cannot hold them, which leaves none.

        Args:
            projection: defines and uniforms of project.glsl.
            exact: whether depths are told apart to float64's last bits, and not to a millionth of themselves.
        """
        self.size = (camera.width, camera.height)
        self.num_seen = self.num_pairs = 0
        if self._count > min(self._most_bytes // self._bytes, _MOST_GROUPS * GROUP):
            return False
        seen, low, high = self._project(camera, *projection)
        pairs = low + (high << 32)
        if pairs > min(MOST_PAIRS, self._most_bytes // 8):
            return False
        self.num_seen, self.num_pairs = seen, pairs
        if pairs:
            self._order(exact)
            self._deal()
        return True

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of tiles."""
        width, height = self.size
        return -(-width // TILE), -(-height // TILE)

    # --- the steps ----------------------------------------------------------------------------

    def compile(self, defines: Mapping[str, float]) -> Iterator[None]:
        """All of them ahead, a shader a step. defines: of project.glsl."""
        for name in ("key", "digits", "move", "touched", "pair", "ranges", "atoms"):
            self._shader(name)
            yield
        self._shader("project", {**defines, **_PROJECTING})
        yield
        self._shader("scan", _SUMMING)
        yield

    def _shader(self, name: str, defines: Mapping[str, float] | None = None) -> moderngl.ComputeShader:
        return self._programs.compute(f"tiled/{name}.comp", {**_DEFINES, **(defines or {})})

    def _project(self, camera: Camera, defines: Mapping, uniforms: Mapping) -> tuple[int, int, int]:
        """Gaussians in view, and the two words of their pairs' number."""
        totals = self._buffer("totals", 12)
        totals.clear()
        viewmat, _ = matrices(camera)
        bound = (*self._vertices.buffers, self._buffer("splats", _SPLAT * self._count), totals)
        self._run(
            "project",
            -(-self._count // GROUP),
            bound,
            {**uniforms, "count": self._count, "grid": self.grid, "depth_row": tuple(viewmat[2].tolist())}
            | {"nearest": NEAR},
            {**defines, **_PROJECTING},
        )
        seen, low, high = np.frombuffer(totals.read(12), np.uint32).tolist()
        return seen, low, high

    def _order(self, exact: bool) -> None:
        """Rows by depth into the first of `_elements`, those out of view last."""
        for word in (0, 1) if exact else (1,):
            bound = (self._buffer("splats"), self._elements[0].at_least(8 * self._count))
            fresh = word == 0 or not exact
            given = {"count": self._count, "fresh": fresh, "half_of": word}
            self._run("key", -(-self._count // GROUP), bound, given)
            self._sort(self._elements, self._count, _HIGH_BITS if word else 32)

    def _deal(self) -> None:
        """Pairs of tile and row, tile by tile, nearest first, into the first of `_pairs`, and `ranges`."""
        blocks = -(-self.num_seen // GROUP)
        counts = self._buffer("counts", 4 * blocks)
        listed = self._buffer("splats"), self._elements[0].at_least(1)
        self._run("touched", blocks, (*listed, counts), {"count": self.num_seen})
        self._scan(blocks)
        pairs = self._pairs[0].at_least(8 * self.num_pairs)
        columns, rows = self.grid
        self._run("pair", blocks, (*listed, counts, pairs), {"count": self.num_seen, "columns": columns})
        self._sort(self._pairs, self.num_pairs, (columns * rows - 1).bit_length())
        ranges = self._buffer("ranges", 8 * columns * rows)
        ranges.clear()
        bound = (self._pairs[0].at_least(1), ranges)
        self._run("ranges", self._blocks(self.num_pairs), bound, {"count": self.num_pairs})

    def _sort(self, elements: list[Growing], count: int, bits: int) -> None:
        """By so many bits of their keys, stably, from the first buffer into the first."""
        blocks = self._blocks(count)
        num_counts = blocks << _DIGIT
        counts = self._buffer("counts", 4 * num_counts)
        for shift in range(0, bits, _DIGIT):
            source, into = (each.at_least(8 * count) for each in elements)
            given = {"count": count, "shift": shift}
            self._run("digits", blocks, (source, counts), given)
            self._scan(num_counts)
            self._run("move", blocks, (source, counts, into), given)
            elements.reverse()

    def _scan(self, num_counts: int) -> None:
        self._run("scan", 1, (self._buffer("counts"),), {"count": num_counts}, _SUMMING)

    @staticmethod
    def _blocks(count: int) -> int:
        return -(-count // (GROUP * _EACH))

    def _run(
        self,
        name: str,
        groups: int,
        bound: tuple[moderngl.Buffer, ...],
        uniforms: Mapping,
        defines: Mapping[str, float] | None = None,
    ) -> None:
        shader = self._shader(name, defines)
        set_uniforms(shader, **uniforms)
        for place, buffer in enumerate(bound):
            buffer.bind_to_storage_buffer(place)
        shader.run(groups)
        self._ctx.memory_barrier()

    def _buffer(self, name: str, size: int = 1) -> moderngl.Buffer:
        return self._made[name].at_least(size)

    # --- what is read of them -----------------------------------------------------------------

    def bind(self) -> None:
        """For splat.frag."""
        for place, buffer in enumerate(
            (self._buffer("splats"), self._pairs[0].at_least(1), self._buffer("ranges"))
        ):
            buffer.bind_to_storage_buffer(place)

    def rows(self) -> np.ndarray:
        """(n,) uint32 of the Gaussians in view, the nearest first."""
        if not self.num_seen:
            return np.zeros(0, np.uint32)
        elements = self._elements[0].at_least(1).read(8 * self.num_seen)
        return np.frombuffer(elements, np.uint32).reshape(-1, 2)[:, 1]

    def depth(self, place: int) -> float:
        """Of the Gaussian at a place of them, scene units."""
        row = int(np.frombuffer(self._elements[0].at_least(1).read(8, offset=8 * place), np.uint32)[1])
        key = self._buffer("splats").read(8, offset=_SPLAT * row + 56)
        return float((np.frombuffer(key, np.uint64) + np.uint64(_KEY_BASE)).view(np.float64)[0])

    def atoms(self, bits: np.ndarray) -> np.ndarray:
        """(words,) uint32, bits of the atoms in view; bits: (N, words) uint32, of those that each carries."""
        carried = self._atoms.of(bits)
        seen = self._ctx.buffer(np.zeros(bits.shape[1], np.uint32))
        given = {"count": self._count, "words": bits.shape[1]}
        self._run("atoms", -(-self._count // GROUP), (self._buffer("splats"), carried, seen), given)
        found = np.frombuffer(seen.read(), np.uint32)
        seen.release()
        return found

    def release(self) -> None:
        """Give every buffer back; what is found next makes them anew."""
        for owned in (self._atoms, *self._made.values(), *self._elements, *self._pairs):
            owned.release()
        self.num_seen = self.num_pairs = 0
