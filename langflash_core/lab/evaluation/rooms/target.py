"""The view that was kept back: its picture, what it is called, its segments. K atoms, H W pixels."""

import math

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.evaluation.alignment import aligned_camera
from langflash_core.lab.evaluation.consistency import label_consistency
from langflash_core.lab.evaluation.drawing import drawn_features, drawn_frame, placed_gaussians
from langflash_core.lab.evaluation.rooms.phrases import note_paraphrases
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE, STUFF, Setting, Tally
from langflash_core.lab.evaluation.rooms.truth import relative, seen_by_photos, true_masks, views_of
from langflash_core.lab.evaluation.segments import instance_iou, label_border_f, panoptic
from langflash_core.lab.evaluation.sharp_measures import ssim
from langflash_core.lab.evaluation.sights import (
    Look,
    Sight,
    error_picture,
    label_picture,
    legend_of,
    photo_picture,
)
from langflash_core.lab.evaluation.words import PAPER_LABELS, paper_label
from langflash_core.lab.training.losses import ssim_map
from langflash_core.lab.training.measures import confusion, psnr
from langflash_core.lab.training.shards import RoomRecord
from langflash_core.network import LangFlashNet
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.model import Seen
from langflash_core.network.semantics.aggregation import average_atoms
from langflash_core.splat import view_colours
from langflash_core.types import Camera, Prediction, Views


def language_maps(network: LangFlashNet, views: Views) -> tuple[Tensor, Tokens]:
    """L(x) of views, (1, V, C, h, w), and the tokens it was read from."""
    images = views.images[None]
    tokens = network.encode(images, views.Ks[None])
    return network.language(tokens, images), tokens


def judge_views(
    setting: Setting,
    record: RoomRecord,
    prediction: Prediction,
    scale: float,
    tally: Tally,
    look: Look | None = None,
) -> None:
    """Picture of the target view, and labels of photo 0 and the target view by every method.

    look: shown the target view, for pictures of a report.
    """
    network = setting.network
    source, target = views_of(record, (0, 1)), views_of(record, (2,))
    with torch.no_grad():
        features, tokens = language_maps(network, source)  # (1, V, C, h, w)
        size = (features.shape[-2], features.shape[-1])
        small = F.adaptive_avg_pool2d(prediction.weights, size)[None]
        averaged = average_atoms(small, features)[0]
        masks = true_masks(record, (0, 1))  # (V, G', H, W)
        seen = Seen(source.images, tokens, prediction.depths, prediction.viewmats, source.Ks)
        renamed = network.named(averaged, small[0], seen)
        true_atoms = network.dictionary(masks, features, seen)
        alone = language_maps(network, target)[0][0, 0]
    rgb, maps, true_maps = _rendered(record, prediction, masks, scale)
    photo = record.rgb[2].permute(1, 2, 0).float() / 255
    shown = seen_by_photos(record)
    _judge_picture(setting, record, prediction, scale, rgb, tally)
    for view, own, weights, exact in (
        (0, features[0, 0], prediction.weights[0], masks[0]),
        (2, alone, maps, true_maps),
    ):
        vectors = {
            "features": upsampled(own, (photo.shape[0], photo.shape[1])),
            "averaged": torch.einsum("khw,kc->hwc", weights, averaged),
            "averaged_named": torch.einsum("khw,kc->hwc", weights, renamed),
            "lfa": torch.einsum("khw,kc->hwc", weights, prediction.dictionary),
            "true_masks_lfa": torch.einsum("khw,kc->hwc", exact, true_atoms),
        }
        counted = torch.ones_like(shown) if view == 0 else shown
        _count_labels(setting, record, view, vectors, tally, counted)
    found = torch.einsum("khw,kc->hwc", prediction.weights[0], prediction.dictionary) @ setting.texts.T
    beside = torch.einsum("khw,kc->hwc", maps, prediction.dictionary) @ setting.texts.T
    drawn = maps.sum(0) > 0
    named = beside.argmax(-1).masked_fill(~(shown & drawn), -1)
    labels = torch.stack((found.argmax(-1), named)).numpy()
    judge_target(setting, record, prediction, maps, labels, shown.numpy(), tally)
    if look is not None:
        look(_sight(setting, record, rgb, labels, tally))


