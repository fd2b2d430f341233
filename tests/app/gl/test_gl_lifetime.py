"""Objects, errors, state: what is left behind when the renderer has been and gone."""

import ctypes
import math
import mmap
import random
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import torch

from app.cli.drawn import MOST_LAYERS, bytes_drawn
from app.cli.renderers import open_renderer
from app.gl import SplatRenderer, offscreen_context, paints
from app.gl.canvas import Canvas
from app.gl.hardware import hardware_of
from app.gl.layered import KEPT
from app.gl.layout import DEFINES
from app.gl.splats import SplatBuffers
from app.gl.targets import gl_function
from langflash_core.base.graphics import COMPUTE, Programs
from langflash_core.errors import GraphicsError
from langflash_core.types import Scene
from tests.app.gl.questions import question
from tests.app.gl.test_gl_layers import layered
from tests.splat.scenes import camera, cloud, maps_of

COMPUTING = "#version 430 core\nlayout(local_size_x = 1) in; void main() {}"
KINDS = ("Texture", "Buffer", "Framebuffer", "Program", "VertexArray", "Shader")


def living(gl) -> dict[str, int]:
    """How many names of each kind OpenGL itself calls objects."""
    counts = {}
    for kind in KINDS:
        is_object = gl_function(gl, f"glIs{kind}", ctypes.c_ubyte, ctypes.c_uint)
        counts[kind] = sum(bool(is_object(name)) for name in range(1, 20_000))
    return counts


def resident_megabytes() -> float:
    """Memory this process holds; 0 where the system does not say so in /proc."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * mmap.PAGESIZE / 1e6 if statm.exists() else 0.0


@pytest.mark.parametrize("degree", [0, 1, 3, 4])
def test_a_scene_takes_on_the_card_what_is_told(gl, degree):
    """Buffers and textures that stay; tables of weights are filled up to whole rows."""
    scene = cloud(20_000, 5)
    num_bases, opacities = (degree + 1) ** 2, scene.gaussians.opacities.clamp_min(0.1)
    sh = torch.zeros(len(opacities), num_bases, 3)
    scene = replace(scene, gaussians=replace(scene.gaussians, sh=sh, opacities=opacities))
    programs = Programs(gl, "splat", DEFINES)
    splats = SplatBuffers(gl, programs, scene)
    made = [*splats._vertices._shapes, splats._vertices._harmonics, splats._vertices._tints]
    made += [splats._order_buffer, splats.places]
    held = sum(buffer.size for buffer in made) + 8 * math.prod(splats._textures._sparse.size)
    splats.release()
    programs.release()
    told = bytes_drawn(len(opacities), num_bases, scene.semantics.weight_ids.shape[1], None)
    assert told == pytest.approx(held, rel=0.01)
    halves = bytes_drawn(len(opacities), num_bases, 5, 2 * KEPT)
    assert halves == bytes_drawn(len(opacities) // 2, num_bases, 5, None) and MOST_LAYERS == KEPT


@pytest.fixture(scope="module")
def use_another_program(context):
    """A program in use outlives its deletion, and so does a compute shader: use these before counting."""
    context.__enter__()  # current, whoever else drew in between
    program = context.program(
        vertex_shader="#version 330 core\nout float x; void main() { x = 1.0; }", varyings=["x"]
    )
    room, draws = context.buffer(reserve=4), context.vertex_array(program, [])
    shader = context.compute_shader(COMPUTING) if context.version_code >= COMPUTE else None

    def use() -> None:
        if shader is not None:
            shader.run(1)
        draws.transform(room, vertices=1)

    yield use
    for owned in (draws, room, program, *([shader] if shader is not None else [])):
        owned.release()


def test_nothing_leaks_in_1000_frames(gl, queries, use_another_program):
    """Random sizes, scenes and phrases: no error, every name given back, memory level."""
    use_another_program()
    before = living(gl)
    renderer = SplatRenderer(gl)
    shake = random.Random(0)
    scenes = [cloud(count, atoms) for count, atoms in ((200, 0), (0, 3), (150, 5), (100, 70))]
    megabytes = []
    for _ in range(1000):
        scene = shake.choice(scenes)
        renderer.set_scene(scene)
        size = shake.randrange(1, 60), shake.randrange(1, 60)
        renderer.draw(
            camera(*size),
            weight_maps=shake.random() < 0.5,
            fast=shake.random() < 0.3,
            share=shake.choice((1.0, 1.0, 0.25)),
        )
        renderer.ask(question(scene, shake.randrange(1, 9)))
        renderer.heat_texture(0)
        atoms, depth = renderer.picture().atoms, partial(paints.depth, renderer)
        shake.choice([renderer.label_texture, atoms, depth, renderer.frame])()
        assert gl.error == "GL_NO_ERROR"
        megabytes.append(resident_megabytes())
    assert living(gl) != before
    # Each frame makes textures of some 100 kB: a leak of them would be 40 MB in 400 frames. After 600
    # nearly all shaders have been there, which the driver compiles anew for each format it meets; what
    # came later took 8 to 11 MB in runs of 3,000 frames, and nothing after 1,800.
    assert max(megabytes[600:]) - max(megabytes[:600]) < 20
    renderer.release()
    renderer.release()
    use_another_program()
    # No more than before: a program that an earlier test left in use may go meanwhile.
    assert all(count <= before[kind] for kind, count in living(gl).items()), (living(gl), before)


def test_a_released_renderer_draws_again(gl):
    scene = cloud(100, 3)
    renderer = SplatRenderer(gl)
    renderer.set_scene(scene)
    renderer.draw(camera())
    first = renderer.frame(True)
    renderer.release()
    renderer.set_scene(scene)
    renderer.draw(camera())
    again = renderer.frame(True)
    assert (first.rgb - again.rgb).abs().max() == 0 and (maps_of(first) - maps_of(again)).abs().max() == 0
    renderer.release()


def test_the_callers_state_survives(gl, renderer):
    """As in a window: its framebuffer and viewport stay bound, and drawing does not blend."""
    home = gl.fbo
    mine = gl.simple_framebuffer((20, 10), components=4)
    mine.use()
    mine.viewport = (3, 2, 7, 5)
    scene = cloud(200, 30)
    renderer.set_scene(scene)
    renderer.draw(camera())
    renderer.ask(question(scene))
    renderer.heat_texture(0)
    renderer.label_texture()
    renderer.relevance()
    assert gl.fbo is mine and mine.viewport == (3, 2, 7, 5)
    read = gl_function(gl, "glGetIntegerv", None, ctypes.c_uint, ctypes.POINTER(ctypes.c_int * 4))
    values = (ctypes.c_int * 4)()
    read(0x0BA2, values)  # GL_VIEWPORT
    assert tuple(values) == (3, 2, 7, 5)
    read(0x8CA6, values)  # GL_DRAW_FRAMEBUFFER_BINDING
    assert values[0] == mine.glo
    read(0x0BE2, values)  # GL_BLEND
    assert values[0] == 0
    home.use()  # moderngl must not be left bound to what is released
    for attachment in mine.color_attachments:
        attachment.release()
    mine.release()


def test_too_large_an_image_is_one_sentence(renderer):
    renderer.set_scene(cloud(3))
    with pytest.raises(GraphicsError, match="choose a smaller size"):
        renderer.draw(camera(10_000_000, 4))


def test_without_egl_the_packages_are_named(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("GLCONTEXT_LINUX_LIBEGL", "libnothing.so")
    with pytest.raises(GraphicsError, match="libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"):
        offscreen_context()


def test_a_command_that_was_told_to_use_opengl_names_the_other_way(monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("GLCONTEXT_LINUX_LIBEGL", "libnothing.so")
    with pytest.raises(GraphicsError, match="--backend torch"), open_renderer("gl"):
        pass


def test_renderers_share_a_canvas_and_each_has_its_own_picture(gl, queries):
    """As in the bench: the textures hold the picture drawn last, and no one takes it for another's."""
    scenes = cloud(200, 5), cloud(150, 3)
    alone = []
    for scene in scenes:
        renderer = SplatRenderer(gl)
        alone.append(_everything(renderer, scene))
        renderer.release()
    canvas = Canvas(gl)
    sharing = [SplatRenderer(gl, canvas=canvas) for _ in scenes]
    for renderer, scene in zip(sharing, scenes, strict=True):
        _everything(renderer, scene)
    for _ in range(2):
        assert [_pictures(renderer) for renderer in sharing] == alone
    for renderer in sharing:
        renderer.release()
    canvas.release()


