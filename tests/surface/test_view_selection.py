"""Every surface is covered by the photo that sees it finest, and by one."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, rays, transform, unproject
from langflash_core.geometry.vantage import from_the_middle, leading
from langflash_core.rig.rig import Rig
from langflash_core.surface import view_selection
from langflash_core.surface.settings import VIEW_SELECTION

BEHIND, BEFORE = VIEW_SELECTION.behind, VIEW_SELECTION.before

HEIGHT, WIDTH = 24, 32
WALL = (0.0, 0.0, 1.0), 3.0  # n x = d, in the world


def select_views(depths: Tensor, viewmats: Tensor, Ks: Tensor, *known: Tensor) -> Tensor:
    return view_selection.select_views(Rig(viewmats, Ks, depths), *known)


def find_covered(depths: Tensor, viewmats: Tensor, Ks: Tensor, keep: Tensor) -> Tensor:
    return view_selection.find_covered(Rig(viewmats, Ks, depths), keep)


def fill_uncovered(depths: Tensor, viewmats: Tensor, Ks: Tensor, keep: Tensor, known: Tensor) -> Tensor:
    return view_selection.fill_uncovered(Rig(viewmats, Ks, depths), keep, known)


def camera(
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: tuple[float, float] = (0.0, 0.0)
) -> Tensor:
    """viewmat of a camera at `centre`, turned to the right and then down, radians."""
    right, down = torch.tensor(turn)
    yaw = torch.tensor([[right.cos(), 0, -right.sin()], [0, 1, 0], [right.sin(), 0, right.cos()]])
    pitch = torch.tensor([[1, 0, 0], [0, down.cos(), -down.sin()], [0, down.sin(), down.cos()]])
    viewmat = torch.eye(4)
    viewmat[:3, :3] = pitch @ yaw
    viewmat[:3, 3] = -viewmat[:3, :3] @ torch.tensor(centre)
    return viewmat


def lens(views: int, fov: float = 60) -> Tensor:
    return intrinsics_from_fov(fov, WIDTH, HEIGHT).repeat(views, 1, 1)


def depths_of(planes: list[tuple[tuple[float, float, float], float]], viewmat: Tensor, K: Tensor) -> Tensor:
    """(H, W) of the nearest of some planes (n, d)."""
    pose, ahead = invert_rigid(viewmat), rays(K, WIDTH, HEIGHT)
    found = torch.full((HEIGHT, WIDTH), 1e3)
    for normal, distance in planes:
        n = torch.tensor(normal)
        along = ahead @ (pose[:3, :3].T @ n)
        z = (distance - n @ pose[:3, 3]) / torch.where(along.abs() < 1e-6, 1e-6, along)
        found = torch.where((z > 0) & (z < found), z, found)
    return found


def seen(viewmats: list[Tensor], planes=(WALL,), fov: float = 60) -> tuple[Tensor, Tensor, Tensor]:
    """Depths, poses and lenses of views of some planes."""
    Ks = lens(len(viewmats), fov)
    maps = [depths_of(list(planes), viewmat, K) for viewmat, K in zip(viewmats, Ks, strict=True)]
    return torch.stack(maps), torch.stack(viewmats), Ks


def inside(depths: Tensor, viewmats: Tensor, Ks: Tensor, view: int, other: int, margin: float = 0) -> Tensor:
    """(H, W) bool: cells of a view whose surface lies in the picture of another."""
    points = transform(invert_rigid(viewmats[view]), unproject(depths[view], Ks[view]).flatten(0, 1))
    pos_c = transform(viewmats[other], points)
    at = pos_c[:, :2] / pos_c[:, 2:] * Ks[other, 0, 0] + Ks[other, :2, 2]
    limit = torch.tensor([WIDTH, HEIGHT])
    return ((pos_c[:, 2] > 0) & (at > margin).all(-1) & (at < limit - margin).all(-1)).view(HEIGHT, WIDTH)


def grown(cells: Tensor, by: int = 1) -> Tensor:
    size = 2 * by + 1
    return torch.nn.functional.max_pool2d(cells[None].float(), size, 1, by)[0] > 0


@pytest.mark.parametrize("views", [1, 2, 5])
def test_of_equal_photos_the_first_keeps_all(views):
    keep = select_views(*seen([camera()] * views))
    assert keep[0].all() and not keep[1:].any()


@pytest.mark.parametrize("leads", [True, False])
def test_one_that_does_not_lead_takes_over_up_to_its_border(leads, monkeypatch):
    """Of frames a finger apart each would keep its own border else, where the next one takes it."""
    far, near = camera(), camera((0.0, 0.0, 3 - 3 / 2.2))
    given = seen([far, near, far], fov=20)
    monkeypatch.setattr(view_selection, "leading", lambda *of: [0, 1] if leads else [0])
    monkeypatch.setattr(view_selection, "_close_mask", lambda cells: cells)
    border = inside(*given, view=0, other=1) & ~inside(*given, view=0, other=1, margin=view_selection._BORDER)
    assert border.any() and (select_views(*given)[0][border] == leads).all()


@pytest.mark.parametrize("gap", [-BEFORE - 0.01, -BEFORE + 0.01, BEHIND - 0.01, BEHIND + 0.01])
def test_surfaces_are_the_same_within_what_depths_err(gap):
    """gap: log depth by which the later photo's wall lies behind the earlier's."""
    depths = torch.tensor([0.0, gap]).exp()[:, None, None].expand(2, HEIGHT, WIDTH) * 3
    keep = select_views(depths, torch.eye(4).repeat(2, 1, 1), lens(2))
    assert keep[0].all() and keep[1].all() == (not -BEFORE < gap < BEHIND)


def test_photos_do_not_leave_a_surface_to_each_other():
    """Areas of 1 thrice, .62 and .38, in this order: the fourth is left to the first, the last to neither, as
    it is less than half the first. By pairs the first would be left to the last, the last to the fourth, and
    so nobody's."""
    views = [camera((0.0, 0.0, 3 - 3 * share**0.5)) for share in (1.0, 1.0, 1.0, 0.62, 0.38)]
    given = seen(views, fov=20)
    assert from_the_middle(given[0], given[1]) == [0, 1, 2, 3, 4]
    keep = select_views(*given)
    assert keep[4].all()
    common = inside(*given, view=0, other=4, margin=1)
    assert not keep[0][~grown(~common, 2)].any() and keep[0][~inside(*given, view=0, other=3)].all()


