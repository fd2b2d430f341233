"""Photos of lenses that bend lines: straightened, they are those of a straight lens."""

import cv2
import numpy as np
import pytest
import torch

from langflash_core.base.records import FoundFocal
from langflash_core.images.straight import after, distort, smallest_scale, straighten_views
from langflash_core.types import Lenses, Views

SIZE, FOCAL = (112, 84), 90.0
BENDS = [-0.2, 0.08]


def _wall(q: np.ndarray) -> np.ndarray:
    """Colours (n, 3) in [0, 1] of a wall before the camera, smooth, at (x / z, y / z) (n, 2)."""
    waves = np.stack((np.sin(7 * q[..., 0]), np.cos(9 * q[..., 1]), np.sin(6 * q.sum(-1))), -1)
    return 0.5 + 0.4 * waves


def _places(size: tuple[int, int]) -> np.ndarray:
    """Middles of pixels (h, w, 2) from the photo's middle, in pixels of the view."""
    times = size[0] / SIZE[0]
    columns, rows = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    return np.stack((columns, rows), -1) / times - np.array(SIZE) / 2


def _straight_rays(places: np.ndarray, k: float) -> np.ndarray:
    """q of what a bent lens shows at `places`: p / f = (1 + k |q|^2) q, by Newton, float64."""
    radii = np.linalg.norm(places, axis=-1, keepdims=True) / FOCAL
    found = radii.copy()
    for _ in range(50):
        found -= (found * (1 + k * found**2) - radii) / (1 + 3 * k * found**2)
    return places / FOCAL * found / np.maximum(radii, 1e-12)


def _views(k: float, times: int = 4) -> Views:
    image = _wall(_straight_rays(_places(SIZE), k))
    large = _wall(_straight_rays(_places((SIZE[0] * times, SIZE[1] * times)), k))
    source = cv2.imencode(".jpg", (large[..., ::-1] * 255).round().astype(np.uint8))[1].tobytes()
    K = torch.tensor([[FOCAL / 1.2, 0, SIZE[0] / 2], [0, FOCAL / 1.2, SIZE[1] / 2], [0, 0, 1]])
    lenses = Lenses((0,), (65.0,), (0.35,), (False,), "assumed")
    images = torch.from_numpy(image).float().movedim(-1, 0)[None]
    return Views(images, K[None], ("a.jpg",), (source,), lenses=lenses)


@pytest.mark.parametrize("k", BENDS)
def test_a_straightened_photo_is_a_straight_lens_own(k):
    """Within what cubic interpolation errs on these waves, and JPEG on the large one."""
    views = _views(k)
    found = straighten_views(views, [FoundFocal(1.2, 0.01, 4, k, 0.01)])
    focal = float(found.Ks[0, 0, 0]) * 1.2
    truth = _wall(_places(SIZE) / focal)
    shown, taken = (view.images[0].movedim(0, -1).numpy() for view in (found, views))
    assert np.abs(shown - truth).max() < 0.01 < 0.03 < np.abs(taken - truth).max()
    read = cv2.imdecode(np.frombuffer(found.sources[0], np.uint8), cv2.IMREAD_COLOR)
    assert read is not None
    large = read[..., ::-1] / 255
    truth = _wall(_places((SIZE[0] * 4, SIZE[1] * 4)) / focal)
    assert np.sqrt(((large - truth) ** 2).mean()) < 0.015
    assert found.lenses is not None and found.lenses.straightened[0] is not None


@pytest.mark.parametrize("k", BENDS)
def test_no_pixel_is_without_a_photo_and_none_is_given_away(k):
    bend = k / FOCAL**2
    scale = smallest_scale(SIZE, np.array(SIZE) / 2, bend)
    corners = np.array([[x, y] for x in (0, 56, 112) for y in (0, 42, 84)]) - np.array(SIZE) / 2
    reached = np.abs(distort(corners / scale, bend))
    assert (reached <= np.array(SIZE) / 2 + 1e-3).all()
    assert (np.abs(reached - np.array(SIZE) / 2) < 1e-2).any()
    assert (scale < 1) == (k < 0)


def test_an_extreme_bend_stays_where_the_lens_is_one_to_one():
    bend = -0.9 / FOCAL**2
    scale = smallest_scale(SIZE, np.array(SIZE) / 2, bend)
    farthest = np.hypot(*SIZE) / 2 / scale
    assert 1 + 3 * bend * farthest**2 > 0


def test_photos_without_a_bend_stay_as_they_are():
    views = _views(0.0)
    for found in ([None], [FoundFocal(1.2, 0.01, 4)]):
        same = straighten_views(views, found)
        assert torch.equal(same.images, views.images) and same.sources == views.sources
        assert torch.equal(same.Ks, views.Ks)


def test_two_rounds_are_one_bend():
    """What is left is of second order, a twentieth of the corner's shift at these bends: the next round's."""
    first, second = FoundFocal(1.1, 0.02, 4, -0.12, 0.02), FoundFocal(1.15, 0.01, 4, -0.03, 0.01)
    both = after(first, second)
    q = np.linspace(0, 0.7, 20)[:, None] * np.ones((1, 2)) / np.sqrt(2)
    # p2 = f2 (1 + k2 q^2) q is the straightened place, of which q1 = p2 / f1 went through the first lens
    inner = distort(q, second.bend) * second.growth / first.growth
    exact = distort(inner, first.bend) * first.growth
    once = distort(q, both.bend) * both.growth
    assert np.abs(once - exact).max() < 0.05 * np.abs(exact - q * both.growth).max()
    assert after(None, second) == second
