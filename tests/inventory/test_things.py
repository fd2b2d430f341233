"""The things of a room whose things are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError, PromptError
from langflash_core.geometry.rotations import turn_of
from langflash_core.inventory import inventory
from langflash_core.inventory.things import upright_box
from langflash_core.scene.joining import append_part
from langflash_core.writing.inventory.words import doubt_of
from tests.boxroom import (
    CHAIRS,
    EYE,
    HIGH,
    METRES,
    TABLE,
    WORDS,
    box_room,
    in_layers,
    without_language,
)


@pytest.fixture(scope="module")
def room():
    return box_room().with_record(metric_scale=METRES)


@pytest.fixture(scope="module")
def found(room):
    return inventory(room)


def seen_from_above(thing) -> tuple[float, float]:
    """Where a thing is in the room: the inventory's origin lies under the first camera."""
    return thing.place[0] + EYE[0], thing.place[2] + EYE[2]


def test_two_chairs_a_table_and_a_door_are_found_where_they_stand(found):
    assert found.counts == {"chair": 2, "door": 1, "table": 1}
    assert (found.unit, found.guess) == ("m", None)
    places = sorted(seen_from_above(thing) for thing in found.things if thing.kind == "chair")
    for place, true in zip(places, sorted(CHAIRS), strict=True):
        assert math.dist(place, true) < 0.1
    (table,) = (thing for thing in found.things if thing.kind == "table")
    assert math.dist(seen_from_above(table), TABLE) < 0.1
    # Quantiles leave out 2 % on either side, and samples lie half a spacing inside.
    assert table.size == pytest.approx((1.4, 0.8, 0.74), abs=0.12)
    assert abs(table.bottom) < 0.08 and 0.85 < table.sure <= 1
    assert set(table.photos) == {0, 1} and table.id == "table 1" == table.title


def test_one_thing_is_told_as_one(found):
    assert repr(found).startswith("Inventory: 4 things (")
    assert repr(replace(found, things=found.things[:1])).startswith("Inventory: 1 thing (")


def test_the_corners_of_a_thing_are_those_of_its_box(found):
    (table,) = (thing for thing in found.things if thing.kind == "table")
    sides = np.linalg.norm(np.diff(table.corners, axis=0), axis=1)
    assert sides == pytest.approx([table.size[0], table.size[1], table.size[0]])
    assert table.corners.mean(0) == pytest.approx([table.place[0], table.place[2]])


def test_names_that_a_person_gave_are_told(room):
    named = inventory(room.with_record(thing_names={"chair 1": "reading chair", "ghost 3": "none"}))
    titles = {thing.title for thing in named.things}
    assert "reading chair" in titles and "chair 1" not in titles and "chair 2" in titles


def test_without_a_length_the_guess_is_told(room):
    found = inventory(room.with_record(metric_scale=None))
    assert found.unit == "m" and found.guess is not None
    (table,) = (thing for thing in found.things if thing.kind == "table")
    assert table.size[0] == pytest.approx(1.4, rel=0.15)


def test_things_are_all_of_their_gaussians_once(found):
    rows = np.stack([thing.rows for thing in found.things])
    assert rows.sum(0).max() == 1
    segments = found.segments()
    assert segments.counts == (1,) * len(found.things)
    assert segments.members.numpy().sum(1).tolist() == rows.sum(1).tolist()


def test_things_of_layers_are_counted_once_and_are_those_of_all_layers(room, found):
    layers = in_layers(room)
    told = inventory(layers)
    assert told.counts == found.counts
    assert not told.scene.layered and told.given.layered and len(told.scene.gaussians) < len(layers.gaussians)
    assert layers.view_ids is not None
    segments = told.segments()
    for number, thing in enumerate(told.things):
        word = layers.semantics.weight_ids[segments.members[number], 0]
        assert float((word == word.mode().values).float().mean()) > 0.9
        shares = [
            float((layers.view_ids[segments.members[number]] == view).float().mean()) for view in (0, 1)
        ]
        # the door is .03 m before a wall that layers of photos would not have there
        assert min(shares) > 0.3 or thing.kind == "door"


def test_scenes_of_nothing_or_without_language_are_refused(room):
    with pytest.raises(InputError, match="empty"):
        inventory(room.rows(torch.zeros(len(room.gaussians), dtype=torch.bool)))
    with pytest.raises(PromptError, match="no language"):
        inventory(without_language(room))


def test_gaussians_that_are_not_finite_stop_nothing(room):
    means = room.gaussians.means.clone()
    means[::50] = math.nan
    found = inventory(replace(room, gaussians=replace(room.gaussians, means=means)))
    assert found.counts["chair"] == 2


