"""The two losses over semantic groups: L_SG (masks, existence) and L_LFA (dictionary).

Sizes: N queries, G ground-truth groups of one scene, P pixels of all its views together (one
group is one instance in every view), C channels. Weights of the terms are `GroupingWeights`,
`AggregationWeights`: the paper prints only symbols, the values are this project's.
"""

from dataclasses import dataclass

import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.losses import cosine_distance, dice_pairs, focal_pairs, soft_iou


@dataclass(frozen=True)
class GroupingWeights:
    """lambda_foc, lambda_dice, lambda_exist, lambda_mse, and the weight of "no object".

    mse: of `instance_contrast`, which stands in for the regression of SAM's embedding. teacher: of that
    regression itself; 0: it is not asked for.
    """

    focal: float = 20.0
    dice: float = 1.0
    existence: float = 2.0
    mse: float = 1.0
    no_object: float = 0.1
    teacher: float = 0.0


@dataclass(frozen=True)
class AggregationWeights:
    """lambda_in, lambda_gt, lambda_text."""

    initial: float = 0.5
    truth: float = 1.0
    text: float = 1.0


@dataclass(frozen=True)
class Assignment:
    """Query `queries[j]` speaks for group `groups[j]`; both (M,) int64, M = min(N, G)."""

    queries: Tensor
    groups: Tensor


def match(
    mask_logits: Tensor, existence_logits: Tensor, masks: Tensor, weights: GroupingWeights
) -> Assignment:
    """Cheapest one-to-one assignment of queries to groups over all views jointly.

    cost[n, g] = focal * L_foc + dice * L_dice - existence * sigmoid(e_n)

    Args:
        mask_logits: (N, P). existence_logits: (N,). masks: (G, P) of 0 and 1.

    Raises:
        ValueError: a logit is not finite (training has diverged).

    Source: Carion et al. 2020 (DETR) for the assignment; scipy's Jonker-Volgenant solver.
    """
    if not bool(torch.isfinite(mask_logits).all() and torch.isfinite(existence_logits).all()):
        raise ValueError("mask_logits: expected finite logits, received NaN or infinity")
    with torch.no_grad():
        logits = mask_logits.float()
        cost = weights.focal * focal_pairs(logits, masks) + weights.dice * dice_pairs(logits, masks)
        cost = cost - weights.existence * existence_logits.float().sigmoid()[:, None]
        rows, columns = linear_sum_assignment(cost.cpu().numpy())
    device = mask_logits.device
    return Assignment(torch.as_tensor(rows, device=device), torch.as_tensor(columns, device=device))


def grouping_loss(
    mask_logits: Tensor, existence_logits: Tensor, masks: Tensor, weights: GroupingWeights
) -> tuple[Tensor, Assignment]:
    """L_SG of one scene, without its dense-teacher term (`losses.teacher_loss`).

    focal * mean_j L_foc(p_j, m_j) + dice * mean_j L_dice(p_j, m_j)
    + existence * sum_n c_n BCE(e_n, [n matched]) / sum_n c_n,  c_n = 1 matched, no_object else.

    Args:
        mask_logits: (N, P). existence_logits: (N,). masks: (G, P) of 0 and 1; G = 0 trains
            existence alone.

    Returns:
        The loss and the assignment it used.
    """
    chosen = match(mask_logits, existence_logits, masks, weights)
    logits, truth = mask_logits.float()[chosen.queries], masks[chosen.groups]
    matched = torch.zeros_like(existence_logits, dtype=torch.float32)
    matched[chosen.queries] = 1
    costs = torch.where(matched > 0, 1.0, weights.no_object)
    entropy = F.binary_cross_entropy_with_logits(existence_logits.float(), matched, reduction="none")
    loss = weights.existence * (costs * entropy).sum() / costs.sum()
    if len(chosen.queries):
        loss = (
            loss + weights.focal * _paired_focal(logits, truth) + weights.dice * _paired_dice(logits, truth)
        )
    return loss, chosen


def _paired_focal(logits: Tensor, masks: Tensor, alpha: float = 0.25) -> Tensor:
    """Diagonal of `focal_pairs` (gamma 2), averaged."""
    probs = logits.sigmoid()
    as_one = alpha * (1 - probs) ** 2 * F.softplus(-logits)
    as_zero = (1 - alpha) * probs**2 * F.softplus(logits)
    return (masks * as_one + (1 - masks) * as_zero).mean()


def _paired_dice(logits: Tensor, masks: Tensor) -> Tensor:
    probs = logits.sigmoid()
    return (1 - (2 * (probs * masks).sum(1) + 1) / (probs.sum(1) + masks.sum(1) + 1)).mean()


@dataclass(frozen=True)
class GroupTexts:
    """What the matched groups are called: truth (M, C) unit, one phrase per group; bank (A, C) unit;
    true (M, A) bool, which phrases of the bank hold for which group (None: go by cosine)."""

    truth: Tensor
    bank: Tensor
    true: Tensor | None = None


def aggregation_loss(
    atoms: Tensor,
    pooled: Tensor,
    quality: Tensor,
    texts: GroupTexts,
    weights: AggregationWeights,
    *,
    temperature: float = 14.0,
    synonym: float = 0.6,
) -> Tensor:
    """L_LFA over the M matched groups of a scene.

    L_in   = mean_n (1 - cos(d_n, d_n^(0))): refinement stays near what the pixels said.
    L_gt   = sum_n w_n (1 - cos(d_n, g_n)) / (sum_n w_n + 1e-6): towards the true vector g_n of the
             group (the paper's CLIP vector of the mask; here the text embedding of its name),
             with w_n the quality of the matched mask (soft IoU, no gradient), so that a query
             whose mask leaks over its neighbours does not learn the wrong name. The paper prints
             p_n in L_gt but defines w_n; w_n is what is meant.
    L_text = sum_n w_n CE_n / (sum_n w_n + 1e-6): the atom must prefer its own phrase to every phrase
             of the bank that is false of it (`texts.true`; without it, cosine to g_n up to `synonym`).

    Args:
        atoms: (M, C) refined d_n of matched queries. pooled: (M, C) d_n^(0). quality: (M,) in [0, 1].

    Returns:
        initial * L_in + truth * L_gt + text * L_text; 0 for M = 0.
    """
    if atoms.shape[0] == 0:
        return atoms.sum() * 0
    units = F.normalize(atoms.float(), dim=-1)
    share = quality.detach().float()
    share = share / (share.sum() + 1e-6)
    initial = cosine_distance(units, pooled.detach()).mean()
    truth = (share * cosine_distance(units, texts.truth)).sum()
    alike = texts.truth @ texts.bank.T > synonym if texts.true is None else texts.true
    negatives = (temperature * units @ texts.bank.T).masked_fill(alike, -torch.inf)
    positives = temperature * (units * texts.truth).sum(-1, keepdim=True)
    logits = torch.cat((positives, negatives), 1)
    text = (share * (torch.logsumexp(logits, 1) - logits[:, 0])).sum()
    return weights.initial * initial + weights.truth * truth + weights.text * text


def mask_quality(mask_logits: Tensor, masks: Tensor) -> Tensor:
    """w_n: soft IoU (M,) in [0, 1] of matched masks, (M, P) logits and 0/1 truth; carries no gradient."""
    return soft_iou(mask_logits.detach().float().sigmoid(), masks)
