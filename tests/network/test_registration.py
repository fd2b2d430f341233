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
from scipy.optimize import least_squares
from torch import Tensor

from langflash_core.network.stereo import registration
from langflash_core.network.stereo.prior import DepthMaps
from langflash_core.network.stereo.registration import _Matches, _smooth, _triangulated, registered

WIDTH, HEIGHT, RATIO = 84, 63, 3
K = torch.tensor([[70.0, 0, 42], [0, 70.0, 31.5], [0, 0, 1]])
LARGE = K * torch.tensor([[RATIO], [RATIO], [1.0]])
BEND = 0.03
FLOW_ERROR = registration._FLOW_ERROR

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
        maps = DepthMaps(logs, torch.full_like(logs, -2.5))
        found = registered(maps, self.photos, self.viewmats, K.expand(len(logs), 3, 3), **more)
        assert found.log_errors is maps.log_errors
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
    """A slow wave (H, W), up to 3 %."""
    y, x = torch.meshgrid(torch.arange(HEIGHT) / HEIGHT, torch.arange(WIDTH) / WIDTH, indexing="ij")
    return BEND * torch.sin(2 * math.pi * x) * torch.cos(math.pi * y)


def moves(seen: Room, view: int) -> float:
    """Pixels of the photo, for one unit of log depth: the baseline over the depth, as it is drawn."""
    centres = [-v[:3, :3].T @ v[:3, 3] for v in seen.viewmats]
    away = min(float((centres[view] - c).norm()) for i, c in enumerate(centres) if i != view)
    return float(LARGE[0, 0]) * away / float(seen.logs[view].exp().mean())


@pytest.mark.parametrize("planes", [SLANTED, CORNER])
@pytest.mark.parametrize("places", [PAIR, THREE])
@pytest.mark.parametrize("wrong", ["bent", "too far"])
def test_bent_depth_comes_back(places, planes, wrong):
    """A third of the error is left at most: a shift of 3 % is 0.6 pixels here, flow finds it to a tenth;
    where the other photo ends, a fifth of the picture, nothing says what is right but what lies beside. In
    the middle, which all of them see, a fifth."""
    seen = room(places, planes)
    off = bend() if wrong == "bent" else torch.full((HEIGHT, WIDTH), BEND)
    found = seen.registered(seen.logs + off)
    left = (found - seen.logs).abs()
    assert left.mean() < off.abs().mean() / 3
    middle = (slice(None), slice(15, -15), slice(20, -20))
    assert left[middle].mean() < off.expand_as(left)[middle].abs().mean() / 5


@pytest.mark.parametrize("places", [PAIR, THREE])
def test_true_depth_stays(places):
    """Flow errs by FLOW_ERROR pixels, independently in at least the cells that maps are off together, _ALIKE:
    their mean, as depth, is FLOW_ERROR / moves / sqrt(_ALIKE)."""
    seen = room(places)
    changed = (seen.registered(seen.logs) - seen.logs).abs()
    for view, change in enumerate(changed):
        assert change.mean() < FLOW_ERROR / moves(seen, view) / math.sqrt(registration._ALIKE)


def test_twice_is_the_same_to_the_last_bit_and_what_is_given_stays(pair):
    bent = pair.logs + bend()
    kept, photos = bent.clone(), [photo.copy() for photo in pair.photos]
    assert torch.equal(pair.registered(bent), pair.registered(bent))
    assert torch.equal(bent, kept)
    assert all(np.array_equal(*both) for both in zip(photos, pair.photos, strict=True))


@pytest.mark.parametrize("ratio", [4, 2, 1])
def test_photos_of_other_sizes(ratio, pair):
    """Larger ones are shrunk, smaller ones compared as they are: shifts of a few tenths of their pixels."""
    cameras = pair.viewmats.double().numpy()
    large = (K * torch.tensor([[ratio], [ratio], [1.0]])).numpy()
    photos = [shade(cast(pose, large, SLANTED, ratio)[1]) for pose in cameras]
    found = Room(photos, pair.logs, pair.viewmats).registered(pair.logs + bend())
    left = (found - pair.logs).abs().mean() / bend().abs().mean()
    assert left < {4: 1 / 3, 2: 1 / 2, 1: 1}[ratio]


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
    """The same surface, all of it wrong: what cannot be seen is carried along, and less the further it is."""
    seen = two_walls(2.0, blank=True)
    change = (seen.registered(seen.logs + BEND) - seen.logs - BEND)[0, 8:-8].mean(0) / -BEND
    middle = WIDTH // 2
    assert change[20 : middle - 3].mean() == pytest.approx(1, abs=0.1)
    assert (change[middle : middle + 3] > 1 / 4).all() and (change[middle + 3 : middle + 6] > 1 / 20).all()
    assert (change.diff()[middle:] <= 1e-4).all()


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
    left = (found - pair.logs)[~broken].abs().mean()
    assert left < bend().abs().mean() / 3


