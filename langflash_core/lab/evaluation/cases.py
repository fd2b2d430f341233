"""Judging the cases of a protocol: the whole program on a few photos, and views of known truth.

Labels are judged on the drawn atoms and, beside them, on the language features of each picture alone, as a
rival that needs no scene. A view that the network got is a source, one that was kept back a target.

Sizes: H W pixels as the network saw the photos, L labels.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.running import Progress
from langflash_core.lab.evaluation import posed
from langflash_core.lab.evaluation.bench import Bench, as_seen, relative
from langflash_core.lab.evaluation.consistency import label_consistency
from langflash_core.lab.evaluation.metrics import (
    PoseError,
    Presence,
    pose_error,
    pose_measures,
    presence_measures,
)
from langflash_core.lab.evaluation.posed import LEFT_OUT, judge_depth, judge_view
from langflash_core.lab.evaluation.protocols import PROTOCOLS, Case
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE
from langflash_core.lab.evaluation.rooms.target import language_maps
from langflash_core.lab.evaluation.segments import label_border_f
from langflash_core.lab.evaluation.tables import labels_table, markdown, measures_table, rounded
from langflash_core.lab.evaluation.tallies import Shelf, intervals, judged, merged
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.measures import accuracy, class_ious, confusion, nan_mean, occurring_mean_iou
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import LanguageSpace, language_space
from langflash_core.network import PRESETS, LangFlashNet, load_network
from langflash_core.pipeline import query
from langflash_core.types import Frame, Scene, Views

MEASURES = (
    ("Rotation error, median (degrees)", "pose_rotation_median", "", ""),
    ("Direction error, median (degrees)", "pose_direction_median", "", ""),
    ("Pose AUC at 5 degrees", "pose_auc_5", "", ""),
    ("Pose AUC at 10 degrees", "pose_auc_10", "", ""),
    ("Pose AUC at 20 degrees", "pose_auc_20", "", ""),
    ("Depth AbsRel, each photo's scale aligned", "depth_abs_rel", "", ""),
    ("Depth AbsRel of one depth", "depth_abs_rel_flat", "", ""),
    ("Depth delta < 1.25", "depth_delta1", "", ""),
    ("PSNR of kept back views, whole picture (dB)", "psnr_whole_picture", "", ""),
    ("PSNR of kept back views, pose fitted, whole picture (dB)", "psnr_whole_picture_aligned", "", ""),
    ("PSNR of kept back views, covered pixels (dB)", "psnr", "", ""),
    ("PSNR of the first photo instead, same pixels (dB)", "psnr_first_photo", "", ""),
    ("SSIM of kept back views, whole picture", "ssim_whole_picture", "", ""),
    ("LPIPS of kept back views, VGG, whole picture", "lpips_whole_picture", "", ""),
    ("LPIPS of kept back views, VGG, pose fitted, whole picture", "lpips_whole_picture_aligned", "", ""),
    ("Share of kept back views that is covered", "covered", "", ""),
    ("Label consistency across views", "label_consistency", "", ""),
    ("Presence precision", "presence_precision", "", ""),
    ("Presence recall", "presence_recall", "", ""),
    ("Presence F1", "presence_f1", "", ""),
    ("Calibration error of scores (ECE)", "calibration_error", "", ""),
    ("Second photo found its place", "placed", "", ""),
    ("Reconstruction, seconds", "seconds", "", ""),
)
METHODS = {"atoms": "the program: atoms drawn", "features": "2D features of each view, no scene"}
COLUMNS = {
    f"{kind}_{what}": f"{kind} {text}"
    for kind in ("source", "target")
    for what, text in (("miou", "mIoU"), ("picture_miou", "picture mIoU"), ("accuracy", "accuracy"))
}
PUBLISHED: dict[str, Sequence[tuple[str, float, float]]] = {
    "scannet": (
        ("LangFlash as published (Liu et al. 2026), main table", 0.7416, 0.8718),
        ("LangFlash as published, table of K, K = 128", 0.7144, 0.8547),
    ),
}
"""Per protocol: title, mIoU, accuracy. Their weights cannot be had here; their view is as they chose it."""


@dataclass(frozen=True)
class Judge:
    """What every case is judged with. network: a second copy, for features alone; None leaves them out."""

    bench: Bench
    space: LanguageSpace
    network: LangFlashNet | None = None

    @staticmethod
    def of(bench: Bench, *, features: bool = True) -> "Judge":
        """Ready to judge; `features`: also 2D features, for which the network is read a second time.

        Raises:
            WeightsError: the checkpoint does not fit.
        """
        network = load_network(bench.preset, bench.weights) if features else None
        return Judge(bench, language_space(PRESETS[bench.preset].space), network)


@dataclass
class Tally(posed.Tally):
    """What cases collect besides numbers and poses. counts: confusion (L + 1, L + 1) by (list of labels,
    method, view), the last column for pixels without an answer; mious: per picture, by the same but the
    list; presence: found against truth, with scores and truths of all that was asked."""

    counts: dict[tuple[tuple[str, ...], str, str], Tensor] = field(default_factory=dict)
    mious: dict[tuple[str, str], list[float]] = field(default_factory=dict)
    presence: Presence = field(default_factory=Presence)
    scores: list[Tensor] = field(default_factory=list)
    truths: list[Tensor] = field(default_factory=list)


@dataclass(frozen=True)
class Seen:
    """One view of a case: its photo at the network's size, what the scene shows there, the true pose
    relative to the first photo (None: not known)."""

    photo: FittedPhoto
    frame: Frame
    viewmat: Tensor | None
    kind: str


def case_tallies(
    judge: Judge,
    cases: Iterable[Case],
    *,
    count: int | None = None,
    shelf: Shelf | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> list[tuple[str, Tally]]:
    """Scene and tally of every case, in order; those on the shelf are not judged again.

    Raises:
        InputError: there is no case.
    """
    scenes: dict[str, str] = {}

    def named() -> Iterator[tuple[str, Case]]:
        for case in cases:
            scenes[case.name] = case.scene
            yield case.name, case

    found = judged(
        named(), lambda case, _: judge_case(judge, case), count=count, shelf=shelf, progress=progress
    )
    return [(scenes[name], tally) for name, tally in found.items()]


@torch.no_grad()
def judge_case(judge: Judge, case: Case) -> Tally:
    """Everything about one case."""
    tally = Tally()
    photos = [case.folder.photo(id) for id in case.photos]
    bench = judge.bench
    scene, seconds = bench.scene_of(photos)
    tally.note(seconds=seconds, placed=float(scene.num_views == len(photos)))
    tally.note(**{f"stage_{name}_seconds": value for name, value in scene.record.cost.timings.items()})
    sources = [as_seen(photo, scene.view_size) for photo in photos[: scene.num_views]]
    frames = [bench.render(scene, scene.camera(view)) for view in range(len(sources))]
    scale = judge_depth(frames, sources, tally)
    poses = [_pose(photos[0], photo) for photo in photos]
    if len(photos) > 1:
        scale = _judge_pose(scene, poses, scale, tally)
    views = [Seen(s, f, p, "source") for s, f, p in zip(sources, frames, poses, strict=False)]
    if not math.isnan(scale):
        for id in case.targets:
            photo = case.folder.photo(id)
            viewmat, target = relative(photos[0], photo), as_seen(photo, scene.view_size)
            frame = judge_view(scene, viewmat, scale, target, sources[0], bench, tally)
            views.append(Seen(target, frame, viewmat, "target"))
    answers = [_judge_labels(judge, case, scene, view, tally) for view in views] if case.labels else []
    if case.labels:
        _ask(judge, case, scene, views[0], tally)
        _judge_consistency(views, answers, tally)
    return tally


def _pose(first: LabelledPhoto, photo: LabelledPhoto) -> Tensor | None:
    """World to camera, world = the first photo's camera; None where a pose is not known."""
    return None if first.pose is None or photo.pose is None else relative(first, photo)