def _everything(renderer: SplatRenderer, scene: Scene) -> list[bytes]:
    renderer.set_scene(scene)
    renderer.ask(question(scene))
    renderer.draw(camera())
    return _pictures(renderer)


def _pictures(renderer: SplatRenderer) -> list[bytes]:
    frame = renderer.frame(weight_maps=True)
    tensors = (frame.rgb, frame.depths, maps_of(frame), renderer.relevance())
    textures = (renderer.rgb_texture, renderer.heat_texture(1), renderer.picture().atoms())
    return [*(values.numpy().tobytes() for values in tensors), *(texture.read() for texture in textures)]


def test_a_canvas_of_another_precision_is_refused(gl):
    canvas = Canvas(gl, "float32")
    with pytest.raises(ValueError, match="canvas: expected float16"):
        SplatRenderer(gl, canvas=canvas)
    canvas.release()


def test_nothing_is_forgotten_but_what_is_asked_for(gl, queries):
    renderer = SplatRenderer(gl)
    before = _everything(renderer, cloud(100, 3))
    passes = renderer.passes.copy()
    renderer.forget(answers_only=True)
    assert _pictures(renderer) == before
    assert renderer.passes["weights"] == passes["weights"] and renderer.passes["norm"] == passes["norm"] + 1
    renderer.forget()
    with pytest.raises(ValueError, match="expected draw"):
        renderer.frame()
    renderer.draw(camera())
    assert _pictures(renderer) == before and renderer.passes["weights"] == passes["weights"] + 1
    renderer.release()


def test_precision_has_two_names(gl):
    with pytest.raises(ValueError, match="float16 or float32"):
        SplatRenderer(gl, "float8")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("blends_all", [True, False])
def test_layers_leave_nothing(gl, use_another_program, blends_all):
    """A walk past more than are kept, in two sizes, moving and at rest, with answers."""
    use_another_program()
    before = living(gl)
    renderer = SplatRenderer(gl, hardware=replace(hardware_of(gl), blends_all=blends_all))
    scene = layered(12, count=40)
    renderer.set_scene(scene)
    for view in range(12):
        seen = scene.camera(view).with_size(32 + 8 * (view % 2), 24)
        renderer.ask(question(scene, 1 + view % 3))
        renderer.draw(seen, fast=True, share=(1.0, 0.5)[view % 2])
        renderer.relevance()
        renderer.draw(seen)
        renderer.relevance()
        paints.trust(renderer, False)
    assert living(gl) != before
    renderer.release()
    use_another_program()
    assert all(count <= before[kind] for kind, count in living(gl).items()), (living(gl), before)
    assert gl.error == "GL_NO_ERROR"
