from dataclasses import replace

import pytest

from app.gl import SplatRenderer
from app.gl.answers import ShaderAnswers
from app.gl.hardware import hardware_of
from app.gl.processor.host import HostAnswers
from langflash_core.language.relevance import CompiledQuery
from langflash_core.types import Scene


@pytest.fixture(params=["float16", "float32"])
def precision(request):
    return request.param


@pytest.fixture
def renderer(gl, precision):
    made = SplatRenderer(gl, precision)
    yield made
    made.release()


@pytest.fixture
def show(gl):
    """`show(scene, precision, asked=..., ...)`: a renderer of its own, given back at the end of the test."""
    made: list[SplatRenderer] = []

    def shown(scene: Scene | None, *given, asked: CompiledQuery | None = None, **how) -> SplatRenderer:
        renderer = SplatRenderer(gl, *given, **how)
        made.append(renderer)
        if scene is not None:
            renderer.set_scene(scene)
        renderer.ask(asked)
        return renderer

    yield shown
    for renderer in made:
        renderer.release()


@pytest.fixture(params=["shader", "host"])
def queries(request, monkeypatch):
    """Both places where phrases meet weight maps, whatever this machine would choose."""
    answers = {"shader": ShaderAnswers, "host": HostAnswers}[request.param]
    monkeypatch.setattr("app.gl.canvas.hardware_of", lambda ctx: replace(hardware_of(ctx), answers=answers))
    return request.param
