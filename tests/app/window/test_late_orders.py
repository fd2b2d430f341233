"""What moves is drawn in a late order, what rests in its own."""

import time
from dataclasses import replace

import pytest
import torch

from app.gl import SplatRenderer, moving_renderer, ordering
from app.gl.hardware import CARD
from app.window.drawing.card import CardPicture
from app.window.drawing.picture import ScenePicture
from app.window.drawing.processor import ProcessorPicture
from app.window.drawing.values import Stand
from langflash_core.geometry.poses import orbit
from tests.app.window.scenes import room, shown_scene

SIZE = (160, 120)
FRAMES = 4


def made(kind: str, context) -> tuple[SplatRenderer, ScenePicture]:
    scene = room(torch.eye(3, 384))
    if kind == "card":
        renderer = SplatRenderer(context, hardware=CARD)
        return renderer, CardPicture(renderer, 1, scene)
    renderer = moving_renderer(context)
    return renderer, ProcessorPicture(renderer, 1, scene, lambda: None)


@pytest.mark.parametrize("kind", ["card", "processor"])
def test_a_picture_that_moves_is_late_and_one_at_rest_is_not(context, monkeypatch, kind) -> None:
    monkeypatch.setattr(ordering, "FEW", 0)
    state = shown_scene()
    with context:
        renderer, picture = made(kind, context)
        late = 0
        stand = Stand(state.scene.pose, SIZE, state.now)
        while late < FRAMES:
            state = replace(state, now=state.now + 0.05)
            pose = orbit(state.scene.pose, 0.01, 0.0)
            state = state.with_scene(pose=pose)
            stand = Stand(pose, SIZE, state.now)
            picture.update(state, stand, touched=state.now)
            late += not picture.easel.exact
        for _ in range(600):
            state = replace(state, now=state.now + 0.05)
            picture.update(state, stand, touched=0.0)
            if picture.whole and picture.easel.exact:
                break
            time.sleep(0.01)
        assert picture.whole and picture.easel.exact
        picture.release(2.0)
        renderer.release()
