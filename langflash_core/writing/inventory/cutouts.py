"""Small pictures of things, cut out of the photos that show them best."""

import base64

import numpy as np
import torch
from PIL import Image
from torch.nn import functional as F

from langflash_core.base.picture_files import decoded_photo, encoded
from langflash_core.base.running import Progress
from langflash_core.export.png import to_8bit
from langflash_core.inventory.things import Inventory
from langflash_core.segments import carrying, segmented_view
from langflash_core.writing.renderers import Renderer
from langflash_core.writing.settings import CUTOUTS


def cutouts_of(found: Inventory, renderer: Renderer, progress: Progress) -> dict[str, str]:
    """A data URL by id, WebP with transparency, of every thing that some photo shows."""
    if not found.things:
        return {}
    segments = found.segments()
    scene, cutouts = carrying(found.given, segments), {}
    best = [thing.photos[0] if thing.photos else 0 for thing in found.things]
    for view in sorted(set(best)):
        progress("cutting out", 0.3 + 0.6 * view / found.scene.num_views)
        seen = segmented_view(scene, segments, found.scene.camera(view), renderer)
        photo = _photo(found, view, seen.frame.rgb)
        for number, thing in enumerate(found.things):
            if best[number] == view:
                picture = _cut_out(photo, seen.mattes[number].cpu())
                if picture is not None:
                    packed = base64.b64encode(encoded(picture, "WEBP", quality=CUTOUTS.quality)).decode()
                    cutouts[thing.id] = f"data:image/webp;base64,{packed}"
    return cutouts


def _photo(found: Inventory, view: int, drawn: torch.Tensor) -> np.ndarray:
    """(H, W, 3) uint8: the photo, or what is drawn of it where the scene has none."""
    photo = decoded_photo(found.scene.photos[view]) if view < len(found.scene.photos) else None
    return to_8bit(drawn) if photo is None else photo


def _cut_out(photo: np.ndarray, matte: torch.Tensor) -> Image.Image | None:
    """The thing on transparency, cropped; None where no pixel is mostly its own."""
    height, width = photo.shape[:2]
    alpha = F.interpolate(matte[None, None], (height, width), mode="bilinear", align_corners=False)[0, 0]
    rows, columns = (alpha >= CUTOUTS.least).nonzero(as_tuple=True)
    if not len(rows):
        return None
    left, top = int(columns.min()), int(rows.min())
    right, bottom = int(columns.max()) + 1, int(rows.max()) + 1
    margin = round(CUTOUTS.margin * max(right - left, bottom - top))
    low = max(0, left - margin), max(0, top - margin)
    box = (*low, min(width, right + margin), min(height, bottom + margin))
    soft = ((alpha - 0.25) / 0.5).clamp(0, 1)
    picture = np.dstack((photo, (soft * 255).round().byte().numpy()))
    cut = Image.fromarray(picture, "RGBA").crop(box)
    cut.thumbnail((CUTOUTS.side, CUTOUTS.side), Image.Resampling.LANCZOS)
    return cut
