"""Attention, decoders, DPT, grouping and aggregation: shapes for every view count, and the maths."""

import math
from typing import cast

import pytest
import torch
from torch.nn import functional as F

from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.attention import Attention, CrossBlock, rope_2d, rotate
from langflash_core.network.layers.decoder import TwoStackDecoder, normalised_intrinsics
from langflash_core.network.layers.dpt import DPT
from langflash_core.network.presets import MINI
from langflash_core.network.semantics.aggregation import Aggregation, average_atoms
from langflash_core.network.semantics.grouping import Groups, SemanticGrouping, group_weights, surviving

GRID = (3, 4)


def _tokens(num_views: int) -> Tokens:
    torch.manual_seed(num_views)
    n = GRID[0] * GRID[1]
    hooks = [torch.randn(1, num_views, n, MINI.encoder_dim) for _ in range(7)]
    return Tokens(tuple(hooks[:4]), GRID, tuple(hooks[4:6]), tuple(hooks[6:]))


def _intrinsics(num_views: int) -> torch.Tensor:
    return torch.tensor([[50.0, 0, 28], [0, 50.0, 21], [0, 0, 1]]).expand(1, num_views, 3, 3)


def test_rotary_scores_depend_on_the_offset_alone():
    code = rope_2d((6, 6), 32, 100.0).double()
    torch.manual_seed(0)
    q, k = torch.randn(32, dtype=torch.float64), torch.randn(32, dtype=torch.float64)
    turned_q = rotate(q.expand(1, 1, 36, 32), code)[0, 0]
    turned_k = rotate(k.expand(1, 1, 36, 32), code)[0, 0]
    scores = turned_q @ turned_k.T
    assert scores[0, 8] == pytest.approx(scores[14, 22].item(), abs=1e-5)  # both (+1, +2); float32 angles
    assert abs(scores[0, 8] - scores[0, 7]) > 1e-4


def test_rotation_keeps_norms():
    tokens = torch.randn(2, 4, 13, 32)
    turned = rotate(tokens, rope_2d((3, 4), 32, 100.0, extra=1))
    assert torch.allclose(turned.norm(dim=-1), tokens.norm(dim=-1), rtol=1e-5)


def test_attention_equals_its_float64_twin():
    torch.manual_seed(0)
    layer = Attention(32, 4).double()
    q, kv = torch.randn(2, 5, 32).double(), torch.randn(2, 7, 32).double()
    split = lambda x: x.unflatten(-1, (4, 8)).transpose(1, 2)  # noqa: E731
    scores = split(layer.query(q)) @ split(layer.key(kv)).transpose(-1, -2) / math.sqrt(8)
    expected = layer.out((scores.softmax(-1) @ split(layer.value(kv))).transpose(1, 2).flatten(2))
    assert torch.allclose(layer(q, kv, kv), expected, atol=1e-12)


@pytest.mark.parametrize("num_views", [1, 2, 3, 8])
def test_decoder_keeps_views_and_stays_finite(num_views):
    decoder = TwoStackDecoder(MINI).eval()
    middle, last = decoder(_tokens(num_views), _intrinsics(num_views))
    assert middle.shape == last.shape == (1, num_views, 12, MINI.decoder_dim)
    assert torch.isfinite(last).all()


