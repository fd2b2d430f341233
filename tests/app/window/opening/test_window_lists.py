"""Long lists of files as a person brings them: copied in another program, or dragged."""

import io
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from PIL import Image

from app.window.recovery import preferences
from tests.app.window.test_window import MIDDLE, ROOT, Program, display, pytestmark

__all__ = ["display", "pytestmark"]  # a fixture and the mark of the window's tests

OWNER = """
import glfw, sys
glfw.init()
glfw.window_hint(glfw.VISIBLE, False)
window = glfw.create_window(10, 10, "", None, None)
glfw.set_clipboard_string(None, sys.stdin.read())
print("copied", flush=True)
while True:
    glfw.wait_events()
"""


@pytest.fixture
def program(display: str, folders: Path) -> Iterator[Program]:
    """Photos wait in the tray."""
    preferences.save(replace(preferences.DEFAULTS, start_at_once=False))
    running = Program(display)
    yield running
    running.leave()


def photos(folder: Path, count: int) -> list[Path]:
    folder = folder / "photos of a room, from the hall to the window"
    folder.mkdir()
    stream = io.BytesIO()
    Image.new("RGB", (64, 48), (90, 60, 30)).save(stream, "JPEG")
    paths = [folder / f"2024-05-17 at noon, step {number:04d}.jfif" for number in range(count)]
    for path in paths:
        path.write_bytes(stream.getvalue())
    return paths


@contextmanager
def copied(display: str, text: str) -> Iterator[None]:
    """Another program has it on the clipboard."""
    environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(ROOT)}
    environment.pop("WAYLAND_DISPLAY", None)
    command, pipe = [sys.executable, "-c", OWNER], subprocess.PIPE
    with subprocess.Popen(command, env=environment, stdin=pipe, stdout=pipe, text=True) as owner:
        assert owner.stdin is not None and owner.stdout is not None
        owner.stdin.write(text)
        owner.stdin.close()
        assert owner.stdout.readline() == "copied\n"
        try:
            yield
        finally:
            owner.kill()


@pytest.mark.parametrize("where", ["window", "field"])
def test_three_hundred_addresses_are_pasted(
    program: Program, display: str, tmp_path: Path, where: str
) -> None:
    """On the picture, and into the field for a path of the dialog."""
    paths = photos(tmp_path, 300)
    text = "\r\n".join(path.as_uri() for path in paths)
    assert len(text) > 30_000
    with copied(display, text):
        if where == "field":
            program.xdotool("key", "ctrl+o")
            program.until(lambda s: s["dialog"] == "open", "the dialog for files")
            time.sleep(0.5)
        program.xdotool("key", "ctrl+v")
        state = program.until(lambda s: len(s["photos"]) > 0, "the photos")
    assert state["photos"] == [path.name for path in paths]
    assert state["toasts"] == [] and state["dialog"] is None


def test_a_thousand_files_are_dropped(program: Program, tmp_path: Path) -> None:
    """All come; how many make no scene is said."""
    paths = photos(tmp_path, 1000)
    program.client.drop(program.window, paths, MIDDLE)
    state = program.until(lambda s: len(s["photos"]) > 0, "the photos")
    assert state["photos"] == [path.name for path in paths[:300]]
    assert "700 photos were left out" in state["toasts"][0]


@pytest.mark.skipif(os.name != "posix", reason="names are text there")
def test_a_name_that_is_not_utf_8_does_not_take_the_rest_of_a_drop_with_it(
    program: Program, tmp_path: Path
) -> None:
    good = photos(tmp_path, 3)
    bad = Path(os.fsdecode(bytes(good[0].parent) + b"/caf\xe9.jpg"))
    bad.write_bytes(good[0].read_bytes())
    program.client.drop(program.window, [good[0], bad, *good[1:]], MIDDLE)
    state = program.until(lambda s: len(s["photos"]) > 0, "the photos")
    assert state["photos"] == [path.name for path in good]
    assert len(state["toasts"]) == 1 and "not UTF-8" in state["toasts"][0]
