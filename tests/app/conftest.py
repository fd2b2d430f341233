"""What tests of the renderer and of the window share: one OpenGL context."""

import pytest

from app.gl import offscreen_context
from langflash_core.errors import GraphicsError


@pytest.fixture(scope="session")
def context():
    """One OpenGL context without a window for all tests; they are skipped where there is none."""
    try:
        made = offscreen_context()
    except GraphicsError as problem:
        pytest.skip(str(problem))
    yield made
    made.release()
