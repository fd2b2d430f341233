"""Which photos do not look right, as people are told."""

from typing import Any

import pytest

from langflash_core.base.records import Record
from langflash_core.scene.doubts import doubt_line, doubtful, told_warnings
from langflash_core.scene.record import from_json, to_json

FINE = {"covered": [0.7, 1.0, 1.0, 0.8], "alike": [0.9, 0.8, 0.7, None], "nearest": [1, 0, 3, 2]}
HELPS = "with more light, and hold still"


def told(**changes: Any) -> Record:
    return Record(foreseen={**FINE, **changes})


def test_photos_that_meet_say_nothing():
    assert doubt_line(told(), 4) == "" and doubtful(told(), 4) == {}
    assert told_warnings(Record(warnings=("one",), foreseen=FINE), 4) == ("one",)


def test_a_photo_that_does_not_meet_its_neighbours():
    record = told(alike=[0.9, 0.8, 0.5, None])
    assert doubt_line(record, 4) == (
        f"photo 3 does not meet the photos beside it; take more photos between 3 and 4, {HELPS}"
    )
    assert doubtful(record, 4) == {
        2: f"It does not meet the photos beside it; take more photos between 3 and 4, {HELPS}."
    }
    assert told_warnings(record, 4) == (doubt_line(record, 4),)


def test_a_photo_that_stands_alone_is_not_torn_as_well():
    record = told(covered=[0.2, 1.0, 1.0, 0.8], alike=[0.1, 0.8, 0.7, None])
    assert doubt_line(record, 4) == (f"photo 1 stands alone; take more photos between 1 and 2, {HELPS}")
    assert set(doubtful(record, 4)) == {0}


def test_all_of_them_are_one_sentence():
    record = Record(
        foreseen=told(covered=[0.2, 1.0, 1.0, 0.8], alike=[0.9, 0.5, 0.4, 0.9]).foreseen,
        detail={"photos_psnr_db": [35.0, 34.0, 36.0, 20.0]},
    )
    assert doubt_line(record, 4) == (
        "photos 2 and 3 do not meet the photos beside them, photo 1 stands alone and photo 4 is blurred "
        f"where it was taken; take more photos between 1 and 2 and between 3 and 4, {HELPS}"
    )
    assert set(doubtful(record, 4)) == {0, 1, 2, 3}


def test_many_are_counted():
    count = 30
    record = Record(
        foreseen={
            "covered": [1.0] * count,
            "alike": [0.9, *[0.1] * (count - 1)],
            "nearest": [1, *range(count - 1)],
        }
    )
    line = doubt_line(record, count)
    assert (
        "photos 2, 3, 4, 5, 6, 7 and 23 others do not meet" in line
        and "between them and their neighbours," in line
    )


def test_where_no_photo_meets_another_none_is_numbered():
    line = doubt_line(told(covered=[1.0] * 4, alike=[0.1] * 4), 4)
    assert line.startswith("none of the 4 photos meets those beside it; take more photos between 1 and 2")


def test_old_scenes_whose_photos_came_out_badly():
    """Files from before there were layers know how near their pictures come to the photos."""
    record = Record(detail={"photos_psnr_db": [18.0, 33.0, 25.9]})
    assert doubt_line(record, 3) == (
        "photos 1 and 3 are blurred where they were taken; take them again with more light, and hold still"
    )


def test_what_was_said_of_a_photo_by_name_is_said_again():
    notes = ("b.jpg is blurred; hold the camera still and take it again", "the photos do not record the lens")
    record = Record(photos=("a.jpg", "b.jpg"), warnings=notes)
    assert doubtful(record, 2) == {1: f"{notes[0]}."} and doubt_line(record, 2) == ""


def test_notes_that_say_the_same_of_several_photos_are_one():
    photos = tuple("abcde")
    dark, blurred = "is very dark; take it again with more light", "is blurred; hold the camera still"
    burnt = "is over-exposed, more than half of it is pure white; expose it less"
    notes = (f"a {dark}", f"b {blurred}", f"c {dark}", "no lens", f"d {burnt}", f"e {burnt}", f"e {dark}")
    assert told_warnings(Record(photos=photos, warnings=notes), 5) == (
        "photos 1, 3 and 5 are very dark; take them again with more light",
        f"b {blurred}",
        "no lens",
        "photos 4 and 5 are over-exposed, more than half of each is pure white; expose them less",
    )


def test_photos_of_one_name_are_not_numbered():
    """Nobody knows which of them is meant."""
    said = " is very dark; take it again with more light"
    record = Record(photos=("a.jpg", "b.jpg", "a.jpg"), warnings=tuple(f"{who}.jpg{said}" for who in "aab"))
    assert told_warnings(record, 3) == (
        "a.jpg, a.jpg and b.jpg are very dark; take them again with more light",
    )


def test_words_of_before_are_told_as_those_of_now():
    before = " is 2.3 times as long as it is wide, only its centre is used; use plain photos"
    now = " is 2.3 times as long as wide, only the centre is used; use plain photos"
    record = Record(photos=("a", "b", "c"), warnings=(f"a{before}", f"b{before}", f"c{now}"))
    assert told_warnings(record, 3) == (
        "photos 1, 2 and 3 are 2.3 times as long as wide, only the centre is used; use plain photos",
    )


def test_photos_that_were_left_out_for_one_reason_are_one_sentence():
    """By their names, since the scene does not number them; files of before have a sentence of each."""
    names = ("0102.jpg", "0108.jpg", "0114.jpg")
    said = ": too little of it could be matched with the other photos, so it is left out; take others"
    record = Record(warnings=tuple(name + said for name in names))
    assert told_warnings(record, 2) == (
        "0102.jpg, 0108.jpg and 0114.jpg: too little of each could be matched with the other photos, so they "
        "are left out; take others",
    )


@pytest.mark.parametrize("wrong", [None, "x", 3, [], [1.0], [True] * 4, ["a"] * 4, {"a": 1}])
@pytest.mark.parametrize("name", list(FINE))
def test_what_another_version_means_otherwise_is_left_out(name, wrong):
    assert doubt_line(told(**{"alike": [0.1] * 4, name: wrong}), 4) == ""


@pytest.mark.parametrize("nearest", [[1, 0, 3, 4], [-1, 0, 3, 2], [0.5, 0, 3, 2], [None, 0, 3, 2]])
def test_neighbours_that_are_none_are_left_out(nearest):
    assert doubt_line(told(alike=[0.1] * 4, nearest=nearest), 4) == ""


def test_numbers_of_other_views_say_nothing():
    assert doubt_line(told(alike=[0.1] * 4), 3) == "" and doubtful(told(alike=[0.1] * 4), 3) == {}


def test_a_file_keeps_it_and_an_old_one_has_none():
    record = told(alike=[0.1, None, 0.5, 0.9])
    assert from_json(to_json(record)) == record
    assert "foreseen" not in to_json(Record()) and from_json({}).foreseen == {}
    with pytest.raises(ValueError, match="foreseen: expected dict"):
        from_json({"foreseen": [1]})
