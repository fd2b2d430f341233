"""`langflash eval walk`: the same place in 2, 4, 8 ... photos, and what every further photo brings.

A scene is made of the photos of a walk (`walk_subjects` says which), and brought into the true world by the
similarity that fits its cameras best (`fitted_cameras`). Then its cameras, its depth in every photo and its
pictures where frames were kept are compared with the truth. Beside each kept frame stands the picture of the
scene that its own two photos make alone, brought into the world by their own two cameras.

Sizes: H W pixels; "small" is the network's grid, "large" the photo's size, at most three times the grid.
"""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.alignment import aligned_camera
from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.numbers import rounded
from langflash_core.lab.evaluation.posed import as_seen
from langflash_core.lab.evaluation.sharp_subjects import size_of
from langflash_core.lab.evaluation.side_measures import Similarity, as_array
from langflash_core.lab.evaluation.sides import covered_depths, number
from langflash_core.lab.evaluation.stretches import placed_views
from langflash_core.lab.evaluation.walk_measures import (
    camera_errors,
    fitted_cameras,
    lens_error,
    lit,
    walked,
)
from langflash_core.lab.evaluation.walk_subjects import Walk
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.measures import abs_rel, align_scale, delta1, nan_mean, psnr
from langflash_core.language.answers import COVERED_ALPHA
from langflash_core.pipeline import reconstruct
from langflash_core.running import Progress
from langflash_core.types import NO_LANGUAGE, Camera, Record, Scene, Semantics

ALONE = "alone_"
"""Begins what the scene of a kept frame's own two photos shows."""
Pictures = dict[str, Tensor]


@dataclass(frozen=True)
class Bench:
    """What scenes are made and judged with.

    render: draws one. weights, preset, size: as `reconstruct` has them. assume_lens: it is told nothing of
    the lens. given_poses: it is told where the photos were taken. alone: kept frames' own two photos stand
    beside. align: also from poses fitted to the pictures. lpips: None leaves it out.
    """

    render: Render
    weights: Path | None = None
    preset: str = "mini"
    size: int | None = None
    assume_lens: bool = False
    given_poses: bool = False
    alone: bool = True
    align: bool = False
    lpips: Lpips | None = None


@dataclass(frozen=True)
class Made:
    """A scene of some frames, without its language. views: which photos were placed, from 0; length: of the
    walk from the first photo to the last, m; seconds on the wall and of the processor."""

    scene: Scene
    photos: tuple[LabelledPhoto, ...]
    views: tuple[int, ...]
    fit: Similarity
    length: float
    seconds: float
    cpu_seconds: float
    memory_mb: float = math.nan

    @property
    def placed(self) -> list[LabelledPhoto]:
        return [self.photos[v] for v in self.views]


def run_walks(
    walks: Iterable[Walk],
    count: int,
    bench: Bench,
    *,
    progress: Progress = lambda stage, fraction: None,
    shown: Callable[[str, Pictures], None] = lambda name, pictures: None,
) -> dict:
    """Judge the code that makes scenes by walks.

    Args:
        count: of the walks. shown: is given pictures of kept frames, by title.

    Returns:
        Plain JSON: "cases" with the numbers of each walk, "by_photos" their means.

    Raises:
        InputError: there is no walk. WeightsError: the checkpoint does not fit.
    """
    rows = []
    for done, walk in enumerate(walks):

        def told(stage: str, fraction: float, walk: Walk = walk, done: int = done) -> None:
            progress(f"{walk.name}: {stage}", (done + fraction) / max(count, 1))

        rows.append(judge(walk, bench, told, shown))
    if not rows:
        raise InputError("there is nothing to judge; give furniture or a folder with --posed")
    made_with = str(bench.weights) if bench.weights else bench.preset
    return {"weights": made_with, **summary(rows)}


def judge(
    walk: Walk,
    bench: Bench,
    progress: Progress = lambda stage, fraction: None,
    shown: Callable[[str, Pictures], None] = lambda name, pictures: None,
) -> dict:
    """Numbers of one walk: "photos" by their number, each with what its scene has once and "frames", the kept
    ones."""
    alone: dict[tuple[tuple[int, int], int], dict[str, float]] = {}
    rows = {}
    total = sum(walk.plan.chosen)
    done = 0
    for photos in sorted(walk.plan.chosen):
        progress(f"{photos} photos", done / total)
        frames = walk.plan.between(photos)
        made = make(walk, walk.plan.chosen[photos], bench)
        once = once_of(made, bench.render)
        kept = {str(frame): picture_numbers(made, walk.kept(frame), bench) for frame in frames}
        for frame in frames if bench.alone else ():
            pair = walk.plan.own(photos, frame)
            if (pair, frame) not in alone:
                own = made if photos == 2 else make(walk, pair, bench)
                alone[pair, frame] = _alone(own, walk.kept(frame), bench)
            kept[str(frame)] |= alone[pair, frame]
        rows[str(photos)] = {
            **rounded(once),
            "frames": {name: rounded(values) for name, values in kept.items()},
        }
        done += photos
    return {"name": walk.name, "photos": rows}


