"""Nothing covers anything else where the window is small or the interface large."""

import pytest

from app.window.editing.panels.tools import _GAP, _MARGIN, _TOOLS, tool_side
from app.window.scene.panels.legend import covers_views

SEPARATORS = 2 * (1 + _GAP) + 12  # two lines, and the strip's padding


@pytest.mark.parametrize(("window", "scale"), [((800, 500), 1.0), ((1280, 800), 1.5), ((1920, 1080), 1.0)])
def test_the_tools_end_above_the_viewpoints(window: tuple[int, int], scale: float) -> None:
    height = window[1] / scale - 52 - 32  # toolbar and status bar
    side = tool_side(height)
    strip = (len(_TOOLS) + 3) * (side + _GAP) + SEPARATORS
    assert _MARGIN + strip <= height - 88
    assert side == 36 if height > 500 else side >= 20  # icons are 16


def test_the_legend_makes_room_for_the_viewpoints() -> None:
    assert covers_views(452, 2) and not covers_views(932, 2) and covers_views(932, 9)
