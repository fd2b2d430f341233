"""Groups become parts: pixels that look alike to the mask map and to the queries share one atom.

The queries merge neighbours (a chair takes its table along), and a merged group's atom answers to
neither word. The map that masks are read from tells the two apart: it was trained so that pixels
of one instance point the same way. So a scene is cut into many parts in the joint space of that
map and of the queries' answer; parts of one object simply get similar atoms. Against splitting
each group by its language vectors, mIoU in target views rose, without training: averaged atoms on
48 validation rooms from .590 to .627 (8 labels) and .181 to .215 (class groups), aggregated atoms
on 47 held-out rooms from .520 to .546 and .136 to .160; the atoms went from 20 to 38.

Notation: V views, K groups, f channels of the mask map, J parts, X pixels of all views,
S = f + K channels of the joint space.
"""

from collections.abc import Callable, Sequence

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.many import groups_of, in_groups, in_half_precision, together
from langflash_core.network.presets import Splitting
from langflash_core.network.prior import resize
from langflash_core.network.semantics.settings import SPLITTING


def split_groups(
    weights: Float[Tensor, "V K H W"],
    embeddings: Float[Tensor, "v f h w"],
    rule: Splitting,
    size: tuple[int, int],
    features: Float[Tensor, "V C _ _"] | None = None,
) -> Float[Tensor, "V J _ _"]:
    """w_j(x) = softmax_j(sharpness u(x) . c_j), u = (e, agreement sqrt(w), meaning L) / norm.

    sqrt(w) is a unit vector, so u . u' adds the Bhattacharyya affinity of the queries' answers at
    two pixels, and the cosine of their language features, to the cosine of their embeddings: what is
    called differently is no part of one thing. The c_j are the means of spherical k-means.

    Args:
        weights: w_k(x), (V, K, h, w), sums to 1 over K; K may be 0.
        embeddings: e(x), the mask map (V, f, h, w), any norm.
        size: (H, W) of the answer.
        features: L(x), (V, C, h', w'), unit norm; None: the embeddings say it already.

    Returns:
        (V, J, H, W), sums to 1 over J >= 1; J = 0 where K = 0. Deterministic.

    Source: own; spherical k-means (Dhillon and Modha 2001), seeded as k-means++ (Arthur and
    Vassilvitskii 2007).
    """
    if weights.shape[1] == 0:
        return weights.new_zeros(len(weights), 0, *size)
    joint = joint_maps(weights, embeddings, None if features is None else condense_features(features), rule)
    return split_maps([lambda: joint], len(weights), rule, size)


def joint_maps(
    weights: Float[Tensor, "v K h w"],
    embeddings: Float[Tensor, "v f h w"],
    meant: Float[Tensor, "v C H W"] | None,
    rule: Splitting,
) -> Float[Tensor, "v S h w"]:
    """u of some views (v, S, h, w): weights (v, K, h, w) and embeddings (v, f, h, w) as `split_groups` has
    them; meant: (v, D, h', w'), condensed features."""
    units = F.normalize(embeddings.float(), dim=1)
    seen = [units, rule.agreement * weights.float().sqrt()]
    if meant is not None:
        seen.append(rule.meaning * F.normalize(resize(meant, (units.shape[-2], units.shape[-1])), dim=1))
    return F.normalize(torch.cat(seen, 1), dim=1)


