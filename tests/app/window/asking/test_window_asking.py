"""Asking as a person does it: two phrases, a threshold dragged, every mode, and fluent typing."""

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.base.pictures import KEYED, PICTURES, Picture
from langflash_core.language.spaces import language_space
from langflash_core.scene.file import save
from tests.app.window import test_window
from tests.app.window.scenes import PHRASES, room
from tests.app.window.test_window import LEFT, PATIENCE, SIZE, Program, change

pytestmark = test_window.pytestmark
display = test_window.display  # a fixture: an X server of this module's own

MENU = tuple(picture for picture in PICTURES if picture not in KEYED)  # in the menu alone
SLOWER = 0.100  # seconds that a frame may take longer while typing


@pytest.fixture(scope="module")
def program(display: str, tmp_path_factory) -> Iterator[Program]:
    """A window with a room whose photos each made a part of it, at rest."""
    scene = room(language_space("minilm").encode(list(PHRASES)))
    half = len(scene.gaussians) // 2
    path = tmp_path_factory.mktemp("asking") / "room.langflash"
    save(replace(scene, view_ids=(torch.arange(len(scene.gaussians)) >= half).long()), path)
    running = Program(display, path)
    running.until(lambda s: s["scene"] == "room.langflash", "the scene")
    running.at_rest()
    yield running
    running.leave()


def click(program: Program, x: int, y: int) -> None:
    program.xdotool("mousemove", str(x), str(y), "sleep", "0.2", "click", "1")


def type_into(program: Program, row: int, text: str, delay: int = 30) -> None:
    """Click a phrase and type, again where a busy machine lost the click or a key."""
    for _ in range(5):
        program.click("##text", row)
        time.sleep(0.3)
        program.xdotool("key", "ctrl+a")
        program.xdotool("type", "--delay", str(delay), text)
        with program._changed:
            if program._changed.wait_for(lambda: program._lines[-1]["prompts"][row][0] == text, PATIENCE / 5):
                return
    raise AssertionError(f"could not type {text!r}; last state {program.state}")


def test_escape_leaves_the_field_and_keeps_what_was_typed(program: Program) -> None:
    type_into(program, 0, "floor")
    program.xdotool("key", "Escape", "sleep", "0.5", "key", "4")  # no letter of the phrase: a mode
    state = program.until(lambda s: s["mode"] == "atoms", "the key of a mode")
    assert state["prompts"][0][0] == "floor"
    program.xdotool("key", "2")
    program.until(lambda s: s["mode"] == "heat", "the heat-map")


def test_two_phrases_are_asked_at_once(program: Program) -> None:
    type_into(program, 0, "armchair")
    program.until(lambda s: s["prompts"][0][2] is True, "the armchair")
    program.click("Add a phrase")
    program.until(lambda s: len(s["items"]["##text"]) == 2, "a second row")
    type_into(program, 1, "floor")
    state = program.until(lambda s: [p[2] for p in s["prompts"]] == [True, True], "both found")
    assert state["mode"] == "heat" and state["recent"][0] == "armchair"
    program.until(lambda s: len(s["binned"]) == 2, "the histograms")


def test_the_threshold_is_dragged_in_the_histogram(program: Program) -> None:
    before = program.at_rest()
    (x, row), (left, _, right, _) = program.item("drag line"), program.box("plot")
    wanted = 0.9
    steps = np.linspace(x, left + wanted * (right - left), 8).round().astype(int)
    moves = [word for step in steps for word in ("mousemove", str(step), str(row), "sleep", "0.1")]
    program.xdotool("mousemove", str(x), str(row), "sleep", "0.3", "mousedown", "1", *moves, "mouseup", "1")
    # The line follows the pointer to within the pixels it was taken and drawn at: 3 / 311.
    state = program.until(lambda s: abs(s["prompts"][1][3] - wanted) < 0.01, "the new threshold")
    assert state["prompts"][0][3] == before["prompts"][0][3]
    assert state["splats"] == before["splats"]  # a threshold costs no splat pass


