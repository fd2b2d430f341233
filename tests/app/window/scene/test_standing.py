"""The window stands upright: orbits, sides, axes and grid know up and floor of a scene that was levelled."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.window.commands import Tick
from app.window.editing import commands as edit
from app.window.editing import pointing as point
from app.window.kit.lengths import said
from app.window.scene import camera
from app.window.scene.commands import SceneArrived
from app.window.scene.near import orbited
from app.window.scene.panels import axes, floor
from app.window.scene.standing import Levelled, LevelScene
from app.window.scene.state import FLIGHT_SECONDS
from app.window.scene.work import FindWorld, WriteScene, describe_scene
from app.window.state import State
from langflash_core.base.records import Guess, World
from langflash_core.geometry import poses, rotations
from langflash_core.geometry.poses import Vector
from langflash_core.geometry.rotations import turn_of
from langflash_core.level import found_world
from langflash_core.scene.file import load
from tests.app.window.scenes import after, shown_scene, told

LEAN = 20.0  # degrees by which the first photo looks down
STANDS = World(
    rotations.quaternion(rotations.about(np.array([1.0, 0.0, 0.0]), math.radians(LEAN))),
    (0.0, 0.5, 0.2), "edges", 0.5, "floor", "walls", Guess(2.0, 1.6, 2.5, ("door",)),
)  # fmt: skip
RIGHT = 1e-9


@pytest.fixture
def shown() -> State:
    return replace(shown_scene(), preferences=replace(State().preferences, near_photos=False))


@pytest.fixture
def level(shown: State) -> State:
    return landed(after(shown, Levelled(STANDS)))


def landed(state: State) -> State:
    return after(state, Tick(state.now + FLIGHT_SECONDS + 1))


def leaning(state: State) -> float:
    """Degrees of the picture's right side from level."""
    return abs(math.degrees(math.asin(state.scene.pose.axes[:, 0] @ -turn_of(STANDS)[1])))


def test_levelling_is_an_edit_that_is_saved_and_undone(shown: State, tmp_path: Path) -> None:
    looking = after(shown, LevelScene())
    assert told(looking).startswith("Finding the floor")
    (answer,) = after(
        looking, Levelled(STANDS)
    ).toasts  # the question stayed beside it, as if it were still open
    assert answer.text.startswith("Levelled")
    state = after(shown, Levelled(STANDS))
    assert state.world == STANDS and state.editing.unsaved and told(state).startswith("Levelled by edges")
    assert "scale guessed from door" in told(state)
    assert after(state, edit.Undo()).world is None and after(state, edit.Undo(), edit.Redo()).world == STANDS
    assert state.scene.info is not None
    list(WriteScene(state.scene.info.scene, tmp_path / "s.langflash", state.editing.marks).run(never))
    opened = load(tmp_path / "s.langflash")
    assert opened.record.world == STANDS
    again = after(State(), SceneArrived(describe_scene(opened, 2, "s")))
    assert again.world == STANDS and not again.editing.unsaved
    assert told(after(state, Levelled(STANDS))).startswith("The scene is level already")
    measured = after(state.with_editing(ruler=((0.0, 0.0, 1.0), (0.3, 0.0, 1.0))), point.SetLength(0.6))
    assert "guess" not in told(after(measured, Levelled(STANDS))), "what was told is no guess any more"
    leans = replace(STANDS, up_by="surfaces", up_error=6.0)
    assert "do not clearly show" in told(after(shown, Levelled(leans)))


def test_the_worker_finds_what_the_library_finds(shown: State) -> None:
    info, marks = shown.scene.info, shown.editing.marks
    assert info is not None and marks is not None
    [found] = FindWorld(info.serial, info.memory, marks).run(never)
    assert found == Levelled(found_world(info.scene))


def test_orbits_keep_the_scenes_own_up(level: State) -> None:
    """With the first camera's up, a quarter of a turn tipped the room by all that the photo looked down."""
    turned = after(level, camera.Orbit(yaw=math.pi / 2))
    assert leaning(turned) < 0.1
    before = after(shown_scene(), camera.Orbit(yaw=math.pi / 2))
    assert leaning(before) > LEAN - 5


def test_a_photo_held_aslant_comes_upright_where_one_turns(level: State) -> None:
    aslant = replace(
        level.scene.pose, rotation=poses._rotation(rotations.about(level.scene.pose.axes[:, 2], 0.2))
    )
    rolls = [poses.roll(aslant, level.up)]
    pose = aslant
    for _ in range(10):
        pose, _ = orbited(level, pose, math.radians(3), 0.0)
        rolls.append(poses.roll(pose, level.up))
    assert abs(rolls[1]) > 0.5 * abs(rolls[0]) and abs(rolls[-1]) < 0.15 * abs(rolls[0])


def test_it_opens_upright_where_the_first_photo_was_held_aslant(level: State) -> None:
    info = level.scene.info
    assert info is not None
    rolled = replace(info.views[0], rotation=poses.Rotation(*rotations.quaternion(
        rotations.about(np.array([0.0, 0.0, 1.0]), math.radians(8))
    )))  # fmt: skip
    other = replace(info, serial=9, views=(rolled, *info.views[1:]), history=level.editing.history)
    state = after(State(), SceneArrived(other))
    assert abs(poses.roll(state.scene.pose, state.up)) < RIGHT and state.scene.view is None
    straight = after(State(), SceneArrived(replace(other, views=info.views)))
    assert straight.scene.view == 0 and straight.scene.pose == info.views[0]
    none = after(State(), SceneArrived(replace(other, views=())))
    assert abs(poses.roll(none.scene.pose, none.up)) < RIGHT


@pytest.mark.parametrize(("side", "forward"), camera.SIDES)
def test_sides_are_those_of_the_room(level: State, side: str, forward: Vector) -> None:
    state = landed(after(level, camera.Face(forward)))
    seen = turn_of(STANDS) @ state.scene.pose.axes  # columns right, down, ahead; east, down, north
    np.testing.assert_allclose(seen[:, 2], np.array(forward), atol=1e-6)
    assert np.isclose(np.abs(seen), 1, atol=1e-6).sum() == 3, "a plan stands along the walls"
    nearest = min(axes.ends(state), key=lambda end: end[3])
    assert nearest[0] == side, "the end that one looks from is nearest"


def test_the_grid_lies_on_the_floor_a_metre_a_square(level: State) -> None:
    assert floor.lines(shown_scene()) == []
    for line in floor.lines(level):
        stands = (line - STANDS.origin) @ turn_of(STANDS).T
        assert np.abs(stands[:, 1]).max() < 1e-9
        metres = stands[:, [0, 2]] * 2.0
        on_line = np.isclose(metres, np.round(metres)).all(0)
        assert on_line.any()
    wide = replace(level.scene.info, extent=(Vector(-900, -1, -900), Vector(900, 1, 900)))  # type: ignore[type-var]
    assert len(floor.lines(level.with_scene(info=wide))) < 4 * floor.MOST


def test_lengths_are_said_to_be_a_guess_until_one_is_told(level: State) -> None:
    assert level.guess == STANDS.guess and said(0.7, level.metric, level.guess) == "about 1.4 m"
    assert said(0.2, None, level.guess) == "about 40 cm" and said(0.2, None) == "0.200 units"
    marks = level.editing.marks
    assert marks is not None
    known = edit.with_edit(level, "Set the scale", replace(marks, metric_scale=2.5))
    assert known.guess is None and said(0.8, known.metric, known.guess) == "2.00 m"


def never() -> bool:
    return False
