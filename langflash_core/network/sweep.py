"""Plane-sweep refinement of monocular depth: what two views say together.

Both views are compared over depth hypotheses around the prior, by features that need no training
here: descriptors learned on real photos (`local`) and plain patches. A U-Net whose bottom reads
the encoder's deepest tokens turns the comparison into a correction for every pixel, so that what
matches at an edge also moves the blank wall beside it.

Sizes: B batch, V views, P hypotheses, G channel groups, h x w the token grid, n = B*V.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, rays
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.dpt import ResidualUnit
from langflash_core.network.presets import GuidedDepth
from langflash_core.network.prior import resize
from langflash_core.network.settings import PRIOR
from langflash_core.rig.neighbours import Neighbours, everyone
from langflash_core.rig.projected import see_points
from langflash_core.rig.rig import DepthMaps


@dataclass(frozen=True)
class Compared:
    """What a sweep compares: unit vectors of every view.

    table: (V, (h' + 2) (w' + 2), C), maps of `size` = (h', w') with a border of zeros, as rows.
    own: (v, h w, C, G) of the first v views, whose depth is looked for, at the size of the depth maps, once
    for each of G equal groups of channels and 0 outside of it: products with it are sums by group.
    """

    table: Float[Tensor, "V _ C"]
    size: tuple[int, int]
    own: Float[Tensor, "v n C G"]

    @staticmethod
    def of(
        maps: Float[Tensor, "V C h w"], size: tuple[int, int], groups: int = 1, first: int | None = None
    ) -> "Compared":
        """Vectors (V, C, h', w') of any size, for depth maps of `size`; groups must divide C. first: so many
        views' depth is looked for; None: that of all."""
        mine = maps[:first]
        own = _rows(mine if _size(maps) == size else resize(mine, size))
        belongs = torch.eye(groups).to(own).repeat_interleave(own.shape[-1] // groups, 0)  # (C, G)
        # Row by row: products with rows that lie apart take three times as long, to the same bits.
        apart = (own[..., None] * belongs).contiguous()
        return Compared(_rows(F.pad(maps, (1,) * 4)).contiguous(), _size(maps), apart)

    def views(self, first: int, count: int) -> "Compared":
        """The views of one scene out of several."""
        part = slice(first, first + count)
        return Compared(self.table[part], self.size, self.own[part])


def sweep_correlation(
    compared: Sequence[Compared],
    log_depths: Float[Tensor, "v h w"],
    offsets: Float[Tensor, " P"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
    neighbours: Neighbours | None = None,
) -> tuple[list[Float[Tensor, "v _ P h w"]], Float[Tensor, "v P h w"]]:
    """Correlation of every view with its neighbours (None: all others) over depth hypotheses.

    Args:
        compared: vectors to correlate, one answer each.
        log_depths: (V, h, w) prior; hypothesis j of a pixel is prior * exp(offsets[j]).
        offsets: (P,). viewmats: (V, 4, 4) of one common length unit. Ks: (V, 3, 3), pixels of
            the maps of depth.

    Returns:
        Of each, correlations (V, G, P, h, w), the mean over the neighbours that see the point,
        their sum over G is the cosine; and which share of the neighbours sees it (V, P, h, w).

    Source: plane sweep (Collins 1996) around a prior, as MVSplat does with given poses; groups as
    in Guo et al. 2019 (group-wise correlation).
    """
    num_views, height, width = log_depths.shape
    directions = rays(Ks, width, height).flatten(1, 2).transpose(1, 2)  # (V, 3, h w)
    correlations: list[list[Tensor]] = [[] for _ in compared]
    visibilities = []
    for view, others in enumerate(neighbours or everyone(num_views)):
        depths = (log_depths[view].flatten()[:, None] + offsets).exp()  # (h w, P)
        totals = [depths.new_zeros(*depths.shape, c.own.shape[-1]) for c in compared]
        count = torch.zeros_like(depths)
        for other in others:
            relative = viewmats[other] @ invert_rigid(viewmats[view])
            turned = relative[:3, :3] @ directions[view]
            pos_o = turned[..., None] * depths + relative[:3, 3, None, None]  # (3, h w, P)
            there = see_points(pos_o.flatten(1), Ks[other], (height, width))
            ndc = torch.stack(there.normalised_coordinates)
            inside = (there.z > 0) & (ndc.abs() <= 1).all(0)  # of a pixel on the border half is there
            seen = inside.view_as(depths).to(depths)
            ndc = torch.where(inside, ndc, 0.0).unflatten(1, depths.shape)
            for c, total in zip(compared, totals, strict=True):
                total += _products(c, view, other, ndc) * seen[..., None]
            count = count + seen
        for found, total in zip(correlations, totals, strict=True):
            mean = total / count.clamp_min(1)[..., None]
            found.append(mean.permute(2, 1, 0).unflatten(2, (height, width)))
        visibilities.append((count / max(len(others), 1)).T.unflatten(1, (height, width)))
    return [torch.stack(found) for found in correlations], torch.stack(visibilities)


def _products(compared: Compared, view: int, other: int, ndc: Tensor) -> Tensor:
    """Products (X, P, G) of a view's pixels with another's points at (2, X, P), as `Compared` has them.

    Some pixels at a time: what was gathered of them stays in a processor's cache.
    """
    at_once = max(1, PRIOR.at_once // ndc.shape[2])
    table, own = compared.table[other], compared.own[view]
    parts = zip(ndc.split(at_once, 1), own.split(at_once), strict=True)
    return torch.cat([torch.bmm(sample_bilinear(table, compared.size, there), here) for there, here in parts])


def sample_bilinear(
    table: Float[Tensor, "_ C"], size: tuple[int, int], ndc: Float[Tensor, "2 X P"]
) -> Float[Tensor, "X P C"]:
    """Bilinear vectors (X, P, C) of a map of `size` = (h, w) at places (2, X, P) of -1 to 1.

    Each is a weighted sum of four rows of the table ((h + 2) (w + 2), C), whose border is 0: as embeddings
    are gathered, and not channel by channel, as `grid_sample` does, the twin, which it equals but for
    rounding.
    """
    # Pixels' centres are whole numbers, the first is 1.
    x, y = ((along + 1) * (side / 2) + 0.5 for along, side in zip(ndc, (size[1], size[0]), strict=True))
    column, row = x.floor(), y.floor()
    right, down = x - column, y - row
    left, up = 1 - right, 1 - down
    width = size[1] + 2
    first = row.int() * width + column.int()
    ids = torch.stack((first, first + 1, first + width, first + width + 1), -1)
    shares = torch.stack((up * left, up * right, down * left, down * right), -1)
    bags = ids.flatten(0, 1), shares.flatten(0, 1)
    return F.embedding_bag(bags[0], table, per_sample_weights=bags[1], mode="sum").unflatten(0, first.shape)


def _rows(maps: Tensor) -> Tensor:
    """Maps (V, C, h, w) as (V, h w, C)."""
    return maps.flatten(2).transpose(1, 2)


def patches(images: Float[Tensor, "n 3 H W"], reach: int = 2) -> Float[Tensor, "n C h w"]:
    """Grey patches (n, (2 reach + 1)^2, H/2, W/2) of mean 0 and unit norm: their products are
    normalised cross-correlations, which exposure cannot change. images (n, 3, H, W)."""
    half = resize(images.mean(1, keepdim=True), (images.shape[-2] // 2, images.shape[-1] // 2))
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

    def forward(
        self, x: Float[Tensor, "B C H W"], shallow: Float[Tensor, "B D h w"], deep: Float[Tensor, "B D h w"]
    ) -> Float[Tensor, "B E H W"]:
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
        # On a device of its own, because networks that take over a file's tensors are built on none.
        offsets = torch.linspace(-preset.sweep_range, preset.sweep_range, planes, device="cpu")
        self.register_buffer("offsets", offsets, persistent=False)
        inputs = (self.groups + 1) * planes + 6  # correlations; how much is seen, depth, error, colour
        self.regularise = Regulariser(inputs, preset.encoder_dim, widths)
        self.answer = nn.Conv2d(widths[0], planes + 1, 3, padding=1)
        self.sharpness = nn.Parameter(torch.tensor([10.0, 5.0]))

    def forward(
        self,
        images: Float[Tensor, "B V 3 H W"],
        tokens: Tokens,
        local: Float[Tensor, "n C h w"],
        prior: DepthMaps,
        viewmats: Float[Tensor, "B V 4 4"],
        Ks: Float[Tensor, "B V 3 3"],
        neighbours: Neighbours | None = None,
        first: int | None = None,
    ) -> tuple[DepthMaps, ...]:
        """Refined maps of the prior's size after each pass; the last are the answer.

        Args:
            images: (B, V, 3, H, W). local: `LocalFeatures` of them, (n, C, h', w').
            prior: (B, V, H, W), of the viewmats' length unit.
            viewmats: (B, V, 4, 4). Ks: (B, V, 3, 3), pixels of the images.
            neighbours: as `sweep_correlation` has them, of every scene.
            first: of one scene (B = 1) only so many views are refined, of which the prior and the neighbours
                are; the others are looked at. None: all.
        """
        grid, pictures = tokens.grid, images.flatten(0, 1)
        size = (4 * grid[0], 4 * grid[1])
        scale = torch.tensor([size[1] / images.shape[-1], size[0] / images.shape[-2], 1.0]).to(Ks)
        with torch.no_grad():
            compared = [
                Compared.of(local, size, self.groups, first),
                Compared.of(patches(pictures), size, 1, first),
            ]
        read = (
            resize(pictures[:first], size) - 0.5,
            tokens.maps(self.match_hook)[:first],
            tokens.maps(-1)[:first],
        )
        passes = []
        for _ in range(self.num_passes):
            prior = self._once(compared, read, prior, viewmats, Ks * scale[:, None], neighbours)
            passes.append(prior)
        return tuple(passes)

    def _once(
        self,
        compared: list[Compared],
        read: tuple[Tensor, Tensor, Tensor],
        prior: DepthMaps,
        viewmats: Tensor,
        Ks: Tensor,
        neighbours: Neighbours | None,
    ) -> DepthMaps:
        """One pass; read: small pictures, shallow and deep tokens. Ks: pixels of the small pictures."""
        colours, shallow, deep = read
        shape = prior.log_depths.shape[:2]
        start = resize(torch.stack((prior.log_depths, prior.log_errors), 2).flatten(0, 1), _size(colours))
        with torch.no_grad():
            logs = start[:, 0].unflatten(0, shape)
            (described, plain), seen = self._sweep(compared, logs, viewmats, Ks, neighbours)
        likely = self.sharpness[0] * described.sum(1) + self.sharpness[1] * plain[:, 0]
        evidence = (described.flatten(1, 2), plain[:, 0], seen.mean(1, keepdim=True))
        hidden = self.regularise(torch.cat((*evidence, _centre_maps(start), colours), 1), shallow, deep)
        raw = self.answer(F.relu(hidden)).float()
        shift = ((raw[:, :-1] + likely).softmax(1) * self.offsets[:, None, None]).sum(1)
        change = resize(torch.stack((shift, raw[:, -1]), 1), _size(prior.log_depths)).unflatten(0, shape)
        return DepthMaps(
            prior.log_depths + change[:, :, 0],
            (prior.log_errors + change[:, :, 1]).clamp(*PRIOR.log_error_range),
        )

    def _sweep(
        self,
        compared: list[Compared],
        log_depths: Tensor,
        viewmats: Tensor,
        Ks: Tensor,
        neighbours: Neighbours | None,
    ) -> tuple[list[Tensor], Tensor]:
        """`sweep_correlation` of every scene: (n, G, P, h, w) each, and (n, P, h, w)."""
        count = log_depths.shape[1]
        scenes = [
            sweep_correlation(
                compared if len(log_depths) == 1 else [c.views(b * count, count) for c in compared],
                logs,
                self.offsets,
                viewmats[b],
                Ks[b],
                neighbours,
            )
            for b, logs in enumerate(log_depths)
        ]
        volumes, seen = zip(*scenes, strict=True)
        return [torch.cat(found) for found in zip(*volumes, strict=True)], torch.cat(seen)


def _size(maps: Tensor) -> tuple[int, int]:
    return maps.shape[-2], maps.shape[-1]


def _centre_maps(maps: Tensor) -> Tensor:
    """Log depth about its mean and log error about a typical one, (n, 2, h, w): no unit left."""
    logs, errors = maps[:, 0], maps[:, 1]
    return torch.stack((logs - logs.mean((1, 2), keepdim=True), errors - PRIOR.typical_log_error), 1)
