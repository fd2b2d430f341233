"""Masks of single photos become groups of the scene: a painted wall with a box in front of it."""

import torch
from torch import Tensor

from langflash_core.geometry.cameras import rays
from langflash_core.network.model import Geometry
from langflash_core.network.semantics.grouping import Groups
from langflash_core.network.semantics.lifting import lifted_weights
from langflash_core.types import Gaussians

SIZE = 96
K = torch.tensor([[90.0, 0, 48], [0, 90.0, 48], [0, 0, 1]])
SHIFTS = (0.0, 0.25, 0.5)  # of the cameras, to the right
RED, BLUE, BOX, WALL = range(4)


def _seen(shift: float) -> tuple[Tensor, Tensor]:
    """Points (H, W, 3) in the world, and what each of them is: a box at 1.5, two patches of a wall at 3."""
    directions = rays(K, SIZE, SIZE)
    near, far = directions * 1.5, directions * 3.0
    near, far = near + torch.tensor([shift, 0, 0]), far + torch.tensor([shift, 0, 0])
    box = ((near[..., 0] - 0.3).abs() < 0.25) & ((near[..., 1] - 0.3).abs() < 0.25)
    kind = torch.full((SIZE, SIZE), WALL)
    kind[(far[..., 0] < -0.1) & (far[..., 1].abs() < 0.8)] = RED
    kind[(far[..., 0] > 0.4) & (far[..., 1] < -0.1)] = BLUE
    kind[box] = BOX
    return torch.where(box[..., None], near, far), kind


def _scene() -> tuple[Geometry, Tensor, Tensor]:
    points, kinds = zip(*(_seen(shift) for shift in SHIFTS), strict=True)
    means = torch.stack(points)
    viewmats = torch.eye(4).repeat(len(SHIFTS), 1, 1)
    viewmats[:, 0, 3] = -torch.tensor(SHIFTS)
    count = means[..., 0].numel()
    gaussians = Gaussians(
        means.reshape(-1, 3), torch.zeros(count, 4), torch.ones(count, 3), torch.ones(count),
        torch.zeros(count, 1, 3),
    )  # fmt: skip
    geometry = Geometry(gaussians, viewmats, means[..., 2], torch.ones(means.shape[:-1]), ())
    return geometry, K.repeat(len(SHIFTS), 1, 1), torch.stack(kinds)


def _masks(kind: Tensor, order: list[int], scores: list[float] | None = None) -> Groups:
    """Sure, stable logits of the named things, in an order of the photo's own."""
    logits = torch.stack([torch.where(kind == k, 6.0, -6.0) for k in order])
    sure = torch.tensor(scores or [0.95] * len(order))
    return Groups(logits[None, None], sure.logit()[None])


def _ids(weights: Tensor) -> Tensor:
    return weights.argmax(1)


def test_one_thing_is_one_group_in_all_photos():
    geometry, Ks, kinds = _scene()
    orders = ([RED, BLUE, BOX], [BOX, RED, BLUE], [BLUE, BOX, RED])
    weights = lifted_weights([_masks(k, o) for k, o in zip(kinds, orders, strict=True)], geometry, Ks)
    assert weights.shape == (3, 4, SIZE, SIZE)
    torch.testing.assert_close(weights.sum(1), torch.ones(3, SIZE, SIZE))
    ids = _ids(weights)
    for kind in (RED, BLUE, BOX):
        inside = ids[kinds == kind]
        # Borders fade over five pixels, so corners of a thing may go to its neighbour.
        assert (inside == inside.mode().values).float().mean() > 0.97
    assert len({int(ids[kinds == kind].mode().values) for kind in range(4)}) == 4
    assert int(ids[kinds == WALL].mode().values) == 3  # what no mask covers comes last


def test_what_hides_a_thing_is_not_joined_with_it():
    """The box covers other parts of the wall in each photo; only points of equal depth are compared."""
    geometry, Ks, kinds = _scene()
    everything = [BOX, RED, BLUE, WALL]
    ids = _ids(lifted_weights([_masks(k, everything) for k in kinds], geometry, Ks))
    assert len({int(ids[kinds == kind].mode().values) for kind in range(4)}) == 4


def test_small_masks_lie_over_large_ones_and_unsure_ones_go():
    geometry, Ks, kinds = _scene()
    one = Geometry(
        geometry.gaussians.map(lambda v: v[: SIZE * SIZE]), geometry.viewmats[:1], geometry.depths[:1],
        geometry.confidences[:1], (),
    )  # fmt: skip
    whole = torch.where(kinds[0] < 9, 6.0, -6.0)
    box = torch.where(kinds[0] == BOX, 6.0, -6.0)
    red = torch.where(kinds[0] == RED, 6.0, -6.0)
    found = Groups(torch.stack((box, whole, red))[None, None], torch.tensor([0.8, 0.99, 0.3]).logit()[None])
    weights = lifted_weights([found], one, Ks[:1])
    assert weights.shape[1] == 2  # the whole and the box; red is not sure; nothing is left over
    ids = _ids(weights)[0]
    assert (ids[kinds[0] == BOX] == 1).float().mean() > 0.97 and (ids[kinds[0] == RED] == 0).all()


def test_no_masks_leave_one_group_and_few_places_keep_the_largest():
    geometry, Ks, kinds = _scene()
    nothing = [_masks(k, [RED], [0.1]) for k in kinds]
    assert torch.equal(lifted_weights(nothing, geometry, Ks), torch.ones(3, 1, SIZE, SIZE))
    masks = [_masks(k, [RED, BLUE, BOX]) for k in kinds]
    assert lifted_weights(masks, geometry, Ks, most=2).shape[1] == 2
