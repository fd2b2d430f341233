"""Blocks against a slow twin that goes through them one by one."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.surfels import covered_areas
from langflash_core.mending.coarse import coarsen
from langflash_core.mending.settings import COARSENING

SIDE = 0.15


@pytest.mark.parametrize("squares", [True, False])
def test_a_block_is_the_mean_of_its_cube(known, squares):
    part = known.scene.rows(known.members)
    made = coarsen(part, SIDE, squares=squares)
    means = part.gaussians.means.double().numpy()
    colours = (0.5 + SH_C0 * part.gaussians.sh[:, 0].double()).numpy()
    areas, cubes = covered_areas(part.gaussians), np.floor(means / SIDE).astype(int)
    expected = set()
    for cube in np.unique(cubes, axis=0):
        rows = (cubes == cube).all(1)
        mean = (colours[rows] * areas[rows, None]).sum(0) / areas[rows].sum()
        expected.add(tuple((mean.clip(0, 1) * (COARSENING.levels - 1)).round().astype(int).tolist()))
    shown = ((0.5 + SH_C0 * made.gaussians.sh[:, 0]) * (COARSENING.levels - 1)).double().numpy()
    if squares:
        assert {tuple(row) for row in shown.round().astype(int).tolist()} == expected
        assert np.abs(shown - shown.round()).max() < 1e-3  # nothing below the steps
    else:
        assert shown.min() >= np.min(list(expected)) - 1e-3 and shown.max() <= np.max(list(expected)) + 1e-3


def test_what_is_made_is_coarse_and_whole(known):
    part = known.scene.rows(known.members)
    more = torch.ones(len(part.gaussians), 3, 3)
    rough = replace(part.gaussians, sh=torch.cat((part.gaussians.sh, more), 1))
    made = coarsen(replace(part, gaussians=rough), SIDE, squares=True)
    assert made.gaussians.sh.shape[1] == 1  # harmonics are gone
    assert made.levels is not None and not bool(made.levels.any())
    totals = made.semantics.weight_values.sum(1)
    assert torch.allclose(totals, torch.ones_like(totals), atol=1e-5)
    nearest = torch.cdist(made.gaussians.means, part.gaussians.means).amin(1)
    assert float(nearest.max()) < 1.5 * SIDE


def test_places_are_steps(known):
    """One place a block, in eighths of its side: what a block is made of moves it only in steps."""
    part = known.scene.rows(known.members)
    still = coarsen(part, SIDE, squares=True)
    moved = replace(part.gaussians, means=part.gaussians.means + 1e-5)
    again = coarsen(replace(part, gaussians=moved), SIDE, squares=True)
    same = torch.cdist(still.gaussians.means, again.gaussians.means).amin(1) < 1e-6
    assert float(same.float().mean()) > 0.9


def test_a_side_of_nothing_is_refused(known):
    with pytest.raises(ValueError, match="above 0"):
        coarsen(known.scene, 0.0, squares=True)
