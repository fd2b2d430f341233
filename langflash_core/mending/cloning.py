"""A clone brush: what lies round one place is laid on the surface at another.

The brushed pixels show a surface, which is a plane with heights over it; where most of them show nothing,
it is what lies around them. Round the source is a plane, too. The similarity

    x' = s R (x - a) + b

takes the source a to where the stroke begins, b, and one plane's normal to the other's by the smallest
turn. What lies near the source's plane and comes to lie in the pixels is copied, lifted by the height of
the surface there; what it covers goes. s is 1, so that boards and tiles stay as large as they are, unless
copies are to be as close together as what is there. Nobody saw any of it there: confidences of copies are 0.

Sizes: N Gaussians, H W pixels, n m points.
"""

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.spatial import KDTree
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.mending.settings import CLONING
from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import UNTURNED, Moved, Spot, Turn, turn_about, turn_matrix
from langflash_core.scene.mask import Mask
from langflash_core.scene.selection import spacing
from langflash_core.splat import drawable_rows, project
from langflash_core.splat.picking import seen_in
from langflash_core.types import Camera, Gaussians, Scene

from .looks import Render
from .planes import Plane, planes


@dataclass(frozen=True)
class Stroke:
    """Where a brush went. pixels (H, W): of the camera's picture. start: x and y of where it began, and
    radius of the brush, in pixels."""

    camera: Camera
    pixels: Bool[np.ndarray, "H W"]
    start: tuple[float, float]
    radius: float

    def dilate(self, around: float) -> Bool[np.ndarray, "H W"]:
        """The pixels with all within so many of them."""
        reach = math.ceil(around)
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
        return cv2.dilate(self.pixels.astype(np.uint8), disc) > 0

    def holds(self, centres: Float[np.ndarray, "n 2"], around: float = 0.0) -> Bool[np.ndarray, " n"]:
        """Whether places in the picture, NaN for none, are in the pixels or so many beside them."""
        mask = self.dilate(around)
        x, y = np.floor(np.nan_to_num(centres, nan=-1.0)).T
        inside = (x >= 0) & (y >= 0) & (x < mask.shape[1]) & (y < mask.shape[0])
        return inside & mask[np.where(inside, y, 0).astype(int), np.where(inside, x, 0).astype(int)]

    def ray(self) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """Of the start, in the world: the eye, and a unit direction. An orthographic eye is far behind."""
        pose = invert_rigid(self.camera.viewmat.cpu().double()).numpy()
        K = self.camera.K.cpu().double().numpy()
        x, y = (self.start[0] - K[0, 2]) / K[0, 0], (self.start[1] - K[1, 2]) / K[1, 1]
        if self.camera.orthographic:
            return pose[:3, :3] @ (x, y, -CLONING.away) + pose[:3, 3], pose[:3, 2]
        ahead = pose[:3, :3] @ (x, y, 1.0)
        return pose[:3, 3], ahead / np.linalg.norm(ahead)

    def unit(self, point: Float[np.ndarray, " 3"]) -> float:
        """What a pixel covers at a point's depth, scene units."""
        viewmat = self.camera.viewmat.cpu().double().numpy()
        depth = 1.0 if self.camera.orthographic else float(viewmat[2, :3] @ point + viewmat[2, 3])
        return depth / float(self.camera.K[0, 0])


def clone(
    scene: Scene,
    visible: Bool[Tensor, " N"],
    source: Spot,
    stroke: Stroke,
    render: Render,
    *,
    fit: bool = False,
) -> tuple[Scene, Bool[Tensor, " N"]]:
    """What a stroke lays on the surface that it is brushed over, and what that covers.

    Args:
        visible: (N,) bool, what takes part. source: in the world, scene units. render: draws scenes.
        fit: copies are scaled, within `CLONING.scales`, until they lie as close together as what is there.

    Returns:
        A scene of n > 0 Gaussians of the same dictionary, to be appended, and (N,) bool, to be deleted.

    Raises:
        InputError: no surface is seen round the pixels, or nothing lies round the source.
    """
    rows = visible.cpu().bool() & drawable_rows(scene)
    shown = scene.rows(rows)
    seen = _visible_surface(shown, stroke, render)
    surface = _surface(seen, stroke)
    near, move = _move_to_stroke(seen.points, np.array(source), surface, stroke.radius, fit)
    part = _of_all_layers(shown.rows(torch.from_numpy(near)))
    move = replace(move, rows=Mask.full(len(part.gaussians)))
    laid = _lift_to_surface(apply_changes(part.gaussians, (move,)), surface)
    here = torch.from_numpy(stroke.holds(_centres(laid, stroke.camera), CLONING.rim))
    if not here.any():
        raise InputError("nothing lies round the source where the brush would copy it; choose another source")
    copies = replace(part.rows(here), gaussians=laid.rows(here))
    if copies.confidences is not None:
        copies = replace(copies, confidences=torch.zeros_like(copies.confidences))
    gone = torch.zeros(len(rows), dtype=torch.bool)
    gone[rows] = torch.from_numpy(_covered_gaussians(seen, surface, stroke))
    return copies, gone


