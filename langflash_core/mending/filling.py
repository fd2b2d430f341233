"""What was behind a part that was taken out: walls and floors go on as planes, under what is left around.

Where the part covered a pixel and nothing is left there, is a hole. Planes are found among what the views
show around their holes, but for those that much of it lies behind. A ray through a hole meets the planes that
lie around it there; it ends at the nearest one that is not before what was taken away: so two walls meet in
their corner. Where no plane lies around, depth is interpolated from the edge as 1 / z, which a plane's is
linear in. What another view sees through is not filled.

Every plane becomes a flat picture, in which holes are filled by what is around them (`texture.py`), and one
flat Gaussian per pixel of its hole, with the weights of the nearest known pixel. Nobody saw any of it:
confidences of what is filled are 0.

Sizes: H W pixels of a view, h w of a plane's picture, n points.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from scipy import ndimage
from torch import Tensor

from langflash_core.geometry.cameras import invert_rigid, rays, transform, unproject
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.geometry.surfels import ellipses, spans
from langflash_core.mending.settings import FILLING
from langflash_core.rig.projected import project_points
from langflash_core.scene.joining import append_part
from langflash_core.scene.weights import sparse_weights
from langflash_core.surface.settings import EXPOSURE
from langflash_core.types import Camera, Gaussians, Scene

from .looks import Render, mattes
from .planes import Plane, planes
from .texture import diffuse, heal

_BRIGHTEST = EXPOSURE.gain_range[1] + EXPOSURE.largest_offset  # a photo's white in the scene's light


@dataclass(frozen=True)
class _View:
    """What one photo's place shows without the part. rays (H, W, 3) in the world, z = 1 in the camera; eye
    (3,); colours (H, W, 3); depths (H, W), 0 for nothing; before (H, W), depths with the part; hole, ring
    (H, W); number of the photo."""

    camera: Camera
    rays: Float[np.ndarray, "H W 3"]
    eye: Float[np.ndarray, " 3"]
    colours: Float[np.ndarray, "H W 3"]
    depths: Float[np.ndarray, "H W"]
    before: Float[np.ndarray, "H W"]
    hole: Bool[np.ndarray, "H W"]
    ring: Bool[np.ndarray, "H W"]
    weights: Float[np.ndarray, "H W K"] | None
    number: int

    def points(self, depths: Float[np.ndarray, "H W"]) -> Float[np.ndarray, "H W 3"]:
        return self.eye + self.rays * depths[..., None]

    def pixels(
        self, points: Float[np.ndarray, "n 3"]
    ) -> tuple[
        Bool[np.ndarray, " n"], Integer[np.ndarray, " n"], Integer[np.ndarray, " n"], Float[np.ndarray, " n"]
    ]:
        """Whether points are in the picture, their rows, columns and depths."""
        height, width = self.hole.shape
        camera = self.camera.viewmat.double(), self.camera.K.double()
        there = project_points(torch.from_numpy(points).double().T, *camera, (height, width))
        pixels = there.pixels.numpy()
        return there.inside.numpy(), pixels // width, pixels % width, there.z.numpy()


def fill(scene: Scene, removed: Tensor, render: Render) -> Scene:
    """What belongs where a part was, as Gaussians of the scene's own dictionary, to be appended to what is
    left.

    Args:
        removed: (N,) bool, the part. render: draws scenes.

    Returns:
        A scene of n >= 0 Gaussians.
    """
    left = scene.rows(~removed)
    views = _views(scene, left, removed, render)
    none = left.rows(torch.zeros(0, dtype=torch.int64))
    flat, rest = _on_planes(views, _planes_around(views), none) if views else (none, [])
    for view, missing in zip(views, rest, strict=True):
        flat = append_part(flat, _fill_smoothly(view, missing, append_part(left, flat), render, none))
    return flat


def _views(scene: Scene, left: Scene, removed: Tensor, render: Render) -> list[_View]:
    cameras = [_resize_camera(scene.camera(view)) for view in range(scene.num_views)]
    shown = mattes(scene, removed, cameras, render)
    order = sorted(range(len(cameras)), key=lambda view: -float(shown[view][0].sum()))[: FILLING.most_views]
    found = [
        _view(left, cameras[v], *shown[v], v, render)
        for v in order
        if float(shown[v][0].sum()) >= FILLING.least
    ]
    return [view for view in found if view.hole.sum() >= FILLING.least]


def _resize_camera(camera: Camera) -> Camera:
    longer = max(camera.width, camera.height)
    ratio = min(FILLING.finer, max(1, FILLING.most_side / longer))
    return camera.with_size(max(1, round(camera.width * ratio)), max(1, round(camera.height * ratio)))


def _view(left: Scene, camera: Camera, matte: Tensor, before: Tensor, number: int, render: Render) -> _View:
    frame = render(left, camera)
    alphas = frame.alphas.cpu().numpy()
    hole = ((matte.numpy() > 0.1) & (alphas < 0.5)) | ((matte.numpy() >= 0.5) & (alphas < 0.9))
    size = 2 * max(2, round(FILLING.ring * max(hole.shape))) + 1
    ring = (cv2.dilate(hole.astype(np.uint8), np.ones((size, size), np.uint8)) > 0) & (alphas >= 0.9) & ~hole
    pose = invert_rigid(camera.viewmat.cpu().double())
    ahead = rays(camera.K.cpu().double(), camera.width, camera.height) @ pose[:3, :3].T
    straight = frame.rgb.cpu().numpy() / np.maximum(alphas, 1 / 255)[..., None]
    return _View(
        camera, ahead.numpy(), pose[:3, 3].numpy(), straight.clip(0, _BRIGHTEST).astype(np.float64),
        np.where(alphas >= 0.9, frame.depths.cpu().numpy(), 0.0).astype(np.float64),
        before.double().numpy(), hole, ring & (frame.depths.cpu().numpy() > 0),
        None if frame.weight_maps is None else frame.weight_maps.cpu().numpy(), number,
    )  # fmt: skip


def _planes_around(views: Sequence[_View]) -> list[Plane]:
    points = np.concatenate([view.points(view.depths)[view.ring] for view in views])
    depths = np.concatenate([view.depths[view.ring] for view in views])
    eyes = np.concatenate([np.broadcast_to(view.eye, (int(view.ring.sum()), 3)) for view in views])
    step = max(1, len(points) // 5000)
    points, eyes, far = points[::step], eyes[::step], FILLING.far * depths[::step]
    found = planes(points, far, share=FILLING.share, most=FILLING.most_planes)
    return [plane for plane in found if _bounds(plane, points, eyes, far)]


def _bounds(
    plane: Plane,
    points: Float[np.ndarray, "n 3"],
    eyes: Float[np.ndarray, "n 3"],
    far: Float[np.ndarray, " n"],
) -> bool:
    """Whether little of what is around lies behind a plane, as it does behind a chair's back: it goes on."""
    behind = plane.apart(points) * np.sign(plane.apart(eyes)) < -2 * far
    return float(behind.mean()) <= FILLING.behind


