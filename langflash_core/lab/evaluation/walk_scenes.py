"""Scenes of the photos of a walk, with the similarity that brings them into the true world. V photos."""

import math
import multiprocessing
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
from jaxtyping import Float

from langflash_core.lab.evaluation import bench as benches
from langflash_core.lab.evaluation.bench import Render, as_array, as_seen, files_of, pose_of, wordless
from langflash_core.lab.evaluation.side_measures import Similarity
from langflash_core.lab.evaluation.sides import covered_depths
from langflash_core.lab.evaluation.walk_measures import centres_of, fitted_cameras, lens_ratio, walked
from langflash_core.lab.evaluation.walk_subjects import Walk
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.photos.folder import lenses_of
from langflash_core.reconstruction.networks import Networks
from langflash_core.scene.file import load, save
from langflash_core.types import Scene


@dataclass(frozen=True)
class Bench(benches.Bench):
    """assume_lens: `reconstruct` is told nothing of the lens. alone: kept frames' own two photos stand
    beside. memory: each scene is made in a process of its own, whose memory is told. colmap: its cameras
    stand beside."""

    assume_lens: bool = False
    alone: bool = True
    memory: bool = False
    colmap: bool = False


@dataclass(frozen=True)
class Cost:
    """Seconds on the wall and of the processor; the most memory of a process, MB, NaN where it did more than
    this."""

    seconds: float
    cpu_seconds: float
    memory_mb: float = math.nan


@dataclass(frozen=True)
class Made:
    """A scene without its language. frames, photos: all it was to be made of; views: which of them were
    placed, in the scene's order; fit: to the true world; length: of the walk from the first photo to the
    last, m."""

    scene: Scene
    frames: tuple[int, ...]
    photos: tuple[LabelledPhoto, ...]
    views: tuple[int, ...]
    fit: Similarity
    length: float
    cost: Cost

    @property
    def placed(self) -> list[LabelledPhoto]:
        return [self.photos[view] for view in self.views]

    @cached_property
    def lens(self) -> float:
        """Focal length that the scene takes the photos to have, over the true one."""
        seen = [as_seen(photo, self.scene.view_size).K for photo in self.placed]
        return lens_ratio(list(self.scene.Ks), seen)

    def fit_near(self, frame: int) -> Similarity:
        """To the true world by the two cameras around a frame alone: a walk that bends does not matter."""
        numbers = [self.frames[view] for view in self.views]
        before = [row for row, number in enumerate(numbers) if number < frame][-1:]
        after = [row for row, number in enumerate(numbers) if number > frame][:1]
        if not (before and after):
            return self.fit
        rows = before + after
        return fitted_cameras(as_array(self.scene.viewmats)[rows], true_cameras(self.placed)[rows])


def made_of(walk: Walk, frames: Sequence[int], bench: Bench, *, memory: bool = False) -> Made:
    """A scene of some frames of a walk.

    Args:
        memory: in a process of its own, whose memory is told; its seconds hold the reading of the weights.

    Raises:
        InputError: a photo has no pose.
    """
    photos = tuple(walk.photo(frame) for frame in frames)
    truth = true_cameras(photos)
    options = {**bench.options, "intrinsics": None if bench.assume_lens else lenses_of(photos)}
    with files_of(photos) as paths:
        scene, cost = _made_apart(paths, options) if memory else _made(paths, options, bench.networks)
    placed = placed_views(scene)
    views = tuple(view for view, photo in enumerate(photos) if photo.id in placed)
    fit = fitted_cameras(np.stack([as_array(placed[photos[v].id]) for v in views]), truth[list(views)])
    length = walked(np.stack([walk.camera(frame) for frame in range(frames[0], frames[-1] + 1)]))
    made = Made(wordless(scene), tuple(frames), photos, views, fit, length, cost)
    return replace(made, fit=_scaled(made, bench.render)) if len(views) < 2 else made


def with_lens(lens: float, photo: FittedPhoto) -> FittedPhoto:
    """With focal lengths that many times as long."""
    return replace(photo, K=photo.K * torch.tensor([[lens, 1, 1], [1, lens, 1], [1, 1, 1]]).to(photo.K))


def _made(
    paths: Sequence[Path], options: dict[str, Any], networks: Networks | None = None
) -> tuple[Scene, Cost]:
    start, cpu = time.perf_counter(), time.process_time()
    scene = benches.reconstruct(paths, networks=networks, **options)
    return scene, Cost(time.perf_counter() - start, time.process_time() - cpu)


def _made_apart(paths: Sequence[Path], options: dict[str, Any]) -> tuple[Scene, Cost]:
    context = multiprocessing.get_context("spawn")
    with TemporaryDirectory() as folder, ProcessPoolExecutor(1, context) as pool:
        file = Path(folder) / "scene.langflash"
        try:
            cost = pool.submit(_saved, paths, options, file, torch.get_num_threads()).result()
        except BrokenProcessPool as error:
            raise MemoryError("the system ended the process of a scene") from error
        return load(file), cost


def _saved(paths: Sequence[Path], options: dict[str, Any], file: Path, threads: int) -> Cost:
    """In a process of its own."""
    torch.set_num_threads(threads)
    scene, cost = _made(paths, options)
    save(scene, file)
    memory = scene.record.cost.peak_memory_mb
    return cost if memory is None else replace(cost, memory_mb=float(memory))


def placed_views(scene: Scene) -> dict[str, torch.Tensor]:
    """Poses (4, 4) by the id of their photo; a photo that was left out has none."""
    names = (Path(name).stem for name in scene.record.photos)
    return dict(zip(names, scene.viewmats.cpu(), strict=True))


def true_cameras(photos: Sequence[LabelledPhoto]) -> Float[np.ndarray, "V 4 4"]:
    """World to camera."""
    return np.stack([np.linalg.inv(as_array(pose_of(photo))) for photo in photos])


def _scaled(made: Made, render: Render) -> Similarity:
    """The fit of a single camera, with the scale that the depth of its photo has, where that is known."""
    scene, fit = made.scene, made.fit
    drawn = covered_depths(render(scene, scene.camera(0)))
    truth = as_array(as_seen(made.placed[0], scene.view_size).depths)
    both = (drawn > 0) & (truth > 0)
    scale = float(np.median(truth[both] / drawn[both])) if both.any() else 1.0
    centre = fit.rotation @ centres_of(as_array(scene.viewmats[:1]))[0]
    return Similarity(scale, fit.rotation, fit.scale * centre + fit.shift - scale * centre)
