"""MobileSAM whole: its checkpoint, a photo looked at once, and prompts about it.

Sizes: N prompts, P points each, H W pixels of the photo, S the side of the square that is seen.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, UInt8
from PIL import Image
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.checkpoints.importing import read_checkpoint
from langflash_core.network.encoders.mobile_sam import SIDE, MobileSamEncoder, load_frozen, own_names
from langflash_core.network.semantics.mobile_sam.decoder import MaskDecoder
from langflash_core.network.semantics.mobile_sam.prompts import (
    INSIDE,
    LEFT_TOP,
    NO_POINT,
    RIGHT_BOTTOM,
    PromptEncoder,
)

_SURE = 10.0
"""Logit of a rough mask that is given as yes or no."""


@dataclass(frozen=True)
class Looked:
    """A photo after the encoder: its map (1, 256, S/16, S/16), its size (H, W), and pixels of the square a
    pixel of the photo."""

    features: Float[Tensor, "1 256 _ _"]
    size: tuple[int, int]
    scale: float


class MobileSam(nn.Module):
    """`look` once a photo, then ask as often as one likes."""

    def __init__(self, side: int = SIDE) -> None:
        """Without weights.

        Args:
            side: S, a multiple of 64; a smaller one is quicker and sees less.
        """
        super().__init__()
        self.side = side
        self.image_encoder = MobileSamEncoder(side)
        self.prompt_encoder = PromptEncoder()
        self.mask_decoder = MaskDecoder()

    @torch.inference_mode()
    def look(self, image: UInt8[np.ndarray, "H W 3"]) -> Looked:
        """Encode a photo: its longer side becomes S, what is missing of the square is zero."""
        rows, columns = self.image_encoder.fitting(*image.shape[:2])
        small = Image.fromarray(image).resize((columns, rows), Image.Resampling.BILINEAR)
        pixels = torch.from_numpy(np.array(small)).to(self._device).movedim(-1, 0)[None] / 255
        features = self.image_encoder(self.image_encoder.pad_to_square(pixels))
        return Looked(features, image.shape[:2], self.side / max(image.shape[:2]))

    def by_points(
        self, looked: Looked, points: Float[Tensor, "N 2"]
    ) -> tuple[Float[Tensor, "N 3 _ _"], Float[Tensor, "N 3"]]:
        """Three masks a point: logits (N, 3, S/4, S/4), above 0 inside, and predicted IoU (N, 3).

        Args:
            points: (x, y) in pixels of the photo.
        """
        says = torch.tensor([INSIDE, NO_POINT]).expand(len(points), 2)
        positions = torch.stack((points, torch.zeros_like(points)), 1)
        logits, scores = self._ask(looked, positions, says, None)
        return logits[:, 1:], scores[:, 1:]

    def by_masks(
        self,
        looked: Looked,
        masks: Float[Tensor, "N H W"],
        points: Float[Tensor, "N P 2"],
        boxes: Float[Tensor, "N 4"],
    ) -> tuple[Float[Tensor, "N 4 _ _"], Float[Tensor, "N 4"]]:
        """Rough masks made good: logits (N, 4, S/4, S/4) and predicted IoU (N, 4), the first of each the one
        for prompts that leave nothing open.

        Args:
            masks: 1 inside, -1 outside, 0 where nobody knows.
            points: inside the things. boxes: left, top, right, bottom; pixels of the photo, both.
        """
        inside = torch.full(points.shape[:2], INSIDE)
        corners = torch.tensor([LEFT_TOP, RIGHT_BOTTOM]).expand(len(boxes), 2)
        positions = torch.cat((points, boxes.unflatten(1, (2, 2))), 1)
        return self._ask(looked, positions, torch.cat((inside, corners), 1), self._rough(looked, masks))

    @torch.inference_mode()
    def _ask(
        self, looked: Looked, positions: Tensor, says: Tensor, rough: Tensor | None
    ) -> tuple[Tensor, Tensor]:
        """Positions (N, P, 2) in the photo's pixels."""
        device = self._device
        tokens = self.prompt_encoder.points(
            positions.to(device).float() * looked.scale, says.to(device), self.side
        )
        where = self.prompt_encoder.grid(looked.features.shape[-1])
        logits, scores = self.mask_decoder(looked.features, where, tokens, self.prompt_encoder.rough(rough))
        return logits.cpu(), scores.cpu()

    def on_photo(self, logits: Float[Tensor, "*N q q"], looked: Looked) -> Float[Tensor, "*N H W"]:
        """Logits of the square's quarter grid at the photo's pixels."""
        height, width = looked.size
        whole = (max(height, width),) * 2
        flat = logits.flatten(0, -3)[:, None]
        large = F.interpolate(flat, whole, mode="bilinear", align_corners=False)[:, 0, :height, :width]
        return large.view(*logits.shape[:-2], height, width)

    def _rough(self, looked: Looked, masks: Tensor) -> Tensor:
        """Masks (N, H, W) in [-1, 1] as logits on the square's quarter grid."""
        quarter = self.side // 4
        height, width = (max(1, round(side * looked.scale / 4)) for side in looked.size)
        small = F.interpolate(masks[:, None], (height, width), mode="area")[:, 0]
        logits = small * _SURE
        filled = F.pad(logits, (0, quarter - width, 0, quarter - height), value=-_SURE)
        return filled.to(self._device)

    @property
    def _device(self) -> torch.device:
        return self.mask_decoder.iou_token.weight.device


def load_mobile_sam(path: Path, side: int = SIDE, device: str = "cpu") -> MobileSam:
    """The network with the weights of a file: .safetensors, or the published .pt.

    Raises:
        WeightsError: the file cannot be read, or is not of MobileSAM.
    """
    return load_frozen(MobileSam(side), own_names(read_checkpoint(path)), path, "MobileSAM").to(device)