def _on_planes(
    views: Sequence[_View], found: Sequence[Plane], none: Scene
) -> tuple[Scene, list[Bool[np.ndarray, "H W"]]]:
    """The patches of all planes, and the pixels of each view's hole that no plane lies around."""
    chosen = [_choose_planes(view, found) for view in views]
    flat = none
    for number, plane in enumerate(found):
        spots = [
            view.points(depth)[which == number] for view, (which, depth) in zip(views, chosen, strict=True)
        ]
        if sum(map(len, spots)):
            flat = append_part(flat, _patch(plane, np.concatenate(spots), views, none))
    return flat, [view.hole & (which < 0) for view, (which, _) in zip(views, chosen, strict=True)]


def _choose_planes(
    view: _View, found: Sequence[Plane]
) -> tuple[Integer[np.ndarray, "H W"], Float[np.ndarray, "H W"]]:
    """The plane that each pixel of the hole shows, -1 for none, and its depth there, 0 for none."""
    which, depth = np.full(view.hole.shape, -1), np.full(view.hole.shape, np.inf)
    if not found or not view.ring.any():
        return which, np.zeros_like(depth)
    points = view.points(view.depths)
    apart = np.stack([abs(plane.apart(points)) for plane in found])  # (p, H, W)
    label = np.where(view.ring & (apart.min(0) <= 2 * FILLING.far * view.depths), apart.argmin(0), -1)
    any_surface = np.asarray(ndimage.distance_transform_edt(~view.ring))
    for number, plane in enumerate(found):
        if not (label == number).any():
            continue
        reach = np.asarray(ndimage.distance_transform_edt(label != number))
        down = view.rays @ plane.normal
        hit = (plane.offset - plane.normal @ view.eye) / np.where(abs(down) > 1e-9, down, 1e-9)
        steep = abs(down) > FILLING.grazing * np.linalg.norm(view.rays, axis=-1)
        behind = (hit > FILLING.before * np.where(view.before > 0, view.before, 0)) & (hit > 1e-6)
        there = view.hole & steep & behind & (reach <= FILLING.reached * any_surface + 3) & (hit < depth)
        alike = np.array([abs(plane.normal @ other.normal) > FILLING.parallel for other in found])
        # a curtain's, just before its wall's
        there &= (which < 0) | ~alike[which] | (hit < FILLING.close * depth)
        which[there], depth[there] = number, hit[there]
    return which, np.where(which < 0, 0.0, depth)