@pytest.mark.parametrize("depth", [-4.0, 5.0, 40.0, -40.0])
def test_far_and_near_stay_finite(depth, pair):
    wild = torch.full_like(pair.logs, depth)
    found = pair.registered(wild)
    assert found.isfinite().all() and (found - wild).abs().max() <= registration._FARTHEST + 1e-5


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (3, 3), (4, 4), (2, 33), (33, 2)])
def test_small_maps(size):
    """Flow needs 12 pixels; maps of less stay."""
    logs = torch.zeros(2, *size)
    rng = np.random.default_rng(0)
    photos = [rng.integers(0, 256, (3 * size[0], 3 * size[1]), dtype=np.uint8) for _ in range(2)]
    found = registered(DepthMaps(logs, logs), photos, torch.eye(4).expand(2, 4, 4), K.expand(2, 3, 3))
    assert found.log_depths.shape == logs.shape and found.log_depths.isfinite().all()


def test_check_is_asked_before_each_comparison_and_ends_the_work(pair):
    class Enough(Exception):
        pass

    calls = []
    four = Room(pair.photos * 2, pair.logs.repeat(2, 1, 1), pair.viewmats.repeat(2, 1, 1))
    four.registered(four.logs, check=lambda: calls.append(0))
    assert len(calls) == 4 * registration._PARTNERS

    def check() -> None:
        calls.append(0)
        if len(calls) == 3:
            raise Enough

    calls.clear()
    with pytest.raises(Enough):
        four.registered(four.logs, check=check)
    assert len(calls) == 3


