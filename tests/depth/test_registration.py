"""Depth brought to a fraction of the photo's pixel: bent maps of rooms that are drawn exactly, and everything
that says nothing about depth.

Grey is a function of the place in the world, a sum of waves, and surfaces are planes: photos are ray casts,
without resampling, at three times the maps' size.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.running import Run
from langflash_core.depth.registration import register_depths, smooth
from langflash_core.depth.surfaces import flatten, one_surface, sharpen
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import REGISTRATION
from langflash_core.types import Views

WIDTH, HEIGHT, RATIO = 84, 63, 3
K = torch.tensor([[70.0, 0, 42], [0, 70.0, 31.5], [0, 0, 1]])
LARGE = K * torch.tensor([[RATIO], [RATIO], [1.0]])
BEND = 0.03
FLOW_ERROR = REGISTRATION.flow_error
ONE_GREY = np.full((HEIGHT, WIDTH), 128, np.float32)

Plane = tuple[tuple[float, float, float], float]
SLANTED: tuple[Plane, ...] = (((-0.4, -0.1, 1.0), 2.0),)
CORNER: tuple[Plane, ...] = (((0.6, 0.0, 1.0), 2.4), ((-0.6, 0.1, 1.0), 2.4))
PAIR = ((0.0, 0.0, 0.0), (0.2, 0.02, 0.0))
THREE = (*PAIR, (-0.15, 0.12, 0.1))


@dataclass(frozen=True)
class Room:
    """Photos and true log depths (V, H, W) of cameras."""

    photos: list[np.ndarray]
    logs: Tensor
    viewmats: Tensor

    def registered(self, logs: Tensor, **more) -> Tensor:
        errors = torch.full_like(logs, -2.5)
        rig = Rig.of_logs(logs, self.viewmats, K.expand(len(logs), 3, 3), errors)
        found = register_depths(rig, self.photos, **more)
        assert found.log_errors is errors
        return found.log_depths


def poses(places: Sequence[tuple[float, float, float]]) -> np.ndarray:
    """Cameras (V, 4, 4) at places, each turned towards what is before the first."""
    made = np.tile(np.eye(4), (len(places), 1, 1))
    for pose, place in zip(made, places, strict=True):
        cosine, sine = math.cos(0.2 * place[0]), math.sin(0.2 * place[0])
        pose[:3, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
        pose[:3, 3] = -pose[:3, :3] @ place
    return made


def cast(
    pose: np.ndarray, K: np.ndarray, planes: Sequence[Plane], ratio: int
) -> tuple[np.ndarray, np.ndarray]:
    """Depths (h, w) of the nearest plane n . p = c at each pixel, and the places (h, w, 3) in the world."""
    ys, xs = np.mgrid[: HEIGHT * ratio, : WIDTH * ratio] + 0.5
    rays = np.stack(((xs - K[0, 2]) / K[0, 0], (ys - K[1, 2]) / K[1, 1], np.ones_like(xs)), -1) @ pose[:3, :3]
    eye = -pose[:3, :3].T @ pose[:3, 3]
    depths = np.full(xs.shape, np.inf)
    for normal, offset in planes:
        along = (offset - eye @ normal) / (rays @ normal)
        depths = np.minimum(depths, np.where(along > 0, along, np.inf))
    return depths, eye + rays * depths[..., None]


def shade(places: np.ndarray, seed: int = 0) -> np.ndarray:
    """Grey (...) uint8 of places (..., 3): sixty waves 6 to 60 cm long, 2 pixels of a photo and more."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(60, 3))
    waves *= 2 * np.pi / np.exp(rng.uniform(np.log(0.06), np.log(0.6), (60, 1)))
    waves /= np.linalg.norm(rng.normal(size=(60, 3)), axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, 60)
    return np.clip(128 + 12 * np.sin(places @ waves.T + phases).sum(-1), 0, 255).round().astype(np.uint8)


@functools.cache
def room(places: tuple[tuple[float, float, float], ...], planes: tuple[Plane, ...] = SLANTED) -> Room:
    cameras = poses(places)
    photos = [shade(cast(pose, LARGE.numpy(), planes, RATIO)[1]) for pose in cameras]
    depths = np.stack([cast(pose, K.numpy(), planes, 1)[0] for pose in cameras])
    return Room(photos, torch.from_numpy(depths).log().float(), torch.from_numpy(cameras).float())


