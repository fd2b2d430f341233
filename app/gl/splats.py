"""One scene's Gaussians on the GPU: sorted, projected, and their weights expanded, per camera."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import moderngl
import numpy as np
import torch
from torch.nn import functional as F

from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.geometry.quaternions import unit_quats
from langflash_core.graphics import Programs, draws_in_software, set_uniforms
from langflash_core.splat.projection import ALPHA_MIN, DILATION, NEAR, TAN_MARGIN, drawable_rows
from langflash_core.types import Camera, Gaussians, Scene

from .layout import ATOMS_A_LAYER
from .targets import as_sprites

_ROW_TEXELS = 4096
_ROWS_AT_ONCE = 1 << 16  # Gaussians: 12 MB of coefficients of degree 3
_SPLATS_AT_ONCE = 1 << 17  # of cells: 13 MB of weights
TINTS = ((0.16, 0.56, 1.0), (1.0, 0.22, 0.20))  # colours of tint 1, selected, and tint 2, to be deleted
TINTED = 0.75  # share of the tint; the rest and the shading stay, so that shapes can be seen
_SHAPE_FLOATS = 8  # place (4), shape (4)
_PLACE_FLOATS = _SHAPE_FLOATS + 3  # and colour
_SLACK = 0.02  # deviations, of quad.vert
_MARGIN = 128.0  # pixels around the image where a sprite's centre may be
_WIDEST = 1e12  # scene units: wider Gaussians are flat over any view, and float32 squares end at 1e38


class SplatBuffers:
    """Owns the vertex data of a scene; `sort` chooses and orders, `project` and `expand` fill.

    Where OpenGL runs on the processor, `project` reads the `footprints` of the chosen Gaussians back: (n, 8)
    float32, place and shape as project.vert has them, in draw order; elsewhere None. Where none is too
    large, `sprites` are drawn there in place of quads: the same fragments out of one vertex, 30 % quicker.

    Gaussians with a value or a weight that is not finite are left out, and those
    below opacity 1/255, which no pixel can show. Footprints end where alpha falls below 1/255 and, where
    `reach` is given, no further than so many deviations.
    """

    def __init__(self, ctx: moderngl.Context, programs: Programs, scene: Scene, reach: float | None = None):
        self._defines = {} if reach is None else {"REACH": reach}
        self._ctx = ctx
        self._programs = programs
        self._owned: list = []
        self._in_software = draws_in_software(ctx)
        self._largest = min(2 * _MARGIN, ctx.info["GL_POINT_SIZE_RANGE"][1])  # sprite
        self._widest_view = min(ctx.info["GL_MAX_VIEWPORT_DIMS"])
        self.footprints: np.ndarray | None = None
        self.sprites = False
        gaussians = scene.gaussians.map(lambda v: v.detach().cpu().float())
        finite = drawable_rows(scene).cpu()
        kept = finite & (gaussians.opacities >= ALPHA_MIN)
        sh = gaussians.sh  # most of a large scene's bytes: never copied as a whole
        gaussians = replace(gaussians, sh=sh[:, :0]).map(lambda v: v[kept])
        gaussians = replace(gaussians, scales=gaussians.scales.clamp(-_WIDEST, _WIDEST))
        self._kept = kept.numpy()
        self._shown = np.ones(len(gaussians), bool)
        self.num_gaussians = len(gaussians)
        self.order = np.zeros(0, np.uint32)
        self.depth_range = (NEAR, 1.0)
        self._set_places(gaussians.means, gaussians.scales)
        self._ids = scene.semantics.weight_ids.cpu()[kept].numpy()
        self._values = scene.semantics.weight_values.detach().cpu().float()[kept].numpy()
        self._num_atoms = scene.semantics.num_atoms
        self._carried = atom_bits(self._ids, self._values, self._num_atoms)
        if self.num_gaussians:
            self._upload(gaussians, sh, np.flatnonzero(kept.numpy()))

    def _upload(self, gaussians, sh, rows: np.ndarray) -> None:
        """`sh` (all, S, 3) of which `rows` are drawn, like every row of `gaussians`."""
        count = self.num_gaussians
        place = np.concatenate((self._means, gaussians.opacities.numpy()[:, None]), 1)
        self.sh_degree = min(math.isqrt(sh.shape[1]) - 1, MAX_SHOWN_DEGREE)
        fields = (place, unit_quats(gaussians.quats).numpy(), gaussians.scales.numpy())
        self._vertex_buffers = [
            self._own(self._ctx.buffer(np.ascontiguousarray(f).tobytes())) for f in fields
        ]
        self._vertex_buffers.append(self._upload_harmonics(sh.numpy(), rows))
        self._tints = self._own(self._ctx.buffer(bytes(count)))
        self._order_buffer = self._own(self._ctx.buffer(reserve=4 * count))
        self.places = self._own(self._ctx.buffer(reserve=4 * _PLACE_FLOATS * count))
        self._sparse = self._upload_weights()
        self._slots = self._own(self._ctx.texture((max(1, self._num_atoms), 1), 1, dtype="f4"))
        self._weights = self._own(_Growing(self._ctx))
        self._some = self._own(_Growing(self._ctx))
        self._numbers = self._own(_Growing(self._ctx))
        self._vaos: dict[tuple, moderngl.VertexArray] = {}

    def _upload_harmonics(self, sh: np.ndarray, rows: np.ndarray) -> moderngl.Buffer:
        """Coefficients of the shown degree, flat, padded to whole vec4s."""
        num_numbers = 3 * (self.sh_degree + 1) ** 2
        self._sh_vec4s = (num_numbers + 3) // 4
        stride = 16 * self._sh_vec4s  # bytes
        buffer = self._own(self._ctx.buffer(reserve=stride * len(rows)))
        self._write_harmonics(buffer, sh, rows)
        return buffer

    def _write_harmonics(self, buffer: moderngl.Buffer, sh: np.ndarray, rows: np.ndarray) -> None:
        num_numbers, stride = 3 * (self.sh_degree + 1) ** 2, 16 * self._sh_vec4s
        for first in range(0, len(rows), _ROWS_AT_ONCE):
            some = sh[rows[first : first + _ROWS_AT_ONCE]].reshape(-1, 3 * sh.shape[1])[:, :num_numbers]
            padded = np.zeros((len(some), 4 * self._sh_vec4s), np.float32)
            padded[:, :num_numbers] = some
            buffer.write(padded.tobytes(), offset=stride * first)

    def _upload_weights(self) -> moderngl.Texture:
        pairs = np.stack((self._ids.astype(np.float32), self._values), -1).reshape(-1, 2)
        rows = max(1, -(-len(pairs) // _ROW_TEXELS))
        padded = np.zeros((rows * _ROW_TEXELS, 2), np.float32)
        padded[: len(pairs)] = pairs
        texture = self._own(self._ctx.texture((_ROW_TEXELS, rows), 2, padded.tobytes(), dtype="f4"))
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        return texture

    def _own(self, created):
        self._owned.append(created)
        return created

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> bool:
        """What of the scene's N Gaussians to draw: shown (N,) bool; tints (N,) uint8, 0 for none.

        Nothing is uploaded again but one byte a Gaussian. Project after this; whether to sort again,
        because other Gaussians are shown now, is returned.
        """
        before, self._shown = self._shown, shown[self._kept]
        if self.num_gaussians:
            self._tints.write(np.ascontiguousarray(tints[self._kept], np.uint8).tobytes())
        return not np.array_equal(before, self._shown)

    def place(self, gaussians: Gaussians) -> None:
        """The same Gaussians elsewhere or in other colours: `gaussians` has all N, moved or recoloured.

        Opacities and weights stay. Sort and project after this.
        """
        if not self.num_gaussians:
            return
        rows = torch.from_numpy(np.flatnonzero(self._kept))
        means, quats, scales = (v[rows].float() for v in (gaussians.means, gaussians.quats, gaussians.scales))
        scales = scales.clamp(-_WIDEST, _WIDEST)
        self._set_places(means, scales)
        place = np.concatenate((self._means, gaussians.opacities[rows].float().numpy()[:, None]), 1)
        for buffer, values in zip(
            self._vertex_buffers, (place, unit_quats(quats).numpy(), scales.numpy()), strict=False
        ):
            buffer.write(np.ascontiguousarray(values).tobytes())
        self._write_harmonics(self._vertex_buffers[3], gaussians.sh.float().numpy(), rows.numpy())

    def _set_places(self, means: torch.Tensor, scales: torch.Tensor) -> None:
        self._means = means.numpy()
        self._coordinates = np.ascontiguousarray(self._means.T, np.float64)
        self._widest = scales.abs().amax(-1).numpy()

    def sort(self, camera: Camera) -> None:
        """Choose the Gaussians that may touch the image and order them back to front.

        z is computed in float64, term by term as in the reference (`view_depths`), so that both
        agree on near ties; of equal depths the first Gaussian is in front.
        """
        viewmat = camera.viewmat.detach().cpu().double().numpy()
        across, down, along = self._coordinates
        row = viewmat[2]
        z = across * row[0] + down * row[1] + along * row[2] + row[3]
        with np.errstate(over="ignore", invalid="ignore"):  # places beyond float32 are beside any image
            rows = np.flatnonzero(self._may_touch(camera, viewmat, z) & self._shown)
        depths = z[rows]
        nearest_first = rows[stable_order(depths)]
        if len(rows):
            margin = len(rows) // 50
            near, far = z[nearest_first[margin]], z[nearest_first[len(rows) - 1 - margin]]
            self.depth_range = (float(near), float(far))
        self.draw_in(nearest_first[::-1])

    def draw_in(self, order: np.ndarray) -> None:
        """Draw these rows of the Gaussians kept, the first first."""
        self.order, self.footprints = order.astype(np.uint32), None
        if len(order):
            self._order_buffer.write(self.order.tobytes())

    def _may_touch(self, camera: Camera, viewmat: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(N,) bool, conservative: the Frobenius norm of the Jacobian bounds the footprint.

        Of an orthographic camera |J|_F^2 = fx^2 + fy^2, wherever the Gaussian is.
        """
        K = camera.K.detach().cpu().double().numpy()
        seen = z >= NEAR
        flat = camera.orthographic
        inverse = np.ones(len(z), np.float32) if flat else 1 / np.where(seen, z, 1.0).astype(np.float32)
        sizes = (camera.width, camera.height)
        bound = 0.0  # |J|_F^2 z^2 <= sum over axes of focal^2 (1 + steepest slope^2)
        for axis, extent in enumerate(sizes):
            focal, principal = K[axis, axis], K[axis, 2]
            steepest = (max(principal, extent - principal) + TAN_MARGIN * 0.5 * extent) / focal
            bound += focal * focal * (1 if flat else 1 + steepest * steepest)
        rounding = np.float32(1e-6 * np.abs(viewmat[:3, 3]).max())  # of places far from the origin
        deviations = np.sqrt(
            np.square((self._widest + rounding) * inverse) * np.float32(bound) + np.float32(DILATION)
        )
        radius = np.float32(math.sqrt(2 * math.log(1 / ALPHA_MIN))) * deviations + np.float32(1)
        for axis, extent in enumerate(sizes):
            pos_c = self._means @ viewmat[axis, :3].astype(np.float32) + np.float32(viewmat[axis, 3])
            place = pos_c * inverse * np.float32(K[axis, axis]) + np.float32(K[axis, 2])
            seen &= (place + radius > 0) & (place - radius < extent)
        return seen

    def active_atoms(self) -> np.ndarray:
        """Atoms (Ka,) that the chosen Gaussians carry with a weight above 0, ascending."""
        if not (self._num_atoms and len(self.order)):
            return np.zeros(0, np.int64)
        return np.flatnonzero(self.atoms_of(np.arange(len(self.order)), np.zeros(1, np.int64)))

    def atoms_of(self, places: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """(runs, K) bool: atoms that the chosen Gaussians at these `places` of the order carry with a weight
        above 0, together in each run of places, from `starts` on."""
        carried = np.bitwise_or.reduceat(self._carried[self.order[places]], starts, axis=0)  # (runs, words)
        bits = np.unpackbits(carried.astype("<u8").view(np.uint8), axis=1, bitorder="little")
        return bits[:, : self._num_atoms].astype(bool)

    def project(self, camera: Camera) -> None:
        """Footprints and colours of the chosen Gaussians into `places`, in draw order."""
        program = self._programs.get(
            "project.vert",
            defines={
                "SH_DEGREE": self.sh_degree,
                "SH_VEC4S": self._sh_vec4s,
                "TINTED": TINTED,
                **self._defines,
            },
            varyings=("out_place", "out_shape", "out_colour"),
        )
        viewmat = camera.viewmat.detach().cpu().double().numpy()
        K = camera.K.detach().cpu().double().numpy()
        eye = -viewmat[:3, :3].T @ viewmat[:3, 3]
        set_uniforms(
            program,
            viewmat=viewmat,
            eye=eye,
            eye_rest=eye - eye.astype(np.float32),
            pinhole=np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2]]),
            orthographic=int(camera.orthographic),
            image_size=(float(camera.width), float(camera.height)),
            tint_colours=np.array(TINTS),
        )
        formats = ("4f", "4f", "3f", f"{4 * self._sh_vec4s}f", "1f1")
        names = ("in_mean", "in_quat", "in_scale", "in_sh", "in_tint")
        buffers = (*self._vertex_buffers, self._tints)
        content = [(b, f, n) for b, f, n in zip(buffers, formats, names, strict=True)]
        self._transform(program, content, self.places)
        if self._in_software:
            self._measure((camera.width, camera.height))

    def _measure(self, size: tuple[int, int]) -> None:
        """Read the footprints back; whether all that reach the image are small enough for sprites, and the
        image with its margin for a viewport."""
        chosen = 4 * _PLACE_FLOATS * len(self.order)
        read = np.frombuffer(self.places.read(chosen), np.float32).reshape(-1, _PLACE_FLOATS)
        self.footprints = read[:, :_SHAPE_FLOATS]
        small = 2 * np.maximum(*self._reaches()) < self._largest
        if not small.all():  # what is broken compares as beside the image
            x0, y0, x1, y1 = self.boxes()
            small = small[(x1 > 0) & (y1 > 0) & (x0 < size[0]) & (y0 < size[1])]
        self.sprites = bool(small.all()) and max(size) + 2 * _MARGIN <= self._widest_view

    def _reaches(self) -> tuple[np.ndarray, np.ndarray]:
        """Half the sides (n,) of the boxes, pixels."""
        assert self.footprints is not None
        l11, l21, l22, radius = self.footprints[:, 4:].T
        with np.errstate(over="ignore", invalid="ignore"):
            radius = radius + np.float32(_SLACK)
            return radius * l11, radius * np.sqrt(l21 * l21 + l22 * l22)

    def boxes(self) -> np.ndarray:
        """(4, n) float32 x0, y0, x1, y1 of the footprints that were read back, pixels, in draw order."""
        assert self.footprints is not None
        x, y = self.footprints[:, :2].T
        wide, tall = self._reaches()
        with np.errstate(over="ignore", invalid="ignore"):
            return np.stack((x - wide, y - tall, x + wide, y + tall))

    @property
    def defines(self) -> dict[str, float]:
        """What quad.vert is compiled with to draw these."""
        return {"MARGIN": _MARGIN} if self.sprites else {}

    def expand(self, atoms: np.ndarray, first: int, num_layers: int) -> moderngl.Buffer:
        """Dense weights of `num_layers` layers of `atoms`, from place `first` on, in draw order."""
        program = self._programs.get(
            "expand.vert",
            defines={"LAYERS": num_layers, "ROW_TEXELS": _ROW_TEXELS},
            varyings=("out_weights",),
        )
        slots = np.full(self._num_atoms, -1, np.float32)
        slots[atoms] = np.arange(len(atoms))
        self._slots.write(slots.tobytes())
        self._sparse.use(0)
        self._slots.use(1)
        set_uniforms(
            program, sparse_weights=0, slots=1, weights_per_gaussian=self._ids.shape[1], first_slot=first
        )
        out = self._weights.at_least(4 * ATOMS_A_LAYER * num_layers * self.num_gaussians)
        self._transform(program, [], out)
        return out

    def mixed(self, table: np.ndarray) -> np.ndarray:
        """sum_j w_ij table[id_ij], (N, n) float32 in the scene's order, of a table (K, n)."""
        rows = torch.from_numpy(np.ascontiguousarray(table, np.float32))
        ids, values = torch.from_numpy(self._ids), torch.from_numpy(self._values)
        return F.embedding_bag(ids, rows, per_sample_weights=values, mode="sum").numpy()

    def in_order(self, numbers: np.ndarray) -> moderngl.Buffer:
        """Numbers (N, n) float32 of all Gaussians as those of the chosen ones, in draw order."""
        out = self._numbers.at_least(numbers.nbytes)
        out.write(numbers[self.order].tobytes())
        return out

    def _transform(self, program: moderngl.Program, content: list, out: moderngl.Buffer) -> None:
        key = ("transform", program.glo)
        if key not in self._vaos:
            self._vaos[key] = self._ctx.vertex_array(
                program, content, index_buffer=self._order_buffer, index_element_size=4
            )
        self._vaos[key].transform(out, mode=moderngl.POINTS, vertices=len(self.order))

    def draw(
        self,
        program: moderngl.Program,
        weights: moderngl.Buffer | None = None,
        num_layers: int = 0,
        colour: bool = True,
    ) -> None:
        """One quad or sprite per chosen Gaussian, with its colour, `num_layers` of weights, or both.

        Args:
            program: of quad.vert with these `defines`.
        """
        key = ("draw", program.glo)
        if key not in self._vaos:
            footprint, each = ("in_place", "in_shape"), "v" if self.sprites else "i"
            content: list[tuple] = [(self.places, f"4f 4f 12x/{each}", *footprint)]
            if colour:
                content = [(self.places, f"4f 4f 3f/{each}", *footprint, "in_colour")]
            if weights is not None:
                content.append((weights, f"{ATOMS_A_LAYER * num_layers}f/{each}", "in_weights"))
            self._vaos[key] = self._ctx.vertex_array(program, content)
        self._render(self._vaos[key], len(self.order))

    def draw_cells(
        self,
        program: moderngl.Program,
        boxes: np.ndarray,
        places: Sequence[np.ndarray],
        slots: np.ndarray,
        num_layers: int,
    ) -> None:
        """As `draw`, weights alone, in each cell those at its places of the order, whose footprints were read
        back, within its box. The framebuffer's scissor is the last one's afterwards.

        Args:
            boxes: (b, 4) x, y, width, height, pixels. places: of each cell, ascending.
            slots: (b, K), place of each atom in the layers of each cell, 3 `num_layers` for none.
        """
        key = ("cells", program.glo)
        if key not in self._vaos:
            each = "v" if self.sprites else "i"
            content = [
                (self._some.at_least(1), f"4f 4f/{each}", "in_place", "in_shape"),
                (self._weights.at_least(1), f"{ATOMS_A_LAYER * num_layers}f 4x/{each}", "in_weights"),
            ]
            self._vaos[key] = self._ctx.vertex_array(program, content)
        counts = [len(each) for each in places]
        for first, last in self._uploads(counts):
            self._stream(places[first:last], slots[first:last], ATOMS_A_LAYER * num_layers)
            at = 0
            for box, count in zip(boxes[first:last].tolist(), counts[first:last], strict=True):
                self._ctx.fbo.scissor = tuple(box)
                self._render(self._vaos[key], count, at)
                at += count

    def _uploads(self, counts: Sequence[int]) -> Iterator[tuple[int, int]]:
        """Cells to draw out of one upload: quads from the first one on, sprites of several."""
        first, total = 0, 0
        for cell, count in enumerate(counts):
            if cell > first and (not self.sprites or total + count > _SPLATS_AT_ONCE):
                yield first, cell
                first, total = cell, 0
            total += count
        if counts:
            yield first, len(counts)

    def _stream(self, places: Sequence[np.ndarray], slots: np.ndarray, width: int) -> None:
        """Footprints and dense weights, `width` a splat, of cells one after the other."""
        assert self.footprints is not None
        chosen = np.concatenate(places)
        rows, (cells, num_atoms) = self.order[chosen], slots.shape
        ids, values = (torch.from_numpy(each[rows]) for each in (self._ids, self._values))
        first = np.repeat(num_atoms * np.arange(cells), [len(each) for each in places])
        held = torch.from_numpy(slots).reshape(-1)[ids + torch.from_numpy(first)[:, None]]
        dense = torch.zeros(len(rows), width + 1)  # the last one for atoms of other layers
        dense.scatter_add_(1, held, values)
        for buffer, stream in ((self._some, self.footprints[chosen]), (self._weights, dense.numpy())):
            buffer.at_least(stream.nbytes).write(stream)

    def _render(self, vao: moderngl.VertexArray, count: int, first: int = 0) -> None:
        """first: of sprites alone."""
        if self.sprites:
            with as_sprites(self._ctx, int(_MARGIN)):
                vao.render(moderngl.POINTS, vertices=count, first=first)
        else:
            vao.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=count)

    def _drop_vaos(self) -> None:
        for vao in self._vaos.values():
            vao.release()
        self._vaos.clear()

    def release(self) -> None:
        if self._owned:
            self._drop_vaos()
        for owned in reversed(self._owned):
            owned.release()
        self._owned.clear()
        self.num_gaussians = 0