def judge_target(
    setting: Setting,
    record: RoomRecord,
    prediction: Prediction,
    maps: Tensor,
    labels: np.ndarray,
    shown: np.ndarray,
    tally: Tally,
) -> None:
    """Segments and borders of the target view where a photo sees it, and whether it is named as photo 0.

    Walls, floor and ceiling are one segment each, as benchmarks count what cannot be counted.

    Args:
        maps: (K, H, W), drawn. labels: (2, H, W), rows of `setting.groups` in photo 0 and, where a photo
            sees it and the scene covers it, in the target view; -1 elsewhere. shown: (H, W), where a photo
            sees the target view: there a hole is wrong.
    """
    truth = class_rows(setting, record, 2)
    truth[~shown] = -1
    instances = np.where(truth < 0, -1, record.instances[2].numpy().astype(np.int64))
    atoms = np.where((maps.sum(0) > 0).numpy(), maps.argmax(0).numpy(), -1)
    kinds = (prediction.dictionary @ setting.texts.T).argmax(1).tolist()
    true_kinds = {i: setting.groups.index(label.group) for i, label in enumerate(record.labels)}
    stuff = {row for row, group in enumerate(setting.groups) if group in STUFF}

    def joined(ids: np.ndarray, kind_of: dict[int, int]) -> tuple[np.ndarray, dict[int, int]]:
        merged_ids = {i: -2 - kind if kind in stuff else i for i, kind in kind_of.items()}
        table = np.array([merged_ids.get(i, i) for i in range(max([*kind_of, 0]) + 1)])
        places = {target: n for n, target in enumerate(sorted(set(table.tolist())))}
        numbered = np.array([places[i] for i in table.tolist()])
        classes = {places[merged_ids[i]]: kind for i, kind in kind_of.items()}
        return np.where(ids < 0, -1, numbered[ids.clip(0)]), classes

    found, found_classes = joined(atoms, dict(enumerate(kinds)))
    real, real_classes = joined(instances, true_kinds)
    tally.panoptic += panoptic(found, real, found_classes, real_classes)
    tally.note(
        instance_iou=instance_iou(found, real, smallest=round(MIN_SHARE * real.size)),
        border_f=label_border_f(labels[1], truth),
        label_consistency=label_consistency(
            labels,
            record.depths[[0, 2]].double().numpy(),
            record.viewmats[[0, 2]].double().numpy(),
            record.Ks[[0, 2]].double().numpy(),
        ),
    )


def class_rows(setting: Setting, record: RoomRecord, view: int) -> np.ndarray:
    """Row of `setting.groups` of every pixel (H, W) of a view, -1 for none."""
    table = np.full(256, -1, dtype=np.int64)
    for index, label in enumerate(record.labels):
        table[index] = setting.groups.index(label.group)
    return table[record.instances[view].numpy().astype(np.int64)]


def _sight(setting: Setting, record: RoomRecord, rgb: Tensor, labels: np.ndarray, tally: Tally) -> Sight:
    """The room for people, with the numbers that its tally ended with."""
    first, photo = (record.rgb[view].permute(1, 2, 0).float() / 255 for view in (0, 2))
    seen = labels[1] >= 0
    truth = np.where(seen, class_rows(setting, record, 2), -1)
    known = {name: values[-1] for name, values in tally.numbers.items()}
    pictures = {
        "first photo": photo_picture(first),
        "another view": photo_picture(photo),
        "drawn": photo_picture(rgb),
        "error": error_picture(rgb, photo, seen),
        "labels": label_picture(labels[1]),
        "true labels": label_picture(truth),
    }
    right = float((labels[1] == truth)[truth >= 0].mean()) if (truth >= 0).any() else math.nan
    numbers = {name: known[name] for name in ("psnr", "depth_abs_rel", "instance_iou") if name in known}
    numbers = {"labels right": right, **numbers}
    legend = legend_of(setting.groups, labels[1], truth)
    return Sight(str(record.seed), f"room {record.seed}", pictures, numbers, right, legend)


def upsampled(features: Tensor, size: tuple[int, int]) -> Tensor:
    """Maps (C, h, w) at a size (H, W), (H, W, C)."""
    return F.interpolate(features[None], size=size, mode="bilinear", align_corners=False)[0].permute(1, 2, 0)


