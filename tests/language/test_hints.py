"""Negations, slips and unknown words are told, known ones are not; what is proposed does what it says."""

import time

import pytest
import torch

from langflash_core.language.algebra import encode_prompts, terms
from langflash_core.language.hints import hint, hints
from langflash_core.language.spaces import language_space
from langflash_core.language.vocabulary import all_phrases
from langflash_core.types import Semantics

KNOWN = """
floor; a red sofa; typewriter; ottoman; fridge; seat without a back; no smoking sign; t-shirt; x-ray;
non-stick pan; nightstand; footstool; grandfather clock; bean bag; toaster oven; kettle; doorknob;
toothbrush; coat rack; yoga mat; monitor stand; ironing board; nothing but the floor;
small but tidy desk; books on a shelf; wall - floor; chair + table; knotted rug; the person not; potted plants
"""
SLIPS = {
    "flor": "floor", "chiar": "chair", "tabel": "table", "windwo": "window", "cusion": "cushion",
    "curtian": "curtain", "pilow": "pillow", "bokshelf": "bookshelf", "refridgerator": "refrigerator",
    "cieling": "ceiling", "mirrow": "mirror", "wadrobe": "wardrobe", "a red sofe": "sofa",
    "matress": "mattress", "televison": "television", "ofice chair": "office",
}  # fmt: skip
ALONE = (
    "no floor", "not the floor", "without the floor", "anything but the floor", "everything except the floor",
    "all but the floor", "non-floor", "what is not the floor", "everything that isn't the floor", "No Floor",
    "everything except for a floor", "anything other than the floor",
)  # fmt: skip
BESIDE = {
    "chair but not armchair": "chair - armchair", "a chair, but not the armchair": "chair - armchair",
    "chair without arm rests": "chair - arm rests", "the table except the desk": "table - desk",
    "seat that is not a sofa": "seat - sofa", "door with no handle": "door - handle",
    "furniture other than the bed": "furniture - bed", "lamp and not candle": "lamp - candle",
}  # fmt: skip


@pytest.mark.parametrize("phrase", [each.strip() for each in KNOWN.split(";")])
def test_known_phrases_are_told_nothing(phrase: str) -> None:
    assert hint(phrase) == ""


def test_nor_is_any_phrase_of_the_table() -> None:
    assert [phrase for phrase in all_phrases() if hint(phrase)] == []


@pytest.mark.parametrize(("slip", "word"), SLIPS.items())
def test_a_slip_is_told_the_nearest_word(slip: str, word: str) -> None:
    assert hint(slip).endswith(f'is not a word this model knows; did you mean "{word}"?')


@pytest.mark.parametrize("word", ["stuhl", "chaise", "der teppich", "椅子家具", "xqzvw", "стол"])
def test_what_is_near_to_nothing_is_told_as_that(word: str) -> None:
    said = f'"{word.split()[-1]}" is not a word this model knows well; try a more common word, in English'
    assert hint(word) == said


def test_words_that_a_person_taught_are_known() -> None:
    assert hint("Stuhl") and hint("roter stuhl", ["Stuhl"]) == hint("Stuhl", ["stuhl"]) == ""
    assert 'did you mean "stuhl"?' in hint("sthul", ["Stuhl"])


@pytest.mark.parametrize("phrase", ALONE)
def test_a_negation_alone_is_told_what_it_finds_and_how_to_take_away(phrase: str) -> None:
    said = hint(phrase)
    assert 'this looks for "floor" itself' in said and said.endswith('as in "wall - floor"')
    assert hint(phrase.replace("floor", "wall").replace("Floor", "wall")).endswith('as in "floor - wall"')


@pytest.mark.parametrize(("phrase", "instead"), BESIDE.items())
def test_a_negation_beside_something_is_told_the_minus(phrase: str, instead: str) -> None:
    assert hint(phrase).endswith(f'takes nothing away; write "{instead}"')


def test_the_minus_that_is_proposed_takes_away() -> None:
    """The words "but not" leave a phrase as near to what it denies as to what it asks for."""
    space = language_space("minilm")
    for phrase, instead in BESIDE.items():
        (_, more), (sign, less) = terms(instead)
        asked, denied = space.encode([more, less])
        written, minus = encode_prompts(space, [phrase, instead])
        assert (
            sign == -1
            and float(minus @ asked) > 0.3
            and float(minus @ denied) < float(written @ denied) - 0.3
        )


def test_only_phrases_of_this_text_model_are_told() -> None:
    def semantics(space: str) -> Semantics:
        return Semantics(torch.zeros(1, 1, dtype=torch.int64), torch.ones(1, 1), torch.zeros(1, 4), space)  # pyright: ignore[reportCallIssue]

    assert hints(semantics("clip"), ["no floor", "flor"]) == ("", "")


def test_it_takes_less_than_a_millisecond() -> None:
    """A key stroke. The median of many: the machine does other things too."""
    asked = (
        "floor",
        "a very old typewriter",
        "refridgerator",
        "chaise",
        "anything but the floor",
        "sthul tich",
    )
    hint("flor")
    for phrase in asked:
        taken = []
        for _ in range(31):
            started = time.perf_counter()
            hint(phrase)
            taken.append(time.perf_counter() - started)
        assert sorted(taken)[15] < 1e-3, phrase
