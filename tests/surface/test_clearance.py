"""How far surfaces go on, against the distance to every end on small maps."""

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.surface.clearance import clearances
from langflash_core.surface.settings import UPSAMPLING

CHAMFER = 0.025  # relative: steps of 1, 1.4 and 2.197 instead of the length


def ends(logs: np.ndarray) -> np.ndarray:
    """(n, 2) rows and columns of pixels beside a farther one."""
    height, width = logs.shape
    found = []
    for r, c in np.ndindex(height, width):
        beside = ((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1))
        inside = [(i, j) for i, j in beside if 0 <= i < height and 0 <= j < width]
        if any(logs[place] - logs[r, c] > UPSAMPLING.jump for place in inside):
            found.append((r, c))
    return np.array(found).reshape(-1, 2)


def nearest(logs: np.ndarray, row: int, column: int) -> tuple[float, set[bool]]:
    """The distance to the nearest end, and whether it is of a nearer surface, of all that are as near."""
    places = ends(logs)
    distances = np.hypot(*(places - (row, column)).T)
    as_near = places[distances <= distances.min() * (1 + 2 * CHAMFER) + 1e-6]
    hidden = {bool(logs[row, column] - logs[tuple(place)] > UPSAMPLING.jump) for place in as_near}
    return float(distances.min()), hidden


def surfaces(seed: int, size: tuple[int, int]) -> Tensor:
    """Slanted walls of four depths, cut by random lines."""
    generator = torch.Generator().manual_seed(seed)
    row, column = torch.arange(size[0])[:, None], torch.arange(size[1])
    logs = 0.01 * (row / size[0] + column / size[1])
    for _ in range(2):
        normal, place = torch.randn(2, generator=generator), torch.rand(2, generator=generator)
        beyond = normal[0] * (row - place[0] * size[0]) + normal[1] * (column - place[1] * size[1]) > 0
        logs = logs + (0.1 + torch.rand(1, generator=generator)) * beyond
    return logs


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [(19, 26), (3, 30), (1, 25), (25, 1)])
def test_clearances_are_distances_to_the_nearest_end(seed, size):
    """Where a nearer and an own end are as near, either is right; that is rare."""
    logs = surfaces(seed, size)
    found, logs = clearances(logs).numpy(), logs.numpy()
    if len(ends(logs)) == 0:
        assert np.isinf(found).all()
        return
    either = 0
    for place in np.ndindex(*size):
        distance, hidden = nearest(logs, *place)
        either += len(hidden) == 2
        assert bool(np.isinf(found[place])) in hidden
        if np.isfinite(found[place]):
            assert found[place] - 0.5 == pytest.approx(distance, rel=CHAMFER, abs=1e-6)
    assert either <= 0.1 * found.size


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (12, 15)])
@pytest.mark.parametrize("step", [0.0, 0.9 * UPSAMPLING.jump])
def test_without_a_jump_nothing_ends(size, step):
    logs = step * torch.arange(size[0] * size[1]).view(size) / size[1]
    assert torch.equal(clearances(logs), torch.full(size, torch.inf))


def test_one_pixel_before_a_wall_and_one_hole_in_it():
    """A speck is all end; around a hole the wall ends as a ring does, and what is in it is endless."""
    logs = torch.ones(7, 9)
    logs[3, 4] = 0
    found = clearances(logs)
    assert float(found[3, 4]) == 0.5
    found[3, 4] = torch.inf
    assert found.isinf().all()
    hole = clearances(2 - logs)
    assert hole[3, 4].isinf() and hole[[2, 3, 3, 4], [4, 3, 5, 4]].tolist() == [0.5] * 4
    assert float(hole[3, 0]) == 3.5 and hole.isfinite().sum() == 62
