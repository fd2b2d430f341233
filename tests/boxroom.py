"""A room of flat Gaussians with known walls, heights and things, seen by two cameras that are held askew."""

from dataclasses import replace

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from langflash_core.language.spaces import language_space
from langflash_core.types import Gaussians, Record, Scene, Semantics

WORDS = ("wall", "floor", "ceiling", "chair", "table", "door")
METRES = 2.0
"""Metres per scene unit."""
WIDE, DEEP, HIGH = 4.0, 5.0, 2.6  # metres: east, north, up
CHAIRS = ((0.8, 2.6), (3.2, 2.6))
TABLE = (2.0, 3.6)
EYE = (2.0, 1.5, 0.3)  # east, height, north
SPACING = 0.08


def box_room(
    pitch: float = 20.0,
    roll: float = 4.0,
    yaw: float = 10.0,
    chairs: tuple[tuple[float, float], ...] = CHAIRS,
    table: tuple[float, float] | None = TABLE,
) -> Scene:
    """The room in the frame of its first camera, in units of `METRES`.

    Args:
        pitch, roll, yaw: degrees by which that camera looks down, leans, and looks aside of north.
    """
    parts = [
        _sheet("floor", (0, 0, 0), (WIDE, 0, 0), (0, 0, DEEP)),
        _sheet("ceiling", (0, HIGH, 0), (WIDE, 0, 0), (0, 0, DEEP)),
        _sheet("wall", (0, 0, DEEP), (WIDE, 0, 0), (0, HIGH, 0)),
        _sheet("wall", (0, 0, 0), (0, 0, DEEP), (0, HIGH, 0)),
        _sheet("wall", (WIDE, 0, 0), (0, 0, DEEP), (0, HIGH, 0)),
        _sheet("door", (WIDE - 0.03, 0, 3.5), (0, 0, 0.9), (0, 2.0, 0)),
        *(_cube("chair", east, north, 0.45, 0.45, 0.8) for east, north in chairs),
        *(_cube("table", east, north, 1.4, 0.8, 0.74) for east, north in (() if table is None else (table,))),
    ]
    points, normals, words = (np.concatenate([part[k] for part in parts]) for k in range(3))
    # Of a world of east, height, north to the first camera: right, down, ahead.
    flip = np.diag([1.0, -1.0, 1.0])
    turn = Rotation.from_euler("zxy", [roll, pitch, -yaw], degrees=True).as_matrix()
    home = turn @ flip
    means = (points - np.array(EYE)) @ home.T / METRES
    across = normals @ home.T
    quats = np.stack([_turn_to(n) for n in across])
    count = len(means)
    gaussians = Gaussians(
        torch.from_numpy(means).float(),
        torch.from_numpy(quats).float(),
        torch.tensor([0.6, 0.6, 0.05]).repeat(count, 1) * SPACING / METRES,
        torch.full((count,), 0.95),
        torch.from_numpy(np.eye(6)[words][:, None, :3]).float(),
    )
    semantics = Semantics(
        torch.from_numpy(words)[:, None],
        torch.ones(count, 1),
        language_space("minilm").encode(WORDS),
        "minilm",
    )
    second = torch.eye(4)
    second[0, 3] = -0.15
    K = torch.tensor([[60.0, 0, 48], [0, 60, 36], [0, 0, 1]])
    return Scene(
        gaussians, semantics, torch.stack((torch.eye(4), second)), K.repeat(2, 1, 1), (96, 72),
        view_ids=torch.zeros(count, dtype=torch.int64), record=Record(preset="mini"),
    )  # fmt: skip


def in_layers(scene: Scene, apart: float = 1.05) -> Scene:
    """The scene as two layers, of its photos, the second's depths so many times as large."""
    count, second = len(scene.gaussians), scene.viewmats[1][:3, 3]
    twice = scene.rows(torch.arange(count).repeat(2))
    means = twice.gaussians.means.clone()
    means[count:] = apart * (means[count:] + second) - second
    ids = torch.arange(2).repeat_interleave(count)
    layered = replace(twice, gaussians=replace(twice.gaussians, means=means), view_ids=ids)
    return layered.with_record(layered=True)


def true_up(scene: Scene, pitch: float = 20.0, roll: float = 4.0, yaw: float = 10.0) -> np.ndarray:
    """Up in the scene's axes."""
    turn = Rotation.from_euler("zxy", [roll, pitch, -yaw], degrees=True).as_matrix()
    return turn @ np.array([0.0, -1.0, 0.0])


def without_language(scene: Scene) -> Scene:
    """The same as a splat file of another program."""
    none = torch.zeros(len(scene.gaussians), 0)
    return replace(scene, semantics=Semantics(none.long(), none, torch.zeros(0, 0), "none"))


def _sheet(word: str, corner: tuple, along: tuple, up: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    start, first, second = (np.array(v, float) for v in (corner, along, up))
    steps = [
        np.arange(SPACING / 2, np.linalg.norm(side), SPACING) / np.linalg.norm(side)
        for side in (first, second)
    ]
    s, t = (grid.ravel()[:, None] for grid in np.meshgrid(*steps))
    points = start + s * first + t * second
    normal = np.cross(first, second) / np.linalg.norm(np.cross(first, second))
    return points, np.tile(normal, (len(points), 1)), np.full(len(points), WORDS.index(word))


def _cube(word: str, east: float, north: float, wide: float, deep: float, high: float):
    low = np.array([east - wide / 2, 0, north - deep / 2])
    x, y, z = (wide, 0, 0), (0, high, 0), (0, 0, deep)
    sheets = [
        _sheet(word, tuple(low), x, y), _sheet(word, tuple(low + z), x, y), _sheet(word, tuple(low), z, y),
        _sheet(word, tuple(low + x), z, y), _sheet(word, tuple(low + y), x, z),
    ]  # fmt: skip
    return tuple(np.concatenate([sheet[k] for sheet in sheets]) for k in range(3))


def _turn_to(normal: np.ndarray) -> np.ndarray:
    """Quaternion wxyz of a rotation whose third axis is a direction."""
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first /= np.linalg.norm(first)
    matrix = np.stack((first, np.cross(normal, first), normal), 1)
    return Rotation.from_matrix(matrix).as_quat(scalar_first=True)
