"""An empty window as a person meets it: its picture is a button, its samples start a room."""

from pathlib import Path

import numpy as np
import pytest

from app.window.recovery import preferences, records, tiles
from app.window.recovery.preferences import DEFAULTS
from app.window.recovery.state import Kept
from langflash_core.base.resources import asset_path
from langflash_core.geometry.poses import Pose, Vector
from tests.app.window.test_window import SIZE, TOP, Program, display, pytestmark, scene_file

__all__ = ["display", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests

PHOTOS = asset_path("photos/toy_left.png").parent


@pytest.fixture
def home(tmp_path: Path, monkeypatch) -> Path:
    pictures = tmp_path / "Pictures"
    pictures.mkdir()
    for side in ("left", "right"):
        (pictures / f"toy_{side}.png").write_bytes((PHOTOS / f"toy_{side}.png").read_bytes())
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))  # no other test's session is offered
    monkeypatch.setenv("LANGFLASH_CONFIG", str(tmp_path / "config"))  # nor begun where another one opened
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


def test_a_scene_that_was_open_lately_is_a_tile_that_opens_as_it_was_left(
    display: str, scene_file: Path, tmp_path: Path, monkeypatch
) -> None:
    """By keys alone; its picture is the one that was kept."""
    monkeypatch.setenv("LANGFLASH_CONFIG", str(tmp_path / "config"))
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))
    preferences.save(DEFAULTS.opened(scene_file))
    pose = Pose(Vector(0.1, 0.0, 0.0))
    left = Kept(scene=str(scene_file), phrases=("wall",), likes=("",), mode="depth", pose=pose, views=2)
    records.keep_project(left)
    pink = np.full((180, 270, 3), (255, 0, 160), np.uint8)
    tiles.keep_picture(str(scene_file), pink, tiles.stamp(scene_file))
    program = Program(display)
    left, top, right, bottom = program.box(f"##project {scene_file}")
    program.until(lambda s: program.client.picture(*SIZE)[(top + bottom) // 2, left + 20, 1] < 20, "the tile")
    shown = program.client.picture(*SIZE)[top + 10 : bottom - 10, left + 10 : right - 10].astype(int)
    assert abs(shown - (255, 0, 160)).max() < 12  # JPEG
    program.xdotool("key", "F6", "key", "F6", "key", "F6", "sleep", "0.5", "key", "Down", "sleep", "0.5")
    program.xdotool("key", "Return")
    state = program.until(lambda s: s["prompts"][0][1] is not None, "its phrase, answered")
    assert (state["scene"], state["prompts"][0][0], state["mode"]) == ("room.langflash", "wall", "depth")
    assert state["pose"][0] == pytest.approx(0.1) and state["toasts"] == []
    program.leave()
