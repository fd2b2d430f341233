"""The window: photos in, a scene to fly through, phrases that light up.

A folder a feature (scene, asking, editing, exporting, recovery), a file a role in each: `state` holds
what is shown, `commands` what can happen, `work` what takes long, on the worker's thread; `effects` alone
touch the disk, the worker and the picture; panels turn the state into pictures and hands into commands.
What they share is here: `session` joins it in one loop, `frame` puts the panels in their places, `kit`
is what panels are made of, `viewport` shows what `drawing` draws, as much as the quality `governor` allows.
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
