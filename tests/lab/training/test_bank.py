"""Names of several sets as one bank: who denies whom, and what rare ones count."""

import numpy as np
import pytest
import torch

from langflash_core.lab.photos import Name
from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.bank import MIN_PHOTOS, NameBank, NamedSet, Shown

from .conftest import encode


def shown(**pixels: int) -> Shown:
    return Shown({int(key[1:]): count for key, count in pixels.items()}, 1000)


@pytest.fixture(scope="module")
def bank():
    """A set that names everything, and one of outlines that knows chairs and bottles alone."""
    whole = {
        1: Name("wall", "wall"),
        2: Name("chair", "chair"),
        3: Name("swivel chair", "chair"),
        4: Name("zither", "other prop"),
    }
    outlines = {7: Name("chair", "chair"), 9: Name("bottle", None)}
    first = NamedSet(whole, [shown(_1=600, _2=200, _3=200, _4=1) for _ in range(MIN_PHOTOS)])
    second = NamedSet(outlines, [shown(_7=300, _9=100) for _ in range(MIN_PHOTOS)])
    return NameBank.of([first, second, NamedSet({}, [])], encode)


def test_ids_of_every_set_find_the_same_names(bank):
    at = {text: row for row, text in enumerate(bank.texts)}
    assert bank.name_of[0].tolist() == [-1, at["wall"], at["chair"], at["swivel chair"], -1]
    assert bank.name_of[1][7] == at["chair"] and bank.name_of[1][9] == at["bottle"]
    assert bank.class_of[0].tolist() == [-1, 0, 4, 4, -1] and CLASSES37[4] == "chair"
    assert bank.class_of[1][9] == -1, "a bottle is none of the 37"
    assert bank.name_of[2].tolist() == bank.class_of[2].tolist() == [-1], "photos without labels"
    assert torch.equal(bank.vectors[at["bottle"]], encode(["bottle"])[0])


def test_a_set_denies_what_it_names_and_nothing_else(bank):
    at = {text: row for row, text in enumerate(bank.texts)}
    chair, wall, swivel, bottle = (at[text] for text in ("chair", "wall", "swivel chair", "bottle"))
    assert bank.against[0, wall, chair] and bank.against[0, chair, swivel]
    assert not bank.against[0, swivel, chair], "a swivel chair is a chair"
    assert not bank.against[0, wall, bottle], "the first set has no word for bottles"
    assert bank.against[1, chair, bottle] and not bank.against[1, chair, wall]
    assert bank.against.diagonal(dim1=1, dim2=2).all(), "what is true stands in the softmax"
    assert not bank.against[0, wall, at["sofa"]], "of the 37, but nobody labelled it"


def test_common_classes_count_less_and_pixels_one_on_average(bank):
    wall, chair = CLASSES37.index("wall"), CLASSES37.index("chair")
    share = {wall: 0.6 / 1.3, chair: 0.7 / 1.3}  # of the labelled pixels of both sets, photo by photo
    ratio = float(bank.balance[wall] / bank.balance[chair])
    assert ratio == pytest.approx((share[wall] / share[chair]) ** -0.25, rel=1e-4)
    assert float(sum(bank.balance[c] * s for c, s in share.items())) == pytest.approx(1, rel=1e-4)


def test_what_is_too_small_is_not_shown():
    labels = np.zeros((100, 100), np.int64)
    labels[0, :19], labels[1, :20] = 5, 6  # .19 and .2 % of the photo
    assert Shown.of(labels).pixels == {5: 19, 6: 20} and Shown.of(labels).seen == (6,)
