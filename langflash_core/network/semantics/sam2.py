"""Class-agnostic masks of one photo by SAM 2, where its package and a checkpoint are installed.

Its own mask generator asks a grid of points and keeps what is sure and stable; so does this, with
the same questions, but it leaves the choice to the caller (N masks, H W pixels).
"""

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.base.resources import weights_folder
from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.errors import WeightsError

CONFIGS = {
    "sam2.1_hiera_tiny.pt": "configs/sam2.1/sam2.1_hiera_t.yaml",
    "sam2.1_hiera_small.pt": "configs/sam2.1/sam2.1_hiera_s.yaml",
    "sam2.1_hiera_base_plus.pt": "configs/sam2.1/sam2.1_hiera_b+.yaml",
    "sam2.1_hiera_large.pt": "configs/sam2.1/sam2.1_hiera_l.yaml",
}
"""Published file names and the package's own configurations of them."""
GRID = 16  # points along each side; the package's 32 finds little more at 256 pixels
_POINTS_AT_ONCE = 64
_BROKEN = (UnpicklingError, RuntimeError, OSError, EOFError, ValueError, KeyError, AttributeError, TypeError)


@dataclass(frozen=True)
class Segments:
    """Masks of one photo: logits (N, H, W), above 0 inside; scores (N,), predicted IoU in [0, 1]."""

    logits: Float[Tensor, "N H W"]
    scores: Float[Tensor, " N"]


def sam2_checkpoint() -> Path | None:
    """The largest checkpoint that is there, if the package is there too."""
    if find_spec("sam2") is None:
        return None
    present = [weights_folder() / name for name in CONFIGS if (weights_folder() / name).is_file()]
    return present[-1] if present else None


class Sam2:
    """SAM 2 as an oracle of masks. Source: Ravi et al. 2024; asked as Kirillov et al. 2023 ask SAM."""

    def __init__(self, device: str):
        """Reads the model.

        Raises:
            WeightsError: the package or its checkpoint is missing, or cannot be read.
        """
        checkpoint = sam2_checkpoint()
        if checkpoint is None:
            raise WeightsError(
                "SAM 2 is not at hand; install its package (github.com/facebookresearch/sam2) and put a "
                f"checkpoint of its own name, such as {next(iter(CONFIGS))}, into {weights_folder()}"
            )
        self.predictor = _predictor(checkpoint, device)

    @torch.inference_mode()
    def __call__(self, photo: Float[Tensor, "3 H W"]) -> Segments:
        """All masks that a grid of points gives in a photo (3, H, W) in [0, 1], three a point."""
        height, width = photo.shape[-2:]
        picture = (photo.clamp(0, 1) * 255).round().byte().movedim(0, -1).cpu().numpy()
        self.predictor.set_image(picture)
        steps = (np.arange(GRID) + 0.5) / GRID
        points = np.stack(np.meshgrid(steps * width, steps * height), -1).reshape(-1, 1, 2)
        logits, scores = [], []
        for start in range(0, len(points), _POINTS_AT_ONCE):
            asked = points[start : start + _POINTS_AT_ONCE]
            masks, ious, _ = self.predictor.predict(
                asked, np.ones(asked.shape[:2], dtype=np.int32), multimask_output=True, return_logits=True
            )
            logits.append(torch.from_numpy(masks).flatten(0, 1))
            scores.append(torch.from_numpy(ious).flatten())
        return Segments(torch.cat(logits).float(), torch.cat(scores).float())


def _predictor(checkpoint: Path, device: str) -> Any:
    ensure_torchvision()
    from sam2.build_sam import build_sam2  # type: ignore[import-not-found]
    from sam2.sam2_image_predictor import SAM2ImagePredictor  # type: ignore[import-not-found]

    try:
        return SAM2ImagePredictor(build_sam2(CONFIGS[checkpoint.name], str(checkpoint), device=device))
    except _BROKEN as error:
        reason = " ".join(str(error).split())[:120]
        raise WeightsError(f"{checkpoint} is not a checkpoint of SAM 2 ({reason}); copy it again") from None
