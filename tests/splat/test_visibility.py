"""Shares of the photos, against weights drawn by the reference rasteriser."""

from dataclasses import replace

import torch

from langflash_core.splat import compose
from langflash_core.splat.reference import render
from langflash_core.splat.visibility import seen_shares
from langflash_core.types import Semantics
from tests.app.cli.conftest import stripes
from tests.splat.test_compose import layered


def test_shares_are_the_weight_maps_means():
    """Each stripe's sum is what its drawn weights come to; the twin leaves nothing out (`mixing.SMALL`)."""
    scene = stripes()
    shares = seen_shares(scene)
    assert shares.shape == (2, len(scene.gaussians)) and float(shares.sum(1).max()) <= 1
    for view in range(2):
        maps = render(scene, scene.camera(view)).weight_maps
        assert maps is not None
        for atom, drawn in enumerate(maps.mean((0, 1)).tolist()):
            own = float(shares[view, scene.semantics.weight_ids[:, 0] == atom].sum())
            assert abs(own - drawn) < 0.03 * drawn


def test_hidden_and_broken_ones_have_none():
    scene = stripes()
    scene.gaussians.means[::2, 2] = 3.0  # behind the others, twice as dense as they need be
    scene.gaussians.scales[1::2] *= 2
    scene.gaussians.means[1] = torch.nan
    shares = seen_shares(scene)
    assert float(shares[:, ::2].sum()) < 0.01 * float(shares.sum()) and float(shares[0, 1]) == 0


def test_nothing_is_seen_of_nothing():
    assert seen_shares(stripes().rows(torch.zeros(42 * 56, dtype=torch.bool))).shape == (2, 0)


def test_of_layers_shares_are_those_of_the_blended_picture():
    """The twin: a weight map for each Gaussian, blended."""
    scene = layered([(2, 0.2, 0), (2.1, 0.8, 1)], [0.0, 0.5])
    count = len(scene.gaussians)
    own = Semantics(torch.arange(count)[:, None], torch.ones(count, 1), torch.eye(count), "test")
    shares = seen_shares(scene)
    for view in range(2):
        maps = compose.render(replace(scene, semantics=own), scene.camera(view)).weight_maps
        assert maps is not None
        # `mixing` leaves contributions below .01 out: 2 % of the light
        assert float((shares[view] - maps.mean((0, 1))).abs().sum()) < 0.03
        assert float(shares[view].sum()) <= 1
