"""Phrases of a real place: regions become masks of a view, and what is lit gets a verdict."""

import json
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import phrases
from langflash_core.lab.evaluation.phrases import (
    Verdict,
    judged,
    painted,
    phrases_markdown,
    read_place,
    shares,
)
from langflash_core.language.grammar import Kind, read_phrase

ASKED = Path(phrases.__file__).parent / "asked"
SIZE = (60, 40)


def _box(left: int, top: int, right: int, bottom: int) -> np.ndarray:
    mask = np.zeros(SIZE[::-1], bool)
    mask[top:bottom, left:right] = True
    return mask


THING = _box(10, 10, 20, 20)


@pytest.mark.parametrize(
    ("lit", "verdict"),
    [
        (THING, "right"),
        (_box(10, 10, 20, 15), "right"),  # half of it
        (_box(10, 10, 30, 20), "partly"),  # and as much beside it
        (_box(10, 10, 11, 20), "partly"),  # a tenth of it
        (_box(40, 20, 50, 30), "wrong"),
        (_box(0, 0, 0, 0), "missed"),
    ],
)
def test_a_thing_is_right_where_most_of_what_is_lit_lies_in_it(lit, verdict):
    assert judged("lamp", [lit], [[THING]], 0.9).verdict == verdict


def test_half_of_the_things_have_to_be_lit_over_all_frames():
    other = _box(40, 20, 50, 30)
    nothing = _box(0, 0, 0, 0)
    assert judged("lamp", [THING, nothing], [[THING], [other]], 0.9).verdict == "right"
    assert judged("lamp", [THING, nothing], [[THING], [other, other]], 0.9).verdict == "partly"


def test_regions_follow_the_middle_that_the_network_saw():
    # a photo of 200 x 100 is cut to its middle 150 x 100; the view has 60 x 40 pixels
    (box,) = painted([(0.125, 0, 0.5, 0.5)], (200, 100), SIZE)
    assert np.argwhere(box).min(0).tolist() == [0, 0] and np.argwhere(box).max(0).tolist() == [20, 30]
    (triangle,) = painted([((0.125, 0), (0.875, 0), (0.125, 1))], (200, 100), SIZE)
    assert triangle.mean() == pytest.approx(0.5, abs=0.05)  # its edge takes the pixels it passes
    assert painted([(0.0, 0.0, 0.1, 1.0)], (200, 100), SIZE) == []  # cut away


def test_shares_are_of_what_is_there_and_of_what_is_not():
    some = [Verdict("a", "right", 0.9), Verdict("b", "wrong", 0.95), Verdict("c", "honest", 0.1)]
    found = shares([*some, Verdict("d", "claimed", 0.5)])
    assert found == {
        "right": 0.5, "partly": 0, "wrong": 0.5, "missed": 0,
        "honest": 0.5, "claimed": 0.5, "confident": 0.25,
    }  # fmt: skip
    assert "| wrong | 100 % | b (0.95) |" in phrases_markdown("home", some[1:])
    assert "honest" not in phrases_markdown("home", some[:2])  # nobody asked for what is not there


def test_thirty_phrases_with_modifiers_of_every_kind():
    places = [read_place(ASKED / f"{name}_modified.json") for name in ("kitchen", "workshop", "office")]
    readings = [read_phrase(phrase) for place in places for phrase in place.phrases]
    said = [modifier for reading in readings for modifier in reading.modifiers]
    assert len(readings) == 30 and all(reading.narrows for reading in readings)
    assert {each.kind for each in said} == set(get_args(Kind)) and any(each.negated for each in said)
    assert all(len(frames) == 1 for place in places for frames in place.there.values())


@pytest.mark.parametrize("name", ["kitchen", "workshop", "office"])
def test_every_place_asks_forty_phrases_a_third_of_them_of_nothing(name):
    place = read_place(ASKED / f"{name}.json")
    assert len(set(place.phrases)) == 40 and len(place.absent) == 13 and 3 <= len(place.frames) <= 4


@pytest.mark.parametrize(
    "document",
    [
        "[]", "{", {"there": {}, "absent": []}, {"there": {"a": {"0": [[0, 1]]}}, "absent": []},
        {"there": {"a": {"0": [[[0, 1], [1, 1]]]}}, "absent": []}, {"there": {"a": {"0": [1]}}},
    ],
)  # fmt: skip
def test_what_is_no_place_is_said_in_a_sentence(tmp_path, document):
    path = tmp_path / "home.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    with pytest.raises(InputError, match=r"is no place|names no frame"):
        read_place(path)
    with pytest.raises(InputError, match="there is no file"):
        read_place(tmp_path / "gone.json")
