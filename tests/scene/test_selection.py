"""Growing, floaters, spacing: against brute force and scenes whose answer is known."""

from dataclasses import replace

import numpy as np
import torch

from langflash_core.scene.selection import grow, isolation, spacing, strongest_atoms
from langflash_core.types import Gaussians, Semantics

STRICTNESS = 5.0  # robust deviations: far more than the surfaces here have


def wall_with_floaters(unit: float = 1.0) -> tuple[Gaussians, np.ndarray]:
    """A 40 x 40 sheet with jitter, and 30 Gaussians hanging in front of it."""
    generator = np.random.default_rng(4)
    u, v = np.meshgrid(np.arange(40), np.arange(40))
    sheet = np.stack((u.ravel() * 0.02, v.ravel() * 0.02, np.full(1600, 2.0)), 1)
    sheet += generator.normal(0, 0.003, sheet.shape)
    stray = generator.uniform((0, 0, 0.5), (0.8, 0.8, 1.7), (30, 3))
    means = torch.tensor(np.concatenate((sheet, stray)) * unit, dtype=torch.float32)
    opacities = torch.tensor(np.concatenate((generator.uniform(0.6, 1, 1600), generator.uniform(0.1, 1, 30))))
    quats = torch.zeros(1630, 4)
    quats[:, 0] = 1
    scales = torch.full((1630, 3), 0.012 * unit)
    gaussians = Gaussians(means, quats, scales, opacities.float(), torch.zeros(1630, 1, 3))
    return gaussians, np.arange(1630) >= 1600


def test_floaters_stand_out_and_the_wall_does_not():
    gaussians, stray = wall_with_floaters()
    scores = isolation(gaussians, np.ones(1630, bool))
    assert (scores[stray] >= STRICTNESS).mean() > 0.9
    assert (scores[~stray] >= STRICTNESS).mean() < 0.01


def test_floaters_do_not_depend_on_unit_or_order():
    gaussians, _ = wall_with_floaters()
    scores = isolation(gaussians, np.ones(1630, bool))
    larger = isolation(wall_with_floaters(50.0)[0], np.ones(1630, bool))
    np.testing.assert_allclose(larger, scores, atol=1e-3)  # means and scales are float32
    order = np.random.default_rng(0).permutation(1630)
    shuffled = isolation(gaussians.map(lambda v: v[torch.from_numpy(order)]), np.ones(1630, bool))
    np.testing.assert_allclose(shuffled, scores[order], atol=1e-6)


def test_a_faint_gaussian_is_more_of_a_floater():
    gaussians, _ = wall_with_floaters()
    visible = np.ones(1630, bool)
    faint = gaussians.opacities.clone()
    faint[800] = 0.02
    before, after = (isolation(g, visible)[800] for g in (gaussians, replace(gaussians, opacities=faint)))
    assert after > before + 1


def test_only_visible_gaussians_take_part():
    gaussians, stray = wall_with_floaters()
    assert (isolation(gaussians, ~stray)[stray] == 0).all()
    assert not isolation(gaussians, np.zeros(1630, bool)).any()
    one = np.zeros(1630, bool)
    one[3] = True
    assert not isolation(gaussians, one).any()


def test_growing_equals_brute_force():
    generator = np.random.default_rng(1)
    means = generator.random((300, 3)).astype(np.float32)
    selected, allowed = generator.random(300) < 0.05, generator.random(300) < 0.8
    distances = np.linalg.norm(means[:, None].astype(float) - means[selected].astype(float), axis=-1).min(1)
    expected = selected | (allowed & (distances <= 0.1))
    assert (grow(means, selected, allowed, 0.1) == expected).all() and expected.sum() > selected.sum()
    assert (grow(means, np.zeros(300, bool), allowed, 0.1) == 0).all()


def test_growing_goes_on_among_wide_ones():
    """A row of fine ones, then one of wide ones ten times as far apart, whose reach is as much longer."""
    along = np.concatenate((0.1 * np.arange(40), 4.4 + np.arange(10)))
    means = np.stack((along, 0 * along, 0 * along), -1)
    radii = np.where(along < 4, 0.07, 0.7)
    selected, everyone = along < 4, np.ones(50, bool)
    assert int(grow(means, selected, everyone, 0.2).sum()) == 40
    grown = grow(means, selected, everyone, 0.2, radii)
    assert grown[:41].all() and int(grown.sum()) == 41
    grown = grow(means, grown, everyone, 0.2, radii)
    assert 42 <= int(grown.sum()) < 45  # two spacings at a time, not ten
    fine = grow(means, along < 0.05, everyone, 0.2, radii)
    assert int(fine.sum()) == 3  # where all are of one size, as ever


def test_spacing_of_a_grid_is_its_step():
    grid = np.stack(np.meshgrid(*[np.arange(20) * 0.25] * 3), -1).reshape(-1, 3)
    assert spacing(grid) == 0.25 and spacing(grid[:1]) == 0.0


def test_strongest_atoms_break_no_tie_with_nothing():
    semantics = Semantics(
        torch.tensor([[2, 0], [1, 3], [0, 0]]),
        torch.tensor([[0.2, 0.8], [0.6, 0.4], [0.0, 0.0]]),
        torch.eye(4),
        "minilm",
    )
    assert strongest_atoms(semantics).tolist() == [0, 1, -1]
    empty = replace(semantics, weight_ids=torch.zeros(3, 0).long(), weight_values=torch.zeros(3, 0))
    assert strongest_atoms(empty).tolist() == [-1, -1, -1]
