"""One light over all photos: a gain and an offset per photo and channel, found where photos see one surface.

Photos of one room differ in exposure and white balance, and every Gaussian takes its photo's colour, which
leaves patches. Here photo i's colours c become y = g_i c + o_i, channel by channel, in sRGB values without
a gamma change: what an exposure does to linear light is nearly a gain there, because the curve is nearly a
power, and offsets take up the rest.

Compared are means of blocks of pixels, which lessen the harm of poses and depths that are a pixel off:
photo a's block is carried by its depth into photo b, and speaks where b's depth there agrees, both are
confident, and no pixel of either is near black or white. With s = log g, such a pair leaves the residual

    r = (y_a - y_b) / sqrt(g_a g_b),

a difference in units of the photos. It does not shrink when all gains do, so noise in the colours does not
draw the gains of photos that are compared much below those of others, as it would with y_a - y_b alone.
Minimised, each channel for itself, is

    sum w (r / sigma)^2 / (1 + (r / sigma)^2) + sum_i (s_i / tau_s)^2 + (o_i / tau_o)^2,

the robust sum of Geman and McClure over all pairs, w = 1 / `EXPOSURE.together`, and a prior that outweighs
the pairs where they are few, or so even that gain and offset cannot be told apart. Gauge: in every set of
photos that pairs connect, the mean of s and that of o are 0; a photo that shares nothing is a set of its own
and stays exactly as it is. So do photos that no light makes alike: their poses or depths are wrong, and after
a first minimum those pairs of photos are left out.

Sizes: V photos, H W pixels, P blocks of a photo, E ordered pairs of photos that are compared.

Source: own derivation; gains over overlaps with a prior: Brown and Lowe 2007, section 6; the robust weights:
Geman and McClure 1985, sigma lowered step by step as in Black and Rangarajan 1996.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.rig.pairs import strongest
from langflash_core.rig.rig import Rig
from langflash_core.surface.settings import EXPOSURE

BLOCK, SIGMA = EXPOSURE.block, EXPOSURE.sigma
_SIGMAS = (0.4, 0.4, 0.2, 0.2, 0.1, 0.1) + 10 * (SIGMA,)  # step after step


@dataclass(frozen=True)
class ExposureCompensation:
    """gains, offsets (V, 3): what brings each photo's red, green and blue to the light of all.

    Raises:
        ValueError: they are not of one shape (V, 3).
    """

    gains: Float[Tensor, "V 3"]
    offsets: Float[Tensor, "V 3"]

    def __post_init__(self) -> None:
        for name, values in (("gains", self.gains), ("offsets", self.offsets)):
            if values.shape != (len(self.gains), 3):
                expected = (len(self.gains), 3)
                raise ValueError(f"{name}: expected shape {expected}, received {tuple(values.shape)}")

    def stored(self) -> dict[str, list[list[float]]]:
        """What a scene's record says of it, to 6 digits; nothing of the identity."""
        gains, offsets = (
            [[round(x, 6) for x in row] for row in v.tolist()] for v in (self.gains, self.offsets)
        )
        plain = all(x == 1 for row in gains for x in row) and not any(x for row in offsets for x in row)
        return {} if plain else {"gains": gains, "offsets": offsets}

    @property
    def span(self) -> tuple[Float[Tensor, " 3"], Float[Tensor, " 3"]]:
        """Least and most (3,) that photos in [0, 1] become, and 0 and 1: what no photo leaves."""
        low = self.offsets.amin(0).clamp_max(0)
        return low, (self.gains + self.offsets).amax(0).clamp_min(1)

    @property
    def whole(self) -> "ExposureCompensation":
        """The same light with all its span in [0, 1], so that nothing of a photo is clipped."""
        low, high = self.span
        return ExposureCompensation(self.gains / (high - low), (self.offsets - low) / (high - low))

    def correct_photos(
        self, images: Float[Tensor, "*V 3 H W"], view: int | None = None
    ) -> Float[Tensor, "*V 3 H W"]:
        """Photos (V, 3, H, W), or the one of `view` (3, H, W), in the light of all; not clipped."""
        chosen = slice(None) if view is None else view
        gains, offsets = self.gains[chosen].to(images), self.offsets[chosen].to(images)
        return images * gains[..., None, None] + offsets[..., None, None]