def _alone(own: Made, target: LabelledPhoto, bench: Bench) -> dict[str, float]:
    """What the two photos around a kept frame bring without the others."""
    kept = ("depth_abs_rel", "placed", "gaussians", "seconds")
    once = once_of(own, bench.render)
    found = {f"photos_{key}": once[key] for key in kept} | picture_numbers(own, target, bench)
    return {ALONE + key: value for key, value in found.items()}


def make(walk: Walk, frames: Sequence[int], bench: Bench) -> Made:
    """A scene of some frames of a walk.

    Raises:
        InputError: a photo has no pose.
    """
    photos = tuple(walk.photo(frame) for frame in frames)
    truth = true_cameras(photos)
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{photo.id}.png" for photo in photos]
        for path, photo in zip(paths, photos, strict=True):
            Image.fromarray(photo.image).save(path, "PNG", compress_level=1)
        start, cpu = time.perf_counter(), time.process_time()
        scene = reconstruct(
            paths,
            preset=bench.preset,
            weights=bench.weights,
            intrinsics=None if bench.assume_lens else photos[0].intrinsics,
            size=bench.size,
            viewmats=torch.from_numpy(truth).float() if bench.given_poses else None,
        )
        seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu
    placed = placed_views(scene)
    views = tuple(v for v, photo in enumerate(photos) if photo.id in placed)
    found = np.stack([as_array(placed[photos[v].id]) for v in views])
    fit = fitted_cameras(found, truth[list(views)])
    length = walked(np.stack([walk.camera(frame) for frame in range(frames[0], frames[-1] + 1)]))
    made = Made(_wordless(scene), photos, views, fit, length, seconds, cpu_seconds)
    return replace(made, fit=_scaled(made, bench.render)) if len(views) < 2 else made


def true_cameras(photos: Sequence[LabelledPhoto]) -> np.ndarray:
    """World-to-camera matrices (V, 4, 4).

    Raises:
        InputError: one has no pose.
    """
    for photo in photos:
        if photo.pose is None:
            raise InputError(
                f"photo {photo.id} has no line in poses.txt; add it, or take the photo out of the folder"
            )
    return np.stack([np.linalg.inv(as_array(photo.pose)) for photo in photos if photo.pose is not None])


def _wordless(scene: Scene) -> Scene:
    """The scene without language, which costs memory and time to draw."""
    count = len(scene.gaussians)
    nothing = Semantics(
        torch.zeros(count, 0, dtype=torch.int64), torch.zeros(count, 0), torch.zeros(0, 0), NO_LANGUAGE
    )
    return replace(scene, semantics=nothing, record=Record())


def _scaled(made: Made, render: Render) -> Similarity:
    """The fit of a single camera, whose scale the depth of its photo tells where it is known."""
    scene = made.scene
    drawn, truth = (
        covered_depths(render(scene, scene.camera(0))),
        as_array(as_seen(made.placed[0], scene.view_size).depths),
    )
    both = (drawn > 0) & (truth > 0)
    scale = float(np.median(truth[both] / drawn[both])) if both.any() else 1.0
    own = as_array(scene.viewmats[0])
    centre = -own[:3, :3].T @ own[:3, 3]
    rotation = made.fit.rotation
    true_centre = rotation @ centre * made.fit.scale + made.fit.shift
    return Similarity(scale, rotation, true_centre - scale * rotation @ centre)


@torch.no_grad()
def once_of(made: Made, render: Render) -> dict[str, float]:
    """What a scene has once: cameras, lens, depth in its photos, size and cost."""
    scene, placed = made.scene, made.placed
    truth = true_cameras(placed)
    errors = camera_errors(as_array(scene.viewmats), truth, made.fit)
    seen = [as_seen(photo, scene.view_size) for photo in placed]
    depth = [_depth_numbers(scene, view, photo, made.fit, render) for view, photo in enumerate(seen)]
    enough = len(placed) > 1
    return {
        "placed": len(placed) / len(made.photos),
        "places": float(errors.places.mean()) / made.length if enough else math.nan,
        "places_most": float(errors.places.max()) / made.length if enough else math.nan,
        "rotation": float(errors.rotations.mean()) if enough else math.nan,
        "focal": lens_error(list(scene.Ks), [photo.K for photo in seen]),
        **{key: nan_mean(row[key] for row in depth) for key in depth[0]},
        "gaussians": float(len(scene.gaussians)),
        "coarse": float((scene.levels == 0).sum()) if scene.levels is not None else math.nan,
        "seconds": made.seconds,
        "cpu_seconds": made.cpu_seconds,
        "memory_mb": made.memory_mb,
        "length": made.length,
    }