def _judge_pose(scene: Scene, poses: Sequence[Tensor | None], scale: float, tally: Tally) -> float:
    """Error of the second photo's pose; returns true lengths per scene unit, from the cameras' distance
    where no depth told it."""
    truth = poses[1]
    if truth is None:
        return scale
    if scene.num_views < 2:
        tally.poses.append(PoseError(pose_error(torch.eye(4), truth.float()).rotation, LEFT_OUT))
        return scale
    predicted = scene.viewmats[1].cpu()
    tally.poses.append(pose_error(predicted, truth.float()))
    if not math.isnan(scale):
        return scale
    return float(truth[:3, 3].norm() / predicted[:3, 3].norm().clamp_min(1e-9))


def _rows(case: Case, photo: FittedPhoto) -> Tensor:
    """Place in `case.labels` of every pixel (H, W), -1 where nothing is judged."""
    table = torch.full((max([0, *case.rows]) + 1,), -1)
    for id, row in case.rows.items():
        table[id] = row
    table[0] = -1
    return table[photo.labels]


def _judge_labels(judge: Judge, case: Case, scene: Scene, view: Seen, tally: Tally) -> np.ndarray:
    """Labels of one view by every method; returns those of the drawn atoms (H, W), -1 without an answer."""
    truth = _rows(case, view.photo)
    assert view.frame.weight_maps is not None
    maps = relevance_maps(view.frame.weight_maps, compile_query(scene, judge.space, case.labels)).cpu()
    found = {"atoms": maps.argmax(0).masked_fill((maps == 0).all(0), -1)}
    if judge.network is not None:
        found["features"] = _by_features(judge, case.labels, view.photo)
    for method, labels in found.items():
        answered = torch.where(labels < 0, len(case.labels), labels)
        counts = confusion(answered.flatten(), truth.flatten(), len(case.labels) + 1)
        key = (case.labels, method, view.kind)
        tally.counts[key] = tally.counts[key] + counts if key in tally.counts else counts
        tally.mious.setdefault((method, view.kind), []).append(_answered_miou(counts))
        borders = label_border_f(labels.numpy(), truth.numpy())
        tally.note(**{f"border_f_{view.kind}_{method}": borders})
    return found["atoms"].numpy()


