"""The reference rasteriser: exact front-to-back compositing in torch, differentiable.

Per pixel p, over Gaussians i in order of depth:

    alpha_i = min(0.99, o_i exp(-|L_i^-1 (p - c_i)|^2 / 2)), 0 below 1/255
    T_i     = prod_{j < i} (1 - alpha_j)
    F(p)    = sum_i T_i alpha_i f_i

No tiles, no early stop at low transmittance, no approximation. Work is a flat list of
(pixel, Gaussian) pairs, sorted by pixel and then depth, made for one rectangle of pixels at a
time so that the list stays short; a Gaussian's pairs are the pixels of its bounding box, and
the alpha cut decides. Transmittance is an exclusive running sum of log(1 - alpha), in float64
whatever the input, restarted at each pixel. 100,000 Gaussians with 24
atoms at 224 x 224 take 1.3 s on one core where they are 1.2 px wide, 15 s at 4.5 px, below 1 GB.
"""

from collections.abc import Callable, Iterator

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.types import Camera, Frame, Gaussians, Scene

from .projection import (
    ALPHA_MAX,
    ALPHA_MIN,
    NEAR,
    Footprints,
    drawable_rows,
    project,
    view_colours,
    view_depths,
)

_MAX_PAIRS = 1 << 17  # held at once: 30 MB at 28 channels; more leave the processor's caches
_Box = tuple[int, int, int, int]  # x0, y0, x1, y1 in pixels, half open


def render(
    scene: Scene,
    camera: Camera,
    *,
    background: tuple[float, float, float] = (0.0, 0.0, 0.0),
    weight_maps: bool = True,
) -> Frame:
    """Draw colour, depth, and the K weight maps of a scene.

    Computed in float64 whatever the scene holds; the frame comes back in the scene's dtype.
    Differentiable in every Gaussian value, the weights, and the camera.

    Gaussians with a value or a weight that is not finite are left out.

    Args:
        background: colour under what is transparent, [0, 1].
        weight_maps: also composite w_ik, (H, W, K).

    Raises:
        ValueError: a weight row does not belong to a Gaussian.
    """
    dtype = scene.gaussians.means.dtype
    rows = drawable_rows(scene)
    gaussians = scene.gaussians.map(lambda v: v.double()[rows])
    layers = [view_colours(gaussians, camera), view_depths(gaussians, camera)[:, None]]
    if weight_maps:
        layers.append(scene.semantics.dense_weights().double()[rows])
    maps, alphas = rasterize(gaussians, torch.cat(layers, -1), camera)
    under = torch.tensor(background, dtype=maps.dtype, device=maps.device)
    rgb = maps[..., :3] + (1 - alphas[..., None]) * under
    covered = alphas >= ALPHA_MIN
    depths = torch.where(covered, maps[..., 3] / torch.where(covered, alphas, 1.0), 0.0)
    weights = maps[..., 4:].to(dtype) if weight_maps else None
    return Frame(rgb.to(dtype), alphas.to(dtype), depths.to(dtype), weights)


def rasterize(
    gaussians: Gaussians, features: Float[Tensor, "N F"], camera: Camera, near: float = NEAR
) -> tuple[Float[Tensor, "H W F"], Float[Tensor, "H W"]]:
    """Composite any features front to back; works in the dtype and on the device given.

    Args:
        gaussians: N of them; those with values that are not finite are left out.
        features: (N, F), composited as they are: colours, depths, weights, language vectors.
        camera: size and pose of the image.
        near: z below which a Gaussian is left out, scene units.

    Returns:
        maps (H, W, F) = sum_i T_i alpha_i f_i over black, and alphas (H, W) = 1 - T.

    Raises:
        ValueError: features and Gaussians differ in number.
    """
    if features.shape[0] != len(gaussians):
        raise ValueError(f"features: expected {len(gaussians)} rows, received {features.shape[0]}")
    footprints = project(gaussians, camera, near)
    pixels, parts = [], []
    for box, rows, clipped in _rectangles(footprints, (0, 0, camera.width, camera.height)):
        index, part = _composite(footprints, features, rows, clipped, box, camera.width)
        pixels.append(index)
        parts.append(part)
    image = features.new_zeros(camera.height * camera.width, features.shape[1] + 1)
    if pixels:
        image = image.index_copy(0, torch.cat(pixels), torch.cat(parts))
    image = image.unflatten(0, (camera.height, camera.width))
    return image[..., :-1], image[..., -1]


