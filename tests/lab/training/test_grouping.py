"""Matching and the two group losses: against brute force, at the ends, and without any group."""

import itertools

import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.training.grouping import (
    AggregationWeights,
    GroupingWeights,
    GroupTexts,
    aggregation_loss,
    grouping_loss,
    mask_quality,
    match,
)
from langflash_core.lab.training.losses import dice_pairs, focal_pairs
from tests.lab.training import reference

WEIGHTS = GroupingWeights()


def case(queries: int = 5, groups: int = 3, pixels: int = 30):
    generator = torch.Generator().manual_seed(0)
    masks = F.one_hot(torch.randint(groups, (pixels,), generator=generator), groups).T.float()
    logits = torch.randn(queries, pixels, generator=generator)
    return logits, torch.randn(queries, generator=generator), masks


def test_the_assignment_is_the_cheapest():
    logits, existence, masks = case()
    cost = WEIGHTS.focal * focal_pairs(logits, masks) + WEIGHTS.dice * dice_pairs(logits, masks)
    cost = cost - WEIGHTS.existence * existence.sigmoid()[:, None]
    best = min(
        sum(float(cost[q, g]) for g, q in enumerate(order)) for order in itertools.permutations(range(5), 3)
    )
    chosen = match(logits, existence, masks, WEIGHTS)
    assert float(cost[chosen.queries, chosen.groups].sum()) == pytest.approx(best, rel=1e-5)  # float32 sums


def test_grouping_loss_is_the_sum_of_its_terms():
    logits, existence, masks = case()
    value, chosen = grouping_loss(logits, existence, masks, WEIGHTS)
    pairs = list(zip(chosen.queries.tolist(), chosen.groups.tolist(), strict=True))
    focal = sum(reference.focal_twin(logits[q].numpy(), masks[g].numpy()) for q, g in pairs) / len(pairs)
    dice = sum(reference.dice_twin(logits[q].numpy(), masks[g].numpy()) for q, g in pairs) / len(pairs)
    there = torch.zeros(5).index_fill(0, chosen.queries, 1)
    costs = torch.where(there > 0, 1.0, WEIGHTS.no_object)
    entropy = (
        F.binary_cross_entropy_with_logits(existence, there, weight=costs, reduction="sum") / costs.sum()
    )
    expected = 20 * focal + dice + 2 * float(entropy)
    assert float(value) == pytest.approx(expected, rel=1e-5)  # float32 against float64


def test_perfect_masks_cost_next_to_nothing():
    _, _, masks = case()
    logits = torch.cat((masks, torch.zeros(2, masks.shape[1]))) * 40 - 20
    existence = torch.tensor([20.0, 20, 20, -20, -20])
    value, chosen = grouping_loss(logits, existence, masks, WEIGHTS)
    assert float(value) < 1e-3
    assert mask_quality(logits[chosen.queries], masks[chosen.groups]).min() > 0.999


def test_a_scene_without_groups_trains_existence_alone():
    logits, existence, _ = case()
    logits = logits.requires_grad_()
    existence = existence.requires_grad_()
    value, chosen = grouping_loss(logits, existence, torch.zeros(0, 30), WEIGHTS)
    value.backward()
    assert len(chosen.queries) == 0
    assert logits.grad is None
    assert existence.grad is not None
    assert bool((existence.grad > 0).all())  # every query is told that it does not exist


def test_more_groups_than_queries_are_matched_as_far_as_they_go():
    logits, existence, _ = case(queries=2)
    masks = torch.eye(4).repeat_interleave(8, 1)[:, :30]
    _, chosen = grouping_loss(logits, existence, masks, WEIGHTS)
    assert len(chosen.queries) == 2
    assert len(set(chosen.groups.tolist())) == 2


def test_diverged_logits_are_refused():
    logits, existence, masks = case()
    logits[0, 0] = torch.nan
    with pytest.raises(ValueError, match="mask_logits"):
        match(logits, existence, masks, WEIGHTS)


def aggregation_case():
    generator = torch.Generator().manual_seed(1)
    unit = [F.normalize(torch.randn(n, 8, generator=generator), dim=-1) for n in (3, 3, 6)]
    return unit[0], unit[1], GroupTexts(unit[2][:3], unit[2])


def test_aggregation_loss_is_the_sum_of_its_terms():
    atoms, pooled, texts = aggregation_case()
    quality = torch.tensor([0.9, 0.1, 0.5])
    value = float(aggregation_loss(atoms, pooled, quality, texts, AggregationWeights()))
    share = quality / (quality.sum() + 1e-6)
    initial = (1 - (atoms * pooled).sum(1)).mean()
    truth = (share * (1 - (atoms * texts.truth).sum(1))).sum()
    text = 0.0
    for n in range(3):
        positive = 14 * atoms[n] @ texts.truth[n]
        rivals = [14 * atoms[n] @ t for t in texts.bank if float(t @ texts.truth[n]) <= 0.6]
        text += share[n] * (torch.stack((positive, *rivals)).exp().sum().log() - positive)
    assert value == pytest.approx(float(0.5 * initial + truth + text), rel=1e-5)  # float32 sums


def test_what_is_true_of_a_group_is_no_rival():
    atoms, pooled, texts = aggregation_case()
    quality, weights = torch.ones(3), AggregationWeights(initial=0.0, truth=0.0)
    everything = GroupTexts(texts.truth, texts.bank, torch.ones(3, 6, dtype=torch.bool))
    assert float(aggregation_loss(atoms, pooled, quality, everything, weights)) == pytest.approx(0, abs=1e-6)
    nothing = GroupTexts(texts.truth, texts.bank, torch.zeros(3, 6, dtype=torch.bool))
    assert float(aggregation_loss(atoms, pooled, quality, nothing, weights)) > 0.1


def test_a_leaking_mask_teaches_nothing():
    atoms, pooled, texts = aggregation_case()
    atoms = atoms.requires_grad_()
    weights = AggregationWeights(initial=0.0)
    aggregation_loss(atoms, pooled, torch.tensor([1.0, 0.0, 1.0]), texts, weights).backward()
    assert atoms.grad is not None
    assert float(atoms.grad[1].abs().max()) == 0
    assert float(atoms.grad[0].abs().max()) > 0


def test_no_matched_group_costs_nothing():
    empty = torch.zeros(0, 8)
    texts = GroupTexts(empty, torch.eye(8))
    assert float(aggregation_loss(empty, empty, torch.zeros(0), texts, AggregationWeights())) == 0
