"""`langflash lab eval walk`: the same place in 2, 4, 8 ... photos, and what every further photo brings.

A scene is made of the photos of a walk (`walk_subjects` says which), and brought into the true world by the
similarity that fits its cameras best (`fitted_cameras`). Then its cameras, its depth in every photo and its
pictures where frames were kept are compared with the truth. Beside each kept frame stands the picture of the
scene that its own two photos make alone, brought into the world by their own two cameras.

Pictures are compared whole (what nothing covers is black), where the scene covers them, and there in the
photo's light, since a kept photo has an exposure of its own. A place that is a pixel off costs decibels that
nobody sees, so the same picture is also judged from the pose that fits it (`alignment`).

Sizes: H W pixels; "large" is the photo's size, at most three times the network's grid.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.lab.evaluation.alignment import aligned_camera
from langflash_core.lab.evaluation.bench import Render, as_array, as_seen, files_of, picture_of
from langflash_core.lab.evaluation.sharp_subjects import size_of
from langflash_core.lab.evaluation.side_measures import Similarity
from langflash_core.lab.evaluation.tables import (
    Measure,
    Pairs,
    Table,
    by_measure,
    full_titles,
    number,
    rounded,
)
from langflash_core.lab.evaluation.tallies import Rows, Shelf, judged
from langflash_core.lab.evaluation.walk_colmap import mapped
from langflash_core.lab.evaluation.walk_measures import camera_errors, fitted_cameras, lit
from langflash_core.lab.evaluation.walk_scenes import Bench, Made, made_of, true_cameras, with_lens
from langflash_core.lab.evaluation.walk_subjects import Walk
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.measures import abs_rel, align_scale, delta1, nan_mean, psnr
from langflash_core.language.settings import ANSWERING
from langflash_core.scene.gaps import fill_gaps
from langflash_core.types import Camera, Scene

ALONE = "alone_"
"""Begins what the scene of a kept frame's own two photos shows."""
TRUTH, OWN = "truth", "own two"
"""Titles of pictures, beside numbers of photos."""
SHOWN = 3
"""So many kept frames of a walk are shown."""
Shown = Callable[[str, int, str, Tensor], None]
"""Is given a walk's name, a kept frame, a title and a picture (H, W, 3) at the photo's size."""


