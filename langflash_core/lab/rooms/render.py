"""Draws rooms offscreen: radiance, z-depth and instance ids. H W pixels; G-buffer (2 H + 1, 2 W + 1).

A pixel's centre is one sample of the G-buffer; depth and id are that sample, colour is a tent around
it. So colour is smooth, ids are exact, and all three agree on where a pixel is.
"""

import math
from dataclasses import dataclass

import moderngl
import numpy as np
from jaxtyping import Float, Int

from langflash_core.base.graphics import Programs, offscreen_context, set_uniforms
from langflash_core.lab.rooms.layout import Instance, Room
from langflash_core.lab.rooms.pack import Pack
from langflash_core.lab.rooms.shell import CEILING, FLOOR, WALL, shell_triangles

_LOOKS = ("mesh", "cut", "pattern", "wall", "floor")
_SHELL_LOOKS = {WALL: "wall", FLOOR: "floor", CEILING: "mesh"}
_SHADOW_SIZE = 1024
_NEAR, _FAR = 0.04, 60.0
_MAX_SHELL_VERTICES = 3_000
_MAX_POINTS, _MAX_PORTALS = 6, 4


@dataclass(frozen=True)
class Picture:
    """One view: linear radiance, z-depth in m (0 where nothing), instance ids (0 where nothing)."""

    radiance: Float[np.ndarray, "H W 3"]
    depth: Float[np.ndarray, "H W"]
    ids: Int[np.ndarray, "H W"]


@dataclass(frozen=True)
class _Targets:
    """Textures and framebuffers for one picture size."""

    textures: dict[str, moderngl.Texture]
    depth: moderngl.Renderbuffer
    gbuffer: moderngl.Framebuffer
    occlusion: moderngl.Framebuffer
    shade: moderngl.Framebuffer
    resolve: moderngl.Framebuffer

    def release(self) -> None:
        for target in (
            self.resolve,
            self.shade,
            self.occlusion,
            self.gbuffer,
            self.depth,
            *self.textures.values(),
        ):
            target.release()


