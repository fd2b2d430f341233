"""MobileSAM's image encoder: photos to the dense embedding that SAM's masks are read from.

TinyViT-5M as timm has it, but for the last stage, which keeps the grid, and SAM's neck behind it. Sizes: n
photos of H x W pixels, h w the grid, a sixteenth of the side that the encoder sees.

Source: Zhang et al. 2023 (MobileSAM); Wu et al. 2022 (TinyViT); Kirillov et al. 2023 (SAM).
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch
from jaxtyping import Float, Shaped
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.errors import InputError, WeightsError
from langflash_core.network.checkpoints.importing import read_checkpoint

CHANNELS = 256
SIDE = 1024  # pixels of the longer side, as it was trained
STRIDE = 16
_MEAN, _STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
PREFIX = "image_encoder."
"""Of the encoder's names in a file of the whole."""
_UNUSED = (PREFIX + "norm_head.", PREFIX + "head.")  # of an ImageNet classifier
# Names of the published file, and timm's; blocks of a stage come after what leads to them there.
_NAMES = (
    (r"^patch_embed\.seq\.0\.", "patch_embed.conv1."),
    (r"^patch_embed\.seq\.2\.", "patch_embed.conv2."),
    (r"^layers\.(\d)\.downsample\.", lambda found: f"stages.{int(found[1]) + 1}.downsample."),
    (r"^layers\.", "stages."),
    (r"\.c\.weight$", ".conv.weight"),
    (r"^(?!neck)", "body."),
)


Module = TypeVar("Module", bound=nn.Module)


class MobileSamEncoder(nn.Module):
    """Frozen; photos of any size and shape, whose own part of SAM's padded square comes back."""

    def __init__(self, side: int = SIDE) -> None:
        """Without weights; `load_mobile_sam_encoder` brings them.

        Args:
            side: pixels to which a photo's longer side is brought; less is quicker and sees less.

        Raises:
            InputError: the side is no multiple of 16.
        """
        if side < STRIDE or side % STRIDE:
            raise InputError(f"SAM sees sides that are multiples of {STRIDE}, not {side}; choose another")
        super().__init__()
        ensure_torchvision()
        from timm.models.tiny_vit import TinyVit

        self.side = side
        body: Any = TinyVit(
            embed_dims=(64, 128, 160, 320),
            num_heads=(2, 4, 5, 10),
            window_sizes=(7, 7, 14, 7),
            num_classes=0,
            drop_path_rate=0.0,
        )
        body.stages[3].downsample.conv2.conv.stride = (1, 1)
        body.head = nn.Identity()
        self.body = body
        self.neck = nn.Sequential(
            nn.Conv2d(320, CHANNELS, 1, bias=False),
            ChannelNorm(CHANNELS),
            nn.Conv2d(CHANNELS, CHANNELS, 3, padding=1, bias=False),
            ChannelNorm(CHANNELS),
        )

    @property
    def device(self) -> torch.device:
        """Where its numbers lie."""
        return next(self.parameters()).device

    def forward(self, squares: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n 256 h w"]:
        """Embedding (n, 256, h, w) of normalised pictures (n, 3, H, W), sides multiples of 16."""
        return self.neck(self.body.forward_features(squares))

    @torch.inference_mode()
    def dense(self, images: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n 256 h w"]:
        """Embedding (n, 256, h, w) of photos (n, 3, H, W) in [0, 1], max(h, w) = side / 16.

        Cells that show nothing of the photo are left out.
        """
        size = self.fitting(*images.shape[-2:])
        small = F.interpolate(images, size, mode="bilinear", antialias=True)
        rows, columns = (-(-length // STRIDE) for length in size)
        return self(self.pad_to_square(small))[..., :rows, :columns]

    def fitting(self, height: int, width: int) -> tuple[int, int]:
        """Height and width of a photo whose longer side is the encoder's."""
        scale = self.side / max(height, width)
        return max(1, round(height * scale)), max(1, round(width * scale))

    def pad_to_square(self, small: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n 3 H W"]:
        """Squares (n, 3, side, side) of photos (n, 3, h, w) of `fitting` size, in [0, 1].

        Normalised, and zero where nothing is, as SAM has them.
        """
        mean, std = (small.new_tensor(each)[:, None, None] for each in (_MEAN, _STD))
        return F.pad((small - mean) / std, (0, self.side - small.shape[-1], 0, self.side - small.shape[-2]))


class ChannelNorm(nn.LayerNorm):
    """Layer norm over the channels of maps (n, C, h, w)."""

    def __init__(self, width: int) -> None:
        super().__init__(width, eps=1e-6)

    def forward(self, input: Float[Tensor, "n C h w"]) -> Float[Tensor, "n C h w"]:
        return super().forward(input.movedim(1, -1)).movedim(-1, 1)


def load_mobile_sam_encoder(path: Path, side: int = SIDE, device: str = "cpu") -> MobileSamEncoder:
    """The encoder with the weights of a file of MobileSAM: .safetensors, or the published .pt.

    Raises:
        WeightsError: the file cannot be read, or holds another network. InputError: not such a side.
    """
    stored = own_names(read_checkpoint(path))
    state = {name.removeprefix(PREFIX): value for name, value in stored.items() if name.startswith(PREFIX)}
    return load_frozen(MobileSamEncoder(side), state, path, "MobileSAM's encoder").to(device)


def own_names(published: Mapping[str, Shaped[Tensor, "..."]]) -> dict[str, Shaped[Tensor, "..."]]:
    """The tensors of a file of MobileSAM, those of the encoder by the names they have here, in single
    precision; without the classifier's, which nobody asks."""
    return {
        _rename_tensor(name): value.float() if value.is_floating_point() else value
        for name, value in published.items()
        if not name.startswith(_UNUSED)
    }


def load_frozen(network: Module, state: Mapping[str, Shaped[Tensor, "..."]], path: Path, what: str) -> Module:
    """The network, frozen, with exactly these tensors, which are of a file.

    Raises:
        WeightsError: they are others than its own; says what the file does not hold.
    """
    try:
        network.load_state_dict(state)
    except RuntimeError as error:
        reason = " ".join(str(error).split())[:160]
        raise WeightsError(
            f"{path} does not hold {what} ({reason}); give mobile_sam.pt or a .safetensors of it"
        ) from None
    return network.requires_grad_(False).eval()


def _rename_tensor(published: str) -> str:
    if not published.startswith(PREFIX):
        return published
    name = published.removeprefix(PREFIX)
    for pattern, replacement in _NAMES:
        name = re.sub(pattern, replacement, name)
    return PREFIX + name