@pytest.fixture(scope="module")
def pair() -> Room:
    return room(PAIR)


def bend() -> Tensor:
    """Half a wave each way (H, W), up to 3 %: as slow as errors of the maps are."""
    y, x = ((torch.arange(n) + 0.5) / n for n in (HEIGHT, WIDTH))
    return BEND * torch.cos(math.pi * y)[:, None] * torch.cos(math.pi * x)


OWN = 1 / (REGISTRATION.alike * REGISTRATION.expected**2)
BENDING = REGISTRATION.stiff * ((math.pi / HEIGHT) ** 2 + (math.pi / WIDTH) ** 2)
"""What holds a cell where it is, and what a bend of half a wave each way costs it."""


def moves(seen: Room, view: int) -> float:
    """Pixels of the photo, for one unit of log depth: the baseline over the depth, as it is drawn."""
    centres = [-v[:3, :3].T @ v[:3, 3] for v in seen.viewmats]
    away = min(float((centres[view] - c).norm()) for i, c in enumerate(centres) if i != view)
    return float(LARGE[0, 0]) * away / float(seen.logs[view].exp().mean())


def kept(seen: Room, cost: float) -> float:
    """The share of an error that stays, of one whose correction costs so much a cell.

    Of weight w the least of w (x - t)^2 + cost x^2 is x = t w / (w + cost). On this texture flow is .45 sure
    and more, so that w is .45 (moves / FLOW_ERROR)^2 / ONE_SHIFT for each of the neighbours. Each round
    begins with what the one before left.
    """
    others = len(seen.photos) - 1
    slowest = min(moves(seen, view) for view in range(len(seen.photos)))
    each = 0.45 * (slowest / FLOW_ERROR) ** 2 / REGISTRATION.one_shift
    rounds = REGISTRATION.rounds if others > 1 else (1,)
    return math.prod(cost / (min(most, others) * each + cost) for most in rounds)


@pytest.mark.parametrize("planes", [SLANTED, CORNER])
@pytest.mark.parametrize("places", [PAIR, THREE])
@pytest.mark.parametrize("wrong", ["bent", "too far"])
def test_wrong_depth_comes_back(places, planes, wrong):
    """Corrections are stiff, so that walls stay straight: of a slow bend a third stays where two photos see
    it, a fifth where three do (`kept`). What is too far as a whole bends nothing; a fifth stays at most, of
    flow's own error at the border. Of one picture in six the other photo sees nothing."""
    seen = room(places, planes)
    off = bend() if wrong == "bent" else torch.full((HEIGHT, WIDTH), BEND)
    share = kept(seen, OWN + BENDING) if wrong == "bent" else kept(seen, OWN)
    assert share < {("bent", 2): 1 / 3, ("bent", 3): 1 / 5}.get((wrong, len(places)), 1 / 6)
    left = (seen.registered(seen.logs + off) - seen.logs).abs()
    middle = (slice(None), slice(15, -15), slice(20, -20))
    flows = 0.04 / min(moves(seen, view) for view in range(len(places)))  # pixels: flow's own error is .03
    assert left[middle].mean() < share * off.expand_as(left)[middle].abs().mean() + flows
    assert left.mean() < (share + 1 / 6) * off.abs().mean()


@pytest.mark.parametrize("places", [PAIR, THREE])
def test_true_depth_stays(places):
    """Flow errs by FLOW_ERROR pixels, independently in at least the cells that maps are off together, _ALIKE:
    their mean, as depth, is FLOW_ERROR / moves / sqrt(_ALIKE)."""
    seen = room(places)
    changed = (seen.registered(seen.logs) - seen.logs).abs()
    for view, change in enumerate(changed):
        assert change.mean() < FLOW_ERROR / moves(seen, view) / math.sqrt(REGISTRATION.alike)


