"""Scenes cut into parts where pixels look alike to the mask map, and only there."""

from dataclasses import replace

import pytest
import torch
from torch.nn import functional as F

from langflash_core.network.presets import Splitting
from langflash_core.network.semantics import splitting
from langflash_core.network.semantics.splitting import cluster, split_groups

RULE = Splitting()
SIZE = (64, 128)


def _embeddings(*columns: int, cosine: float = 0.3, noise: float = 0.02) -> torch.Tensor:
    """Mask maps (1, 16, 16, 32): vertical bands of vectors with a given mutual cosine."""
    basis = torch.eye(16)
    kinds = [F.normalize(cosine**0.5 * basis[0] + (1 - cosine) ** 0.5 * basis[c + 1], dim=0) for c in columns]
    bands = torch.stack([kinds[x * len(kinds) // 32] for x in range(32)], -1)  # (16, 32)
    maps = bands[None, :, None, :].expand(1, 16, 16, 32)
    return 3 * (maps + noise * torch.randn(maps.shape, generator=torch.manual_seed(0)))


def _one_group() -> torch.Tensor:
    return torch.ones(1, 1, 16, 32)


def test_a_group_of_two_things_becomes_two():
    parts = split_groups(_one_group(), _embeddings(0, 1), RULE, SIZE)
    assert parts.shape == (1, 2, *SIZE)
    halves = parts[0, :, :, :56].mean((1, 2)), parts[0, :, :, 72:].mean((1, 2))
    assert (halves[0] - halves[1]).abs().min() > 0.9  # each part owns one half


def test_parts_share_every_pixel():
    weights = torch.rand(2, 3, 16, 32, generator=torch.manual_seed(1)).softmax(1)
    parts = split_groups(weights, _embeddings(0, 1, 2).expand(2, -1, -1, -1), RULE, SIZE)
    assert parts.shape[1] >= 3 and (parts >= 0).all()
    assert torch.allclose(parts.sum(1), torch.ones(2, *SIZE), atol=1e-5)  # float32 softmax


@pytest.mark.parametrize("columns", [(0,), (3, 3)])
def test_one_thing_is_one_part(columns):
    parts = split_groups(_one_group(), _embeddings(*columns), RULE, SIZE)
    assert torch.equal(parts, torch.ones(1, 1, *SIZE))


def test_what_nearly_looks_alike_stays_together():
    assert split_groups(_one_group(), _embeddings(0, 1, cosine=0.97), RULE, SIZE).shape[1] == 1


def test_the_queries_answer_keeps_look_alikes_apart():
    """Two chairs of one look: the map cannot tell them apart, two queries can."""
    weights = torch.zeros(1, 2, 16, 32)
    weights[:, 0, :, :16], weights[:, 1, :, 16:] = 1, 1
    assert split_groups(weights, _embeddings(0), RULE, SIZE).shape[1] == 2
    deaf = replace(RULE, agreement=0.0)
    assert split_groups(weights, _embeddings(0), deaf, SIZE).shape[1] == 1


@pytest.mark.parametrize("max_parts", [1, 3])
def test_there_are_never_more_parts_than_allowed(max_parts):
    parts = split_groups(_one_group(), _embeddings(*range(8)), replace(RULE, max_parts=max_parts), SIZE)
    assert 1 <= parts.shape[1] <= max_parts


def test_no_groups_flat_maps_and_single_pixels_are_finite():
    assert split_groups(torch.zeros(2, 0, 8, 8), torch.rand(2, 4, 8, 8), RULE, SIZE).shape == (2, 0, *SIZE)
    assert torch.equal(
        split_groups(_one_group(), torch.zeros(1, 16, 16, 32), RULE, SIZE), torch.ones(1, 1, *SIZE)
    )
    assert split_groups(torch.ones(1, 1, 1, 1), torch.ones(1, 4, 1, 1), RULE, SIZE).shape == (1, 1, *SIZE)


def test_clusters_are_the_best_of_their_kind():
    """Spherical k-means ends where every vector sits with its nearest centre, the mean of its own."""
    vectors = F.normalize(_embeddings(0, 1, 2)[0].flatten(1).T, dim=-1)
    centres = cluster(vectors, replace(RULE, max_parts=3))
    assert len(centres) == 3
    nearest = (vectors @ centres.T).argmax(1)
    for index, centre in enumerate(centres):
        assert F.cosine_similarity(vectors[nearest == index].mean(0), centre, dim=0) > 1 - 1e-5
    assert torch.equal(cluster(vectors, replace(RULE, max_parts=3)), centres)


def test_what_is_called_differently_is_cut_apart():
    """One group of one look, whose halves point to different words; without features it stays whole."""
    features = torch.zeros(1, 384, 4, 8)
    features[:, 0, :, :4], features[:, 7, :, 4:] = 1, 1
    parts = split_groups(_one_group(), _embeddings(0), RULE, SIZE, features)
    assert split_groups(_one_group(), _embeddings(0), RULE, SIZE).shape[1] == 1
    assert parts.shape[1] == 2
    left, right = parts[0, :, :, : SIZE[1] // 4], parts[0, :, :, -SIZE[1] // 4 :]
    assert left.mean((1, 2)).argmax() != right.mean((1, 2)).argmax()


def test_few_directions_keep_the_cosines_of_a_scene():
    """Features of a scene are mixtures of few words: 20 of them, and noise of a tenth."""
    generator = torch.Generator().manual_seed(3)
    words = torch.nn.functional.normalize(torch.randn(20, 384, generator=generator), dim=1)
    mixed = torch.rand(2, 6, 8, 20, generator=generator) ** 4 @ words
    noise = 0.1 * mixed.norm(dim=-1, keepdim=True) / 384**0.5
    mixed = mixed + noise * torch.randn(mixed.shape, generator=generator)
    maps = torch.nn.functional.normalize(mixed, dim=-1).movedim(-1, 1)
    small = splitting.condense_features(maps)
    assert small.shape == (2, 32, 6, 8)
    flat, thin = (m.movedim(1, -1).flatten(0, 2) for m in (maps, small))
    # What is lost is noise, a tenth of a vector: at most .1^2 of a cosine, and room for twice that.
    assert float((flat @ flat.T - thin @ thin.T).abs().max()) < 0.02
