"""How near a drawn picture is to its photo where a pixel of the network's grid is several of the photo's.

Pictures are (H, W, 3) in [0, 1] at the photo's size, "grey" is (H, W), `LUMA` times red, green, blue. The
*period* is the spacing of the grid in pixels of the photo: photo size / grid size, 3 at the most. PSNR is in
`training.measures`, LPIPS in `lpips`. Every measure is NaN where nothing can be measured.

H W pixels, L the side of a window, M lines, A harmonics.
"""

import math
from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Bool, Float
from PIL import Image
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.walk_measures import lit
from langflash_core.lab.training.losses import structural_similarity
from langflash_core.lab.training.measures import psnr
from langflash_core.types import LUMA, Camera

OPAQUE = 0.99
"""Alpha from which a pixel lets nothing through; a single Gaussian is never drawn denser."""
_ROUNDING = 1e-3
"""Frames come in half precision, which knows .99 to 5e-4, and a product of few layers to twice that."""
FLAT = 4 / 255
"""Standard deviation of a photo's grey in a window below which it is a flat wall."""
PERIODS = 8
"""Sides of a window, so that noise of deviation s reads as a lattice of only .06 s at a period of 3."""


_WINDOW = 7
"""Pixels, the side of what is around a pixel: a table's leg, and not the table."""
_FOGGED = 0.25
"""Of the photo's own local contrast, below which a pixel is fog."""
SIGMA, RADIUS = 1.5, 5
"""Of the Gaussian window of SSIM: 11 x 11 pixels."""


def grey_of(rgb: Float[Tensor, "H W 3"]) -> Float[Tensor, "H W"]:
    """Grey in [0, 1] of a picture, which is clamped first."""
    return rgb.clamp(0, 1) @ torch.tensor(LUMA).to(rgb)


def check_pictures(drawn: Float[Tensor, "_h _w 3"], photo: Float[Tensor, "H W 3"]) -> None:
    """Prove that two pictures can be compared.

    Raises:
        InputError: they differ in size, have less than 3 x 3 pixels, or hold what is no finite number.
    """
    sizes = [f"{p.shape[1]} x {p.shape[0]}" for p in (drawn, photo)]
    if drawn.shape != photo.shape:
        raise InputError(f"a picture of {sizes[0]} is beside a photo of {sizes[1]}; draw it at that size")
    if min(photo.shape[:2]) < 3:
        raise InputError(f"a picture of {sizes[1]} has no detail to measure; give 3 x 3 pixels or more")
    if not bool(drawn.isfinite().all() and photo.isfinite().all()):
        raise InputError("a picture holds values that are not finite; draw scenes of finite Gaussians")


def fine(grey: Float[Tensor, "H W"]) -> Float[Tensor, "h w"]:
    """Grey minus the mean of the 3 x 3 pixels around, (H - 2, W - 2): only where all nine are."""
    return grey[1:-1, 1:-1] - F.avg_pool2d(grey[None], 3, stride=1)[0]


def detail(
    drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"], counted: Bool[Tensor, "H W"] | None = None
) -> float:
    """Energy of `fine` of what is drawn over that of the photo: sum |fine(d)|^2 / sum |fine(p)|^2.

    1 for the photo itself, 0 for a blur; noise and lattices count as well (`true_detail` tells). A cosine of
    w radians a pixel after a 3 x 3 mean has ((1 + 2 cos w) / 3)^2. counted: None means all pixels.
    """
    check_pictures(drawn, photo)
    made, truth = _fine_of(drawn, counted), _fine_of(photo, counted)
    return _ratio(made.square().sum(), truth.square().sum())


def true_detail(
    drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"], counted: Bool[Tensor, "H W"] | None = None
) -> float:
    """Share of the photo's fine contrast that is drawn in its place: sum fine(d) fine(p) / sum |fine(p)|^2.

    1 for the photo, 0 for a blur and, unlike `detail`, for noise and lattices; below 0 for a negative.
    """
    check_pictures(drawn, photo)
    made, truth = _fine_of(drawn, counted), _fine_of(photo, counted)
    return _ratio((made * truth).sum(), truth.square().sum())


def _fine_of(rgb: Tensor, counted: Tensor | None) -> Tensor:
    kept = fine(grey_of(rgb.double()))
    return kept if counted is None else kept[counted[1:-1, 1:-1]]


def _ratio(part: Tensor, whole: Tensor) -> float:
    return float(part / whole) if float(whole) > 1e-12 else math.nan


def window_side(period: float) -> int:
    """L of the windows in which a lattice is sought, pixels."""
    return max(1, round(PERIODS * period))


