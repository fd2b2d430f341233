"""Photos whose lens bends straight lines, drawn again as a straight lens would have taken them.

A point at q = (x / z, y / z) is at p = f (1 + k |q|^2) q of the photo and at p' = s f q of the straightened
one, pixels from the principal point: f the focal length, k Brown's first radial term. s is the smallest that
leaves no pixel without a photo behind it.
"""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import torch
from torch import Tensor

from langflash_core.base.records import FoundFocal
from langflash_core.images.settings import STRAIGHTEN
from langflash_core.types import Views


def after(before: FoundFocal | None, found: FoundFocal) -> FoundFocal:
    """Two bends in one: `found` in photos that were straightened as `before` has it.

    To the first order of the bends; what is left is found in the next round.
    """
    if before is None:
        return found
    ratio = found.growth / before.growth
    return replace(found, bend=found.bend + before.bend * ratio**2)


def straighten_views(views: Views, found: Sequence[FoundFocal | None]) -> Views:
    """The views as straight lenses would have taken them; what is said of their focal lengths grows by s.

    Args:
        found: of each lens of `views.lenses`; None, or no bend: its photos stay as they are.
    """
    assert views.lenses is not None, "bends are sought of lenses that are known"
    images, sources, Ks = list(views.images), list(views.sources), views.Ks.clone()
    for v, lens in enumerate(views.lenses.of):
        own = found[lens]
        if own is None or not own.bend:
            continue
        K = views.Ks[v].double().numpy()
        bend = own.bend / (K[0, 0] * own.growth) ** 2  # of pixels of the view
        scale = smallest_scale(views.size, K[:2, 2], bend)
        images[v] = _redrawn(views.images[v], K[:2, 2], bend, scale)
        if sources:
            sources[v] = _redrawn_source(sources[v], views.size, K[:2, 2], bend, scale)
        Ks[v, :2, :2] *= scale
    lenses = replace(views.lenses, straightened=tuple(found))
    return replace(views, images=torch.stack(images), sources=tuple(sources), Ks=Ks, lenses=lenses)


def smallest_scale(size: tuple[int, int], centre: np.ndarray, bend: float) -> float:
    """The smallest s with which every pixel of the straightened photo has one of the photo behind it.

    Args:
        size: (width, height) pixels. centre (2,): the principal point. bend: k / f^2, per squared pixel.
    """
    width, height = size
    x, y = np.linspace(0, width, 65), np.linspace(0, height, 65)
    sides = [np.column_stack((x, np.full(65, edge))) for edge in (0.0, height)]
    sides += [np.column_stack((np.full(65, edge), y)) for edge in (0.0, width)]
    border = np.concatenate(sides) - centre
    low, high = STRAIGHTEN.scales
    for _ in range(STRAIGHTEN.steps):
        middle = (low + high) / 2
        places = distort(border / middle, bend) + centre
        steep = 1 + 3 * bend * ((border / middle) ** 2).sum(1).max() > STRAIGHTEN.steepest
        inside = steep and (places >= 0).all() and (places <= np.array(size)).all()
        low, high = (low, middle) if inside else (middle, high)
    return high


def distort(places: np.ndarray, bend: float) -> np.ndarray:
    """Where a lens puts what a straight one puts at `places` (n, 2), from the principal point."""
    return places * (1 + bend * (places**2).sum(-1, keepdims=True))


def _undistort(pixels: np.ndarray, centre: np.ndarray, bend: float, scale: float) -> np.ndarray:
    """Pixels (h, w, 3), straightened; numbers in their own pixels, the first one's middle is at .5."""
    height, width = pixels.shape[:2]
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    straight = (np.stack((columns, rows), -1) - centre) / scale
    places = (distort(straight, bend) + centre - 0.5).astype(np.float32)
    nearest = cv2.BORDER_REPLICATE
    return cv2.remap(pixels, places, None, cv2.INTER_CUBIC, borderMode=nearest)  # pyright: ignore


def _redrawn(image: Tensor, centre: np.ndarray, bend: float, scale: float) -> Tensor:
    """An image (3, H, W) in [0, 1]."""
    drawn = _undistort(image.movedim(0, -1).numpy(), centre, bend, scale)
    return torch.from_numpy(drawn).movedim(-1, 0).clamp(0, 1).contiguous()


def _redrawn_source(
    source: bytes, size: tuple[int, int], centre: np.ndarray, bend: float, scale: float
) -> bytes:
    """JPEG bytes of the same crop, larger than the view of `size`."""
    pixels = cv2.imdecode(np.frombuffer(source, np.uint8), cv2.IMREAD_COLOR)
    assert pixels is not None, "sources are JPEG bytes that images/ wrote"
    times = pixels.shape[1] / size[0]
    drawn = _undistort(pixels, centre * times, bend / times**2, scale)
    return cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, STRAIGHTEN.quality])[1].tobytes()
