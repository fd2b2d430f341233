"""A second pair of other eyes: MOSAIC, as MLCommons measures telephones with it.

It learned 32 names of ADE20K, seldom ones less, and looks at what is around in windows of three sizes, so
that it errs elsewhere than DeepLab. Its names are not asked either: what its maps mean is read in the
language space (`semantics.second`).

Sizes: n pictures, h w an eighth of a picture's sides.

Source: Wang et al. 2021 (MOSAIC: mobile segmentation via decoding aggregated information and encoded
context), on a MobileNet of Chu et al. 2021 (multi-hardware). Batch norms lie in the convolutions before them.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.deeplab import pad_frame

CHANNELS = 320
"""Of the maps that its decoder reads: 128 of context and 192 of detail."""
_BLOCKS = (
    (96, 32, 3, 2, 1), (64, 32, 3, 1, 1), (160, 64, 5, 2, 1), (192, 64, 3, 1, 1), (128, 64, 3, 1, 1),
    (192, 64, 3, 1, 1), (384, 128, 5, 2, 1), (384, 128, 3, 1, 1), (384, 128, 3, 1, 1), (384, 128, 3, 1, 1),
    (768, 160, 3, 1, 1), (640, 160, 3, 1, 1), (960, 192, 3, 1, 1), (384, 96, 5, 1, 2), (384, 96, 5, 1, 2),
    (384, 96, 5, 1, 2),
)  # fmt: skip
"""Channels inside a block and those that it gives, side of its depthwise layer, stride, dilation."""
_DETAIL = 5
"""The block whose inside the decoder sees, at an eighth of the sides."""
_DEEP = 448
"""Channels at a sixteenth of the sides."""
_WINDOWS = (8, 4, 2)
"""Sides of the windows whose means are the context, in pixels of a sixteenth."""


class Block(nn.Module):
    """A block that is wide inside; where it changes no size, it adds to what it reads."""

    def __init__(self, given: int, inner: int, channels: int, side: int, stride: int, dilation: int):
        super().__init__()
        self.adds = stride == 1 and given == channels
        self.expand = nn.Conv2d(given, inner, 1)
        self.depthwise = nn.Conv2d(inner, inner, side, stride, dilation=dilation, groups=inner)
        self.project = nn.Conv2d(inner, channels, 1)

    def forward(
        self, x: Float[Tensor, "n C h w"]
    ) -> tuple[Float[Tensor, "n D _ _"], Float[Tensor, "n _ _ _"]]:
        """What it holds inside and what it gives."""
        inside = F.relu(self.expand(x))
        inside = F.relu(self.depthwise(pad_frame(inside, self.depthwise)))
        y = self.project(inside)
        return inside, x + y if self.adds else y


class Separable(nn.Module):
    """A convolution of each channel by itself, then one over channels."""

    def __init__(self, given: int, channels: int, side: int):
        super().__init__()
        self.depthwise = nn.Conv2d(given, given, side, padding=side // 2, groups=given)
        self.pointwise = nn.Conv2d(given, channels, 1)

    def forward(self, x: Float[Tensor, "n C h w"]) -> Float[Tensor, "n D h w"]:
        return F.relu(self.pointwise(F.relu(self.depthwise(x))))


class Context(nn.Module):
    """Means over windows of one size, half of their channels read closely, half more widely."""

    def __init__(self, window: int):
        super().__init__()
        self.window = window
        self.close, self.wide = Separable(_DEEP // 2, 64, 3), Separable(_DEEP // 2, 64, 5)

    def forward(self, x: Float[Tensor, "n 448 h w"]) -> Float[Tensor, "n 128 h w"]:
        means = F.avg_pool2d(x, self.window, ceil_mode=True)
        close, wide = means.chunk(2, 1)
        read = torch.cat((self.close(close), self.wide(wide)), 1)
        return enlarge(read, self.window, (x.shape[-2], x.shape[-1]))


class Mosaic(nn.Module):
    """Pictures -> what its decoder reads. Frozen."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Conv2d(3, 32, 3, 2)
        given, blocks = 32, []
        for inner, channels, side, stride, dilation in _BLOCKS:
            blocks.append(Block(given, inner, channels, side, stride, dilation))
            given = channels
        self.blocks = nn.ModuleList(blocks)
        self.deep = nn.Conv2d(given, _DEEP, 1)
        self.contexts = nn.ModuleList(Context(window) for window in _WINDOWS)
        self.both = nn.Conv2d(128 * len(_WINDOWS) + _DEEP, 128, 1)

    def forward(self, pictures: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n 320 h w"]:
        """Maps (n, 320, h, w), 0 or more, of pictures (n, 3, H, W) in [0, 1]."""
        x = (2 * pictures - 1).contiguous(memory_format=torch.channels_last)
        x, detail = F.relu(self.stem(pad_frame(x, self.stem))), pictures
        for place, block in enumerate(self.blocks):
            inside, x = block(x)
            if place == _DETAIL:
                detail = inside
        deep = F.relu(self.deep(x))
        around = F.relu(self.both(torch.cat([*(read(deep) for read in self.contexts), deep], 1)))
        return torch.cat((enlarge(around, 2, (detail.shape[-2], detail.shape[-1])), detail), 1)


def enlarge(x: Float[Tensor, "n C h w"], times: int, size: tuple[int, int]) -> Float[Tensor, "n C H W"]:
    """x so many times as large, cut to `size`: what stands at i comes to `times` i, as TensorFlow had it at
    first; behind the last row and column these go on."""
    height, width = (times * length + 1 for length in x.shape[-2:])
    longer = F.pad(x, (0, 1, 0, 1), mode="replicate")
    larger = F.interpolate(longer, (height, width), mode="bilinear", align_corners=True)
    return larger[..., : size[0], : size[1]]
