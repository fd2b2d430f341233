"""Groups with MobileSAM's outlines, where its weights are installed: each group's mask in each photo is a
prompt, and the answer that means the same thing redraws it.

On 13 photos of rooms, then with the photo's borders (`surface.borders`): F1 of borders .497 with neither,
.533, .564 with the borders alone, .569 with both; with true names for the groups .571, .619, .628, .640. A
square of 1,024 pixels brings no more than one of 512 (.564, .640) and takes four times as long.

Sizes: V views, K groups, H W the grid of the weights, h w a photo.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float, Float64
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.resources import weights_folder
from langflash_core.errors import WeightsError
from langflash_core.network.semantics.mobile_sam.model import Looked, MobileSam, load_mobile_sam
from langflash_core.network.semantics.mobile_sam.rough import agreement, box, middle
from langflash_core.network.semantics.settings import OUTLINING

FILES = ("mobile_sam.safetensors", "mobile_sam_fp16.safetensors", "mobile_sam.pt")
"""Names under which the weights are looked for."""


def mobile_sam_checkpoint() -> Path | None:
    """The weights in the user's folder."""
    return next((path for path in (weights_folder() / name for name in FILES) if path.is_file()), None)


class Outlines:
    """MobileSAM, asked for groups."""

    def __init__(self, model: MobileSam) -> None:
        self.model = model

    @staticmethod
    def load_installed(device: str, side: int = OUTLINING.seen) -> "Outlines":
        """With the weights in the user's folder.

        Raises:
            WeightsError: there are none, or they cannot be read.
        """
        path = mobile_sam_checkpoint()
        if path is None:
            raise WeightsError(
                f"MobileSAM's weights are not at hand; put the authors' {FILES[-1]}, or a .safetensors of it "
                f"called {FILES[0]}, into {weights_folder()}"
            )
        return Outlines(load_mobile_sam(path, side, device))

    @torch.inference_mode()
    def __call__(
        self, weights: Float[Tensor, "V K H W"], photos: Sequence[Float[Tensor, "3 _ _"]]
    ) -> Float[Tensor, "V K H W"]:
        """The weights redrawn, (V, K, H, W), sums to 1 over K; photos (3, h, w) in [0, 1], of any size."""
        if weights.shape[1] == 0:
            return weights
        views = [self._view(own.cpu(), photo) for own, photo in zip(weights, photos, strict=True)]
        return torch.stack(views).to(weights)

    def _view(self, weights: Tensor, photo: Tensor) -> Tensor:
        """One photo's weights (K, H, W)."""
        picture = (photo.clamp(0, 1) * 255).round().byte().movedim(0, -1).cpu().numpy()
        looked = self.model.look(np.ascontiguousarray(picture))
        labels = F.interpolate(weights[None], picture.shape[:2], mode="bilinear")[0].argmax(0).numpy()
        counts = torch.bincount(weights.argmax(0).flatten(), minlength=len(weights))
        asked = [
            k for k in torch.nonzero(counts >= OUTLINING.smallest).flatten().tolist() if (labels == k).any()
        ]
        logits, same = torch.zeros_like(weights), torch.zeros(len(weights))
        for start in range(0, len(asked), OUTLINING.at_once):
            groups = asked[start : start + OUTLINING.at_once]
            found, agree = self._best_masks(
                looked, np.stack([labels == k for k in groups]), weights.shape[1:]
            )
            logits[groups], same[groups] = found, torch.from_numpy(agree).float()
        return apply_outlines(weights, logits, same)

    def _best_masks(
        self, looked: Looked, rough: Bool[np.ndarray, "n h w"], size: Sequence[int]
    ) -> tuple[Float[Tensor, "n H W"], Float64[np.ndarray, " n"]]:
        """Of the answers to each rough mask the one that is most like it: logits, and their IoU."""
        points = torch.tensor([middle(mask) for mask in rough]).float()[:, None]
        boxes = torch.tensor([box(mask) for mask in rough]).float()
        given = torch.from_numpy(np.where(rough, 1.0, -1.0)).float()
        answers, _ = self.model.by_masks(looked, given, points, boxes)
        whole = self.model.on_photo(answers, looked)  # (n, 4, h, w)
        everywhere = np.ones(rough.shape[1:], dtype=bool)
        agree = agreement((whole > 0).numpy(), rough, everywhere)
        best, rows = torch.from_numpy(agree.argmax(1)), torch.arange(len(rough))
        small = F.interpolate(whole[rows, best][None], tuple(size), mode="bilinear", antialias=True)[0]
        return small, agree.max(1)


def apply_outlines(
    weights: Float[Tensor, "K H W"], logits: Float[Tensor, "K H W"], same: Float[Tensor, " K"]
) -> Float[Tensor, "K H W"]:
    """softmax_k(log w_k + l_k), l cut at +-`OUTLINING.sure`; groups whose answer is another thing keep l = 0.

    Args:
        logits: of masks, above 0 inside. same: IoU of mask and group.
    """
    told = torch.where(
        (same >= OUTLINING.same)[:, None, None], logits.clamp(-OUTLINING.sure, OUTLINING.sure), 0.0
    )
    return (weights.clamp_min(math.exp(-2 * OUTLINING.sure)).log() + told).softmax(0)