MEASURES = (
    Measure("photos placed (%)", "placed", "share"),
    Measure("places, mean (% of the walk)", "places", "share"),
    Measure("places, farthest (% of the walk)", "places_most", "share"),
    Measure("rotation, mean (degrees)", "rotation", ".2f"),
    Measure("focal length off by (%)", "focal", "share"),
    Measure("depth AbsRel, one scale", "depth_abs_rel", ".3f"),
    Measure("depth delta 1, one scale", "depth_delta1", ".3f"),
    Measure("depth AbsRel, a scale per photo", "depth_own_scale", ".3f"),
    Measure("depth AbsRel of own two photos alone", "between_alone_photos_depth_abs_rel", ".3f"),
    Measure("PSNR at the photos' own places, as shown (dB)", "own_psnr", ".2f"),
    Measure("PSNR between, whole (dB)", "between_psnr", ".2f"),
    Measure("... own two photos alone", "between_alone_psnr", ".2f"),
    Measure("... against fewer photos, same frames", "gain_psnr", "+.2f"),
    Measure("PSNR between, covered (dB)", "between_psnr_covered", ".2f"),
    Measure("... own two photos alone", "between_alone_psnr_covered", ".2f"),
    Measure("PSNR between, covered, light fitted (dB)", "between_psnr_lit", ".2f"),
    Measure("... own two photos alone", "between_alone_psnr_lit", ".2f"),
    Measure("covered (%)", "between_covered", "share"),
    Measure("... own two photos alone", "between_alone_covered", "share"),
    Measure("PSNR between, pose fitted (dB)", "between_aligned_psnr", ".2f"),
    Measure("... own two photos alone", "between_alone_aligned_psnr", ".2f"),
    Measure("... against fewer photos, same frames", "gain_aligned_psnr", "+.2f"),
    Measure("LPIPS between", "between_lpips", ".3f"),
    Measure("... own two photos alone", "between_alone_lpips", ".3f"),
    Measure("LPIPS between, pose fitted", "between_aligned_lpips", ".3f"),
    Measure("... own two photos alone", "between_alone_aligned_lpips", ".3f"),
    Measure("depth AbsRel between", "between_depth", ".3f"),
    Measure("... own two photos alone", "between_alone_depth", ".3f"),
    Measure("PSNR between at the photo's size (dB)", "between_large_psnr", ".2f"),
    Measure("... own two photos alone", "between_alone_large_psnr", ".2f"),
    Measure("PSNR between at the photo's size, pose fitted (dB)", "between_large_aligned_psnr", ".2f"),
    Measure("... own two photos alone", "between_alone_large_aligned_psnr", ".2f"),
    Measure("LPIPS between at the photo's size", "between_large_lpips", ".3f"),
    Measure("... own two photos alone", "between_alone_large_lpips", ".3f"),
    Measure("LPIPS between at the photo's size, pose fitted", "between_large_aligned_lpips", ".3f"),
    Measure("... own two photos alone", "between_alone_large_aligned_lpips", ".3f"),
    Measure("Gaussians", "gaussians", ",.0f"),
    Measure("of these coarse", "coarse", ",.0f"),
    Measure("seconds", "seconds", ".1f"),
    Measure("processor seconds", "cpu_seconds", ".1f"),
    Measure("peak memory (MB)", "memory_mb", ",.0f"),
    Measure("COLMAP: photos placed (%)", "colmap_placed", "share"),
    Measure("COLMAP: places, mean (% of the walk)", "colmap_places", "share"),
    Measure("... ours, of the same photos", "colmap_ours_places", "share"),
    Measure("COLMAP: rotation, mean (degrees)", "colmap_rotation", ".2f"),
    Measure("... ours, of the same photos", "colmap_ours_rotation", ".2f"),
    Measure("COLMAP: focal length off by (%)", "colmap_focal", "share"),
    Measure("COLMAP: seconds", "colmap_seconds", ".1f"),
    Measure("length of the walk (m)", "length", ".1f"),
)


def run_walks(
    walks: Iterable[Walk],
    count: int,
    bench: Bench,
    *,
    shelf: Shelf | None = None,
    progress: Progress = lambda stage, fraction: None,
    shown: Shown = lambda name, frame, title, rgb: None,
) -> dict:
    """Judge the code that makes scenes by walks.

    Args:
        count: of the walks. shelf: where walks are kept; those on it are not judged again.

    Returns:
        Plain JSON: "cases" with the numbers of each walk, "by_photos" their means.

    Raises:
        InputError: there is no walk. WeightsError: the checkpoint does not fit.
    """
    tallies = judged(
        ((walk.name, walk) for walk in walks),
        lambda walk, told: Rows([judge(walk, bench, told, shown)]),
        count=count,
        shelf=shelf,
        progress=progress,
    )
    rows = [row for tally in tallies.values() for row in tally.rows]
    return {"weights": bench.made_with, "by_photos": by_photos(rows), "cases": rows}


