"""`langflash eval rooms`: the network on rooms with furniture it has never seen, in one command.

Every scene gives two photos to the network and keeps a third as the target view. Depth, pose and
points are judged in the photos, pictures and labels in the photos and in the target view (there
only where a photo sees the surface), phrases in the first photo. Trivial answers are measured in
the same run on the same scenes.

Sizes: V views, H W pixels, K atoms, G class groups, C channels, P phrases.
"""

import logging
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import unproject
from langflash_core.lab.evaluation.consistency import label_consistency
from langflash_core.lab.evaluation.metrics import (
    POSE_LIMITS,
    PoseError,
    Presence,
    calibration_error,
    point_error,
    pose_auc,
    pose_error,
    presence,
)
from langflash_core.lab.evaluation.pictures import ssim
from langflash_core.lab.evaluation.segments import Panoptic, instance_iou, label_border_f, panoptic
from langflash_core.lab.evaluation.side_measures import DepthView, seen_by
from langflash_core.lab.evaluation.sights import (
    Look,
    Sight,
    error_picture,
    label_picture,
    legend_of,
    photo_picture,
)
from langflash_core.lab.evaluation.tallies import Shelf, collected, merged
from langflash_core.lab.evaluation.words import OTHER, PAPER_LABELS, PARAPHRASES, absent_phrases, paper_label
from langflash_core.lab.rooms.cameras import overlap_fraction
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.losses import ssim_map
from langflash_core.lab.training.measures import (
    abs_rel,
    align_scale,
    class_ious,
    confusion,
    delta1,
    mean_iou,
    nan_mean,
    psnr,
)
from langflash_core.lab.training.measures import accuracy as pixel_accuracy
from langflash_core.lab.training.shards import NOTHING, RoomRecord
from langflash_core.language.answers import presence_scores
from langflash_core.language.relevance import relevancy
from langflash_core.language.spaces import LanguageSpace, encode_cached, language_space
from langflash_core.language.vocabulary import OWN
from langflash_core.network import LangFlashNet, load_network
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.model import Seen
from langflash_core.network.semantics.aggregation import average_atoms
from langflash_core.splat import rasterize, view_colours
from langflash_core.types import Camera, Prediction, Views

log = logging.getLogger(__name__)

PHRASES = 20
"""Asked per scene: half of them things that are there, half things that are not."""
MASK_THRESHOLDS = tuple(round(0.3 + 0.01 * step, 2) for step in range(70))
MEDIANS = ("depth_abs_rel", "depth_abs_rel_view_0_twice", "points_view_1")
"""Of these the median room is told beside the mean, which a few wrong poses dominate."""
STUFF = frozenset({"wall", "floor", "ceiling"})
MIN_SHARE = 0.004
"""Of view 0: a thing counts as there from this share of its pixels on (200 of 224 x 224)."""


@dataclass
class Tally:
    """What a run collects: numbers per scene by name, confusion counts by (row, view, label set),
    presence scores, per present phrase its mask's IoU at each of `MASK_THRESHOLDS`, and per
    paraphrase its IoU and that of the plain names, a pair for each scene that shows it; segments of the
    target view against true instances."""

    numbers: dict[str, list[float]] = field(default_factory=dict)
    counts: dict[tuple[str, str, str], Tensor] = field(default_factory=dict)
    scores: list[Tensor] = field(default_factory=list)
    truths: list[Tensor] = field(default_factory=list)
    poses: list[tuple[PoseError, float]] = field(default_factory=list)
    mask_ious: list[Tensor] = field(default_factory=list)
    paraphrases: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    panoptic: Panoptic = field(default_factory=Panoptic)

    def note(self, **values: float) -> None:
        for name, value in values.items():
            self.numbers.setdefault(name, []).append(float(value))

    def count(self, key: tuple[str, str, str], table: Tensor) -> None:
        self.counts[key] = self.counts[key] + table if key in self.counts else table