def flat_windows(photo: Float[Tensor, "H W 3"], side: int) -> list[tuple[int, int]]:
    """(top, left) of the windows of a tiling in which the photo is flat (`FLAT`), the flattest first."""
    grey = grey_of(photo)
    rows, columns = (size // side for size in grey.shape)
    if rows * columns == 0:
        return []
    tiles = grey[: rows * side, : columns * side].unflatten(1, (columns, side)).unflatten(0, (rows, side))
    spread = tiles.double().std((1, 3), correction=0).flatten()
    order = [place for place in spread.argsort(stable=True).tolist() if float(spread[place]) < FLAT]
    return [(place // columns * side, place % columns * side) for place in order]


def lattice(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"], period: float) -> float:
    """What the grid of Gaussians shows of itself on flat walls: root mean square in 1/255.

    In every flat window (`flat_windows`, L = 8 periods) e = grey(drawn) - grey(photo) is averaged down and
    across to two profiles of L values, E_x(x) and E_y(y). To each, a + b x + sum_k (c_k cos 2 pi k x / period
    + s_k sin 2 pi k x / period) is fitted by least squares over the harmonics k >= 1 up to half a cycle a
    pixel. The measure is 255 sqrt(mean over windows of (mean H_x^2 + mean H_y^2)), H the sum over k alone.
    A lattice A cos(2 pi x / period) + A cos(2 pi y / period) has 255 A.

    Args:
        period: spacing of the grid, pixels; below 2 nothing can be measured. The grid lies along the axes:
            pictures from a photo's own place.

    Source: own; the least squares is a Fourier transform where L is a multiple of the period.
    """
    check_pictures(drawn, photo)
    side = window_side(period)
    windows = flat_windows(photo, side) if period >= 2 else []
    if not windows:
        return math.nan
    error = grey_of(drawn).double() - grey_of(photo).double()
    tiles = torch.stack([error[top : top + side, left : left + side] for top, left in windows])
    energy = harmonic_energy(tiles.mean(1), period) + harmonic_energy(tiles.mean(2), period)
    return 255 * math.sqrt(float(energy.mean()))


def harmonic_energy(lines: Float[Tensor, "M L"], period: float) -> Float[Tensor, " M"]:
    """Mean square of the part of each line that repeats with a period, after its slope (see `lattice`)."""
    places = torch.arange(lines.shape[1], dtype=torch.float64)
    turns = [2 * math.pi * k / period for k in range(1, int(period / 2 + 1e-9) + 1)]
    waves = [wave(turn * places) for turn in turns for wave in (torch.cos, torch.sin)]
    basis = torch.stack([torch.ones_like(places), places / len(places), *waves], 1)  # (L, 2 + 2 A)
    found = torch.linalg.pinv(basis, rtol=1e-9) @ lines.double().T  # the sine is 0 at half a cycle a pixel
    return (basis[:, 2:] @ found[2:]).square().mean(0)


def opaque(alphas: Float[Tensor, "H W"], counted: Bool[Tensor, "H W"] | None = None) -> float:
    """Share of pixels, in [0, 1], that let nothing through: alpha of at least `OPAQUE`.

    Raises:
        InputError: there is no pixel, or an alpha is no finite number.
    """
    _check_alphas(alphas)
    kept = alphas if counted is None else alphas[counted]
    return float((kept >= OPAQUE - _ROUNDING).float().mean()) if kept.numel() else math.nan


def let_through(alphas: Float[Tensor, "H W"], counted: Bool[Tensor, "H W"] | None = None) -> float:
    """Mean share of light, in [0, 1], that comes from behind the scene: 1 - alpha, which darkens a picture
    over black. Says by how much surfaces fail to be `opaque`."""
    _check_alphas(alphas)
    kept = alphas if counted is None else alphas[counted]
    return float((1 - kept).mean()) if kept.numel() else math.nan


def _check_alphas(alphas: Tensor) -> None:
    if alphas.numel() == 0 or not bool(alphas.isfinite().all()):
        raise InputError("alphas hold no pixel, or values that are not finite; draw a scene that has some")


def ripple(crops: Sequence[Float[Tensor, "H W 3"]], spacing: float) -> float:
    """What enlarged flat walls show within one spacing of Gaussians: standard deviation in 1/255.

    255 sqrt(mean over crops and pixels of (grey - its mean over a square of one spacing)^2), where the whole
    square fits: shading goes, what repeats from Gaussian to Gaussian stays. A cosine of amplitude A across
    has 255 A / sqrt 2.

    Args:
        crops: of one size. spacing: of the grid, pixels of the crops.
    """
    side = round(spacing)
    if not crops or side < 2 or min(crops[0].shape[:2]) < side:
        return math.nan
    greys = torch.stack([grey_of(crop.double()) for crop in crops])[:, None]
    means = F.avg_pool2d(greys, side, stride=1)
    low, (height, width) = side // 2, means.shape[-2:]
    rest = greys[..., low : low + height, low : low + width] - means
    return 255 * math.sqrt(float(rest.square().mean()))


def on_grid(photo: Float[Tensor, "H W 3"], grid: tuple[int, int]) -> Float[Tensor, "H W 3"]:
    """The photo brought to the network's grid (width, height) by the means over areas, and back by bicubic
    interpolation: what no picture of one colour a cell, laid over each other smoothly, is far above."""
    height, width = photo.shape[:2]
    planes = []
    for plane in photo.float().cpu().unbind(-1):
        small = Image.fromarray(plane.numpy()).resize(grid, Image.Resampling.BOX)
        planes.append(np.asarray(small.resize((width, height), Image.Resampling.BICUBIC)))
    return torch.from_numpy(np.stack(planes, -1)).clamp(0, 1).to(photo)


def crop_camera(camera: Camera, corner: tuple[int, int], side: int, times: float) -> Camera:
    """A square window of a camera's picture, `times` as large.

    Args:
        corner: (top, left) of the window, pixels of the camera. side: of it, pixels of the camera.
    """
    top, left = corner
    K = camera.K.clone()
    K[0, 2] -= left
    K[1, 2] -= top
    K[:2] *= times
    return Camera(camera.viewmat, K, round(side * times), round(side * times))


def spread_windows(size: tuple[int, int], side: int, count: int = 3) -> list[tuple[int, int]]:
    """(top, left) of count x count windows, evenly over a picture of `size` (width, height)."""
    width, height = size
    places = [(k + 0.5) / count for k in range(count)]
    return [
        (max(0, round(y * height - side / 2)), max(0, round(x * width - side / 2)))
        for y in places
        for x in places
    ]


# Whatever its light: for real walks, whose mean of squared errors hides fog.


def in_its_light(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> Float[Tensor, "H W 3"]:
    """What is drawn in the photo's light: a gain and an offset a channel, by least squares, within [0, 1]."""
    return lit(drawn.reshape(-1, 3), photo.reshape(-1, 3)).reshape(drawn.shape).clamp(0, 1)


def structure(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> float:
    """Correlation of the horizontal differences of grey: 1 of the photo itself, about .3 and less of fog."""
    check_pictures(drawn, photo)
    ours, theirs = (grey_of(picture).diff(dim=1).double().flatten() for picture in (drawn, photo))
    ours, theirs = ours - ours.mean(), theirs - theirs.mean()
    norms = float(ours.norm() * theirs.norm())
    return float(ours @ theirs) / norms if norms > 0 else math.nan


def fog(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> float:
    """Share of the pixels around which the photo is no flat wall, where what is drawn has less than a quarter
    of its contrast: the standard deviation of grey in 7 x 7 pixels."""
    check_pictures(drawn, photo)
    made, truth = _contrast(drawn), _contrast(photo)
    textured = truth >= FLAT
    return float((made < _FOGGED * truth)[textured].float().mean()) if bool(textured.any()) else math.nan


def _contrast(picture: Tensor) -> Tensor:
    """(h, w) of the whole windows."""
    side = min(_WINDOW, *picture.shape[:2])
    windows = F.unfold(grey_of(picture).double()[None, None], side)[0]  # (side^2, h w)
    return windows.std(0, correction=0)


def likeness(drawn: Float[Tensor, "H W 3"], photo: Float[Tensor, "H W 3"]) -> dict[str, float]:
    """PSNR in the photo's light, structure and fog."""
    shown = in_its_light(drawn, photo)
    return {
        "psnr": psnr(shown, photo),
        "structure": structure(drawn, photo),
        "fog": fog(shown, photo),
    }


# As papers on novel views report it; the SSIM of the losses, under a box, is in `training.losses`.


def ssim(rendered: Tensor, photo: Tensor) -> float:
    """Mean structural similarity with a Gaussian window; in [-1, 1], 1 for equal pictures.

    As scikit-image's `structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=
    False, data_range=1)`, which leaves the window's radius out at the picture's edges.

    Raises:
        ValueError: the pictures differ in size, or are smaller than the window.

    Source: Wang, Bovik, Sheikh, Simoncelli 2004.
    """
    if rendered.shape != photo.shape or min(photo.shape[:2]) <= 2 * RADIUS:
        sizes = f"{tuple(rendered.shape)}, {tuple(photo.shape)}"
        raise ValueError(f"rendered, photo: expected one size above {2 * RADIUS} pixels, received {sizes}")
    first, second = (p.double().clamp(0, 1).permute(2, 0, 1)[:, None] for p in (rendered, photo))
    return float(structural_similarity(first, second, _smooth).mean())


def _smooth(maps: Tensor) -> Tensor:
    """(C, 1, H, W) under the window, (C, 1, H - 10, W - 10): only where the whole window fits."""
    steps = torch.arange(-RADIUS, RADIUS + 1, dtype=maps.dtype)
    line = torch.exp(-(steps**2) / (2 * SIGMA**2))
    line = line / line.sum()
    return F.conv2d(F.conv2d(maps, line[None, None, :, None]), line[None, None, None, :])