def _rectangles(
    footprints: Footprints, box: _Box, wanted: Callable[[_Box], bool] = lambda box: True
) -> Iterator[tuple[_Box, Tensor, Tensor]]:
    """Parts of a rectangle that footprints reach, of few pairs each; rows (k,) of those that do, and their
    boxes (k, 4) inside it. wanted: whether anybody asks for a part."""
    everyone = torch.arange(len(footprints.ids), device=footprints.ids.device)
    queue = [(box, everyone, footprints.boxes())]
    while queue:
        box, rows, boxes = queue.pop()
        if not wanted(box):
            continue
        rows, clipped, num_pairs = _clip(rows, boxes, box)
        halves = _halves(box) if num_pairs > _MAX_PAIRS else []
        if halves:
            queue.extend((half, rows, clipped) for half in halves)
        elif num_pairs:
            yield box, rows, clipped


def _halves(box: _Box) -> list[_Box]:
    """The rectangle cut across its longer side; empty for a single pixel."""
    x0, y0, x1, y1 = box
    if y1 - y0 >= x1 - x0 and y1 - y0 > 1:
        middle = (y0 + y1) // 2
        return [(x0, y0, x1, middle), (x0, middle, x1, y1)]
    if x1 - x0 > 1:
        middle = (x0 + x1) // 2
        return [(x0, y0, middle, y1), (middle, y0, x1, y1)]
    return []


def _clip(rows: Tensor, boxes: Tensor, box: _Box) -> tuple[Tensor, Tensor, int]:
    """Rows (k,) of footprints that reach a rectangle, their boxes (k, 4) inside it, and its pairs."""
    x0, y0, x1, y1 = box
    low = boxes.new_tensor((x0, y0, x0, y0))
    high = boxes.new_tensor((x1, y1, x1, y1))
    clipped = boxes.maximum(low).minimum(high)
    sides = clipped[:, 2:] - clipped[:, :2]
    areas = sides[:, 0].clamp_min(0) * sides[:, 1].clamp_min(0)
    inside = areas > 0
    return rows[inside], clipped[inside], int(areas.sum())


def _pairs(clipped: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Every (box, x, y) of boxes (k, 4), three (M,) tensors, box by box."""
    sides = clipped[:, 2:] - clipped[:, :2]
    counts = sides[:, 0] * sides[:, 1]
    rows = torch.repeat_interleave(torch.arange(len(counts), device=counts.device), counts)
    local = torch.arange(len(rows), device=counts.device) - (counts.cumsum(0) - counts)[rows]
    widths = sides[rows, 0]
    return rows, clipped[rows, 0] + local % widths, clipped[rows, 1] + local // widths


def _alphas(footprints: Footprints, rows: Tensor, xs: Tensor, ys: Tensor) -> Tensor:
    """alpha (M,) of pairs, before the cut at 1/255; gradients flow unless the 0.99 holds it."""
    centres, roots = footprints.centres[rows], footprints.roots[rows]
    u = (xs + 0.5 - centres[:, 0]) / roots[:, 0]
    v = (ys + 0.5 - centres[:, 1] - roots[:, 1] * u) / roots[:, 2]
    return (footprints.opacities[rows] * torch.exp(-0.5 * (u * u + v * v))).clamp_max(ALPHA_MAX)


def _composite(
    footprints: Footprints, features: Tensor, reaching: Tensor, clipped: Tensor, box: _Box, width: int
) -> tuple[Tensor, Tensor]:
    """The pixels of one rectangle: flat indices (P,) and values (P, F + 1), alpha last."""
    x0, y0, x1, y1 = box
    boxes, xs, ys = _pairs(clipped)
    rows = reaching[boxes]
    with torch.no_grad():
        kept = (_alphas(footprints, rows, xs, ys) >= ALPHA_MIN).nonzero().squeeze(-1)
        local = ((ys - y0) * (x1 - x0) + (xs - x0))[kept].int()
        local, order = local.sort(stable=True)  # pairs came nearest first: ties keep depth order
        kept = kept[order]
        local = local.long()
    rows, xs, ys = rows[kept], xs[kept], ys[kept]
    alphas = _alphas(footprints, rows, xs, ys)
    contributions = _transmittances(alphas, local) * alphas
    num_pixels = (x1 - x0) * (y1 - y0)
    index = torch.arange(num_pixels, device=rows.device)
    index = (y0 + index // (x1 - x0)) * width + x0 + index % (x1 - x0)
    sums = features.new_zeros(num_pixels, features.shape[1])
    sums = sums.index_add(0, local, contributions[:, None] * features[footprints.ids[rows]])
    alpha = alphas.new_zeros(num_pixels).index_add(0, local, contributions)
    return index, torch.cat((sums, alpha[:, None].to(sums)), -1)


def _transmittances(alphas: Tensor, pixels: Tensor) -> Tensor:
    """T_i (M,) before each pair, for pairs sorted by pixel and then depth."""
    logs = torch.log1p(-alphas.double())
    before = logs.cumsum(0) - logs
    starts = torch.searchsorted(pixels, pixels)  # the first pair of the same pixel
    return torch.exp(before - before[starts]).to(alphas)
