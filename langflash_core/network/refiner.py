"""Plane-sweep refinement of monocular depth: what two views say together.

Both views are compared over depth hypotheses around the prior, by features that need no training
here: descriptors learned on real photos (`local`) and plain patches. A U-Net whose bottom reads
the encoder's deepest tokens turns the comparison into a correction for every pixel, so that what
matches at an edge also moves the blank wall beside it.

Sizes: B batch, V views, P hypotheses, G channel groups, h x w the token grid, n = B*V.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, rays
from langflash_core.network.depth import LOG_ERROR_RANGE, DepthMaps, resize
from langflash_core.network.dpt import ResidualUnit
from langflash_core.network.encoder import Tokens
from langflash_core.network.presets import GuidedDepth

_TYPICAL_LOG_ERROR = -1.5  # centres the error channel that the network reads


def sweep_correlation(
    features: Tensor, log_depths: Tensor, offsets: Tensor, viewmats: Tensor, Ks: Tensor, groups: int = 1
) -> tuple[Tensor, Tensor]:
    """Correlation of every view with the others over depth hypotheses.

    Args:
        features: (V, C, h', w'), unit channel norm, of any size.
        log_depths: (V, h, w) prior; hypothesis j of a pixel is prior * exp(offsets[j]).
        offsets: (P,). viewmats: (V, 4, 4) of one common length unit. Ks: (V, 3, 3), pixels of
            the maps of depth.
        groups: channels are summed in G equal groups, which must divide C.

    Returns:
        Correlations (V, G, P, h, w), the mean over the other views that see the point, their sum
        over G is the cosine; and which share of the other views sees it (V, P, h, w).

    Source: plane sweep (Collins 1996) around a prior, as MVSplat does with given poses; groups as
    in Guo et al. 2019 (group-wise correlation).
    """
    num_views, height, width = log_depths.shape
    own = features if _size(features) == (height, width) else resize(features, (height, width))
    directions = rays(Ks, width, height)  # (V, h, w, 3)
    correlations, visibilities = [], []
    for view in range(num_views):
        depths = (log_depths[view] + offsets[:, None, None]).exp()  # (P, h, w)
        pos_c = directions[view] * depths[..., None]  # (P, h, w, 3)
        total = features.new_zeros(groups, *depths.shape)
        count = torch.zeros_like(depths)
        for other in range(num_views):
            if other == view:
                continue
            relative = viewmats[other] @ invert_rigid(viewmats[view])
            pos_o = pos_c @ relative[:3, :3].T + relative[:3, 3]
            warped, seen = _sample(features[other], pos_o, Ks[other], (height, width))
            products = (warped * own[view]).unflatten(1, (groups, -1)).sum(2)  # (P, G, h, w)
            total = total + products.movedim(1, 0) * seen
            count = count + seen
        correlations.append(total / count.clamp_min(1))
        visibilities.append(count / max(num_views - 1, 1))
    return torch.stack(correlations), torch.stack(visibilities)


def _sample(features: Tensor, pos_c: Tensor, K: Tensor, size: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """Bilinear features (P, C, h, w) at projected points (P, h, w, 3), and (P, h, w) 1 where the point
    is in view; K speaks of a picture of `size`, (height, width)."""
    z = pos_c[..., 2]
    xy = pos_c[..., :2] / z.clamp_min(1e-4)[..., None] * K.diagonal()[:2] + K[:2, 2]
    ndc = (xy / xy.new_tensor([size[1], size[0]]) * 2 - 1).clamp(-4, 4)
    seen = ((z > 1e-4) & (ndc.abs() <= 1).all(-1)).to(features.dtype)
    batch = features[None].expand(len(ndc), -1, -1, -1)
    return F.grid_sample(batch, ndc.to(features.dtype), align_corners=False), seen


def patches(images: Tensor, reach: int = 2) -> Tensor:
    """Grey patches (n, (2 reach + 1)^2, H/2, W/2) of mean 0 and unit norm: their products are
    normalised cross-correlations, which exposure cannot change. images (n, 3, H, W)."""
    half = resize(images, (images.shape[-2] // 2, images.shape[-1] // 2)).mean(1, keepdim=True)
    side = 2 * reach + 1
    columns = F.unfold(half, side, padding=reach).unflatten(2, (half.shape[-2], half.shape[-1]))
    return F.normalize(columns - columns.mean(1, keepdim=True), dim=1, eps=1e-3)


class Regulariser(nn.Module):
    """A U-Net that works at 2 and 1 times the token grid; the tokens join at the bottom."""

    def __init__(self, inputs: int, token_dim: int, widths: tuple[int, int, int]):
        super().__init__()
        a, b, c = widths
        self.enter = nn.Conv2d(inputs, b, 4, stride=2, padding=1)
        self.second = ResidualUnit(b)
        self.down = nn.Conv2d(b, c, 4, stride=2, padding=1)
        self.tokens = nn.Conv2d(2 * token_dim, c, 1)
        self.bottom = nn.Sequential(ResidualUnit(c), ResidualUnit(c))
        self.up_b, self.second_up = nn.Conv2d(c, b, 1), ResidualUnit(b)
        self.up_a, self.aside, self.first_up = nn.Conv2d(b, a, 1), nn.Conv2d(inputs, a, 1), ResidualUnit(a)

    def forward(self, x: Tensor, shallow: Tensor, deep: Tensor) -> Tensor:
        """(n, inputs, 4h, 4w) and tokens (n, E, h, w) of two depths -> (n, a, 4h, 4w)."""
        second = self.second(self.enter(x))
        bottom = self.bottom(self.down(F.relu(second)) + self.tokens(torch.cat((shallow, deep), 1)))
        second = self.second_up(second + _double(self.up_b(bottom)))
        return self.first_up(self.aside(x) + _double(self.up_a(second)))


def _double(maps: Tensor) -> Tensor:
    return F.interpolate(maps, scale_factor=2.0, mode="bilinear", align_corners=False)


class DepthRefiner(nn.Module):
    """Corrects the prior by what the sweep shows.

    Each pass answers with a soft-argmax over the hypotheses, so it can never leave their range, and
    the next looks around that answer; with no other view (or none that sees a pixel) correlations
    are 0 and the prior speaks alone.
    """

    offsets: Tensor  # (P,) log-depth hypotheses around the prior

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        planes, widths = preset.sweep_planes, preset.refiner_widths
        self.match_hook, self.groups = preset.match_hook, preset.sweep_groups
        self.num_passes = preset.sweep_passes
        offsets = torch.linspace(-preset.sweep_range, preset.sweep_range, planes)
        self.register_buffer("offsets", offsets, persistent=False)
        inputs = (self.groups + 1) * planes + 6  # correlations; how much is seen, depth, error, colour
        self.regularise = Regulariser(inputs, preset.encoder_dim, widths)
        self.answer = nn.Conv2d(widths[0], planes + 1, 3, padding=1)
        self.sharpness = nn.Parameter(torch.tensor([10.0, 5.0]))

    def forward(
        self, images: Tensor, tokens: Tokens, local: Tensor, prior: DepthMaps, viewmats: Tensor, Ks: Tensor
    ) -> tuple[DepthMaps, ...]:
        """Refined maps of the prior's size after each pass; the last are the answer.

        Args:
            images: (B, V, 3, H, W). local: `LocalFeatures` of them, (n, C, h', w').
            prior: (B, V, H, W), of the viewmats' length unit.
            viewmats: (B, V, 4, 4). Ks: (B, V, 3, 3), pixels of the images.
        """
        passes = []
        for _ in range(self.num_passes):
            prior = self._once(images, tokens, local, prior, viewmats, Ks)
            passes.append(prior)
        return tuple(passes)

    def _once(
        self, images: Tensor, tokens: Tokens, local: Tensor, prior: DepthMaps, viewmats: Tensor, Ks: Tensor
    ) -> DepthMaps:
        size, shape = _size(prior.log_depths), prior.log_depths.shape[:2]
        small_size = (4 * tokens.grid[0], 4 * tokens.grid[1])
        pictures = images.flatten(0, 1)
        start = resize(torch.stack((prior.log_depths, prior.log_errors), 2).flatten(0, 1), small_size)
        with torch.no_grad():
            scale = torch.tensor([small_size[1] / size[1], small_size[0] / size[0], 1.0]).to(Ks)[:, None]
            logs = start[:, 0].unflatten(0, shape)
            described, seen = self._sweep(local, logs, viewmats, Ks * scale, self.groups)
            plain, _ = self._sweep(patches(pictures), logs, viewmats, Ks * scale, 1)
        likely = self.sharpness[0] * described.sum(1) + self.sharpness[1] * plain[:, 0]
        evidence = (described.flatten(1, 2), plain[:, 0], seen.mean(1, keepdim=True))
        read = torch.cat((*evidence, _centred(start), resize(pictures, small_size) - 0.5), 1)
        hidden = self.regularise(read, tokens.maps(self.match_hook), tokens.maps(-1))
        raw = self.answer(F.relu(hidden)).float()
        shift = ((raw[:, :-1] + likely).softmax(1) * self.offsets[:, None, None]).sum(1)
        change = resize(torch.stack((shift, raw[:, -1]), 1), size).unflatten(0, shape)
        return DepthMaps(
            prior.log_depths + change[:, :, 0],
            (prior.log_errors + change[:, :, 1]).clamp(*LOG_ERROR_RANGE),
        )

    def _sweep(
        self, features: Tensor, log_depths: Tensor, viewmats: Tensor, Ks: Tensor, groups: int
    ) -> tuple[Tensor, Tensor]:
        """`sweep_correlation` of every scene: (n, G, P, h, w) and (n, P, h, w)."""
        scenes = zip(features.unflatten(0, log_depths.shape[:2]), log_depths, viewmats, Ks, strict=True)
        pairs = [sweep_correlation(f, d, self.offsets, m, K, groups) for f, d, m, K in scenes]
        correlations, seen = (torch.cat(part) for part in zip(*pairs, strict=True))
        return correlations, seen


def _size(maps: Tensor) -> tuple[int, int]:
    return maps.shape[-2], maps.shape[-1]


def _centred(maps: Tensor) -> Tensor:
    """Log depth about its mean and log error about a typical one, (n, 2, h, w): no unit left."""
    logs, errors = maps[:, 0], maps[:, 1]
    return torch.stack((logs - logs.mean((1, 2), keepdim=True), errors - _TYPICAL_LOG_ERROR), 1)
