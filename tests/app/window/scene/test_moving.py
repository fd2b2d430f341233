"""Hands on the picture: what a drag turns around, where it is held back, what walks into no wall."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from imgui_bundle import ImVec2, imgui

from app.window.commands import Command, Tick, apply
from app.window.editing.state import Reading
from app.window.effects import Hands
from app.window.frame import canvas
from app.window.scene import camera, near
from app.window.scene.commands import SceneArrived
from app.window.scene.effects import SceneEffects
from app.window.scene.panels import moving
from app.window.scene.state import FLIGHT_SECONDS, INSISTING, Hold
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.base.records import World
from langflash_core.geometry import poses, rotations
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History
from langflash_core.scene.mask import Mask
from langflash_core.scene.surroundings import Surroundings
from langflash_core.types import Scene
from tests.app.window import headless
from tests.app.window.scenes import after, room, with_info

SIZE = (1280, 800)
EXACT = 1e-9
WALL, SPACING = 2.0, 0.1
# Of what is kept clear: between samples a wall is 2 % nearer than they are, and of 60 steps, of two parts,
# each part may err by a thousandth.
ROOM = 0.85
STEP = math.radians(3.0)  # 10 pixels of an orbit


@pytest.fixture(scope="module")
def scene() -> Scene:
    made = room(torch.eye(3))
    return replace(made, view_ids=torch.zeros(len(made.gaussians), dtype=torch.int64))


@pytest.fixture
def state(scene: Scene) -> State:
    """At the first photo's place of a room."""
    return after(State(), SceneArrived(describe_scene(scene, 1, "room")))


@pytest.fixture
def away(state: State) -> State:
    """In the room, not where a photo was taken."""
    return state.with_scene(pose=poses.fly(state.scene.pose, 0.0, 0.0, 0.1), view=None)


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Surroundings:
    """All there is around: a wall at `WALL` ahead, which photos on all of the way there saw."""
    steps = np.arange(-8, 8, SPACING) + SPACING / 2
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps))
    places = np.stack((x, y, np.full(len(x), WALL)), 1)
    eyes = places - (0.0, 0.0, 1.0)
    rows = np.arange(len(x))
    made = Surroundings(places, eyes, np.full(len(x), 2 * SPACING), rows, 0 * rows, WALL)
    monkeypatch.setattr(near, "surroundings", lambda state: made)
    return made


# What a drag turns around


def test_a_drag_looks_around_where_a_photo_was_taken_and_orbits_elsewhere(state: State, away: State) -> None:
    assert state.scene.info is not None
    for view in state.scene.info.views:
        assert near.at_photo(state.with_scene(pose=poses.look(view, 0.3, 0.1)))
    held = after(state, camera.TakeHold((5.0, 5.0))).scene.hold
    assert held is not None and held.looks
    orbits = after(state, camera.TakeHold((5.0, 5.0), orbits=True))
    for other in (orbits, after(away, camera.TakeHold((5.0, 5.0)))):
        assert other.scene.hold is not None and not other.scene.hold.looks
    flat = state.with_scene(pose=poses.orthographic(state.scene.pose, *(state.scene.info.extent or ())))
    assert not near.at_photo(flat)


def test_the_pivot_is_what_lies_under_the_hand_or_the_middle_of_what_is_near(away: State) -> None:
    found: list[Command] = []
    places = {(640.0, 400.0): (0.1, 0.2, 1.5), (3.0, 3.0): None}
    viewport = SimpleNamespace(read=lambda at: (Reading(at, places[at]), None))
    hands = Hands(found.append, found.append, lambda work: None, lambda: None, lambda: 0.0)
    effects = SceneEffects(hands, viewport, SimpleNamespace(), lambda title: None)  # pyright: ignore[reportArgumentType]
    pressed = after(away, camera.TakeHold((640.0, 400.0)))
    effects.follow(camera.TakeHold((640.0, 400.0)), away, pressed)
    effects.follow(camera.TakeHold((3.0, 3.0)), away, pressed)
    assert found == [camera.HoldPlace(Vector(0.1, 0.2, 1.5))]
    hold = after(pressed, *found).scene.hold
    assert hold is not None and hold.pivot == (0.1, 0.2, 1.5)
    nothing, around, pose = pressed.scene.hold, near.surroundings(away), away.scene.pose
    assert nothing is not None and nothing.pivot is not None and around is not None
    way = pose.axes.T @ (np.array(nothing.pivot) - pose.centre)
    depth = around.middle(pose)
    assert depth is not None
    np.testing.assert_allclose(way, (0, 0, depth), atol=EXACT)
    assert after(away, camera.HoldPlace(Vector(0.0, 0.0, 1.0))) == away, "no hand is there"
    assert after(pressed, camera.LetGo()).scene.hold is None