def test_of_many_photos_those_that_lead_begin_surfaces():
    """A wall that twelve photos see; in each it stands forward somewhere, by less than a gap asks for."""
    depths, viewmats, Ks = seen([camera((0.2 * k, 0.0, 0.0)) for k in range(12)])
    wrong = torch.zeros_like(depths, dtype=torch.bool)
    for view in range(12):
        wrong[view, 4:9, 10 + view : 15 + view] = True
    depths = torch.where(wrong, 0.85 * depths, depths)
    first = leading(depths, viewmats)
    assert len(first) in (2, 3)
    keep = select_views(depths, viewmats, Ks)
    kept = {view for view in range(12) if bool((keep & wrong)[view].any())}
    assert kept and kept <= set(first)
    assert find_covered(depths, viewmats, Ks, keep).all()


@pytest.mark.parametrize("views", [2, 5])
def test_a_gap_that_all_see_is_filled_by_the_first(views):
    """And by none again: 128 photos that each filled it made 3.6 times the Gaussians of 64."""
    given = seen([camera()] * views)
    found = fill_uncovered(*given, keep=torch.zeros_like(given[0], dtype=torch.bool), known=given[0] > 0)
    assert found[0].all() and not found[1:].any()


def test_what_lies_before_what_fills_a_gap_fills_it_too():
    """A fifth farther is about the same depth, more is another surface."""
    depths = torch.tensor([1.0, 1.19, 0.8])[:, None, None].expand(3, HEIGHT, WIDTH) * 3
    nothing = torch.zeros_like(depths, dtype=torch.bool)
    found = fill_uncovered(depths, torch.eye(4).repeat(3, 1, 1), lens(3), nothing, ~nothing)
    assert found[0].all() and not found[1].any() and found[2].all()


