"""LSeg's image tower: dense features in CLIP ViT-B/32's space, C = 512, at half the picture's size.

Source: Li et al. 2022 (LSeg), its demo network: ViT-L/16, readout "project", batch norms.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.network.encoders.vit import ClassTokenEncoder, centre_images
from langflash_core.network.layers.dpt import Fusion, resizes
from langflash_core.network.presets import PointMaps


class NormedUnit(nn.Module):
    """Two 3x3 convolutions with a batch norm after and a ReLU before each, added to their input."""

    def __init__(self, feature: int):
        super().__init__()
        self.conv1, self.conv2 = (nn.Conv2d(feature, feature, 3, padding=1, bias=False) for _ in range(2))
        self.norm1, self.norm2 = nn.BatchNorm2d(feature), nn.BatchNorm2d(feature)

    def forward(self, x: Float[Tensor, "n C h w"]) -> Float[Tensor, "n C h w"]:
        return x + self.norm2(self.conv2(F.relu(self.norm1(self.conv1(F.relu(x))))))


class LSeg(nn.Module):
    """Pictures -> L(x). Frozen: always in evaluation mode, because of its batch norms."""

    def __init__(self, preset: PointMaps):
        super().__init__()
        sizes, dims = preset.language, preset.language.dpt_dims
        self.vit = ClassTokenEncoder(sizes)
        self.readout = nn.ModuleList(nn.Linear(2 * sizes.dim, sizes.dim) for _ in dims)
        self.project = nn.ModuleList(nn.Conv2d(sizes.dim, n, 1) for n in dims)
        self.resize = resizes(dims)
        self.level = nn.ModuleList(nn.Conv2d(n, sizes.dpt_feature, 3, padding=1, bias=False) for n in dims)
        self.fuse = nn.ModuleList(
            Fusion(sizes.dpt_feature, coarsest=i == 3, align_corners=True, unit=NormedUnit) for i in range(4)
        )
        self.out = nn.Conv2d(sizes.dpt_feature, preset.language_dim, 1)
        self.requires_grad_(False).eval()

    def train(self, mode: bool = True) -> "LSeg":
        """Stays in evaluation mode."""
        return super().train(False)

    def features(self, images: Float[Tensor, "n 3 H W"]) -> Float[Tensor, "n C h w"]:
        """Features of any norm (n, C, H/2, W/2) of images (n, 3, H, W) in [0, 1], sides multiples of 16."""
        patch = self.vit.patch.kernel_size[0]
        grid = (images.shape[-2] // patch, images.shape[-1] // patch)
        levels = [
            level(resize(project(self._map(tokens, readout, grid))))
            for tokens, readout, project, resize, level in zip(
                self.vit(centre_images(images)),
                self.readout,
                self.project,
                self.resize,
                self.level,
                strict=True,
            )
        ]
        path = self.fuse[3](levels[3])
        for index in (2, 1, 0):
            path = self.fuse[index](path, levels[index])
        return self.out(path).float()

    def forward(self, images: Float[Tensor, "B V 3 H W"]) -> Float[Tensor, "B V C h w"]:
        """L(x), (B, V, C, H/2, W/2), unit channel norm."""
        return F.normalize(self.features(images.flatten(0, 1)), dim=1).unflatten(0, images.shape[:2])

    @staticmethod
    def _map(tokens: Tensor, readout: nn.Module, grid: tuple[int, int]) -> Tensor:
        """Every token joined with the class token, (n, C, h, w)."""
        patches = tokens[:, 1:]
        joined = torch.cat((patches, tokens[:, :1].expand_as(patches)), -1)
        return F.gelu(readout(joined)).transpose(1, 2).unflatten(2, grid)
