"""Losses of every stage as pure functions. Slow twins: tests/lab/training/reference.py.

Sizes: B batch, V views, H W pixels, P sampled pixels, A phrases of the bank, C channels,
N queries, G ground-truth groups. r = log z - log z* is the depth residual; t a text embedding.
An empty selection (no valid pixel, no group) gives a zero that still carries a gradient path.
"""

import math
from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional as F

EPS = 1e-6


def masked_mean(values: Tensor, mask: Tensor) -> Tensor:
    """Mean of `values` where `mask`; 0 where nothing is selected. Shapes broadcast.

    Values outside the mask may be NaN: they are replaced before they are multiplied.
    """
    mask = mask.expand_as(values)
    kept = torch.where(mask, values, torch.zeros_like(values))
    return kept.sum() / mask.sum().clamp_min(1)


def log_residual(log_depths: Tensor, targets: Tensor) -> tuple[Tensor, Tensor]:
    """r = log z - log z* (0 where invalid) and the mask of pixels with a target (z* > 0, finite)."""
    valid = torch.isfinite(targets) & (targets > 0)
    logs = torch.where(valid, targets, torch.ones_like(targets)).log()
    return torch.where(valid, log_depths - logs, torch.zeros_like(log_depths)), valid


def depth_loss(log_depths: Tensor, targets: Tensor, *, absolute: float = 0.3) -> Tensor:
    """Scale-aware L1 on log-depth: the shape of a room counts more than its size.

    mean_x |r - m| + absolute * |m| with m the masked mean of r of each picture. One photo does
    not tell metres from centimetres, so the common factor is trained with a smaller weight.

    Args:
        log_depths: (B, H, W) predicted log z.
        targets: (B, H, W) z, any unit, 0 or NaN where unknown.
        absolute: weight of the common factor.

    Returns:
        Scalar, nats.

    Source: own; the pair of terms of Eigen et al. 2014 with L1 in place of L2.
    """
    residuals, valid = log_residual(log_depths, targets)
    counts = valid.sum((-2, -1)).clamp_min(1)
    offsets = residuals.sum((-2, -1)) / counts
    shape = masked_mean((residuals - offsets[:, None, None]).abs(), valid)
    present = valid.flatten(1).any(1)
    return shape + absolute * masked_mean(offsets.abs(), present)


def gradient_loss(log_depths: Tensor, targets: Tensor, *, scales: int = 4) -> Tensor:
    """L1 between the slopes of predicted and true log-depth, at `scales` strides 1, 2, 4, ...

    Edges stay sharp and planes flat. Pairs with an invalid end do not count.
    Source: Li & Snavely 2018 (MegaDepth), as used by MiDaS.
    """
    residuals, valid = log_residual(log_depths, targets)
    total = residuals.sum() * 0
    for level in range(scales):
        step = 2**level
        part, mask = residuals[:, ::step, ::step], valid[:, ::step, ::step]
        if min(part.shape[-2:]) < 2:
            break
        along_x = masked_mean((part[..., 1:] - part[..., :-1]).abs(), mask[..., 1:] & mask[..., :-1])
        along_y = masked_mean((part[:, 1:] - part[:, :-1]).abs(), mask[:, 1:] & mask[:, :-1])
        total = total + along_x + along_y
    return total / scales


def point_loss(points: Tensor, targets: Tensor, valid: Tensor) -> Tensor:
    """Mean distance of points after each scene's mean distance from the first camera is made 1.

    mean_x | X(x) / s - X*(x) / s* |, s and s* the mean norms over all valid pixels of all views.

    Args:
        points, targets: (B, V, H, W, 3) in view 0's frame. valid: (B, V, H, W) bool.

    Returns:
        Scalar; 0 where nothing is valid.

    Source: Wang et al. 2024 (DUSt3R), its regression loss.
    """
    count = valid.flatten(1).sum(1).clamp_min(1)

    def unit(values: Tensor) -> Tensor:
        norms = torch.where(valid, values.norm(dim=-1), 0.0)
        return values / (norms.flatten(1).sum(1) / count).clamp_min(EPS)[:, None, None, None, None]

    kept = torch.where(valid[..., None], targets, torch.zeros_like(targets))
    return masked_mean((unit(points) - unit(kept)).norm(dim=-1), valid)


