"""Attention, decoders, DPT, grouping and aggregation: shapes for every view count, and the maths."""

from typing import cast

import pytest
import torch
from torch.nn import functional as F

from langflash_core.network.layers.attention import CrossBlock, rope_2d
from langflash_core.network.layers.decoder import TwoStackDecoder, normalised_intrinsics
from langflash_core.network.presets import MINI
from langflash_core.network.semantics.aggregation import Aggregation, average_atoms
from langflash_core.network.semantics.grouping import Groups, group_weights, surviving

GRID = (3, 4)


def _intrinsics(num_views: int) -> torch.Tensor:
    return torch.tensor([[50.0, 0, 28], [0, 50.0, 21], [0, 0, 1]]).expand(1, num_views, 3, 3)


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


def test_intrinsics_are_normalised_by_the_picture():
    small = normalised_intrinsics(_intrinsics(1), 56, 42)
    large = normalised_intrinsics(_intrinsics(1) * torch.tensor([2.0, 2.0, 1.0])[:, None], 112, 84)
    assert torch.allclose(small, large)


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
