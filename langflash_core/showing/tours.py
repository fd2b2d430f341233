"""Tours of scene files: read and written without torch; where stops and notes go, by a photo or a phrase."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from langflash_core.errors import InputError, PromptError, ViewError
from langflash_core.geometry.poses import Pose, Vector, from_view
from langflash_core.geometry.reach import median_reach
from langflash_core.scene.container import Container, damage_error, read_container, write_container
from langflash_core.scene.tour import Tour, read_tour, told_tour

if TYPE_CHECKING:
    from langflash_core.types import Camera, Frame, Scene

_TOUR = "tour"  # of a file's metadata


def tour_in(path: Path) -> tuple[Tour, Container]:
    """The tour of a scene file, and what else is in it; without torch.

    Raises:
        SceneFileError: missing, damaged, or no .langflash file.
    """
    found = read_container(path)
    try:
        return read_tour(found.metadata.get(_TOUR) or {}), found
    except ValueError as error:
        raise damage_error(path, error) from error


def write_tour(tour: Tour, found: Container, path: Path) -> None:
    """The same scene file with another tour; its tensors stay as they are, bit by bit.

    Raises:
        OutputError: the path cannot be written.
    """
    rest = {name: value for name, value in found.metadata.items() if name != _TOUR}
    told = told_tour(tour)
    write_container(replace(found, metadata={**rest, **({_TOUR: told} if told else {})}), path)


def pose_of_view(found: Container, view: int) -> Pose:
    """The pose of a photo, around what it shows.

    Raises:
        ViewError: there is no such photo.
    """
    viewmats, Ks = found.arrays["viewmats"], found.arrays["Ks"]
    if not 0 <= view < len(viewmats):
        raise ViewError(
            f"there is no photo {view + 1}: this scene has {len(viewmats)}; use --view 1 to {len(viewmats)}"
        )
    return _pose(found, viewmats[view].astype(float), Ks[view].astype(float), found.view_size, False)


def pose_of_camera(found: Container, camera: "Camera") -> Pose:
    """The pose of any camera, around what it shows."""
    size = (camera.width, camera.height)
    return _pose(found, camera.viewmat.double().numpy(), camera.K.double().numpy(), size, camera.orthographic)


def _pose(found: Container, viewmat: np.ndarray, K: np.ndarray, size: tuple[int, int], flat: bool) -> Pose:
    reach = median_reach(found.arrays["means"].astype(float), viewmat, K, size)
    return from_view(viewmat, K, size, reach, flat)


def place_of(scene: "Scene", phrase: str, render: Callable[["Scene", "Camera"], "Frame"]) -> Vector:
    """The middle of what answers a phrase, where a photo shows it best.

    Raises:
        PromptError: no photo's view answers it.
    """
    from langflash_core import pipeline  # torch

    found = [
        answer
        for view in range(scene.num_views)
        for answer in pipeline.query(scene, [phrase], view=view, render=render).answers
    ]
    best = max(found, key=lambda answer: (answer.centroid is not None, answer.score))
    if best.centroid is None:
        raise PromptError(
            f"not found in any view: {phrase} (best score {best.score:.3f}); say where, or another phrase"
        )
    return Vector(*map(float, best.centroid))


def stop_at(tour: Tour, said: str) -> int:
    """Which stop is meant by its name or its number from 1.

    Raises:
        InputError: there is none.
    """
    if said in tour.names:
        return tour.names.index(said)
    if said.isdecimal() and 1 <= int(said) <= len(tour.stops):
        return int(said) - 1
    raise InputError(f"there is no stop {said}; the tour has {', '.join(tour.names) or 'none'}")