@dataclass(frozen=True)
class _Blocks:
    """What is compared of V photos.

    maps: (V, 8, h, w) means of the BLOCK x BLOCK pixels right of and below every pixel: colour; the share of
    pixels that are exposed well, a channel each; depth; confidence. own: (V, 8, P) those of every BLOCK-th
    pixel of a row and a column. points: (V, P, 3) in the world. coarse: numbers (p,) of a few of the P.
    """

    maps: Tensor
    own: Tensor
    points: Tensor
    coarse: Tensor


@dataclass(frozen=True)
class Pairs:
    """One channel of one surface in two photos, E x 3 x P times.

    firsts, seconds: (E,) photos a and b. own, other: (E, 3, P) colours in a and in b, float64. counted:
    (E, 3, P) whether they are to be compared; where not, colours are 0.
    """

    firsts: Int[Tensor, " E"]
    seconds: Int[Tensor, " E"]
    own: Float[Tensor, "E 3 P"]
    other: Float[Tensor, "E 3 P"]
    counted: Bool[Tensor, "E 3 P"]


def compensate_exposure(rig: Rig) -> ExposureCompensation:
    """The gains and offsets that bring photos of one scene to one light.

    Args:
        rig: with photos, whose places are known, and confidences. Depths of 0 and less are left out, as is
            what is not finite.

    Returns:
        float64, on the CPU. Gains in `EXPOSURE.gain_range`, offsets up to `EXPOSURE.largest_offset`. Exactly
        the identity for a photo that shares nothing with others.
    """
    with torch.no_grad():
        return solve_compensation(
            compare_photos(rig.map(lambda values: values.detach().cpu().float())), len(rig)
        )


def compare_photos(rig: Rig) -> Pairs:
    """The pairs that `compensate_exposure` compares, float32 in."""
    num_views = len(rig)
    if num_views < 2 or min(rig.size) < BLOCK:
        return _no_pairs()
    blocks = _blocks(rig)
    shared = torch.zeros(num_views, num_views, dtype=torch.int64)
    for view in range(num_views):
        _, agrees = _sample_blocks(blocks, blocks.points[:, blocks.coarse], rig, view)
        shared[:, view] = (agrees & _confident(blocks.own[..., blocks.coarse])).sum(-1)
    both, parts = (shared + shared.T).numpy(), []
    pairs = strongest(np.where(both > 0, both, -np.inf), EXPOSURE.sources)
    for view in sorted({view for pair in pairs for view in pair}):
        chosen = torch.tensor([sum(pair) - view for pair in pairs if view in pair])
        there, agrees = _sample_blocks(blocks, blocks.points[chosen], rig, view)
        own = blocks.own[chosen]
        exposed = (own[:, 3:6] > 0.999) & (there[:, 3:6] > 0.999)
        counted = exposed & (agrees & _confident(own))[:, None]
        colours = (torch.where(counted, values[:, :3], 0.0).double() for values in (own, there))
        parts.append((chosen, torch.full_like(chosen, view), *colours, counted))
    return Pairs(*map(torch.cat, zip(*parts, strict=True))) if parts else _no_pairs()


def _no_pairs() -> Pairs:
    views, colours = torch.zeros(0, dtype=torch.int64), torch.zeros(0, 3, 0, dtype=torch.float64)
    return Pairs(views, views, colours, colours, colours.bool())


