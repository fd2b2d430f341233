"""`langflash lab eval posed`: pairs of real photos whose poses somebody measured.

Two photos some numbers apart make a scene; a third from between them, which the network does not see, is
drawn from its true place. Lengths of a scene are brought to metres by the first photo's depth, or by the
distance between the cameras where there are no depth maps.

Sizes: H W pixels as the network saw the photos.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.alignment import aligned_camera
from langflash_core.lab.evaluation.bench import Bench, as_seen, picture_of, relative
from langflash_core.lab.evaluation.metrics import PoseError, pose_error, pose_measures
from langflash_core.lab.evaluation.sharp_measures import ssim
from langflash_core.lab.evaluation.sights import Look, Sight, error_picture, photo_picture
from langflash_core.lab.evaluation.tables import Measure, Table, by_row, measures_table, rounded
from langflash_core.lab.evaluation.tallies import Noted, judged, merged
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.losses import ssim_map
from langflash_core.lab.training.measures import depth_measures, nan_mean, psnr
from langflash_core.language.settings import ANSWERING
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Camera, Frame, Scene

APART = (6, 12, 18, 24)
"""Numbers between the photos of a pair, in turn."""
PAIRS = 40
LEFT_OUT = 180.0
"""Degrees of direction for a photo that the program left out: it has no place, so it is wrong."""
MEASURES = (
    ("Rotation error, median (degrees)", "pose_rotation_median", "no motion", "true_rotation_median"),
    ("Direction error, median (degrees)", "pose_direction_median", "", ""),
    ("Rotation error of placed photos, median (degrees)", "rotation_placed_median", "", ""),
    ("Direction error of placed photos, median (degrees)", "direction_placed_median", "", ""),
    ("Right pose (5 / 15 degrees)", "pose_right_share", "", ""),
    ("Pose AUC at 5 degrees", "pose_auc_5", "", ""),
    ("Pose AUC at 10 degrees", "pose_auc_10", "", ""),
    ("Pose AUC at 20 degrees", "pose_auc_20", "", ""),
    ("Second photo found its place", "placed", "", ""),
    ("Depth AbsRel, each photo's scale aligned", "depth_abs_rel", "one depth", "depth_abs_rel_flat"),
    ("Depth AbsRel, median photo", "depth_abs_rel_median", "", ""),
    ("Depth delta < 1.25", "depth_delta1", "", ""),
    ("PSNR of the photo between, covered pixels (dB)", "psnr", "first photo", "psnr_first_photo"),
    ("PSNR of the photo between, median pair (dB)", "psnr_median", "mean colour", "psnr_mean_colour"),
    ("... from the pose fitted to it, pixels covered from there (dB)", "psnr_aligned", "", ""),
    ("SSIM of the photo between, covered pixels", "ssim", "", ""),
    ("PSNR of the photo between, whole picture (dB)", "psnr_whole_picture", "", ""),
    ("... from the pose fitted to it (dB), whole picture", "psnr_whole_picture_aligned", "", ""),
    ("LPIPS of the photo between (VGG), whole picture", "lpips_whole_picture", "", ""),
    ("... from the pose fitted to it", "lpips_whole_picture_aligned", "", ""),
    ("SSIM of the photo between, whole picture, Gaussian window", "ssim_whole_picture", "", ""),
    ("Share of the photo between that is covered", "covered", "", ""),
    ("Reconstruction, seconds a pair", "seconds", "", ""),
)  # fmt: skip
BY_GAP = ("pairs", "placed", "true_rotation_median", "pose_rotation_median", "pose_direction_median",
          "pose_right_share", "depth_abs_rel", "psnr")  # fmt: skip


@dataclass(frozen=True)
class Triple:
    """Ids of the first photo, of one from between, and of the second; how many numbers apart."""

    first: str
    between: str
    second: str
    apart: int

    @property
    def name(self) -> str:
        return f"{self.first}-{self.second}"


@dataclass
class Tally(Noted):
    """Numbers per pair, by name, and the error of each pose."""

    poses: list[PoseError] = field(default_factory=list)


def chosen_triples(ids: Sequence[str], count: int = PAIRS, apart: Sequence[int] = APART) -> list[Triple]:
    """About `count` pairs, starting evenly over the folder, with a photo half-way between.

    Raises:
        InputError: no two photos are so far apart with one between.
    """
    by_number = {int(id): id for id in ids if id.isdigit()}
    found = []
    for gap in apart:
        every = [
            Triple(id, by_number[number + gap // 2], by_number[number + gap], gap)
            for number, id in sorted(by_number.items())
            if number + gap in by_number and number + gap // 2 in by_number
        ]
        wanted = min(len(every), -(-count // len(apart)))
        found += [every[(2 * k + 1) * len(every) // (2 * wanted)] for k in range(wanted)]
    if not found:
        numbers = ", ".join(str(gap) for gap in apart)
        raise InputError(
            f"no two photos are {numbers} numbers apart with one half-way between; choose another --apart"
        )
    return sorted(found, key=lambda triple: (int(triple.first), triple.apart))[:count]


def run_posed(
    folder: PhotoFolder,
    triples: Sequence[Triple],
    bench: Bench,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge a checkpoint on pairs of a posed folder.

    Returns:
        Plain JSON: "measures" over all pairs, "by_gap" the medians and means for each distance in number.

    Raises:
        InputError: the folder lacks a pose. WeightsError: the checkpoint does not fit.
    """
    cases = ((triple.name, triple) for triple in triples)
    tallies = judged(
        cases, lambda triple, _: judge(folder, triple, bench), count=len(triples), progress=progress
    )
    by_gap: dict[int, list[Tally]] = {}
    for triple in triples:
        by_gap.setdefault(triple.apart, []).append(tallies[triple.name])
    return {
        "weights": bench.made_with,
        "folder": folder.root.name,
        "pairs": len(triples),
        "measures": summary(merged(list(tallies.values()))),
        "by_gap": {str(gap): summary(merged(several)) for gap, several in sorted(by_gap.items())},
    }