def judge(
    walk: Walk,
    bench: Bench,
    progress: Progress = lambda stage, fraction: None,
    shown: Shown = lambda name, frame, title, rgb: None,
) -> dict:
    """Numbers of one walk: "photos" by their number, each with what its scene has once and "frames", the kept
    ones."""
    alone: dict[tuple[tuple[int, int], int], dict[str, float]] = {}
    plan, rows, done = walk.plan, {}, 0
    pictured = set(plan.kept[:: max(1, len(plan.kept) // SHOWN)][:SHOWN])
    for photos, frames in sorted(plan.chosen.items()):
        progress(f"{photos} photos", done / sum(plan.chosen))
        made = made_of(walk, frames, bench, memory=bench.memory)
        once = {
            **once_of(made, bench.render),
            **(_colmap(made, bench) if bench.colmap else {}),
        }
        kept: dict[str, dict[str, float]] = {}
        for frame in plan.between(photos):
            rgb, kept[str(frame)] = pictured_at(made, walk, frame, bench)
            if frame in pictured:
                shown(walk.name, frame, str(photos), rgb)
        for frame in plan.between(photos) if bench.alone else ():
            pair = plan.own(photos, frame)
            if (pair, frame) not in alone:
                own = made if photos == 2 else made_of(walk, pair, bench)
                rgb, alone[pair, frame] = _alone(own, walk, frame, bench)
                if frame in pictured:
                    shown(walk.name, frame, OWN, rgb)
            kept[str(frame)] |= alone[pair, frame]
        rows[str(photos)] = {**rounded(once), "frames": {name: rounded(row) for name, row in kept.items()}}
        done += photos
    for frame in pictured:
        target = walk.kept(frame)
        shown(walk.name, frame, TRUTH, picture_of(as_seen(target, size_of(target, made.scene.view_size))))
    return {"name": walk.name, "photos": rows}


def _alone(own: Made, walk: Walk, frame: int, bench: Bench) -> tuple[Tensor, dict[str, float]]:
    """What the two photos around a kept frame bring without the others."""
    kept = ("depth_abs_rel", "placed", "gaussians", "seconds")
    once = once_of(own, bench.render)
    rgb, numbers = pictured_at(own, walk, frame, bench)
    found = {f"photos_{key}": once[key] for key in kept} | numbers
    return rgb, {ALONE + key: value for key, value in found.items()}


@torch.no_grad()
def once_of(made: Made, render: Render) -> dict[str, float]:
    """What a scene has once: cameras, lens, depth in its photos, size and cost."""
    scene, placed = made.scene, made.placed
    seen = [as_seen(photo, scene.view_size) for photo in placed]
    depth = [_depth(scene, view, photo, made.fit, render) for view, photo in enumerate(seen)]
    return {
        "placed": len(placed) / len(made.photos),
        **_cameras(as_array(scene.viewmats), true_cameras(placed), made.fit, made.length),
        "focal": abs(made.lens - 1),
        **{key: nan_mean(row[key] for row in depth) for key in depth[0]},
        "own_psnr": nan_mean(_own_psnr(made, view, render) for view in range(len(placed))),
        "gaussians": float(len(scene.gaussians)),
        "coarse": float((scene.levels == 0).sum()) if scene.levels is not None else math.nan,
        "seconds": made.cost.seconds,
        "cpu_seconds": made.cost.cpu_seconds,
        "memory_mb": made.cost.memory_mb,
        "length": made.length,
    }


def _cameras(found: np.ndarray, truth: np.ndarray, fit: Similarity, length: float) -> dict[str, float]:
    """Errors of cameras after the fit, NaN of a single one, which has none."""
    if len(found) < 2:
        return dict.fromkeys(("places", "places_most", "rotation"), math.nan)
    errors = camera_errors(found, truth, fit)
    return {
        "places": float(errors.places.mean()) / length,
        "places_most": float(errors.places.max()) / length,
        "rotation": float(errors.rotations.mean()),
    }


def _depth(scene: Scene, view: int, photo: FittedPhoto, fit: Similarity, render: Render) -> dict[str, float]:
    """Drawn depth of one photo: by the scene's one scale, and by one of its own."""
    frame = render(scene, scene.camera(view))
    truth = torch.where(frame.alphas.cpu() >= ANSWERING.covered_alpha, photo.depths, 0.0)
    drawn = frame.depths.cpu().float()
    return {
        "depth_abs_rel": abs_rel(drawn * fit.scale, truth),
        "depth_delta1": delta1(drawn * fit.scale, truth),
        "depth_own_scale": abs_rel(align_scale(drawn, truth), truth),
    }


def _own_psnr(made: Made, view: int, render: Render) -> float:
    """dB of a photo's own place, at the photo's size, as the window shows it."""
    scene = made.scene
    size = size_of(made.placed[view], scene.view_size)
    frame = render(scene, scene.camera(view, *size))
    shown = fill_gaps(frame.rgb.cpu().float(), frame.alphas.cpu().float()).clamp(0, 1)
    return psnr(shown, picture_of(as_seen(made.placed[view], size)))


def _colmap(made: Made, bench: Bench) -> dict[str, float]:
    """COLMAP's cameras of the same photos, and the scene's own where COLMAP has some, too."""
    with files_of(made.photos) as paths:
        intrinsics = None if bench.assume_lens else made.photos[0].intrinsics
        rival = mapped(paths, intrinsics, torch.get_num_threads())
    known = [view for view, photo in enumerate(made.photos) if photo.id in rival.viewmats]
    numbers = {"placed": len(known) / len(made.photos), "seconds": rival.seconds}
    if known:
        found = np.stack([rival.viewmats[made.photos[view].id] for view in known])
        truth = true_cameras([made.photos[view] for view in known])
        numbers |= _cameras(found, truth, fitted_cameras(found, truth), made.length)
    if rival.focal is not None and made.photos[0].K is not None:
        numbers["focal"] = abs(rival.focal / float(made.photos[0].K[[0, 1], [0, 1]].mean()) - 1)
    both = [(own, view) for own, view in enumerate(made.views) if view in known]
    if both:
        found = as_array(made.scene.viewmats)[[own for own, _ in both]]
        truth = true_cameras([made.photos[view] for _, view in both])
        ours = _cameras(found, truth, fitted_cameras(found, truth), made.length)
        numbers |= {f"ours_{key}": value for key, value in ours.items()}
    return {f"colmap_{key}": value for key, value in numbers.items()}


@torch.no_grad()
def pictured_at(made: Made, walk: Walk, frame: int, bench: Bench) -> tuple[Tensor, dict[str, float]]:
    """The scene from where a frame was kept: the picture at the photo's size, and numbers at both sizes.

    It is drawn through the lens that the scene takes the photos to have: the same camera took the frame.
    "aligned_" is from that place or from the pose that fits the photo, whichever looks more like it.
    """
    scene, target = made.scene, walk.kept(frame)
    sizes = (scene.view_size, size_of(target, scene.view_size))
    small, large = (with_lens(made.lens, as_seen(target, size)) for size in sizes)
    places = [torch.from_numpy(made.fit.viewmat(walk.camera(frame))).float()]
    if bench.align:
        places.append(_fitted_place(made, walk, frame, small, bench))
    rgb, numbers = picture_of(large), {}
    for name, photo in (("", small), ("large_", large)):
        cameras = [Camera(place, photo.K, photo.rgb.shape[2], photo.rgb.shape[1]) for place in places]
        drawn = [_alike(scene, camera, photo, made.fit, bench) for camera in cameras]
        numbers |= {name + key: value for key, value in drawn[0][1].items()}
        rgb, best = max(drawn, key=lambda found: found[1]["psnr"])
        if bench.align:
            numbers |= {f"{name}aligned_{key}": value for key, value in best.items()}
    return rgb, numbers


def _fitted_place(made: Made, walk: Walk, frame: int, photo: FittedPhoto, bench: Bench) -> Tensor:
    """The pose that fits the photo, sought from its place or from where its neighbours alone say that it was,
    whichever looks more like it."""
    scene, truth = made.scene, picture_of(photo)
    starts = [fit.viewmat(walk.camera(frame)) for fit in (made.fit, made.fit_near(frame))]
    cameras = [Camera(torch.from_numpy(start).float(), photo.K, *scene.view_size) for start in starts]
    best = max(cameras, key=lambda at: psnr(bench.render(scene, at).rgb.cpu().float(), truth))
    return aligned_camera(lambda at: bench.render(scene, at), best, truth).viewmat


def _alike(
    scene: Scene, camera: Camera, photo: FittedPhoto, fit: Similarity, bench: Bench
) -> tuple[Tensor, dict[str, float]]:
    """A drawn picture, and how near it is: whole, where the scene covers it, there in the photo's light."""
    frame = bench.render(scene, camera)
    rgb, truth, shown = (
        frame.rgb.cpu().float(),
        picture_of(photo),
        frame.alphas.cpu() >= ANSWERING.covered_alpha,
    )
    numbers = {"psnr": psnr(rgb, truth), "covered": float(shown.float().mean())}
    if bool(shown.any()):
        numbers["psnr_covered"] = psnr(rgb[shown], truth[shown])
        numbers["psnr_lit"] = psnr(lit(rgb[shown], truth[shown]), truth[shown])
        depths = torch.where(shown, photo.depths, 0.0)
        numbers["depth"] = abs_rel(frame.depths.cpu().float() * fit.scale, depths)
    if bench.lpips is not None:
        numbers["lpips"] = bench.lpips.whole(rgb[None], truth[None])[0]
    return rgb, numbers


def by_photos(rows: Sequence[Mapping]) -> dict[str, dict]:
    """Means over walks by number of photos; frames' within their walk first, so that each counts alike."""
    found: dict[str, dict] = {}
    for photos in sorted({int(name) for row in rows for name in row["photos"]}):
        means = [flat(row["photos"], str(photos)) for row in rows if str(photos) in row["photos"]]
        keys = dict.fromkeys(key for one in means for key in one)
        mean = {key: nan_mean(one.get(key, math.nan) for one in means) for key in keys}
        found[str(photos)] = {"walks": len(means), **rounded(mean)}
    return found


def flat(photos: Mapping[str, Mapping], name: str) -> dict[str, float]:
    """Numbers of one scene of a walk. "between_": means over its kept frames; "gain_": of their differences
    to the same frames in the next fewer photos."""
    row = photos[name]
    found = {key: number(value) for key, value in row.items() if key != "frames"}
    frames = row["frames"]
    keys = dict.fromkeys(key for values in frames.values() for key in values)
    found |= {f"between_{key}": nan_mean(number(row.get(key)) for row in frames.values()) for key in keys}
    fewer = max((int(other) for other in photos if int(other) < int(name)), default=None)
    if fewer is not None:
        before = photos[str(fewer)]["frames"]
        for key in (key for key in keys if "psnr" in key and not key.startswith(ALONE)):
            changes = (number(frames[f].get(key)) - number(before[f].get(key)) for f in frames if f in before)
            found[f"gain_{key}"] = nan_mean(changes)
    return found


def tables(result: Mapping) -> list[Table]:
    """A row a measure, a column a number of photos."""
    columns = {f"{photos} photos": row for photos, row in result["by_photos"].items()}
    count = next(iter(columns.values()))["walks"]
    return [by_measure("", f"mean of {count} walk{'s' * (count != 1)}", columns, MEASURES)]


def changes(pairs: Sequence[tuple[Mapping, Mapping]]) -> Iterator[tuple[Measure, Pairs]]:
    """What became of the same walks in another version, by number of photos."""
    for photos in sorted({int(name) for old, _ in pairs for name in old["photos"]}):
        known = [
            (flat(old["photos"], str(photos)), flat(new["photos"], str(photos)))
            for old, new in pairs
            if str(photos) in old["photos"] and str(photos) in new["photos"]
        ]
        for measure in full_titles(MEASURES):
            values = [(old.get(measure.key, math.nan), new.get(measure.key, math.nan)) for old, new in known]
            yield Measure(f"{photos} photos: {measure.title}", measure.key, measure.form), values