class RoomRenderer:
    """Owns the context's objects for one pack: all meshes in one buffer, textures, programs, targets.

    Use from one thread. `release()` may be called twice; the context is released only if made here.
    """

    def __init__(self, pack: Pack, ctx: moderngl.Context | None = None) -> None:
        """Upload a pack.

        Args:
            pack: furniture; must be the one that rooms are laid out with.
            ctx: a context to draw with; one without a window is made when None.

        Raises:
            GraphicsError: OpenGL is not available here.
        """
        self._own = ctx is None
        self.ctx = offscreen_context() if ctx is None else ctx
        self.pack = pack
        self._owned: list = []
        self._targets: dict[tuple[int, int], _Targets] = {}
        self._room: Room | None = None
        with self.ctx:
            self._build()

    def release(self) -> None:
        """Give everything back, in reverse order of making."""
        if not self._owned:
            return
        with self.ctx:
            for targets in self._targets.values():
                targets.release()
            self._targets = {}
            while self._owned:
                self._owned.pop().release()
        if self._own:
            self.ctx.release()

    def __enter__(self) -> "RoomRenderer":
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def set_room(self, room: Room) -> None:
        """Choose what is drawn: uploads walls, draws the shadow maps, sets the light."""
        self._room = room
        triangles, kinds = shell_triangles(room.shell)
        rows = _shell_rows(triangles, kinds, len(self.pack.material_table))
        if len(rows) > _MAX_SHELL_VERTICES:
            raise ValueError(f"room: expected at most {_MAX_SHELL_VERTICES} shell vertices, got {len(rows)}")
        self._shell_ranges = _runs(kinds)
        with self.ctx:  # another renderer may have been current
            self._shell_buffer.write(rows.tobytes())
            self._light(room)

    def draw(
        self, viewmat: Float[np.ndarray, "4 4"], K: Float[np.ndarray, "3 3"], size: tuple[int, int]
    ) -> Picture:
        """Draw the current room.

        Args:
            viewmat: world (room, y up) -> camera, OpenCV axes.
            K: pixels; the principal point must be the centre.
            size: (height, width), pixels.

        Returns:
            Linear radiance, depth and ids.

        Raises:
            ValueError: no room was set.
        """
        if self._room is None:
            raise ValueError("room: expected set_room before draw, got none")
        lens = self._lens(K, size)
        with self.ctx:
            if size not in self._targets:
                self._targets[size] = self._make_targets(size)
            targets = self._targets[size]
            self._draw_gbuffer(targets, viewmat, K, size)
            self._draw_occlusion(targets, viewmat, lens)
            self._draw_light(targets, viewmat, lens)
            return self._resolve(targets, size)

    # -- making -----------------------------------------------------------------------------------

    def _keep(self, thing):
        self._owned.append(thing)
        return thing

    def _build(self) -> None:
        pack, ctx = self.pack, self.ctx
        vertices = np.concatenate(
            [pack.positions, pack.normals, pack.uvs, pack.material_ids[:, None]], axis=1
        )
        self._vertices = self._keep(ctx.buffer(vertices.astype(np.float32).tobytes()))
        self._faces = self._keep(ctx.buffer(pack.faces.astype(np.uint32).tobytes()))
        self._shell_buffer = self._keep(ctx.buffer(reserve=_MAX_SHELL_VERTICES * 9 * 4, dynamic=True))
        programs = self._keep(Programs(ctx, "rooms"))
        self._looks = {look: programs.get("mesh.vert", f"{look}.frag") for look in _LOOKS}
        self._shadow = programs.get("shadow.vert", "shadow.frag")
        self._occlude, self._shade, self._finish = (
            programs.get("screen.vert", f"{name}.frag") for name in ("occlusion", "shade", "resolve")
        )
        names = ("in_position", "in_normal", "in_uv", "in_material")
        self._arrays, self._shell_arrays = {}, {}
        for look, program in self._looks.items():
            layout = _layout(program, names)
            self._arrays[look] = self._keep(
                ctx.vertex_array(program, [(self._vertices, *layout)], self._faces)
            )
            self._shell_arrays[look] = self._keep(ctx.vertex_array(program, [(self._shell_buffer, *layout)]))
        layout = _layout(self._shadow, names)
        self._shadow_vao = self._keep(
            ctx.vertex_array(self._shadow, [(self._vertices, *layout)], self._faces)
        )
        self._shadow_shell = self._keep(ctx.vertex_array(self._shadow, [(self._shell_buffer, *layout)]))
        self._item_looks = [_item_look(self.pack, k) for k in range(len(self.pack.items))]
        self._screens = {
            p: self._keep(ctx.vertex_array(p, [])) for p in (self._occlude, self._shade, self._finish)
        }
        self._build_textures()

    def _build_textures(self) -> None:
        ctx, pack = self.ctx, self.pack
        white = np.array([[1, 1, 1, 1, -1, 0, 0, 0]], dtype=np.float32)
        table = np.concatenate([pack.material_table.reshape(-1, 8), white])
        self._materials = self._keep(
            ctx.texture((2, len(table)), 4, table.astype(np.float32).tobytes(), dtype="f4")
        )
        self._materials.filter = (moderngl.NEAREST, moderngl.NEAREST)
        layers, side = len(pack.textures), pack.textures.shape[1]
        self._textures = self._keep(ctx.texture_array((side, side, layers), 4, pack.textures.tobytes()))
        self._textures.build_mipmaps()
        self._textures.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        self._maps, self._map_targets = [], []
        for _ in range(2):
            shadow = self._keep(ctx.depth_texture((_SHADOW_SIZE, _SHADOW_SIZE)))
            shadow.compare_func = "<="
            shadow.filter = (moderngl.NEAREST, moderngl.NEAREST)  # the shader's taps do the softening
            shadow.repeat_x = shadow.repeat_y = False
            self._maps.append(shadow)
            self._map_targets.append(self._keep(ctx.framebuffer(depth_attachment=shadow)))

    def _make_targets(self, size: tuple[int, int]) -> _Targets:
        height, width = size
        fine, ctx = (2 * width + 1, 2 * height + 1), self.ctx
        textures = {
            "albedo": ctx.texture(fine, 4),
            "normal": ctx.texture(fine, 4, dtype="f2"),
            "depth_id": ctx.texture(fine, 2, dtype="f4"),
            "radiance": ctx.texture(fine, 4, dtype="f2"),
            "occlusion": ctx.texture((width, height), 1),
            "colour": ctx.texture((width, height), 4, dtype="f4"),
            "centre": ctx.texture((width, height), 4, dtype="f4"),
        }
        for texture in textures.values():
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            texture.repeat_x = texture.repeat_y = False
        textures["occlusion"].filter = (moderngl.LINEAR, moderngl.LINEAR)
        depth = ctx.depth_renderbuffer(fine)
        return _Targets(
            textures,
            depth,
            gbuffer=ctx.framebuffer([textures["albedo"], textures["normal"], textures["depth_id"]], depth),
            occlusion=ctx.framebuffer([textures["occlusion"]]),
            shade=ctx.framebuffer([textures["radiance"]]),
            resolve=ctx.framebuffer([textures["colour"], textures["centre"]]),
        )

    # -- light ------------------------------------------------------------------------------------

    def _light(self, room: Room) -> None:
        style, shade = room.style, self._shade
        lamp, to_lamp = _lamp_matrix(room)
        to_sun = _sun_matrix(room)
        self._draw_shadow(0, room, to_sun, skip=frozenset({"window", "curtain"}))
        self._draw_shadow(1, room, to_lamp, skip=frozenset({"ceiling lamp", "ceiling fan"}))
        bounce = np.array(style.floor_colour) ** 2.2 * 0.6 + 0.4
        points, colours = _small_lamps(room)
        portals, normals = _portals(room)
        set_uniforms(
            shade,
            to_sun=to_sun,
            to_lamp=to_lamp,
            sun_direction=style.sun_direction,
            sun_colour=style.sun_colour,
            sky_colour=style.sky_colour,
            lamp=(*(float(v) for v in lamp), 0.006),
            lamp_colour=style.lamp_colour,
            ambient_up=tuple(0.75 * v for v in style.ambient),
            ambient_down=tuple(float(v) for v in np.array(style.ambient) * bounce),
            points=points,
            point_colours=colours,
            portals=portals,
            portal_normals=normals,
            portal_colour=style.sky_colour,
        )

    def _draw_shadow(
        self, slot: int, room: Room, to_light: Float[np.ndarray, "4 4"], skip: frozenset[str]
    ) -> None:
        self._map_targets[slot].use()
        self._map_targets[slot].clear(depth=1.0)
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        set_uniforms(self._shadow, to_light=to_light)
        for instance in room.instances:
            if instance.item < 0 or instance.group in skip or "ceiling lamp" in instance.names:
                continue
            set_uniforms(self._shadow, model=instance.model)
            first, count = self.pack.face_ranges[instance.item]
            self._shadow_vao.render(moderngl.TRIANGLES, vertices=int(count) * 3, first=int(first) * 3)
        if slot == 0:  # only the sun is outside the walls
            set_uniforms(self._shadow, model=np.eye(4))
            last = self._shell_ranges[-1]
            self._shadow_shell.render(moderngl.TRIANGLES, vertices=last[1] + last[2])

    # -- a picture --------------------------------------------------------------------------------

    def _draw_gbuffer(
        self, targets: _Targets, viewmat: np.ndarray, K: np.ndarray, size: tuple[int, int]
    ) -> None:
        room = self._room
        assert room is not None
        targets.gbuffer.use()
        targets.gbuffer.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self._materials.use(0)
        self._textures.use(1)
        eye = -viewmat[:3, :3].T @ viewmat[:3, 3]
        for program in self._looks.values():
            _frame_uniforms(program, room, viewmat, eye, K, size)
        visible = [
            (float(np.linalg.norm((i.low + i.high) / 2 - eye)), k)
            for k, i in enumerate(room.instances)
            if i.item >= 0 and _in_view(i, viewmat, K, size)
        ]
        for _, k in sorted(visible):  # front to back: early depth tests save shading
            self._draw_instance(room.instances[k], k + 1)
        self._draw_shell(room)

    def _draw_instance(self, instance: Instance, number: int) -> None:
        look = self._item_looks[instance.item]
        program = self._looks[look]
        set_uniforms(program, model=instance.model)
        panes = 1.0 if instance.group in {"window", "door"} else 0.0
        set_uniforms(
            program,
            instance_id=float(number),
            tint=instance.tint,
            seed=instance.seed,
            glow=instance.glow,
            see_through=panes,
        )
        first, count = self.pack.face_ranges[instance.item]
        self._arrays[look].render(moderngl.TRIANGLES, vertices=int(count) * 3, first=int(first) * 3)

    def _draw_shell(self, room: Room) -> None:
        for kind, first, count in self._shell_ranges:
            look = _SHELL_LOOKS[kind]
            program = self._looks[look]
            set_uniforms(program, model=np.eye(4))
            set_uniforms(program, instance_id=float(kind), tint=room.style.ceiling_colour, glow=0.0)
            self._shell_arrays[look].render(moderngl.TRIANGLES, vertices=count, first=first)

    def _lens(self, K: Float[np.ndarray, "3 3"], size: tuple[int, int]) -> tuple[float, float, float, float]:
        return (0.5 / float(K[0, 0]), 0.5 / float(K[1, 1]), 2.0 * size[1] + 1, 2.0 * size[0] + 1)

    def _draw_occlusion(self, targets: _Targets, viewmat: np.ndarray, lens: tuple[float, ...]) -> None:
        targets.occlusion.use()
        self.ctx.enable_only(moderngl.NOTHING)
        targets.textures["depth_id"].use(0)
        targets.textures["normal"].use(1)
        set_uniforms(self._occlude, to_camera=viewmat, lens=lens, depth_id=0, normals=1)
        self._screens[self._occlude].render(moderngl.TRIANGLES, vertices=3)

    def _draw_light(self, targets: _Targets, viewmat: np.ndarray, lens: tuple[float, ...]) -> None:
        targets.shade.use()
        for slot, name in enumerate(("albedo", "normal", "depth_id", "occlusion")):
            targets.textures[name].use(slot)
        self._maps[0].use(4)
        self._maps[1].use(5)
        names = ("albedos", "normals", "depth_id", "occlusions", "sun_map", "lamp_map")
        set_uniforms(self._shade, **{name: slot for slot, name in enumerate(names)})
        set_uniforms(self._shade, to_world=np.linalg.inv(viewmat), lens=lens)
        self._screens[self._shade].render(moderngl.TRIANGLES, vertices=3)

    def _resolve(self, targets: _Targets, size: tuple[int, int]) -> Picture:
        targets.resolve.use()
        targets.textures["radiance"].use(0)
        targets.textures["depth_id"].use(1)
        set_uniforms(self._finish, radiance=0, depth_id=1)
        self._screens[self._finish].render(moderngl.TRIANGLES, vertices=3)
        colour, centre = (
            np.frombuffer(targets.textures[name].read(), dtype=np.float32).reshape(*size, 4)[::-1]
            for name in ("colour", "centre")
        )
        return Picture(
            colour[..., :3].copy(), centre[..., 0].copy(), np.round(centre[..., 1]).astype(np.int32)
        )