# What holds it back


@pytest.mark.parametrize(("right", "down"), [(0, 0), (1, 0), (-1, 0), (0, 1), (0.3, -0.3)])
def test_no_walk_enters_a_surface_and_along_it_one_slides(
    state: State, wall: Surroundings, right: float, down: float
) -> None:
    """A step a frame, for as long as it goes."""
    pose = state.scene.pose
    for _ in range(60):
        pose, _ = near.flown(state, pose, 0.1 * right, 0.1 * down, 0.1, near.UNHURRIED)
        assert WALL - pose.centre.z > ROOM * wall.clear
    assert WALL - pose.centre.z < 1.5 * wall.clear, "it goes there"
    slid = near.flown(state, pose, 0.1, 0.0, 0.1)[0]
    assert slid.centre.x - pose.centre.x > 0.07, "along the wall it goes on"
    back = near.flown(state, pose, 0.0, 0.0, -0.1)[0]
    assert back.centre.z == pytest.approx(pose.centre.z - 0.1), "and back"


def test_who_is_too_near_may_go_away(state: State, wall: Surroundings) -> None:
    close = replace(state.scene.pose, centre=Vector(0.0, 0.0, WALL - 0.3 * wall.clear))
    assert near.flown(state, close, 0.0, 0.0, -0.05)[0].centre.z == pytest.approx(close.centre.z - 0.05)
    assert near.flown(state, close, 0.0, 0.0, 0.05)[0].centre.z < close.centre.z + 0.01


def test_no_orbit_or_wheel_leads_through_a_wall(state: State, wall: Surroundings) -> None:
    """Around something beside it, as far from it as a picture away."""
    beside = Pose(Vector(0.0, 0.0, 1.0), reach=1.0)
    pivot, passed = Vector(-1.0, 0.0, 1.4), False
    for yaw, pitch in ((STEP, 0.0), (-STEP, 0.0), (0.0, STEP), (0.0, -STEP)):
        turned = free = beside
        for _ in range(60):
            turned, _ = near.orbited(state, turned, yaw, pitch, pivot, least=1.0)
            assert WALL - turned.centre.z > ROOM * wall.clear
            free = poses.orbit(free, yaw, pitch, pivot=np.array(pivot))
            passed = passed or free.centre.z > WALL
    assert passed, "an orbit that nobody holds does"
    pose = replace(beside, reach=2 * WALL)
    for _ in range(100):
        pose = near.zoomed(state, pose, 0.8)
    assert wall.clear * ROOM < WALL - pose.centre.z < 1.5 * wall.clear


def test_a_drag_into_black_slows_down_stops_and_goes_on_for_a_hand_that_insists(state: State) -> None:
    around = near.surroundings(state)
    assert around is not None
    pose, shares, known = state.scene.pose, list[float](), list[float]()
    for _ in range(60):
        pose, share = near.looked(state, pose, STEP, 0.0)
        shares.append(share)
        known.append(around.known(pose))
    assert shares[0] > near.ENOUGH and shares[-1] == 0 and any(0 < share < near.ENOUGH for share in shares)
    # It stops on the part after which less would be known; a turn of three degrees changes it by up to 7 %.
    assert known[-1] > near.LEAST - 0.08
    back, share = near.looked(state, pose, -2 * STEP, 0.0)
    assert share == 1 and around.known(back) > known[-1], "the way back is free"
    on, share = near.looked(state, pose, STEP, 0.0, least=1.0)
    assert share == 1 and around.known(on) < known[-1]
    slow, share = near.looked(state, pose, STEP, 0.0, near.UNHURRIED)
    assert share == pytest.approx(near.UNHURRIED), "keys and wheel go on, slowly"
    assert poses.look(pose, near.UNHURRIED * STEP, 0.0).rotation == pytest.approx(slow.rotation)


