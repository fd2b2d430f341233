"""GLSL programs from `shaders/`: includes, definitions, and a cache with an owner."""

import re

import moderngl
import numpy as np

from langflash_core.resources import shader_path

_INCLUDE = re.compile(r'^#include "([\w.]+)"$', re.MULTILINE)


def shader_source(name: str, defines: dict[str, float]) -> str:
    """Text of `shaders/<name>` with its includes pasted in and `defines` after #version.

    Includes are looked up in `shaders/include/`; an include may not include.
    """
    text = shader_path(name).read_text(encoding="utf-8")
    text = _INCLUDE.sub(lambda m: shader_path(f"include/{m[1]}").read_text(encoding="utf-8"), text)
    version, rest = text.split("\n", 1)
    lines = [f"#define {key} {value}" for key, value in sorted(defines.items())]
    return "\n".join([version, *lines, rest])


class Programs:
    """Compiles each variant once; releases all of them."""

    def __init__(self, ctx: moderngl.Context):
        self._ctx = ctx
        self._made: dict[tuple, moderngl.Program] = {}

    def get(
        self,
        vertex: str,
        fragment: str | None = None,
        defines: dict[str, float] | None = None,
        varyings: tuple[str, ...] = (),
    ) -> moderngl.Program:
        """The program of two files in `shaders/splat/`; `varyings` are captured instead of drawn."""
        defines = defines or {}
        key = (vertex, fragment, varyings, tuple(sorted(defines.items())))
        if key not in self._made:
            self._made[key] = self._ctx.program(
                vertex_shader=shader_source(f"splat/{vertex}", defines),
                fragment_shader=shader_source(f"splat/{fragment}", defines) if fragment else None,
                varyings=varyings,
            )
        return self._made[key]

    def release(self) -> None:
        for program in reversed(self._made.values()):
            program.release()
        self._made.clear()


def set_uniforms(program: moderngl.Program, **values: float | int | tuple | np.ndarray) -> None:
    """Set uniforms by name; those the compiler found unused are passed over. Arrays go as float32."""
    for name, value in values.items():
        uniform = program.get(name, None)
        if isinstance(uniform, moderngl.Uniform):
            if isinstance(value, np.ndarray):
                uniform.write(np.ascontiguousarray(value, dtype=np.float32).tobytes())
            else:
                uniform.value = value
