"""Spelling and classes of published names."""

import pytest

from langflash_core.lab.photos.names import CLASSES37, CLASSES40, class_of, spoken


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("refridgerator", "refrigerator"),
        ("garbage bin", "trash bin"),
        ("night_stand", "night stand"),
        ("floor-wood", "floor"),
        ("wall-other-merged", "wall"),
        ("table-merged", "table"),
        ("windowpane, window", "window"),
        ("tv", "television"),
        ("Floor Mat", "floor mat"),
        ("yeti", "yeti"),
    ],
)
def test_names_are_spelled_as_people_do(name: str, words: str):
    assert spoken(name) == words


def test_classes():
    assert len(CLASSES40) == 40 and len(CLASSES37) == 37
    assert all(class_of(name) == name for name in CLASSES40)
    assert class_of("couch") == "sofa" and class_of("dining table") == "table"
    assert class_of("coffee table") == "other furniture"  # as NYU Depth v2 counts it
    assert class_of("yeti") is None
    assert {spoken(name) for name in ("otherprop", "refridgerator", "night stand")} <= set(CLASSES40)