@dataclass(frozen=True)
class Setting:
    """What every scene is judged with: network, language space, class groups and their vectors."""

    network: LangFlashNet
    space: LanguageSpace
    groups: tuple[str, ...]
    texts: Tensor
    paper_texts: Tensor
    median_depth: float
    temperature: float
    threshold: float
    negatives: Tensor

    @staticmethod
    def of(network: LangFlashNet, groups: Sequence[str], median_depth: float) -> "Setting":
        space = language_space(network.preset.space)
        own = network.calibration
        with torch.no_grad():
            return Setting(
                network=network,
                space=space,
                groups=tuple(groups),
                texts=space.encode(list(groups)),
                paper_texts=space.encode(list(PAPER_LABELS[:OTHER])),
                median_depth=median_depth,
                temperature=float(own.get("temperature", space.temperature)),
                threshold=float(own.get("threshold", space.threshold)),
                negatives=space.encode(list(own.get("negatives", space.negatives))),
            )


def run_eval(
    data: Path, weights: Path | None = None, *, preset: str = "mini", limit: int | None = None
) -> dict:
    """Judge a checkpoint on `data/held_out` (made by `langflash train cache --set held_out`).

    Args:
        data: cache folder; `held_out` is judged, `validation` calibrates the presence threshold
            where the checkpoint brings none, `train` gives the constant-depth baseline.
        limit: only the first so many scenes.

    Returns:
        Plain JSON: "rows" (name -> numbers), "scenes", "seeds", "threshold".

    Raises:
        InputError: there is no such cache. WeightsError: the weights do not fit.
    """
    setting, held_out = open_rooms(data, weights, preset=preset, limit=limit)
    tallies: dict[str, Tally] = {}
    for name, tally in room_tallies(setting, held_out):
        tallies[name] = tally
        log.info("scene %s (%d of %d)", name, len(tallies), len(held_out))
    return {
        "weights": str(weights) if weights else preset,
        "scenes": len(tallies),
        "seeds": [min(map(int, tallies)), max(map(int, tallies))],
        "threshold": setting.threshold,
        "temperature": setting.temperature,
        **summary(merged(list(tallies.values())), setting),
    }


def open_rooms(
    data: Path, weights: Path | None = None, *, preset: str = "mini", limit: int | None = None
) -> tuple[Setting, RoomSet]:
    """What `run_eval` judges with, and the rooms that it judges.

    Raises:
        InputError: there is no such cache. WeightsError: the weights do not fit.
    """
    held_out = _rooms(data / "held_out", limit)
    network = load_network(preset, weights)
    groups = sorted({label.group for label in held_out.labels()})
    return Setting.of(network, groups, _median_depth(data)), held_out


def room_tallies(
    setting: Setting, rooms: RoomSet, shelf: Shelf | None = None, look: Look | None = None
) -> Iterator[tuple[str, Tally]]:
    """Seed and tally of every room, in order; those on the shelf are not judged again."""

    def judge(record: RoomRecord) -> Tally:
        tally = Tally()
        judge_scene(setting, record, tally, look)
        return tally

    return collected(((str(record.seed), record) for record in _records(rooms)), judge, shelf)


def asked_rooms(network: LangFlashNet, data: Path, *, limit: int | None = None) -> Tally:
    """Scores, truths and mask overlaps of phrases in `data/validation`, whose furniture no training saw.

    The sets "there" and "not there" are those of `judge_scene`. Every second question uses another word
    of the vocabulary instead of the plain name, because people do.
    """
    rooms = _rooms(data / "validation", limit)
    groups = sorted({label.group for label in rooms.labels()})
    plain = Setting.of(network, groups, median_depth=1.0)
    tally = Tally()
    for record in _records(rooms):
        views = views_of(record, (0, 1))
        ask_phrases(plain, record, network.predict(views), tally, varied=True)
    return tally


def _rooms(folder: Path, limit: int | None) -> RoomSet:
    try:
        return RoomSet(folder, limit=limit)
    except ValueError as error:
        raise InputError(str(error)) from None


def _records(rooms: RoomSet):
    for shard, index in rooms.entries:
        yield shard.record(index, with_tokens=False)


def _median_depth(data: Path, scenes: int = 256) -> float:
    """Median true depth of training rooms, metres: the best constant there is."""
    if not (data / "train").is_dir():
        return 2.5
    rooms = _rooms(data / "train", scenes)
    samples = [record.depths[:, ::8, ::8].float().flatten() for record in _records(rooms)]
    joined = torch.cat(samples)
    return float(joined[joined > 0].median())


