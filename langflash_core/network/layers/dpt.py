"""Dense prediction from tokens: four levels are brought to a pyramid and fused coarse to fine.

Source: Ranftl et al. 2021 (DPT). With a token grid of h x w the paths are
path_4 at 1x, path_3 at 2x, path_2 at 4x and path_1 at 8x the grid.
"""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F


@dataclass(frozen=True)
class Paths:
    """Fused maps (n, feature, s*h, s*w), coarse to fine: s = 1, 2, 4, 8."""

    path_4: Float[Tensor, "n C _ _"]
    path_3: Float[Tensor, "n C _ _"]
    path_2: Float[Tensor, "n C _ _"]
    path_1: Float[Tensor, "n C _ _"]


class ResidualUnit(nn.Module):
    """Two 3x3 convolutions with ReLU before each, added to their input."""

    def __init__(self, feature: int):
        super().__init__()
        self.conv1 = nn.Conv2d(feature, feature, 3, padding=1)
        self.conv2 = nn.Conv2d(feature, feature, 3, padding=1)

    def forward(self, x: Float[Tensor, "B C H W"]) -> Float[Tensor, "B C H W"]:
        return x + self.conv2(F.relu(self.conv1(F.relu(x))))


class Fusion(nn.Module):
    """Add the finer level, mix, double the size. unit: what mixes."""

    def __init__(
        self,
        feature: int,
        *,
        coarsest: bool = False,
        align_corners: bool = False,
        unit: type[nn.Module] = ResidualUnit,
    ):
        super().__init__()
        self.align_corners = align_corners
        self.lateral = None if coarsest else unit(feature)
        self.mix = unit(feature)
        self.out = nn.Conv2d(feature, feature, 1)

    def forward(
        self, coarse: Float[Tensor, "n C h w"], lateral: Float[Tensor, "n C _ _"] | None = None
    ) -> Float[Tensor, "n C H W"]:
        if self.lateral is not None and lateral is not None:
            # An odd grid makes the coarsest path a row too large.
            coarse = coarse[..., : lateral.shape[-2], : lateral.shape[-1]] + self.lateral(lateral)
        # The 1x1 convolution commutes with the bilinear resize and is four times cheaper before it.
        return double(self.out(self.mix(coarse)), align_corners=self.align_corners)


def double(maps: Float[Tensor, "n C h w"], *, align_corners: bool) -> Float[Tensor, "n C H W"]:
    """Maps (n, C, h, w) -> (n, C, 2h, 2w), bilinear."""
    return F.interpolate(maps, scale_factor=2.0, mode="bilinear", align_corners=align_corners)


def resizes(dims: tuple[int, int, int, int]) -> nn.ModuleList:
    """What brings maps of the grid's size, of so many channels each, to 4, 2, 1 and half times it."""
    a, b, _, d = dims
    return nn.ModuleList(
        (
            nn.ConvTranspose2d(a, a, 4, stride=4),
            nn.ConvTranspose2d(b, b, 2, stride=2),
            nn.Identity(),
            nn.Conv2d(d, d, 3, stride=2, padding=1),
        )
    )


class DPT(nn.Module):
    """Four token levels -> `Paths`. `align_corners` is how the published heads double their maps."""

    def __init__(
        self,
        token_dims: tuple[int, int, int, int],
        level_dims: tuple[int, int, int, int],
        feature: int,
        *,
        align_corners: bool = False,
    ):
        super().__init__()
        self.project = nn.ModuleList(nn.Conv2d(t, n, 1) for t, n in zip(token_dims, level_dims, strict=True))
        self.resize = resizes(level_dims)
        self.level = nn.ModuleList(nn.Conv2d(n, feature, 3, padding=1, bias=False) for n in level_dims)
        self.fuse = nn.ModuleList(
            Fusion(feature, coarsest=i == 3, align_corners=align_corners) for i in range(4)
        )

    def forward(
        self,
        maps: tuple[
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
            Float[Tensor, "n _ _ _"],
        ],
    ) -> Paths:
        """Fuse token maps (n, C_i, h, w), shallow first."""
        levels = [
            level(resize(project(m)))
            for m, project, resize, level in zip(maps, self.project, self.resize, self.level, strict=True)
        ]
        path_4 = self.fuse[3](levels[3])
        path_3 = self.fuse[2](path_4, levels[2])
        path_2 = self.fuse[1](path_3, levels[1])
        path_1 = self.fuse[0](path_2, levels[0])
        # An odd token grid makes the coarsest path one row too large; the others follow the laterals.
        height, width = levels[2].shape[-2:]
        return Paths(path_4[..., :height, :width], path_3, path_2, path_1)
