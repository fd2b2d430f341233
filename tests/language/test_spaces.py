import pytest
import torch

from langflash_core.errors import PromptError
from langflash_core.language.algebra import encode_prompts, terms
from langflash_core.language.spaces import encode_cached, language_space


def test_minilm_space():
    space = language_space("minilm")
    assert space is language_space()
    assert space.encode(["sofa", "chair"]).shape == (2, space.dimension)
    assert encode_cached(space, space.negatives) is encode_cached(space, space.negatives)


def test_clip_space_is_described_without_its_weights():
    assert language_space("clip").dimension == 512


def test_unknown_space():
    with pytest.raises(PromptError, match="'siglip' is unknown"):
        language_space("siglip")


@pytest.mark.parametrize(
    ("prompt", "expected"),
    [
        ("dining-room t-shirt", [(1, "dining-room t-shirt")]),
        ("C++ book", [(1, "C++ book")]),
        ("chair - armchair", [(1, "chair"), (-1, "armchair")]),
        ("sofa + cushion  -  red cloth", [(1, "sofa"), (1, "cushion"), (-1, "red cloth")]),
        ("sofa +cushion", [(1, "sofa +cushion")]),
    ],
)
def test_terms(prompt, expected):
    assert terms(prompt) == expected


@pytest.mark.parametrize("prompt", ["chair - ", " + chair", "a -  - b + ", "-"])
def test_incomplete_algebra(prompt):
    with pytest.raises(PromptError, match="incomplete"):
        terms(prompt)


def test_empty_prompt():
    with pytest.raises(PromptError, match="empty"):
        encode_prompts(language_space(), ["  "])


def test_sums_and_differences():
    space = language_space()
    sofa, cushion, chair = space.encode(["sofa", "cushion", "chair"])
    both, less, plain = encode_prompts(space, ["sofa + cushion", "chair - sofa", "chair"])
    # Float32 sums of unit vectors, twice normalised, and batches of other sizes: below 1e-6.
    for combined, total in ((both, sofa + cushion), (less, chair - sofa), (plain, chair)):
        torch.testing.assert_close(combined, total / total.norm(), rtol=0, atol=2e-6)
    assert less @ sofa < 0 < less @ chair


def test_a_prompt_can_cancel_itself_out():
    with pytest.raises(PromptError, match="cancels itself out"):
        encode_prompts(language_space(), ["chair - chair"])
