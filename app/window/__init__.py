"""The window: photos in, a scene to fly through, phrases that light up.

`state` holds what is shown, `commands` what can happen, `worker` what takes long; `panels` turn
the state into pictures and hands into commands; `session` joins them in one loop.
"""

from collections.abc import Sequence
from pathlib import Path

__all__ = ["run"]


def run(paths: Sequence[str | Path] = ()) -> int:
    """Open the window; `paths` behave like a drop. Returns the exit code when it is closed.

    Raises:
        GraphicsError: no display, or no OpenGL 3.3.
    """
    from .session import Session  # glfw and ImGui load here, not with the package

    return Session(paths).run()
