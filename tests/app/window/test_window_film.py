"""A film dropped on the window, on a real screen: its strip, a scene of it; and a stop in between."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.window.dialogs import Dialog
from tests import films
from tests.app.window import test_window
from tests.app.window.test_window import MIDDLE, Program, x_server

pytestmark = test_window.pytestmark
SIZE = (1000, 700)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("films")


@pytest.fixture(scope="module")
def program(folder: Path) -> Iterator[Program]:
    patch = pytest.MonkeyPatch()
    patch.setenv("LANGFLASH_HOME", str(folder / "home"))
    with x_server(*SIZE) as display:
        running = Program(display, size=SIZE)
        yield running
        running.leave()
    patch.undo()


def drop(program: Program, path: Path) -> None:
    program.client.drop(program.window, [path], MIDDLE)


def test_looking_through_a_film_can_be_stopped(program: Program, folder: Path) -> None:
    long = films.write(folder / "long.mp4", [films.seen(4.0 * (i % 300)) for i in range(1500)])
    drop(program, long)
    program.until(lambda s: s["job"] == "film", "the film to be looked through")
    program.xdotool("key", "Escape")
    program.until(lambda s: s["job"] is None and "Stopped." in s["toasts"], "the end of it")
    assert program.state["dialog"] is None and program.state["photos"] == []


def test_a_film_becomes_a_scene(program: Program, folder: Path) -> None:
    walk = films.write(folder / "walk.mp4", films.walk(6, 10.0))
    drop(program, walk)
    program.until(lambda s: s["dialog"] == "film", Dialog.FILM.value)
    program.until(lambda s: any(name.endswith("Reconstruct") for name in s["items"]), "the strip")
    picture = program.client.picture(*SIZE)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500, "frames are seen"
    count = sum(name.startswith("##") and name[2:].isdigit() for name in program.state["items"])
    assert 3 <= count <= 10, "a card for each still"
    program.click("Reconstruct")
    program.until(lambda s: s["job"] is not None, "the job")
    seen = program.until(lambda s: s["scene"] is not None and s["job"] is None, "the scene")
    assert 3 <= len(seen["photos"]) <= 6 and all(name.startswith("walk.mp4 @ ") for name in seen["photos"])
    assert seen["gl_errors"] == []
