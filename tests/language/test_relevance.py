import math
import time
from dataclasses import replace
from inspect import unwrap

import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.errors import PromptError, SceneFileError
from langflash_core.language.leads import nearer_threshold
from langflash_core.language.relevance import (
    CompiledQuery,
    Mode,
    compile_query,
    finite_atoms,
    reduce_dictionary,
    relevance_maps,
    relevancy,
)
from langflash_core.language.settings import RELEVANCE
from langflash_core.language.spaces import language_space
from langflash_core.types import Gaussians, Record, Scene, Semantics
from tests.language.reference import feature_cosine, gram_cosine, softmax_relevancy

C = 96  # channels of the algebraic tests: below, at and above it the factorisation differs


def atoms(num, channels=C, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return normalize(torch.randn(num, channels, generator=generator, dtype=torch.float64), dim=-1)


def maps(num, height=9, width=11, seed=1):
    """Weight maps whose rows sum to an alpha in [0, 1); the first row of pixels is empty."""
    generator = torch.Generator().manual_seed(seed)
    weights = torch.rand(height, width, num, generator=generator, dtype=torch.float64) ** 4
    alphas = torch.rand(height, width, 1, generator=generator, dtype=torch.float64) * 0.9 + 0.05
    weights = weights / weights.sum(-1, keepdim=True).clamp_min(1e-9) * alphas
    weights[0] = 0
    return weights


def compiled(dictionary, texts, negatives=None, mode: Mode = "relevancy", temperature=10.0):
    factor, basis = reduce_dictionary(dictionary)
    negatives = texts[:0] if negatives is None else negatives
    names = tuple(str(i) for i in range(len(texts)))
    return CompiledQuery(factor, texts @ basis.T, negatives @ basis.T, temperature, 0.5, mode, names)


def awkward(kind):
    dictionary = atoms(24)
    if kind == "repeated":
        dictionary[5:20] = dictionary[3]
    if kind == "zero rows":
        dictionary[[0, 7, 23]] = 0
    if kind == "all zero":
        dictionary[:] = 0
    return dictionary


@pytest.mark.parametrize("num", [0, 1, 24, 25, 95, 96, 130])
def test_reduced_dictionary_is_exact(num):
    dictionary = atoms(num)
    factor, basis = reduce_dictionary(dictionary)
    rank = min(num, C)
    assert factor.shape == (num, rank)
    assert basis.shape == (rank, C)
    # Householder QR in float64 is backward stable to a few ulps of 2.2e-16.
    torch.testing.assert_close(factor @ basis, dictionary, rtol=0, atol=1e-13)
    torch.testing.assert_close(basis @ basis.T, torch.eye(rank, dtype=torch.float64), rtol=0, atol=1e-13)


@pytest.mark.parametrize("kind", ["repeated", "zero rows", "all zero"])
def test_reduced_dictionary_of_lower_rank(kind):
    dictionary = awkward(kind)
    factor, basis = reduce_dictionary(dictionary)
    torch.testing.assert_close(factor @ basis, dictionary, rtol=0, atol=1e-13)
    torch.testing.assert_close(basis @ basis.T, torch.eye(24, dtype=torch.float64), rtol=0, atol=1e-13)
    assert torch.isfinite(relevance_maps(maps(24), compiled(dictionary, atoms(3), atoms(2)))).all()


def test_reduced_dictionary_keeps_float32(unchecked):
    factor, basis = reduce_dictionary(atoms(24).float())
    assert factor.dtype == basis.dtype == torch.float32
    # Computed in float64, rounded once: half an ulp of numbers below 1.
    torch.testing.assert_close(factor @ basis, atoms(24).float(), rtol=0, atol=1e-6)
    with pytest.raises(ValueError, match="dictionary: expected"):
        reduce_dictionary(torch.zeros(3))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_atoms_that_are_not_finite_say_nothing(bad):
    broken, silent = atoms(5), atoms(5)
    broken[2, 3], silent[2] = bad, 0.0
    assert torch.equal(finite_atoms(broken), torch.arange(5) != 2)
    for made, expected in zip(reduce_dictionary(broken), reduce_dictionary(silent), strict=True):
        assert torch.equal(made, expected)


@pytest.mark.parametrize("num", [0, 1, 24, 25, 130])
def test_cosines_equal_both_twins(num):
    dictionary, weights, texts = atoms(num), maps(num), atoms(5, seed=2)
    cosines = relevance_maps(weights, compiled(dictionary, texts, mode="cosine"))
    # float64 all through; the Gram form loses about half the digits of |F|^2 before its root.
    torch.testing.assert_close(cosines, feature_cosine(weights, dictionary, texts), rtol=0, atol=1e-10)
    torch.testing.assert_close(cosines, gram_cosine(weights, dictionary, texts), rtol=0, atol=1e-10)


def test_float32_stays_near_the_twin():
    dictionary, weights, texts = atoms(24), maps(24), atoms(5, seed=2)
    cosines = relevance_maps(weights.float(), compiled(dictionary.float(), texts.float(), mode="cosine"))
    twin = feature_cosine(weights, dictionary, texts)
    # Sums of 24 float32 products relative to |F|; measured 2e-7.
    torch.testing.assert_close(cosines.double(), twin, rtol=0, atol=2e-6)


@pytest.mark.parametrize("num", [1, 24, 130])
def test_relevancy_equals_the_softmax(num):
    dictionary, weights, texts, negatives = atoms(num), maps(num), atoms(5, seed=2), atoms(4, seed=3)
    scores = relevance_maps(weights, compiled(dictionary, texts, negatives))
    positive, negative = (feature_cosine(weights, dictionary, t) for t in (texts, negatives))
    expected = softmax_relevancy(positive, negative, 10.0)
    expected[:, 0] = 0  # the first row of pixels is empty
    torch.testing.assert_close(scores, expected, rtol=0, atol=1e-10)


def test_relevancy_is_stable_and_ordered():
    positives = torch.tensor([[-1.0, -0.5, 0.0, 0.5, 1.0]])
    negatives = torch.tensor([[0.0], [-1.0]]).expand(2, 5)
    scores = relevancy(positives, negatives, 1e4)  # logits of +-1e4
    assert scores.tolist() == [[0.0, 0.0, 0.5, 1.0, 1.0]]
    gentle = relevancy(positives, negatives, 10.0)
    assert (gentle.diff() > 0).all()
    assert ((gentle > 0) & (gentle < 1)).all()
    assert (relevancy(positives, negatives + 1, 10.0)[:, :-1] < 0.5).all()  # a negative wins
    with pytest.raises(ValueError, match="at least one"):
        relevancy(positives, negatives[:0], 10.0)


@pytest.mark.parametrize("mode", ["cosine", "relevancy"])
@pytest.mark.parametrize("num", [0, 1, 24, 130])
def test_empty_pixels_are_exactly_zero(mode, num):
    texts, negatives = atoms(3, seed=2), atoms(2, seed=3) if mode == "relevancy" else None
    query = compiled(atoms(num), texts, negatives, mode=mode)
    weights = maps(num)
    weights[1] *= RELEVANCE.empty_norm * 0.5  # barely touched pixels count as empty, too
    scores = relevance_maps(weights, query)
    assert scores.shape == (3, 9, 11)
    assert torch.isfinite(scores).all()
    assert (scores[:, :2] == 0).all()
    assert num == 0 or (scores[:, 2:] != 0).all()


@pytest.mark.parametrize("mode", ["cosine", "relevancy"])
def test_invariances(mode):
    dictionary, weights, texts, negatives = atoms(24), maps(24), atoms(3, seed=2), atoms(2, seed=3)
    negatives = negatives if mode == "relevancy" else None
    expected = relevance_maps(weights, compiled(dictionary, texts, negatives, mode))
    order = torch.randperm(24, generator=torch.Generator().manual_seed(4))
    split = torch.cat((dictionary, dictionary[:1]))  # atom 0 twice, its weight shared out
    shared = torch.cat((weights, 0.3 * weights[..., :1]), -1)
    shared[..., 0] *= 0.7
    variants = {
        "permuted atoms": (weights[..., order], dictionary[order]),
        "split atom": (shared, split),
        "half the alpha": (weights * 0.5, dictionary),
        "an unused atom": (
            torch.cat((weights, 0 * weights[..., :1]), -1),
            torch.cat((dictionary, atoms(1, seed=9))),
        ),
    }
    for name, (changed, other) in variants.items():
        scores = relevance_maps(changed, compiled(other, texts, negatives, mode))
        # float64: only the order of sums differs.
        torch.testing.assert_close(scores, expected, rtol=0, atol=1e-10, msg=name)


def test_many_pixels_are_taken_in_parts():
    query = compiled(atoms(2), atoms(2, seed=2), atoms(2, seed=3))
    weights = maps(2, height=300, width=300)  # 90,000 pixels: two parts
    whole = relevance_maps(weights, query)
    torch.testing.assert_close(whole[:, 290:], relevance_maps(weights[290:], query), rtol=0, atol=1e-12)


def test_gradients_reach_the_weights_and_stay_finite():
    weights = maps(3, height=3, width=2).requires_grad_()
    query = compiled(atoms(3), atoms(2, seed=2), atoms(2, seed=3))
    relevance_maps(weights, query).sum().backward()
    assert weights.grad is not None
    assert torch.isfinite(weights.grad).all()
    assert (weights.grad[0] == 0).all()  # empty pixels
    assert torch.autograd.gradcheck(lambda w: relevance_maps(w, query), maps(3, 3, 2)[1:].requires_grad_())


def test_sizes_must_agree(unchecked):
    query = compiled(atoms(4), atoms(2, seed=2), atoms(2, seed=3))
    with pytest.raises(ValueError, match="weight_maps: expected K = 4, received 5"):
        relevance_maps(maps(5), query)
    narrow = replace(query, prompts=query.prompts[:, :3], negatives=query.negatives[:, :3])
    with pytest.raises(ValueError, match="phrases: expected r = 4, received 3"):
        relevance_maps(maps(4), narrow)


# With the real text tower.

THINGS = ("sofa", "table", "bookcase", "lamp", "plant", "door")


@pytest.fixture(scope="module")
def semantics():
    dictionary = language_space().encode(THINGS)
    return Semantics(torch.arange(6)[:, None], torch.ones(6, 1), dictionary, "minilm")


def scene_of(semantics, **record):
    gaussians = Gaussians(
        torch.zeros(6, 3), torch.zeros(6, 4), torch.ones(6, 3), torch.ones(6), torch.zeros(6, 1, 3)
    )
    eye = torch.eye(4)[None]
    return Scene(gaussians, semantics, eye, eye[:, :3, :3], (8, 8), record=Record(**record))


def test_phrases_find_their_atom(semantics):
    query = compile_query(semantics, language_space(), ["couch", "pot plant", "bookshelf"])
    scores = relevance_maps(torch.eye(6)[None], query)[:, 0]  # one pixel per atom
    assert scores.argmax(1).tolist() == [0, 4, 2]
    assert (scores.amax(1) > query.threshold).all()
    assert query.texts == ("couch", "pot plant", "bookshelf")
    assert query.negative_texts == language_space().negatives


def test_compiled_query_is_reduced(semantics):
    query = compile_query(semantics, language_space(), ["couch"], mode="cosine")
    assert query.factor.shape == (6, 6)
    assert query.prompts.shape == (1, 6)
    assert query.negatives.shape == (0, 6)
    assert query.threshold == language_space().cosine_threshold
    nothing = Semantics(
        torch.zeros(6, 0, dtype=torch.int64), torch.zeros(6, 0), semantics.dictionary[:0], "minilm"
    )
    assert compile_query(nothing, language_space(), ["couch"]).prompts.shape == (1, 0)


def test_negatives_can_be_given(semantics):
    plain = relevance_maps(torch.eye(6)[None], compile_query(semantics, language_space(), ["couch"]))
    against = compile_query(semantics, language_space(), ["couch"], negatives=["sofa"])
    # "sofa" itself is a negative now: on the sofa's atom it fits better than "couch".
    assert plain[0, 0, 0] > 0.9
    assert relevance_maps(torch.eye(6)[None], against)[0, 0, 0] < 0.5


def test_the_scenes_calibration_goes_first(semantics):
    own = {"temperature": 25, "threshold": 0.65, "negatives": ["wall"], "cosine_threshold": 0.3}
    query = compile_query(scene_of(semantics, calibration=own), language_space(), ["couch"])
    assert (query.temperature, query.threshold, query.negative_texts) == (
        25.0,
        nearer_threshold(0.65, 25.0),
        ("wall",),
    )
    query = compile_query(scene_of(semantics, calibration=own), language_space(), ["couch"], mode="cosine")
    assert query.threshold == 0.3
    assert compile_query(scene_of(semantics), language_space(), ["couch"]).temperature == 10.0


@pytest.mark.parametrize(
    "own", [{"temperature": "hot"}, {"temperature": 0}, {"threshold": 2}, {"negatives": 3}]
)
def test_a_damaged_calibration_is_refused(semantics, own):
    with pytest.raises(SceneFileError, match="calibration"):
        compile_query(scene_of(semantics, calibration=own), language_space(), ["couch"])


def test_bad_queries_are_one_sentence(semantics):
    space = language_space()
    with pytest.raises(PromptError, match="no prompt"):
        compile_query(semantics, space, [])
    with pytest.raises(PromptError, match="no prompt"):
        compile_query(semantics, space, "couch")
    with pytest.raises(PromptError, match="empty"):
        compile_query(semantics, space, ["couch", " "])
    with pytest.raises(PromptError, match="negative phrase"):
        compile_query(semantics, space, ["couch"], negatives=[])
    with pytest.raises(PromptError, match="mode 'dot' is unknown"):
        # As a program without the tests' check of signatures calls it.
        unwrap(compile_query)(semantics, space, ["couch"], mode="dot")
    with pytest.raises(PromptError, match="speaks 'minilm' with 384"):
        compile_query(semantics, language_space("clip"), ["couch"])


def test_sixteen_prompts_on_a_large_view_are_quick():
    query = compiled(atoms(24, 384).float(), atoms(16, 384, 2).float(), atoms(4, 384, 3).float())
    weights = maps(24, 480, 640).float()
    seconds = []
    for _ in range(5):
        start = time.process_time()
        relevance_maps(weights, query)
        seconds.append(time.process_time() - start)
    # Measured 0.03 s of one core; processor time, so other work on the machine hardly counts.
    assert min(seconds) < 0.3
