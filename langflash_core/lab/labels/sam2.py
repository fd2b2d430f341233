"""SAM 2 of transformers (extra `sam2`): proposes, refines, and follows objects by its memory of a video.

Sizes: N prompts, H W pixels of a frame, S the side of the square that is seen, T frames.

Source: Ravi et al. 2024, SAM 2: Segment Anything in Images and Videos.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8, UInt16
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.optional import optional_packages
from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.errors import WeightsError
from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.masks import painted
from langflash_core.lab.labels.protocols import Following

_MEAN, _STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)


@dataclass(frozen=True)
class Embedded:
    """A photo after the encoder: its maps, and its size (H, W)."""

    features: Any
    size: tuple[int, int]


class Sam2Pictures:
    """Transformers' Sam2Model, asked like `MobileSam`; photos are squeezed to a square."""

    def __init__(self, model: Any) -> None:
        self._model = model.requires_grad_(False).eval()
        self._side = int(model.config.prompt_encoder_config.image_size)

    @torch.inference_mode()
    def look(self, image: UInt8[np.ndarray, "H W 3"]) -> Embedded:
        """Encode a photo."""
        pixels = normalised(image, self._side).to(self._model.device)
        return Embedded(self._model.get_image_embeddings(pixels), (image.shape[0], image.shape[1]))

    def by_points(self, looked: Embedded, points: Float[Tensor, "N 2"]) -> tuple[Tensor, Tensor]:
        """Three masks a point: logits (N, 3, q, q), above 0 inside, and predicted IoU (N, 3)."""
        places = self._places(points, looked)[None, :, None]
        says = torch.ones(places.shape[:3], dtype=torch.int64)
        return self._ask(looked, True, input_points=places, input_labels=says)

    def by_masks(
        self,
        looked: Embedded,
        masks: Float[Tensor, "N H W"],
        points: Float[Tensor, "N P 2"],
        boxes: Float[Tensor, "N 4"],
    ) -> tuple[Tensor, Tensor]:
        """Logits (N, 1, q, q) and predicted IoU (N, 1) of rough masks' boxes and inner points; the model
        takes one rough mask a photo, so their shapes are not asked with."""
        corners = self._places(boxes.unflatten(1, (2, 2)), looked).flatten(1)
        inside = self._places(points, looked)[None]
        says = torch.ones(inside.shape[:3], dtype=torch.int64)
        return self._ask(looked, False, input_points=inside, input_labels=says, input_boxes=corners[None])

    def on_photo(self, logits: Float[Tensor, "*N q q"], looked: Embedded) -> Float[Tensor, "*N H W"]:
        """At the photo's pixels."""
        flat = logits.flatten(0, -3)[:, None]
        large = F.interpolate(flat, looked.size, mode="bilinear", align_corners=False)[:, 0]
        return large.view(*logits.shape[:-2], *looked.size)

    def _places(self, points: Tensor, looked: Embedded) -> Tensor:
        """Of the photo, in the square's pixels."""
        height, width = looked.size
        return points.float() * torch.tensor([self._side / width, self._side / height])

    @torch.inference_mode()
    def _ask(self, looked: Embedded, several: bool, **prompts: Tensor) -> tuple[Tensor, Tensor]:
        placed = {name: value.to(self._model.device) for name, value in prompts.items()}
        found = self._model(image_embeddings=looked.features, multimask_output=several, **placed)
        return found.pred_masks[0].float().cpu(), found.iou_scores[0].float().cpu()


class Sam2Propagator:
    """Transformers' Sam2VideoModel, frame by frame: objects may join at any time."""

    def __init__(self, model: Any) -> None:
        self._model = model.requires_grad_(False).eval()

    def follow(self, clip: Clip) -> Following:
        """Begin at the clip's first frame, without objects."""
        return _Sam2Following(self._model, clip)


class _Sam2Following:
    def __init__(self, model: Any, clip: Clip) -> None:
        with optional_packages():
            ensure_torchvision()
            from transformers.models.sam2_video.modeling_sam2_video import (  # pyright: ignore[reportMissingImports]
                Sam2VideoInferenceSession,
            )

        self._model, self._clip = model, clip
        self._side = int(model.config.prompt_encoder_config.image_size)
        self._size = clip.read(0).shape[:2]
        self._ids = np.zeros(self._size, np.uint16)
        self._session = Sam2VideoInferenceSession(
            video_height=self._size[0],
            video_width=self._size[1],
            inference_device=model.device,
            dtype=torch.float32,
        )

    def add(self, frame: int, ids: UInt16[np.ndarray, "H W"]) -> None:
        """Each becomes an object of the model's, whose memory begins with its mask here; of a known one the
        memory is put right by all of it."""
        self._ids = np.where(self._ids > 0, self._ids, ids)
        numbers = np.unique(ids[ids > 0])
        masks = self._ids[None] == numbers[:, None, None]
        for number, mask in zip(numbers.tolist(), masks, strict=True):
            square = torch.from_numpy(mask)[None, None].float()
            large = F.interpolate(square, (self._side, self._side), mode="bilinear", antialias=True)
            place = self._session.obj_id_to_idx(number)
            self._session.add_mask_inputs(place, frame, (large >= 0.5).float())
        self._session.obj_with_new_inputs = numbers.tolist()
        if len(numbers):
            self._model(self._session, frame_idx=frame)

    def to(self, frame: int) -> UInt16[np.ndarray, "H W"]:
        """What the model remembers of every object, found in this frame."""
        pixels = normalised(self._clip.read(frame), self._side)[0]
        self._session.add_new_frame(pixels, frame)
        self._session.processed_frames.pop(frame - 2, None)  # frames are read again from the clip, never here
        if self._session.get_obj_num() == 0:
            return self._ids
        found = self._model(self._session, frame_idx=frame)
        logits = F.interpolate(found.pred_masks.float(), self._size, mode="bilinear", align_corners=False)
        masks = (logits[:, 0] > 0).cpu().numpy()
        self._ids = painted(masks, np.array(found.object_ids), self._size)
        return self._ids


def normalised(image: UInt8[np.ndarray, "H W 3"], side: int) -> Float[Tensor, "1 3 S S"]:
    """As SAM 2 takes pictures: a square whatever their shape, ImageNet's mean and deviation."""
    square = cv2.resize(image, (side, side), interpolation=cv2.INTER_LINEAR).astype(np.float32) / 255
    return torch.from_numpy((square - _MEAN) / _STD).float().movedim(-1, 0)[None]


def load_sam2(source: str, device: str = "cpu") -> tuple[Sam2Pictures, Sam2Propagator]:
    """Both models of one checkpoint.

    Args:
        source: a folder as transformers saves it, or a name that it fetches, "facebook/sam2.1-hiera-small".

    Raises:
        WeightsError: there is no such checkpoint. MissingPackageError: transformers is not installed.
    """
    with optional_packages():
        ensure_torchvision()
        from transformers import Sam2Model, Sam2VideoModel  # pyright: ignore[reportMissingImports]
    try:
        models = [kind.from_pretrained(source).to(device) for kind in (Sam2Model, Sam2VideoModel)]
    except (OSError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:160]
        raise WeightsError(
            f"SAM 2 cannot be had from {source} ({reason}); give a folder that transformers saved, or a name "
            "such as facebook/sam2.1-hiera-small"
        ) from None
    return Sam2Pictures(models[0]), Sam2Propagator(models[1])
