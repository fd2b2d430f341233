"""Rubbish that was planted is found, and little else; strengths mean the same in every unit and order."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.mending.recipes import KINDS
from langflash_core.mending.strength import choose_removed, kind_strengths, least_strengths
from langflash_core.scene.joining import append_part

COUNT = 24


@pytest.fixture(scope="module")
def planted(known):
    """The scene with floaters, sheets, flyaways and crumbs behind its own Gaussians, so many of each."""
    scene, draws = known.scene, torch.Generator().manual_seed(1)
    usual = float(scene.gaussians.scales.amax(1).median())

    def some(**changes):
        rows = torch.randint(len(scene.gaussians), (COUNT,), generator=draws)
        part = scene.rows(rows)
        return replace(part, gaussians=replace(part.gaussians, **changes))

    def places(near, far, spread):
        depth = near + (far - near) * torch.rand(COUNT, 1, generator=draws)
        aside = spread * (torch.rand(COUNT, 2, generator=draws) - 0.5)
        return torch.cat((aside, torch.ones(COUNT, 1)), 1) * depth

    across = torch.eye(3).repeat(COUNT, 1, 1)[:, :, [2, 0, 1]]  # the first axis along z
    long = torch.tensor([60 * usual, usual, 0.4 * usual]).repeat(COUNT, 1)
    ball = torch.tensor([0.05, 0.1, 0.3]) + usual / 3 * torch.randn(COUNT, 3, generator=draws)
    parts = (
        some(means=places(0.2, 0.6, 0.7), scales=torch.full((COUNT, 3), usual)),
        some(means=places(0.8, 0.9, 0.4), quats=matrices_to_quats(across), scales=long),
        some(means=places(30, 90, 0.6)),
        some(means=ball, scales=torch.full((COUNT, 3), usual / 3)),
    )
    whole = scene
    for part in parts:
        whole = append_part(whole, part)
    return whole


def test_what_was_planted_is_found(known, planted):
    own = len(known.scene.gaussians)
    least = least_strengths(planted, np.ones(len(planted.gaussians), bool))
    found = choose_removed(least, 1.0)
    assert found[:own].mean() < 0.03
    for place, kind in enumerate(KINDS):
        assert found[own + place * COUNT :][:COUNT].mean() > 0.8, kind


def test_more_strength_takes_more_and_none_nothing(planted):
    least = least_strengths(planted, np.ones(len(planted.gaussians), bool))
    before = np.zeros(len(least), bool)
    for strength in (0.0, 0.25, 0.5, 1.0):
        found = choose_removed(least, strength)
        assert not (before & ~found).any()
        before = found
    assert not choose_removed(least, 0.0).any() and before.any()


def test_strengths_hold_in_every_unit(planted):
    all_of_them = np.ones(len(planted.gaussians), bool)
    gaussians = planted.gaussians
    larger = replace(gaussians, means=100 * gaussians.means, scales=100 * gaussians.scales)
    viewmats = planted.viewmats.clone()
    viewmats[:, :3, 3] *= 100
    other = replace(planted, gaussians=larger, viewmats=viewmats)
    ours, theirs = (least_strengths(each, all_of_them) for each in (planted, other))
    assert np.allclose(ours, theirs, atol=1e-3)


def test_each_kind_is_the_least_of_its_own_and_what_is_not_shown_stays(planted):
    shown = np.arange(len(planted.gaussians)) % 3 > 0
    each = kind_strengths(planted, shown)
    assert np.array_equal(np.minimum.reduce(list(each.values())), least_strengths(planted, shown))
    assert np.isinf(least_strengths(planted, shown)[~shown]).all()


def test_few_are_left_alone_and_unknown_kinds_refused(planted):
    few = planted.rows(torch.arange(5))
    assert np.isinf(least_strengths(few, np.ones(5, bool))).all()
    with pytest.raises(InputError, match="no kind 'dust'"):
        least_strengths(few, np.ones(5, bool), ["dust"])


def test_every_layer_is_looked_at_by_itself(planted):
    """Two photos that see the same: nothing has more neighbours, or is less alone, for that."""
    planted = planted.with_record(layered=False)
    count = len(planted.gaussians)
    twice = planted.rows(torch.arange(count).repeat(2))
    ids = torch.arange(2).repeat_interleave(count)
    layers = replace(twice, view_ids=ids).with_record(layered=True)
    alone = kind_strengths(planted, np.ones(count, bool), ["floaters"])["floaters"]
    for least in np.split(kind_strengths(layers, np.ones(2 * count, bool))["floaters"], 2):
        assert np.array_equal(least, alone)
    # What no photo made is in both, and goes where it is rubbish in both.
    shared = torch.cat((torch.full((10,), -1), ids[10:]))
    told = kind_strengths(replace(layers, view_ids=shared), np.ones(2 * count, bool))["floaters"]
    assert np.isinf(told[:10]).all() and np.isinf(alone[:10]).all()
