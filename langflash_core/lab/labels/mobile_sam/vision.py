"""TinyViT of 5 million numbers with SAM's neck: a square picture to 256 channels at a sixteenth of its side.

Sizes: B pictures, C channels, H W cells, h heads, s side of a window of attention.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

_WIDTHS = (64, 128, 160, 320)
_DEPTHS = (2, 2, 6, 2)
_HEADS = (2, 4, 5, 10)
_WINDOWS = (7, 7, 14, 7)
_STRIDES = (2, 2, 1)  # of what leads from one stage to the next; SAM's last stage keeps the grid
_GROWTH = 4
_CLASSES = 1000  # of a head that the file holds and nobody asks
CHANNELS = 256


class ConvNorm(nn.Module):
    """A convolution without bias, then a batch norm."""

    def __init__(self, before: int, after: int, kernel: int = 1, stride: int = 1, groups: int = 1):
        super().__init__()
        self.c = nn.Conv2d(before, after, kernel, stride, kernel // 2, groups=groups, bias=False)
        self.bn = nn.BatchNorm2d(after)

    def forward(self, x: Tensor) -> Tensor:
        return self.bn(self.c(x))


class PatchEmbed(nn.Module):
    """Pixels to a quarter of their grid."""

    def __init__(self, width: int):
        super().__init__()
        self.seq = nn.Sequential(ConvNorm(3, width // 2, 3, 2), nn.GELU(), ConvNorm(width // 2, width, 3, 2))

    def forward(self, x: Tensor) -> Tensor:
        return self.seq(x)


class Inverted(nn.Module):
    """Wide, by channel, narrow again (Sandler et al. 2018), with a way around."""

    def __init__(self, width: int):
        super().__init__()
        wide = _GROWTH * width
        self.conv1 = ConvNorm(width, wide)
        self.conv2 = ConvNorm(wide, wide, 3, groups=wide)
        self.conv3 = ConvNorm(wide, width)

    def forward(self, x: Tensor) -> Tensor:
        inner = F.gelu(self.conv2(F.gelu(self.conv1(x))))
        return F.gelu(x + self.conv3(inner))


class Merging(nn.Module):
    """From one stage's grid and width to the next one's."""

    def __init__(self, before: int, after: int, stride: int):
        super().__init__()
        self.conv1 = ConvNorm(before, after)
        self.conv2 = ConvNorm(after, after, 3, stride, groups=after)
        self.conv3 = ConvNorm(after, after)

    def forward(self, x: Tensor) -> Tensor:
        return self.conv3(F.gelu(self.conv2(F.gelu(self.conv1(x)))))


class WindowAttention(nn.Module):
    """Attention among the s x s cells of a window, biased by how far apart they are."""

    def __init__(self, width: int, heads: int, side: int):
        super().__init__()
        self.heads = heads
        self.norm = nn.LayerNorm(width)
        self.qkv = nn.Linear(width, 3 * width)
        self.proj = nn.Linear(width, width)
        self.attention_biases = nn.Parameter(torch.zeros(heads, side * side))
        rows, columns = torch.meshgrid(torch.arange(side), torch.arange(side), indexing="ij")
        apart = [(axis.flatten()[:, None] - axis.flatten()).abs() for axis in (rows, columns)]
        self.register_buffer("apart", apart[0] * side + apart[1], persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """Windows (B', s*s, C)."""
        q, k, v = self.qkv(self.norm(x)).unflatten(2, (self.heads, -1)).transpose(1, 2).chunk(3, -1)
        bias = self.attention_biases[:, self.get_buffer("apart")]
        return self.proj(F.scaled_dot_product_attention(q, k, v, bias).transpose(1, 2).flatten(2))


class Feedforward(nn.Module):
    """Two layers on every cell, normalised before."""

    def __init__(self, width: int):
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.fc1 = nn.Linear(width, _GROWTH * width)
        self.fc2 = nn.Linear(_GROWTH * width, width)

    def forward(self, x: Tensor) -> Tensor:
        return self.fc2(F.gelu(self.fc1(self.norm(x))))


class WindowBlock(nn.Module):
    """Attention in windows, a convolution by channel, a feed-forward; (B, C, H, W) each."""

    def __init__(self, width: int, heads: int, side: int):
        super().__init__()
        self.side = side
        self.attn = WindowAttention(width, heads, side)
        self.local_conv = ConvNorm(width, width, 3, groups=width)
        self.mlp = Feedforward(width)

    def forward(self, x: Tensor) -> Tensor:
        x = self.local_conv(x + self._attended(x))
        return x + self.mlp(x.movedim(1, -1)).movedim(-1, 1)

    def _attended(self, x: Tensor) -> Tensor:
        """What does not fill a window is filled up with zeros, which are attended to, as in training."""
        s, (height, width) = self.side, x.shape[-2:]
        padded = F.pad(x, (0, -width % s, 0, -height % s))
        rows, columns = padded.shape[-2] // s, padded.shape[-1] // s
        windows = padded.unflatten(3, (columns, s)).unflatten(2, (rows, s)).permute(0, 2, 4, 3, 5, 1)
        seen = self.attn(windows.flatten(3, 4).flatten(0, 2)).view(len(x), rows, columns, s, s, -1)
        return seen.permute(0, 5, 1, 3, 2, 4).flatten(4).flatten(2, 3)[..., :height, :width]


class Stage(nn.Module):
    """Blocks of one width, then the way to the next."""

    def __init__(self, stage: int):
        super().__init__()
        width, heads, side = _WIDTHS[stage], _HEADS[stage], _WINDOWS[stage]
        self.blocks = nn.Sequential(
            *(
                Inverted(width) if stage == 0 else WindowBlock(width, heads, side)
                for _ in range(_DEPTHS[stage])
            )
        )
        last = stage == len(_STRIDES)
        self.downsample = nn.Identity() if last else Merging(width, _WIDTHS[stage + 1], _STRIDES[stage])

    def forward(self, x: Tensor) -> Tensor:
        return self.downsample(self.blocks(x))


class ChannelNorm(nn.Module):
    """LayerNorm over the channels of maps (B, C, H, W)."""

    def __init__(self, width: int):
        super().__init__()
        self.weight = nn.Parameter(torch.ones(width))
        self.bias = nn.Parameter(torch.zeros(width))

    def forward(self, x: Tensor) -> Tensor:
        return F.layer_norm(x.movedim(1, -1), self.weight.shape, self.weight, self.bias, 1e-6).movedim(-1, 1)


class ImageEncoder(nn.Module):
    """Normalised pictures (B, 3, S, S) to (B, 256, S/16, S/16)."""

    def __init__(self) -> None:
        super().__init__()
        self.patch_embed = PatchEmbed(_WIDTHS[0])
        self.layers = nn.Sequential(*(Stage(stage) for stage in range(len(_WIDTHS))))
        self.norm_head = nn.LayerNorm(_WIDTHS[-1])
        self.head = nn.Linear(_WIDTHS[-1], _CLASSES)
        self.neck = nn.Sequential(
            nn.Conv2d(_WIDTHS[-1], CHANNELS, 1, bias=False),
            ChannelNorm(CHANNELS),
            nn.Conv2d(CHANNELS, CHANNELS, 3, padding=1, bias=False),
            ChannelNorm(CHANNELS),
        )

    def forward(self, x: Tensor) -> Tensor:
        return self.neck(self.layers(self.patch_embed(x)))
