"""How a scene of a walk looks from aside: at photos of the same place that it was not made of.

Frames between photos say nothing of it. Here every other photo of the folder is a kept frame, and of each
pixel it is known from where the scene's photos saw that surface: the angle, at the surface, between the kept
photo's place and the nearest one of a photo that sees it, by measured depth. Pixels are judged in `BINS` of
these angles, with gaps filled and in the light of the place, as the window shows them, from the pose that
fits the photo best.

Sizes: H W pixels of the network's grid.
"""

import math
from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.lab.evaluation.alignment import aligned_camera
from langflash_core.lab.evaluation.posed import as_seen
from langflash_core.lab.evaluation.walk_measures import lit
from langflash_core.lab.evaluation.walk_scenes import Bench, Made, true_cameras, with_lens
from langflash_core.lab.evaluation.walk_subjects import Walk
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.measures import abs_rel, psnr
from langflash_core.language.settings import ANSWERING
from langflash_core.rig.projected import project_points
from langflash_core.scene.gaps import filled
from langflash_core.types import Camera

BINS = ((0, 7), (7, 15), (15, 30), (30, 60))
"""Degrees."""
SAME = 0.06  # relative difference of measured depths that show one surface
LEAST_SEEN, LEAST_PIXELS = 0.2, 0.03
"""Shares of a kept photo: what of it the scene's photos see, and what of it lies in a bin, at the least."""
BRIGHT = 0.25  # sRGB, by which a pixel is brighter than the photo that everybody sees it
_NEAR = 1e-3  # metres


@torch.no_grad()
def aside(made: Made, walk: Walk, bench: Bench) -> dict[str, float]:
    """Means over kept photos, by how much of each lies in a bin: "aside_LOW_" and PSNR (dB), in the photo's
    light as well, depth AbsRel, and the share that is too bright; nothing of bins that no photo fills."""
    size = made.scene.view_size
    seen = [(as_seen(photo, size), pose) for photo, pose in _posed(made.placed)]
    sums: dict[int, list[tuple[float, dict[str, float]]]] = {}
    for photo, pose in _posed(list(walk.others())):
        target = as_seen(photo, size)
        angles = nearest_angles((target, pose), seen)
        if float(torch.isfinite(angles).float().mean()) >= LEAST_SEEN:
            for low, share, numbers in _judged(made, with_lens(made.lens, target), pose, angles, bench):
                sums.setdefault(low, []).append((share, numbers))
    found = {}
    for low, rows in sorted(sums.items()):
        for key in rows[0][1]:
            known = [(share, row[key]) for share, row in rows if not math.isnan(row[key])]
            total = sum(share for share, _ in known)
            mean = sum(share * value for share, value in known) / total if known else math.nan
            found[f"aside_{low}_{key}"] = mean
        found[f"aside_{low}_photos"] = float(len(rows))
    return found


def _posed(photos: Sequence[LabelledPhoto]) -> list[tuple[LabelledPhoto, np.ndarray]]:
    """With world to camera (4, 4)."""
    return list(zip(photos, true_cameras(photos), strict=True))


def nearest_angles(
    target: tuple[FittedPhoto, Float[np.ndarray, "4 4"]],
    photos: Sequence[tuple[FittedPhoto, Float[np.ndarray, "4 4"]]],
) -> Float[torch.Tensor, "H W"]:
    """Degrees (H, W) at each pixel's surface between this camera and the nearest of a photo that sees it;
    endless where none does, or no depth is measured. Cameras are world to camera."""
    photo, viewmat = target
    depths = photo.depths.double()
    pose = invert_rigid(torch.from_numpy(viewmat))
    points = unproject(depths, photo.K.double()).flatten(0, 1) @ pose[:3, :3].T + pose[:3, 3]
    height, width = depths.shape
    known, nearest = depths.flatten() > 0, torch.full((height * width,), math.inf, dtype=torch.float64)
    here = torch.nn.functional.normalize(pose[:3, 3] - points, dim=-1)
    for other, other_viewmat in photos:
        camera = torch.from_numpy(other_viewmat)
        high, wide = other.depths.shape
        projected = project_points(points.T, camera, other.K.double(), (high, wide))
        own = projected.looked_up(other.depths.double().flatten())
        inside = known & projected.inside & (projected.z > _NEAR)
        sees = inside & (own > 0) & ((projected.z / own.clamp_min(_NEAR) - 1).abs() < SAME)
        there = torch.nn.functional.normalize(invert_rigid(camera)[:3, 3] - points, dim=-1)
        angles = (here * there).sum(-1).clamp(-1, 1).arccos().rad2deg()
        nearest = torch.where(sees, torch.minimum(nearest, angles), nearest)
    return nearest.view(height, width)


def _judged(
    made: Made, photo: FittedPhoto, viewmat: np.ndarray, angles: torch.Tensor, bench: Bench
) -> list[tuple[int, float, dict[str, float]]]:
    """Lower end of each bin that the photo fills, its share of the photo, and numbers."""
    scene, truth = made.scene, photo.rgb.permute(1, 2, 0).float() / 255
    start = Camera(torch.from_numpy(made.fit.viewmat(viewmat)).float(), photo.K, *scene.view_size)
    camera = aligned_camera(lambda at: bench.render(scene, at), start, truth)
    frame = bench.render(scene, camera)
    covered = frame.alphas.cpu() >= ANSWERING.covered_alpha
    rgb = filled(frame.rgb.cpu().float(), frame.alphas.cpu().float()).clamp(0, 1)
    drawn = frame.depths.cpu().float() * made.fit.scale
    rows = []
    for low, high in BINS:
        some = (angles >= low) & (angles < high)
        share = float(some.float().mean())
        if share < LEAST_PIXELS:
            continue
        rgb_some, truth_some = rgb[some], truth[some]
        numbers = {
            "psnr": psnr(rgb_some, truth_some),
            "psnr_lit": psnr(lit(rgb_some, truth_some), truth_some),
            "depth": abs_rel(drawn, torch.where(some & covered, photo.depths, 0.0)),
            "bright": float(((rgb_some - truth_some).amax(-1) > BRIGHT).float().mean()),
        }
        rows.append((low, share, numbers))
    return rows