class _Growing:
    """A buffer made when first needed, and larger when more is."""

    def __init__(self, ctx: moderngl.Context):
        self._ctx = ctx
        self._made: moderngl.Buffer | None = None

    def at_least(self, size: int) -> moderngl.Buffer:
        """One of `size` bytes or more, always the same object; what it held is lost where it grows."""
        if self._made is None:
            self._made = self._ctx.buffer(reserve=size)
        elif self._made.size < size:
            self._made.orphan(size)
        return self._made

    def release(self) -> None:
        if self._made is not None:
            self._made.release()
        self._made = None


def stable_order(keys: np.ndarray) -> np.ndarray:
    """np.argsort(keys, kind="stable") by the several times faster unstable sort, ties put right."""
    order = np.argsort(keys)
    ordered = keys[order]
    same = ordered[1:] == ordered[:-1]
    if same.any():
        tied = np.append(same, False) | np.insert(same, 0, False)
        runs = np.cumsum(np.insert(~same, 0, True))[tied]
        rows = order[tied]
        order[tied] = rows[np.lexsort((rows, runs))]
    return order


def atom_bits(ids: np.ndarray, values: np.ndarray, num_atoms: int) -> np.ndarray:
    """(N, ceil(K / 64)) uint64: which atoms each Gaussian carries with a weight above 0."""
    bits = np.zeros((max(1, -(-num_atoms // 64)), len(ids)), np.uint64)
    for column, carries in zip(ids.T, values.T > 0, strict=True):
        masks = carries.astype(np.uint64) << (column & 63).astype(np.uint64)
        for number, word in enumerate(bits):
            word |= masks if len(bits) == 1 else np.where(column >> 6 == number, masks, np.uint64(0))
    return np.ascontiguousarray(bits.T)
