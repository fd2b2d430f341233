"""What was behind a part that was taken out: what other photos saw there, and between that and what is
left around, a surface that runs smoothly from edge to edge.

Where the part covered a pixel and nothing is left there, is a hole. The view with the largest hole comes
first. Points that other views see behind the part are put into its picture; between these and the hole's
edge 1 / z runs smoothly, which a plane's is linear in, so floors, walls and tables go on. What stands before
the part is no edge. The next view has this surface in its picture, and fills what of its own hole is left.
Colours run in from the edge, too, with the texture of what is beside (`texture.py`), and each pixel becomes
a flat Gaussian, with the weights of the nearest known one. Confidences of what is filled are 0.

Sizes: H W pixels of a view, n points.
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
from langflash_core.types import Camera, Frame, Gaussians, Scene

from .looks import Render
from .photos import nearest_in
from .taking import Nearby, most_telling, with_fringe
from .texture import diffuse, heal

_BRIGHTEST = EXPOSURE.gain_range[1] + EXPOSURE.largest_offset  # a photo's white in the scene's light


@dataclass(frozen=True)
class _View:
    """What one photo's place shows without the part, as far as its ring reaches. rays (H, W, 3) in the world,
    z = 1 in the camera; eye (3,); colours (H, W, 3); depths (H, W), 0 for nothing; before (H, W), depths of
    the part; hole, ring (H, W); number of the photo."""

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


@dataclass(frozen=True)
class Filled:
    """gone: (N,) bool, what is to be taken away, the part and its fringe. patch: what comes instead. unseen:
    share of the holes that no other photo saw."""

    gone: Bool[Tensor, " N"]
    patch: Scene
    unseen: float


def delete_and_fill(scene: Scene, members: Tensor, render: Render) -> Filled:
    """A part (N,) bool taken out with its fringe, and what belongs there."""
    gone = with_fringe(scene, members, render)
    return Filled(gone, *_filled(scene, gone, render))


def fill(scene: Scene, removed: Tensor, render: Render) -> Scene:
    """What belongs where a part was, as Gaussians of the scene's own dictionary, to be appended to what is
    left.

    Args:
        removed: (N,) bool, the part. render: draws scenes.

    Returns:
        A scene of n >= 0 Gaussians.
    """
    return _filled(scene, removed, render)[0]


def _filled(scene: Scene, removed: Tensor, render: Render) -> tuple[Scene, float]:
    """What fills the holes, and the share of them that no other view sees."""
    patch = scene.rows(torch.zeros(0, dtype=torch.int64))
    views = sorted(_views(scene, removed, render), key=lambda view: -int(view.hole.sum()))
    holes = told = 0
    for view in views:
        seen = _with_others(view, views)
        told += int((view.hole & (seen.depths > 0)).sum())
        holes += int(view.hole.sum())
        patch = append_part(patch, _fill_view(_with_patch(seen, patch, render), patch))
    return patch, 1 - told / max(holes, 1)


def _views(scene: Scene, removed: Tensor, render: Render) -> list[_View]:
    """The few views that show most of a part, from different sides."""
    found, nearby = [], Nearby.of(scene)
    for number in most_telling(scene, removed, FILLING.most_views):
        camera = _resize_camera(scene.camera(number))
        part = nearby.drawn(removed, camera, render, weight_maps=False)
        if float(part.alphas.sum()) >= FILLING.least:
            view = _view(nearby, removed, camera, part, number, render)
            found += [view] if view.hole.sum() >= FILLING.least else []
    return found


def _resize_camera(camera: Camera) -> Camera:
    longer = max(camera.width, camera.height)
    ratio = min(FILLING.finer, max(1, FILLING.most_side / longer))
    return camera.with_size(max(1, round(camera.width * ratio)), max(1, round(camera.height * ratio)))


def _view(nearby: Nearby, removed: Tensor, camera: Camera, part: Frame, number: int, render: Render) -> _View:
    reach = max(2, round(FILLING.ring * max(camera.width, camera.height)))
    matte = part.alphas.cpu().numpy()
    box = _box(matte > 0.1, 2 * reach)
    camera, matte = _crop(camera, box), matte[box]
    frame = nearby.drawn(~removed, camera, render)
    alphas, depths = frame.alphas.cpu().numpy(), frame.depths.cpu().double().numpy()
    hole = ((matte > 0.1) & (alphas < 0.5)) | ((matte >= 0.5) & (alphas < 0.9))
    size = np.ones((2 * reach + 1, 2 * reach + 1))
    ring = (cv2.dilate(hole.astype(np.uint8), size) > 0) & (alphas >= 0.9) & ~hole & (depths > 0)
    pose = invert_rigid(camera.viewmat.cpu().double())
    ahead = rays(camera.K.cpu().double(), camera.width, camera.height) @ pose[:3, :3].T
    straight = frame.rgb.cpu().double().numpy() / np.maximum(alphas, 1 / 255)[..., None]
    before = np.where(matte > 0.1, part.depths.cpu().double().numpy()[box], 0.0)
    return _View(
        camera, ahead.numpy(), pose[:3, 3].numpy(), straight.clip(0, _BRIGHTEST),
        np.where(alphas >= 0.9, depths, 0.0), before, hole, ring,
        None if frame.weight_maps is None else frame.weight_maps.cpu().numpy(), number,
    )  # fmt: skip


def _box(shown: Bool[np.ndarray, "H W"], margin: int) -> tuple[slice, slice]:
    """Rows and columns around what is shown, and so many pixels more."""
    found = []
    for axis, side in enumerate(shown.shape):
        along = np.flatnonzero(shown.any(1 - axis))
        first, last = (along[0], along[-1]) if len(along) else (0, 0)
        found.append(slice(max(0, int(first) - margin), min(side, int(last) + 1 + margin)))
    return found[0], found[1]


def _crop(camera: Camera, box: tuple[slice, slice]) -> Camera:
    """The camera of a part of its picture."""
    K, (rows, columns) = camera.K.clone(), box
    K[0, 2] -= columns.start
    K[1, 2] -= rows.start
    return replace(camera, K=K, width=columns.stop - columns.start, height=rows.stop - rows.start)


def _with_others(view: _View, views: Sequence[_View]) -> _View:
    """A view with what other views show behind the part, in the pixels of its hole."""
    points, colours, weights = [], [], []
    for other in views:
        shown = (other.depths > 0) & ~other.hole
        if other is not view and shown.any():
            points.append(other.points(other.depths)[shown])
            colours.append(other.colours[shown])
            weights.append(None if other.weights is None else other.weights[shown])
    if not points:
        return view
    inside, rows, columns, z = view.pixels(np.concatenate(points))
    deep = inside & view.hole[rows, columns] & (z >= FILLING.before * view.before[rows, columns])
    hit = np.zeros(view.hole.shape, np.float32)
    hit[rows[deep], columns[deep]] = 1
    deep &= (cv2.blur(hit, (3, 3)) >= FILLING.dense)[rows, columns]
    some = np.flatnonzero(deep)[np.argsort(-z[deep], kind="stable")]  # the nearest one stays
    places = rows[some], columns[some]
    depths, painted = view.depths.copy(), view.colours.copy()
    depths[view.hole] = 0
    depths[places], painted[places] = z[some], np.concatenate(colours)[some]
    carried = view.weights
    if carried is not None:
        carried = carried.copy()
        carried[places] = np.concatenate([each for each in weights if each is not None])[some]
    return replace(view, depths=depths, colours=painted, weights=carried)


def _with_patch(view: _View, patch: Scene, render: Render) -> _View:
    """A view with what has been filled so far, which is a hole no more."""
    if not len(patch.gaussians):
        return view
    frame = render(patch.with_record(layered=False), view.camera)
    alphas = frame.alphas.cpu().numpy()
    there = view.hole & (alphas >= 0.5)
    depths, colours = view.depths.copy(), view.colours.copy()
    depths[there] = frame.depths.cpu().double().numpy()[there]
    colours[there] = (frame.rgb.cpu().double().numpy() / np.maximum(alphas, 0.5)[..., None])[there]
    weights = view.weights
    if weights is not None and frame.weight_maps is not None:
        weights = np.where(there[..., None], frame.weight_maps.cpu().numpy(), weights)
    return replace(view, depths=depths, colours=colours, weights=weights, hole=view.hole & ~there)


def _fill_view(view: _View, patch: Scene) -> Scene:
    """A view's hole as Gaussians, on a surface that runs smoothly from what is known to what is known."""
    none = patch.rows(torch.zeros(0, dtype=torch.int64))
    limits = nearest_in(view.before, view.before > 0) if view.before.any() else view.before
    known = (view.depths > 0) & (view.depths >= FILLING.before * limits)
    if view.hole.sum() < FILLING.least or not known.any():
        return none
    hole = view.hole.astype(np.uint8)
    rim = cv2.dilate(hole, np.ones((2 * FILLING.rim + 1, 2 * FILLING.rim + 1))) > 0
    clear = known & (~rim | view.hole)
    clear = clear if clear.any() else known
    inverse = np.repeat((1 / np.maximum(view.depths, 1e-9))[..., None], 3, -1)
    depth = torch.from_numpy(1 / np.maximum(diffuse(inverse, clear)[..., 0], 1e-9))
    colours = heal(view.colours, clear, rim & ~clear, _like_edge(view, clear, rim))
    points = unproject(depth, view.camera.K.cpu().double())
    axes, sizes = ellipses(*spans(points, depth / float(view.camera.K[0, 0])))
    pose = invert_rigid(view.camera.viewmat.cpu().double())
    missing = view.hole
    rows = torch.from_numpy(missing)
    nearest = _nearest(clear)
    carried = None if view.weights is None else view.weights[nearest[0][missing], nearest[1][missing]]
    return _elements(
        none, transform(pose, points[rows]).numpy(), (pose[:3, :3] @ axes[rows]).numpy(),
        FILLING.cover * sizes[rows].clamp_min(1e-6).numpy(), colours[missing], carried, view.number,
    )  # fmt: skip


def _like_edge(
    view: _View, clear: Bool[np.ndarray, "H W"], rim: Bool[np.ndarray, "H W"]
) -> Bool[np.ndarray, "H W"]:
    """Pixels of groups that the hole's edge mostly shows: other things nearby are not copied into it."""
    if view.weights is None or not view.weights.shape[-1]:
        return clear
    groups = view.weights.argmax(-1)
    edge = clear & (cv2.dilate(rim.astype(np.uint8), np.ones((5, 5))) > 0)
    counts = np.bincount(groups[edge], minlength=view.weights.shape[-1])
    return (counts >= FILLING.rare * counts.sum())[groups]


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