@pytest.mark.parametrize("ratio", [4, 2, 1])
def test_photos_of_other_sizes(ratio, pair):
    """Larger ones are shrunk, smaller ones compared as they are: shifts of a few tenths of their pixels, and
    weights that fall with the square of their size, against the same stiffness."""
    cameras = pair.viewmats.double().numpy()
    large = (K * torch.tensor([[ratio], [ratio], [1.0]])).numpy()
    photos = [shade(cast(pose, large, SLANTED, ratio)[1]) for pose in cameras]
    found = Room(photos, pair.logs, pair.viewmats).registered(pair.logs + bend())
    left = (found - pair.logs).abs().mean() / bend().abs().mean()
    assert left < {4: 1 / 3, 2: 3 / 4, 1: 1}[ratio]


def test_one_view_stays_as_it_is(pair):
    alone = Room(pair.photos[:1], pair.logs[:1], pair.viewmats[:1])
    assert torch.equal(alone.registered(pair.logs[:1]), pair.logs[:1])


def test_views_without_neighbours_stay_and_others_do_not_mind(pair):
    seen = Room([*pair.photos, pair.photos[0]], pair.logs[[0, 1, 0]] + bend(), pair.viewmats[[0, 1, 0]])
    found = seen.registered(seen.logs, neighbours=[[1], [0], []])
    assert torch.equal(found[2], seen.logs[2])
    assert torch.equal(found[:2], pair.registered(pair.logs + bend()))


@pytest.mark.parametrize("grey", [0, 128, 255])
def test_without_texture_nothing_changes(grey, pair):
    """Two blank walls: flow is 0 and sure of it, but there is nothing to see."""
    blank = Room([np.full_like(photo, grey) for photo in pair.photos], pair.logs, pair.viewmats)
    assert torch.equal(blank.registered(pair.logs + bend()), pair.logs + bend())


def test_from_one_place_nothing_changes(pair):
    """The same photo twice, and a camera that only turned: no depth moves anything. Rounding makes a baseline
    of 1e-7 out of none, 1e-5 of a pixel."""
    bent = pair.logs[:1].expand(2, -1, -1) + bend()
    same = Room(pair.photos[:1] * 2, bent, pair.viewmats[:1].expand(2, -1, -1))
    assert torch.equal(same.registered(bent), bent)
    cameras = poses(PAIR)
    cameras[1, :3, 3] = 0
    photos = [shade(cast(pose, LARGE.numpy(), SLANTED, RATIO)[1]) for pose in cameras]
    turned = Room(photos, bent, torch.from_numpy(cameras).float())
    assert (turned.registered(bent) - bent).abs().max() < 1e-5


def test_photos_that_show_something_else_change_nothing(pair):
    """The same place with other waves, noise, and cameras that look away from each other."""
    others = shade(cast(pair.viewmats[1].double().numpy(), LARGE.numpy(), SLANTED, RATIO)[1], seed=1)
    noise = np.random.default_rng(0).integers(0, 256, others.shape, dtype=np.uint8)
    for photo in (others, noise):
        strangers = Room([pair.photos[0], photo], pair.logs, pair.viewmats)
        assert torch.equal(strangers.registered(pair.logs), pair.logs)
    away = pair.viewmats.clone()
    away[1] = torch.diag(torch.tensor([-1.0, 1, -1, 1]))
    assert torch.equal(Room(pair.photos, pair.logs, away).registered(pair.logs), pair.logs)


def two_walls(far: float, blank: bool) -> Room:
    """A textured wall at 2 that ends at x = 0, the middle of the first photo, beside another at `far`."""
    cameras = poses(PAIR)
    photos, logs = [], []
    for pose in cameras:
        for ratio, K_of in ((RATIO, LARGE), (1, K)):
            near, places = cast(pose, K_of.numpy(), (((0.0, 0.0, 1.0), 2.0),), ratio)
            beyond, behind = cast(pose, K_of.numpy(), (((0.0, 0.0, 1.0), far),), ratio)
            hides = places[..., 0] < 0
            if ratio == RATIO:
                photos.append(
                    np.where(hides, shade(places), 128 if blank else shade(behind)).astype(np.uint8)
                )
            else:
                logs.append(np.log(np.where(hides, near, beyond)))
    return Room(photos, torch.from_numpy(np.stack(logs)).float(), torch.from_numpy(cameras).float())