def _layout(program: moderngl.Program, names: tuple[str, ...]) -> tuple[str, ...]:
    """Buffer format and attributes of a vertex row, less what the compiler dropped."""
    parts = zip(("3f", "3f", "2f", "1f"), ("12x", "12x", "8x", "4x"), names, strict=True)
    formats = [used if name in program else gap for used, gap, name in parts]
    return (" ".join(formats), *(name for name in names if name in program))


def _item_look(pack: Pack, item: int) -> str:
    """Which shader draws an item: patterns, holes, or plain."""
    first, count = pack.vertex_ranges[item]
    rows = pack.material_table[np.unique(pack.material_ids[first : first + count])]
    if (rows[:, 1, 2] > 0).any():
        return "pattern"
    layers = rows[:, 1, 0].astype(int)
    holed = any(layer >= 0 and pack.textures[layer, ..., 3].min() < 128 for layer in layers)
    return "cut" if holed or (rows[:, 0, 3] <= 0.92).any() else "mesh"


def _frame_uniforms(
    program: moderngl.Program,
    room: Room,
    viewmat: np.ndarray,
    eye: np.ndarray,
    K: np.ndarray,
    size: tuple[int, int],
) -> None:
    """What is the same for all things in one picture."""
    set_uniforms(program, to_camera=viewmat)
    fine_h, fine_w = 2 * size[0] + 1, 2 * size[1] + 1
    style = room.style
    set_uniforms(
        program,
        materials=0,
        textures=1,
        projection=(4 * K[0, 0] / fine_w, 4 * K[1, 1] / fine_h, _NEAR, _FAR),
        eye_w=tuple(float(v) for v in eye),
        wall_colour=style.wall_colour,
        wall_accent=style.wall_accent,
        wall_style=style.wall_finish,
        floor_colour=style.floor_colour,
        floor_accent=style.floor_accent,
        floor_style=style.floor_finish,
        ceiling_colour=style.ceiling_colour,
    )


