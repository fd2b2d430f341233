"""Where the pixels of a frame were in the frame before: optical flow, or our own network's matches and depth.

A *step* is a map (H, W, 2) float32: what to add to a pixel's place (x, y) to be at the same thing in the
frame before; NaN where that frame did not show it.
"""

from collections.abc import Callable

import cv2
import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from langflash_core.base.running import Run, evenly
from langflash_core.geometry.cameras import intrinsics_from_fov, pixel_grid, transform, unproject
from langflash_core.images.pictures import fitting_size
from langflash_core.images.settings import LENS_PRIOR
from langflash_core.lab.labels.clips import Clip
from langflash_core.network import LangFlashNet
from langflash_core.rig.projected import see_points
from langflash_core.types import Views

Image = UInt8[np.ndarray, "H W 3"]
Step = Float[np.ndarray, "H W 2"]
Motion = Callable[[Clip, int, Image, Image], Step]
"""Clip, frame, its pixels, those of the frame before, to the step between them."""
_AREA = 224 * 224  # pixels that the network sees
_RETURNS = 1.5  # pixels by which a way there and back may miss, and a share of its length
_RETURNS_SHARE = 0.1
_NEARER = 0.1  # of depth: what lay so much behind something in the frame before was not shown


def by_flow(clip: Clip, frame: int, image: Image, before: Image) -> Step:
    """Dense inverse search (Kroeger et al. 2016), as OpenCV has it, there and back: what does not come
    back was hidden or out of the frame."""
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    now, then = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (image, before))
    there, back = (
        search.calc(a, b, np.zeros((*a.shape, 2), np.float32)) for a, b in ((now, then), (then, now))
    )
    returned = there + _sampled(back, there)
    far = _RETURNS + _RETURNS_SHARE * np.linalg.norm(there, axis=-1)
    there[~(np.linalg.norm(returned, axis=-1) <= far)] = np.nan
    return _inside(there)


class NetworkMotion:
    """The network's depth of a frame, carried by its pose from matches (or the clip's own) to the one before.

    For what does not move but the camera.
    """

    def __init__(self, network: LangFlashNet) -> None:
        self._network = network

    @torch.inference_mode()
    def __call__(self, clip: Clip, frame: int, image: Image, before: Image) -> Step:
        """As `Motion`; without enough matches nothing is known to have been shown."""
        views = views_of(clip, (frame, frame - 1), (image, before))
        images, Ks = views.images[None], views.Ks[None]
        run = Run(evenly(self._network.stages))
        tokens = self._network.encode(images, Ks)
        found = self._network.reconstruct(views, images, Ks, tokens, run)
        size = image.shape[:2]
        if found.unplaced:
            return np.full((*size, 2), np.nan, np.float32)
        step = _carried(found.depths, found.viewmats, views.Ks)
        height, width = step.shape[:2]
        large = cv2.resize(step, (size[1], size[0]), interpolation=cv2.INTER_LINEAR)
        return _inside(large * np.array([size[1] / width, size[0] / height], np.float32))


def views_of(clip: Clip, frames: tuple[int, ...], pictures: tuple[Image, ...]) -> Views:
    """Frames as the network takes them, with the clip's cameras where it knows them."""
    height, width = pictures[0].shape[:2]
    size = fitting_size(width, height, _AREA, 14)
    small = [cv2.resize(picture, size, interpolation=cv2.INTER_AREA) for picture in pictures]
    images = torch.from_numpy(np.stack(small)).movedim(-1, 1).float() / 255
    if clip.Ks is None:
        Ks = intrinsics_from_fov(LENS_PRIOR.assumed_fov, width, height)[None].repeat(len(frames), 1, 1)
    else:
        Ks = clip.Ks[list(frames)]
    ratio = torch.tensor([size[0] / width, size[1] / height, 1.0])
    poses = None
    if clip.viewmats is not None and len(frames) > 1:
        own = clip.viewmats[list(frames)].double()
        poses = own @ torch.linalg.inv(own[0])
    names = tuple(clip.ids[t] for t in frames)
    return Views(images, (Ks * ratio[:, None]).float(), names, viewmats=poses)


def _carried(depths: Tensor, viewmats: Tensor, Ks: Tensor) -> Step:
    """From view 0, the world, to view 1."""
    height, width = depths.shape[-2:]
    points = transform(viewmats[1], unproject(depths[0], Ks[0]))  # (H, W, 3)
    there = see_points(points.flatten(0, 1).T, Ks[1], (height, width))
    places = torch.stack((there.x, there.y), -1).view(height, width, 2)
    step = (places - pixel_grid(width, height, like=depths)).numpy()
    then = _sampled(depths[1].numpy(), step)
    hidden = points[..., 2].numpy() > (1 + _NEARER) * then
    step[hidden | (points[..., 2].numpy() <= 0)] = np.nan
    return step.astype(np.float32)


def _sampled(values: np.ndarray, step: Step) -> np.ndarray:
    """Values (H, W, ...) where a step leads to, bilinear; the edge's outside."""
    places = _places(np.nan_to_num(step, nan=0.0))
    return cv2.remap(values, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def _places(step: Step) -> tuple[np.ndarray, np.ndarray]:
    """Where a step leads to, x and y (H, W) float32, in cv2's pixels (the first one's middle is 0)."""
    height, width = step.shape[:2]
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return (x + step[..., 0]).astype(np.float32), (y + step[..., 1]).astype(np.float32)


def _inside(step: Step) -> Step:
    """NaN where a step leaves the frame."""
    height, width = step.shape[:2]
    x, y = _places(step)
    step[(x < -0.5) | (x > width - 0.5) | (y < -0.5) | (y > height - 0.5)] = np.nan
    return step


def moved(ids: np.ndarray, step: Step) -> tuple[np.ndarray, np.ndarray]:
    """Ids (H, W) carried along a step, 0 where nothing is known, and where something is known (H, W) bool."""
    known = np.asarray(np.isfinite(step).all(-1))
    places = _places(np.nan_to_num(step, nan=0.0))
    carried = cv2.remap(ids, *places, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    return np.where(known, carried, 0).astype(ids.dtype), known
