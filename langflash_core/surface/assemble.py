"""From a network's `Prediction` to a `Scene`: one unit of length, sparse weights, no bad numbers."""

import time
from dataclasses import replace

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.rig.rig import Rig
from langflash_core.scene.weights import sparse_weights
from langflash_core.surface.consistency import seen_through
from langflash_core.surface.settings import PRUNING
from langflash_core.types import Cost, Gaussians, Prediction, Record, Scene, Semantics, Views


def assemble(prediction: Prediction, views: Views, *, top_m: int = 8, preset: str = "mini") -> Scene:
    """A scene in scene units: the mean distance of view 0's points from its camera is 1.

    Views that the prediction could not place are left out, photo and all: in the wrong place
    their surfaces would hide what is right, and their depths would speak against it.

    Args:
        prediction: N = V*H*W Gaussians in the order (v h w); may hold non-finite ones.
        views: what it was predicted from. top_m: weights kept per Gaussian, renormalised.
        preset: recorded.

    Returns:
        Scene with `view_ids`, the order of the Gaussians kept, whose record has `preset`, `photos`,
        `warnings`, `counts`, `network_unit` and, of its cost, `timings`.

    Raises:
        InputError: not one usable point in view 0.
        ValueError: the prediction's sizes disagree, or its poses are not finite.
    """
    start = time.perf_counter()
    num_views, _, height, width = prediction.weights.shape
    num_predicted = len(prediction.gaussians)
    if num_predicted != num_views * height * width or num_views != views.num_views:
        raise ValueError(
            f"gaussians: expected {num_views * height * width} of {views.num_views} views, "
            f"received {num_predicted} of {num_views}"
        )
    left_out = unplaced_photos(prediction, views)
    prediction, views = placed_views(prediction, views)
    num_views, num_predicted = views.num_views, len(prediction.gaussians)
    if not bool(torch.isfinite(prediction.viewmats).all()):
        raise ValueError("viewmats: expected finite poses, received others")
    unit = mean_distance(prediction.gaussians.means[: height * width], prediction.viewmats[0])
    usable = _usable(prediction.gaussians)
    points = prediction.gaussians.means.unflatten(0, (num_views, -1))
    keep = usable & ~seen_through(rig_of(prediction, views), points).flatten()
    view_ids = torch.arange(num_views, device=keep.device).repeat_interleave(height * width)[keep]
    record = Record(
        preset=preset,
        photos=views.names,
        warnings=(*views.warnings, *prediction.warnings),
        counts={
            "predicted": num_predicted,
            "unusable": num_predicted - int(usable.sum()),
            "seen_through": int(usable.sum()) - len(view_ids),
        },
        left_out=left_out,
        network_unit=unit,
    )
    scene = Scene(
        gaussians=normalise_gaussians(prediction.gaussians.map(lambda values: values[keep]), unit),
        semantics=_semantics(prediction, keep.view(num_views, -1), top_m),
        viewmats=scaled_poses(prediction.viewmats, unit),
        Ks=views.Ks.to(prediction.viewmats).clone(),
        view_size=views.size,
        photos=views.sources,
        view_ids=view_ids,
        record=record,
    )
    timings = {**prediction.timings, "assembly": time.perf_counter() - start}
    return scene.with_record(cost=Cost(timings))


def rig_of(prediction: Prediction, views: Views) -> Rig:
    """The photos of a prediction, and what it says of where they are."""
    Ks = views.Ks.to(prediction.viewmats)
    return Rig(prediction.viewmats, Ks, prediction.depths, prediction.confidences, views.images)


def unplaced_photos(prediction: Prediction, views: Views) -> dict[str, list[str]]:
    """What a record's `left_out` says of views of unknown pose: nothing of none."""
    return {"unplaced": [views.names[v] for v in prediction.unplaced]} if prediction.unplaced else {}


