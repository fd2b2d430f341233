"""Contexts without a window, and shaders from their files."""

import sys

import moderngl
import numpy as np
import pytest

from langflash_core.base.graphics import Programs, offscreen_context, set_uniforms, shader_source
from langflash_core.base.resources import shader_path
from langflash_core.errors import GraphicsError, MissingPackageError


def test_a_shader_is_its_text_with_includes_and_defines():
    source = shader_source("splat/norm.frag", {"LAYERS": 3, "COLUMNS": 2})
    lines = source.splitlines()
    assert lines[:3] == ["#version 330 core", "#define COLUMNS 2", "#define LAYERS 3"]
    assert "#include" not in source
    assert shader_path("include/combine.glsl").read_text(encoding="utf-8") in source


def test_includes_beside_the_shader_come_first(tmp_path, monkeypatch):
    files = {
        "own/a.frag": '#version 330 core\n#include "both.glsl"\n#include "shared.glsl"\nvoid main() {}\n',
        "own/both.glsl": "// beside\n",
        "include/both.glsl": "// shared\n",
        "include/shared.glsl": "// only here\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr("langflash_core.base.graphics.shader_path", tmp_path.joinpath)
    assert shader_source("own/a.frag").splitlines() == [
        "#version 330 core", "// beside", "", "// only here", "", "void main() {}",
    ]  # fmt: skip
    (tmp_path / "include/shared.glsl").unlink()
    with pytest.raises(FileNotFoundError):
        shader_source("own/a.frag")


@pytest.mark.parametrize("folder", ["splat", "rooms"])
def test_every_include_is_found(folder):
    for path in shader_path(folder).rglob("*.*"):
        if path.suffix in (".vert", ".frag", ".comp"):
            name = path.relative_to(shader_path(folder).parent).as_posix()
            source = shader_source(name)
            version = 430 if path.parent.name == "tiled" else 330
            assert "#include" not in source and source.startswith(f"#version {version} core\n"), name


def test_programs_are_compiled_once_and_given_back(gl):
    programs = Programs(gl, "splat", {"PHRASES_A_LAYER": 4})
    defines = {"EMPTY_NORM": 1e-4, "ATOMS_A_LAYER": 3}
    first = programs.get("screen.vert", "fast.frag", defines)
    assert programs.get("screen.vert", "fast.frag", dict(defines)) is first
    assert programs.get("screen.vert", "fast.frag", {**defines, "EMPTY_NORM": 1e-3}) is not first
    programs.release()
    assert programs.get("screen.vert", "fast.frag", defines) is not first
    programs.release()
    assert gl.error == "GL_NO_ERROR"


def test_matrices_are_given_by_rows(gl):
    program = gl.program(
        vertex_shader="#version 330 core\nuniform mat4 one; uniform mat4 two[2]; uniform vec4 rows[4];\n"
        "out vec4 x; out vec4 y; out vec4 z;\nvoid main() { vec4 v = vec4(1.0, 2.0, 3.0, 4.0);"
        "x = one * v; y = two[gl_VertexID + 1] * v; z = rows[gl_VertexID + 2]; }",
        varyings=("x", "y", "z"),
    )
    values = np.random.default_rng(0).integers(0, 9, (2, 4, 4)).astype(float)
    set_uniforms(program, one=values[0], two=values, rows=values[0], unknown=1.0)
    out, vao = gl.buffer(reserve=48), gl.vertex_array(program, [])
    vao.transform(out, mode=moderngl.POINTS, vertices=1)
    x, y, z = np.frombuffer(out.read(), np.float32).reshape(3, 4)
    vector = np.array([1, 2, 3, 4])
    assert np.array_equal(x, values[0] @ vector) and np.array_equal(y, values[1] @ vector)
    assert np.array_equal(z, values[0][2])
    for owned in (vao, out, program):
        owned.release()


@pytest.mark.parametrize("platform, asked", [("linux", {"backend": "egl"}), ("darwin", {}), ("win32", {})])
def test_a_context_is_made_the_platforms_way(monkeypatch, platform, asked):
    told = []

    def create(**settings):
        told.append(settings)
        raise Exception("no such luck")

    monkeypatch.setattr("sys.platform", platform)
    monkeypatch.setattr(moderngl, "create_context", create)
    with pytest.raises(GraphicsError, match="no such luck") as caught:
        offscreen_context()
    assert told == [{"require": version, "standalone": True, **asked} for version in (430, 330)]
    assert ("libegl1" in str(caught.value)) == (platform == "linux")


def test_without_moderngl_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    with pytest.raises(MissingPackageError, match="langflash\\[gl\\]"):
        offscreen_context()
