"""Connected things: three chairs are three, whatever their order, unit and distance."""

import numpy as np
import torch

from langflash_core.scene.instances import disc_radii, instances
from langflash_core.scene.settings import INSTANCES
from langflash_core.types import Gaussians
from tests.splat.scenes import unturned


def discs(means: np.ndarray, radius: float | np.ndarray = 0.02) -> Gaussians:
    wide = np.broadcast_to(radius, len(means))
    scales = torch.from_numpy(np.stack((wide, wide, 0.1 * wide), 1).astype(np.float32))
    return unturned(torch.from_numpy(means.astype(np.float32)), scales)


def patch(x: float, z: float = 1.0, side: int = 12, step: float = 0.03) -> np.ndarray:
    """A square of points, `step` apart."""
    ys, xs = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    return np.stack((x + step * xs, step * ys, np.full_like(xs, z, float)), -1).reshape(-1, 3)


def slowly(means: np.ndarray, radii: np.ndarray, link: float) -> list[set[int]]:
    """The parts by all pairs and a flood fill; the twin."""
    apart = np.linalg.norm(means[:, None] - means[None], axis=-1)
    near = apart <= link * (radii[:, None] + radii[None]) / 2
    left, parts = set(range(len(means))), []
    while left:
        part, rim = set(), {left.pop()}
        while rim:
            part |= rim
            rim = {j for i in rim for j in np.flatnonzero(near[i])} & left
            left -= rim
        parts.append(part)
    return parts


def test_three_chairs_are_three():
    means = np.concatenate((patch(0.0), patch(0.6), patch(1.2)))
    numbers = instances(discs(means), np.ones(len(means), bool))
    assert [len(set(part)) for part in np.split(numbers, 3)] == [1, 1, 1] and set(numbers) == {1, 2, 3}


def test_what_touches_is_one_and_what_is_no_member_is_none():
    means = np.concatenate((patch(0.0), patch(0.36), patch(2.0)))
    members = np.arange(len(means)) < 288
    numbers = instances(discs(means), members)
    assert set(numbers[:288]) == {1} and set(numbers[288:]) == {0}


def test_the_largest_surface_is_first_wherever_it_stands_in_the_file():
    means = np.concatenate((patch(0.0, side=6), patch(1.0, side=12)))
    numbers = instances(discs(means), np.ones(len(means), bool))
    assert set(numbers[:36]) == {2} and set(numbers[36:]) == {1}


def test_a_thing_far_away_has_fewer_and_larger_gaussians_and_still_counts():
    near, far = patch(0.0, side=24, step=0.015), patch(2.0, side=6, step=0.06)
    radii = np.concatenate((np.full(576, 0.01), np.full(36, 0.04)))
    numbers = instances(discs(np.concatenate((near, far)), radii), np.ones(612, bool))
    assert set(numbers[:576]) | set(numbers[576:]) == {1, 2} and len(set(numbers[576:])) == 1


def test_crumbs_get_no_number():
    means = np.concatenate((patch(0.0), [[5.0, 5.0, 5.0]]))
    numbers = instances(discs(means), np.ones(len(means), bool))
    assert set(numbers[:-1]) == {1} and numbers[-1] == 0


def test_order_and_unit_change_nothing():
    means = np.concatenate((patch(0.0), patch(0.6, side=8), patch(1.2, side=10)))
    before = instances(discs(means), np.ones(len(means), bool))
    shuffle = np.random.default_rng(0).permutation(len(means))
    for scale in (1e-3, 1.0, 1e3):
        after = instances(discs(scale * means[shuffle], scale * 0.02), np.ones(len(means), bool))
        assert np.array_equal(after, before[shuffle])


def test_parts_are_those_of_all_pairs():
    rng = np.random.default_rng(3)
    centres = rng.uniform(0, 3, (12, 3))
    means = (centres[:, None] + 0.05 * rng.standard_normal((12, 25, 3))).reshape(-1, 3)
    radii = rng.uniform(0.01, 0.02, len(means))
    gaussians = discs(means, radii)
    numbers = instances(gaussians, np.ones(len(means), bool))
    means32 = gaussians.means.double().numpy()
    for part in slowly(means32, disc_radii(gaussians), INSTANCES.link):
        assert len(set(numbers[list(part)])) == 1  # crumbs are 0 together
    kept = [set(np.flatnonzero(numbers == n)) for n in range(1, numbers.max() + 1)]
    assert all(part in slowly(means32, disc_radii(gaussians), INSTANCES.link) for part in kept)


def test_nothing_one_and_nan():
    one = discs(np.zeros((1, 3)))
    assert instances(one, np.zeros(1, bool)).tolist() == [0]
    assert instances(one, np.ones(1, bool)).tolist() == [1]
    broken = np.concatenate((patch(0.0), [[np.nan, 0, 1]]))
    assert set(instances(discs(broken), np.ones(len(broken), bool))[:-1]) == {1}
