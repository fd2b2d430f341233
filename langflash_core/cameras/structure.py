"""From photos and their monocular depth to cameras: key points, poses, lenses, and depth in one unit.

Structure from motion in plain functions: nothing here is learned.
"""

import math

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from langflash_core.base.keeping import MATCHES
from langflash_core.base.running import Run
from langflash_core.cameras.adjustment import Sought
from langflash_core.cameras.alignment import Correction
from langflash_core.cameras.inputs import PoseInput, scale_focal
from langflash_core.cameras.keypoints import KeyPoints, decode_grey, match_photos, match_sources
from langflash_core.cameras.poses import Poses, estimate_poses, on_other_maps
from langflash_core.geometry.cameras import rays
from langflash_core.rig.rig import DepthMaps, Rig
from langflash_core.rig.settings import PAIRING
from langflash_core.types import Views


def find_poses(
    views: Views, Ks: Float[Tensor, "V 3 3"], prior: DepthMaps, local: Float[Tensor, "V C h w"], run: Run
) -> Poses:
    """Poses and lenses of all photos, or that a lens bends lines.

    Args:
        Ks: pixels of the views. prior: of one scene (B = 1). local: descriptors of cells. run: keeps matches,
            and may stop between pairs.

    Raises:
        InputError: the photos do not fit the poses that are given.
    """
    inputs = _pose_inputs(Ks, views.size, prior, local)
    return estimate_poses(
        inputs, _key_points(views, run), run.check, _known_poses(views), _sought_lenses(views)
    )


def is_other_lens(poses: Poses) -> bool:
    """Whether a lens was found to be another than depth was predicted for."""
    return bool(np.abs(np.log(poses.growths)).max() > PAIRING.other_depth)


def rescale_poses(
    poses: Poses, views: Views, Ks: Float[Tensor, "V 3 3"], prior: DepthMaps, local: Float[Tensor, "V C h w"]
) -> Poses:
    """The same poses for other depth of the same photos, and its unit; arguments as `find_poses`."""
    return on_other_maps(poses, _pose_inputs(Ks, views.size, prior, local))


def found_lenses(Ks: Float[Tensor, "V 3 3"], poses: Poses) -> Float[Tensor, "V 3 3"]:
    """Intrinsics of the lenses that were found."""
    if poses.adjusted is None or (poses.growths == 1).all():
        return Ks
    return torch.from_numpy(scale_focal(Ks.cpu().double().numpy(), poses.growths)).to(Ks)


def placed_rig(
    photos: Float[Tensor, "V 3 H W"], Ks: Float[Tensor, "V 3 3"], prior: DepthMaps, poses: Poses
) -> Rig:
    """The photos where they were found, with their depth in view 0's unit, straightened by the matches.

    Args:
        prior: of one scene (B = 1).
    """
    corrected = [
        _correct_depths(own, K, correction) + math.log(scale)
        for own, K, scale, correction in zip(
            prior.log_depths[0].cpu(), Ks.cpu(), poses.depth_scales, poses.corrections, strict=True
        )
    ]
    viewmats = torch.from_numpy(poses.viewmats).to(photos)
    return Rig.of_logs(torch.stack(corrected).to(Ks), viewmats, Ks, prior.log_errors[0], photos)


def grey_photos(views: Views) -> list[UInt8[np.ndarray, "_ _"]]:
    """The largest version of the photos at hand, (h, w) uint8 each."""
    if views.sources:
        return [decode_grey(source) for source in views.sources]
    photos = (views.images.movedim(1, -1).cpu().numpy() * 255).round().astype(np.uint8)  # (V, H, W, 3)
    return [cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY) for rgb in photos]


def _pose_inputs(Ks: Tensor, size: tuple[int, int], prior: DepthMaps, local: Tensor) -> list[PoseInput]:
    own = Ks.cpu().double(), prior.depths[0].cpu(), local.cpu()  # once: each call's own would hold all of it
    return [
        PoseInput(K=K, size=size, depth=depth, local=cells)
        for K, depth, cells in zip(*(values.numpy() for values in own), strict=True)
    ]


def _key_points(views: Views, run: Run) -> KeyPoints:
    """Of the largest version of the photos at hand."""
    if not views.sources:
        return match_photos(grey_photos(views), run.check)
    return KeyPoints.of(run.kept(MATCHES, lambda: match_sources(views.sources, run.check).arrays()))


def _known_poses(views: Views) -> Float[np.ndarray, "V 4 4"] | None:
    """Poses that were given, float64, world = view 0."""
    return None if views.viewmats is None else views.viewmats.double().cpu().numpy()


def _sought_lenses(views: Views) -> Sought | None:
    """Lenses that are not given."""
    if views.lenses is None:
        return None
    return Sought(views.lenses.of, views.lenses.doubts, not views.lenses.straight)


def _correct_depths(log_depths: Tensor, K: Tensor, correction: Correction) -> Tensor:
    """Log depths (H, W) straightened by the matches."""
    height, width = log_depths.shape
    x = rays(K, width, height)[..., :2].numpy()
    change = correction.at(x, log_depths.numpy())
    return log_depths + torch.from_numpy(change).to(log_depths)