def test_a_box_turns_where_that_saves_room():
    rng = np.random.default_rng(0)
    flat = rng.uniform(-0.5, 0.5, (4000, 2)) * [2.0, 0.4]
    turn = math.radians(36)
    matrix = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    east, north = (flat @ matrix.T).T
    points = np.stack((east + 1, rng.uniform(-1.0, 0.0, 4000), north + 2), 1)
    place, size, degrees, bottom = upright_box(points)
    assert degrees == pytest.approx(36, abs=1.6)  # steps of three degrees
    assert size == pytest.approx((0.96 * 2.0, 0.96 * 0.4, 0.96), abs=0.06)
    assert place == pytest.approx((1, -0.5, 2), abs=0.05) and bottom == pytest.approx(0.02, abs=0.01)
    # The slow way: every direction's own extents.
    areas = []
    for k in range(0, 90, 3):
        t = math.radians(k)
        axes = np.array([[math.cos(t), math.sin(t)], [-math.sin(t), math.cos(t)]])
        low, high = np.quantile(points[:, [0, 2]] @ axes.T, (0.02, 0.98), axis=0)
        areas.append(np.prod(high - low))
    assert size[0] * size[1] == pytest.approx(min(areas), rel=0.02)


def test_a_box_is_along_the_walls_however_those_are_turned():
    """A desk 1.8 m long along a wall that is turned by 23 degrees, whose far end is seen askew."""
    east, north = np.meshgrid(np.linspace(-0.9, 0.9, 60), np.linspace(-0.35, 0.35, 30))
    flat = np.stack((east.ravel(), north.ravel() + 0.12 * east.ravel()), 1)
    turn = math.radians(23)
    flat = flat @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    points = np.stack((flat[:, 0], np.full(len(flat), -0.7), flat[:, 1]), 1)
    _, size, degrees, _ = upright_box(points, 23)
    assert degrees % 90 == pytest.approx(23) and size[0] == pytest.approx(1.8, abs=0.1)
    assert upright_box(points)[2] % 90 != pytest.approx(23)


def test_one_point_has_a_box_of_no_size():
    place, size, _, bottom = upright_box(np.array([[1.0, -2.0, 3.0]]))
    assert place == (1.0, -2.0, 3.0) and size == (0.0, 0.0, 0.0) and bottom == 2.0


def with_more(room, points: np.ndarray, word: str):
    """The room with flat Gaussians (n, 3) of one word more, in metres east, height, north of it."""
    like = room.semantics.weight_ids[:, 0] == WORDS.index(word)
    rows = like.nonzero()[:1, 0].repeat(len(points))
    some, whole = room.rows(rows), inventory(room)
    stands = np.stack((points[:, 0] - EYE[0], -points[:, 1], points[:, 2] - EYE[2]), 1)
    places = stands / whole.scale @ turn_of(whole.world) + np.array(whole.world.origin)
    moved = replace(some.gaussians, means=torch.from_numpy(places).float())
    return append_part(room, replace(some, gaussians=moved))


def test_a_line_is_no_thing(room):
    rng, chairs = np.random.default_rng(0), []
    for extent in ((0.9, 0.01, 0.01), (0.6, 0.6, 0.6)):
        more = with_more(room, np.array((1.6, 1.2, 2.0)) + rng.uniform(size=(600, 3)) * extent, "chair")
        chairs.append(inventory(more, threshold=0.0, least=0.0).counts["chair"])
    assert chairs == [2, 3]


@pytest.mark.parametrize(
    ("extent", "count", "thin"),
    [
        ((0.13, 0.25, 0.04), 0, False),  # "a plant 13 cm wide" and 4 cm deep
        ((0.6, 0.6, 0.04), 1, True),
        ((0.6, 0.6, 0.3), 1, False),
    ],
)
def test_one_side_of_a_body_is_no_small_thing_and_in_doubt_as_a_large_one(room, extent, count, thin):
    rng = np.random.default_rng(0)
    more = with_more(room, np.array((1.6, 1.0, 2.0)) + rng.uniform(size=(600, 3)) * extent, "chair")
    chairs = [each for each in inventory(more, threshold=0.0, least=0.0).things if each.kind == "chair"]
    (new,) = [each for each in chairs if each.bottom > 0.5] if count else [None]
    assert len(chairs) == 2 + count
    if new is not None:
        assert new.thin == thin and bool(doubt_of(replace(new, sure=1.0))) == thin
    assert not any(each.thin for each in chairs if each is not new)


def test_a_thing_has_a_size_and_a_place_in_the_room():
    found = inventory(box_room(pitch=0.0).with_record(metric_scale=METRES))  # the ceiling is in view
    (table,) = (thing for thing in found.things if thing.kind == "table")
    assert found.top == pytest.approx(HIGH + 0.1, abs=0.1)
    assert found.holds(table) and found.holds(replace(table, size=(0.9, 0.5, 0.01)))  # a picture
    assert found.holds(replace(table, bottom=HIGH - 0.3))  # a lamp
    assert not found.holds(replace(table, size=(0.9, 0.04, 0.01)))
    assert not found.holds(replace(table, bottom=HIGH + 0.3))
    assert not found.holds(replace(table, bottom=-0.9, size=(0.8, 0.8, 0.3)))


def test_without_a_ceiling_nothing_is_too_high(room):
    below = room.rows(room.semantics.weight_ids[:, 0] != WORDS.index("ceiling"))
    assert math.isinf(inventory(below).top)
