"""Which Gaussians phrases mean: those of the things that they tell from others, from wherever one looks."""

import pytest
import torch

from langflash_core import pipeline, segments
from langflash_core.errors import PromptError
from langflash_core.language.spaces import language_space
from langflash_core.language.spoken import compile_spoken
from langflash_core.meant import meant_relevance
from langflash_core.types import Scene
from tests.language.test_narrowing import SURE, painted


@pytest.fixture(scope="module")
def scene() -> Scene:
    return painted()


def sides(scene: Scene, *phrases: str) -> list[set[str]]:
    """On which sides of the room lie the chairs that each phrase means."""
    compiled = compile_spoken(scene, language_space("minilm"), phrases)
    relevance, _ = meant_relevance(scene, compiled, [SURE] * len(phrases))
    east = scene.gaussians.means[:, 0]
    return [{"left" if x < 0 else "right" for x in east[row >= SURE]} for row in relevance]


def test_looks_places_and_relations_choose(scene: Scene) -> None:
    asked = ("chair", "red chair", "green chair", "right chair", "chair left of the table", "blue chair")
    both, left, right = {"left", "right"}, {"left"}, {"right"}
    assert sides(scene, *asked) == [both, left, right, right, left, set()]


def test_a_selection_is_what_the_phrase_means(scene: Scene) -> None:
    chosen = pipeline.select(scene, ["red chair"], threshold=SURE)
    chairs = scene.semantics.weight_ids[:, 0] == 3
    assert len(chosen.gaussians) == int((chairs & (scene.gaussians.means[:, 0] < 0)).sum())
    with pytest.raises(PromptError, match="nothing in the scene answers blue chair"):
        pipeline.select(scene, ["blue chair"], threshold=SURE)


def test_segments_are_what_the_phrases_mean(scene: Scene) -> None:
    found = segments.segment(scene, ["red chair", "chair", "blue chair"], threshold=SURE)
    assert found.counts == (1, 2, 0)
    assert torch.equal(found.members[0], found.members[1] & (scene.gaussians.means[:, 0] < 0))


def test_plain_phrases_are_as_before_and_notes_tell_why_nothing_is_left(scene: Scene) -> None:
    compiled = compile_spoken(scene, language_space("minilm"), ["chair", "blue chair"])
    relevance, notes = meant_relevance(scene, compiled, [SURE, SURE])
    assert notes == ("", "no chair here looks blue") and bool((relevance[1] == 0).all())
    assert bool((relevance[0] >= SURE).any())