def views_of(record: RoomRecord, chosen: Sequence[int]) -> Views:
    """Views of a stored scene as the network takes them; sources are left out, so matching reads
    the same pictures."""
    keep = list(chosen)
    return Views(
        images=record.rgb[keep].float() / 255,
        Ks=record.Ks[keep],
        names=tuple(f"view {v}" for v in keep),
    )


def judge_scene(setting: Setting, record: RoomRecord, tally: Tally, look: Look | None = None) -> None:
    """Everything about one scene of at least three views; adds to `tally`."""
    views = views_of(record, (0, 1))
    start = time.perf_counter()
    prediction = setting.network.predict(views)
    tally.note(seconds=time.perf_counter() - start)
    tally.note(**{f"stage_{name}_seconds": value for name, value in prediction.timings.items()})
    truth = record.depths.float()
    scale = _scale(prediction.depths[0], truth[0])
    judge_geometry(setting, record, prediction, scale, tally)
    ask_phrases(setting, record, prediction, tally)
    judge_views(setting, record, prediction, scale, tally, look)


def _scale(depths: Tensor, truth: Tensor) -> float:
    """True lengths per predicted length: median of z* / z in view 0."""
    valid = (truth > 0) & (depths > 0)
    return float((truth[valid] / depths[valid]).median())


def judge_geometry(
    setting: Setting, record: RoomRecord, prediction: Prediction, scale: float, tally: Tally
) -> None:
    """Depth of both photos, with its trivial rivals; pose; points of photo 1 in photo 0's frame."""
    truth = record.depths.float()
    twice = setting.network.predict(views_of(record, (0, 0)))
    tally.note(
        depth_abs_rel=abs_rel(align_scale(prediction.depths[0], truth[0]), truth[0]),
        depth_delta1=delta1(align_scale(prediction.depths[0], truth[0]), truth[0]),
        depth_abs_rel_metric=abs_rel(prediction.depths[0], truth[0]),
        depth_abs_rel_view_0_twice=abs_rel(align_scale(twice.depths[0], truth[0]), truth[0]),
        depth_abs_rel_constant=_constant_error(setting, truth[0]),
    )
    error = pose_error(prediction.viewmats[1], _relative(record, 1))
    pair = record.viewmats[[0, 1]].double().numpy(), record.Ks[[0, 1]].double().numpy()
    tally.poses.append((error, overlap_fraction(truth[:2].numpy(), *pair)))
    height, width = truth.shape[-2:]
    points = prediction.gaussians.means.reshape(-1, height, width, 3)[1]
    tally.note(points_view_1=point_error(points, truth[1], record.Ks[1], _relative(record, 1), scale))
    identity = _true_depth_identity_pose(record)
    tally.note(points_view_1_true_depth_identity_pose=identity)


def _constant_error(setting: Setting, truth: Tensor) -> float:
    return abs_rel(align_scale(torch.full_like(truth, setting.median_depth), truth), truth)


def _true_depth_identity_pose(record: RoomRecord) -> float:
    depths = record.depths[1].float()
    return point_error(unproject(depths, record.Ks[1]), depths, record.Ks[1], _relative(record, 1), 1.0)


def _relative(record: RoomRecord, view: int) -> Tensor:
    """Pose of a view, world = view 0."""
    return record.viewmats[view].double().matmul(torch.linalg.inv(record.viewmats[0].double())).float()


