"""A view of a scene of layers: drawn from the photos nearest to it, each layer into a picture of its own,
blended pixel by pixel.

A layer is what one photo shows, whole and closed (`Scene.layered`). Which layers a camera sees, and how
much each counts, follows from the way d_v to the photo's place, in median distances of the scene, and the
angle a_v between the axes, radians, together f_v = d_v + a_v + FLOOR:

    w_v = 1 / f_v^2 - 1 / f_(L+1)^2     of the L nearest photos, f_(L+1) of the next one,

so that a layer counts nothing where another takes its place: pictures are continuous in the camera. In a
pixel layer i has alpha A_i and depth z_i, and is supported by all that lie about as deep,

    S_i = A_i sum_j w_j A_j exp(-(ln(z_i / z_j) / DEPTH)^2),     b_i ~ w_i A_i (S_i / max_j S_j)^4,

b in sum 1: layers that agree are blended, of others the best supported shows, and a hole in one is filled by
the next. (With the square two real films gain .06 dB and show things twice, with the eighth power they lose
.1.) Where a layer ends its alpha falls, and so would sum_i b_i A_i though another is opaque there, a dark
line along every edge: b is raised until that sum is

    max_i A_i min(1, w_i A_i / (CLOSES sum_j w_j A_j)).

The same numbers blend everything, F = sum_i b_i F_i of colours, depths, alphas and weight maps, so what
is linear in a layer stays linear: W = sum_i b_i W_i, and the feature of a pixel is W D.

Sizes: V views, L layers of a picture, H W pixels.

Source: own derivation; the weights follow Buehler et al. 2001, "Unstructured lumigraph rendering", section 4.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.nearness import Nearness
from langflash_core.types import Camera, Frame, Scene

from . import reference
from .projection import ALPHA_MIN

DEPTH = 0.1
"""Of the logarithm of depth, at which two layers still support each other by 1 / e: between .04 and .2 real
films change by .1 dB and .01 in structure."""


CLOSES = 0.005
"""Share of w_i A_i from which a layer lets no light through where it is opaque itself: at a photo's place the
next one has some .015, the third of a close film .003. One that comes or goes changes nothing at once."""


def some_layers(scene: Scene, most: int) -> Scene:
    """A scene of layers with at most so many of them, all over the walk; with one or none, a scene without
    layers."""
    assert scene.view_ids is not None
    kept = Nearness.of(scene).spread(most)
    if len(kept) <= 1:
        return scene.layer(*kept) if kept else scene.with_record(layered=False)
    ids = scene.view_ids
    return scene.rows((ids < 0) | torch.isin(ids, torch.tensor(kept, device=ids.device)))


def shares(
    alphas: Float[Tensor, "L H W"], depths: Float[Tensor, "L H W"], weights: Float[np.ndarray, " L"]
) -> Float[Tensor, "L H W"]:
    """What each layer counts in each pixel, in sum 1 or more; 0 where no layer shows anything.

    Args:
        alphas: in [0, 1]. depths: z, scene units, anything where alpha is 0. weights: of the layers.
    """
    counts = torch.from_numpy(weights).to(alphas)[:, None, None] * alphas
    logs = depths.clamp_min(1e-9).log()
    support = torch.stack([(counts * torch.exp(-(((log - logs) / DEPTH) ** 2))).sum(0) for log in logs])
    support = alphas * support
    best = support.amax(0).clamp_min(1e-30)
    blend = counts * (support / best).square().square()
    blend = blend / blend.sum(0).clamp_min(1e-30)
    closed = (alphas * (counts / (CLOSES * counts.sum(0)).clamp_min(1e-30)).clamp_max(1)).amax(0)
    return blend * (closed / (blend * alphas).sum(0).clamp_min(1e-30)).clamp_min(1)


def blend_layers(frames: Sequence[Frame], weights: Float[np.ndarray, " L"]) -> Frame:
    """One picture of those of layers over black, by `shares`.

    Args:
        frames: of the layers, of one size, all with weight maps or none.
    """
    alphas = torch.stack([frame.alphas for frame in frames])
    depths = torch.stack([frame.depths for frame in frames])
    b = shares(alphas, depths, weights)
    alpha = (b * alphas).sum(0)
    sums = (b * alphas * depths).sum(0)
    depth = torch.where(alpha >= ALPHA_MIN, sums / alpha.clamp_min(ALPHA_MIN), 0.0)
    rgb = sum((own[..., None] * frame.rgb for own, frame in zip(b, frames, strict=True)), torch.zeros(()))
    maps = None
    if all(frame.weight_maps is not None for frame in frames):
        maps = torch.zeros_like(_maps(frames[0]))
        for own, frame in zip(b, frames, strict=True):
            maps += own[..., None] * _maps(frame)
    return Frame(rgb, alpha, depth, maps)


def layers_of(scene: Scene, camera: Camera) -> tuple[list[Scene], Float[np.ndarray, " L"]]:
    """The layers that a camera sees as scenes of their own, and what each counts."""
    chosen = Nearness.of(scene).chosen(camera)
    return [scene.layer(view) for view in chosen.views], chosen.weights


def render(
    scene: Scene,
    camera: Camera,
    *,
    background: tuple[float, float, float] = (0.0, 0.0, 0.0),
    weight_maps: bool = True,
) -> Frame:
    """`reference.render` of a scene, layers and all.

    Raises:
        as `reference.render`.
    """
    parts, weights = layers_of(scene, camera) if scene.layered else ([], np.ones(0))
    if not parts:
        return reference.render(scene, camera, background=background, weight_maps=weight_maps)
    frames = [reference.render(part, camera, weight_maps=weight_maps) for part in parts]
    frame = blend_layers(frames, weights)
    under = torch.tensor(background).to(frame.rgb)
    return replace(frame, rgb=frame.rgb + (1 - frame.alphas[..., None]) * under)


def _maps(frame: Frame) -> Tensor:
    assert frame.weight_maps is not None
    return frame.weight_maps
