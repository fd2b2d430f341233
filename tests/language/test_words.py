"""From vectors to words, and vectors as questions: against the brute-force feature."""

import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import LanguageSpace
from langflash_core.language.words import feature_at, nearest_words, with_vectors
from langflash_core.types import Semantics

WORDS = ("chair", "Sofa", "door", "sofa", "lamp")


class Tower:
    def encode(self, texts):
        rows = [torch.randn(12, generator=torch.Generator().manual_seed(len(t) + ord(t[0]))) for t in texts]
        return normalize(torch.stack(rows), dim=-1) if rows else torch.zeros(0, 12)


SPACE = LanguageSpace("test", 12, 10.0, 0.5, 0.2, Tower)


@pytest.fixture
def semantics() -> Semantics:
    generator = torch.Generator().manual_seed(3)
    values = torch.rand(50, 3, generator=generator)
    return Semantics(
        torch.randint(0, 7, (50, 3), generator=generator),
        values / values.sum(1, keepdim=True),
        normalize(torch.randn(7, 12, generator=generator), dim=-1),
        "test",
    )


def test_words_come_best_first_and_once():
    embeddings = normalize(torch.randn(5, 12, generator=torch.Generator().manual_seed(0)), dim=-1)
    embeddings[3] = embeddings[1]
    near = nearest_words(3.0 * embeddings[1] + 0.1 * embeddings[2], WORDS, embeddings, count=4)
    assert near[0].word == "Sofa" and len({n.word.lower() for n in near}) == 4
    cosines = [n.cosine for n in near]
    assert cosines == sorted(cosines, reverse=True) and cosines[0] == pytest.approx(1, abs=0.02)


def test_a_vector_that_says_nothing_has_no_words(unchecked):
    embeddings = torch.eye(5)
    assert nearest_words(torch.zeros(5), WORDS, embeddings) == ()
    assert nearest_words(torch.full((5,), float("nan")), WORDS, embeddings) == ()
    with pytest.raises(ValueError, match="embeddings"):
        nearest_words(torch.zeros(4), WORDS, embeddings)


def test_a_vector_as_prompt_equals_the_cosine_of_features(semantics):
    weights = torch.rand(6, 4, 7, generator=torch.Generator().manual_seed(1))
    features = weights @ semantics.dictionary
    query = compile_query(semantics, SPACE, ["chair", "like this"], mode="cosine")
    asked = with_vectors(query, semantics.dictionary, {1: feature_at(weights[2, 1], semantics.dictionary)})
    found = relevance_maps(weights, asked)
    expected = torch.cosine_similarity(features, features[2, 1].expand_as(features), dim=-1)
    torch.testing.assert_close(found[1], expected, rtol=0, atol=1e-5)  # float32 throughout
    torch.testing.assert_close(found[0], relevance_maps(weights, query)[0], rtol=0, atol=0)
    assert float(found[1][2, 1]) == pytest.approx(1, abs=1e-5)
    assert with_vectors(query, semantics.dictionary, {}) is query
    for wrong in ({2: torch.ones(12)}, {0: torch.zeros(12)}):
        with pytest.raises(ValueError, match="vectors"):
            with_vectors(query, semantics.dictionary, wrong)
