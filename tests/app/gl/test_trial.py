"""Which way of drawing is chosen: what was preferred, what the driver can, what a trial said."""

import json
import math
from collections.abc import Generator
from typing import Any, ClassVar

import moderngl
import pytest
import torch

from app.gl.splats import SplatBuffers
from app.gl.tiled import trial
from app.gl.tiled.splats import TiledSplats
from app.gl.tiled.trial import Trial, chosen, file, kept, measuring, trying
from langflash_core.base.graphics import COMPUTE, draws_in_software


class Card:
    """What is asked of a context, of one that is no processor."""

    version_code = COMPUTE
    info: ClassVar = {"GL_RENDERER": "A card", "GL_VERSION": "4.6 of a driver"}


CARD: Any = Card()


def ended(steps: Generator[None, None, Any]) -> Any:
    """What a generator returns."""
    try:
        while True:
            next(steps)
    except StopIteration as end:
        return end.value


def measured(gl) -> Trial:
    return ended(measuring(gl))


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("LANGFLASH_CONFIG", str(tmp_path / "new"))


@pytest.fixture
def says(monkeypatch):
    """`says(trial)`: what a trial finds from now on; a list of those that were made."""
    made: list[Trial] = []

    def told(found: Trial) -> list[Trial]:
        def measuring(_ctx):
            yield
            made.append(found)
            return found

        monkeypatch.setattr(trial, "measuring", measuring)
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
    assert chosen(CARD, "measured") is None
    assert ended(trying(CARD)) == way == chosen(CARD, "measured")
    assert chosen(CARD, "quads") == "quads"
    assert chosen(CARD, "tiles") == "tiles"


def test_what_a_trial_said_is_kept_and_another_driver_tried_anew(says, monkeypatch):
    says(Trial(10.0, 5.0))
    assert ended(trying(CARD)) == "tiles" and kept(CARD) == Trial(10.0, 5.0)
    says(Trial(3.0, math.inf))
    monkeypatch.setattr(Card, "info", {**Card.info, "GL_VERSION": "4.6 of its successor"})
    assert chosen(CARD, "measured") is None
    assert ended(trying(CARD)) == "quads" and kept(CARD) == Trial(3.0, math.inf)
    assert len(json.loads(file().read_bytes())) == 2


def test_a_trial_that_was_left_is_made_anew_and_one_that_took_the_process_along_is_not(says):
    says(Trial(10.0, 5.0))
    steps = trying(CARD)
    next(steps)
    assert chosen(CARD, "measured") == "quads", "what the next start finds, should the driver crash now"
    steps.close()
    assert chosen(CARD, "measured") is None


OWN = '{"A card, 4.6 of a driver": %s}'
HUGE = f'{{"quads_ms": 1{"0" * 400}, "tiles_ms": 1}}'


@pytest.mark.parametrize(
    "content",
    [
        *("", "[]", "{", "[" * 100_000),
        *(OWN % own for own in ('{"quads_ms": 1}', "[1, 2]", "7", HUGE)),
    ],
    ids=lambda content: content[:50],
)
def test_what_is_damaged_is_tried_anew(says, content):
    says(Trial(10.0, 5.0))
    file().parent.mkdir()
    file().write_text(content)
    assert chosen(CARD, "measured") is None
    assert ended(trying(CARD)) == "tiles" == chosen(CARD, "measured")


def test_a_folder_that_cannot_be_written_stops_nothing(says):
    says(Trial(10.0, 5.0))
    file().parent.parent.joinpath("new").write_text("a file")
    assert ended(trying(CARD)) == "tiles"


def test_older_opengl_and_processors_keep_their_quads(gl, says, monkeypatch):
    made = says(Trial(10.0, 5.0))
    if draws_in_software(gl):
        assert chosen(gl, "measured") == "quads" and (chosen(gl, "tiles") == "tiles") == (
            gl.version_code >= COMPUTE
        )
    monkeypatch.setattr(Card, "version_code", COMPUTE - 10)
    for wanted in ("measured", "quads", "tiles"):
        assert chosen(CARD, wanted) == "quads"
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


def test_what_went_wrong_before_is_not_the_tiles(monkeypatch):
    class Flagged:
        error = property(lambda _: flags.pop() if flags else "GL_NO_ERROR")

    def timed(*_):
        yield
        return 1.0, torch.ones(3)

    flags = ["GL_INVALID_ENUM"]
    monkeypatch.setattr(trial, "_timed", timed)
    assert measured(Flagged()).tiles_ms == 1.0


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