def _answered_miou(counts: Tensor) -> float:
    """Over labels that occur; pixels without an answer are misses of their label, and no label themselves."""
    return occurring_mean_iou(counts, range(len(counts) - 1))


def _by_features(judge: Judge, labels: Sequence[str], photo: FittedPhoto) -> Tensor:
    """Labels (H, W) of a picture alone, from the network's language features before there is a scene."""
    assert judge.network is not None
    device = next(judge.network.parameters()).device
    views = Views(
        images=(photo.rgb.float() / 255)[None].to(device), Ks=photo.K[None].to(device), names=("view",)
    )
    features = language_maps(judge.network, views)[0][0, 0].float().cpu()  # (C, h, w)
    scores = torch.einsum("lc,chw->lhw", judge.space.encode(list(labels)), features)
    size = (photo.rgb.shape[-2], photo.rgb.shape[-1])
    return F.interpolate(scores[None], size=size, mode="bilinear", align_corners=False)[0].argmax(0)


def _ask(judge: Judge, case: Case, scene: Scene, view: Seen, tally: Tally) -> None:
    """Labels of which the first photo shows enough, and such as it does not show at all; "other" is no
    question."""
    truth = _rows(case, view.photo)
    shares = torch.bincount(truth[truth >= 0], minlength=len(case.labels)) / truth.numel()
    asked = [
        row
        for row, label in enumerate(case.labels)
        if label != "other" and (float(shares[row]) >= MIN_SHARE or float(shares[row]) == 0)
    ]
    if not asked:
        return
    height, width = truth.shape
    phrases = [case.labels[row] for row in asked]
    found = query(scene, phrases, size=(width, height), render=lambda scene, camera: view.frame)
    there = [float(shares[row]) > 0 for row in asked]
    tally.presence += Presence.of([answer.found for answer in found.answers], there)
    tally.scores.append(torch.tensor([answer.score for answer in found.answers]))
    tally.truths.append(torch.tensor(there))