@pytest.mark.parametrize("seed", range(4))
def test_after_gaps_are_filled_nothing_that_is_known_is_bare(seed):
    """Some photos' halves are kept, some cells are not known; what was kept stays, and less is added than
    everybody's share."""
    given = seen(drawn_views(seed, 5), [WALL, ((0.9, 0.1, 0.42), 1.9)][: 1 + seed % 2])
    drawn = torch.rand(given[0].shape, generator=torch.Generator().manual_seed(seed))
    keep, known = torch.zeros_like(drawn, dtype=torch.bool), drawn < 0.9
    keep[::2, :, : WIDTH // 2] = True
    found = fill_uncovered(*given, keep, known)
    assert (found & keep).equal(keep) and not (found & ~keep & ~known).any()
    assert not (known & ~find_covered(*given, found)).any()
    assert (found & ~keep).sum() < (known & ~find_covered(*given, keep)).sum()


def everybody_leads(monkeypatch) -> None:
    """What others leave bare is filled then by nobody, who is asked by other bounds."""
    monkeypatch.setattr(view_selection, "leading", lambda depths, viewmats: [*range(len(depths))])


def drawn_views(seed: int, count: int) -> list[Tensor]:
    generator = torch.Generator().manual_seed(seed)
    drawn = torch.rand(count, 5, generator=generator) - 0.5
    return [camera((2 * x, y, 1.6 * z), turn=(0.8 * a, 0.4 * b)) for x, y, z, a, b in drawn.tolist()]


@pytest.mark.parametrize("count", [2, 3, 6])
@pytest.mark.parametrize("seed", range(8))
def test_no_surface_that_somebody_sees_is_left_without_an_owner(seed, count, monkeypatch):
    """A wall, or two that meet: every cell of every photo lies within a cell of one that some photo keeps,
    since which photo a point belongs to is asked at its cell in one photo and answered for another cell, half
    a cell away, in the next. Left out are crumbs, cells of which fewer than five of nine stay, where they are
    narrower than that: the ends of wedges, lines along a picture's edge."""
    given = seen(drawn_views(seed, count), [WALL, ((0.9, 0.1, 0.42), 1.9)][: 1 + seed % 2])
    everybody_leads(monkeypatch)
    keep = select_views(*given)
    monkeypatch.setattr(view_selection, "_close_mask", lambda cells: cells)
    asked = select_views(*given)
    assert not without_owner(asked, *given).any()
    crumbs = asked & ~keep
    assert all(
        plain_most(cells.numpy())[gone.numpy()].sum() == 0 for cells, gone in zip(asked, crumbs, strict=True)
    )
    assert not without_owner(keep | crumbs, *given).any()
    assert float(without_owner(keep, *given).float().mean()) < 0.02
    if count == 6:
        assert float(keep.float().mean()) < 0.7  # and not everybody keeps all


def without_owner(keep: Tensor, depths: Tensor, viewmats: Tensor, Ks: Tensor) -> Tensor:
    """(V, H, W) bool: cells whose surface no photo keeps, not even a cell beside it."""
    wider = torch.stack([grown(cells) for cells in keep])
    found = wider.clone()
    for view in range(len(keep)):
        points = transform(invert_rigid(viewmats[view]), unproject(depths[view], Ks[view]).flatten(0, 1))
        somebody = found[view].flatten()
        for other in range(len(keep)):
            pos_c = transform(viewmats[other], points)
            at = (pos_c[:, :2] / pos_c[:, 2:] * Ks[other, 0, 0] + Ks[other, :2, 2]).floor().long()
            there = (pos_c[:, 2] > 0) & (at >= 0).all(-1) & (at < torch.tensor([WIDTH, HEIGHT])).all(-1)
            column, row = at[there].unbind(-1)
            near = (depths[other, row, column].log() - pos_c[there, 2].log()).abs() < BEFORE
            somebody[there] |= wider[other, row, column] & near
    return ~found


def plain_selected(depths: np.ndarray, viewmats: np.ndarray, Ks: np.ndarray) -> np.ndarray:
    """The rule point by point, before crumbs go and borders grow."""
    return np.array(
        [
            [[plain_owner(depths, viewmats, Ks, v, y, x) == v for x in range(WIDTH)] for y in range(HEIGHT)]
            for v in range(len(depths))
        ]
    )


def plain_owner(depths: np.ndarray, viewmats: np.ndarray, Ks: np.ndarray, view: int, y: int, x: int) -> int:
    """The photo that has the surface of one cell of one photo."""
    pose = np.linalg.inv(viewmats[view])
    point = pose[:3, :3] @ point_of(depths[view], Ks[view], y, x) + pose[:3, 3]
    normal = pose[:3, :3] @ normal_of(depths[view], Ks[view], y, x)
    owner, finest, border = -1, math.inf, 2 if len(depths) > 2 else 0
    for other in plain_order(depths, viewmats):
        at = viewmats[other][:3, :3] @ point + viewmats[other][:3, 3]
        if other != view and not same_surface(at, depths[other], Ks[other], border):
            continue
        towards = point - np.linalg.inv(viewmats[other])[:3, 3]
        distance = np.linalg.norm(towards)
        area = (distance / Ks[other, 0, 0]) ** 2 / max(abs(towards @ normal) / distance, 1e-3)
        if 2 * area < finest:
            owner, finest = other, area
    return owner


def plain_order(depths: np.ndarray, viewmats: np.ndarray) -> list[int]:
    """From the middle outwards; two as they come."""
    poses = np.linalg.inv(viewmats)
    median = np.sort(depths.ravel())[(depths.size - 1) // 2]

    def apart(a: np.ndarray, b: np.ndarray) -> float:
        return np.linalg.norm(a[:3, 3] - b[:3, 3]) / median + np.linalg.norm(a[:3, 2] - b[:3, 2])

    sums = [sum(apart(a, b) for b in poses) if len(poses) > 2 else 0 for a in poses]
    return sorted(range(len(poses)), key=sums.__getitem__)


def point_of(depths: np.ndarray, K: np.ndarray, y: int, x: int) -> np.ndarray:
    ray = np.array([(x + 0.5 - K[0, 2]) / K[0, 0], (y + 0.5 - K[1, 2]) / K[1, 1], 1])
    return ray * depths[y, x]


def normal_of(depths: np.ndarray, K: np.ndarray, y: int, x: int) -> np.ndarray:
    """Of the shorter steps to the neighbours along columns and rows."""
    here = point_of(depths, K, y, x)

    def shorter(step: Callable[[int], tuple[int, int]]) -> np.ndarray:
        steps = [
            sign * (point_of(depths, K, *step(sign)) - here)
            for sign in (1, -1)
            if 0 <= step(sign)[0] < HEIGHT and 0 <= step(sign)[1] < WIDTH
        ]
        return min(steps, key=lambda s: float(np.linalg.norm(s)))

    crossed = np.cross(shorter(lambda sign: (y, x + sign)), shorter(lambda sign: (y + sign, x)))
    return crossed / np.linalg.norm(crossed)


def same_surface(at: np.ndarray, depths: np.ndarray, K: np.ndarray, border: int) -> bool:
    if at[2] <= 0:
        return False
    column, row = (math.floor(at[i] / at[2] * K[i, i] + K[i, 2]) for i in (0, 1))
    if not (border <= row < HEIGHT - border and border <= column < WIDTH - border):
        return False
    return -BEFORE < math.log(at[2]) - math.log(depths[row, column]) < BEHIND


def around(cells: np.ndarray, y: int, x: int) -> np.ndarray:
    return cells[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]


def plain_most(keep: np.ndarray) -> np.ndarray:
    """Cells of which most of the nine around stay."""
    return np.array([[around(keep, y, x).mean() > 0.5 for x in range(WIDTH)] for y in range(HEIGHT)])


def plain_closed(keep: np.ndarray) -> np.ndarray:
    """Those, and what touches them."""
    most = plain_most(keep)
    return np.array([[around(most, y, x).any() for x in range(WIDTH)] for y in range(HEIGHT)])


@pytest.mark.parametrize(("seed", "count"), [(0, 3), (3, 3), (0, 2)])
def test_it_agrees_with_its_twin_cell_by_cell(seed, count, monkeypatch):
    """In float64, where none of these cells lies as near to a limit as rounding goes."""
    depths, viewmats, Ks = seen(drawn_views(seed, count), [WALL, ((0.9, 0.1, 0.42), 1.9)])
    generator = torch.Generator().manual_seed(seed)
    depths = depths.double() * torch.exp(0.03 * torch.randn(depths.shape, generator=generator).double())
    given = (depths, viewmats.double(), Ks.double())
    expected = np.array(
        [plain_closed(keep) for keep in plain_selected(*(values.numpy() for values in given))]
    )
    assert 0.2 < expected.mean() < 0.95
    everybody_leads(monkeypatch)
    assert np.array_equal(select_views(*given).numpy(), expected)


def test_a_camera_that_sees_nothing_of_the_others_and_points_behind():
    away = camera(turn=(math.pi, 0.0))
    given = seen([camera(), away], [WALL, ((0.0, 0.0, -1.0), 3.0)])
    assert select_views(*given).all()


def test_depths_of_nobodys_making_do_not_raise():
    depths = torch.exp(3 * torch.randn(3, HEIGHT, WIDTH, generator=torch.Generator().manual_seed(0)))
    depths[0, 0, 0], depths[1, 5, 5] = 1e-6, 1e6
    keep = select_views(depths, torch.stack(drawn_views(1, 3)), lens(3))
    assert keep.shape == depths.shape and keep.dtype == torch.bool


def many(count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Cameras here and there before a wall with a step, near and far: depths, viewmats, Ks."""
    g = torch.Generator().manual_seed(3)
    K = torch.tensor([[40.0, 0.0, 24.0], [0.0, 40.0, 20.0], [0.0, 0.0, 1.0]])
    viewmats = torch.eye(4).repeat(count, 1, 1)
    viewmats[:, :3, 3] = torch.rand(count, 3, generator=g) * torch.tensor([2.0, 0.6, 1.5]) - torch.tensor(
        [1.0, 0.3, 0.0]
    )
    x = (torch.arange(48) + 0.5 - 24) / 40
    depths = []
    for pose in viewmats:
        back, near = 3.0 + pose[2, 3], 2.6 + pose[2, 3]
        depth = torch.where(x * near - pose[0, 3] > 0.1, near, back)  # a pillar from x = .1 on
        depths.append(depth.expand(40, 48))
    return torch.stack(depths), viewmats, K.repeat(count, 1, 1)


def test_of_many_photos_few_are_compared_cell_by_cell(monkeypatch):
    """Nearly the same cells as where all are compared with all; no surface loses its cover."""
    depths, viewmats, Ks = many(14)
    looked_at = []
    same = view_selection._same
    monkeypatch.setattr(view_selection, "_same", lambda *of: looked_at.append(of) or same(*of))
    some = select_views(depths, viewmats, Ks)
    few = len(looked_at)
    monkeypatch.setattr(view_selection, "_ALL", 100)
    every = select_views(depths, viewmats, Ks)
    assert few < 0.7 * (len(looked_at) - few) and len(looked_at) - few == 14 * 13
    # Of 40 x 48 cells 30 are tried; of 224 x 224 they are 784, and .999 the same in a room of 32 photos.
    assert (some == every).float().mean() > 0.96
    assert find_covered(depths, viewmats, Ks, some).all()


def test_up_to_eight_photos_all_are_compared():
    """Exactly as one by one: the choice at every eighth cell has no part in it."""
    depths, viewmats, Ks = many(8)
    few = select_views(depths, viewmats, Ks)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_selection, "_holders", None)
        assert torch.equal(select_views(depths, viewmats, Ks), few)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5])
def test_blocks_beside_a_picture_cover_nothing(share):
    """The same as with all points, however few are kept."""
    depths, viewmats, Ks = many(6)
    keep = torch.rand(depths.shape, generator=torch.Generator().manual_seed(1)) < share
    found = find_covered(depths, viewmats, Ks, keep)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(view_selection._Blocks, "before", lambda blocks, *_: blocks.points.flatten(1))
        assert torch.equal(find_covered(depths, viewmats, Ks, keep), found)
    assert bool(found.any()) == (share > 0)