@pytest.mark.parametrize("size", [(9, 11), (1, 6), (6, 1), (1, 1)])
def test_smooth_is_the_dense_solution(size):
    """In float64. CG stops at a residual of 1e-3 of the right side, and eigenvalues are at least 1 / s^2."""
    g = torch.Generator().manual_seed(0)
    height, width = size
    logs = 0.03 * torch.randn(size, generator=g)
    logs[:, width // 2 :] += 0.5
    weight = 300 * torch.rand(size, generator=g) ** 4
    target = weight * 0.05 * torch.randn(size, generator=g)
    flat, own = logs.double().flatten().numpy(), 1 / (registration._ALIKE * registration._EXPECTED**2)
    dense = np.diag(weight.double().flatten().numpy() + own)
    for r, c in np.ndindex(height, width):
        for beside in ((r + 1, c), (r, c + 1)):
            if beside[0] < height and beside[1] < width:
                i, j = r * width + c, beside[0] * width + beside[1]
                tie = registration._STIFF * math.exp(-(((flat[i] - flat[j]) / registration._JUMP) ** 2))
                dense[[i, j], [i, j]] += tie
                dense[[i, j], [j, i]] -= tie
    right = target.double().flatten().numpy()
    off = np.linalg.norm(_smooth(target, weight, logs).flatten().numpy() - np.linalg.solve(dense, right))
    assert off <= 1e-3 * np.linalg.norm(right) / own + 1e-7


def test_smooth_of_nothing_is_nothing():
    assert torch.equal(_smooth(torch.zeros(5, 7), torch.zeros(5, 7), torch.rand(5, 7)), torch.zeros(5, 7))


def test_smooth_does_not_cross_a_jump():
    """exp(-(0.4 / 0.03)^2) is 1e-77: the far side has no right side and no tie."""
    logs = torch.zeros(8, 10)
    logs[:, 5:] = 0.4
    weight = torch.zeros(8, 10)
    weight[:, :3] = 100
    found = _smooth(0.05 * weight, weight, logs)
    assert found[:, 5:].abs().max() < 1e-12
    assert found[:, 4].min() > 0.01, "what is not seen moves along"


def _geometry(noise: float) -> tuple[Tensor, Tensor, _Matches, Tensor]:
    """Log depths (6, 7), true ones, where these are in the neighbour but for noise (pixels), and its pose."""
    g = torch.Generator().manual_seed(0)
    logs = 0.7 + 0.1 * torch.randn(6, 7, generator=g, dtype=torch.float64)
    true = logs + 0.5 * torch.rand(6, 7, generator=g, dtype=torch.float64) - 0.25
    pose = torch.from_numpy(poses([(0.3, -0.1, 0.2)])[0])
    found = _projected(true, pose) + noise * torch.randn(2, 6, 7, generator=g, dtype=torch.float64)
    return logs, true, _at(found), pose


def _at(places: Tensor) -> _Matches:
    """Matches, all sure, at places (2, 6, 7), pixels."""
    x, y = places.float().numpy()
    return _Matches(x, y, np.ones((6, 7), np.float32))


SMALL_K = torch.tensor([[8.0, 0, 3.5], [0, 8.0, 3.0], [0, 0, 1]])


def _rays() -> Tensor:
    ys, xs = torch.meshgrid(torch.arange(6) + 0.5, torch.arange(7) + 0.5, indexing="ij")
    K = SMALL_K.double()
    return torch.stack(((xs - K[0, 2]) / K[0, 0], (ys - K[1, 2]) / K[1, 1], torch.ones_like(xs)), -1).double()


def _projected(logs: Tensor, pose: Tensor) -> Tensor:
    """(2, 6, 7) pixels of the neighbour."""
    pos = (_rays() * logs.exp()[..., None]) @ pose[:3, :3].T + pose[:3, 3]
    K = SMALL_K.double()
    return torch.stack([pos[..., i] / pos[..., 2] * K[i, i] + K[i, 2] for i in (0, 1)])


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_triangulated_is_the_least_squares_of_each_pixel(noise):
    """scipy's in float64. float32: 1e-7 of rays of about 1 over parallaxes of about 1/30 at noise, 1e-5."""
    logs, true, matches, pose = _geometry(noise)
    change, _ = _triangulated(logs.float(), matches, SMALL_K, SMALL_K, pose.float())
    turned, shift, K = (_rays() @ pose[:3, :3].T).numpy(), pose[:3, 3].numpy(), SMALL_K.double().numpy()
    for r, c in np.ndindex(6, 7):
        q = [(float(m[r, c]) - K[i, 2]) / K[i, i] for i, m in enumerate((matches.x, matches.y))]

        def wrong(inverse, a=turned[r, c], q=q):
            return [q[i] * a[2] - a[i] - inverse[0] * (shift[i] - q[i] * shift[2]) for i in (0, 1)]

        best = least_squares(wrong, [0.5], xtol=1e-12, ftol=1e-12, gtol=1e-12).x[0]
        limit = registration._FARTHEST
        expected = (
            np.clip(-math.log(max(best, 1e-6)) - float(logs[r, c]), -limit, limit) if best > 1e-6 else 0
        )
        assert float(change[r, c]) == pytest.approx(expected, abs=1e-4)
    if noise == 0:
        assert (change.double() - (true - logs)).abs().max() < 1e-4


def test_moves_are_the_differences_of_the_projection():
    """Central differences of 1e-5, float64: 1e-10. float32 knows a match, here of 10 pixels, to 1e-6."""
    logs, _, _, pose = _geometry(0.0)
    at = _at(_projected(logs, pose))
    _, found = _triangulated(logs.float(), at, SMALL_K, SMALL_K, pose.float())
    expected = (_projected(logs + 1e-5, pose) - _projected(logs - 1e-5, pose)).norm(dim=0) / 2e-5
    torch.testing.assert_close(found.double(), expected, rtol=1e-3, atol=1e-5)


def test_matches_that_no_depth_explains_say_nothing():
    """Behind the camera, without a baseline, and where the match is no number: 0 twice, and finite."""
    logs, _, matches, pose = _geometry(0.0)
    still = pose.clone()
    still[:3, 3] = 0
    behind, broken = _at(_projected(logs, pose)), _at(torch.full((2, 6, 7), torch.nan))
    reversed_pose = pose.clone()
    reversed_pose[:3, 3] *= -1
    for case, camera in ((matches, still), (broken, pose), (behind, reversed_pose)):
        change, moved = _triangulated(logs.float(), case, SMALL_K, SMALL_K, camera.float())
        assert (change == 0).all() and (moved == 0).all()
    for far in (_projected(torch.full_like(logs, 20.0), pose), torch.full((2, 6, 7), torch.inf)):
        found = _triangulated(logs.float(), _at(far), SMALL_K, SMALL_K, pose.float())
        assert all(values.isfinite().all() for values in found)