def test_a_blank_wall_moves_with_what_is_textured_beside_it():
    """The same surface, all of it wrong. What cannot be seen is carried along, and less the further it is:
    STIFF x'' = OWN x with a free end is a cosh, of 23 cells' length here; flow's patches reach 3 cells in."""
    seen = two_walls(2.0, blank=True)
    change = (seen.registered(seen.logs + BEND) - seen.logs - BEND)[0, 8:-8].mean(0) / -BEND
    middle = WIDTH // 2
    assert change[20 : middle - 6].mean() == pytest.approx(1 - kept(seen, OWN), abs=0.05)
    away = (WIDTH - 0.5 - torch.arange(middle + 4, WIDTH)) * math.sqrt(OWN / REGISTRATION.stiff)
    expected = change[middle + 4] * away.cosh() / away[0].cosh()
    assert (change[middle + 4 :] - expected).abs().max() < 0.02


def out_of_plane(change: Tensor) -> np.ndarray:
    """(H, W): what is left of a correction without its plane of least squares, which bends nothing."""
    y, x = np.mgrid[: change.shape[0], : change.shape[1]]
    plane = np.stack((np.ones(x.size), x.ravel(), y.ravel()), -1)
    values = change.double().numpy().ravel()
    return (values - plane @ np.linalg.lstsq(plane, values, rcond=None)[0]).reshape(change.shape)


def lined(upright: bool, noise: float) -> Room:
    """A blank wall with one dark line, 2 cm to either side, and a camera's noise, grey values."""
    true, rng, photos = room(PAIR), np.random.default_rng(0), []
    for pose in poses(PAIR):
        off = cast(pose, LARGE.numpy(), SLANTED, RATIO)[1][..., 0 if upright else 1]
        grey = 128 - 80 * np.exp(-((off / 0.02) ** 2)) + noise * rng.normal(size=off.shape)
        photos.append(grey.round().astype(np.uint8))
    return Room(photos, true.logs, true.viewmats)


@pytest.mark.parametrize("upright", [True, False])
@pytest.mark.parametrize("noise", [0.0, 0.5, 1.0])
def test_walls_beside_a_line_stay_straight(upright, noise):
    """To half a percent of the depth, a seventh of what FLOW_ERROR means here; of stiffness 30 it was 2 %."""
    seen = lined(upright, noise)
    for change in seen.registered(seen.logs) - seen.logs:
        assert np.abs(out_of_plane(change)).max() < 0.005


def test_flow_errors_along_a_line_bend_neither_it_nor_the_wall():
    """A line of 3 cells of full weight, in 13 patches of 5 cells that err independently by FLOW_ERROR.

    With W the weight across the line, a wave of number k along it falls to W / (W + 2 STIFF q), with q^2 =
    k^2 + OWN / STIFF, and to e^(-q d) of that at a distance of d. Waves of k = pi m / HEIGHT have a variance
    of 2 / 13 each; those from m = 2 to 12, which no plane takes, sum up to a fifth, and at 10 cells to a
    twentieth.
    """
    error, line = FLOW_ERROR / moves(room(PAIR), 0), slice(40, 43)
    weight = torch.zeros(HEIGHT, WIDTH)
    weight[:, line] = 1 / error**2 / REGISTRATION.one_shift
    q = np.sqrt((np.pi * np.arange(2, 13) / HEIGHT) ** 2 + OWN / REGISTRATION.stiff)
    across = 3 * float(weight.max())
    falls = across / (across + 2 * REGISTRATION.stiff * q)
    assert math.sqrt(2 / 13 * (falls**2).sum()) < 1 / 5
    assert math.sqrt(2 / 13 * ((falls * np.exp(-10 * q)) ** 2).sum()) < 1 / 20
    bent = []
    for seed in range(12):
        patches = error * torch.randn(13, generator=torch.Generator().manual_seed(seed))
        target = weight * patches.repeat_interleave(5)[:HEIGHT, None]
        bent.append(out_of_plane(smooth(target, weight, torch.zeros(HEIGHT, WIDTH), ONE_GREY)))
    on, beside = np.array(bent)[..., line], np.array(bent)[..., [30, 31, 51, 52]]
    assert math.sqrt(np.square(on).mean()) < error / 5
    assert math.sqrt(np.square(beside).mean()) < error / 20