@pytest.mark.parametrize("num_views", [1, 2, 3, 5])
def test_a_layer_of_the_stacks_equals_every_view_reading_all_others(num_views):
    """Keys and values made once, in a ring, against a memory gathered for each view; both round float64."""
    decoder = TwoStackDecoder(MINI).double().eval()
    x = torch.randn(2, num_views, GRID[0] * GRID[1] + 1, MINI.decoder_dim).double()
    code = rope_2d(GRID, MINI.decoder_dim // MINI.decoder_heads, MINI.rope_base, extra=1)
    first, other = cast(CrossBlock, decoder.first[0]), cast(CrossBlock, decoder.other[0])
    expected = []
    for view in range(num_views):
        block, others = other if view else first, [v for v in range(num_views) if v != view] or [view]
        memory = torch.cat([x[:, v] for v in others], 1)
        expected.append(block(x[:, view], block.memory(memory, code.repeat(1, len(others), 1)), code))
    assert torch.allclose(
        decoder._layer(x, code, first, other, None), torch.stack(expected, 1), rtol=0, atol=1e-12
    )


def test_decoder_treats_other_views_alike_and_reads_them():
    """Exchanging views 1 and 2 exchanges their tokens and leaves view 0 alone."""
    decoder = TwoStackDecoder(MINI).eval()
    tokens = _tokens(3)
    swapped = tokens.views([0, 2, 1])
    _, plain = decoder(tokens, _intrinsics(3))
    _, exchanged = decoder(swapped, _intrinsics(3))
    assert torch.allclose(plain[:, [0, 2, 1]], exchanged, atol=1e-5)  # sums run in another order
    alone = tokens.views([0])
    assert not torch.allclose(decoder(alone, _intrinsics(1))[1][:, 0], plain[:, 0], atol=1e-3)


def test_intrinsics_are_normalised_by_the_picture():
    small = normalised_intrinsics(_intrinsics(1), 56, 42)
    large = normalised_intrinsics(_intrinsics(1) * torch.tensor([2.0, 2.0, 1.0])[:, None], 112, 84)
    assert torch.allclose(small, large)


@pytest.mark.parametrize("grid", [(4, 4), (3, 5), (1, 1)])
def test_dpt_paths_double_from_the_grid(grid):
    dpt = DPT((8, 8, 8, 8), (4, 6, 8, 10), 5)
    paths = dpt(tuple(torch.randn(2, 8, *grid) for _ in range(4)))
    for scale, path in zip(
        (1, 2, 4, 8), (paths.path_4, paths.path_3, paths.path_2, paths.path_1), strict=True
    ):
        assert path.shape == (2, 5, scale * grid[0], scale * grid[1])


@pytest.mark.parametrize("num_views", [1, 2, 3, 8])
def test_grouping_answers_once_per_scale(num_views):
    grouping = SemanticGrouping(MINI).eval()
    memories = tuple(torch.randn(num_views, MINI.dpt_feature, s * 3, s * 4) for s in (1, 2, 4))
    answers = grouping(memories, torch.randn(num_views, MINI.dpt_feature, 24, 32), num_views)
    assert len(answers) == 3
    assert answers[-1].mask_logits.shape == (1, num_views, MINI.num_queries, 24, 32)
    assert answers[-1].existence_logits.shape == (1, MINI.num_queries)


def _groups(existence: list[float], strongest: list[float]) -> Groups:
    logits = torch.full((1, 2, len(existence), 4, 4), -9.0)
    logits[0, 1, :, 2, 2] = torch.logit(torch.tensor(strongest))
    return Groups(logits, torch.logit(torch.tensor(existence))[None])


def test_survivors_need_existence_and_a_pixel():
    groups = _groups([0.9, 0.4, 0.9, 0.6], [0.9, 0.9, 0.4, 0.6])
    assert surviving(groups, 0.5).tolist() == [0, 3]


def test_the_threshold_itself_does_not_survive():
    assert surviving(_groups([0.5], [0.9]), 0.5).tolist() == []


@pytest.mark.parametrize("num_survivors", [0, 1, 4])
def test_weights_of_survivors_sum_to_one(num_survivors):
    groups = _groups([0.9] * 4, [0.9] * 4)
    weights = group_weights(groups, torch.arange(num_survivors), (13, 17))
    assert weights.shape == (2, num_survivors, 13, 17)
    if num_survivors:
        assert torch.allclose(weights.sum(1), torch.ones(2, 13, 17), atol=1e-6)  # float32 softmax


def test_extreme_logits_give_finite_weights():
    logits = torch.tensor([1e4, -1e4, 1e4])[:, None, None].expand(1, 1, 3, 4, 4)
    weights = group_weights(Groups(logits, torch.ones(1, 3)), torch.arange(3), (8, 8))
    assert torch.isfinite(weights).all()
    assert weights[0, 1].max() == 0


def _average_twin(weights, features, eps):
    B, V, K, h, w = weights.shape
    atoms = torch.zeros(B, K, features.shape[2], dtype=torch.float64)
    for b in range(B):
        for k in range(K):
            total = sum(weights[b, v, k, y, x] for v in range(V) for y in range(h) for x in range(w))
            for v in range(V):
                for y in range(h):
                    for x in range(w):
                        atoms[b, k] += weights[b, v, k, y, x] * features[b, v, :, y, x] / (total + eps)
    return atoms


def test_average_atoms_equal_the_loop():
    torch.manual_seed(0)
    weights = torch.rand(2, 2, 3, 2, 3, dtype=torch.float64).softmax(2)
    features = F.normalize(torch.randn(2, 2, 5, 2, 3, dtype=torch.float64), dim=2)
    expected = _average_twin(weights, features, 1e-6)
    assert torch.allclose(average_atoms(weights, features), expected, atol=1e-12)


def test_aggregation_starts_as_the_average_and_is_unit():
    torch.manual_seed(0)
    weights = torch.rand(1, 2, 4, 8, 8).softmax(2)
    features = F.normalize(torch.randn(1, 2, MINI.language_dim, 8, 8), dim=2)
    atoms = Aggregation(MINI).eval()(weights, features)
    assert torch.allclose(atoms, F.normalize(average_atoms(weights, features), dim=-1), atol=1e-6)


def test_aggregation_of_nothing_is_empty_and_of_an_empty_group_is_finite():
    features = F.normalize(torch.randn(1, 1, MINI.language_dim, 4, 4), dim=2)
    aggregation = Aggregation(MINI).eval()
    assert aggregation(torch.zeros(1, 1, 0, 4, 4), features).shape == (1, 0, MINI.language_dim)
    assert torch.isfinite(aggregation(torch.zeros(1, 1, 2, 4, 4), features)).all()
