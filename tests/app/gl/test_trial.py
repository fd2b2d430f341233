"""Which way of drawing is chosen: what was preferred, what the driver can, what a trial said."""

import json
import math
from typing import ClassVar

import moderngl
import pytest

from app.gl.splats import SplatBuffers
from app.gl.tiled import trial
from app.gl.tiled.splats import TiledSplats
from app.gl.tiled.trial import Trial, chosen, file, measured, tried
from langflash_core.base.graphics import COMPUTE, draws_in_software


class Card:
    """What is asked of a context, of one that is no processor."""

    version_code = COMPUTE
    info: ClassVar = {"GL_RENDERER": "A card", "GL_VERSION": "4.6 of a driver"}


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("LANGFLASH_CONFIG", str(tmp_path / "new"))


@pytest.fixture
def says(monkeypatch):
    """`says(trial)`: what a trial finds from now on; a list of those that were made."""
    made: list[Trial] = []

    def told(found: Trial) -> list[Trial]:
        monkeypatch.setattr(trial, "measured", lambda ctx: made.append(found) or found)
        return made

    return told


@pytest.mark.parametrize(
    ("quads", "tiles", "way"),
    [
        (10.0, 5.0, "tiles"),
        (10.0, 9.5, "quads"),
        (5.0, 10.0, "quads"),
        (10.0, math.inf, "quads"),
        (math.inf, math.inf, "quads"),
    ],
)
def test_a_card_draws_the_way_that_is_clearly_quicker(says, quads, tiles, way):
    says(Trial(quads, tiles))
    assert chosen(Card(), "measured") == way  # pyright: ignore[reportArgumentType]
    assert chosen(Card(), "quads") == "quads"  # pyright: ignore[reportArgumentType]
    assert chosen(Card(), "tiles") == "tiles"  # pyright: ignore[reportArgumentType]


def test_a_card_is_tried_once_and_another_driver_anew(says, monkeypatch):
    made = says(Trial(10.0, 5.0))
    for _ in range(2):
        assert tried(Card()) == Trial(10.0, 5.0)  # pyright: ignore[reportArgumentType]
    assert len(made) == 1
    says(Trial(3.0, math.inf))
    monkeypatch.setattr(Card, "info", {**Card.info, "GL_VERSION": "4.6 of its successor"})
    for _ in range(2):
        assert tried(Card()) == Trial(3.0, math.inf)  # pyright: ignore[reportArgumentType]
    assert len(made) == 2 and len(json.loads(file().read_bytes())) == 2


@pytest.mark.parametrize("content", ["", "[]", '{"A card, 4.6 of a driver": {"quads_ms": 1}}', "{"])
def test_what_is_damaged_is_tried_anew(says, content):
    made = says(Trial(10.0, 5.0))
    file().parent.mkdir()
    file().write_text(content)
    for _ in range(2):
        assert tried(Card()) == Trial(10.0, 5.0)  # pyright: ignore[reportArgumentType]
    assert len(made) == 1


def test_a_folder_that_cannot_be_written_stops_nothing(says):
    says(Trial(10.0, 5.0))
    file().parent.parent.joinpath("new").write_text("a file")
    assert chosen(Card(), "measured") == "tiles"  # pyright: ignore[reportArgumentType]


def test_older_opengl_and_processors_keep_their_quads(gl, says, monkeypatch):
    made = says(Trial(10.0, 5.0))
    if draws_in_software(gl):
        assert chosen(gl, "measured") == "quads" and (chosen(gl, "tiles") == "tiles") == (
            gl.version_code >= COMPUTE
        )
    monkeypatch.setattr(Card, "version_code", COMPUTE - 10)
    for wanted in trial.WAYS:
        assert chosen(Card(), wanted) == "quads"  # pyright: ignore[reportArgumentType]
    assert not made and not file().exists()


@pytest.fixture
def small(gl, monkeypatch):
    if gl.version_code < COMPUTE:
        pytest.skip("OpenGL 4.3 is not here")
    for name, value in {"_GAUSSIANS": 3000, "_SIZE": (64, 48), "_FRAMES": 1}.items():
        monkeypatch.setattr(trial, name, value)


@pytest.mark.usefixtures("small")
def test_both_ways_are_drawn_and_timed(gl):
    found = measured(gl)
    assert 0 < found.quads_ms < math.inf and 0 < found.tiles_ms < math.inf


class Refused(TiledSplats):
    def project(self, camera):
        raise moderngl.Error("this driver compiles nothing")


class Dark(TiledSplats):
    def _fill(self, *given):
        pass


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("broken", [Refused, Dark])
def test_tiles_that_are_refused_or_show_something_else_are_not_taken(gl, monkeypatch, broken):
    monkeypatch.setattr(trial, "TiledSplats", broken)
    assert measured(gl).tiles_ms == math.inf
    monkeypatch.setattr(trial, "TiledSplats", SplatBuffers)
    assert measured(gl).tiles_ms < math.inf


@pytest.mark.usefixtures("small")
def test_a_driver_that_refuses_the_trial_stops_no_window(gl, monkeypatch):
    for name in ("SplatBuffers", "TiledSplats"):
        monkeypatch.setattr(trial, name, Refused)
    assert measured(gl).sooner == "quads"