def _depth_numbers(
    scene: Scene, view: int, photo: FittedPhoto, fit: Similarity, render: Render
) -> dict[str, float]:
    """Drawn depth of one photo: by the scene's one scale, and by one of its own."""
    frame = render(scene, scene.camera(view))
    truth = torch.where(frame.alphas.cpu() >= COVERED_ALPHA, photo.depths, 0.0)
    drawn = frame.depths.cpu().float()
    return {
        "depth_abs_rel": abs_rel(drawn * fit.scale, truth),
        "depth_delta1": delta1(drawn * fit.scale, truth),
        "depth_own_scale": abs_rel(align_scale(drawn, truth), truth),
    }


@torch.no_grad()
def picture_numbers(made: Made, target: LabelledPhoto, bench: Bench) -> dict[str, float]:
    """A kept frame, drawn from its place, at both sizes."""
    scene = made.scene
    viewmat = torch.from_numpy(made.fit.viewmat(true_cameras([target])[0])).float()
    numbers: dict[str, float] = {}
    places = {"": viewmat}
    small = as_seen(target, scene.view_size)
    if bench.align:
        camera = Camera(viewmat, small.K, *scene.view_size)
        places["aligned_"] = aligned_camera(lambda at: bench.render(scene, at), camera, _rgb(small)).viewmat
    for size, name in ((scene.view_size, ""), (size_of(target, scene.view_size), "large_")):
        photo = small if name == "" else as_seen(target, size)
        for how, place in places.items():
            found = _alike(scene, Camera(place, photo.K, *size), photo, made.fit, bench)
            numbers |= {name + how + key: value for key, value in found.items()}
    return numbers


def _rgb(photo: FittedPhoto) -> Tensor:
    return photo.rgb.permute(1, 2, 0).float() / 255


def _alike(
    scene: Scene, camera: Camera, photo: FittedPhoto, fit: Similarity, bench: Bench
) -> dict[str, float]:
    """A drawn picture beside the photo: whole, where the scene covers it, and there in the photo's light."""
    frame = bench.render(scene, camera)
    rgb, truth, shown = frame.rgb.cpu().float(), _rgb(photo), frame.alphas.cpu() >= COVERED_ALPHA
    numbers = {"psnr": psnr(rgb, truth), "covered": float(shown.float().mean())}
    if bool(shown.any()):
        numbers["psnr_covered"] = psnr(rgb[shown], truth[shown])
        numbers["psnr_lit"] = psnr(lit(rgb[shown], truth[shown]), truth[shown])
        depths = torch.where(shown, photo.depths, 0.0)
        numbers["depth"] = abs_rel(frame.depths.cpu().float() * fit.scale, depths)
    if bench.lpips is not None:
        numbers["lpips"] = bench.lpips.whole(rgb[None], truth[None])[0]
    return numbers


def summary(rows: Sequence[Mapping]) -> dict:
    """Means over walks by number of photos; kept frames' within their walk first, so that each counts alike.

    "gain_" is the difference to the next smaller number of photos, over frames that both have."""
    by_photos = {}
    numbers = sorted({int(name) for row in rows for name in row["photos"]})
    for place, photos in enumerate(numbers):
        before = str(numbers[place - 1]) if place else None
        means = [flat(row["photos"], str(photos), before) for row in rows if str(photos) in row["photos"]]
        keys = dict.fromkeys(key for found in means for key in found)
        by_photos[str(photos)] = rounded(
            {key: nan_mean(found.get(key, math.nan) for found in means) for key in keys}
        )
        by_photos[str(photos)]["walks"] = len(means)
    return {"by_photos": by_photos, "cases": list(rows)}


def flat(photos: Mapping[str, Mapping], name: str, before: str | None = None) -> dict[str, float]:
    """Numbers of one scene of a walk, its kept frames' means among them as "between_"."""
    row = photos[name]
    found = {key: number(value) for key, value in row.items() if key != "frames"}
    frames = row["frames"]
    keys = dict.fromkeys(key for values in frames.values() for key in values)
    found |= {
        f"between_{key}": nan_mean(number(values.get(key)) for values in frames.values()) for key in keys
    }
    if before in photos:
        earlier = photos[before]["frames"]
        shared = [frame for frame in frames if frame in earlier]
        for key in ("psnr", "large_psnr", "aligned_psnr", "large_aligned_psnr"):
            if key in keys:
                changes = [number(frames[f].get(key)) - number(earlier[f].get(key)) for f in shared]
                found[f"gain_{key}"] = nan_mean(changes)
    return found