def error_loss(
    log_depths: Tensor, log_errors: Tensor, targets: Tensor, *, shared_offset: bool = True
) -> Tensor:
    """Negative log-likelihood of |r| under a Laplace distribution of scale b: |r| / b + log b.

    Only b is trained by it: r carries no gradient, so that hard pixels are not given up on.

    Args:
        log_depths, log_errors, targets: (B, H, W); log_errors = log b.
        shared_offset: take each picture's mean of r off first (a monocular map has no scale).

    Returns:
        Scalar, nats; its minimum over b is at b = E|r|.

    Source: Kendall & Gal 2017, with the residual detached.
    """
    residuals, valid = log_residual(log_depths.detach(), targets)
    if shared_offset:
        counts = valid.sum((-2, -1), keepdim=True).clamp_min(1)
        residuals = residuals - residuals.sum((-2, -1), keepdim=True) / counts
    return masked_mean(residuals.abs() * torch.exp(-log_errors) + log_errors, valid)


def language_loss(
    features: Tensor,
    targets: Tensor,
    bank: Tensor,
    *,
    true: Tensor | None = None,
    temperature: float = 14.0,
    synonym: float = 0.6,
    attract: float = 0.5,
) -> Tensor:
    """Contrastive cross-entropy of pixel features against phrases, plus plain attraction.

    For pixel p with phrase t_p: -log e^{s f.t_p} / (e^{s f.t_p} + sum_{a: not true_pa} e^{s f.t_a})
    plus attract * (1 - f.t_p). Phrases that are true of the pixel's thing, too ("settee" and
    "furniture" for "sofa"), are no negatives; its nearest false ones ("armchair") are. Attraction
    keeps the features in the text tower's own space, so that unseen phrases and absolute cosines
    mean something.

    Args:
        features: (P, C), any norm (normalised here).
        targets: (P, C) unit, the phrase of each pixel's instance.
        bank: (A, C) unit, every phrase of the batch and the standing ones.
        true: (P, A) bool, which phrases hold for the pixel; without it, those with t_a.t_p > synonym.
        temperature: s.

    Returns:
        Scalar; 0 for P = 0. Pixels must already be drawn class-balanced.

    Source: InfoNCE (van den Oord et al. 2018) with LSeg's per-pixel form; masking is ours.
    """
    if features.shape[0] == 0:
        return features.sum() * 0
    units = F.normalize(features.float(), dim=-1)
    positives = (units * targets).sum(-1)
    negatives = temperature * units @ bank.T
    negatives = negatives.masked_fill(targets @ bank.T > synonym if true is None else true, -math.inf)
    logits = torch.cat((temperature * positives[:, None], negatives), 1)
    contrast = torch.logsumexp(logits, 1) - logits[:, 0]
    return contrast.mean() + attract * (1 - positives).mean()


def focal_pairs(logits: Tensor, masks: Tensor, *, alpha: float = 0.25, gamma: float = 2.0) -> Tensor:
    """Mean focal loss of every query against every group: (N, P) logits, (G, P) 0/1 masks -> (N, G).

    Source: Lin et al. 2017; the pairwise form of DETR / Mask2Former matching.
    """
    probs = logits.sigmoid()
    as_one = alpha * (1 - probs) ** gamma * F.softplus(-logits)
    as_zero = (1 - alpha) * probs**gamma * F.softplus(logits)
    return (as_one @ masks.T + as_zero @ (1 - masks).T) / max(logits.shape[1], 1)


def dice_pairs(logits: Tensor, masks: Tensor) -> Tensor:
    """Dice loss 1 - (2 p.m + 1) / (|p| + |m| + 1) of every pair, (N, P), (G, P) -> (N, G), in [0, 1)."""
    probs = logits.sigmoid()
    overlap = 2 * probs @ masks.T
    sizes = probs.sum(1)[:, None] + masks.sum(1)[None]
    return 1 - (overlap + 1) / (sizes + 1)


def soft_iou(probs: Tensor, masks: Tensor, eps: float = EPS) -> Tensor:
    """sum min(p, m) / sum max(p, m) along the last axis, in [0, 1]; shapes (..., P)."""
    return torch.minimum(probs, masks).sum(-1) / (torch.maximum(probs, masks).sum(-1) + eps)


