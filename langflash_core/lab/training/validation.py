"""What each stage is judged by while it trains: a few measures on unseen rooms, in seconds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.batches import RoomSet, SceneBatch
from langflash_core.lab.training.measures import (
    abs_rel,
    accuracy,
    align_scale,
    confusion,
    delta1,
    mean_iou,
    nan_mean,
    psnr,
)
from langflash_core.lab.training.naming import measure_naming
from langflash_core.lab.training.parts import PartSet
from langflash_core.lab.training.stages.aggregation import named_parts
from langflash_core.lab.training.stages.depth import scaled_prior
from langflash_core.lab.training.stages.gaussians import novel_views
from langflash_core.lab.training.stages.grouping import group_masks
from langflash_core.lab.training.stages.pixels import nearest
from langflash_core.lab.training.stages.stage import Words, frozen_tokens, guided, one_scene, tokens_of
from langflash_core.network.model import LangFlashNet
from langflash_core.network.precision import mixed_precision

Measure = Callable[[LangFlashNet, Any, Words], dict[str, float | Tensor]]


@dataclass(frozen=True)
class Validator:
    """Runs a stage's measure over a set of rooms and averages; confusion matrices are summed."""

    rooms: RoomSet | PartSet
    words: Words
    measure: Measure
    views: int = 2
    device: str = "cpu"

    def __call__(self, network: LangFlashNet) -> dict[str, float]:
        rows: list[dict[str, float | Tensor]] = []
        for batch in self.rooms.walk(4, views=self.views):
            with mixed_precision(self.device):
                rows.append(self.measure(network, batch.to(self.device), self.words))
        return _summary(rows)


def _summary(rows: list[dict[str, float | Tensor]]) -> dict[str, float]:
    result: dict[str, float] = {}
    for key in sorted({k for row in rows for k in row}):
        values = [row[key] for row in rows if key in row]
        tables = [v for v in values if isinstance(v, Tensor)]
        if tables:
            counts = torch.stack(tables).sum(0)
            result[f"{key}_accuracy"], result[f"{key}_miou"] = accuracy(counts), mean_iou(counts)
        else:
            result[key] = nan_mean([v for v in values if isinstance(v, float)])
    return result


def measure_depth(network: LangFlashNet, batch: SceneBatch, words: Words) -> dict[str, float | Tensor]:
    """AbsRel and delta1 after one scale per picture, and AbsRel in metres as predicted."""
    depths = guided(network).monocular_depth(tokens_of(network, batch), batch.Ks).depths.float()
    return _depth_rows(depths, batch.depths, metric=True)


def measure_refine(network: LangFlashNet, batch: SceneBatch, words: Words) -> dict[str, float | Tensor]:
    """AbsRel of the refined and of the scale-aligned prior depth, true poses, no alignment after."""
    network = guided(network)
    prior = scaled_prior(network, batch)
    local = network.local(batch.images.flatten(0, 1))
    maps = network.refiner(
        batch.images, frozen_tokens(network, batch), local, prior, batch.viewmats, batch.Ks
    )[-1]
    flat = batch.depths.flatten(0, 1)
    refined, before = (d.float().flatten(0, 1) for d in (maps.depths, prior.depths))
    return {
        "abs_rel": nan_mean(abs_rel(a, t) for a, t in zip(refined, flat, strict=True)),
        "prior_abs_rel": nan_mean(abs_rel(a, t) for a, t in zip(before, flat, strict=True)),
        "delta1": nan_mean(delta1(a, t) for a, t in zip(refined, flat, strict=True)),
    }


def _depth_rows(depths: Tensor, truth: Tensor, *, metric: bool) -> dict[str, float | Tensor]:
    pairs = list(zip(depths.flatten(0, 1), truth.flatten(0, 1), strict=True))
    aligned = [(align_scale(d, t), t) for d, t in pairs]
    rows: dict[str, float | Tensor] = {
        "abs_rel": nan_mean(abs_rel(d, t) for d, t in aligned),
        "delta1": nan_mean(delta1(d, t) for d, t in aligned),
    }
    if metric:
        rows["metric_abs_rel"] = nan_mean(abs_rel(d, t) for d, t in pairs)
    return rows


