"""How far the cameras of a scene are from where the photos were taken: pure functions of poses and colours.

Poses map the world to a camera, OpenCV axes. V cameras, P pixels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from torch import Tensor

from langflash_core.lab.evaluation.side_measures import Similarity

_ROUNDS = 20
_LEAST = 5e-3
"""Error, in spreads of the walk or in radians, below which a camera pulls no harder."""


@dataclass(frozen=True)
class CameraErrors:
    """Per camera: metres from its true place, and degrees from its true direction."""

    places: Float[np.ndarray, " V"]
    rotations: Float[np.ndarray, " V"]


def centres_of(viewmats: Float[np.ndarray, "V 4 4"]) -> Float[np.ndarray, "V 3"]:
    """Where cameras stand."""
    return -np.einsum("vji,vj->vi", viewmats[:, :3, :3], viewmats[:, :3, 3])


def walked(viewmats: Float[np.ndarray, "V 4 4"]) -> float:
    """Metres from camera to camera, in order."""
    return float(np.linalg.norm(np.diff(centres_of(viewmats), axis=0), axis=1).sum())


def fitted_cameras(found: Float[np.ndarray, "V 4 4"], truth: Float[np.ndarray, "V 4 4"]) -> Similarity:
    """The similarity from the scene's world to the true one that fits cameras best, places and directions.

    Places alone leave the turn about a straight walk open, and two that are near each other tell none at all;
    so the least sum over cameras of both errors is sought: of the place, over the spread of the true places,
    and of the direction, in radians. Squares of both are minimised together, each weighted by one over what
    was left of it: what is wrong pulls nothing else, be it one camera, or where two stand.

    Args:
        found: of the scene, at least one. truth: of the same photos.

    Returns:
        A scale of 1 where the cameras of either side stand in one place.

    Source: Umeyama 1991, with the scale of Horn 1987, the ratio of both spreads, which does not shrink where
    places disagree; iteratively reweighted least squares.
    """
    axes = np.einsum("vji,vjk->vik", truth[:, :3, :3], found[:, :3, :3])  # scene to true, of each camera
    places = directions = np.ones(len(found))
    fit = Similarity(1.0, np.eye(3), np.zeros(3))
    for _ in range(_ROUNDS):
        fit, spread = _weighted(centres_of(found), centres_of(truth), axes, places, directions)
        errors = camera_errors(found, truth, fit)
        places = 1 / np.maximum(errors.places / max(spread, 1e-9), _LEAST)
        directions = 1 / np.maximum(np.radians(errors.rotations), _LEAST)
    return fit


def _weighted(
    found: np.ndarray, truth: np.ndarray, axes: np.ndarray, places: np.ndarray, directions: np.ndarray
) -> tuple[Similarity, float]:
    """The fit under weights of places and directions, and the spread of the true places."""
    shares = places / places.sum()
    middle, true_middle = shares @ found, shares @ truth
    centred, true_centred = found - middle, truth - true_middle
    own, true = (math.sqrt(float(shares @ (c**2).sum(1))) for c in (centred, true_centred))
    moving = min(own, true) > 1e-9
    covariance = (true_centred * shares[:, None]).T @ centred
    together = np.einsum("v,vij->ij", directions, axes)
    if moving:
        together = together + covariance * (places.sum() / (own * true))
    u, _, vt = np.linalg.svd(together)
    rotation = (u * np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])) @ vt
    scale = true / own if moving else 1.0
    return Similarity(scale, rotation, true_middle - scale * rotation @ middle), true


def camera_errors(
    found: Float[np.ndarray, "V 4 4"], truth: Float[np.ndarray, "V 4 4"], fit: Similarity
) -> CameraErrors:
    """What is left after a fit."""
    moved = centres_of(found) @ (fit.scale * fit.rotation).T + fit.shift
    turned = np.einsum("vij,kj->vik", found[:, :3, :3], fit.rotation)  # of the true world to the camera
    between = np.einsum("vij,vkj->vik", turned, truth[:, :3, :3])
    sines = np.stack([between[:, 2, 1] - between[:, 1, 2], between[:, 0, 2] - between[:, 2, 0],
                      between[:, 1, 0] - between[:, 0, 1]], 1)  # fmt: skip
    cosines = np.trace(between, axis1=1, axis2=2) - 1
    rotations = np.degrees(np.arctan2(np.linalg.norm(sines, axis=1), cosines))
    return CameraErrors(np.linalg.norm(moved - centres_of(truth), axis=1), rotations)


def lit(drawn: Float[Tensor, "P 3"], photo: Float[Tensor, "P 3"]) -> Float[Tensor, "P 3"]:
    """Drawn colours under the photo's light: a gain and an offset per channel, by least squares.

    A photo that was kept from the scene has an exposure of its own, which nothing tells.
    """
    middle, true_middle = drawn.mean(0), photo.mean(0)
    centred = drawn - middle
    gains = (centred * (photo - true_middle)).mean(0) / centred.square().mean(0).clamp_min(1e-9)
    return gains * centred + true_middle


def lens_ratio(Ks: Sequence[Tensor], truth: Sequence[Tensor]) -> float:
    """f / f*, mean over cameras, f the mean of both focal lengths in pixels."""
    pairs = zip(Ks, truth, strict=True)
    return float(np.mean([float((K[0, 0] + K[1, 1]) / (T[0, 0] + T[1, 1])) for K, T in pairs]))
