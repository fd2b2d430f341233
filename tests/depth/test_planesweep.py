"""Depth that a plane over the whole range finds: a thing before a wall of which the maps know nothing."""

import math

import cv2
import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.depth import planesweep
from langflash_core.depth.planesweep import (
    _best,
    _largest,
    _on_plane,
    _peaks,
    _planes,
    _Scene,
    _warp_neighbour,
    _Windows,
)
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import PLANE_SWEEP

WIDTH, HEIGHT, LARGE = 96, 72, 3
K = torch.tensor([[80.0, 0, 48], [0, 80.0, 36], [0, 0, 1]])
WALL, THING = 3.0, 1.2
SIDE = 0.2  # half, of the square thing
PLACES = ((0.0, 0.0, 0.0), (0.3, 0.02, 0.0), (-0.25, 0.1, 0.05), (0.05, -0.3, -0.05))
ALL = [[other for other in range(4) if other != view] for view in range(4)]


def searched(logs: Tensor, photos: list[np.ndarray], poses: Tensor, Ks: Tensor, *more) -> Tensor:
    return planesweep.sweep_planes(Rig.of_logs(logs, poses, Ks), photos, *more).log_depths


def surface(seed: int) -> np.ndarray:
    """A pattern (256, 256) that is smooth over some pixels."""
    noise = np.random.default_rng(seed).normal(size=(256, 256))
    smooth = cv2.GaussianBlur(noise, (0, 0), 1.5)
    return np.clip(128 + 60 * smooth / smooth.std(), 0, 255)