def test_every_mode_shows_something_of_its_own(program: Program) -> None:
    pictures = {}
    for place, mode in enumerate(KEYED):
        program.xdotool("mousemove", str(LEFT + 200), "300")
        click(program, 30, SIZE[1] - 12)  # away from the text field
        program.xdotool("key", str((place + 1) % 10))
        pictures[mode] = settled(program, mode, list(pictures.values())[-1:])
    for mode in MENU:
        program.click("###menu")
        program.click(f"##{mode.name}")
        pictures[mode] = settled(program, mode, list(pictures.values())[-1:])
    assert set(pictures) == set(PICTURES)
    state = program.state
    assert state["gl_errors"] == [] and state["toasts"] == []
    modes = list(pictures)
    for n, first in enumerate(modes):
        for second in modes[n + 1 :]:
            # The smallest thing that differs is the block's share of the picture, some per cent.
            assert change(pictures[first], pictures[second]) > 0.5, (first, second)


def settled(program: Program, mode: Picture, before: list[np.ndarray]) -> np.ndarray:
    """The picture of a mode once it has replaced the one before and stays."""
    program.until(lambda s: s["mode"] == mode.name, mode.name)
    for picture in before:
        program.until_changed(picture, 0.5)
    seen = None
    while seen is None or change(seen, program.picture()) > 0:
        seen = program.picture()
        time.sleep(0.5)  # longer than any repaint of this small room
    return seen


def test_arrow_up_brings_a_recent_phrase_back(program: Program) -> None:
    recent = program.state["recent"]
    program.click("##text")
    time.sleep(0.3)
    program.xdotool("key", "Up")
    program.until(lambda s: s["prompts"][0][0] == recent[0], "the newest phrase")
    program.xdotool("key", "Up")
    program.until(lambda s: s["prompts"][0][0] == recent[1], "the one before")


def frame_seconds(program: Program, first: int) -> list[float]:
    """Seconds of every frame of the lines from `first` on."""
    with program._changed:
        return [seconds for line in program._lines[first:] for seconds in line["seconds"]]


def test_typing_never_holds_a_frame_up(program: Program) -> None:
    """No frame takes 100 ms longer than an idle one, at rest in the heat-map of the exact maps.

    What other programs take from this machine only adds to a frame, and comes and goes; a frame held
    up by the window itself would be so every time. So the best of five phrases counts.
    """
    click(program, 30, SIZE[1] - 12)
    program.xdotool("key", "2")
    type_into(program, 0, "wall")
    program.at_rest()
    excess = []
    for text in ("armchair with a cushion", "wooden floor", "white wall", "carpet", "door of the room"):
        first = len(program._lines)
        time.sleep(2.5)  # frames of the blinking cursor
        type_into(program, 0, text, delay=120)  # slow enough that words are encoded in between
        program.until(lambda s: s["prompts"][0][1] is not None, "a score")
        seconds = frame_seconds(program, first)
        idle = float(np.median(seconds[:4]))  # before the first key
        excess.append(max(seconds[4:]) - idle)
        if excess[-1] <= SLOWER:
            break
    assert min(excess) <= SLOWER, f"slowest frame over idle: {[round(1000 * e) for e in excess]} ms"
    assert program.state["gl_errors"] == []


def test_a_new_phrase_has_the_caret_and_is_answered_in_any_mode(program: Program) -> None:
    click(program, 30, SIZE[1] - 12)
    program.xdotool("key", "1")
    program.until(lambda s: s["mode"] == "rgb", "the colours")
    rows = len(program.state["prompts"])
    program.click("Add a phrase")
    program.until(lambda s: len(s["prompts"]) == rows + 1, "another row")
    time.sleep(0.5)
    program.xdotool("type", "--delay", "60", "lamp")
    program.until(lambda s: s["prompts"][-1][0] == "lamp", "the phrase in its field")
    program.until(lambda s: s["prompts"][-1][1] is not None and s["mode"] == "rgb", "its score")


def test_a_reading_stands_under_its_phrase_and_a_click_takes_it_away(program: Program) -> None:
    type_into(program, 0, "blue armchair")
    program.until(lambda s: s["prompts"][0][2] is False, "no armchair that looks blue")
    program.click("##whole")
    program.until(lambda s: s["prompts"][0][0] == '"blue armchair"', "the phrase within quotes")
    state = program.until(lambda s: s["prompts"][0][2] is not None, "its answer")
    assert not any(name.endswith("##whole") for name in state["items"])
