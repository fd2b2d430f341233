from dataclasses import replace

import pytest

from app.gl import SplatRenderer
from app.gl.answers import ShaderAnswers
from app.gl.hardware import hardware_of
from app.gl.processor.host import HostAnswers
from app.gl.splats import SplatBuffers
from app.gl.tiled.splats import TiledSplats
from langflash_core.base.graphics import COMPUTE
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


@pytest.fixture(params=["shader", "host", "tiled"])
def queries(request, gl, monkeypatch):
    """Both places where phrases meet weight maps, and splats drawn tile by tile, whatever this machine would
    choose."""
    answers = HostAnswers if request.param == "host" else ShaderAnswers
    if request.param == "tiled" and gl.version_code < COMPUTE:
        pytest.skip("OpenGL 4.3 is not here")
    splats = TiledSplats if request.param == "tiled" else SplatBuffers
    ways = {"answers": answers, "splats": splats}
    monkeypatch.setattr("app.gl.canvas.hardware_of", lambda ctx: replace(hardware_of(ctx), **ways))
    return request.param