def target_camera(record: RoomRecord, scale: float) -> Camera:
    """The view that was kept back, in the scene's units; predicted lengths times `scale` are metres."""
    viewmat = relative(record, 2)
    viewmat[:3, 3] /= scale
    return Camera(viewmat, record.Ks[2], record.rgb.shape[-1], record.rgb.shape[-2])


def _judge_picture(
    setting: Setting, record: RoomRecord, prediction: Prediction, scale: float, rgb: Tensor, tally: Tally
) -> None:
    """The target view against its photo where a photo of the scene sees it, as a whole, and from the pose
    that fits the photo best."""
    photo = record.rgb[2].permute(1, 2, 0).float() / 255
    shown = seen_by_photos(record)
    gaussians = placed_gaussians(prediction)
    fitted = aligned_camera(lambda at: drawn_frame(gaussians, at), target_camera(record, scale), photo)
    moved = drawn_frame(gaussians, fitted).rgb
    if bool(shown.any()):
        flat = photo[shown].mean(0).expand_as(photo)
        tally.note(
            psnr=psnr(rgb[shown], photo[shown]),
            psnr_aligned=psnr(moved[shown], photo[shown]),
            ssim=float(ssim_map(rgb.clamp(0, 1), photo)[shown].mean()),
            psnr_mean_colour=psnr(flat[shown], photo[shown]),
        )
    if setting.lpips is not None:
        pictures = torch.stack((rgb, moved))
        own, fit = setting.lpips.whole(pictures, photo.expand_as(pictures))
        tally.note(lpips_whole_picture=own, lpips_whole_picture_aligned=fit)
    tally.note(
        psnr_whole_picture=psnr(rgb, photo),
        psnr_whole_picture_aligned=psnr(moved, photo),
        ssim_whole_picture=ssim(rgb, photo),
        target_seen_share=float(shown.float().mean()),
    )


def _rendered(
    record: RoomRecord, prediction: Prediction, masks: Tensor, scale: float
) -> tuple[Tensor, Tensor, Tensor]:
    """The target view drawn from the Gaussians: rgb (H, W, 3), weight maps of the predicted
    (K, H, W) and of the true groups (G', H, W). Predicted lengths times `scale` are metres."""
    camera, gaussians = target_camera(record, scale), placed_gaussians(prediction)
    atoms = prediction.weights.shape[1]
    weights = prediction.weights.permute(0, 2, 3, 1).flatten(0, 2)
    exact = masks.permute(0, 2, 3, 1).flatten(0, 2)
    with torch.no_grad():
        colours = view_colours(gaussians, camera)
        layers = drawn_features(gaussians, torch.cat((colours, weights, exact), 1), camera)
    layers = layers.permute(2, 0, 1)
    return layers[:3].permute(1, 2, 0), layers[3 : 3 + atoms], layers[3 + atoms :]


def _count_labels(
    setting: Setting,
    record: RoomRecord,
    view: int,
    vectors: dict[str, Tensor],
    tally: Tally,
    counted: Tensor,
) -> None:
    """Confusion counts over class groups and over the paper's labels, of every method in one view;
    only pixels `counted` (H, W)."""
    name = "source" if view == 0 else "target"
    truth = torch.from_numpy(class_rows(setting, record, view)).masked_fill(~counted, -1).flatten()
    found = {method: (maps @ setting.texts.T).argmax(-1).flatten() for method, maps in vectors.items()}
    if "wall" in setting.groups:
        found["majority"] = torch.full_like(truth, setting.groups.index("wall"))
    for method, labels in found.items():
        for kind, table in label_tables(setting, labels, truth).items():
            tally.count((method, name, kind), table)
    if name == "source":
        note_paraphrases(setting, vectors["lfa"], truth, tally)


def label_tables(setting: Setting, found: Tensor, truth: Tensor) -> dict[str, Tensor]:
    """Confusion counts over class groups and over the paper's labels, of rows of `setting.groups` (P,);
    -1 in `truth` is not judged."""
    to_paper = torch.tensor([*(paper_label(group) for group in setting.groups), -1])
    return {
        "groups": confusion(found, truth, len(setting.groups)),
        "paper": confusion(to_paper[found], to_paper[truth], len(PAPER_LABELS)),
    }
