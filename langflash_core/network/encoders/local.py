"""Local features that correspond between photos: a small frozen network trained on real pictures.

Source: Potje et al. 2024 (XFeat), its dense descriptor branch with batch norms folded into the
convolutions; keypoint and matching heads are left out. Weights: see NOTICE.

Sizes: n pictures, H W pixels.
"""

from collections.abc import Mapping

from jaxtyping import Float, Shaped
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.prior import resize

DIM = 64
_ENLARGE = 3  # photos are small here; descriptors of pictures three times as large are 40 % more exact
_STRIDE = 32
_BATCH_NORM_EPS = 1e-5


def _conv(inputs: int, outputs: int, kernel: int = 3, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2), nn.ReLU())


class LocalFeatures(nn.Module):
    """Pictures -> descriptors; never trained here."""

    def __init__(self):
        super().__init__()
        self.skip = nn.Conv2d(1, 24, 1)
        self.block1 = nn.Sequential(_conv(1, 4), _conv(4, 8, stride=2), _conv(8, 8), _conv(8, 24, stride=2))
        self.block2 = nn.Sequential(_conv(24, 24), _conv(24, 24))
        self.block3 = nn.Sequential(_conv(24, 64, stride=2), _conv(64, 64), _conv(64, 64, 1))
        self.block4 = nn.Sequential(_conv(64, 64, stride=2), _conv(64, 64), _conv(64, 64))
        self.block5 = nn.Sequential(
            _conv(64, 128, stride=2), _conv(128, 128), _conv(128, 128), _conv(128, 64, 1)
        )
        self.fusion = nn.Sequential(_conv(64, 64), _conv(64, 64), nn.Conv2d(64, DIM, 1))
        self.requires_grad_(False)

    def forward(self, images: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n C h w"]:
        """(n, 3, H, W) in [0, 1] -> unit descriptors (n, 64, about 3 H / 8, 3 W / 8)."""
        size = tuple(round(side * _ENLARGE / _STRIDE) * _STRIDE for side in images.shape[-2:])
        grey = resize(images.mean(1, keepdim=True), (size[0], size[1]))
        grey = F.instance_norm(grey)
        eighth = self.block3(self.block2(self.block1(grey) + self.skip(F.avg_pool2d(grey, 4))))
        sixteenth = self.block4(eighth)
        coarse = self.block5(sixteenth)
        same = (eighth.shape[-2], eighth.shape[-1])
        joined = eighth + resize(sixteenth, same) + resize(coarse, same)
        return F.normalize(self.fusion(joined).float(), dim=1)


def convert(tensors: Mapping[str, Shaped[Tensor, "..."]]) -> dict[str, Shaped[Tensor, "..."]]:
    """State dict of `LocalFeatures` from the published tensors of XFeat; other heads are dropped."""
    found = {f"skip.{part}": tensors[f"skip1.1.{part}"] for part in ("weight", "bias")}
    names = {f"block{i}": f"block{i}" for i in range(1, 6)} | {"block_fusion": "fusion"}
    for old, new in names.items():
        index = 0
        while f"{old}.{index}.layer.0.weight" in tensors:
            at = f"{old}.{index}.layer"
            spread = (tensors[f"{at}.1.running_var"].float() + _BATCH_NORM_EPS).sqrt()
            weight = tensors[f"{at}.0.weight"].float()
            found[f"{new}.{index}.0.weight"] = weight / spread[:, None, None, None]
            found[f"{new}.{index}.0.bias"] = -tensors[f"{at}.1.running_mean"].float() / spread
            index += 1
    for part in ("weight", "bias"):
        found[f"fusion.2.{part}"] = tensors[f"block_fusion.2.{part}"].float()
    return {key: value.float() for key, value in found.items()}
