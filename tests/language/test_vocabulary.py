"""The phrase table: complete, free of contradictions, and disjoint from what is evaluated."""

from langflash_core.lab.rooms.catalogue import labels
from langflash_core.language import vocabulary
from langflash_core.language.vocabulary import (
    BROADER,
    EVALUATED,
    OWN,
    content,
    groups_of,
    is_name,
    is_trainable,
)


def own_phrases() -> list[str]:
    return [phrase for phrases in OWN.values() for phrase in phrases]


def test_nothing_that_is_evaluated_is_taught():
    trained = [*own_phrases(), *BROADER, *OWN]
    assert not set(trained) & set(EVALUATED)
    assert not {content(p) for p in trained} & {content(p) for p in EVALUATED}
    assert not any(is_trainable(phrase) for phrase in EVALUATED)
    assert not is_trainable("A place to sleep in")
    assert not is_trainable("bookshelves")
    assert is_trainable("used for sleeping")


def test_a_phrase_means_one_group_or_is_listed_as_broader():
    phrases = own_phrases()
    assert len(phrases) == len(set(phrases))
    assert not set(phrases) & set(BROADER)
    assert not set(phrases) & set(OWN)
    assert all(group in BROADER[group] for group in set(BROADER) & set(OWN))


def test_every_group_is_known():
    named = {group for table in (BROADER, EVALUATED) for groups in table.values() for group in groups}
    assert named <= set(OWN)
    catalogue = set(labels()["name_groups"].values()) | {"wall", "floor", "ceiling", "curtain", "rug"}
    assert catalogue <= set(OWN)


def test_phrases_are_plain():
    for phrase in (*own_phrases(), *BROADER, *EVALUATED, *OWN):
        assert phrase == phrase.strip().lower()
        assert 0 < len(phrase.split()) <= 8


def test_truth_of_phrases():
    assert groups_of("settee") == {"sofa"}
    assert {"sofa", "chair", "stool"} <= groups_of("seating")
    assert groups_of("sofa") == {"sofa"}
    assert "coffee table" in groups_of("table")
    assert groups_of("yeti") == frozenset()
    assert "furniture" in vocabulary.further_words("bed")
    assert vocabulary.further_words("yeti") == ()


def test_tags_that_name_something_else_are_no_names():
    assert is_name("pendant", "lamp")
    assert is_name("cupboard", "cabinet")
    assert not is_name("ceiling", "lamp")
    assert not is_name("outdoor", "chair")
