"""Depth, pose and points of a room, with their trivial rivals."""

import torch
from torch import Tensor

from langflash_core.geometry.cameras import unproject
from langflash_core.lab.evaluation.metrics import point_error, pose_error
from langflash_core.lab.evaluation.rooms.tally import Setting, Tally
from langflash_core.lab.evaluation.rooms.truth import relative, views_of
from langflash_core.lab.rooms.cameras import overlap_fraction
from langflash_core.lab.training.measures import abs_rel, align_scale, delta1
from langflash_core.lab.training.shards import RoomRecord
from langflash_core.types import Prediction


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
    error = pose_error(prediction.viewmats[1], relative(record, 1))
    pair = record.viewmats[[0, 1]].double().numpy(), record.Ks[[0, 1]].double().numpy()
    tally.poses.append((error, overlap_fraction(truth[:2].numpy(), *pair)))
    height, width = truth.shape[-2:]
    points = prediction.gaussians.means.reshape(-1, height, width, 3)[1]
    tally.note(points_view_1=point_error(points, truth[1], record.Ks[1], relative(record, 1), scale))
    identity = _true_depth_identity_pose(record)
    tally.note(points_view_1_true_depth_identity_pose=identity)


def _constant_error(setting: Setting, truth: Tensor) -> float:
    return abs_rel(align_scale(torch.full_like(truth, setting.median_depth), truth), truth)


def _true_depth_identity_pose(record: RoomRecord) -> float:
    depths = record.depths[1].float()
    return point_error(unproject(depths, record.Ks[1]), depths, record.Ks[1], relative(record, 1), 1.0)
