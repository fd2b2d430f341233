"""OpenGL without a window: EGL on Linux, the system's hidden context elsewhere."""

import sys
from typing import Any

import moderngl

from langflash_core.errors import GraphicsError

from .targets import bound_framebuffer

_VERSION = 330


def offscreen_context() -> moderngl.Context:
    """A context of its own, current on this thread, objects released by their owners only.

    Raises:
        GraphicsError: no OpenGL 3.3; the sentence names the packages that bring it.
    """
    try:
        settings: dict[str, Any] = {"backend": "egl"} if sys.platform.startswith("linux") else {}
        context = moderngl.create_context(require=_VERSION, standalone=True, **settings)
    except Exception as error:  # glcontext raises bare Exception whatever went wrong
        raise GraphicsError(_explain(error)) from error
    bound_framebuffer(context)
    return context


def _explain(error: Exception) -> str:
    if sys.platform.startswith("linux"):
        return (
            f"OpenGL could not start without a screen ({error}); install the Debian packages "
            "libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri, or use --backend torch"
        )
    return f"OpenGL 3.3 could not start ({error}); update the graphics driver, or use --backend torch"