def _shell_rows(
    triangles: Float[np.ndarray, "F 3 3"], kinds: Int[np.ndarray, " F"], white_material: int
) -> Float[np.ndarray, "C 9"]:
    """Vertices of the shell, grouped by kind."""
    order = np.argsort(kinds, kind="stable")
    triangles, kinds = triangles[order], kinds[order]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    materials = np.full((3 * len(kinds), 1), white_material)
    corners = triangles.reshape(-1, 3)
    return np.concatenate(
        [corners, np.repeat(normals, 3, axis=0), corners[:, [0, 2]], materials], axis=1
    ).astype(np.float32)


def _runs(kinds: Int[np.ndarray, " F"]) -> list[tuple[int, int, int]]:
    """(kind, first vertex, count) in the order of `_shell_rows`."""
    runs, first = [], 0
    for kind in (WALL, FLOOR, CEILING):
        count = int((kinds == kind).sum()) * 3
        runs.append((kind, first, count))
        first += count
    return runs


def _in_view(instance: Instance, viewmat: np.ndarray, K: np.ndarray, size: tuple[int, int]) -> bool:
    """False only when a box lies wholly beyond one side of the picture, or behind."""
    low, high = instance.low, instance.high
    corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    p = corners @ viewmat[:3, :3].T + viewmat[:3, 3]
    tan_x, tan_y = 0.51 * size[1] / K[0, 0], 0.51 * size[0] / K[1, 1]
    z = p[:, 2]
    outside = (z < 0, p[:, 0] > tan_x * z, p[:, 0] < -tan_x * z, p[:, 1] > tan_y * z, p[:, 1] < -tan_y * z)
    return not any(side.all() for side in outside)


