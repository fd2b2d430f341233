"""Measures at the photo's size against pictures of which the answer is known by hand."""

import math

import pytest
import torch
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.sharp_measures import (
    FLAT,
    OPAQUE,
    check_pictures,
    crop_camera,
    detail,
    flat_windows,
    lattice,
    let_through,
    on_grid,
    opaque,
    ripple,
    spread_windows,
    true_detail,
    window_side,
)
from langflash_core.lab.evaluation.sights import busiest_corner, closeups
from langflash_core.lab.training.measures import psnr
from langflash_core.splat import render
from tests.app.cli.conftest import stripes

HEIGHT, WIDTH = 96, 120


def noise(seed: int = 0, height: int = HEIGHT, width: int = WIDTH) -> torch.Tensor:
    """Grey noise (H, W, 3) around a half, far from being clamped."""
    grey = 0.5 + 0.05 * torch.randn(height, width, 1, generator=torch.Generator().manual_seed(seed))
    return grey.expand(-1, -1, 3).contiguous()


def wave(period: float, amplitude: float, *, across: bool = True, height: int = HEIGHT, width: int = WIDTH):
    """A cosine around a half, along x or along y."""
    places = torch.arange(width if across else height, dtype=torch.float64)
    line = amplitude * torch.cos(2 * math.pi * places / period + 0.4)
    grey = (line[None] if across else line[:, None]).expand(height, width)
    return (0.5 + grey)[..., None].expand(-1, -1, 3).float()


def flat() -> torch.Tensor:
    return torch.full((HEIGHT, WIDTH, 3), 0.5)


def test_the_photo_itself_has_all_of_its_detail():
    photo = noise()
    assert detail(photo, photo) == 1 and true_detail(photo, photo) == 1
    half = 0.5 + (photo - 0.5) / 2
    # A float32 picture rounds to 6e-8, its fine detail of .05 to 1e-6 of itself.
    assert detail(half, photo) == pytest.approx(0.25, rel=1e-5)
    assert true_detail(half, photo) == pytest.approx(0.5, rel=1e-5)
    assert true_detail(1 - photo, photo) == pytest.approx(-1, rel=1e-5)


@pytest.mark.parametrize("period", [3, 5, 8])
def test_detail_of_a_wave_after_a_mean_of_nine(period: int):
    photo = wave(period, 0.2)
    blurred = F.avg_pool2d(photo.permute(2, 0, 1), 3, stride=1).permute(1, 2, 0)
    gain = (1 + 2 * math.cos(2 * math.pi / period)) / 3
    assert detail(blurred, photo[1:-1, 1:-1]) == pytest.approx(gain**2, abs=1e-5)
    assert true_detail(blurred, photo[1:-1, 1:-1]) == pytest.approx(gain, abs=1e-5)


def test_noise_counts_as_detail_but_not_as_the_photos():
    photo, other = noise(1), noise(2)
    assert detail(other, photo) == pytest.approx(1, rel=0.1)
    assert abs(true_detail(other, photo)) < 4 / math.sqrt(HEIGHT * WIDTH) * 2  # four deviations of chance
    counted = torch.zeros(HEIGHT, WIDTH, dtype=torch.bool)
    counted[:, :60] = True
    mixed = torch.where(counted[..., None], photo, other)
    assert true_detail(mixed, photo, counted) == pytest.approx(1, abs=0.05)  # but for the seam
    assert math.isnan(detail(photo, flat()))


@pytest.mark.parametrize("period", [2.0, 2.286, 2.4, 3.0, 4.5])
def test_a_lattice_is_found_at_its_amplitude(period: float):
    """A cosine of amplitude A each way: 255 A. Two pixels: cos(pi x + .4) alternates with A cos .4."""
    amplitude = 2 / 255
    drawn = flat() + (wave(period, amplitude) - 0.5) + (wave(period, amplitude, across=False) - 0.5)
    expected = 2 * (math.cos(0.4) * math.sqrt(2) if period == 2 else 1)
    # Windows of eight periods are rounded to pixels: at most 1/32 of a turn is cut, 2 % of the energy.
    assert lattice(drawn, flat(), period) == pytest.approx(expected, rel=0.03)


def test_a_lattice_is_told_from_all_else():
    period = 3.0
    slope = torch.linspace(0, 0.1, WIDTH)[None, :, None]
    assert lattice(flat() + slope, flat(), period) < 0.01  # shading
    assert lattice(wave(7.0, 0.02), flat(), period) < 0.3  # 5.1 of another period: a 20th of it leaks
    speckled = flat() + (noise() - 0.5) * (1 / 255 / 0.05)
    floor = 2 / window_side(period)  # four waves fitted to L^2 values: sqrt(4 / L^2) of the deviation
    assert lattice(speckled, flat(), period) == pytest.approx(floor, rel=0.3)
    assert lattice(flat(), flat(), period) == 0