def placed_views(prediction: Prediction, views: Views) -> tuple[Prediction, Views]:
    """Both without the views of unknown pose."""
    keep = [v for v in range(views.num_views) if v not in prediction.unplaced]
    if len(keep) == views.num_views:
        return prediction, views

    def kept(values: Tensor) -> Tensor:
        return values.unflatten(0, (views.num_views, -1))[keep].flatten(0, 1) if len(values) else values

    return (
        replace(
            prediction,
            gaussians=prediction.gaussians.map(kept),
            weights=prediction.weights[keep],
            viewmats=prediction.viewmats[keep],
            depths=prediction.depths[keep],
            confidences=prediction.confidences[keep],
            Ks=None if prediction.Ks is None else prediction.Ks[keep],
            unplaced=(),
        ),
        replace(
            views,
            images=views.images[keep],
            Ks=views.Ks[keep],
            names=tuple(views.names[v] for v in keep),
            viewmats=None if views.viewmats is None else views.viewmats[keep],
            sources=tuple(views.sources[v] for v in keep) if views.sources else (),
        ),
    )


def mean_distance(means: Float[Tensor, "N 3"], viewmat: Float[Tensor, "4 4"]) -> float:
    """Mean distance of points (n, 3) from the camera, over those that are finite.

    Raises:
        InputError: none is finite, or all sit in the camera.
    """
    centre = invert_rigid(viewmat)[:3, 3]
    distances = (means - centre).double().norm(dim=-1)
    distances = distances[torch.isfinite(distances)]
    mean = float(distances.mean()) if len(distances) else 0.0
    if not mean > 0:
        raise InputError(
            "no depth could be found in the first photo; use a sharper, brighter photo of a room"
        )
    return mean


def _usable(gaussians: Gaussians) -> Tensor:
    """(N,) bool: every number of the Gaussian is finite."""
    keep = torch.isfinite(gaussians.opacities)
    for values in (gaussians.means, gaussians.quats, gaussians.scales, gaussians.sh.flatten(1)):
        keep = keep & torch.isfinite(values).all(-1)
    return keep


def normalise_gaussians(gaussians: Gaussians, unit: float) -> Gaussians:
    """In units of `unit`, quaternions of unit norm, scales not below `PRUNING.min_scale`."""
    norms = gaussians.quats.float().norm(dim=-1, keepdim=True)
    identity = torch.tensor([1.0, 0, 0, 0], device=norms.device)
    quats = torch.where(norms > 1e-6, gaussians.quats.float() / norms.clamp_min(1e-6), identity)
    return Gaussians(
        means=gaussians.means.float() / unit,
        quats=quats,
        scales=(gaussians.scales.float() / unit).clamp_min(PRUNING.min_scale),
        opacities=gaussians.opacities.float().clamp(0, 1),
        sh=gaussians.sh.float(),
    )


def _semantics(prediction: Prediction, keep: Tensor, top_m: int) -> Semantics:
    """Of the Gaussians that keep (V, H*W) names. Atoms without direction are turned off; the rest become
    unit rows.

    View by view: tables of all pixels times all atoms are what memory and time go into.
    """
    finite = has_direction(prediction.dictionary)
    of_views = [
        sparse_weights(maps.flatten(1)[finite].T[own], top_m)
        for maps, own in zip(prediction.weights, keep, strict=True)
    ]
    return semantics_of(prediction, of_views)


def has_direction(dictionary: Float[Tensor, "K C"]) -> Bool[Tensor, " K"]:
    """(K,) bool: atoms (K, C) that have a direction."""
    return torch.isfinite(dictionary).all(-1) & (dictionary.norm(dim=-1) > 1e-6)


def semantics_of(
    prediction: Prediction, of_views: list[tuple[Int[Tensor, "_ m"], Float[Tensor, "_ m"]]]
) -> Semantics:
    """Over the atoms that have a direction, of ids and values (n, m) of each view's Gaussians over those."""
    ids, values = (torch.cat(parts) for parts in zip(*of_views, strict=True))
    ids = ids.long()
    dictionary = prediction.dictionary[has_direction(prediction.dictionary)]
    return Semantics(ids, values, normalize(dictionary.float(), dim=-1), prediction.space)


def scaled_poses(viewmats: Float[Tensor, "V 4 4"], unit: float) -> Float[Tensor, "V 4 4"]:
    """Poses (V, 4, 4) in units of `unit`."""
    scaled = viewmats.float().clone()
    scaled[:, :3, 3] = viewmats[:, :3, 3].float() / unit
    return scaled