def _of_all_layers(part: Scene) -> Scene:
    """What lies near the source, as the layer has it that has most there, for every layer; as it is where
    there are none."""
    if not part.layered or part.view_ids is None or not bool((part.view_ids >= 0).any()):
        return part
    ids = part.view_ids
    most = int(ids[ids >= 0].bincount().argmax())
    part = part.rows((ids == most) | (ids < 0))
    return replace(part, view_ids=torch.full((len(part.gaussians),), -1))


@dataclass(frozen=True)
class _Seen:
    """Of all N that take part: places, places in the picture (NaN: in none), depths, whether one sees them.
    here (N,): those that are seen in the pixels, or around them where most of them show nothing. layered:
    seen in a layer, whose surface may lie a little before or behind another's."""

    points: Float[np.ndarray, "N 3"]
    centres: Float[np.ndarray, "N 2"]
    depths: Float[np.ndarray, " N"]
    seen: Bool[np.ndarray, " N"]
    here: Bool[np.ndarray, " N"]
    layered: bool


def _visible_surface(shown: Scene, stroke: Stroke, render: Render) -> _Seen:
    camera, gaussians = stroke.camera, shown.gaussians.map(lambda values: values.detach().cpu().double())
    points, viewmat = gaussians.means.numpy(), camera.viewmat.cpu().double().numpy()
    depths, centres = points @ viewmat[2, :3] + viewmat[2, 3], _centres(gaussians, camera)
    alphas = render(shown, camera, weight_maps=False).alphas.cpu().numpy()[stroke.pixels]
    closed = bool(alphas.size) and float((alphas >= CLONING.half).mean()) >= CLONING.half
    for around in (0.0, 2 * stroke.radius):
        seen = seen_in(shown, np.ones(len(points), bool), camera, stroke.dilate(around))
        here = seen & stroke.holds(centres, around)
        if closed and here.sum() >= CLONING.nearest:
            break
    return _Seen(points, centres, depths, seen, here, shown.layered)


def _centres(gaussians: Gaussians, camera: Camera) -> Float[np.ndarray, "n 2"]:
    """Where Gaussians are in a picture, pixels; NaN for those that are not in it."""
    found = project(gaussians.map(lambda values: values.detach().cpu().double()), camera)
    centres = np.full((len(gaussians), 2), np.nan)
    centres[found.ids.numpy()] = found.centres.numpy()
    return centres