def test_a_lattice_is_sought_on_flat_walls_alone():
    period, photo = 3.0, noise()
    assert flat_windows(photo, window_side(period)) == [] and math.isnan(lattice(photo, photo, period))
    photo[:, :48] = 0.5
    windows = flat_windows(photo, 24)
    assert sorted(windows) == [(top, left) for top in (0, 24, 48, 72) for left in (0, 24)]
    drawn = photo + (wave(period, 3 / 255) - 0.5)
    assert lattice(drawn, photo, period) == pytest.approx(3 / math.sqrt(2), rel=1e-3)
    assert math.isnan(lattice(drawn, photo, 1.5))  # a grid finer than the photo shows nothing of itself
    assert flat_windows(wave(8.0, FLAT * 1.5), 24) == []  # a deviation of 1.06 times the bound
    assert flat_windows(photo, 200) == []


def test_opaque_pixels():
    alphas = torch.tensor([[0.0, 0.9, 0.985], [OPAQUE, 0.995, 1.0]])
    assert opaque(alphas) == 0.5
    assert opaque(alphas.half().float()) == 0.5  # .99 in half precision is .98975
    assert opaque(alphas, alphas > 0.95) == 0.75
    assert math.isnan(opaque(alphas, alphas > 2)) and math.isnan(let_through(alphas, alphas > 2))
    assert let_through(alphas) == pytest.approx((1 + 0.1 + 0.015 + 0.01 + 0.005) / 6, abs=1e-6)
    assert let_through(alphas, alphas > 0.95) == pytest.approx(0.03 / 4, abs=1e-6)


def test_a_ripple_is_told_from_shading():
    shaded = torch.linspace(0.3, 0.6, 192)[None, :, None].expand(192, 192, 3)
    drawn = shaded + (wave(24, 2 / 255, height=192, width=192) - 0.5)
    # The mean over 24 of 24 pixels takes the wave away and leaves the slope, half a pixel aside: .2 / 255.
    assert ripple([drawn, drawn], 24) == pytest.approx(math.sqrt(2 + 0.2**2), rel=0.01)
    assert math.isnan(ripple([], 24)) and math.isnan(ripple([drawn], 300))


def test_a_photo_through_the_grid():
    photo = noise()
    through = on_grid(photo, (WIDTH // 3, HEIGHT // 3))
    assert through.shape == photo.shape and detail(through, photo) < 0.1
    torch.testing.assert_close(on_grid(flat(), (40, 32)), flat())
    torch.testing.assert_close(on_grid(photo, (WIDTH, HEIGHT)), photo)  # as fine as the photo
    assert psnr(on_grid(wave(40.0, 0.2), (40, 32)), wave(40.0, 0.2)) > 45  # what the grid can hold stays
    assert psnr(photo, photo) == 100
    assert psnr(photo + 0.01, photo) == pytest.approx(40, abs=1e-3)


def test_a_crop_shows_a_window_of_the_picture():
    scene = stripes()
    camera = scene.camera(0, 56, 42)
    whole = render(scene, camera, weight_maps=False).rgb
    crop = render(scene, crop_camera(camera, (8, 20), 16, 1), weight_maps=False).rgb
    torch.testing.assert_close(crop, whole[8:24, 20:36], atol=1e-5, rtol=0)
    near = crop_camera(camera, (8, 20), 16, 8)
    assert (near.width, near.height) == (128, 128)
    enlarged = camera.with_size(56 * 8, 42 * 8)
    torch.testing.assert_close(
        render(scene, near, weight_maps=False).alphas,
        render(scene, enlarged, weight_maps=False).alphas[64:192, 160:288],
        atol=1e-5,
        rtol=0,
    )


def test_windows_are_spread_over_the_picture():
    windows = spread_windows((120, 96), 24)
    assert len(windows) == len(set(windows)) == 9
    assert windows[0] == (4, 8) and windows[4] == (36, 48) and windows[-1] == (68, 88)
    assert set(spread_windows((24, 24), 24, 1)) == {(0, 0)}


def test_a_closeup_is_where_the_detail_is():
    photo = flat()
    photo[60:80, 70:100] = noise()[60:80, 70:100]
    top, left = busiest_corner(photo, HEIGHT // 3, WIDTH // 3)
    assert top <= 60 and top + HEIGHT // 3 >= 80 and left <= 70 and left + WIDTH // 3 >= 100
    found = closeups({"photo": photo, "drawn": flat()})
    assert list(found) == ["photo", "drawn"]
    assert found["photo"].shape == found["drawn"].shape == (HEIGHT // 3 * 3, WIDTH // 3 * 3, 3)
    assert found["photo"].std() > 2 and found["drawn"].std() == 0


def test_what_cannot_be_compared_is_refused_in_a_sentence():
    photo = noise()
    broken = photo.clone()
    broken[3, 4, 1] = math.nan
    for measure in (detail, true_detail, lambda drawn, photo: lattice(drawn, photo, 3.0)):
        with pytest.raises(InputError, match="not finite"):
            measure(broken, photo)
        with pytest.raises(InputError, match="give 3 x 3 pixels or more"):
            measure(photo[:0, :0], photo[:0, :0])
    with pytest.raises(InputError, match="a picture of 120 x 95 is beside a photo of 120 x 96"):
        check_pictures(photo[:-1], photo)
    for alphas in (torch.zeros(0, 4), torch.full((2, 2), math.nan)):
        for measure in (opaque, let_through):
            with pytest.raises(InputError, match="no pixel, or values that are not finite"):
                measure(alphas)
