"""Labelled photos held in memory and drawn anew at every step: another window, another light.

All photos of a data set tend to come from one camera; what other cameras do to a picture is drawn here.

Sizes: B photos, H W pixels.
"""

import io
import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from PIL import Image, ImageFilter
from torch import Tensor

from langflash_core.base.picture_files import opened_picture
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.fitting import drawn_window, fitted
from langflash_core.lab.photos.folder import LabelledPhoto
from langflash_core.types import LUMA

SIZES = ((252, 196), (252, 196), (252, 196), (224, 224), (196, 252), (308, 238))
"""(width, height) of a step's photos, the usual one half of the time; of larger ones fewer are drawn."""

WEATHERED = 0.25
"""Share of photos that look as if another camera had taken them; the others in somewhat other light."""


@dataclass(frozen=True)
class LabelledBatch:
    """images (B, 1, 3, H, W) in [0, 1]; ids (B, H, W) int64 of the folder, 0 = not labelled; depths
    (B, H, W) metres, 0 = unknown; Ks (B, 1, 3, 3); names (B): of the photos."""

    images: Tensor
    ids: Tensor
    depths: Tensor
    Ks: Tensor
    names: tuple[str, ...] = ()

    def to(self, device: str | torch.device) -> "LabelledBatch":
        images, ids, depths, Ks = (part.to(device) for part in (self.images, self.ids, self.depths, self.Ks))
        return LabelledBatch(images, ids, depths, Ks, self.names)


class LivePhotos:
    """Photos of a folder in memory (1.5 MB each)."""

    def __init__(self, folder: PhotoFolder, ids: Sequence[str]):
        """Raises:
        InputError: a photo or its maps cannot be used.
        """
        with ThreadPoolExecutor(2) as pool:
            self.photos = list(pool.map(folder.photo, ids))

    def __len__(self) -> int:
        return len(self.photos)

    def draw(self, count: int, generator: torch.Generator) -> LabelledBatch:
        """`count` random photos, mirrored or not, at one random size; fewer at a larger one."""
        size = SIZES[int(torch.randint(len(SIZES), (1,), generator=generator))]
        count = max(1, min(count, round(count * SIZES[0][0] * SIZES[0][1] / (size[0] * size[1]))))
        views = []
        rows = torch.randint(len(self), (count,), generator=generator).tolist()
        for row in rows:
            seed = int(torch.randint(2**31, (1,), generator=generator))
            view = fitted(self.photos[row], size, *drawn_window(self.photos[row], size, seed))
            views.append((relit(view.rgb, generator), view))
        return LabelledBatch(
            torch.stack([rgb for rgb, _ in views])[:, None].float() / 255,
            torch.stack([view.labels for _, view in views]),
            torch.stack([view.depths for _, view in views]),
            torch.stack([view.K for _, view in views])[:, None],
            tuple(self.photos[row].id for row in rows),
        )


def pictures(photos: Sequence[LabelledPhoto], count: int = 72) -> list[Tensor]:
    """Some of these photos as the network sees them, (1, 1, 3, H, W) in [0, 1], evenly drawn."""
    chosen = photos[:: max(1, len(photos) // count)]
    return [fitted(photo, SIZES[0]).rgb[None, None].float() / 255 for photo in chosen]


def relit(rgb: Tensor, generator: torch.Generator) -> Tensor:
    """A picture (3, H, W) uint8 in somewhat other light; a quarter of them as `weathered` leaves them.

    All of them weathered taught less in the same time (model card).
    """
    u = torch.rand(4, generator=generator).tolist()
    if u[0] < WEATHERED:
        return weathered(rgb, generator)
    x = rgb.float() / 255
    grey = _grey(x)
    x = (grey + (0.6 + 0.8 * u[1]) * (x - grey)) * (0.75 + 0.5 * u[2])
    x = (x - x.mean()) * (0.75 + 0.5 * u[3]) + x.mean()
    return (x.clamp(0, 1) * 255).round().to(torch.uint8)


def _grey(x: Tensor) -> Tensor:
    return (x * torch.tensor(LUMA)[:, None, None]).sum(0, keepdim=True)


def weathered(rgb: Tensor, generator: torch.Generator) -> Tensor:
    """A picture (3, H, W) uint8 as another camera in other light might have taken it: colour of the light,
    exposure, contrast, gamma; grey (a tenth), noise (a quarter), blurred (a fifth), or JPEG (a sixth)."""
    u = torch.rand(12, generator=generator).tolist()
    x = rgb.float() / 255
    grey = _grey(x)
    x = grey + (0.0 if u[0] < 0.1 else 0.5 + u[1]) * (x - grey)
    light = torch.tensor([0.85 + 0.3 * value for value in u[2:5]])[:, None, None]
    x = (x * light * (0.75 + 0.5 * u[5])).clamp(0, 1)
    x = ((x - x.mean()) * (0.7 + 0.6 * u[6]) + x.mean()).clamp(1e-4, 1) ** math.exp(0.7 * (u[7] - 0.5))
    if u[8] < 0.25:
        x = x + 0.03 * u[9] * torch.randn(x.shape, generator=generator)
    taken = (x.clamp(0, 1) * 255).round().to(torch.uint8)
    if u[10] >= 0.35:
        return taken
    picture = Image.fromarray(taken.permute(1, 2, 0).numpy())
    if u[10] < 0.2:
        picture = picture.filter(ImageFilter.GaussianBlur(0.3 + 1.2 * u[11]))
    else:
        packed = io.BytesIO()
        picture.save(packed, "JPEG", quality=int(25 + 60 * u[11]))
        with opened_picture(packed, ("JPEG",)) as decoded:
            picture = decoded.copy()
    return torch.from_numpy(np.array(picture)).permute(2, 0, 1).contiguous()
