"""One scene's Gaussians on the GPU: sorted, projected, and their weights expanded, per camera."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import moderngl
import numpy as np
import torch
from torch import Tensor

from langflash_core.base.graphics import Programs, set_uniforms
from langflash_core.splat.projection import ALPHA_MIN, drawable_rows
from langflash_core.types import Camera, Gaussians, Scene

from .buffers import Growing
from .carried import Carried, CarriedTextures, bytes_of, texels_of
from .layout import ATOMS_A_LAYER
from .ordering import Ordering, lens, matrices
from .shapes import PLACE_FLOATS, MakeShapes, Quads
from .targets import PREMULTIPLIED, drawing
from .vertices import Vertices

TINTS = ((0.16, 0.56, 1.0), (1.0, 0.22, 0.20))  # colours of tint 1, selected, and tint 2, to be deleted
TINTED = 0.75  # share of the tint; the rest and the shading stay, so that shapes can be seen
_PLAIN = np.array([[1.0] * 3, [0.0] * 3])  # the light of a camera without one
_WIDEST = 1e12  # scene units: wider Gaussians are flat over any view, and float32 squares end at 1e38


@dataclass(frozen=True)
class Drawable:
    """What of a scene can be drawn, ready for the card. gaussians: (N,) those, without harmonics; kept:
    (all,) bool, which of the scene's these are; sh: (all, S, 3), of all; carried: their weights; texels: of
    these (`texels_of`)."""

    gaussians: Gaussians
    kept: np.ndarray
    sh: Tensor
    carried: Carried
    texels: np.ndarray

    @staticmethod
    def of(scene: Scene) -> "Drawable":
        """On whatever thread."""
        gaussians, kept = _drawable(scene)
        semantics, rows = scene.semantics, torch.from_numpy(kept)
        values = semantics.weight_values.detach().cpu().float()[rows].numpy()
        carried = Carried(semantics.weight_ids.cpu()[rows].numpy(), values, semantics.num_atoms)
        sh = scene.gaussians.sh.detach().cpu().float()
        return Drawable(gaussians, kept, sh, carried, texels_of(carried))


class SplatBuffers:
    """Owns the vertex data of a scene; `sort` or `follow` choose and order, `project` fills,
    `splat` and `splat_weights` draw.

    Gaussians with a value or a weight that is not finite are left out, and those
    below opacity 1/255, which no pixel can show. Footprints end where alpha falls below 1/255 and, where
    `reach` is given, no further than so many deviations.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        scene: Scene | Drawable,
        shapes: MakeShapes = Quads,
        reach: float | None = None,
    ):
        """shapes: what they are drawn as."""
        own = scene if isinstance(scene, Drawable) else Drawable.of(scene)
        gaussians, self._kept, self.carried = own.gaussians, own.kept, own.carried
        self.num_gaussians = len(gaussians)
        self.shapes = shapes(ctx)
        self._defines = {} if reach is None else {"REACH": reach}
        self._ctx = ctx
        self._programs = programs
        self._ordering = Ordering(gaussians.means, gaussians.scales)
        self._vertices = Vertices(ctx, gaussians, own.sh, np.flatnonzero(self._kept))
        self._textures = CarriedTextures(ctx, programs, self.carried, own.texels)
        self._order_buffer = ctx.buffer(reserve=4 * max(1, self.num_gaussians))
        self.places = ctx.buffer(reserve=4 * PLACE_FLOATS * max(1, self.num_gaussians))
        self._expanded = Growing(ctx)
        self._numbers = Growing(ctx)
        self._vaos: dict[tuple, moderngl.VertexArray] = {}

    @property
    def order(self) -> np.ndarray:
        """(n,) uint32: rows of the Gaussians kept that are drawn, the first first."""
        return self._ordering.order

    @property
    def num_chosen(self) -> int:
        """How many these are."""
        return len(self.order)

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the middle 96 % of the Gaussians that were chosen last, scene units."""
        return self._ordering.depth_range

    # --- what to draw -----------------------------------------------------------------------

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> bool:
        """What of the scene's N Gaussians to draw: shown (N,) bool; tints (N,) uint8, 0 for none.

        Nothing is uploaded again but one byte a Gaussian. Project after this; whether to sort again,
        because other Gaussians are shown now, is returned.
        """
        if self.num_gaussians:
            self._vertices.tint(tints[self._kept])
        return self._ordering.show(shown[self._kept])

    def place(self, gaussians: Gaussians) -> None:
        """The same Gaussians elsewhere or in other colours: `gaussians` has all N, moved or recoloured.

        Opacities and weights stay. Sort and project after this.
        """
        rows = np.flatnonzero(self._kept)
        sh = gaussians.sh.float()
        chosen = torch.from_numpy(rows)
        placed = _bounded(replace(gaussians, sh=sh[:, :0]).map(lambda v: v[chosen].float()))
        self._ordering.place(placed.means, placed.scales)
        self._vertices.place(placed, sh, rows)

    def sort(self, camera: Camera) -> None:
        """Choose the Gaussians that may touch the image and order them back to front."""
        self._ordering.sort(camera)
        self.draw_in(self._ordering.order)

    def found(self, camera: Camera) -> bool:
        """Begin to find that order beside the frames; whether `sort` need not wait for it."""
        return self._ordering.found(camera)

    def follow(self, camera: Camera) -> bool:
        """As `sort` for one frame of a moving camera, in an order that may be late (`ordering.MOST_BEHIND`);
        whether it is exact."""
        before = self.order
        exact = self._ordering.follow(camera)
        if self.order is not before:
            self.draw_in(self._ordering.order)
        return exact

    def draw_in(self, order: np.ndarray) -> None:
        """Draw these rows of the Gaussians kept, the first first."""
        self._ordering.order = np.ascontiguousarray(order, np.uint32)
        self.shapes.forget()
        if len(order):
            self._order_buffer.write(self.order)

    def active_atoms(self) -> np.ndarray:
        """Atoms (Ka,) that the chosen Gaussians carry with a weight above 0, ascending."""
        if not (self.carried.num_atoms and len(self.order)):
            return np.zeros(0, np.int64)
        return np.flatnonzero(self.carried.atoms_of(self.order, np.zeros(1, np.int64)))

    # --- by shaders that write buffers ------------------------------------------------------

    def compile(self, camera: Camera) -> Iterator[None]:
        """Ahead of `project`, where that is of many shaders: a shader a step."""
        yield from ()

    def project(self, camera: Camera) -> None:
        """Footprints and colours of the chosen Gaussians into `places`, in draw order."""
        if not len(self.order):
            return
        defines, uniforms = self._projection(camera)
        varyings = ("out_place", "out_shape", "out_colour")
        program = self._programs.get("project.vert", defines=defines, varyings=varyings)
        set_uniforms(program, **uniforms)
        self._transform(program, self._vertices.content, self.places)
        self.shapes.measure(self.places, len(self.order), (camera.width, camera.height))

    def _projection(self, camera: Camera) -> tuple[dict[str, float], dict]:
        """Defines and uniforms of project.glsl."""
        viewmat, _ = matrices(camera)
        eye = -viewmat[:3, :3].T @ viewmat[:3, 3]
        gain, offset = _PLAIN if camera.light is None else camera.light.cpu().numpy()
        defines = {"SH_DEGREE": self._vertices.degree, "SH_VEC4S": self._vertices.sh_vec4s, "TINTED": TINTED}
        return {**defines, **self._defines}, {
            "viewmat": viewmat,
            "eye": eye,
            "eye_rest": eye - eye.astype(np.float32),
            **lens(camera),
            "image_size": (float(camera.width), float(camera.height)),
            "light_gain": gain,
            "light_offset": offset,
            "tint_colours": np.array(TINTS),
        }

    def _transform(
        self, program: moderngl.Program, content: list, out: moderngl.Buffer, ordered: bool = True
    ) -> None:
        """ordered: the chosen Gaussians, in draw order; else all, row by row."""
        key = ("transform", program.glo, ordered)
        if key not in self._vaos:
            index = {"index_buffer": self._order_buffer, "index_element_size": 4} if ordered else {}
            self._vaos[key] = self._ctx.vertex_array(program, content, **index)
        count = len(self.order) if ordered else self.num_gaussians
        self._vaos[key].transform(out, mode=moderngl.POINTS, vertices=count)

    # --- pictures ---------------------------------------------------------------------------

    def splat(
        self, into: moderngl.Framebuffer, numbers: np.ndarray | None = None, depth: bool = True
    ) -> None:
        """Colour and depth of the chosen Gaussians, projected, which every picture begins with; into a
        framebuffer of the size that the projection was for, or into the corner of a larger one.

        Args:
            numbers: (N, 3 L) float32, that the Gaussians carry into L layers behind colour and depth.
            depth: whether the framebuffer has it beside the colour; without, there are no numbers.
        """
        num_layers = 0 if numbers is None else numbers.shape[1] // ATOMS_A_LAYER
        defines = {"COLOUR": 1} if depth else {"COLOUR": 1, "ALONE": 1}
        carried = None
        if numbers is not None and len(self.order):
            carried = self._numbers.at_least(numbers.nbytes)
            carried.write(numbers[self.order].tobytes())
        into.clear()
        self._draw("colour.frag", into, defines, carried, num_layers)

    def splat_weights(
        self, atoms: np.ndarray, first: int, num_layers: int, into: moderngl.Framebuffer
    ) -> None:
        """Dense weights in `num_layers` layers of `atoms`, from place `first` on, over what is there."""
        out = self._expanded.at_least(bytes_of(num_layers) * self.num_gaussians)
        self._transform(self._textures.ready(atoms, first, num_layers), [], out)
        self._draw("weights.frag", into, {}, out, num_layers)

    def _draw(
        self,
        fragment: str,
        into: moderngl.Framebuffer,
        defines: Mapping[str, float],
        weights: moderngl.Buffer | None,
        num_layers: int,
    ) -> None:
        """One shape per chosen Gaussian, with its colour, `num_layers` of weights, or both."""
        layers = {"LAYERS": num_layers} if num_layers else {}
        program = self._programs.get("quad.vert", fragment, {**defines, **layers, **self.shapes.defines})
        set_uniforms(program, image_size=tuple(float(n) for n in into.size))
        with drawing(into, PREMULTIPLIED):
            if len(self.order):
                self.shapes.render(
                    self._vao(program, "COLOUR" in defines, weights, num_layers), len(self.order)
                )

    def _vao(
        self, program: moderngl.Program, colour: bool, weights: moderngl.Buffer | None, num_layers: int
    ) -> moderngl.VertexArray:
        key = ("draw", program.glo, None if weights is None else weights.glo)
        if key not in self._vaos:
            each = self.shapes.each
            names = ("in_place", "in_shape", "in_colour") if colour else ("in_place", "in_shape")
            content = [(self.places, f"4f 4f {'3f' if colour else '12x'}{each}", *names)]
            if weights is not None:
                content.append((weights, f"{ATOMS_A_LAYER * num_layers}f{each}", "in_weights"))
            self._vaos[key] = self._ctx.vertex_array(program, content)
        return self._vaos[key]

    def release(self) -> None:
        """Give every buffer back; harmless twice."""
        for vao in self._vaos.values():
            vao.release()
        self._vaos.clear()
        for owned in (self._numbers, self._expanded, self.places, self._order_buffer):
            owned.release()
        self._textures.release()
        self._vertices.release()
        self.num_gaussians = 0


MakeSplats = Callable[[moderngl.Context, Programs, Scene | Drawable, MakeShapes], SplatBuffers]
"""Makes the buffers of a scene for a context, drawn with these programs and shapes."""


def _drawable(scene: Scene) -> tuple[Gaussians, np.ndarray]:
    """Those that can be drawn, without their harmonics, and which of the scene's (all,) bool these are."""
    gaussians = replace(scene.gaussians, sh=scene.gaussians.sh[:, :0]).map(lambda v: v.detach().cpu().float())
    kept = drawable_rows(scene).cpu() & (gaussians.opacities >= ALPHA_MIN)
    return _bounded(gaussians.map(lambda v: v[kept])), kept.numpy()


def _bounded(gaussians: Gaussians) -> Gaussians:
    return replace(gaussians, scales=gaussians.scales.clamp(-_WIDEST, _WIDEST))