def _patch(plane: Plane, spots: Float[np.ndarray, "n 3"], views: Sequence[_View], none: Scene) -> Scene:
    """One plane's hole as Gaussians. spots: where rays through holes meet it."""
    basis, pitch, low, shape = _raster(plane, spots, views)
    places = np.floor((spots @ basis.T - low) / pitch).astype(int)[:, ::-1].clip(0, np.array(shape) - 1)
    hole = np.zeros(shape, bool)
    hole[tuple(places.T)] = True
    hole = cv2.morphologyEx(hole.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)) > 0
    rows, columns = np.indices(shape)
    along = low + pitch * (np.stack((columns, rows), -1) + 0.5)
    points = along @ basis + plane.normal * plane.offset  # (h, w, 3)
    on_it = FILLING.far * min(max(FILLING.noise * plane.noise, FILLING.narrowest), 2.0)
    colours, weights, known, taken = _sample_views(points.reshape(-1, 3), views, on_it)
    known = known if weights is None else known & _common(weights, known)
    known = known.reshape(shape)
    hole &= ~taken.reshape(shape)
    if not hole.any():
        return none
    coloured = heal(colours.reshape(*shape, 3), known, hole)
    nearest = _nearest(known) if known.any() else np.zeros((2, *shape), int)
    carried = None if weights is None else weights.reshape(*shape, -1)[nearest[0][hole], nearest[1][hole]]
    axes = np.broadcast_to(np.stack((*basis, np.cross(*basis)), -1), (int(hole.sum()), 3, 3))
    sizes = np.full((len(axes), 2), pitch * FILLING.cover)
    return _elements(none, points[hole], axes, sizes, coloured[hole], carried, views[0].number)


def _raster(
    plane: Plane, spots: Float[np.ndarray, "n 3"], views: Sequence[_View]
) -> tuple[Float[np.ndarray, "2 3"], float, Float[np.ndarray, " 2"], tuple[int, int]]:
    """Axes of a plane's picture, the side of its pixels, its low corner, and its size (h, w), with
    surroundings."""
    basis = plane.basis()
    flat = spots @ basis.T
    nearest = min(float(np.median(np.linalg.norm(spots - view.eye, axis=1))) for view in views)
    pitch = FILLING.cell * nearest / float(views[0].camera.K[0, 0])
    low, high = np.quantile(flat, 0.002, axis=0), np.quantile(flat, 0.998, axis=0)
    margin = 0.6 * float((high - low).max()) + 8 * pitch
    low, high = low - margin, high + margin
    pitch = max(pitch, float(np.sqrt(np.prod(high - low) / FILLING.most_cells)))
    width, height = np.ceil((high - low) / pitch).astype(int).clip(1).tolist()
    return basis, pitch, low, (height, width)


