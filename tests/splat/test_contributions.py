"""What some pixels show, against the reference with one feature per Gaussian."""

import pytest
import torch

from langflash_core.splat import project
from langflash_core.splat.contributions import composition, contributions
from langflash_core.splat.reference import rasterize
from langflash_core.types import Gaussians
from tests.splat.scenes import camera, cloud, turned

# Both sides sum logarithms in float64, in rectangles of other shapes: digits of 1e-16 a layer.
EXACT = 1e-12


def brush(height: int, width: int, x: float, y: float, radius: float) -> torch.Tensor:
    rows, columns = torch.meshgrid(torch.arange(height) + 0.5, torch.arange(width) + 0.5, indexing="ij")
    return (rows - y) ** 2 + (columns - x) ** 2 <= radius**2


@pytest.mark.parametrize("pose", [None, turned(0.3, (0.1, -0.05, 0.2))])
@pytest.mark.parametrize("at", [(24.0, 20.0, 6.0), (40.0, 34.0, 9.0), (30.0, 10.0, 0.8)])
def test_equals_the_reference_under_a_brush(pose, at):
    gaussians, seen = cloud(400, size=0.06).gaussians, camera(pose=pose)
    pixels = brush(seen.height, seen.width, *at)
    one_each = torch.eye(400, dtype=torch.float64)
    maps, _ = rasterize(gaussians, one_each, seen)  # (H, W, N) = T_i alpha_i
    expected = maps[pixels].amax(0)
    found = contributions(gaussians, seen, pixels)
    torch.testing.assert_close(found, expected, rtol=0, atol=EXACT)
    assert 2 < int((found >= 0.05).sum()) < 200, "a brush shows some and hides others"


def test_cut_into_rectangles_it_is_the_same(monkeypatch):
    gaussians, seen = cloud(300, size=0.08).gaussians, camera()
    pixels = brush(seen.height, seen.width, 20.0, 20.0, 15.0)
    whole = contributions(gaussians, seen, pixels)
    monkeypatch.setattr("langflash_core.splat.reference._MAX_PAIRS", 50)
    torch.testing.assert_close(contributions(gaussians, seen, pixels), whole, rtol=0, atol=EXACT)


def test_through_counts_each_gaussian_as_if_alone():
    gaussians, seen = cloud(40, size=0.08).gaussians, camera(20, 16, 16.0)
    pixels = brush(16, 20, 9.0, 8.0, 4.0)
    feature = torch.ones(1, 1, dtype=torch.float64)
    for i, value in enumerate(contributions(gaussians, seen, pixels, through=True)):
        _, alphas = rasterize(gaussians.map(lambda v, i=i: v[i : i + 1]), feature, seen)
        torch.testing.assert_close(value, alphas[pixels].amax(), rtol=0, atol=EXACT)


def test_what_is_hidden_behind_a_surface_is_found_only_through_it():
    means = torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.0, 1.2], [0.0, 0.0, 1.4], [0.0, 0.0, 2.0]])
    gaussians = Gaussians(
        means, torch.tensor([[1.0, 0, 0, 0]]).expand(4, 4), torch.full((4, 3), 0.2), torch.full((4,), 1.0),
        torch.zeros(4, 1, 3),
    )  # fmt: skip
    seen = camera()
    pixels = brush(40, 48, 24.0, 20.0, 1.0)
    # The nearest lets 1 % through, its 0.99 is the largest alpha there is, the next 0.01 %.
    front, second, *_ = contributions(gaussians, seen, pixels).tolist()
    assert front == pytest.approx(0.99, abs=1e-3) and second < 0.02
    assert (contributions(gaussians, seen, pixels, through=True) > 0.9).all()


def test_no_pixels_no_contribution_and_wrong_sizes_are_refused():
    gaussians, seen = cloud(10).gaussians, camera()
    nothing = torch.zeros(40, 48, dtype=torch.bool)
    assert not contributions(gaussians, seen, nothing).any()
    with pytest.raises(ValueError, match="pixels: expected"):
        contributions(gaussians, seen, nothing[1:])


@pytest.mark.parametrize("x,y", [(24, 20), (12, 6), (30, 11), (20, 33)])
def test_the_composition_of_a_pixel_is_the_reference(x, y):
    gaussians, seen = cloud(400, size=0.06).gaussians, camera(pose=turned(0.2, (0.1, 0.0, 0.0)))
    maps, _ = rasterize(gaussians, torch.eye(400, dtype=torch.float64), seen)
    rows, shares = composition(project(gaussians, seen), x, y)
    dense = torch.zeros(400, dtype=torch.float64)
    dense[rows] = shares
    torch.testing.assert_close(dense, maps[y, x], rtol=0, atol=EXACT)
    assert len(rows) > 0
