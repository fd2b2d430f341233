"""Shaders compiled before somebody waits for them: a driver does so at the first drawing, and software
renderers take a tenth of a second for each."""

from collections.abc import Iterator

import torch

from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.language.relevance import CompiledQuery
from langflash_core.types import Camera, Gaussians, Scene, Semantics

from .answers import ShaderAnswers
from .canvas import Canvas
from .display import Answer, Drawn
from .question import Question
from .scene import LiveScene, MakeSplats
from .splats import SplatBuffers
from .view import ViewTargets

SIDE = 36  # pixels; no power of two: for textures with such sides Mesa compiles shaders of their own


def warm_up(canvas: Canvas, splats: MakeSplats = SplatBuffers) -> Iterator[None]:
    """Draw one Gaussian in the ways that come first, a shader a step. splats: as the renderer has them."""
    camera = Camera(torch.eye(4), torch.tensor([[36.0, 0, 18], [0, 36, 18], [0, 0, 1]]), SIDE, SIDE)
    view = canvas.view((SIDE, SIDE))
    scene = LiveScene(canvas.painter, _one(), splats)
    try:
        yield from _ways(view, scene, camera)
    finally:  # of a warm-up, too, that a scene puts an end to
        scene.release()


def _ways(view: ViewTargets, scene: LiveScene, camera: Camera) -> Iterator[None]:
    level = scene.whole
    yield
    level.prepare(camera)
    yield
    view.draw_colour(level)
    yield
    drawn = Drawn(view.colour, camera, (0.0, 0.0, 0.0), level.places_key, fill=True)
    for _ in view.display.gaps.passes(view.colour.colour, view.colour.depth):
        yield
    yield
    view.display.rgb(drawn)
    yield
    view.display.faded(drawn, scene.scene)
    yield
    one = torch.ones(1, 1)
    question = Question(CompiledQuery(one, one, one, 1.0, 0.5, "relevancy", ("",)), ShaderAnswers)
    view.fast_passes(question.num_phrases).run(question.compiled)
    yield
    answer = Answer(view.fast(question, level), question.num_phrases, ())
    yield
    view.display.heat(drawn, answer, 0, 0.5, (0.5, 1.0), "turbo", True)


def _one() -> Scene:
    place = torch.tensor([[0.0, 0.0, 1.0]])
    quat = torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    colour = colour_to_sh(torch.full((1, 3), 0.5))[:, None]
    gaussians = Gaussians(place, quat, torch.full((1, 3), 0.1), torch.ones(1), colour)
    semantics = Semantics(torch.zeros(1, 1, dtype=torch.int64), torch.ones(1, 1), torch.ones(1, 1), "none")
    return Scene(gaussians, semantics, torch.eye(4)[None], torch.eye(3)[None], (SIDE, SIDE))