def _common(weights: Float[np.ndarray, "n K"], known: Bool[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Points that mean what most of a plane's known ones do: a curtain before a wall does not."""
    if not weights.shape[1] or not known.any():
        return np.ones_like(known)
    groups = weights.argmax(1)
    counts = np.bincount(groups[known], minlength=weights.shape[1])
    return (counts >= FILLING.rare * counts.max())[groups]


def _sample_views(
    points: Float[np.ndarray, "n 3"], views: Sequence[_View], on_it: float
) -> tuple[
    Float[np.ndarray, "n 3"], Float[np.ndarray, "n K"] | None, Bool[np.ndarray, " n"], Bool[np.ndarray, " n"]
]:
    """Colours and weights of points where a view shows a surface just there, whether one does, and whether
    one sees through them, or a surface about there. on_it: share of the depth to which a surface counts."""
    count, kept = len(points), views[0].weights
    colours, known, taken = np.zeros((count, 3)), np.zeros(count, bool), np.zeros(count, bool)
    weights = None if kept is None else np.zeros((count, kept.shape[-1]), np.float32)
    for view in views:
        inside, rows, columns, z = view.pixels(points)
        depth = view.depths[rows, columns]
        open_there = inside & ~view.hole[rows, columns] & (depth > 0)
        taken |= open_there & ((depth > FILLING.through * z) | (abs(depth - z) <= 2 * FILLING.far * z))
        new = open_there & (abs(depth - z) <= on_it * z) & ~known
        colours[new] = view.colours[rows[new], columns[new]]
        if weights is not None and view.weights is not None:
            weights[new] = view.weights[rows[new], columns[new]]
        known |= new
    return colours, weights, known, taken


def _fill_smoothly(
    view: _View, missing: Bool[np.ndarray, "H W"], sofar: Scene, render: Render, none: Scene
) -> Scene:
    """Pixels that no plane lies around, on a surface that runs smoothly from their edge to their edge."""
    if missing.sum() < FILLING.least:
        return none
    frame = render(sofar, view.camera, weight_maps=False)
    alphas, depths = frame.alphas.cpu().numpy(), frame.depths.cpu().double().numpy()
    missing = missing & (alphas < 0.5)
    known = (alphas >= 0.9) & (depths > 0) & ~missing
    if missing.sum() < FILLING.least or not known.any():
        return none
    straight = (frame.rgb.cpu().numpy() / np.maximum(alphas, 1 / 255)[..., None]).clip(0, _BRIGHTEST)
    inverse = np.repeat((1 / np.maximum(depths, 1e-9))[..., None], 3, -1)
    depth = torch.from_numpy(1 / np.maximum(diffuse(inverse, known)[..., 0], 1e-9))
    points = unproject(depth, view.camera.K.cpu().double())
    footprint = depth / float(view.camera.K[0, 0])
    axes, sizes = ellipses(*spans(points, footprint))
    pose = invert_rigid(view.camera.viewmat.cpu().double())
    rows = torch.from_numpy(missing)
    nearest = _nearest(known)
    carried = None if view.weights is None else view.weights[nearest[0][missing], nearest[1][missing]]
    return _elements(
        none, transform(pose, points[rows]).numpy(), (pose[:3, :3] @ axes[rows]).numpy(),
        FILLING.cover * sizes[rows].clamp_min(1e-6).numpy(), diffuse(straight, known)[missing],
        carried, view.number,
    )  # fmt: skip


def _nearest(known: Bool[np.ndarray, "H W"]) -> Integer[np.ndarray, "2 H W"]:
    """Rows and columns of the nearest known pixels."""
    return np.asarray(ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True))


def _elements(
    none: Scene,
    means: Float[np.ndarray, "n 3"],
    axes: Float[np.ndarray, "n 3 3"],
    sizes: Float[np.ndarray, "n 2"],
    colours: Float[np.ndarray, "n 3"],
    weights: Float[np.ndarray, "n K"] | None,
    view: int,
) -> Scene:
    """Flat Gaussians with weights over the atoms of `none`, an empty scene of them. They are made by a view;
    in a scene of layers by none, so that every layer has them."""
    count, semantics = len(means), none.semantics
    thin = FILLING.thin * sizes.min(1, keepdims=True)
    gaussians = Gaussians(
        means=torch.from_numpy(means).float(),
        quats=matrices_to_quats(torch.from_numpy(np.array(axes))).float(),
        scales=torch.from_numpy(np.concatenate((sizes, thin), 1)).float(),
        opacities=torch.full((count,), FILLING.opacity),
        sh=colour_to_sh(torch.from_numpy(colours))[:, None].float(),
    )
    most = semantics.weight_ids.shape[1]
    ids, values = torch.zeros(count, most, dtype=torch.int64), torch.zeros(count, most)
    if weights is not None and most and semantics.num_atoms:
        ids, values = sparse_weights(torch.from_numpy(weights), most)
    return replace(
        none,
        gaussians=gaussians,
        semantics=replace(semantics, weight_ids=ids, weight_values=values),
        view_ids=None if none.view_ids is None else torch.full((count,), -1 if none.layered else view),
        levels=None if none.levels is None else torch.zeros(count, dtype=torch.uint8),
        confidences=None if none.confidences is None else torch.zeros(count),
    )