def _lamp_matrix(room: Room) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "4 4"]]:
    """The ceiling lamp's place, and its wide downward view."""
    hung = [i for i in room.instances if i.group == "lamp" and i.high[1] > room.shell.height - 0.05]
    if hung:
        place = (hung[0].low + hung[0].high) / 2
        place[1] = max(hung[0].low[1] - 0.05, 1.6)
    else:
        place = np.array([room.shell.size[0] / 2, room.shell.height - 0.2, room.shell.size[1] / 2])
    view = np.eye(4)
    view[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # looks down: GL camera axes
    view[:3, 3] = -view[:3, :3] @ place
    near, far, focal = 0.1, 8.0, 1 / math.tan(math.radians(150) / 2)
    lens = np.diag([focal, focal, (far + near) / (near - far), 0.0])
    lens[2, 3], lens[3, 2] = 2 * far * near / (near - far), -1.0
    return place, lens @ view


def _sun_matrix(room: Room) -> Float[np.ndarray, "4 4"]:
    """Parallel light over the whole room."""
    extent = np.array([room.shell.size[0], room.shell.height, room.shell.size[1]])
    centre, radius = extent / 2, float(np.linalg.norm(extent)) / 2 + 0.3
    forward = -np.array(room.style.sun_direction)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, up, forward]) / radius
    matrix[:3, 3] = -matrix[:3, :3] @ centre
    return matrix


def _small_lamps(room: Room) -> tuple[Float[np.ndarray, "6 4"], Float[np.ndarray, "6 3"]]:
    points, colours = np.zeros((_MAX_POINTS, 4), np.float32), np.zeros((_MAX_POINTS, 3), np.float32)
    shining = [i for i in room.instances if i.glow > 0][:_MAX_POINTS]
    for k, lamp in enumerate(shining):
        points[k, :3] = (lamp.low + lamp.high) / 2
        points[k, 1] = lamp.low[1] + 0.8 * (lamp.high[1] - lamp.low[1])
        points[k, 3] = 2.5
        colours[k] = np.array([1.0, 0.78, 0.52]) * lamp.glow * 0.12
    return points, colours


def _portals(room: Room) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "4 3"]]:
    """Windows as soft lights: centre, area and inward normal."""
    portals, normals = np.zeros((_MAX_PORTALS, 4), np.float32), np.zeros((_MAX_PORTALS, 3), np.float32)
    for k, hole in enumerate([o for o in room.shell.openings if o.window][:_MAX_PORTALS]):
        wall = room.shell.walls[hole.wall]
        foot = wall.start + wall.direction * hole.centre - wall.inward * 0.1
        portals[k] = (foot[0], hole.foot + hole.height / 2, foot[1], hole.width * hole.height)
        normals[k] = (wall.inward[0], 0.0, wall.inward[1])
    return portals, normals
