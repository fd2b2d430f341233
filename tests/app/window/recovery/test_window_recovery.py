"""A window is killed in the middle of work; the next one goes on with it, and ends without a trace."""

import json
import os
import signal
import time
from pathlib import Path

import numpy as np

from tests.app.window.test_window import MIDDLE, PATIENCE, Program, display, pytestmark, scene_file

__all__ = ["display", "pytestmark", "scene_file"]  # fixtures and the mark of the window's tests

COUNT = 12_300  # Gaussians of the room


def kept(folder: Path) -> dict:
    """The session on the disk; empty without one."""
    sessions = list(folder.glob("session-*.json"))
    return json.loads(sessions[0].read_bytes()) if sessions else {}


def wait_for_files(holds, what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, f"waited for {what}"
        time.sleep(0.1)


def test_a_killed_session_comes_back_whole(display: str, scene_file: Path, folders: Path) -> None:
    state = folders / "state"
    running = Program(display, scene_file)
    running.until(lambda s: s["scene"] == "room.langflash", "the scene")
    running.at_rest()
    running.type_prompt("armchair")
    running.until(lambda s: s["mode"] == "heat" and s["recent"] is not None, "the heat-map")
    running.xdotool("mousemove", *map(str, MIDDLE), "sleep", "0.3", "click", "4")  # nearer
    running.xdotool("click", "1", "sleep", "0.3", "key", "ctrl+a")
    running.until(lambda s: s["selected"] == COUNT, "everything selected")
    running.xdotool("key", "Delete")
    before = running.until(lambda s: s["deleted"] == COUNT, "everything deleted")
    wait_for_files(lambda: kept(state).get("edits") and kept(state)["phrases"] == ["armchair"], "the session")
    edits = Path(kept(state)["edits"])
    wait_for_files(lambda: len(json.loads(edits.read_bytes())["done"]) == 2, "both edits")
    wait_for_files(lambda: kept(state)["pose"]["centre"] == before["pose"][:3], "the camera")
    os.kill(running.pid, signal.SIGKILL)
    running.leave()

    again = Program(display)
    again.click("Restore")
    after = again.until(lambda s: s["deleted"] == COUNT and s["job"] is None, "the restored edits")
    after = again.until(lambda s: s["mode"] == "heat" and s["pose"] == before["pose"], "camera and mode")
    assert (after["scene"], after["edits"]) == (before["scene"], before["edits"])
    assert [row[0] for row in after["prompts"]] == ["armchair"] and after["toasts"] == []
    again.until(lambda s: s["prompts"][0][1] is not None, "an answer")
    assert after["offer"] is None  # it has them already
    wait_for_files(lambda: len(list(state.glob("session-*.json"))) == 1, "one session")
    assert len(list(state.glob("*.edits"))) == 1
    again.xdotool("mousemove", *map(str, MIDDLE), "sleep", "0.3", "key", "ctrl+z", "key", "ctrl+z")
    undone = again.until(lambda s: s["edits"] == [] and s["undone"] == 2, "undo over the crash")
    assert not undone["unsaved"]
    again.at_rest()
    assert np.ptp(again.picture()) > 50  # the room is there again
    again.client.ask_to_close(again.window)
    assert again.ended() == 0
    again.leave()
    assert {file.suffix for file in state.iterdir() if file.name.startswith("project-")} == {".json", ".jpg"}
    assert not [file for file in state.iterdir() if not file.name.startswith("project-")]
