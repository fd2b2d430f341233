import pytest

from app.gl import SplatRenderer


@pytest.fixture(params=["float16", "float32"])
def renderer(gl, request):
    made = SplatRenderer(gl, request.param)
    yield made
    made.release()


@pytest.fixture(params=["shader", "host"])
def queries(request, monkeypatch):
    """Both places where phrases meet weight maps, whatever this machine would choose."""
    monkeypatch.setattr("app.gl.renderer.draws_in_software", lambda ctx: request.param == "host")
    return request.param
