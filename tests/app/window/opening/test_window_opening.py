"""An empty window as a person meets it: its picture is a button, its samples start a room."""

from pathlib import Path

import pytest

from langflash_core.resources import asset_path
from tests.app.window.test_window import TOP, Program, display, pytestmark

__all__ = ["display", "pytestmark"]  # the fixture and the mark of the window's tests

PHOTOS = asset_path("photos/toy_left.png").parent


@pytest.fixture
def home(tmp_path: Path, monkeypatch) -> Path:
    pictures = tmp_path / "Pictures"
    pictures.mkdir()
    for side in ("left", "right"):
        (pictures / f"toy_{side}.png").write_bytes((PHOTOS / f"toy_{side}.png").read_bytes())
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))  # no other test's session is offered
    return pictures


def test_an_empty_window_opens_photos_with_clicks_alone(display: str, home: Path) -> None:
    program = Program(display)
    left, _, right, _ = program.box("welcome")
    program.xdotool("mousemove", str((left + right) // 2), str(TOP + 20), "sleep", "1.5", "click", "1")
    program.until(lambda s: s["dialog"] == "open", "the dialog for files")
    program.click(f"##{home}")  # a folder of the home, where it begins
    program.click(f"##{home / 'toy_left.png'}")
    program.click(f"##{home / 'toy_right.png'}")
    program.click("Open 2 files###open")
    state = program.until(lambda s: s["job"] is not None, "the reconstruction")
    assert state["photos"] == ["toy_left.png", "toy_right.png"] and state["dialog"] is None
    program.xdotool("key", "Escape")
    program.until(lambda s: s["job"] is None, "the end of it")
    program.leave()


def test_a_sample_is_one_click(display: str) -> None:
    program = Program(display)
    program.click("##sample Toy")
    state = program.until(lambda s: s["job"] is not None, "the reconstruction")
    assert state["photos"] == ["toy_left.png", "toy_right.png"]
    program.leave()