def taken(place: tuple[float, float, float], thing: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """A photo (uint8) and its depths, at the maps' size, of a wall and a square before it."""
    rows, columns = np.mgrid[: HEIGHT * LARGE, : WIDTH * LARGE]
    x = ((columns + 0.5) / LARGE - 48) / 80
    y = ((rows + 0.5) / LARGE - 36) / 80

    def seen(depth: float, pattern: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        z = depth - place[2]
        at = place[0] + x * z, place[1] + y * z
        across, down = ((128 + along * scale).astype(np.float32) for along in at)
        shown = cv2.remap(pattern, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        return shown, at[0], at[1]

    picture, _, _ = seen(WALL, surface(0), 80 / WALL * 2)
    depth = np.full(picture.shape, WALL - place[2])
    if thing:
        near, across, down = seen(THING, surface(1), 80 / THING * 2)
        there = (abs(across) < SIDE) & (abs(down) < SIDE)
        picture, depth = np.where(there, near, picture), np.where(there, THING - place[2], depth)
    small = cv2.resize(picture, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    return small.round().astype(np.uint8), depth[LARGE // 2 :: LARGE, LARGE // 2 :: LARGE]


def viewmats() -> Tensor:
    poses = torch.eye(4).repeat(4, 1, 1)
    poses[:, :3, 3] = -torch.tensor(PLACES)
    return poses


def room(thing: bool = True) -> tuple[list[np.ndarray], Tensor, Tensor]:
    """Photos, true log depths, and those of the wall alone."""
    photos, depths = zip(*(taken(place, thing) for place in PLACES), strict=True)
    wall = torch.stack([torch.full((HEIGHT, WIDTH), math.log(WALL - place[2])) for place in PLACES])
    return list(photos), torch.from_numpy(np.log(np.stack(depths))).float(), wall


KS = K.expand(4, 3, 3)
STEP = 2 * THING / WALL / (PLANE_SWEEP.planes - 1)
"""Of log depth at the thing, from a plane to the next, where these end at twice the thing's inverse depth."""


def test_a_thing_before_the_wall_is_found_where_it_is():
    """Within half a plane's step and `_ERROR`, inside of what windows cover; the wall stays but beside it."""
    photos, truth, wall = room()
    wrong = wall.clone()
    wrong[:, :10, :12] = math.log(THING)  # planes begin where the nearest hundredth of the map is
    found = searched(wrong, photos, viewmats(), KS, ALL)
    for own, real in zip(found, truth, strict=True):
        thing = (real < math.log(2)).numpy().astype(np.uint8)
        inside = cv2.erode(thing, np.ones((5, 5))) > 0
        outside = cv2.dilate(thing, np.ones((13, 13))) == 0
        outside[:18, :20] = False
        assert inside.sum() > 100
        assert np.quantile(abs((own - real).numpy()[inside]), 0.9) < STEP / 2 + PLANE_SWEEP.error
        assert np.quantile(abs((own - real).numpy()[outside]), 0.95) < PLANE_SWEEP.error


def test_a_wall_that_is_right_stays():
    photos, truth, wall = room(thing=False)
    found = searched(wall, photos, viewmats(), KS, ALL)
    assert torch.equal(truth, wall)
    assert (found - wall).abs().max() < PLANE_SWEEP.error


@pytest.mark.parametrize("near", [[[1], [0], [3], [2]], [[], [], [], []]])
def test_fewer_than_two_neighbours_change_nothing(near):
    photos, _, wall = room()
    assert torch.equal(searched(wall, photos, viewmats(), KS, near), wall)


@pytest.mark.parametrize("kind", ["blank", "strangers", "one place"])
def test_photos_that_say_nothing_change_nothing(kind):
    photos, _, wall = room()
    poses = viewmats()
    if kind == "blank":
        photos = [np.full((HEIGHT, WIDTH), 90, np.uint8)] * 4
    elif kind == "strangers":
        photos = [cv2.resize(surface(7 + own), (WIDTH, HEIGHT)).astype(np.uint8) for own in range(4)]
    else:
        photos, poses = [photos[0]] * 4, poses[:1].expand(4, 4, 4)
    found = searched(wall, photos, poses, KS, ALL)
    assert (found - wall).abs().mean() < 1e-3  # chance: a pixel of a hundred, by .1


def test_what_check_raises_ends_the_work():
    photos, _, wall = room()
    calls = []

    def check() -> None:
        calls.append(0)
        if len(calls) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        searched(wall, photos, viewmats(), KS, ALL, check)


@pytest.mark.parametrize("depth", [12.0, math.nan, math.inf])  # log depths; the first is as far as maps go
def test_depths_that_are_none_touch_no_other(depth):
    photos, _, wall = room()
    wild = wall.clone()
    wild[:, 40:44, 50:60] = depth
    others = wild.isfinite() & (wild < 12)
    found = searched(wild, photos, viewmats(), KS, ALL)
    assert found[others].isfinite().all()


def test_a_plane_is_what_its_depth_everywhere_is():
    """The homography against each pixel's own way, uint8: one grey value of rounding, and OpenCV's places of
    1/32 pixel in both, times the pattern's steepest slope."""
    photos, _, wall = room()
    scene = _Scene(photos, [own.numpy() for own in wall], viewmats().double(), KS.double())
    for depth in (1.0, 2.5):
        own = np.full((HEIGHT, WIDTH), math.log(depth), np.float32)
        planes = _on_plane(scene, 0, ALL[0], 1 / depth)
        for other, found in zip(ALL[0], planes, strict=True):
            twin = _warp_neighbour(scene, 0, other, own)
            slope = abs(np.diff(photos[other].astype(float), axis=1)).max()
            inside = (found > 0) & (twin > 0)
            inside = cv2.erode(inside.astype(np.uint8), np.ones((5, 5))) > 0
            assert inside.mean() > 0.3
            assert abs(found.astype(float) - twin)[inside].max() < 1.5 + 2 * slope / 32


def test_a_plane_behind_a_neighbour_shows_nothing():
    photos, _, wall = room()
    poses = viewmats()
    poses[1, 2, 3] = -2.0  # two units further in
    scene = _Scene(photos, [own.numpy() for own in wall], poses.double(), KS.double())
    assert (_on_plane(scene, 0, [1], 1.0)[0] == 0).all()


def test_correlations_are_those_of_float64():
    """Window by window; sums of 25 squares of at most 255 lose 25 x 2^-24 of them, beside a variance of the
    noise's at least."""
    left, right = (surface(seed)[:40, :50].round().astype(np.uint8) for seed in (2, 3))
    right[:, 25:] = left[:, 25:]
    found = _Windows(left).alike(right)
    twin = np.zeros((40, 50))
    for row in range(2, 38):
        for column in range(2, 48):
            a, b = (
                picture[row - 2 : row + 3, column - 2 : column + 3].astype(np.float64)
                for picture in (left, right)
            )
            both = ((a - a.mean()) * (b - b.mean())).mean()
            twin[row, column] = both / math.sqrt(a.var() * b.var() + PLANE_SWEEP.noise**4)
    inner = (slice(2, 38), slice(2, 48))
    assert abs(found - twin)[inner].max() < 4 * 255**2 * 25 * 2**-24 / PLANE_SWEEP.noise**2
    assert found[10:30, 30:45].min() > 0.9


def test_the_best_plane_is_that_of_a_stack():
    volume = list(np.random.default_rng(0).uniform(-1, 1, (9, 6, 7)).astype(np.float32))
    best, most = _largest(volume)
    assert np.array_equal(best, np.stack(volume).argmax(0)) and np.array_equal(most, np.stack(volume).max(0))
    own = np.random.default_rng(1).uniform(-1, 1, (3, 6, 7)).astype(np.float32)
    twin = cv2.blur(np.sort(own, 0)[-2:].mean(0), (3, 3))
    assert abs(_best(list(own)) - twin).max() < 4 * 2**-24 * 9


def test_between_planes_a_parabola_has_its_peak():
    inverse = np.linspace(0.2, 1.0, 9)
    peak = np.array([[0.43, 0.78]])
    volume = [1 - 3 * (own - peak) ** 2 for own in inverse]
    best, _ = _largest(volume)
    assert abs(_peaks(volume, best, inverse) - peak).max() < 1e-12
    ends = [1 - 3 * (own - np.array([[-1.0, 2.0]])) ** 2 for own in inverse]
    assert np.array_equal(_peaks(ends, _largest(ends)[0], inverse), [[inverse[0], inverse[-1]]])


def test_planes_are_as_far_apart_in_inverse_depth_and_cover_the_map():
    logs = np.log(np.linspace(1, 4, 1000, dtype=np.float32)).reshape(20, 50)
    planes = _planes(logs)
    assert len(planes) == PLANE_SWEEP.planes and np.ptp(np.diff(planes)) < 1e-6
    assert planes[0] < 1 / 3.9 and planes[-1] > 1.9
