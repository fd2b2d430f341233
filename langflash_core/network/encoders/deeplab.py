"""Another network's eyes: DeepLab on MobileNetV2, which learned the 150 names of ADE20K.

It errs elsewhere than what reads our own encoder. Its names are not asked: what its last maps mean is read in
the language space (`semantics.second`).

Sizes: n pictures, h w a quarter of a picture's sides.

Source: Chen et al. 2018 (DeepLabV3+); Sandler et al. 2018 (MobileNetV2). Batch norms lie in the convolutions
before them. The last halving is a dilation instead, as it learned; the published file leaves out the one
before as well, for twice the time.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

CHANNELS = 256
"""Of its last maps."""
LARGE = 1.5
"""What its last maps are on average where they are not 0; whoever learns from them gets numbers about 1."""
_BLOCKS = (
    (1, 16, 1), (6, 24, 2), (6, 24, 1), (6, 32, 2), (6, 32, 1), (6, 32, 1), (6, 64, 2), (6, 64, 1),
    (6, 64, 1), (6, 64, 1), (6, 96, 1), (6, 96, 1), (6, 96, 1), (6, 160, 1), (6, 160, 1), (6, 160, 1),
    (6, 320, 1),
)  # fmt: skip
"""How much wider a block is inside, channels that it gives, and its stride."""
_DILATED = 14
"""The first block that looks twice as far, in the place of a further halving."""
_FINE = 2
"""The block whose inside the last layers see besides, at a quarter of the sides."""


class Inverted(nn.Module):
    """A block that is wide inside; where it changes no size, it adds to what it reads."""

    def __init__(self, given: int, wider: int, channels: int, stride: int, dilation: int):
        super().__init__()
        inner = given * wider
        self.adds = stride == 1 and given == channels
        self.expand = nn.Conv2d(given, inner, 1) if wider > 1 else None
        self.depthwise = nn.Conv2d(inner, inner, 3, stride, dilation=dilation, groups=inner)
        self.project = nn.Conv2d(inner, channels, 1)

    def inside(self, x: Float[Tensor, "n C h w"]) -> Float[Tensor, "n D _ _"]:
        """What the last layer reads."""
        if self.expand is not None:
            x = F.relu6(self.expand(x))
        return F.relu6(self.depthwise(pad_frame(x, self.depthwise)))

    def outside(
        self, inside: Float[Tensor, "n D _ _"], x: Float[Tensor, "n C h w"]
    ) -> Float[Tensor, "n _ _ _"]:
        """What the block gives of `inside`, for x."""
        y = self.project(inside)
        return x + y if self.adds else y

    def forward(self, x: Float[Tensor, "n C h w"]) -> Float[Tensor, "n _ _ _"]:
        return self.outside(self.inside(x), x)


class Separable(nn.Module):
    """A 3 x 3 convolution of each channel, then one over channels."""

    def __init__(self, given: int, channels: int):
        super().__init__()
        self.depthwise = nn.Conv2d(given, given, 3, padding=1, groups=given)
        self.pointwise = nn.Conv2d(given, channels, 1)

    def forward(self, x: Float[Tensor, "n C h w"]) -> Float[Tensor, "n D h w"]:
        return F.relu(self.pointwise(F.relu(self.depthwise(x))))


class DeepLab(nn.Module):
    """Pictures -> what its scores would be read from, at a quarter of their sides. Frozen."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = nn.Conv2d(3, 32, 3, 2)
        given, blocks = 32, []
        for place, (wider, channels, stride) in enumerate(_BLOCKS):
            blocks.append(Inverted(given, wider, channels, stride, 2 if place >= _DILATED else 1))
            given = channels
        self.blocks = nn.ModuleList(blocks)
        self.whole, self.near = nn.Conv2d(given, CHANNELS, 1), nn.Conv2d(given, CHANNELS, 1)
        self.both = nn.Conv2d(2 * CHANNELS, CHANNELS, 1)
        inner = _BLOCKS[_FINE][0] * _BLOCKS[_FINE - 1][1]
        self.fine = nn.Conv2d(inner, 48, 1)
        self.last = nn.Sequential(Separable(CHANNELS + 48, CHANNELS), Separable(CHANNELS, CHANNELS))

    def forward(self, pictures: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n 256 h w"]:
        """Maps (n, 256, h, w), 0 or more, about 1, of pictures (n, 3, H, W) in [0, 1]."""
        x = (2 * pictures - 1).contiguous(memory_format=torch.channels_last)  # a third quicker
        x = F.relu6(self.stem(pad_frame(x, self.stem)))
        fine = x
        for place, block in enumerate(self.blocks):
            assert isinstance(block, Inverted)
            inside = block.inside(x)
            x = block.outside(inside, x)
            if place == _FINE:
                fine = F.relu(self.fine(inside))
        whole = F.relu(self.whole(x.mean((2, 3), keepdim=True))).expand(-1, -1, *x.shape[-2:])
        deep = F.relu(self.both(torch.cat((whole, F.relu(self.near(x))), 1)))
        deep = F.interpolate(deep, (fine.shape[-2], fine.shape[-1]), mode="bilinear", align_corners=True)
        return self.last(torch.cat((deep, fine), 1)) / LARGE


def pad_frame(x: Float[Tensor, "n C h w"], layer: nn.Conv2d) -> Float[Tensor, "n C _ _"]:
    """x with zeros around it, so that what a square layer gives is as large as its stride allows; a row that
    is over comes last, as TensorFlow has it."""
    stride, reach = layer.stride[0], layer.dilation[0] * (layer.kernel_size[0] - 1)
    sides: list[int] = []
    for length in (x.shape[-1], x.shape[-2]):
        over = max(0, (-(-length // stride) - 1) * stride + reach + 1 - length)
        sides += [over // 2, over - over // 2]
    return F.pad(x, sides)
