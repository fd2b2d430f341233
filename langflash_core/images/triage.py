"""Triage: what about a photo will hurt the scene, one plain sentence each.

Measured on the photo scaled to one size, so that the same scene judged from 1 or 12 megapixels
gets the same answer. `luma` is (H, W) in [0, 1], sRGB values.
"""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import max_pool2d

from langflash_core.errors import ImageError
from langflash_core.geometry.cameras import fov_degrees
from langflash_core.images.decode import PhotoFacts
from langflash_core.images.settings import JUDGING


def photo_notes(photo: PhotoFacts, image: Tensor, grey: np.ndarray) -> list[str]:
    """Size, light, and sharpness of one photo.

    Args:
        image: (3, H, W) as the network sees it.
        grey: (h, w) uint8, the whole photo at the size where light and sharpness are judged.
    """
    notes = []
    if min(photo.width, photo.height) < JUDGING.small_side:
        notes.append(
            f"{photo.name} is small ({photo.width} x {photo.height} pixels), expect little detail; "
            f"use a photo of at least {JUDGING.small_side} pixels a side"
        )
    luma = torch.from_numpy(grey.astype(np.float32)) / 255
    if float(torch.quantile(image.mean(0).flatten(), 0.9)) < JUDGING.dark_lights:
        notes.append(f"{photo.name} is very dark; take it again with more light")
    elif float((luma > 250 / 255).float().mean()) > JUDGING.burnt_share:
        notes.append(f"{photo.name} is over-exposed, more than half of it is pure white; expose it less")
    elif is_blurred(luma):
        notes.append(f"{photo.name} is blurred; hold the camera still and take it again")
    return notes


def check_shown(names: Sequence[str], images: Sequence[Tensor]) -> None:
    """Something is to be seen on one photo at least; images (3, H, W) in [0, 1].

    Raises:
        ImageError: all are black, white, or of one colour, as with a lens cap on.
    """
    if any(_brightness_range(image) >= JUDGING.blank_spread for image in images):
        return
    subject = f"{names[0]} shows" if len(names) == 1 else "the photos show"
    raise ImageError(f"{subject} nothing, all pixels are alike; take photos of a place, with light")


def _brightness_range(image: Tensor) -> float:
    """Between the first and the last hundredth of an image's pixels."""
    low, high = torch.quantile(image.mean(0).flatten(), torch.tensor([0.01, 0.99])).tolist()
    return high - low


def crop_notes(photo: PhotoFacts, box: tuple[float, float, float, float] | None, first: str) -> list[str]:
    """A panorama, or a photo whose shape differs so much from the first that much is cut off;
    box None: all photos are cut to squares, which is no news."""
    aspect = max(photo.width / photo.height, photo.height / photo.width)
    if aspect > 2.0:
        return [
            f"{photo.name} is {aspect:.1f} times as long as wide, only the centre is used; "
            "panoramas do not follow one lens, use plain photos"
        ]
    if box is None:
        return []
    kept = (box[2] - box[0]) * (box[3] - box[1]) / (photo.width * photo.height)
    if 1 - kept > JUDGING.lost_share:
        return [
            f"{photo.name} has another shape than {first}, {1 - kept:.0%} of it was cut off; "
            "take all photos upright or all lengthwise"
        ]
    return []


def fov_notes(name: str, K: Tensor, width: int, height: int) -> list[str]:
    """A field of view on the longer side below 25 or above 110 degrees."""
    horizontal, vertical = fov_degrees(K, width, height)
    fov = horizontal if width >= height else vertical
    if JUDGING.fov_range[0] <= round(fov, 2) <= JUDGING.fov_range[1]:
        return []
    kind = "narrow" if fov < JUDGING.fov_range[0] else "wide"
    return [
        f"{name} has a very {kind} field of view ({fov:.0f} degrees), depth will be poor; use a normal lens"
    ]


def identical_notes(names: Sequence[str], images: Sequence[Tensor]) -> list[str]:
    """Photos that show the same picture as an earlier one: they carry no parallax."""
    notes = []
    for later in range(1, len(images)):
        for earlier in range(later):
            if float((images[later] - images[earlier]).abs().mean()) < JUDGING.same_difference:
                notes.append(
                    f"{names[earlier]} and {names[later]} show the same picture; "
                    "take them from places a step apart"
                )
                break
    if len(notes) <= JUDGING.alike_one_by_one:
        return notes
    return [
        f"{len(notes)} of {len(images)} photos show the same picture as one before them; "
        "take them from places a step apart"
    ]


def is_blurred(luma: Tensor) -> bool:
    """Whether, along x or along y, even the sharpest edges of `luma` (H, W) rise over many pixels.

    An edge of contrast A under Gaussian blur sigma has the steepest slope A / (sigma sqrt(2 pi)),
    so A / slope is its width whatever its strength: a plain wall with one sharp edge is sharp,
    and shallow focus with one sharp subject is too. Judged on the blocks that hold an edge, by
    the sharpest fifth of them; with too few such blocks there is nothing to judge. The two
    directions apart, because a moving camera smears one and leaves the other sharp.
    """
    return any(
        len(widths) >= JUDGING.edge_blocks and float(torch.quantile(widths, 0.2)) > JUDGING.blur_width
        for widths in (edge_widths(luma), edge_widths(luma.T))
    )


def edge_widths(luma: Tensor) -> Tensor:
    """Contrast / steepest slope along x in pixels, one per stretch of a row that crosses an edge.

    Stretches that run nearly along an edge are left out: they see it rise slowly at any sharpness.
    """
    slope_x = (luma[1:-1, 2:] - luma[1:-1, :-2])[None].abs() / 2
    slope_y = (luma[2:, 1:-1] - luma[:-2, 1:-1])[None].abs() / 2
    inner = luma[None, 1:-1, 1:-1]

    def highest(values: Tensor) -> Tensor:
        return max_pool2d(
            values, (1, JUDGING.window), stride=(4, JUDGING.block), padding=(0, JUDGING.window // 2)
        ).flatten()

    contrast = highest(inner) + highest(-inner)
    steepest = highest(slope_x)
    crossing = highest(torch.where(slope_x >= slope_y, slope_x, 0.0)) >= 0.99 * steepest
    edges = (contrast > JUDGING.edge_contrast) & crossing
    return contrast[edges] / steepest[edges].clamp_min(1e-6)