@torch.no_grad()
def judge(folder: PhotoFolder, triple: Triple, bench: Bench, look: Look | None = None) -> Tally:
    """Pose, depth and the photo from between of one pair."""
    tally, render = Tally(), bench.render
    first, between, second = (folder.photo(id) for id in (triple.first, triple.between, triple.second))
    to_second, to_between = relative(first, second), relative(first, between)
    scene, seconds = bench.scene_of((first, second))
    placed = scene.num_views == 2
    predicted = scene.viewmats[1].cpu() if placed else torch.eye(4)
    error = pose_error(predicted, to_second.float())
    tally.poses.append(error if placed else PoseError(error.rotation, LEFT_OUT))
    if placed:
        tally.note(rotation_placed=error.rotation, direction_placed=error.direction)
    tally.note(
        seconds=seconds,
        placed=float(placed),
        true_rotation=pose_error(torch.eye(4), to_second.float()).rotation,
    )
    truths = [as_seen(photo, scene.view_size) for photo in (first, second)[: scene.num_views]]
    frames = [render(scene, scene.camera(view)) for view in range(len(truths))]
    scale = judge_depth(frames, truths, tally)
    if math.isnan(scale) and placed:
        scale = float(to_second[:3, 3].norm() / predicted[:3, 3].norm().clamp_min(1e-9))
    if math.isnan(scale):
        return tally
    target = as_seen(between, scene.view_size)
    frame = judge_view(scene, to_between, scale, target, truths[0], bench, tally)
    if look is not None:
        look(_sight(triple, truths[0], target, frame, tally))
    return tally


def _sight(triple: Triple, first: FittedPhoto, target: FittedPhoto, frame: Frame, tally: Tally) -> Sight:
    """The pair for people, with the numbers that its tally ended with."""
    start, truth = map(picture_of, (first, target))
    pictures = {
        "first photo": photo_picture(start),
        "photo between": photo_picture(truth),
        "drawn": photo_picture(frame.rgb),
        "error": error_picture(frame.rgb, truth, (frame.alphas >= ANSWERING.covered_alpha).numpy()),
    }
    known = {name: values[-1] for name, values in tally.numbers.items()}
    numbers = {name: known[name] for name in ("psnr", "covered", "depth_abs_rel") if name in known}
    numbers["rotation error"] = tally.poses[-1].rotation
    name = f"photos {triple.first} and {triple.second}"
    return Sight(triple.name, name, pictures, numbers, numbers.get("psnr", 0.0))


