"""Measures of poses, points and presence; those of depth and classes are in
`training.measures`, of segments in `segments`, of pictures in `sharp_measures`. Every measure is NaN where
nothing can be measured."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import torch
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, rotation_angle_degrees, transform, unproject


@dataclass(frozen=True)
class PoseError:
    """Degrees: rotation, and direction of the translation (0 to 180; NaN for a still camera)."""

    rotation: float
    direction: float

    @property
    def worst(self) -> float:
        """The larger of both; rotation alone for a still camera."""
        return self.rotation if math.isnan(self.direction) else max(self.rotation, self.direction)

    def right(self, rotation: float = 5.0, direction: float = 15.0) -> bool:
        """Both errors within limits; a still camera is judged by its rotation alone."""
        near = math.isnan(self.direction) or self.direction <= direction
        return self.rotation <= rotation and near


def pose_error(predicted: Tensor, truth: Tensor) -> PoseError:
    """Between two world-to-camera matrices (4, 4) of one world; lengths do not matter."""
    rotation = float(rotation_angle_degrees(predicted[:3, :3].double(), truth[:3, :3].double()))
    left, right = (-(m[:3, :3].double().T @ m[:3, 3].double()) for m in (predicted, truth))
    if float(left.norm()) < 1e-9 or float(right.norm()) < 1e-9:
        return PoseError(rotation, math.nan)
    sine = torch.linalg.cross(left, right).norm()
    return PoseError(rotation, float(torch.rad2deg(torch.atan2(sine, left @ right))))


POSE_LIMITS = (5.0, 10.0, 20.0)
"""Degrees, as papers on relative pose report the area under the curve."""


def pose_auc(errors: Sequence[float], limits: Sequence[float] = POSE_LIMITS) -> list[float]:
    """Area under the share of poses within a limit, up to each limit, as a share of it; in [0, 1].

    The curve of N sorted errors goes from (0, 0) through (e_n, n / N) and stays level after the last
    one within the limit.

    Args:
        errors: degrees, one per pair; NaN and infinity count as never right.

    Source: Sarlin et al., SuperGlue, CVPR 2020, whose curve most papers use.
    """
    count = len(errors)
    if not count:
        return [math.nan] * len(limits)
    known = sorted(e for e in errors if math.isfinite(e))
    areas = []
    for limit in limits:
        within = [e for e in known if e < limit]
        across = [0.0, *within, limit]
        up = [0.0, *((n + 1) / count for n in range(len(within))), len(within) / count]
        steps = zip(across, across[1:], up, up[1:], strict=False)
        areas.append(sum((right - left) * (low + high) / 2 for left, right, low, high in steps) / limit)
    return areas


def pose_measures(errors: Sequence[PoseError]) -> dict[str, float]:
    """Medians and areas under the curve of a run."""
    rotations, directions = torch.tensor([(e.rotation, e.direction) for e in errors]).reshape(-1, 2).T
    areas = zip(POSE_LIMITS, pose_auc([error.worst for error in errors]), strict=True)
    return {
        "pose_rotation_median": float(rotations.nanmedian()),
        "pose_direction_median": float(directions.nanmedian()),
        **{f"pose_auc_{limit:g}": area for limit, area in areas},
    }


def point_error(points: Tensor, depths: Tensor, K: Tensor, viewmat: Tensor, scale: float) -> float:
    """Mean |X - X*| / |X*| of one view's points in the first camera's frame.

    Args:
        points: (H, W, 3) predicted, world = first camera. depths: (H, W) true z, 0 unknown.
        K, viewmat: true camera of this view. scale: true lengths per predicted length, from view 0.
    """
    valid = depths > 0
    if not bool(valid.any()):
        return math.nan
    truth = transform(invert_rigid(viewmat), unproject(depths, K).flatten(0, 1)).unflatten(0, depths.shape)
    error = (points * scale - truth).norm(dim=-1)[valid] / truth.norm(dim=-1)[valid].clamp_min(1e-6)
    return float(error.mean())


@dataclass(frozen=True)
class Presence:
    """Counts of "found" against the truth."""

    hits: int = 0
    false_alarms: int = 0
    misses: int = 0
    rejections: int = 0

    @staticmethod
    def of(found: Sequence[bool], there: Sequence[bool]) -> "Presence":
        """Of phrases, in order."""
        pairs = list(zip(found, there, strict=True))
        return Presence(*map(pairs.count, ((True, True), (True, False), (False, True), (False, False))))

    def __add__(self, other: "Presence") -> "Presence":
        return Presence(*(own + more for own, more in zip(astuple(self), astuple(other), strict=True)))

    @property
    def precision(self) -> float:
        found = self.hits + self.false_alarms
        return self.hits / found if found else math.nan

    @property
    def recall(self) -> float:
        present = self.hits + self.misses
        return self.hits / present if present else math.nan

    @property
    def f1(self) -> float:
        total = 2 * self.hits + self.false_alarms + self.misses
        return 2 * self.hits / total if total else math.nan


def presence(scores: Tensor, present: Tensor, threshold: float) -> Presence:
    """Phrases with score >= threshold count as found; scores (P,), present (P,) bool."""
    return Presence.of((scores >= threshold).tolist(), present.tolist())


def presence_measures(counts: Presence, scores: Tensor, truths: Tensor) -> dict[str, float]:
    """What a run says of phrases that it asked: found or not, and what scores are worth, (P,) each."""
    return {
        "presence_precision": counts.precision,
        "presence_recall": counts.recall,
        "presence_f1": counts.f1,
        "calibration_error": calibration_error(scores, truths),
    }


def mask_iou(found: Tensor, truth: Tensor) -> float:
    """Intersection over union of two bool masks of one shape; 0 where both are empty."""
    union = float((found | truth).sum())
    return float((found & truth).sum()) / union if union else 0.0


def calibration_error(scores: Tensor, truths: Tensor, bins: int = 20) -> float:
    """Expected calibration error: |mean score - share present| of equally wide bins, weighted by phrases.

    In [0, 1]; NaN of nothing. Scores (P,) in [0, 1] are read as probabilities, which relevancy is not
    unless this says so.

    Source: Naeini, Cooper, Hauskrecht, AAAI 2015; as torchmetrics' `BinaryCalibrationError(norm="l1")`.
    """
    if not len(scores):
        return math.nan
    places = (scores.double() * bins).floor().long().clamp(0, bins - 1)
    gaps = torch.zeros(bins, dtype=torch.float64)
    gaps.index_add_(0, places, scores.double() - truths.double())
    return float(gaps.abs().sum() / len(scores))
