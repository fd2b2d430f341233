"""`langflash lab eval grouping`: how well groups and parts of single real photos follow what is in them.

The truth is a folder that is named (connected regions of a name) or outlined (`lab train outlines`);
what nobody named or outlined is not judged. Groups are what the queries answer, parts what they are cut into
and what atoms are made of; each pixel is its likeliest one's.

Sizes: H W pixels of the photo as it is judged, G true regions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from jaxtyping import Float64, Integer

from langflash_core.base.running import Progress
from langflash_core.lab.evaluation.borders import UNKNOWN, border_f1
from langflash_core.lab.evaluation.tables import Measure, by_measure, markdown, rounded
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.fitting import fitted, network_size
from langflash_core.lab.training.measures import nan_mean
from langflash_core.lab.training.outlined import Outlined
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.prior import resize
from langflash_core.network.semantics.splitting import split_groups

SMALLEST = 0.0008
"""Share of the photo below which a region is not judged."""


MEASURES = (
    Measure("IoU of the best one, mean over true regions", "best_iou"),
    Measure("true regions whose best one has an IoU over .5", "recall"),
    Measure("pixels right if each were named by most of what lies in it", "achievable"),
    Measure("F1 of borders, 4 pixels", "border_f1"),
    Measure("how many", "count"),
)


@dataclass(frozen=True)
class GroupingScore:
    """best_iou: mean over true regions of the IoU with the best found one; recall: share of them for which
    it is over .5; achievable: share of judged pixels that are right if every found region is given to the
    true one it lies in most; border_f1: of all borders (`borders`); count: found regions."""

    best_iou: float
    recall: float
    achievable: float
    border_f1: float
    count: float


def score(found: Integer[np.ndarray, "H W"], truth: Integer[np.ndarray, "H W"]) -> GroupingScore:
    """Of a photo whose found regions are numbered from 0, true ones too (`UNKNOWN`: not judged)."""
    known = truth >= 0
    table = _overlaps(found[known], truth[known])
    areas = table.sum(1)
    rows = areas >= SMALLEST * truth.size
    either = areas[:, None] + table.sum(0)[None] - table
    best = (table / np.maximum(either, 1)).max(1, initial=0)[rows]
    return GroupingScore(
        best_iou=float(best.mean()) if rows.any() else float("nan"),
        recall=float((best > 0.5).mean()) if rows.any() else float("nan"),
        achievable=float(table.max(0, initial=0).sum() / max(known.sum(), 1)),
        border_f1=border_f1(found, truth),
        count=float(len(np.unique(found))),
    )


def _overlaps(
    found: Integer[np.ndarray, " P"], truth: Integer[np.ndarray, " P"]
) -> Float64[np.ndarray, "G J"]:
    """Pixels that each true region (rows) and each found one share."""
    true_ids, rows = np.unique(truth, return_inverse=True)
    found_ids, columns = np.unique(found, return_inverse=True)
    flat = np.bincount(rows * len(found_ids) + columns, minlength=len(true_ids) * len(found_ids))
    return flat.reshape(len(true_ids), len(found_ids)).astype(np.float64)


@torch.inference_mode()
def regions_found(
    network: GuidedDepthNet, photo_size: tuple[int, int], images: torch.Tensor, Ks: torch.Tensor
) -> tuple[np.ndarray, np.ndarray]:
    """Groups and parts of one photo (1, 1, 3, h, w), each (H, W) int64."""
    tokens = network.encode(images, Ks)
    features = network.language(tokens, images)
    whole, finest = network.wholes(tokens, images)
    parts = split_groups(whole, finest, network.preset.splitting, photo_size, features[0].float())
    return _likeliest(resize(whole, photo_size)), _likeliest(parts)


def _likeliest(weights: torch.Tensor) -> np.ndarray:
    """Of one view's weights (1, K, H, W); 0 everywhere where K is 0."""
    if weights.shape[1] == 0:
        return np.zeros(weights.shape[-2:], dtype=np.int64)
    return weights[0].argmax(0).numpy()


def grouping_scores(
    network: GuidedDepthNet, folder: PhotoFolder, ids: Sequence[str]
) -> Iterator[tuple[str, dict[str, GroupingScore]]]:
    """Id and scores of groups and parts, photo by photo.

    Raises:
        InputError: a photo or its map cannot be used.
    """
    photos = Outlined(folder, tuple(ids), 1.0)
    for row, id in enumerate(ids):
        photo = photos.photo(row)
        size = network_size(photo, network.preset.native_area, network.preset.patch)
        view = fitted(photo, size)
        side = photo.image.shape[1] / size[0], photo.image.shape[0] / size[1]
        judged = (round(size[0] * min(side)), round(size[1] * min(side)))
        truth = fitted(photo, judged).labels.numpy() - 1
        images, Ks = view.rgb[None, None].float() / 255, view.K[None, None]
        groups, parts = regions_found(network, (judged[1], judged[0]), images, Ks)
        truth = np.where(truth < 0, UNKNOWN, truth)
        yield id, {"groups": score(groups, truth), "parts": score(parts, truth)}


def run_grouping(
    network: GuidedDepthNet,
    folder: PhotoFolder,
    ids: Sequence[str],
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Means over photos of groups and of parts, as plain JSON.

    Raises:
        InputError: a photo or its map cannot be used.
    """
    rows: dict[str, list[GroupingScore]] = {"groups": [], "parts": []}
    for number, (id, scores) in enumerate(grouping_scores(network, folder, ids), 1):
        for kind, one in scores.items():
            rows[kind].append(one)
        progress(f"photo {id}, {number} of {len(ids)}", number / len(ids))
    names = [field.name for field in fields(GroupingScore)]
    means = {
        kind: rounded({name: nan_mean(getattr(one, name) for one in own) for name in names})
        for kind, own in rows.items()
    }
    return {"folder": folder.root.name, "photos": len(ids), **means}


def grouping_markdown(result: dict) -> str:
    """The means as a table."""
    columns = {kind: result[kind] for kind in ("groups", "parts")}
    return markdown(
        [by_measure("", "", columns, MEASURES)], f"{result['photos']} photos of {result['folder']}"
    )
