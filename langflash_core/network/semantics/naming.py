"""What parts are called, from what they look like and from where and how large they are.

Language features name pixels one by one, and from what a window of a few patches shows. A part is
more: all its pixels in all photos, and a thing of some width and height that stands on the floor or
hangs above it. The namer reads both and corrects the part's atom.

Sizes: V views, K parts, H W pixels, h w a map's own size, C channels of the language space.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.attention import SelfBlock
from langflash_core.network.presets import GuidedDepth
from langflash_core.network.semantics.settings import PART_NAMING


def describe(weights: Float[Tensor, "V K H W"], tokens: Tokens) -> Float[Tensor, "K C"]:
    """Mean deep tokens of every part, (K, 2 * encoder channels).

    Args:
        weights: w_k(x) of one scene, (V, K, h, w), any size. tokens: of its views, B = 1.
    """
    small = F.adaptive_avg_pool2d(weights, tokens.grid).flatten(2)  # (V, K, T)
    total = small.sum((0, 2))[:, None] + 1e-6
    count = tokens.grid[0] * tokens.grid[1]
    deep = (*tokens.hooks[-2:], *tokens.named)
    means = [torch.einsum("vkt,vtc->kc", small, hook[0, :, -count:].float()) / total for hook in deep]
    return torch.cat(means, 1)


def upright(pos_c: Float[Tensor, "H W 3"], valid: Bool[Tensor, "H W"]) -> Float[Tensor, "3"]:
    """The direction up in a camera's frame: where most surfaces that could be level face.

    Rooms have floors, table tops and ceilings, and people hold cameras roughly level.

    Args:
        pos_c: points (H, W, 3) of one view in its own frame, +y down. valid: (H, W) bool.

    Returns:
        Unit vector (3,); the camera's own up where nothing level is seen. Deterministic.
    """
    own = pos_c.new_tensor([0.0, -1.0, 0.0])
    across, along = pos_c[1:-1, 2:] - pos_c[1:-1, :-2], pos_c[2:, 1:-1] - pos_c[:-2, 1:-1]
    whole = valid[1:-1, 2:] & valid[1:-1, :-2] & valid[2:, 1:-1] & valid[:-2, 1:-1]
    normals = F.normalize(torch.linalg.cross(across, along, dim=-1)[whole], dim=-1)
    normals = normals * torch.where(normals[:, 1:2] > 0, -1.0, 1.0)
    normals = normals[-normals[:, 1] > PART_NAMING.level]
    if len(normals) < PART_NAMING.min_points:
        return own
    normals = normals[:: max(1, len(normals) // PART_NAMING.voters)]
    agreement = normals @ normals.T
    winner = (agreement > PART_NAMING.same).sum(1).argmax()
    return F.normalize(normals[agreement[winner] > PART_NAMING.near].mean(0), dim=0)


def places(
    weights: Float[Tensor, "V K H W"],
    depths: Float[Tensor, "V _ _"],
    viewmats: Float[Tensor, "V 4 4"],
    Ks: Float[Tensor, "V 3 3"],
) -> Float[Tensor, "K C"]:
    """Where each part is and how large, (K, `PART_NAMING.place`): log width, height and depth (m), heights of
    its foot and top over the floor (m), place to the side and ahead (m), log share of all pixels, share of
    it on a picture's border, and 1; zeros where too little of it is known.

    A pixel counts for the part that has most of it. Lengths are those of `depths`, metres as far as
    one photo tells; the axes are view 0's, turned upright.

    Args:
        weights: w_k(x), (V, K, h, w). depths: (V, H, W), 0 where unknown. viewmats: (V, 4, 4), world =
            view 0. Ks: (V, 3, 3), pixels of the depths.
    """
    _, parts, height, width = weights.shape
    answer = weights.new_zeros(parts, PART_NAMING.place)
    if parts == 0:
        return answer
    scale = torch.tensor([width / depths.shape[2], height / depths.shape[1], 1.0]).to(Ks)[:, None]
    small = F.interpolate(depths[:, None].float(), size=(height, width), mode="nearest-exact")[:, 0]
    pos_c, valid = unproject(small, Ks * scale), torch.isfinite(small) & (small > 0)
    up = upright(pos_c[0], valid[0])
    ahead = F.normalize(up.new_tensor([0.0, 0.0, 1.0]) - up * up[2], dim=0)
    axes = torch.stack((torch.linalg.cross(ahead, up, dim=0), up, ahead))
    poses = invert_rigid(viewmats.float())
    pos_w = torch.einsum("vij,vhwj->vhwi", poses[:, :3, :3], pos_c) + poses[:, None, None, :3, 3]
    pos_r = pos_w @ axes.T  # right, up, ahead
    owner = weights.argmax(1)
    if not bool(valid.any()):
        return answer
    floor = torch.quantile(pos_r[..., 1][valid], 0.01)
    border = torch.zeros_like(valid)
    border[:, [0, -1]] = True
    border[:, :, [0, -1]] = True
    spread = up.new_tensor([0.03, 0.97])
    for k in range(parts):
        own = (owner == k) & (weights[:, k] > 0)  # masks may leave pixels to nobody
        points = pos_r[own & valid]
        if len(points) < PART_NAMING.min_points:
            continue
        low, high = torch.quantile(points, spread, dim=0)
        numbers = [
            *(high - low).clamp_min(0.01).log(), low[1] - floor, high[1] - floor, (low[0] + high[0]) / 2,
            (low[2] + high[2]) / 2, own.float().mean().clamp_min(1e-4).log(),
            (own & border).sum() / own.sum(), torch.ones_like(floor),
        ]  # fmt: skip
        answer[k] = torch.stack(numbers)
    return answer


class PartNamer(nn.Module):
    """Corrects a scene's atoms by looks and places; starts by changing nothing.

    Parts are pieces: the seat and the back of one chair. Self-attention lets them read each other, so
    that a piece can be named by the whole, and a thing by the room it stands in. What it reads is
    brought to mean 0 and variance 1 by statistics of the training parts.
    """

    mean: Float[Tensor, " n"]
    std: Float[Tensor, " n"]

    def __init__(self, preset: GuidedDepth):
        super().__init__()
        inputs, dim = (
            PART_NAMING.deep * preset.encoder_dim + PART_NAMING.place + preset.language_dim,
            preset.naming_dim,
        )
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("std", torch.ones(inputs))
        self.embed = nn.Linear(inputs, dim)
        self.blocks = nn.ModuleList(SelfBlock(dim, preset.naming_heads) for _ in range(preset.naming_blocks))
        self.norm, self.out = nn.LayerNorm(dim), nn.Linear(dim, preset.language_dim)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def standardise(
        self, atoms: Float[Tensor, "K C"], looks: Float[Tensor, "K D"], places: Float[Tensor, "K p"]
    ) -> Float[Tensor, "K E"]:
        """What the layers read, (K, inputs)."""
        return (torch.cat((looks, places, atoms), -1) - self.mean) / self.std

    def context(self, inputs: Float[Tensor, "n C"]) -> Float[Tensor, "n D"]:
        """What each part's correction is read from, (K, naming_dim); inputs: `standardise`."""
        parts = self.embed(inputs)[None]
        for block in self.blocks:
            parts = block(parts)
        return self.norm(parts)[0]

    def forward(
        self, atoms: Float[Tensor, "K C"], looks: Float[Tensor, "K D"], places: Float[Tensor, "K p"]
    ) -> Float[Tensor, "K C"]:
        """Atoms (K, C) of unit norm of one scene.

        Args:
            atoms: of the aggregation, (K, C). looks: of `describe`. places: of `places`.
        """
        change = self.out(self.context(self.standardise(atoms, looks, places)))
        return F.normalize(atoms + change.float(), dim=-1)
