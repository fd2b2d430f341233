"""Judging the cases of a protocol: the whole program on a few photos, and views of known truth.

Labels are judged on the drawn atoms and, beside them, on the language features of each picture alone, as a
rival that needs no scene. A view that the network got is a source, one that was kept back a target.

Sizes: H W pixels as the network saw the photos, L labels.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import posed
from langflash_core.lab.evaluation.consistency import label_consistency
from langflash_core.lab.evaluation.labelled import METHODS, Render, rounded
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.metrics import (
    POSE_LIMITS,
    PoseError,
    Presence,
    calibration_error,
    pose_auc,
    pose_error,
)
from langflash_core.lab.evaluation.posed import (
    LEFT_OUT,
    as_seen,
    judge_aligned,
    judge_depth,
    judge_picture,
    moved_camera,
    relative,
    scene_of,
)
from langflash_core.lab.evaluation.protocols import Case
from langflash_core.lab.evaluation.rooms.tally import MIN_SHARE
from langflash_core.lab.evaluation.rooms.target import language_maps
from langflash_core.lab.evaluation.segments import label_border_f
from langflash_core.lab.evaluation.sights import Look, Sight, error_picture, label_picture, photo_picture
from langflash_core.lab.evaluation.tallies import Shelf, collected, intervals, merged
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.photos.folder import lenses_of
from langflash_core.lab.training.measures import (
    accuracy,
    class_ious,
    confusion,
    nan_mean,
    occurring_mean_iou,
)
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import LanguageSpace, language_space
from langflash_core.network import PRESETS, LangFlashNet, load_network
from langflash_core.pipeline import query
from langflash_core.reconstruction.networks import Networks
from langflash_core.types import Frame, Scene, Views


@dataclass(frozen=True)
class Judge:
    """What every case is judged with. network: a second copy, for features alone; None leaves them out.
    align: targets also from poses fitted to them."""

    render: Render
    space: LanguageSpace
    network: LangFlashNet | None = None
    lpips: Lpips | None = None
    weights: Path | None = None
    preset: str = "mini"
    size: int | None = None
    align: bool = False
    networks: Networks = field(default_factory=Networks, repr=False, compare=False)

    @staticmethod
    def of(
        render: Render,
        weights: Path | None = None,
        *,
        preset: str = "mini",
        size: int | None = None,
        lpips: Lpips | None = None,
        features: bool = True,
        align: bool = False,
    ) -> "Judge":
        """Ready to judge; `features`: also 2D features, for which the network is read a second time.

        Raises:
            WeightsError: the checkpoint does not fit.
        """
        network = load_network(preset, weights) if features else None
        return Judge(
            render, language_space(PRESETS[preset].space), network, lpips, weights, preset, size, align
        )


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
    judge: Judge, cases: Iterable[Case], shelf: Shelf | None = None, look: Look | None = None
) -> Iterator[tuple[str, Tally]]:
    """Scene and tally of every case, in order; those on the shelf are not judged again."""
    scenes: dict[str, str] = {}

    def named() -> Iterator[tuple[str, Case]]:
        for case in cases:
            scenes[case.name] = case.scene
            yield case.name, case

    for name, tally in collected(named(), lambda case: judge_case(judge, case, look), shelf):
        yield scenes[name], tally


@torch.no_grad()
def judge_case(judge: Judge, case: Case, look: Look | None = None) -> Tally:
    """Everything about one case."""
    tally = Tally()
    photos = [case.folder.photo(id) for id in case.photos]
    scene, seconds = scene_of(
        photos,
        lenses_of(photos),
        weights=judge.weights,
        preset=judge.preset,
        size=judge.size,
        networks=judge.networks,
    )
    tally.note(seconds=seconds, placed=float(scene.num_views == len(photos)))
    tally.note(**{f"stage_{name}_seconds": value for name, value in scene.record.cost.timings.items()})
    sources = [as_seen(photo, scene.view_size) for photo in photos[: scene.num_views]]
    frames = [judge.render(scene, scene.camera(view)) for view in range(len(sources))]
    scale = judge_depth(frames, sources, tally)
    poses = [_pose(photos[0], photo) for photo in photos]
    if len(photos) > 1:
        scale = _judge_pose(scene, poses, scale, tally)
    views = [Seen(s, f, p, "source") for s, f, p in zip(sources, frames, poses, strict=False)]
    if not math.isnan(scale):
        views += [_target(judge, case, id, photos[0], scene, scale, tally, sources[0]) for id in case.targets]
    answers = [_judge_labels(judge, case, scene, view, tally) for view in views] if case.labels else []
    if case.labels:
        _ask(judge, case, scene, views[0], tally)
        _judge_consistency(views, answers, tally)
    if look is not None:
        look(_sight(case, views, answers, tally))
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


def _target(
    judge: Judge,
    case: Case,
    id: str,
    first: LabelledPhoto,
    scene: Scene,
    scale: float,
    tally: Tally,
    start: FittedPhoto,
) -> Seen:
    """A view that was kept back, drawn from its true place; its picture is judged."""
    photo = case.folder.photo(id)
    viewmat = relative(first, photo)
    fitted = as_seen(photo, scene.view_size)
    camera = moved_camera(viewmat, scale, fitted, scene.view_size)
    frame = judge.render(scene, camera)
    judge_picture(frame, fitted, tally, start, judge.lpips)
    if judge.align:
        judge_aligned(scene, judge.render, camera, fitted, tally, judge.lpips)
    return Seen(fitted, frame, viewmat, "target")


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
    pairs = list(zip([answer.found for answer in found.answers], there, strict=True))
    tally.presence += Presence(*(pairs.count((f, t)) for t, f in _CELLS))
    tally.scores.append(torch.tensor([answer.score for answer in found.answers]))
    tally.truths.append(torch.tensor(there))


_CELLS = ((True, True), (False, True), (True, False), (False, False))
"""(there, found) of hits, false alarms, misses and rejections."""


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


def _sight(case: Case, views: Sequence[Seen], answers: Sequence[np.ndarray], tally: Tally) -> Sight:
    """The case for people; the last view is a target where there is one."""
    first, last = views[0], views[-1]
    start, photo = (v.photo.rgb.permute(1, 2, 0).float() / 255 for v in (first, last))
    pictures = {
        "first photo": photo_picture(start),
        "another view": photo_picture(photo),
        "drawn": photo_picture(last.frame.rgb),
        "error": error_picture(last.frame.rgb, photo),
    }
    numbers = {name: tally.numbers[name][-1] for name in ("psnr", "depth_abs_rel") if name in tally.numbers}
    if answers:
        truth = _rows(case, last.photo).numpy()
        pictures["labels"] = label_picture(np.where(truth >= 0, answers[-1], -1))
        pictures["true labels"] = label_picture(truth)
        if (truth >= 0).any():
            numbers["labels right"] = float((answers[-1] == truth)[truth >= 0].mean())
    worth = numbers.get("labels right", numbers.get("psnr", math.nan))
    return Sight(case.name, case.name, pictures, numbers, worth)


def summary(tally: Tally) -> dict:
    """Means and tables, rounded; plain JSON. Labels: over all pixels of cases with one list of labels, then
    the mean over lists; "picture_miou" is the mean over pictures."""
    measures = {name: nan_mean(values) for name, values in tally.numbers.items()}
    if tally.poses:
        areas = pose_auc([error.worst for error in tally.poses])
        measures |= {f"pose_auc_{limit:g}": area for limit, area in zip(POSE_LIMITS, areas, strict=True)}
        rotations = torch.tensor([error.rotation for error in tally.poses])
        directions = torch.tensor([error.direction for error in tally.poses])
        measures |= {
            "pose_rotation_median": float(rotations.nanmedian()),
            "pose_direction_median": float(directions.nanmedian()),
        }
    if tally.scores:
        measures |= {
            "presence_precision": tally.presence.precision,
            "presence_recall": tally.presence.recall,
            "presence_f1": tally.presence.f1,
            "calibration_error": calibration_error(torch.cat(tally.scores), torch.cat(tally.truths)),
        }
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
    """Summary of cases, with 95 % intervals that draw scenes, and each scene by itself; plain JSON.

    Raises:
        InputError: there is no case.
    """
    if not tallies:
        raise InputError("no case was judged; give a folder that holds scenes, and a limit above 0")
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
