"""A scene in another frame and unit: that of poses which were given, or the world it stands in."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.base.records import World
from langflash_core.geometry.cameras import invert_rigid, transform
from langflash_core.geometry.poses import Vector, read_pose, told_pose
from langflash_core.geometry.rotations import matrix, quaternion, turn_of
from langflash_core.geometry.turning import turned_quats, turned_sh
from langflash_core.scene.tour import read_tour, told_tour
from langflash_core.types import Gaussians, Scene


def in_world(scene: Scene, viewmat: Float[Tensor, "4 4"], unit: float) -> Scene:
    """The scene with its first camera at `viewmat`.

    Args:
        viewmat: (4, 4), world to camera of view 0. unit: world units per scene unit.
    """
    pose = invert_rigid(viewmat.double().cpu())
    means = transform(pose, scene.gaussians.means.double() * unit).float()
    viewmats = scene.viewmats.double().clone()
    viewmats[:, :3, 3] *= unit
    moved = _transform_gaussians(scene.gaussians, means, pose[:3, :3], unit)
    return replace(scene, gaussians=moved, viewmats=(viewmats @ viewmat.double().cpu()).float())


def transform_scene(
    scene: Scene, turn: Float[np.ndarray, "3 3"], origin: Float[np.ndarray, " 3"], unit: float
) -> Scene:
    """The scene with every point p at unit turn (p - origin); its views look at the same things.

    Key frames, stops and notes go along: they are places of the scene, too. What was taken off a file's
    coordinates is known no more: these have other axes.
    """
    matrix, start = torch.from_numpy(turn).double(), torch.from_numpy(origin).double()
    means = (unit * (scene.gaussians.means.double() - start) @ matrix.T).float()
    viewmats = scene.viewmats.double().clone()
    rotation = viewmats[:, :3, :3] @ matrix.T
    viewmats[:, :3, 3] = unit * (viewmats[:, :3, 3] + viewmats[:, :3, :3] @ start)
    viewmats[:, :3, :3] = rotation
    moved = _transform_gaussians(scene.gaussians, means, matrix, unit)
    path = tuple(_placed_key(key, turn, origin, unit) for key in scene.record.camera_path)
    tour = _placed_tour(scene.record.tour, turn, origin, unit)
    whole = replace(scene, gaussians=moved, viewmats=viewmats.float())
    whole = whole if whole.record.shift is None else whole.with_record(shift=None)
    return whole.with_record(camera_path=path, tour=tour) if path or tour else whole


def upward(world: World | None) -> Float[np.ndarray, " 3"]:
    """Unit vector that points up, in the scene's axes; as the first photo was held, where nobody knows."""
    return np.array([0.0, -1.0, 0.0]) if world is None else -turn_of(world)[1]


def _transform_gaussians(gaussians: Gaussians, means: Tensor, matrix: Tensor, unit: float) -> Gaussians:
    """At these means, turned and scaled."""
    quats = torch.nn.functional.normalize(turned_quats(gaussians.quats, matrix), dim=-1)
    sh = turned_sh(gaussians.sh, matrix)
    return replace(gaussians, means=means, quats=quats, scales=gaussians.scales * unit, sh=sh)


def _placed_tour(
    told: Mapping[str, Any], turn: Float[np.ndarray, "3 3"], origin: Float[np.ndarray, " 3"], unit: float
) -> dict[str, Any]:
    """A tour at the same things."""

    def point(at: Vector) -> Vector:
        return Vector(*(unit * turn @ (np.array(at) - origin)).tolist())

    tour = read_tour(told)
    stops = tuple(
        replace(stop, pose=read_pose(_placed_key(told_pose(stop.pose), turn, origin, unit)))
        for stop in tour.stops
    )
    notes = tuple(
        replace(note, at=point(note.at), to=None if note.to is None else point(note.to))
        for note in tour.notes
    )
    return told_tour(replace(tour, stops=stops, notes=notes))


def _placed_key(
    key: Mapping[str, Any], turn: Float[np.ndarray, "3 3"], origin: Float[np.ndarray, " 3"], unit: float
) -> Mapping[str, Any]:
    """A key frame that sees the same; as it is where it is none."""
    try:
        centre = unit * turn @ (np.array(key["centre"], float) - origin)
        w, x, y, z = map(float, key["rotation"])
        rotation = quaternion(turn @ matrix((w, x, y, z)))
        lengths = {name: unit * float(key[name]) for name in ("reach", "span") if key.get(name) is not None}
    except (TypeError, ValueError, LookupError):
        return key
    return {**key, "centre": centre.tolist(), "rotation": list(rotation), **lengths}