def test_corrections_end_at_a_jump():
    """The near wall is wrong, the far one is not. Flow compares patches of 8 pixels, so within 3
    cells of the line it takes the far wall for the near one; beyond them nothing is left of that."""
    seen = two_walls(3.0, blank=False)
    near = torch.arange(WIDTH) < WIDTH // 2
    wrong = seen.logs + BEND * near
    found = seen.registered(wrong)[0, 8:-8]
    left = (found - seen.logs[0, 8:-8]).abs().mean(0)
    assert left[20 : WIDTH // 2 - 3].mean() < BEND / 5
    assert left[WIDTH // 2 + 4 : WIDTH // 2 + 20].mean() < BEND / 5


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_depths_that_are_no_numbers_stay_alone(value, pair):
    wrong = pair.logs + bend()
    wrong[0, 20:24, 30] = value
    found = pair.registered(wrong)
    broken = ~wrong.isfinite()
    assert torch.equal(found.isfinite(), ~broken)
    left, without = (
        (maps - pair.logs)[~broken].abs().mean() for maps in (found, pair.registered(pair.logs + bend()))
    )
    assert left < 1.1 * without


@pytest.mark.parametrize("depth", [-4.0, 5.0, 40.0, -40.0])
def test_far_and_near_stay_finite(depth, pair):
    wild = torch.full_like(pair.logs, depth)
    found = pair.registered(wild)
    assert found.isfinite().all() and (found - wild).abs().max() <= REGISTRATION.farthest + 1e-5


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (3, 3), (4, 4), (2, 33), (33, 2)])
def test_small_maps(size):
    """Flow needs 12 pixels; maps of less stay."""
    logs = torch.zeros(2, *size)
    rng = np.random.default_rng(0)
    photos = [rng.integers(0, 256, (3 * size[0], 3 * size[1]), dtype=np.uint8) for _ in range(2)]
    found = register_depths(Rig.of_logs(logs, torch.eye(4).expand(2, 4, 4), K.expand(2, 3, 3), logs), photos)
    assert found.log_depths.shape == logs.shape and found.log_depths.isfinite().all()


def test_check_is_asked_before_each_comparison_and_ends_the_work(pair):
    class Enough(Exception):
        pass

    calls = []
    four = Room(pair.photos * 2, pair.logs.repeat(2, 1, 1), pair.viewmats.repeat(2, 1, 1))
    four.registered(four.logs, check=lambda: calls.append(0))
    assert len(calls) == 4 * sum(min(most, 3) for most in REGISTRATION.rounds)

    def check() -> None:
        calls.append(0)
        if len(calls) == 3:
            raise Enough

    calls.clear()
    with pytest.raises(Enough):
        four.registered(four.logs, check=check)
    assert len(calls) == 3


def test_guided_depth_registers_photos_of_known_pose_and_leaves_planes(pair):
    """Ripples of two tokens' length go to a quarter; without `flattened` two thirds stay. The third photo has
    no pose of its own."""
    ripples = (
        torch.cos(math.pi * torch.arange(WIDTH) / 7) * torch.cos(math.pi * torch.arange(HEIGHT) / 7)[:, None]
    )
    order = [0, 1, 0]
    logs, viewmats, Ks = pair.logs[order], pair.viewmats[order], K.expand(3, 3, 3)
    photos = torch.from_numpy(np.stack([pair.photos[v] for v in order]))
    views = Views(photos[:, None].expand(-1, 3, -1, -1) / 255, Ks, ("a", "b", "c"))
    errors = torch.full_like(logs, -2.5)
    small = F.interpolate(views.images, size=(HEIGHT, WIDTH), mode="area")
    rig = Rig.of_logs(logs + 0.01 * ripples, viewmats, Ks, errors, small)
    found = one_surface(rig, (2,), views, Run({}))
    assert (
        torch.equal(found.log_depths[2], flatten(sharpen(rig)).log_depths[2]) and found.log_errors is errors
    )
    left = (found.log_depths - logs)[:2]
    assert left.abs().mean() < 0.01 * ripples.abs().mean() / 3
    assert left[:, 10:-10, 15:-15].std() < 0.01 * ripples.std() / 4
