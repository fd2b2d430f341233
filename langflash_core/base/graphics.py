"""OpenGL without a window: a context, and GLSL programs from `shaders/`.

For whoever draws: the splat renderer and the rooms. moderngl is imported when something is called,
so the package loads without it.
"""

import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from langflash_core.base.optional import optional_packages
from langflash_core.base.resources import shader_path
from langflash_core.errors import GraphicsError

if TYPE_CHECKING:
    import moderngl

OPENGL = 330  # the version needed, 100 times
COMPUTE = 430  # that of compute shaders, which is asked for first: drivers may give no more than that
_INCLUDE = re.compile(r'^#include "([\w.]+)"$', re.MULTILINE)
_MATRIX = 0x8B5C  # GL_FLOAT_MAT4
_SOFTWARE = ("llvmpipe", "softpipe", "swr", "software rasterizer", "apple software renderer")


# --- a context ----------------------------------------------------------------------------------


def offscreen_context() -> "moderngl.Context":
    """A context of its own, current on this thread, objects released by their owners only.

    Made the platform's way: EGL on Linux, which needs no display; the system's hidden context elsewhere.

    Raises:
        GraphicsError: no OpenGL 3.3; the sentence names what brings it.
        MissingPackageError: moderngl is not installed.
    """
    with optional_packages():
        import moderngl
    settings: dict[str, Any] = {"backend": "egl"} if sys.platform.startswith("linux") else {}
    try:
        try:
            context = moderngl.create_context(require=COMPUTE, standalone=True, **settings)
        except Exception:  # as below
            context = moderngl.create_context(require=OPENGL, standalone=True, **settings)
        context.gc_mode = None  # pyright: ignore[reportAttributeAccessIssue] - owners release
        bound_framebuffer(context)
    except Exception as error:  # glcontext raises bare Exception whatever went wrong
        raise GraphicsError(_explain(error)) from error
    return context


def bound_framebuffer(ctx: "moderngl.Context") -> "moderngl.Framebuffer":
    """The framebuffer in use; a context without a screen, or whose last one was released, gets 1 x 1 pixels.

    moderngl binds its last framebuffer again after a clear, released or not: one must stay alive.
    """
    if ctx.fbo is None or not hasattr(ctx.fbo.mglo, "use"):
        (ctx.screen or ctx.simple_framebuffer((1, 1))).use()
    return ctx.fbo


def _explain(error: Exception) -> str:
    if sys.platform.startswith("linux"):
        return (
            f"OpenGL could not start without a screen ({error}); install the Debian packages "
            "libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"
        )
    return f"OpenGL 3.3 could not start ({error}); update the graphics driver"


@contextmanager
def refusals_said(ctx: "moderngl.Context | None", remedy: str) -> Iterator[None]:
    """What the driver refuses inside is one sentence: an object, a program, memory. Without this a picture
    for which there was no memory would be taken for one, since OpenGL only sets a flag.

    Args:
        ctx: whose flag is read at the end; None: whoever calls reads it.
        remedy: ends the sentence, after a semicolon.

    Raises:
        GraphicsError: it refused something.
    """
    import moderngl

    try:
        yield
        flag = None if ctx is None else ctx.error
    except moderngl.Error as error:
        raise GraphicsError(f"the graphics driver refused ({_one_line(error)}); {remedy}") from error
    if flag == "GL_OUT_OF_MEMORY":
        raise GraphicsError(f"the graphics driver is out of memory; {remedy}")


def _one_line(error: Exception) -> str:
    """Compilers and linkers say pages; the first line says what."""
    return next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)[
        :200
    ]


def draws_in_software(ctx: "moderngl.Context") -> bool:
    """Whether this OpenGL runs on the processor."""
    name = ctx.info["GL_RENDERER"].lower()
    return any(known in name for known in _SOFTWARE)


# --- programs -----------------------------------------------------------------------------------


def shader_source(name: str, defines: Mapping[str, float] | None = None) -> str:
    """Text of `shaders/<name>` with its includes pasted in and `defines` after #version.

    Includes are looked up in the shader's own folder, then in `shaders/include/`; an include may not
    include.

    Raises:
        FileNotFoundError: there is no such shader or include.
    """
    folder = name.rpartition("/")[0]

    def included(match: re.Match) -> str:
        beside = shader_path(folder) / match[1]
        found = beside if beside.exists() else shader_path(f"include/{match[1]}")
        return found.read_text(encoding="utf-8")

    text = _INCLUDE.sub(included, shader_path(name).read_text(encoding="utf-8"))
    version, rest = text.split("\n", 1)
    lines = [f"#define {key} {value}" for key, value in sorted((defines or {}).items())]
    return "\n".join([version, *lines, rest])


class Programs:
    """Compiles each variant of the shaders in one folder once; releases all of them."""

    def __init__(self, ctx: "moderngl.Context", folder: str, defines: Mapping[str, float] | None = None):
        """
        Args:
            folder: in `shaders/`. defines: given to every shader, beside those of a variant.
        """
        self._ctx = ctx
        self._folder = folder
        self._defines = dict(defines or {})
        self._made: dict[tuple, moderngl.Program] = {}
        self._computed: dict[tuple, moderngl.ComputeShader] = {}

    def get(
        self,
        vertex: str,
        fragment: str | None = None,
        defines: Mapping[str, float] | None = None,
        varyings: tuple[str, ...] = (),
    ) -> "moderngl.Program":
        """The program of two files in the folder; `varyings` are captured instead of drawn."""
        defines = {**self._defines, **(defines or {})}
        key = (vertex, fragment, varyings, tuple(sorted(defines.items())))
        if key not in self._made:
            self._made[key] = self._ctx.program(
                vertex_shader=shader_source(f"{self._folder}/{vertex}", defines),
                fragment_shader=shader_source(f"{self._folder}/{fragment}", defines) if fragment else None,
                varyings=varyings,
            )
        return self._made[key]

    def compute(self, name: str, defines: Mapping[str, float] | None = None) -> "moderngl.ComputeShader":
        """The compute shader of a file in the folder, of OpenGL 4.3."""
        defines = {**self._defines, **(defines or {})}
        key = (name, tuple(sorted(defines.items())))
        if key not in self._computed:
            self._computed[key] = self._ctx.compute_shader(shader_source(f"{self._folder}/{name}", defines))
        return self._computed[key]

    def release(self) -> None:
        """Give all programs back; the next `get` compiles again."""
        for made in (self._computed, self._made):
            for program in reversed(made.values()):
                program.release()
            made.clear()


def set_uniforms(
    program: "moderngl.Program | moderngl.ComputeShader", **values: float | tuple | np.ndarray
) -> None:
    """Set uniforms by name; those the compiler found unused are passed over.

    Arrays go as float32. Matrices (..., 4, 4) are given by rows, as they are written, and handed over
    by columns, as OpenGL reads them.
    """
    import moderngl

    for name, value in values.items():
        uniform = program.get(name, None)
        if not isinstance(uniform, moderngl.Uniform):
            continue
        if isinstance(value, np.ndarray):
            ordered = value.swapaxes(-1, -2) if uniform.gl_type == _MATRIX else value  # pyright: ignore[reportAttributeAccessIssue]
            uniform.write(np.ascontiguousarray(ordered, dtype=np.float32).tobytes())
        else:
            uniform.value = value
