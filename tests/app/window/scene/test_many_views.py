"""The buttons of a scene's photos stay in the window, however many there are."""

from dataclasses import replace

import pytest

from app.window.frame import layout
from app.window.kit import theme
from tests.app.window import headless
from tests.app.window.scenes import shown_scene


@pytest.mark.parametrize("count", (2, 9, 32))
def test_the_switches_beside_the_photos_are_in_sight(count: int) -> None:
    state = shown_scene()
    assert state.scene.info is not None
    state = state.with_scene(info=replace(state.scene.info, views=state.scene.info.views[:1] * count))
    with headless.context((900, 600)):
        theme.set_up(1.0)
        headless.frames(lambda look: layout.draw_all(state, look), headless.look())
        left, top, right, bottom = headless.box("##views")
    assert left >= 0 and right <= 900 and bottom <= 600 and bottom - top <= 90