def instance_contrast(features: Tensor, ids: Tensor, *, temperature: float = 10.0) -> Tensor:
    """Pixels of one instance should point the same way, pixels of different ones should not.

    mean_p -log( sum_{j != p, id_j = id_p} e^{s f_p.f_j} / sum_{j != p} e^{s f_p.f_j} ), unit f.

    It takes the place of the dense teacher where there is none: like it, it teaches the map that
    masks are read from directly, without waiting for the queries to find their objects.

    Args:
        features: (P, C) of pixels drawn over all views of a scene. ids: (P,) instance of each.

    Returns:
        Scalar; pixels without a partner do not count, 0 if none has one.

    Source: Khosla et al. 2020 (supervised contrastive), the form with the sum inside the logarithm.
    """
    units = F.normalize(features.float(), dim=-1)
    self_pairs = torch.eye(len(ids), dtype=torch.bool, device=ids.device)
    logits = (temperature * units @ units.T).masked_fill(self_pairs, -math.inf)
    same = (ids[:, None] == ids[None]) & ~self_pairs
    kept = same.any(1)
    if not bool(kept.any()):
        return features.sum() * 0
    logits, same = logits[kept], same[kept]
    together = torch.logsumexp(logits.masked_fill(~same, -math.inf), 1)
    return (torch.logsumexp(logits, 1) - together).mean()


def teacher_loss(maps: Tensor, teacher: Tensor | None) -> Tensor:
    """Mean squared error between unit-normalised dense maps (B, C, h, w); 0 without a teacher.

    The paper regresses SAM's encoder. The embedded preset trains with exact instance masks and has
    no teacher by default; `instance_contrast` then takes this term's place and weight.

    Raises:
        ValueError: channels differ; a linear projection belongs before this function.
    """
    if teacher is None:
        return maps.sum() * 0
    if maps.shape != teacher.shape:
        raise ValueError(f"teacher: expected shape {tuple(maps.shape)}, received {tuple(teacher.shape)}")
    return F.mse_loss(F.normalize(maps.float(), dim=1), F.normalize(teacher.float(), dim=1)) * maps.shape[1]


def cosine_distance(left: Tensor, right: Tensor) -> Tensor:
    """1 - cos along the last axis, in [0, 2]."""
    return 1 - F.cosine_similarity(left.float(), right.float(), dim=-1, eps=EPS)


def photometric_loss(rendered: Tensor, photo: Tensor, mask: Tensor, *, ssim_weight: float = 0.2) -> Tensor:
    """(1 - w) L1 + w (1 - SSIM) / 2 of pictures (H, W, 3) in [0, 1], where mask (H, W).

    Source: Kerbl et al. 2023, eq. 7 (there D-SSIM; halved here so that it stays in [0, 1]).
    """
    difference = masked_mean((rendered - photo).abs(), mask[..., None])
    dissimilar = (1 - ssim_map(rendered, photo)) / 2
    return (1 - ssim_weight) * difference + ssim_weight * masked_mean(dissimilar, mask[..., None])


def ssim_map(left: Tensor, right: Tensor, *, window: int = 7, peak: float = 1.0) -> Tensor:
    """Structural similarity per pixel and channel, (H, W, 3) in [-1, 1], box window, edges reflected.

    Source: Wang et al. 2004 with uniform weights (as scikit-image's default).
    """
    first, second = left.permute(2, 0, 1)[None], right.permute(2, 0, 1)[None]

    def smooth(maps: Tensor) -> Tensor:
        pad = window // 2
        return F.avg_pool2d(F.pad(maps, (pad,) * 4, mode="reflect"), window, 1)

    return structural_similarity(first, second, smooth, peak)[0].permute(1, 2, 0)


def structural_similarity(
    first: Tensor, second: Tensor, smooth: Callable[[Tensor], Tensor], peak: float = 1.0
) -> Tensor:
    """Structural similarity of maps under a window; `smooth` is the weighted mean over it.

    Source: Wang et al. 2004, eq. 13, with its constants .01 and .03.
    """
    mean1, mean2 = smooth(first), smooth(second)
    var1 = smooth(first * first) - mean1**2
    var2 = smooth(second * second) - mean2**2
    covariance = smooth(first * second) - mean1 * mean2
    c1, c2 = (0.01 * peak) ** 2, (0.03 * peak) ** 2
    return ((2 * mean1 * mean2 + c1) * (2 * covariance + c2)) / (
        (mean1**2 + mean2**2 + c1) * (var1 + var2 + c2)
    )
