"""Phrases choose among the things of a room whose places and colours are known."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core import pipeline
from langflash_core.language.grammar import read_phrase
from langflash_core.language.narrowing import Sight, choose, viewer_axes
from langflash_core.language.parting import called_part, wall_faces
from langflash_core.language.things import Thing
from langflash_core.types import Scene
from tests.boxroom import box_room

SIZE = (192, 144)
SURE = 0.93  # the words of this room alone, uncalibrated: at 0.8 its floor answers "chair"
RED, GREEN, WHITE = (0.75, 0.08, 0.08), (0.1, 0.45, 0.15), (0.9, 0.9, 0.88)


def painted() -> Scene:
    """A white room with a red chair on the left, a green one on the right and a white table behind, seen
    straight on."""
    scene = box_room(pitch=12.0, roll=0.0, yaw=0.0)
    words, east = scene.semantics.weight_ids[:, 0], scene.gaussians.means[:, 0]
    rgb = torch.tensor(WHITE).expand(len(words), 3).clone()
    rgb[(words == 3) & (east < 0)] = torch.tensor(RED)
    rgb[(words == 3) & (east > 0)] = torch.tensor(GREEN)
    sh = ((rgb - 0.5) / 0.28209479)[:, None]
    return replace(scene, gaussians=replace(scene.gaussians, sh=sh))


@pytest.fixture(scope="module")
def ask():
    scene = painted()
    return lambda *phrases, **options: pipeline.query(
        scene, phrases, size=SIZE, **{"threshold": SURE, **options}
    )


def side(mask: torch.Tensor) -> tuple[bool, bool]:
    """Whether a mask has much on the left half of the picture, and on the right."""
    left, right = mask[:, : SIZE[0] // 2].sum(), mask[:, SIZE[0] // 2 :].sum()
    return bool(left > 0.1 * (left + right) > 0), bool(right > 0.1 * (left + right) > 0)


LEFT, RIGHT, BOTH, NONE = (True, False), (False, True), (True, True), (False, False)
ASKED = {
    "chair": BOTH,
    "red chair": LEFT,
    "green chair": RIGHT,
    "chair, not red": RIGHT,
    "chair on the left": LEFT,
    "right chair": RIGHT,
    "first chair from the right": RIGHT,
    "second chair": RIGHT,
    "third chair": NONE,
    "two chairs": BOTH,
    "one chair": BOTH,
    "blue chair": NONE,
    "chair left of the table": LEFT,
    "chair right of the table": RIGHT,
    "chair closest to the door": RIGHT,
    "chair on the floor": BOTH,
    "chair on the table": NONE,
    "chair beside the green chair": NONE,
    "chair on the ceiling": NONE,
    '"red chair"': BOTH,
    "spider-man chair": BOTH,
    "chair behind the table": NONE,
    "left wall": LEFT,
    "wall on the right": RIGHT,
    "second wall": BOTH,
}


@pytest.mark.parametrize(("phrase", "sides"), ASKED.items())
def test_the_chairs_that_a_phrase_means(ask, phrase: str, sides: tuple[bool, bool]) -> None:
    result = ask(phrase)
    assert (side(result.masks[0]), result.answers[0].found) == (sides, sides != NONE), result.answers[0]


def test_phrases_asked_together_answer_as_alone(ask) -> None:
    together = ask("red chair", "chair", "chair left of the table")
    for row, phrase in enumerate(("red chair", "chair", "chair left of the table")):
        alone = ask(phrase).relevance[0]  # of products of another shape: float32, times the temperature
        assert torch.allclose(together.relevance[row], alone, atol=1e-5)
    assert [answer.reading for answer in together.answers] == ["chair, red", "", "chair, left of table"]


def test_what_is_kept_keeps_its_relevance(ask) -> None:
    narrowed, head = ask("red chair").relevance[0], ask("chair").relevance[0]
    assert (
        torch.equal(narrowed, torch.where(narrowed > 0, head, 0.0))
        and 0 < (narrowed > 0).sum() < (head > 0).sum()
    )


def test_people_are_told_why_nothing_is_left(ask) -> None:
    notes = [
        answer.note for answer in ask("blue chair", "third chair", "chair beside the lamp", "chair").answers
    ]
    assert notes == [
        "no chair here looks blue",
        "only 2 of them are seen here",
        'no "lamp" is found here, to which the phrase relates it',
        "",
    ]


def test_an_unknown_modifier_is_ignored_and_said(ask) -> None:
    (answer,) = ask("spider-man chair").answers
    assert answer.found and answer.reading == "chair"
    assert answer.note == '"spider-man" says nothing that can be checked here, so this is "chair"'


def test_a_thing_that_was_not_taught_is_told_the_nearest_word(ask) -> None:
    (answer,) = ask("typewriter").answers
    assert answer.note.startswith(
        '"typewriter" is no thing that this model was taught; the nearest one it knows is "'
    )


def test_a_grey_picture_tells_no_colours() -> None:
    scene = painted()
    grey = scene.gaussians.sh.mean(-1, keepdim=True).expand(-1, -1, 3).contiguous()
    scene = replace(scene, gaussians=replace(scene.gaussians, sh=grey))
    (answer,) = pipeline.query(scene, "red chair", size=SIZE).answers
    assert answer.found and "has no colours" in answer.note


def two_ladders(orange: float, elsewhere: float) -> Sight:
    """A small ladder and a large one, whose pixels are orange in these shares and else grey, and a crumb that
    is orange."""
    numbers = np.repeat([0, 1, 2], (200, 1000, 20))
    shares = np.array([orange, elsewhere, 1.0])[numbers]
    places = np.concatenate([np.linspace(0, 1, count, endpoint=False) for count in (200, 1000, 20)])
    colours = np.where((places < shares)[:, None], (60.0, 30.0, 45.0), (60.0, 0.0, 0.0))
    return Sight(
        points=np.random.default_rng(0).normal(numbers[:, None], 0.1, (len(numbers), 3)),
        colours=colours,
        areas=np.full(len(numbers), 1 / len(numbers)),
        relevance={"ladder": np.ones(len(numbers))},
        limit=0.9,
        likely=0.8,
        parts=lambda members: np.where(members, numbers, -1),
    )


@pytest.mark.parametrize(
    ("orange", "elsewhere", "sizes"),
    [
        (0.25, 0.05, [200]),  # it stands out, whole
        (0.25, 0.15, [50, 150]),  # none does: what is orange of each
        (0.6, 0.05, [200, 20]),  # mostly orange, with the crumb that is, too
        (0.1, 0.0, [20]),
        (0.04, 0.03, []),  # an orange label makes no orange ladder
    ],
)
def test_the_one_that_stands_out_is_meant(orange: float, elsewhere: float, sizes: list[int]) -> None:
    kept = choose(read_phrase("orange ladder"), two_ladders(orange, elsewhere)).kept
    assert [len(each.rows) for each in kept] == sizes


def cabinet(lower: tuple[float, float, float], upper: tuple[float, float, float]) -> Sight:
    """A front of 40 x 40 places, as one thing, its lower half of one colour and its upper half of another;
    every tenth place of both is a handle."""
    up, right = np.divmod(np.arange(1600), 40)
    colours = np.where((up < 20)[:, None], lower, upper)
    colours[::10] = (70.0, 0.0, 0.0)
    return Sight(
        points=np.stack((right / 40, up / 40, np.full(1600, 2.0)), 1),
        colours=colours,
        areas=np.full(1600, 1 / 1600),
        relevance={"cabinet": np.ones(1600)},
        limit=0.9,
        likely=0.8,
        parts=lambda members: np.where(members, 0, -1),
    )


WOOD, PAINT, SHADED, DIM = (48.0, 8.0, 22.0), (95.0, 0.0, 2.0), (62.0, 0.0, 1.0), (30.0, 7.0, 7.0)


@pytest.mark.parametrize(
    ("phrase", "lower", "upper", "meant"),
    [
        ("wooden cabinet", WOOD, PAINT, "lower"),
        ("white cabinet", WOOD, PAINT, "upper"),
        ("cabinet that is not wooden", WOOD, PAINT, "upper"),
        ("white cabinet", SHADED, PAINT, "both"),
        ("wooden cabinet", WOOD, WOOD, "both"),
        ("orange cabinet", DIM, PAINT, "lower"),
        ("blue cabinet", WOOD, PAINT, "none"),
    ],
)
def test_of_a_thing_of_two_colours_the_part_is_meant(phrase: str, lower, upper, meant: str) -> None:
    kept = choose(read_phrase(phrase), cabinet(lower, upper)).kept
    rows = np.isin(np.arange(1600), np.concatenate([each.rows for each in kept] or [[]]))
    shares = {"lower": (1, 0), "upper": (0, 1), "both": (1, 1), "none": (0, 0)}[meant]
    assert (rows[:800].mean(), rows[800:].mean()) == pytest.approx(shares, abs=0.06)


def test_of_a_large_thing_the_same_part_is_meant() -> None:
    """Of more places than are looked at, up to a fiftieth of it."""
    across, up = np.random.default_rng(0).random((2, 40_000))
    thing = Thing(np.arange(len(up)), np.stack((across, up, np.full(len(up), 2.0)), 1))
    part = called_part(thing, np.where((up < 0.5)[:, None], WOOD, PAINT), (up < 0.5).astype(float))
    assert part is not None and (part != (up < 0.5)).mean() < 0.02


@pytest.mark.parametrize("count", [12, 60, 3000])
def test_walls_of_few_places_are_told_apart_too(count: int) -> None:
    """A line through one place twice is none, on which all would lie."""
    along = np.linspace(0.3, 3, count)
    left, behind = np.stack((0 * along - 2, along)), np.stack((along - 2, 0 * along + 3.3))
    right, away = np.concatenate((left, behind), 1)
    numbers = wall_faces(Thing(np.arange(2 * count), np.stack((right, np.sin(40 * right), away), 1)))
    assert len(set(numbers[:count])) == len(set(numbers[count:])) == 1 and numbers[0] != numbers[-1]


def test_none_is_white_for_having_more_colour() -> None:
    """Of two grey ladders, one of which has a tint, neither stands out; each has a white part."""
    sight = two_ladders(0.35, 0.3)
    lit = (sight.colours == (60.0, 30.0, 45.0)).all(1)
    tint = np.where((np.arange(1220) < 200)[:, None], (60.0, 4.0, 4.0), (60.0, 0.0, 0.0))
    colours = np.where(lit[:, None], (95.0, 0.0, 0.0), tint)
    kept = choose(read_phrase("white ladder"), replace(sight, colours=colours)).kept
    assert sorted(len(each.rows) for each in kept) == [70, 300]


def test_people_are_told_that_a_colour_is_but_a_tint() -> None:
    choice = choose(read_phrase("orange cabinet"), cabinet(DIM, PAINT))
    assert choice.note == "no cabinet here is clearly orange; this comes nearest"


def test_by_cosine_too(ask) -> None:
    assert side(ask("red chair", mode="cosine", threshold=0.7).masks[0]) == LEFT


def test_the_viewer_stands_upright() -> None:
    """Turned, leaning and looking down, up stays up and right is level."""
    up = np.array([0.1, -0.9, 0.2]) / np.linalg.norm([0.1, -0.9, 0.2])
    viewmat = torch.eye(4)
    axes = viewer_axes(viewmat, up)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-12) and np.linalg.det(axes) == pytest.approx(-1)
    assert np.allclose(axes[1], up) and axes[0, 0] > 0.9 and axes[2, 2] > 0.9
    down = viewer_axes(viewmat, np.array([0.0, 0.0, -1.0]))  # looking down: the picture's top is away
    assert np.allclose(down, [[1, 0, 0], [0, 0, -1], [0, -1, 0]])
