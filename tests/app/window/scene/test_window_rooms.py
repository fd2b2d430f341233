"""Rooms as a person changes them: dropped, asked about, gone back to."""

import shutil
from pathlib import Path

from PIL import Image

from tests.app.window.test_window import MIDDLE, Program, display, pytestmark, scene_file

__all__ = ["display", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests


def test_edits_outlive_a_drop_of_another_room(display: str, scene_file: Path, folders: Path) -> None:
    other, photo = folders / "kitchen.langflash", folders / "tiny.png"
    shutil.copy(scene_file, other)
    Image.new("RGB", (40, 30), (90, 60, 30)).save(photo)
    running = Program(display, scene_file)
    running.until(lambda s: s["scene"] == "room.langflash", "the scene")
    running.at_rest()
    running.xdotool("mousemove", *map(str, MIDDLE), "key", "ctrl+a", "key", "Delete")
    running.until(lambda s: s["deleted"] == 12_300, "everything deleted")
    running.client.drop(running.window, [other], MIDDLE)
    running.click("Open it")
    running.until(lambda s: s["dialog"] == "unsaved", "the question about edits")
    running.click("Cancel")
    state = running.until(lambda s: s["dialog"] is None, "no change")
    assert (state["scene"], state["deleted"]) == ("room.langflash", 12_300)
    running.client.drop(running.window, [other], MIDDLE)
    running.click("Open it")
    running.click("Discard")
    running.until(lambda s: s["scene"] == "kitchen.langflash" and s["deleted"] == 0, "the kitchen")
    running.client.drop(running.window, [photo], MIDDLE)
    running.until(lambda s: s["dialog"] == "drop", "the question")
    running.click("New room")
    # Too small a photo for a room: the tray is again that of the kitchen, which came without photos.
    state = running.until(lambda s: s["toasts"] and s["job"] is None, "the end of the job")
    assert state["scene"] == "kitchen.langflash" and state["photos"] == []
    running.click("###back")
    state = running.until(lambda s: s["scene"] == "room.langflash", "the room before")
    assert state["deleted"] == 12_300 and state["photos"] == []
    running.xdotool("mousemove", *map(str, MIDDLE), "key", "ctrl+z", "key", "ctrl+z")
    state = running.until(lambda s: s["deleted"] == 0 and s["undone"] == 2, "undo of what was done before")
    assert state["gl_errors"] == [] and not state["unsaved"]
    running.leave()