def measure_gaussians(network: LangFlashNet, batch: SceneBatch, words: Words) -> dict[str, float | Tensor]:
    """PSNR of the last view rendered from the others, at half size, true poses."""
    return {"psnr": nan_mean(psnr(picture, photo) for picture, _, photo in novel_views(network, batch))}


def measure_language(network: LangFlashNet, batch: SceneBatch, words: Words) -> dict[str, float | Tensor]:
    """Argmax of L(x) over the class groups against the truth: counts of pixels."""
    features = network.language(tokens_of(network, batch), batch.images).float()
    table = words.sampler.table
    texts = table.embeddings[table.group_rows()].to(features)
    predicted = torch.einsum("bvchw,gc->bvghw", features, texts).argmax(2)
    truth = group_map(batch, words, (features.shape[-2], features.shape[-1]))
    return {"pixels": confusion(predicted.flatten(), truth.flatten(), len(table.groups))}


def group_map(batch: SceneBatch, words: Words, size: tuple[int, int]) -> Tensor:
    """True class group (B, V, h, w) into the table's groups; -1 where nothing or unknown."""
    ids = nearest(batch.instances, size)
    maps = []
    for labels, own in zip(batch.labels, ids, strict=True):
        rows = torch.cat((words.sampler.groups(labels), torch.full((256 - len(labels),), -1)))
        maps.append(rows.to(own.device)[own])
    return torch.stack(maps)


def measure_grouping(network: LangFlashNet, batch: SceneBatch, words: Words) -> dict[str, float | Tensor]:
    """Mean best IoU of each true instance among surviving masks, recall at 0.5, and their number."""
    groups = network.group(frozen_tokens(network, batch), batch.images)[-1]
    size = (groups.mask_logits.shape[-2], groups.mask_logits.shape[-1])
    best, counts = [], []
    for b in range(batch.images.shape[0]):
        alive = groups.existence_logits[b].sigmoid() > network.preset.tau_exist
        counts.append(float(alive.sum()))
        masks, _ = group_masks(nearest(batch.instances[b], size))
        if not bool(alive.any()) or len(masks) == 0:
            best.append(torch.zeros(len(masks)))
            continue
        owner = groups.mask_logits[b][:, alive].argmax(1).flatten()  # what the softmax will show
        found = F.one_hot(owner, int(alive.sum())).T.float()
        overlap = masks @ found.T
        best.append((overlap / (masks.sum(1)[:, None] + found.sum(1)[None] - overlap)).amax(1).cpu())
    ious = torch.cat(best)
    return {
        "best_iou": float(ious.mean()),
        "recall_50": float((ious > 0.5).float().mean()),
        "groups": nan_mean(counts),
    }


def measure_aggregation(network: LangFlashNet, batch: SceneBatch, words: Words) -> dict[str, float | Tensor]:
    """Class group that most of a part shows: as its atom says, and as the plain average said."""
    table = words.sampler.table
    texts = table.embeddings[table.group_rows()]
    rows: dict[str, float | Tensor] = {}
    for key in ("atoms", "pooled"):
        rows[key] = torch.zeros(len(table.groups), len(table.groups), dtype=torch.int64)
    for b in range(batch.images.shape[0]):
        found = named_parts(network, one_scene(batch, b))
        if found is None:
            continue
        truth = words.sampler.groups(batch.labels[b])[found.instances.cpu()]
        for key, vectors in (("atoms", found.atoms), ("pooled", found.pooled)):
            predicted = (vectors.float().cpu() @ texts.T).argmax(1)
            rows[key] = rows[key] + confusion(predicted, truth, len(table.groups))
    return rows


MEASURES: dict[str, tuple[Measure, int]] = {
    "depth": (measure_depth, 2),
    "refine": (measure_refine, 2),
    "gaussians": (measure_gaussians, 3),
    "language": (measure_language, 1),
    "grouping": (measure_grouping, 2),
    "aggregation": (measure_aggregation, 2),
    "naming": (measure_naming, 2),
}
