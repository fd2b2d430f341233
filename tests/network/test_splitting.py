"""Groups split where language says they hold two things, and only there."""

import pytest
import torch
from torch.nn import functional as F

from langflash_core.network.presets import Splitting
from langflash_core.network.splitting import cluster, split_groups

RULE = Splitting()


def _features(*columns: int, cosine: float = 0.3, noise: float = 0.05) -> torch.Tensor:
    """Language maps (1, 16, 16, 32): vertical bands of unit vectors with a given mutual cosine."""
    basis = torch.eye(16)
    words = [F.normalize(cosine**0.5 * basis[0] + (1 - cosine) ** 0.5 * basis[w + 1], dim=0) for w in columns]
    bands = torch.stack([words[x * len(words) // 32] for x in range(32)], -1)  # (16, 32)
    maps = bands[None, :, None, :].expand(1, 16, 16, 32)
    return F.normalize(maps + noise * torch.randn(maps.shape, generator=torch.manual_seed(0)), dim=1)


def test_a_group_of_two_things_becomes_two():
    weights = torch.ones(1, 1, 64, 128)
    parts = split_groups(weights, _features(0, 1), RULE)
    assert parts.shape == (1, 2, 64, 128)
    halves = parts[0, :, :, :56].mean((1, 2)), parts[0, :, :, 72:].mean((1, 2))
    assert (halves[0] - halves[1]).abs().min() > 0.9  # each part owns one half


def test_parts_sum_to_their_group():
    torch.manual_seed(1)
    weights = torch.rand(1, 3, 64, 128).softmax(1)
    weights[:, 0, :, :] += 2
    weights = weights / weights.sum(1, keepdim=True)
    parts = split_groups(weights, _features(0, 1, 2), RULE)
    assert parts.shape[1] > 3 and (parts >= 0).all()
    assert torch.allclose(parts.sum(1), torch.ones(1, 64, 128), atol=1e-5)  # float32 softmax


@pytest.mark.parametrize("columns", [(0,), (3, 3)])
def test_one_thing_stays_one_group(columns):
    weights = torch.ones(1, 1, 64, 128)
    assert torch.equal(split_groups(weights, _features(*columns), RULE), weights)


def test_near_synonyms_and_specks_stay_together():
    weights = torch.ones(1, 1, 64, 128)
    assert split_groups(weights, _features(0, 1, cosine=0.95, noise=0.01), RULE).shape[1] == 1
    speck = _features(0).clone()
    speck[:, :, 3, 5] = _features(1)[:, :, 3, 5]  # one of 512 pixels: 0.2 %
    assert split_groups(weights, speck, RULE).shape[1] == 1


def test_no_groups_and_empty_groups():
    assert split_groups(torch.zeros(2, 0, 8, 8), torch.rand(2, 4, 4, 4), RULE).shape == (2, 0, 8, 8)
    weights = torch.stack((torch.ones(64, 128), torch.zeros(64, 128)))[None]
    assert split_groups(weights, _features(0), RULE).shape[1] == 2


def test_clusters_are_the_best_of_their_kind():
    """Spherical k-means ends where every vector sits with its nearest centre, the mean of its own."""
    vectors = _features(0, 1, 2, noise=0.1)[0].flatten(1).T
    centres = cluster(vectors, RULE, len(vectors))
    assert len(centres) == 3
    nearest = (vectors @ centres.T).argmax(1)
    for index, centre in enumerate(centres):
        assert F.cosine_similarity(vectors[nearest == index].mean(0), centre, dim=0) > 1 - 1e-5
    assert torch.equal(cluster(vectors, RULE, len(vectors)), centres)