@dataclass(frozen=True)
class _Surface:
    """What is brushed over: a plane, its normal towards the eye, and the heights (n,) over it of points whose
    places along it are flat (n, 2). start: on the plane. unit: of a pixel there. far: as the
    stroke goes. spacing: of the points."""

    plane: Plane
    flat: Float[np.ndarray, "n 2"]
    heights: Float[np.ndarray, " n"]
    start: Float[np.ndarray, " 3"]
    unit: float
    far: float
    spacing: float
    eye: Float[np.ndarray, " 3"]

    def height(self, points: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        """Of the surface over its plane where points are: the median of the nearest ones' heights."""
        count = min(CLONING.nearest, len(self.flat))
        which = KDTree(self.flat).query(points @ self.plane.basis().T, k=count)[1]
        return np.median(self.heights[np.reshape(which, (-1, count))], axis=1)


def _surface(seen: _Seen, stroke: Stroke) -> _Surface:
    points, slack = seen.points[seen.here], CLONING.far * seen.depths[seen.here]
    found = planes(points, slack, share=CLONING.share, most=1)
    if not found:
        raise InputError("no surface is seen where the brush went; brush over one")
    eye, ahead = stroke.ray()
    plane = _facing(found[0], eye)
    start = _meeting(plane, eye, ahead)
    if start is None:
        nearest = points[np.linalg.norm(seen.centres[seen.here] - stroke.start, axis=1).argmin()]
        start = nearest - _apart(plane, nearest) * plane.normal
    unit = stroke.unit(start)
    heights = plane.apart(points)
    on_it = abs(heights) <= 2 * slack
    far = float(np.linalg.norm(points[on_it] - start, axis=1).max()) + 2 * unit * stroke.radius
    flat = points[on_it] @ plane.basis().T
    return _Surface(plane, flat, heights[on_it], start, unit, far, spacing(points[on_it]), eye)


def _covered_gaussians(seen: _Seen, surface: _Surface, stroke: Stroke) -> Bool[np.ndarray, " N"]:
    """What lies on the surface in the pixels, and what is seen there before it; of layers, all of that."""
    inside, found = stroke.holds(seen.centres), np.zeros(len(seen.points), bool)
    points, slack = seen.points[inside], 2 * CLONING.far * seen.depths[inside]
    over = surface.plane.apart(points) - surface.height(points)
    found[inside] = (abs(over) <= slack) | (seen.seen[inside] & ((over > 0) | seen.layered))
    return found


def _move_to_stroke(
    points: Float[np.ndarray, "N 3"],
    source: Float[np.ndarray, " 3"],
    surface: _Surface,
    radius: float,
    fit: bool,
) -> tuple[Bool[np.ndarray, " N"], Moved]:
    """(N,) bool, what lies near enough to the source and its plane; and how that comes to the stroke."""
    brush, apart = surface.unit * radius, np.linalg.norm(points - source, axis=1)
    least = np.sort(apart)[min(CLONING.nearest, len(points)) - 1]
    around = points[apart <= max(brush, least)]
    found = planes(
        around, np.full(len(around), CLONING.flat * max(brush, least)), share=CLONING.share, most=1
    )
    if not found:
        raise InputError("nothing lies round the source; choose another source")
    base, scale = _facing(found[0], surface.eye), 1.0
    if fit:
        scale = float(np.clip(surface.spacing / max(spacing(around), 1e-12), *CLONING.scales))
    foot = source - _apart(base, source) * base.normal
    near = abs(base.apart(points)) <= max(CLONING.relief * brush / scale, CLONING.flat * least)
    near &= np.linalg.norm(points - foot, axis=1) <= surface.far / scale
    turn = _smallest_turn(base, surface.plane)
    offset = surface.start - scale * turn_matrix(turn) @ foot
    return near, Moved(Mask.full(int(near.sum())), turn, scale, _spot(offset))


def _lift_to_surface(laid: Gaussians, surface: _Surface) -> Gaussians:
    """Gaussians on the surface instead of on its plane."""
    if not len(laid):
        return laid
    means = laid.means.cpu().double().numpy()
    means = means + surface.height(means)[:, None] * surface.plane.normal
    return replace(laid, means=torch.from_numpy(means).to(laid.means))


def _apart(plane: Plane, point: Float[np.ndarray, " 3"]) -> float:
    """Distance of one point."""
    return float(plane.apart(point[None])[0])


def _facing(plane: Plane, eye: Float[np.ndarray, " 3"]) -> Plane:
    """The plane with its normal towards the eye."""
    return plane if _apart(plane, eye) >= 0 else replace(plane, normal=-plane.normal, offset=-plane.offset)


def _meeting(
    plane: Plane, eye: Float[np.ndarray, " 3"], ahead: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, " 3"] | None:
    """Where a ray meets a plane; None where it hardly does."""
    down = float(ahead @ plane.normal)
    return eye - _apart(plane, eye) / down * ahead if down < -CLONING.grazing else None


def _smallest_turn(base: Plane, plane: Plane) -> Turn:
    """That takes one plane's normal to the other's; of opposite ones about any axis along the plane."""
    axis, along = np.cross(base.normal, plane.normal), float(base.normal @ plane.normal)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return UNTURNED if along > 0 else turn_about(_spot(base.basis()[0]), 180.0)
    return turn_about(_spot(axis), math.degrees(math.atan2(sine, along)))


def _spot(values: Float[np.ndarray, " 3"]) -> Spot:
    x, y, z = values.tolist()
    return x, y, z