def _judge_consistency(views: Sequence[Seen], answers: Sequence[np.ndarray], tally: Tally) -> None:
    """Whether surfaces are called the same from all views with known pose and depth."""
    kept = [
        (view, labels)
        for view, labels in zip(views, answers, strict=True)
        if view.viewmat is not None and bool((view.photo.depths > 0).any())
    ]
    if len(kept) < 2:
        return
    tally.note(
        label_consistency=label_consistency(
            np.stack([labels for _, labels in kept]).astype(np.int64),
            np.stack([view.photo.depths.double().numpy() for view, _ in kept]),
            np.stack([view.viewmat.numpy() for view, _ in kept if view.viewmat is not None]),
            np.stack([view.photo.K.double().numpy() for view, _ in kept]),
        )
    )


def summary(tally: Tally) -> dict:
    """Means and tables, rounded; plain JSON. Labels: over all pixels of cases with one list of labels, then
    the mean over lists; "picture_miou" is the mean over pictures."""
    measures = tally.means()
    if tally.poses:
        measures |= pose_measures(tally.poses)
    if tally.scores:
        measures |= presence_measures(tally.presence, torch.cat(tally.scores), torch.cat(tally.truths))
    return {"measures": rounded(dict(sorted(measures.items()))), "labels": _label_tables(tally)}


def _label_tables(tally: Tally) -> dict[str, dict[str, float | None]]:
    """By method: mIoU and accuracy of sources and targets, and IoU of every label of a shared list."""
    tables: dict[str, dict[str, float]] = {}
    lists = {labels for labels, _, _ in tally.counts}
    for method in METHODS:
        row: dict[str, float] = {}
        for kind in ("source", "target"):
            counts = {
                labels: table for (labels, m, k), table in tally.counts.items() if (m, k) == (method, kind)
            }
            if not counts:
                continue
            row[f"{kind}_miou"] = nan_mean(_answered_miou(table) for table in counts.values())
            row[f"{kind}_accuracy"] = nan_mean(accuracy(table) for table in counts.values())
            row[f"{kind}_picture_miou"] = nan_mean(tally.mious[method, kind])
            if len(lists) == 1:
                ((labels, table),) = counts.items()
                ious = class_ious(table)[:-1].tolist()
                row |= {f"{kind}_iou_{label}": iou for label, iou in zip(labels, ious, strict=True)}
        if row:
            tables[method] = row
    return {method: rounded(row) for method, row in tables.items()}


def result_of(tallies: Sequence[tuple[str, Tally]], *, draws: int = 300) -> dict:
    """Summary of cases, with 95 % intervals that draw scenes, and each scene by itself; plain JSON."""
    by_scene: dict[str, list[Tally]] = {}
    for scene, tally in tallies:
        by_scene.setdefault(scene, []).append(tally)
    scenes: Mapping[str, Tally] = {scene: merged(several) for scene, several in by_scene.items()}
    whole = merged(list(scenes.values()))
    return {
        "cases": len(tallies),
        "scenes": len(scenes),
        **summary(whole),
        "intervals": intervals(list(scenes.values()), summary, draws=draws),
        "by_scene": {scene: summary(tally) for scene, tally in scenes.items()},
    }


def cases_markdown(protocol: str, result: dict) -> str:
    """Measures and labels, beside what papers say of themselves."""
    chosen, known = PROTOCOLS[protocol], result["intervals"]
    about = f"{result['cases']} cases of {result['scenes']} scenes; in brackets 95 % of draws of scenes."
    tables = [
        measures_table("", MEASURES, result["measures"], known),
        labels_table("", METHODS, COLUMNS, result["labels"], known),
    ]
    text = markdown(tables, f"## {chosen.title}", chosen.about, about)
    for title, miou, accurate in PUBLISHED.get(protocol, ()) if result["labels"] else ():
        text += f"\n{title}: mIoU {miou:.4f}, accuracy {accurate:.4f}.\n"
    return text
