"""Shaders compiled before somebody waits for them: a driver does so at the first drawing, and software
renderers take a tenth of a second for each."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from langflash_core.base.records import Record
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.nearness import NEAREST
from langflash_core.language.relevance import CompiledQuery
from langflash_core.types import Camera, Gaussians, Scene, Semantics

from .answers import ShaderAnswers
from .canvas import Canvas
from .display import Answer, Drawn
from .layered import MOVING
from .question import Question
from .scene import LiveScene
from .splats import MakeSplats, SplatBuffers
from .view import ViewTargets

SIDE = 36  # pixels; no power of two: for textures with such sides Mesa compiles shaders of their own
_CAMERA = Camera(torch.eye(4), torch.tensor([[36.0, 0, 18], [0, 36, 18], [0, 0, 1]]), SIDE, SIDE)


def warm_up(canvas: Canvas, splats: MakeSplats = SplatBuffers) -> Iterator[None]:
    """Draw one Gaussian in the ways that come first, a shader a step. splats: as the renderer has them."""
    with _live(canvas, _one(1), splats) as scene:
        yield from _ways(canvas.view((SIDE, SIDE)), scene)
    yield from warm_layers(canvas, splats)


def warm_layers(canvas: Canvas, splats: MakeSplats = SplatBuffers) -> Iterator[None]:
    """The same of what layers are blended with while the camera moves."""
    quick = not canvas.hardware.blends_all
    with _live(canvas, _one(MOVING if quick else NEAREST), splats) as scene:
        level, view = scene.whole, canvas.view((SIDE, SIDE))
        level.prepare(_CAMERA, quick)
        yield
        part = level.parts[0]
        part.splats.splat(view.colour.framebuffer)
        yield
        view.draw_colour(level)
        yield
        question = _question()
        passes = view.fast_passes(question.num_phrases)
        part.splats.splat(passes.framebuffer, question.numbers(part))
        yield
        passes.run(question.compiled)
        yield
        view.fast(question, level)


def _ways(view: ViewTargets, scene: LiveScene) -> Iterator[None]:
    level, camera = scene.whole, _CAMERA
    yield
    for part in level.parts:
        yield from part.splats.compile(camera)
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
    question = _question()
    view.fast_passes(question.num_phrases).run(question.compiled)
    yield
    answer = Answer(view.fast(question, level), question.num_phrases, ())
    yield
    view.display.heat(drawn, answer, 0, 0.5, (0.5, 1.0), "turbo", True)


@contextmanager
def _live(canvas: Canvas, scene: Scene, splats: MakeSplats) -> Iterator[LiveScene]:
    """Given back also where a scene puts an end to a warm-up."""
    made = LiveScene(canvas.painter, scene, splats)
    try:
        yield made
    finally:
        made.release()


def _question() -> Question:
    one = torch.ones(1, 1)
    return Question(CompiledQuery(one, one, one, 1.0, 0.5, "relevancy", ("",)), ShaderAnswers)


def _one(num_layers: int) -> Scene:
    """One Gaussian in each layer."""
    place = torch.tensor([[0.0, 0.0, 1.0]]).expand(num_layers, 3)
    quat = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).expand(num_layers, 4)
    colour = colour_to_sh(torch.full((num_layers, 3), 0.5))[:, None]
    scale, ones = torch.full((num_layers, 3), 0.1), torch.ones(num_layers, 1)
    gaussians = Gaussians(place, quat, scale, ones[:, 0], colour)
    semantics = Semantics(torch.zeros(num_layers, 1, dtype=torch.int64), ones, torch.ones(1, 1), "none")
    poses, lenses = torch.eye(4).expand(num_layers, 4, 4), torch.eye(3).expand(num_layers, 3, 3)
    size, record = (SIDE, SIDE), Record(layered=num_layers > 1)
    return Scene(gaussians, semantics, poses, lenses, size, view_ids=torch.arange(num_layers), record=record)
