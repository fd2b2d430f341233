"""`langflash lab eval posed`: pairs of real photos whose poses somebody measured.

Two photos some numbers apart make a scene; a third from between them, which the network does not see, is
drawn from its true place. Lengths of a scene are brought to metres by the first photo's depth, or by the
distance between the cameras where there are no depth maps.

Sizes: H W pixels as the network saw the photos.
"""

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import torch
from PIL import Image
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.images.lens import Intrinsics
from langflash_core.images.pictures import centre_box
from langflash_core.lab.evaluation.alignment import aligned_camera
from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.metrics import POSE_LIMITS, PoseError, pose_auc, pose_error
from langflash_core.lab.evaluation.numbers import rounded
from langflash_core.lab.evaluation.pictures import ssim
from langflash_core.lab.evaluation.sights import Look, Sight, error_picture, photo_picture
from langflash_core.lab.evaluation.tallies import Shelf, collected, merged
from langflash_core.lab.photos import LabelledPhoto, PhotoFolder
from langflash_core.lab.photos.fitting import FittedPhoto, fitted
from langflash_core.lab.photos.folder import lenses_of
from langflash_core.lab.training.losses import ssim_map
from langflash_core.lab.training.measures import abs_rel, align_scale, delta1, nan_mean, psnr
from langflash_core.language.settings import ANSWERING
from langflash_core.pipeline import reconstruct
from langflash_core.reconstruction.networks import Networks
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Camera, Frame, Scene

APART = (6, 12, 18, 24)
"""Numbers between the photos of a pair, in turn."""
PAIRS = 40
LEFT_OUT = 180.0
"""Degrees of direction for a photo that the program left out: it has no place, so it is wrong."""


@dataclass(frozen=True)
class Triple:
    """Ids of the first photo, of one from between, and of the second; how many numbers apart."""

    first: str
    between: str
    second: str
    apart: int


@dataclass
class Tally:
    """Numbers per pair, by name, and the error of each pose."""

    numbers: dict[str, list[float]] = field(default_factory=dict)
    poses: list[PoseError] = field(default_factory=list)

    def note(self, **values: float) -> None:
        for name, value in values.items():
            self.numbers.setdefault(name, []).append(float(value))


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
    render: Render,
    weights: Path | None = None,
    *,
    preset: str = "mini",
    size: int | None = None,
    lpips: Lpips | None = None,
    align: bool = False,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge a checkpoint on pairs of a posed folder.

    Args:
        render: draws a scene. size: as `reconstruct` has it. align: also from fitted poses.

    Returns:
        Plain JSON: "measures" over all pairs, "by_gap" the medians and means for each distance in number.

    Raises:
        InputError: the folder lacks a pose. WeightsError: the checkpoint does not fit.
    """
    by_gap: dict[int, list[Tally]] = {}
    tallies = pair_tallies(
        folder, triples, render, weights, preset=preset, size=size, lpips=lpips, align=align
    )
    for done, (triple, (name, tally)) in enumerate(zip(triples, tallies, strict=True), start=1):
        progress(f"pair {name}", done / len(triples))
        by_gap.setdefault(triple.apart, []).append(tally)
    return {
        "weights": str(weights) if weights else preset,
        "folder": folder.root.name,
        "pairs": len(triples),
        "measures": summary(merged([tally for several in by_gap.values() for tally in several])),
        "by_gap": {str(gap): summary(merged(several)) for gap, several in sorted(by_gap.items())},
    }


def pair_tallies(
    folder: PhotoFolder,
    triples: Sequence[Triple],
    render: Render,
    weights: Path | None = None,
    *,
    preset: str = "mini",
    size: int | None = None,
    lpips: Lpips | None = None,
    align: bool = False,
    shelf: Shelf | None = None,
    look: Look | None = None,
) -> Iterator[tuple[str, Tally]]:
    """Name and tally of every pair, in order; those on the shelf are not judged again."""
    networks = Networks()

    def judge(triple: Triple) -> Tally:
        tally = Tally()
        options = {"weights": weights, "preset": preset, "size": size, "lpips": lpips, "align": align}
        judge_triple(folder, triple, render, tally, **options, look=look, networks=networks)
        return tally

    return collected(((key_of(t), t) for t in triples), judge, shelf)


@torch.no_grad()
def judge_triple(
    folder: PhotoFolder,
    triple: Triple,
    render: Render,
    tally: Tally,
    *,
    weights: Path | None = None,
    preset: str = "mini",
    size: int | None = None,
    lpips: Lpips | None = None,
    align: bool = False,
    look: Look | None = None,
    networks: Networks | None = None,
) -> None:
    """Pose, depth and the photo from between of one pair; adds to `tally`."""
    first, between, second = (folder.photo(id) for id in (triple.first, triple.between, triple.second))
    to_second, to_between = relative(first, second), relative(first, between)
    scene, seconds = scene_of(
        (first, second),
        lenses_of((first, second)),
        weights=weights,
        preset=preset,
        size=size,
        networks=networks,
    )
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
        return
    target = as_seen(between, scene.view_size)
    camera = moved_camera(to_between, scale, target, scene.view_size)
    frame = render(scene, camera)
    judge_picture(frame, target, tally, truths[0], lpips)
    if align:
        judge_aligned(scene, render, camera, target, tally, lpips)
    if look is not None:
        look(_sight(triple, truths[0], target, frame, tally))


def _sight(triple: Triple, first: FittedPhoto, target: FittedPhoto, frame: Frame, tally: Tally) -> Sight:
    """The pair for people, with the numbers that its tally ended with."""
    start, truth = (p.rgb.permute(1, 2, 0).float() / 255 for p in (first, target))
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
    return Sight(key_of(triple), name, pictures, numbers, numbers.get("psnr", 0.0))


def key_of(triple: Triple) -> str:
    """What a pair's tally is kept as."""
    return f"{triple.first}-{triple.second}"