def split_maps(
    groups: Sequence[Callable[[], Tensor]], num_views: int, rule: Splitting, size: tuple[int, int]
) -> Float[Tensor, "v S h w"]:
    """`split_groups` of V views whose joint maps (v, S, h, w) come group by group, each as often as it is
    asked for. Of many views the parts are found in some of their pixels, and the answer is held in half
    precision."""
    step = -(-num_views // SPLITTING.whole)
    coarse = []
    for group in groups:
        small = F.avg_pool2d(group(), 2, ceil_mode=True).movedim(1, -1).flatten(0, 2)  # (X, S)
        coarse.append(F.normalize(small[::step], dim=-1))
    centres = cluster(torch.cat(coarse) if len(coarse) > 1 else coarse[0], rule)

    def weights(group: Callable[[], Tensor]) -> Tensor:
        closeness = torch.einsum("vshw,js->vjhw", group(), rule.sharpness * centres)
        own = resize(closeness.contiguous(), size).softmax(1)  # three times as fast as in einsum's own order
        return in_half_precision(own, num_views)

    return together(map(weights, groups), num_views)


def condense_features(features: Float[Tensor, "V C h w"]) -> Float[Tensor, "V D h w"]:
    """Maps (V, C, h, w) in the few directions that a scene needs, (V, `SPLITTING.directions`, h, w) float32:
    clustering then takes a fifth of the time, and cosines stay.

    Source: Halko, Martinsson and Tropp 2011 (randomised range finder, one power iteration).
    """
    if features.shape[1] <= SPLITTING.directions:
        return features
    drawn = torch.randn(features.shape[1], SPLITTING.directions, generator=torch.Generator().manual_seed(0))
    basis = drawn.to(features.device)
    for _ in range(2):
        basis = torch.linalg.qr(_power_step(features, basis)).Q
    return in_groups(lambda some: torch.einsum("vchw,cd->vdhw", some.float(), basis), features)


def _power_step(features: Tensor, basis: Tensor) -> Tensor:
    """X^T X B of all pixels' features, (C, D); some views at a time."""
    found = None
    for some in groups_of(len(features)):
        pixels = features[some].float().movedim(1, -1).flatten(0, 2)  # (X, C)
        product = pixels.T @ (pixels @ basis)
        found = product if found is None else found + product
    assert found is not None, "there is a view"
    return found


def cluster(vectors: Float[Tensor, "X S"], rule: Splitting) -> Float[Tensor, "J S"]:
    """Centres (J, S), unit norm, of unit vectors (X, S), the largest first; 1 <= J <= max_parts.

    Centres closer than `max_cosine` to a larger one are left out: simple rooms keep few parts.
    """
    centres, counts = _settle(vectors, _seeds(vectors, rule.max_parts))
    order = counts.argsort(descending=True, stable=True)
    centres = centres[order[counts[order] > 0]]
    alike = (centres @ centres.T > rule.max_cosine).tolist()
    kept: list[int] = []
    for row in range(len(centres)):
        if not any(alike[row][other] for other in kept):
            kept.append(row)
    return centres[kept]


def _seeds(vectors: Tensor, count: int) -> Tensor:
    """Up to `count` of the vectors, each drawn with the squared distance to those before it.

    The largest of chance / e with e exponential, as `torch.multinomial` draws one: all e are drawn at once,
    on the processor, so that every device draws the same and none waits for another.
    """
    generator = torch.Generator().manual_seed(0)
    some = vectors[:: max(1, len(vectors) // SPLITTING.seeds_from)]
    waits = torch.empty(min(count, len(some)) - 1, len(some))
    for own in waits:
        own.exponential_(generator=generator)
    distances, chosen = torch.full_like(some[:, 0], torch.inf), [some[:1]]
    for own in waits.to(some):
        distances = distances.minimum((some - chosen[-1]).square().sum(1))
        chance = distances.clamp_min(1e-9)  # equal pixels still give a seed
        chosen.append(some[(chance / own).argmax(0, keepdim=True)])
    return torch.cat(chosen)


def _settle(vectors: Tensor, centres: Tensor) -> tuple[Tensor, Tensor]:
    """Lloyd iterations: unit centres (J, S) and how many vectors each has; empty ones stay put."""
    counts = torch.zeros(len(centres))
    for _ in range(SPLITTING.iterations):
        nearest = (vectors @ centres.T).argmax(1)
        counts = torch.bincount(nearest, minlength=len(centres))
        sums = torch.zeros_like(centres).index_add_(0, nearest, vectors)
        centres = torch.where(counts[:, None] > 0, F.normalize(sums, dim=-1), centres)
    return centres, counts
