"""What there is to say about the atoms of a scene: how much each carries, which are alike, and where
the photos show it."""

from dataclasses import dataclass, field

import numpy as np
import torch
from jaxtyping import Float, UInt8
from PIL import Image
from torch.nn.functional import normalize

from langflash_core.base.picture_files import decoded_photo
from langflash_core.geometry.surfels import covered_areas
from langflash_core.rig.projected import project_points
from langflash_core.scene.selection import strongest_atoms
from langflash_core.scene.settings import ATOM_PICTURES
from langflash_core.types import Scene

_ENOUGH = 1_000_000  # Gaussians that tell shares and places: all of ten million took 3 GB


@dataclass(frozen=True)
class AtomsReport:
    """shares: (K,) of the scene's surface, sum 1. order: (K,) rows, alike atoms side by side.
    similarity: (K, K) cosines."""

    shares: Float[np.ndarray, " K"] = field(repr=False)
    order: tuple[int, ...]
    similarity: Float[np.ndarray, "K K"] = field(repr=False)


def describe_atoms(scene: Scene) -> AtomsReport:
    """Shares, order and cosines; atoms that are not finite count as 0."""
    dictionary = scene.semantics.dictionary.double()
    dictionary = torch.where(torch.isfinite(dictionary).all(-1, keepdim=True), dictionary, 0.0)
    unit = normalize(dictionary, dim=-1)
    similarity = (unit @ unit.T).numpy()
    return AtomsReport(atom_shares(scene), alike_order(similarity), similarity)


def atom_shares(scene: Scene) -> Float[np.ndarray, " K"]:
    """(K,) of the scene's surface, opacity times area, sum 1; zeros where there is none."""
    masses = _atom_areas(scene)
    return masses / max(masses.sum(), 1e-12)


def atom_places(scene: Scene) -> tuple[tuple[float, float, float] | None, ...]:
    """For each atom a Gaussian in the middle of those that carry it most, world; None where none does.

    The middle is the one nearest to their median, so that it lies on the thing and not between two.
    """
    scene = _some(scene)
    strongest, means = strongest_atoms(scene.semantics), scene.gaussians.means.double().numpy()
    found: list[tuple[float, float, float] | None] = []
    for k in range(scene.semantics.num_atoms):
        own = means[strongest == k]
        own = own[np.isfinite(own).all(1)]
        if not len(own):
            found.append(None)
            continue
        x, y, z = own[np.linalg.norm(own - np.median(own, axis=0), axis=1).argmin()].tolist()
        found.append((x, y, z))
    return tuple(found)


def alike_order(similarity: Float[np.ndarray, "K K"]) -> tuple[int, ...]:
    """An order (K,) of rows in which alike ones are near: each next to its likest among the rest.

    Starts at the row least like all others.
    """
    count = len(similarity)
    left = set(range(count))
    order: list[int] = []
    while left:
        rest = sorted(left)
        scores = similarity[order[-1], rest] if order else -similarity[rest].sum(1)
        order.append(rest[int(np.argmax(scores))])
        left.remove(order[-1])
    return tuple(order)


def _some(scene: Scene) -> Scene:
    """About `_ENOUGH` of the Gaussians, evenly, of a scene of more."""
    count = len(scene.gaussians)
    return scene if count <= _ENOUGH else scene.rows(torch.arange(0, count, -(-count // _ENOUGH)))


def _atom_areas(scene: Scene) -> np.ndarray:
    """(K,) of the Gaussians' opacity times area that carries each atom; of many in proportion."""
    scene = _some(scene)
    shares = scene.semantics.weight_values.double().numpy() * covered_areas(scene.gaussians)[:, None]
    ids, finite = scene.semantics.weight_ids.numpy(), np.nan_to_num(shares, posinf=0)
    return np.bincount(ids.ravel(), finite.ravel(), minlength=scene.semantics.num_atoms)


def atom_pictures(scene: Scene) -> tuple[UInt8[np.ndarray, "_ _ 3"] | None, ...]:
    """For each atom the part of a photo that carries it most, (side, side, 3) uint8; None where none does."""
    maps = [atom_cells(scene, view) for view in range(len(scene.photos))]
    photos = [decoded_photo(photo) for photo in scene.photos]
    made: list[np.ndarray | None] = []
    for k in range(scene.semantics.num_atoms):
        totals = [cells[k].sum() for cells in maps]
        view = int(np.argmax(totals)) if totals else 0
        photo = photos[view] if totals and totals[view] > 0 else None
        made.append(None if photo is None else _crop(photo, maps[view][k]))
    return tuple(made)


def atom_cells(scene: Scene, view: int) -> Float[np.ndarray, "K h w"]:
    """(K, h, w): how much of each atom the cells of a photo show, of what is not hidden there."""
    camera = scene.camera(view)
    width, height = -(-camera.width // ATOM_PICTURES.cell), -(-camera.height // ATOM_PICTURES.cell)
    points, K = (
        scene.gaussians.means.double().T,
        camera.K.double() / torch.tensor([[ATOM_PICTURES.cell], [ATOM_PICTURES.cell], [1]]),
    )
    there = project_points(points, camera.viewmat.double(), K, (height, width))
    rows, z = np.flatnonzero(there.inside.numpy()), there.z.numpy()
    cells = there.pixels.numpy()[rows]
    nearest = np.full(width * height, np.inf)
    np.minimum.at(nearest, cells, z[rows])
    seen = z[rows] <= ATOM_PICTURES.near_enough * nearest[cells]
    rows, cells = rows[seen], cells[seen]
    semantics = scene.semantics
    ids = semantics.weight_ids.numpy()[rows]
    shares = (semantics.weight_values * scene.gaussians.opacities[:, None]).double().numpy()[rows]
    flat = (ids * (width * height) + cells[:, None]).ravel()
    maps = np.bincount(flat, np.nan_to_num(shares).ravel(), minlength=semantics.num_atoms * width * height)
    return maps.reshape(semantics.num_atoms, height, width)


def _crop(photo: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The square of a photo (H, W, 3) around the densest place of an atom's cells (h, w)."""
    height, width = cells.shape
    padded = np.pad(cells, 2)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (5, 5)).sum((-1, -2))
    row, column = np.unravel_index(windows.argmax(), windows.shape)
    dense = int((cells > 0.5 * cells.max()).sum())
    side = float(np.clip(1.3 * np.sqrt(dense), 6, min(height, width)))
    top = float(np.clip(row + 0.5 - side / 2, 0, height - side))
    left = float(np.clip(column + 0.5 - side / 2, 0, width - side))
    down, right = photo.shape[0] / height, photo.shape[1] / width
    box = (left * right, top * down, (left + side) * right, (top + side) * down)
    size = (ATOM_PICTURES.picture_side, ATOM_PICTURES.picture_side)
    return np.asarray(Image.fromarray(photo).resize(size, Image.Resampling.BILINEAR, box))