def pose_of(photo: LabelledPhoto) -> Tensor:
    """Camera to world (4, 4) float64.

    Raises:
        InputError: the photo has none.
    """
    if photo.pose is None:
        raise InputError(
            f"photo {photo.id} has no line in poses.txt; add it, or take the photo out of the folder"
        )
    return photo.pose.double()


def relative(first: LabelledPhoto, other: LabelledPhoto) -> Tensor:
    """World-to-camera matrix (4, 4) float64 of a photo, world = the first one's camera."""
    return torch.linalg.inv(pose_of(other)) @ pose_of(first)


def scene_of(
    photos: Sequence[LabelledPhoto],
    intrinsics: Intrinsics | Sequence[Intrinsics] | None,
    *,
    weights: Path | None = None,
    preset: str = "mini",
    size: int | None = None,
    networks: Networks | None = None,
) -> tuple[Scene, float]:
    """Photos through the whole program, and the seconds that took. intrinsics and what follows: as
    `reconstruct` has them."""
    with files_of(photos) as paths:
        start = time.perf_counter()
        scene = reconstruct(
            paths, preset=preset, weights=weights, intrinsics=intrinsics, size=size, networks=networks
        )
        return scene, time.perf_counter() - start


@contextmanager
def files_of(photos: Sequence[LabelledPhoto]) -> Iterator[list[Path]]:
    """The photos as files of one folder, which goes."""
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{photo.id}.png" for photo in photos]
        for path, photo in zip(paths, photos, strict=True):
            Image.fromarray(photo.image).save(path, "PNG", compress_level=1)
        yield paths


def as_seen(photo: LabelledPhoto, size: tuple[int, int]) -> FittedPhoto:
    """A photo as those of a scene were cut, whose `view_size` is given."""
    height, width = photo.image.shape[:2]
    return fitted(photo, size, centre_box(width, height, size))


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
        aligned = align_scale(frame.depths, depths)
        tally.note(
            depth_abs_rel=abs_rel(aligned, depths),
            depth_delta1=delta1(aligned, depths),
            depth_abs_rel_flat=abs_rel(align_scale(torch.ones_like(depths), depths), depths),
        )
    return scale


def moved_camera(viewmat: Tensor, scale: float, photo: FittedPhoto, size: tuple[int, int]) -> Camera:
    """The camera of a photo in the scene's units, of which one is `scale` of the pose's."""
    moved = viewmat.float().clone()
    moved[:3, 3] /= scale
    return Camera(moved, photo.K, *size)


def judge_aligned(
    scene: Scene, render: Render, camera: Camera, photo: FittedPhoto, tally: Tally, lpips: Lpips | None = None
) -> None:
    """The same picture from the pose that fits the photo best, as papers without poses judge; the numbers
    say "aligned"."""
    truth = photo.rgb.permute(1, 2, 0).float() / 255
    plain = bare_scene(scene.gaussians, "colours")  # no weight maps are drawn
    frame = render(plain, aligned_camera(lambda at: render(plain, at), camera, truth))
    shown = frame.alphas >= ANSWERING.covered_alpha
    tally.note(psnr_whole_picture_aligned=psnr(frame.rgb, truth))
    if bool(shown.any()):
        tally.note(psnr_aligned=psnr(frame.rgb[shown], truth[shown]))
    if lpips is not None:
        tally.note(lpips_whole_picture_aligned=lpips.whole(frame.rgb.cpu()[None], truth[None])[0])


def judge_picture(
    frame: Frame, photo: FittedPhoto, tally: Tally, first: FittedPhoto, lpips: Lpips | None = None
) -> None:
    """The scene from where a photo was taken that it was not made of; pixels that the scene covers, and all
    of them."""
    truth, start = (p.rgb.permute(1, 2, 0).float() / 255 for p in (photo, first))
    shown = frame.alphas >= ANSWERING.covered_alpha
    tally.note(
        covered=float(shown.float().mean()),
        psnr_whole_picture=psnr(frame.rgb, truth),
        ssim_whole_picture=ssim(frame.rgb, truth),
    )
    if lpips is not None:
        tally.note(lpips_whole_picture=lpips.whole(frame.rgb.cpu()[None], truth[None])[0])
    if bool(shown.any()):
        flat = truth[shown].mean(0).expand_as(truth)
        tally.note(
            psnr=psnr(frame.rgb[shown], truth[shown]),
            ssim=float(ssim_map(frame.rgb.clamp(0, 1), truth)[shown].mean()),
            psnr_first_photo=psnr(start[shown], truth[shown]),
            psnr_mean_colour=psnr(flat[shown], truth[shown]),
        )


def summary(tally: Tally) -> dict[str, float | None]:
    """Means, medians and shares, rounded."""
    measures = {name: nan_mean(values) for name, values in tally.numbers.items()}
    for name in ("depth_abs_rel", "psnr", "true_rotation", "rotation_placed", "direction_placed"):
        if name in tally.numbers:
            measures[f"{name}_median"] = float(torch.tensor(tally.numbers[name]).nanmedian())
    measures |= {
        "pose_rotation_median": float(torch.tensor([e.rotation for e in tally.poses]).nanmedian()),
        "pose_direction_median": float(torch.tensor([e.direction for e in tally.poses]).nanmedian()),
        "pose_right_share": nan_mean(float(error.right()) for error in tally.poses),
        "pairs": float(len(tally.poses)),
    }
    areas = pose_auc([error.worst for error in tally.poses])
    measures |= {f"pose_auc_{limit:g}": area for limit, area in zip(POSE_LIMITS, areas, strict=True)}
    return rounded(dict(sorted(measures.items())))
