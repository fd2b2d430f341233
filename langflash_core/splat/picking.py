"""What a person points at: the Gaussians that some pixels show, and what one pixel is made of.

In a scene of layers (`compose`) a picture decides how deep a pixel is, and each layer tells which of its
Gaussians show what is there: so a thing is pointed at in all layers, also in those that the picture leaves
out, and not what one of them has behind a thing that it does not show.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from langflash_core.geometry.nearness import Nearness
from langflash_core.types import Camera, Gaussians, Scene, Semantics

from .compose import DEPTH, shares
from .contributions import composition, contributions
from .frustum import may_touch
from .mixing import mixing
from .projection import ALPHA_MIN, Footprints, project, view_depths

SEEN = 0.05  # of a pixel's colour: a Gaussian that adds less anywhere in a region is not seen there


def seen_in(
    scene: Scene,
    visible: Bool[np.ndarray, " N"],
    camera: Camera,
    pixels: Bool[np.ndarray, "H W"],
    *,
    through: bool = False,
) -> Bool[np.ndarray, " N"]:
    """Gaussians that add at least `SEEN` to some of the pixels; of layers, to their own picture, at a depth
    within `compose.DEPTH` of what the blended one shows there.

    Args:
        visible: (N,) bool, what takes part: the rest neither covers nor is found.
        pixels: (H, W) bool, of the camera's size.
        through: also what is hidden behind other things.

    Returns:
        (N,) bool.

    Raises:
        ValueError: the pixels are not of the camera's size.
    """
    near = None if through or not scene.layered else Nearness.of(scene)
    if pixels.shape == (camera.height, camera.width):
        if not pixels.any():
            return np.zeros(len(visible), bool)
        visible = visible & may_touch(scene.gaussians, camera, _box(pixels))
    if near is not None and near.views and pixels.shape == (camera.height, camera.width):
        return _seen_in_layers(scene, near, visible, camera, pixels)
    rows, shown = _visible_gaussians(scene.gaussians, visible)
    parts = contributions(shown, camera, torch.from_numpy(pixels), through=through)
    found = np.zeros(len(visible), bool)
    found[rows[parts >= SEEN].numpy()] = True
    return found


def _box(pixels: Bool[np.ndarray, "H W"]) -> tuple[float, float, float, float]:
    """The box around some pixels."""
    lines, columns = np.flatnonzero(pixels.any(1)), np.flatnonzero(pixels.any(0))
    return (float(columns[0]), float(lines[0]), float(columns[-1] + 1), float(lines[-1] + 1))


def _seen_in_layers(
    scene: Scene, near: Nearness, visible: np.ndarray, camera: Camera, pixels: np.ndarray
) -> Bool[np.ndarray, " N"]:
    """`seen_in` of a scene of layers."""
    chosen, layers = near.chosen(camera), {}
    for view in near.views:
        rows, shown = _visible_gaussians(scene.gaussians, visible & _of_layer(scene, view))
        matrix = mixing(project(shown, camera), camera, len(rows), ALPHA_MIN, 0.0, pixels)[pixels.ravel()]
        layers[view] = rows.numpy(), matrix, view_depths(shown, camera).nan_to_num(0, 0, 0).numpy()
    drawn = [layers[view] for view in chosen.views]
    alphas = np.stack([np.asarray(matrix.sum(1)).ravel() for _, matrix, _ in drawn])
    depths = np.stack([matrix @ z for _, matrix, z in drawn]) / np.maximum(alphas, ALPHA_MIN)
    b = shares(
        torch.from_numpy(alphas)[:, None], torch.from_numpy(depths).to(torch.float32)[:, None], chosen.weights
    )
    alpha = (b[:, 0].numpy() * alphas).sum(0)
    deep = (b[:, 0].numpy() * alphas * depths).sum(0) / np.maximum(alpha, ALPHA_MIN)
    found = np.zeros(len(visible), bool)
    for rows, matrix, z in layers.values():
        entries = matrix.tocoo()
        there = (entries.data >= SEEN) & (deep[entries.row] > 0) & (z[entries.col] > 0)
        pixel, column = entries.row[there], entries.col[there]
        found[rows[column[np.abs(np.log(z[column] / deep[pixel])) <= DEPTH]]] = True
    return found


@dataclass(frozen=True)
class Sight:
    """What a camera sees of a scene, or of one of its layers. rows (n,): of what is visible; footprints:
    theirs; depths (n,): z, scene units. weight: what the layer counts."""

    rows: Int[Tensor, " n"]
    footprints: Footprints
    depths: Float[Tensor, " n"]
    weight: float


def sights(scene: Scene, visible: Bool[np.ndarray, " N"], camera: Camera) -> tuple[Sight, ...]:
    """What is visible in a view, layer by layer; for any number of `weights_at`."""
    near = Nearness.of(scene) if scene.layered else None
    visible = visible & may_touch(scene.gaussians, camera)
    if near is None or not near.views:
        return (_sight(scene, visible, camera, 1.0),)
    chosen = near.chosen(camera)
    return tuple(
        _sight(scene, visible & _of_layer(scene, view), camera, float(weight))
        for view, weight in zip(chosen.views, chosen.weights, strict=True)
    )


def weights_at(semantics: Semantics, seen: tuple[Sight, ...], x: int, y: int) -> Float[Tensor, " K"]:
    """Weights (K,) float32 of a pixel, W_k = sum_i T_i alpha_i w_ik, composed exactly, and blended.

    Args:
        seen: as `sights` gives it.
    """
    pieces = [composition(sight.footprints, x, y) for sight in seen]
    alphas = torch.stack([parts.sum() for _, parts in pieces])
    sums = torch.stack(
        [parts @ sight.depths[here] for sight, (here, parts) in zip(seen, pieces, strict=True)]
    )
    counts = torch.ones(1, dtype=torch.float64)
    if len(seen) > 1:
        depths = sums / alphas.clamp_min(ALPHA_MIN)
        own = np.array([sight.weight for sight in seen])
        counts = shares(alphas[:, None, None], depths[:, None, None], own)[:, 0, 0]
    weights = torch.zeros(semantics.num_atoms, dtype=torch.float64)
    for sight, (here, parts), count in zip(seen, pieces, counts, strict=True):
        ids, values = (each[sight.rows[here]] for each in (semantics.weight_ids, semantics.weight_values))
        weights.index_add_(0, ids.flatten(), (values * (count * parts)[:, None]).flatten())
    return weights.float()


def _sight(scene: Scene, visible: np.ndarray, camera: Camera, weight: float) -> Sight:
    rows, shown = _visible_gaussians(scene.gaussians, visible)
    return Sight(rows, project(shown, camera), view_depths(shown, camera).nan_to_num(0, 0, 0), weight)


def _of_layer(scene: Scene, view: int) -> Bool[np.ndarray, " N"]:
    assert scene.view_ids is not None
    ids = scene.view_ids.cpu().numpy()
    return (ids == view) | (ids < 0)


def _visible_gaussians(gaussians: Gaussians, visible: np.ndarray) -> tuple[Tensor, Gaussians]:
    rows = torch.from_numpy(np.flatnonzero(visible))
    return rows, gaussians.map(lambda values: values[rows].double())