def ask_phrases(
    setting: Setting, record: RoomRecord, prediction: Prediction, tally: Tally, *, varied: bool = False
) -> None:
    """Scores of things that are in photo 0 and of things that are not, with the truth of each.

    varied: every second thing is called by another word of the training vocabulary.
    """
    generator = torch.Generator().manual_seed(record.seed)
    there = visible_groups(record, view=0)
    anywhere = sorted({label.group for label in record.labels})
    order = torch.randperm(len(there), generator=generator).tolist()
    present = [there[i] for i in order[: PHRASES // 2]]
    absent = absent_phrases(anywhere, setting.groups, setting.texts, PHRASES - len(present), generator)
    if not present:
        return
    asked = [p for p in (*present, *absent) if p in setting.groups]
    vectors = setting.texts[[setting.groups.index(p) for p in asked]]
    if varied:
        vectors = setting.space.encode([_other_word(p, i) if i % 2 else p for i, p in enumerate(asked)])
    features = F.normalize(torch.einsum("khw,kc->hwc", prediction.weights[0], prediction.dictionary), dim=-1)
    positives = torch.einsum("hwc,pc->phw", features, vectors)
    negatives = torch.einsum("hwc,mc->mhw", features, setting.negatives)
    maps = relevancy(positives, negatives, setting.temperature)
    covered = torch.ones(maps.shape[-2:], dtype=torch.bool)
    tally.scores.append(presence_scores(maps, covered))
    known = [p for p in present if p in setting.groups]
    tally.truths.append(torch.arange(len(vectors)) < len(known))
    for phrase, values in zip(known, maps, strict=False):
        truth = group_mask(record, phrase, view=0)
        tally.mask_ious.append(torch.tensor([_iou(values >= limit, truth) for limit in MASK_THRESHOLDS]))


def _other_word(group: str, turn: int) -> str:
    """One of the words that mean this group alone; its name where there is none."""
    words = OWN.get(group) or (group,)
    return words[turn % len(words)]


def group_mask(record: RoomRecord, group: str, view: int) -> Tensor:
    """Pixels (H, W) of every instance of a class group in a view."""
    own = [index for index, label in enumerate(record.labels) if label.group == group]
    return torch.isin(record.instances[view].long(), torch.tensor(own))


def visible_groups(record: RoomRecord, view: int) -> list[str]:
    """Class groups that cover at least `MIN_SHARE` of a view."""
    areas = torch.bincount(record.instances[view].long().flatten(), minlength=256).float()
    shares: dict[str, float] = {}
    for index, label in enumerate(record.labels):
        shares[label.group] = shares.get(label.group, 0.0) + float(areas[index]) / float(areas.sum())
    return sorted(group for group, share in shares.items() if share >= MIN_SHARE)


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
        seen = Seen(tokens, prediction.depths, prediction.viewmats, source.Ks)
        renamed = network.named(averaged, small[0], seen)
        true_atoms = network.dictionary(masks, features, seen)
        alone = language_maps(network, target)[0][0, 0]
    rgb, maps, true_maps = _rendered(record, prediction, masks, scale)
    photo = record.rgb[2].permute(1, 2, 0).float() / 255
    shown = seen_by_photos(record)
    flat = photo[shown].mean(0).expand_as(photo)
    if bool(shown.any()):
        tally.note(
            psnr=psnr(rgb[shown], photo[shown]),
            ssim=float(ssim_map(rgb.clamp(0, 1), photo)[shown].mean()),
            psnr_mean_colour=psnr(flat[shown], photo[shown]),
        )
    tally.note(psnr_whole_picture=psnr(rgb, photo), target_seen_share=float(shown.float().mean()))
    for view, own, weights, exact in (
        (0, features[0, 0], prediction.weights[0], masks[0]),
        (2, alone, maps, true_maps),
    ):
        vectors = {
            "features": _upsampled(own, (photo.shape[0], photo.shape[1])),
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
    tally.note(ssim_whole_picture=ssim(rgb, photo))
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
    truth = _class_rows(setting, record, 2)
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


def _class_rows(setting: Setting, record: RoomRecord, view: int) -> np.ndarray:
    """Row of `setting.groups` of every pixel (H, W) of a view, -1 for none."""
    table = np.full(256, -1, dtype=np.int64)
    for index, label in enumerate(record.labels):
        table[index] = setting.groups.index(label.group)
    return table[record.instances[view].numpy().astype(np.int64)]


def _sight(setting: Setting, record: RoomRecord, rgb: Tensor, labels: np.ndarray, tally: Tally) -> Sight:
    """The room for people, with the numbers that its tally ended with."""
    first, photo = (record.rgb[view].permute(1, 2, 0).float() / 255 for view in (0, 2))
    seen = labels[1] >= 0
    truth = np.where(seen, _class_rows(setting, record, 2), -1)
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


def seen_by_photos(record: RoomRecord) -> Tensor:
    """Pixels (H, W) of the target view whose surface photo 0 or 1 sees, from true depths.

    What no photo saw cannot be drawn or named by any method; it is left out of the target's
    measures, alike for all of them.
    """
    maps = (t.double().numpy() for t in (record.depths, record.viewmats, record.Ks))
    first, second, target = (DepthView(*own) for own in zip(*maps, strict=True))
    return torch.from_numpy(seen_by(target, [first, second]))


def _upsampled(features: Tensor, size: tuple[int, int]) -> Tensor:
    return F.interpolate(features[None], size=size, mode="bilinear", align_corners=False)[0].permute(1, 2, 0)


def true_masks(record: RoomRecord, views: Sequence[int]) -> Tensor:
    """One-hot instance masks (V, number of labels, H, W) of some views."""
    ids = record.instances[list(views)].long()
    return torch.stack([(ids == i).float() for i in range(len(record.labels))], 1)


def _rendered(
    record: RoomRecord, prediction: Prediction, masks: Tensor, scale: float
) -> tuple[Tensor, Tensor, Tensor]:
    """The target view drawn from the Gaussians: rgb (H, W, 3), weight maps of the predicted
    (K, H, W) and of the true groups (G', H, W). Predicted lengths times `scale` are metres."""
    viewmat = _relative(record, 2)
    viewmat[:3, 3] /= scale
    height, width = record.rgb.shape[-2:]
    camera = Camera(viewmat, record.Ks[2], width, height)
    atoms = prediction.weights.shape[1]
    weights = prediction.weights.permute(0, 2, 3, 1).flatten(0, 2)
    exact = masks.permute(0, 2, 3, 1).flatten(0, 2)
    opacities = prediction.gaussians.opacities.unflatten(0, (len(prediction.viewmats), -1)).clone()
    opacities[list(prediction.unplaced)] = 0  # a scene leaves such photos out
    gaussians = replace(prediction.gaussians, opacities=opacities.flatten())
    with torch.no_grad():
        colours = view_colours(gaussians, camera)
        layers, _ = rasterize(gaussians, torch.cat((colours, weights, exact), 1), camera)
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
    ids = record.instances[view].long().masked_fill(~counted, NOTHING)
    rows = {group: row for row, group in enumerate(setting.groups)}
    groups = torch.full((256,), -1)
    papers = torch.full((256,), -1)
    for index, label in enumerate(record.labels):
        groups[index] = rows[label.group]
        papers[index] = paper_label(label.group)
    truth, paper_truth = groups[ids].flatten(), papers[ids].flatten()
    to_paper = torch.tensor([paper_label(group) for group in setting.groups])
    for method, maps in vectors.items():
        found = (maps @ setting.texts.T).argmax(-1).flatten()
        tally.count((method, name, "groups"), confusion(found, truth, len(setting.groups)))
        tally.count((method, name, "paper"), confusion(to_paper[found], paper_truth, len(PAPER_LABELS)))
    if "wall" in rows:
        wall = torch.full_like(truth, rows["wall"])
        tally.count(("majority", name, "groups"), confusion(wall, truth, len(setting.groups)))
        tally.count(("majority", name, "paper"), confusion(to_paper[wall], paper_truth, len(PAPER_LABELS)))
    if name == "source":
        _note_paraphrases(setting, vectors["lfa"], truth, tally)


def _note_paraphrases(setting: Setting, maps: Tensor, truth: Tensor, tally: Tally) -> None:
    """IoU of other words with all they are true of, and of the plain names of the same things.

    The names' mask is the union of the masks of all those names that are well in sight: what
    somebody would get who typed them one by one. Same pixels, same threshold.

    Args:
        maps: (H, W, C). truth: (H*W,) row of each pixel's class group, -1 for none.
    """
    units = F.normalize(maps, dim=-1).flatten(0, 1)
    negatives = (units @ setting.negatives.T).T
    there = torch.bincount(truth[truth >= 0], minlength=len(setting.groups)) / truth.numel()
    others = encode_cached(setting.space, tuple(PARAPHRASES))

    def mask(vectors: Tensor) -> Tensor:
        found = relevancy((units @ vectors.T).T, negatives, setting.temperature)
        return (found >= setting.threshold).any(0)

    for vector, (phrase, covered) in zip(others, PARAPHRASES.items(), strict=True):
        own = [row for row, group in enumerate(setting.groups) if group in covered and there[row] > 0]
        if float(there[own].sum()) < MIN_SHARE:
            continue
        pixels = torch.isin(truth, torch.tensor(own))
        asked = _iou(mask(vector[None]), pixels)
        names = [row for row in own if there[row] >= MIN_SHARE] or [max(own, key=lambda row: there[row])]
        named = _iou(mask(setting.texts[names]), pixels)
        tally.note(paraphrase_iou=asked, name_iou=named)
        tally.paraphrases.setdefault(phrase, []).append((asked, named))


def _paraphrase_report(tally: Tally) -> dict[str, dict[str, float | None]]:
    """Per phrase: how often it was asked, its mean IoU, and that of the plain names."""
    return {
        phrase: {
            "asked": len(ious),
            **_rounded({"iou": nan_mean(i[0] for i in ious), "name_iou": nan_mean(i[1] for i in ious)}),
        }
        for phrase, ious in sorted(tally.paraphrases.items())
    }


def _iou(found: Tensor, truth: Tensor) -> float:
    union = float((found | truth).sum())
    return float((found & truth).sum()) / union if union else 0.0


def summary(tally: Tally, setting: Setting) -> dict:
    """Means, medians and tables of a run, rounded; plain JSON."""
    scores, truths = torch.cat(tally.scores), torch.cat(tally.truths)
    found: Presence = presence(scores, truths, setting.threshold)
    always = presence(torch.ones_like(scores), truths, 0.5)
    overlapping = [error for error, overlap in tally.poses if overlap >= 0.3]
    rotations = torch.tensor([error.rotation for error, _ in tally.poses])
    directions = torch.tensor([error.direction for error, _ in tally.poses])
    geometry = {name: nan_mean(values) for name, values in tally.numbers.items()}
    geometry |= {f"{name}_median": _median(tally.numbers[name]) for name in MEDIANS if name in tally.numbers}
    geometry |= {
        "pose_rotation_median": float(rotations.nanmedian()),
        "pose_direction_median": float(directions.nanmedian()),
        "pose_right_share": nan_mean(float(error.right()) for error in overlapping),
        "pose_pairs_overlapping": float(len(overlapping)),
        "panoptic_quality": tally.panoptic.mean(),
        "panoptic_segmentation": tally.panoptic.mean("segmentation"),
        "panoptic_recognition": tally.panoptic.mean("recognition"),
        "calibration_error": calibration_error(scores, truths),
        "presence_precision": found.precision,
        "presence_recall": found.recall,
        "presence_f1": found.f1,
        "presence_f1_always_found": always.f1,
        "presence_phrases": float(len(scores)),
    }
    areas = pose_auc([error.worst for error, _ in tally.poses])
    geometry |= {f"pose_auc_{limit:g}": area for limit, area in zip(POSE_LIMITS, areas, strict=True)}
    if geometry.get("name_iou"):
        geometry["paraphrase_share"] = geometry["paraphrase_iou"] / geometry["name_iou"]
    labels: dict[str, dict[str, float]] = {}
    for (method, view, kind), counts in tally.counts.items():
        row = labels.setdefault(method, {})
        row[f"{view}_{kind}_accuracy"] = pixel_accuracy(counts)
        row[f"{view}_{kind}_miou"] = mean_iou(counts)
        if kind == "groups":
            things = [i for i, g in enumerate(setting.groups) if g not in STUFF]
            row[f"{view}_objects_miou"] = mean_iou(counts, things)
    paper = tally.counts.get(("lfa", "target", "paper"))
    per_label: dict[str, float] = {}
    if paper is not None:
        per_label = dict(zip(PAPER_LABELS, class_ious(paper).tolist(), strict=True))
    return {
        "measures": _rounded(dict(sorted(geometry.items()))),
        "labels": {m: _rounded(row) for m, row in labels.items()},
        "target_iou_by_label": _rounded(per_label),
        "paraphrases": _paraphrase_report(tally),
    }


def _median(values: Sequence[float]) -> float:
    return float(torch.tensor(values).nanmedian())


def _rounded(values: dict[str, float]) -> dict[str, float | None]:
    """Four digits; what could not be measured is null, because JSON has no NaN."""
    return {k: None if math.isnan(v) else round(v, 4) for k, v in values.items()}
