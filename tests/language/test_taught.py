"""What people teach a scene: names, denials, and what looks alike."""

from dataclasses import replace

import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.errors import PromptError
from langflash_core.language.relevance import compile_query, relevance_maps, spoken_dictionary
from langflash_core.language.settings import TEACHING
from langflash_core.language.spaces import language_space
from langflash_core.language.taught import taught_dictionary
from langflash_core.types import Record, Scene
from tests.app.window.scenes import room

SPACE = language_space("minilm")


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The last atom is the first one with a little of another thing: it looks alike."""
    chair, wall = SPACE.encode(["armchair", "wall"])
    return room(torch.stack((chair, wall, normalize(chair + 0.2 * wall, dim=0))))


def score(scene: Scene, phrase: str) -> list[float]:
    """Relevancy of a phrase for each atom alone."""
    return relevance_maps(torch.eye(3)[None], compile_query(scene, SPACE, [phrase]))[0, 0].tolist()


def taught(scene: Scene, **lessons) -> Scene:
    return replace(scene, record=replace(scene.record, **lessons))


def test_what_was_taught_in_other_numbers_is_one_sentence():
    """A file may say that it speaks minilm, and hold atoms of another length."""
    strange = taught(room(torch.eye(3)), atom_names={1: "aquarium"})
    for each in (strange, strange.semantics):
        with pytest.raises(PromptError, match=r"speaks 'minilm' with 3 numbers, .* with 384; query"):
            spoken_dictionary(each, SPACE)


def test_a_named_group_answers_to_its_name_as_well(scene):
    assert score(scene, "aquarium")[1] < 0.6
    named = taught(scene, atom_names={1: "aquarium"})
    assert score(named, "aquarium")[1] > SPACE.threshold and score(named, "wall")[1] > SPACE.threshold
    assert score(named, "armchair")[0] == pytest.approx(score(scene, "armchair")[0], abs=0.02)


def test_a_denied_word_is_refused_and_what_looks_alike_is_moved_along(scene):
    before, after = (
        score(scene, "armchair"),
        score(taught(scene, atom_denials={0: ("armchair",)}), "armchair"),
    )
    assert min(before[0], before[2]) > SPACE.threshold
    assert after[0] < 0.5 and after[2] < before[2] - 0.05
    assert after[1] == pytest.approx(before[1], abs=0.02)


def test_a_part_that_is_taken_out_is_far_below_the_threshold_even_where_negatives_are_below_zero():
    """Groups of photos lie that way: with a cosine of 0 a plant went on to answer "plant" with .83."""
    chair, wall = SPACE.encode(["armchair", "wall"])
    aside = normalize(SPACE.encode(list(SPACE.negatives)).sum(0), dim=0)
    part = normalize(chair - (chair @ aside) * aside - 0.4 * aside, dim=0)
    scene = taught(room(torch.stack((part, wall, part))), atom_denials={2: ("armchair",)}, lone_atoms=(2,))
    shared, _, out = score(scene, "armchair")
    assert shared > SPACE.threshold and out < 0.1
    assert max(score(scene, "wall")[2], score(scene, "window")[2]) < SPACE.threshold, "nothing else instead"


def test_a_group_that_is_said_not_to_be_a_word_does_not_answer_it_even_where_negatives_are_below_zero():
    """With a cosine of 0, one denial of twelve was not heeded in scenes of photos."""
    chair, wall = SPACE.encode(["armchair", "wall"])
    aside = normalize(SPACE.encode(list(SPACE.negatives)).sum(0), dim=0)
    group = normalize(chair - (chair @ aside) * aside - 0.02 * aside, dim=0)
    own = SPACE.encode(["lamp"])[0]  # what rivals add to an atom is exact where none is a mixture of others
    other = normalize(0.8 * group + 0.6 * wall + 0.3 * own, dim=0)  # too little alike to go along
    scene = room(torch.stack((group, wall, other)))
    said = taught(scene, atom_denials={0: ("armchair",)})
    before, after = score(scene, "armchair"), score(said, "armchair")
    assert before[0] > SPACE.threshold > 0.7 > after[0], "not even nearly"
    # The denial adds a dimension to what the three atoms span, these are products of another shape: cosines
    # good to 1e-6, and relevancy moves by a quarter of temperature (10) times the error of two of them.
    assert after[1:] == pytest.approx(before[1:], abs=1e-5)


def test_several_denials_leave_nothing_of_any(scene):
    record = Record(atom_denials={2: ("armchair", "chair", "seat")})
    row = taught_dictionary(scene.semantics.dictionary, record, SPACE)[2]
    assert (SPACE.encode(["armchair", "chair", "seat"]) @ row).max() < 1e-5  # float32
    assert float(row.norm()) == pytest.approx(1, abs=1e-5)


def test_an_atom_that_is_all_denied_falls_silent_instead_of_dividing_by_nothing(scene):
    record = Record(atom_names={1: "lamp"}, atom_denials={1: ("wall", "lamp")})
    assert torch.isfinite(taught_dictionary(scene.semantics.dictionary, record, SPACE)).all()
    record = Record(atom_denials={1: ("wall",)})
    assert float(taught_dictionary(scene.semantics.dictionary, record, SPACE)[1].norm()) == 0


def test_lessons_reach_only_what_is_alike_and_nothing_is_taught_by_nothing(scene):
    dictionary = scene.semantics.dictionary
    assert taught_dictionary(dictionary, Record(), SPACE) is dictionary
    assert torch.equal(taught_dictionary(dictionary, Record(atom_names={0: "\U0001f6cb"}), SPACE), dictionary)
    far = torch.stack((dictionary[0], dictionary[1], SPACE.encode(["sink"])[0]))
    assert float((far[0] @ far[2]).abs()) < TEACHING.alike
    moved = taught_dictionary(far, Record(atom_names={0: "throne"}), SPACE)
    assert torch.equal(moved[1:], far[1:]) and not torch.equal(moved[0], far[0])
