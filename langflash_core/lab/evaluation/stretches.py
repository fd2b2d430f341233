"""`langflash lab eval posed --photos 2 4 8`: what more photos of the same place bring.

A stretch is a run of photos; scenes are made of 2, 4, 8 ... of them, spread evenly from its first to its
last. All are judged alike: by the depth of the first photo, the pose of the last one (so that drift along
the others shows), the poses of all, and the photo in the middle, which no scene is made of.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.labelled import Render, rounded
from langflash_core.lab.evaluation.metrics import pose_error
from langflash_core.lab.evaluation.posed import (
    LEFT_OUT,
    Tally,
    as_seen,
    judge_depth,
    judge_picture,
    moved_camera,
    relative,
    scene_of,
)
from langflash_core.lab.evaluation.tallies import merged
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.folder import lenses_of
from langflash_core.lab.training.measures import nan_mean
from langflash_core.reconstruction.networks import Networks
from langflash_core.types import Scene

STRETCHES = 6
LENGTH = 24
"""Numbers from the first photo of a stretch to its last."""
TURNED = 40.0
"""Degrees: a camera that turned by more from the first photo to the last looks at another place."""


@dataclass(frozen=True)
class Stretch:
    """Ids of the photos from the first to the last, in order, and of the one in the middle, which is in none
    of `chosen`: the photos of each scene, by how many they are."""

    between: str
    chosen: dict[int, tuple[str, ...]]


def chosen_stretches(
    folder: PhotoFolder, photos: Sequence[int], count: int = STRETCHES, length: int = LENGTH
) -> list[Stretch]:
    """Stretches spread evenly over those of the folder that look at one place.

    Raises:
        InputError: there is none, or a scene of so many photos would need the one in the middle.
    """
    names = {int(id): id for id in folder.ids if id.isdigit()}
    poses = {int(id): pose for id, pose in (folder.poses or {}).items() if id in folder.ids and id.isdigit()}
    starts = [n for n in sorted(poses) if n + length in poses and _one_place(poses[n], poses[n + length])]
    if not starts or min(photos) < 2:
        raise InputError(
            f"--photos needs two or more, and photos {length} numbers apart that look the same way; "
            "leave it out to judge pairs"
        )
    wanted = min(count, len(starts))
    firsts = [starts[(2 * k + 1) * len(starts) // (2 * wanted)] for k in range(wanted)]
    return [_stretch([names[n] for n in sorted(names) if f <= n <= f + length], photos) for f in firsts]


def _one_place(first: torch.Tensor, last: torch.Tensor) -> bool:
    """Whether two cameras, camera to world, look at much the same."""
    turned = (torch.linalg.inv(last.double()) @ first.double()).float()
    return pose_error(torch.eye(4), turned).rotation <= TURNED


def _stretch(ids: list[str], photos: Sequence[int]) -> Stretch:
    middle = ids.pop(len(ids) // 2)
    if len(ids) < max(photos):
        raise InputError(
            f"{max(photos)} photos and one between them are more than the {len(ids) + 1} of a stretch; "
            "choose fewer with --photos"
        )
    last = len(ids) - 1
    chosen = {many: tuple(ids[round(k * last / (many - 1))] for k in range(many)) for many in photos}
    return Stretch(middle, chosen)


def run_stretches(
    folder: PhotoFolder,
    stretches: Sequence[Stretch],
    render: Render,
    weights: Path | None = None,
    *,
    preset: str = "mini",
    size: int | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> dict:
    """Judge a checkpoint on scenes of more and more photos; arguments as `run_posed` has them.

    Returns:
        Plain JSON: "by_photos", the means for each number of photos.

    Raises:
        InputError: the folder lacks a pose. WeightsError: the checkpoint does not fit.
    """
    work = list(_scenes(stretches))
    warm = [folder.photo(id) for id in work[0][1]]
    options = {"weights": weights, "preset": preset, "size": size, "networks": Networks()}
    scene_of(warm, lenses_of(warm), **options)
    tallies: dict[int, list[Tally]] = {}
    for done, (between, ids) in enumerate(work, start=1):
        tally = Tally()
        judge_stretch(folder, ids, between, render, tally, **options)
        tallies.setdefault(len(ids), []).append(tally)
        progress(f"{len(ids)} photos from {ids[0]}", done / len(work))
    return {
        "weights": str(weights) if weights else preset,
        "folder": folder.root.name,
        "stretches": len(stretches),
        "by_photos": {str(many): _means(merged(several)) for many, several in sorted(tallies.items())},
    }


def _scenes(stretches: Sequence[Stretch]) -> Iterator[tuple[str, tuple[str, ...]]]:
    for stretch in stretches:
        for ids in stretch.chosen.values():
            yield stretch.between, ids


@torch.no_grad()
def judge_stretch(
    folder: PhotoFolder,
    ids: Sequence[str],
    between: str,
    render: Render,
    tally: Tally,
    *,
    weights: Path | None = None,
    preset: str = "mini",
    size: int | None = None,
    networks: Networks | None = None,
) -> None:
    """One scene of the photos `ids` and the photo between them; adds to `tally`."""
    photos, target = [folder.photo(id) for id in ids], folder.photo(between)
    scene, seconds = scene_of(
        photos, lenses_of(photos), weights=weights, preset=preset, size=size, networks=networks
    )
    truths = {photo.id: relative(photos[0], photo).float() for photo in photos[1:]}
    placed = placed_views(scene)
    for id, truth in truths.items():
        error = pose_error(placed.get(id, torch.eye(4)), truth)
        direction = error.direction if id in placed else LEFT_OUT
        tally.note(rotation=error.rotation, direction=direction)
        if id == ids[-1]:
            tally.note(rotation_last=error.rotation, direction_last=direction)
    tally.note(seconds=seconds, placed=len(placed) / len(ids))
    first = as_seen(photos[0], scene.view_size)
    scale = judge_depth([render(scene, scene.camera(0))], [first], tally)
    if math.isnan(scale):
        return
    seen = as_seen(target, scene.view_size)
    camera = moved_camera(relative(photos[0], target), scale, seen, scene.view_size)
    judge_picture(render(scene, camera), seen, tally, first)


def placed_views(scene: Scene) -> dict[str, torch.Tensor]:
    """Poses (4, 4) by the id of their photo; a photo that was left out has none."""
    names = (Path(name).stem for name in scene.record.photos)
    return dict(zip(names, scene.viewmats.cpu(), strict=True))


def _means(tally: Tally) -> dict[str, float | None]:
    return rounded({name: nan_mean(values) for name, values in sorted(tally.numbers.items())})