def judge_depth(frames: Sequence[Frame], truths: Sequence[FittedPhoto], tally: Tally) -> float:
    """Drawn depth of every photo, each with its own scale; returns metres per scene unit by the first
    (NaN: not known)."""
    scale = math.nan
    for view, (frame, truth) in enumerate(zip(frames, truths, strict=True)):
        depths = torch.where(frame.alphas >= ANSWERING.covered_alpha, truth.depths, 0.0)
        valid = (depths > 0) & (frame.depths > 0)
        if not bool(valid.any()):
            continue
        if view == 0:
            scale = float((depths[valid] / frame.depths[valid]).median())
        tally.note(**depth_measures(frame.depths, depths))
    return scale


def judge_view(
    scene: Scene,
    viewmat: Tensor,
    scale: float,
    photo: FittedPhoto,
    first: FittedPhoto,
    bench: Bench,
    tally: Tally,
) -> Frame:
    """The scene from where a photo was taken that it was not made of: pixels that the scene covers, and all
    of them; with `bench.align` also from the pose that fits the photo best, as papers without poses judge.

    Args:
        viewmat: (4, 4), world = the first photo's camera. scale: its lengths per scene unit.
    """
    placed = viewmat.float().clone()
    placed[:3, 3] /= scale
    camera = Camera(placed, photo.K, *scene.view_size)
    truth, start = map(picture_of, (photo, first))
    frame = bench.render(scene, camera)
    _judge_picture(frame, truth, "", bench, tally)
    tally.note(ssim_whole_picture=ssim(frame.rgb, truth))
    shown = frame.alphas >= ANSWERING.covered_alpha
    tally.note(covered=float(shown.float().mean()))
    if bool(shown.any()):
        flat = truth[shown].mean(0).expand_as(truth)
        tally.note(
            ssim=float(ssim_map(frame.rgb.clamp(0, 1), truth)[shown].mean()),
            psnr_first_photo=psnr(start[shown], truth[shown]),
            psnr_mean_colour=psnr(flat[shown], truth[shown]),
        )
    if bench.align:
        plain = bare_scene(scene.gaussians, "colours")  # no weight maps are drawn
        fitted = aligned_camera(lambda at: bench.render(plain, at), camera, truth)
        _judge_picture(bench.render(plain, fitted), truth, "_aligned", bench, tally)
    return frame


def _judge_picture(frame: Frame, truth: Tensor, end: str, bench: Bench, tally: Tally) -> None:
    """PSNR of what is covered and of all, and LPIPS; names end so."""
    shown = frame.alphas >= ANSWERING.covered_alpha
    tally.note(**{f"psnr_whole_picture{end}": psnr(frame.rgb, truth)})
    if bool(shown.any()):
        tally.note(**{f"psnr{end}": psnr(frame.rgb[shown], truth[shown])})
    if bench.lpips is not None:
        tally.note(**{f"lpips_whole_picture{end}": bench.lpips.whole(frame.rgb.cpu()[None], truth[None])[0]})


def summary(tally: Tally) -> dict[str, float | None]:
    """Means, medians and shares, rounded."""
    medians = ("depth_abs_rel", "psnr", "true_rotation", "rotation_placed", "direction_placed")
    measures = {
        **tally.means(),
        **{f"{name}_median": tally.median(name) for name in medians if name in tally.numbers},
        **pose_measures(tally.poses),
        "pose_right_share": nan_mean(float(error.right()) for error in tally.poses),
        "pairs": float(len(tally.poses)),
    }
    return rounded(dict(sorted(measures.items())))


def tables(result: dict) -> list[Table]:
    """All pairs, and by how many numbers they are apart."""
    measures = [Measure(key.replace("_", " "), key) for key in BY_GAP]
    return [
        measures_table("", MEASURES, result["measures"]),
        by_row("", "numbers apart", result["by_gap"], measures),
    ]