def _blocks(rig: Rig) -> _Blocks:
    assert rig.photos is not None and rig.confidences is not None, "whoever compares photos has them"
    exposed = ((rig.photos > EXPOSURE.exposed[0]) & (rig.photos < EXPOSURE.exposed[1])).float()
    full = torch.cat((rig.photos, exposed, rig.depths[:, None], rig.confidences[:, None]), 1)
    maps = F.avg_pool2d(full, BLOCK, stride=1)
    every = maps[..., ::BLOCK, ::BLOCK]
    lines, columns = every.shape[-2:]
    scale, step = torch.tensor([BLOCK, BLOCK, 1.0])[:, None], EXPOSURE.coarse
    points = transform(invert_rigid(rig.viewmats), unproject(every[:, 6], rig.Ks / scale).flatten(1, 2))
    coarse = torch.arange(lines * columns).view(lines, columns)
    coarse = coarse[*(slice(min(step // 2, side - 1), None, step) for side in (lines, columns))]
    return _Blocks(maps, every.flatten(2), points, coarse.flatten())


def _sample_blocks(blocks: _Blocks, points: Tensor, rig: Rig, view: int) -> tuple[Tensor, Tensor]:
    """What `view` has (n, 8, p) where points (n, p, 3) lie in it, and whether (n, p) it sees these."""
    seen = rig.project(points.flatten(0, 1).T, view)
    lines, columns = blocks.maps.shape[-2:]
    ends = torch.tensor([max(columns - 1, 1), max(lines - 1, 1)])
    places = 2 * (torch.stack((seen.x, seen.y), -1) - BLOCK / 2) / ends - 1
    inside = seen.inside & (places.abs() <= 1).all(-1)
    places = torch.where(inside[:, None], places, 0.0)
    there = F.grid_sample(blocks.maps[view, None], places[None, None], align_corners=True)[0, :, 0]
    agrees = inside & ((there[6] - seen.z).abs() < EXPOSURE.agrees * seen.z) & (there[7] > EXPOSURE.confident)
    return there.unflatten(1, points.shape[:2]).transpose(0, 1), agrees.view(points.shape[:2])


def _confident(own: Tensor) -> Tensor:
    """Blocks (V, P) of maps (V, 8, P) that may speak."""
    return own[:, 7] > EXPOSURE.confident


def solve_compensation(pairs: Pairs, num_views: int) -> ExposureCompensation:
    """The light of these pairs, found again without photos that no light makes alike."""
    light = _minimum(pairs, num_views)
    alike = _alike(pairs, light)
    if bool(alike.all()):
        return light
    kept = (values[alike] for values in (pairs.firsts, pairs.seconds, pairs.own, pairs.other, pairs.counted))
    return _minimum(Pairs(*kept), num_views)


def _alike(pairs: Pairs, light: ExposureCompensation) -> Tensor:
    """(E,) photos of which most pairs differ by no more than 2 sigma."""
    first, second = (
        colours * light.gains[of][..., None] + light.offsets[of][..., None]
        for of, colours in ((pairs.firsts, pairs.own), (pairs.seconds, pairs.other))
    )
    scale = (light.gains[pairs.firsts] * light.gains[pairs.seconds]).sqrt()[..., None]
    near = pairs.counted & ((first - second).abs() < 2 * SIGMA * scale)
    return near.sum((1, 2)) >= EXPOSURE.alike * pairs.counted.sum((1, 2))


def _minimum(pairs: Pairs, num_views: int) -> ExposureCompensation:
    """The minimum of the module's sum over these pairs, by linear least squares that are weighted again."""
    connected = _connected_photos(pairs, num_views)
    gauge = torch.eye(num_views, dtype=torch.float64) - connected / connected.sum(-1, keepdim=True)
    gauge = torch.kron(gauge, torch.eye(2, dtype=torch.float64))  # (3, 2V, 2V)
    prior = torch.tensor([EXPOSURE.log_gain**-2, EXPOSURE.offset**-2], dtype=torch.float64).repeat(num_views)
    found = torch.zeros(3, 2 * num_views, dtype=torch.float64)  # s and o of a photo after the other
    for sigma in _SIGMAS if len(pairs.firsts) else ():
        normal, right = _normal_equations(pairs, found.view(3, num_views, 2), sigma)
        normal = gauge @ normal @ gauge + prior.diag()
        right = (gauge @ right[..., None])[..., 0] - prior * found
        # One after the other: with several threads torch hangs or fails on a batch of large ones (its issue
        # 142815), of 96 photos and more.
        found = found + torch.stack([torch.linalg.solve(*own) for own in zip(normal, right, strict=True)])
    logs, offsets = _bound_gains(found.view(3, num_views, 2), connected).unbind(-1)
    return ExposureCompensation(logs.exp().T.contiguous(), offsets.T.contiguous())


def _normal_equations(pairs: Pairs, found: Tensor, sigma: float) -> tuple[Tensor, Tensor]:
    """Matrix (3, 2V, 2V) and right side (3, 2V) of the step from `found` (3, V, 2).

    With m = (y_a + y_b) / 2 and h = 1 / sqrt(g_a g_b) the residual's derivatives are h (m - o_a) by s_a, h by
    o_a, -h (m - o_b) by s_b and -h by o_b: five sums a channel of a pair of photos say everything.
    """
    num_views, (a, b) = found.shape[1], (pairs.firsts, pairs.seconds)
    logs, offsets = found.transpose(0, 1).unbind(-1)  # (V, 3)
    scale = (-(logs[a] + logs[b]) / 2).exp()  # (E, 3)
    lights = [(logs[of].exp() * scale, offsets[of] * scale) for of in (a, b)]
    some = torch.arange(len(a)).split(EXPOSURE.at_once)
    sums = torch.cat([_sums(pairs, lights, edges, sigma) for edges in some])  # (E, 3, 6)
    slopes = torch.cat([_slopes(offsets[a], scale), -_slopes(offsets[b], scale)], -1)  # (E, 3, 2, 4)
    blocks = slopes.mT @ sums[..., :4].unflatten(-1, (2, 2)) @ slopes  # (E, 3, 4, 4)
    rows = torch.stack((2 * a, 2 * a + 1, 2 * b, 2 * b + 1), -1)  # (E, 4)
    places = rows[:, :, None] * (2 * num_views) + rows[:, None]
    normal = found.new_zeros(3, (2 * num_views) ** 2)
    normal.index_add_(1, places.flatten(), blocks.transpose(0, 1).flatten(1))
    right = found.new_zeros(3, 2 * num_views)
    right.index_add_(1, rows.flatten(), -(sums[..., None, 4:] @ slopes).transpose(0, 1).flatten(1))
    return normal.view(3, 2 * num_views, 2 * num_views), right


def _sums(pairs: Pairs, lights: list[tuple[Tensor, Tensor]], edges: Tensor, sigma: float) -> Tensor:
    """Weighted sums (e, 3, 6) over some pairs of photos: of (h m)^2, h m, h m, 1, r h m, r."""
    first, second = (
        gains[edges, :, None] * colours[edges] + offsets[edges, :, None]
        for (gains, offsets), colours in zip(lights, (pairs.own, pairs.other), strict=True)
    )
    gap, middle = first - second, (first + second) / 2
    weights = pairs.counted[edges] / ((1 + (gap / sigma) ** 2) ** 2 * (sigma**2 * EXPOSURE.together))
    weighted = weights * middle
    products = (weighted * middle, weighted, weighted, weights, weighted * gap, weights * gap)
    return torch.stack([values.sum(-1) for values in products], -1)


def _slopes(offsets: Tensor, scale: Tensor) -> Tensor:
    """Derivatives (E, 3, 2, 2) of the residual by s and o (columns), as multiples of h m and 1 (rows)."""
    one, none = torch.ones_like(scale), torch.zeros_like(scale)
    return torch.stack((one, none, -offsets * scale, scale), -1).unflatten(-1, (2, 2))


def _connected_photos(pairs: Pairs, num_views: int) -> Tensor:
    """(3, V, V) float64: 1 where pairs of a channel lead from one photo to another, in however many steps."""
    reach = torch.eye(num_views, dtype=torch.float64).repeat(3, 1, 1)
    for first, second, some in zip(pairs.firsts, pairs.seconds, pairs.counted.any(-1).double(), strict=True):
        reach[:, first, second] += some
        reach[:, second, first] += some
    for _ in range(max(num_views - 1, 1).bit_length()):
        reach = (reach @ reach > 0).double()
    return reach


def _bound_gains(found: Tensor, connected: Tensor) -> Tensor:
    """s and o (3, V, 2), where one leaves its range drawn to 0 together with all that are connected to it:
    their means stay 0."""
    limits = torch.tensor([math.log(EXPOSURE.gain_range[1]), EXPOSURE.largest_offset], dtype=torch.float64)
    excess = (found.abs() / limits).amax(-1)  # (3, V)
    return found / (connected * excess[:, None]).amax(-1).clamp_min(1)[..., None]