def test_beside_an_upright_photo_one_looks_around_as_far_as_the_window_goes_on_showing_it(
    state: State, wall: Surroundings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a wide window half of the picture is black from the start; what was seen moves aside, and is not
    lost before it comes to the window's edge."""
    upright = Pose(reach=WALL, fov=60.0, aspect=0.4)
    seen = np.abs(wall.places[:, 0]) < WALL * math.tan(math.radians(30)) * upright.aspect
    narrow = wall.of(seen)
    monkeypatch.setattr(near, "surroundings", lambda state: narrow)
    there = with_info(state, views=(upright,))
    wide = poses.of_picture(upright, *SIZE)
    assert narrow.known(wide) < 0.6
    turned, shares = wide, list[float]()
    for _ in range(20):
        turned, share = near.looked(there, turned, STEP, 0.0)
        shares.append(share)
    assert sum(shares[:4]) > 3.9 and shares[-1] == 0
    boxed = near.looked(there, upright, 4 * STEP, 0.0)[1]
    assert boxed < 0.7, "in its own box it would have stopped"


def test_a_quick_drag_ends_where_a_slow_one_does(state: State) -> None:
    slow = state.scene.pose
    for _ in range(20):
        slow, _ = near.orbited(state, slow, STEP, 0.0)
    quick, _ = near.orbited(state, state.scene.pose, 20 * STEP, 0.0)
    # Parts are alike, but each of them stops on the last part before too little is known.
    assert math.dist(quick.centre, slow.centre) < 2 * near.TURN_PART * slow.reach


def test_a_drag_insists_once_it_went_in_vain_for_long_enough(state: State) -> None:
    pressed = after(state, camera.TakeHold((5.0, 5.0)))
    pulled = after(pressed, camera.Pull(state.scene.pose, INSISTING), camera.Pull(state.scene.pose, 1.0))
    assert pressed.scene.hold is not None and not pressed.scene.hold.insists
    assert pulled.scene.hold is not None and pulled.scene.hold.insists
    again = after(pulled, camera.LetGo(), camera.TakeHold((5.0, 5.0)))
    assert again.scene.hold is not None and not again.scene.hold.insists


def test_nothing_holds_who_does_not_want_it_and_no_wall_that_is_deleted(state: State) -> None:
    free = replace(state, preferences=replace(state.preferences, near_photos=False))
    on = lambda at: near.flown(at, at.scene.pose, 0.0, 0.0, 9.0)[0]  # noqa: E731
    assert near.surroundings(free) is None and on(free).centre[2] == pytest.approx(9.0)
    assert on(state).centre[2] < 3
    assert state.scene.info is not None
    marks = first_marks(state.scene.info.scene)
    gone = replace(marks, deleted=Mask.full(marks.deleted.count))
    assert on(state.with_editing(history=History(gone))).centre[2] == pytest.approx(9.0)


def test_a_walk_is_slower_where_something_is_near(state: State, wall: Surroundings) -> None:
    far = Pose(Vector(0.0, 0.0, 0.0), reach=WALL)
    close = replace(far, centre=Vector(0.0, 0.0, WALL - 1.1 * wall.clear))
    assert moving.speed(state, far) == pytest.approx(moving.SPEED * WALL)
    assert 0 < moving.speed(state, close) < 0.6 * moving.speed(state, far)


# The hand itself


@pytest.fixture
def drag(state: State) -> Iterator[Callable[..., State]]:
    """Drags on a picture of `SIZE` from its middle, ten pixels a frame, and gives the state after it."""

    def frame(state: State) -> State:
        imgui.new_frame()
        imgui.set_next_window_pos(ImVec2(0, 0))
        imgui.set_next_window_size(ImVec2(*SIZE))
        imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
        imgui.begin("##picture", None, imgui.WindowFlags_.no_decoration)
        look = replace(headless.look(), picture=SimpleNamespace(glo=1))  # pyright: ignore[reportArgumentType]
        issued = canvas.draw(state, look)
        imgui.end()
        imgui.pop_style_var()
        imgui.end_frame()
        for command in issued:
            state = apply(state, command)
        return state

    def dragged(state: State, across: int, along: int, button: int = 0) -> State:
        io, steps = imgui.get_io(), max(abs(across), abs(along)) // 10
        io.add_mouse_pos_event(SIZE[0] / 2, SIZE[1] / 2)
        state = frame(frame(state))
        io.add_mouse_button_event(button, True)
        state = frame(state)
        for step in range(1, steps + 1):
            io.add_mouse_pos_event(SIZE[0] / 2 + across * step / steps, SIZE[1] / 2 + along * step / steps)
            state = frame(state)
        io.add_mouse_button_event(button, False)
        return frame(frame(state))

    with headless.context(SIZE):
        yield dragged


def test_at_a_photos_place_the_picture_follows_the_hand(state: State, drag: Callable[..., State]) -> None:
    before = state.scene.pose
    ahead = np.array([before.centre + 2.0 * before.axes[:, 2]])
    for across, along in ((-60, 0), (60, 0), (0, 40)):
        after_it = drag(state, across, along)
        assert after_it.scene.pose.centre == before.centre and after_it.scene.hold is None
        found = poses.project(ahead, after_it.scene.pose, SIZE)
        assert found is not None
        # tan x differs from x by x^3 / 3: less than a pixel of 60; a tenth may be held back.
        way = found[1][0] - poses.project(ahead, before, SIZE)[1][0]  # pyright: ignore[reportOptionalSubscript]
        np.testing.assert_allclose(way, (across, along), atol=6.0)


def test_elsewhere_it_orbits_and_with_alt_everywhere(
    state: State, away: State, drag: Callable[..., State]
) -> None:
    turned = drag(away, 30, 0).scene.pose
    assert math.dist(turned.centre, away.scene.pose.centre) > 0.02
    pivot = near.middle_of_near(away)
    assert pivot is not None
    at = [poses.project(np.array([pivot]), pose, SIZE) for pose in (away.scene.pose, turned)]
    np.testing.assert_allclose(at[0][1], at[1][1], atol=1e-6)  # pyright: ignore[reportOptionalSubscript]
    imgui.get_io().add_key_event(imgui.Key.mod_alt, True)
    around = drag(state, 30, 0).scene.pose
    imgui.get_io().add_key_event(imgui.Key.mod_alt, False)
    assert math.dist(around.centre, state.scene.pose.centre) > 0.02


def test_around_a_pivot_a_hand_turns_no_faster_than_on_the_spot(
    state: State, away: State, drag: Callable[..., State]
) -> None:
    """Sixty pixels went 18 degrees around, beside all that photos saw, where they look 3 on the spot."""

    def turned(before: State, across: int) -> float:
        found = drag(before, across, 0).scene.pose
        return math.acos((float(np.trace(before.scene.pose.axes.T @ found.axes)) - 1) / 2)

    pixel = 1 / poses.intrinsics(away.scene.pose, *SIZE)[0, 0]
    # Between two photos little is held back; the first of the frames moves nothing.
    assert 0.8 * 60 * pixel < turned(away, 60) < 60 * pixel * (1 + EXACT)
    alone = with_info(away, views=())
    free = replace(alone, preferences=replace(alone.preferences, near_photos=False))
    assert turned(free, 60) == pytest.approx(60 * moving.TURN), "a thing without photos is turned at once"


def test_a_drag_that_goes_on_gets_into_the_dark(state: State, drag: Callable[..., State]) -> None:
    around = near.surroundings(state)
    assert around is not None
    short, long = (drag(state, -width, 0, button=1).scene.pose for width in (200, 1500))
    assert around.known(short) > near.LEAST - 0.08 and around.known(long) < 0.3


# The way home


def test_home_is_upright_and_so_is_the_way(state: State) -> None:
    turn = rotations.about(np.array([0.0, 0.0, 1.0]), math.radians(8))
    stands = World(rotations.quaternion(turn), (0.0, 0.0, 0.0), "edges", 0.5, "floor", "walls")
    assert state.editing.history is not None
    marks = replace(state.editing.history.marks, world=stands)
    level = state.with_editing(history=replace(state.editing.history, marks=marks))
    lost = poses.look(
        poses.make_upright(poses.fly(state.scene.pose, 0.1, 0.1, 0.5), level.up), 2.5, 0.6, level.up
    )
    flying = after(level.with_scene(pose=lost, view=None), camera.Home())
    for share in (0.2, 0.4, 0.6, 0.8, 1.0):
        on_the_way = after(flying, Tick(flying.now + share * FLIGHT_SECONDS + 1e-6)).scene.pose
        assert abs(poses.roll(on_the_way, level.up)) < 1e-6
    home = after(flying, Tick(flying.now + FLIGHT_SECONDS + 1)).scene
    assert home.pose == near.first_stand(level.scene.info, stands) and home.view is None  # pyright: ignore[reportArgumentType]
    assert after(State(), camera.Home()) == State()
    straight = after(state.with_scene(pose=lost), camera.Home(), Tick(99.0))
    assert straight.scene.view == 0 and straight.scene.pose == state.scene.info.views[0]  # pyright: ignore[reportOptionalMemberAccess]


def test_a_hold_knows_nothing_of_another_scene(state: State, scene: Scene) -> None:
    pressed = state.with_scene(hold=Hold(pivot=Vector(0.0, 0.0, 9.0)))
    assert after(pressed, SceneArrived(describe_scene(scene, 2, "other"))).scene.hold is None
