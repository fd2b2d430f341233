"""Depth to a fraction of the photo's pixel: what is still shifted between two photos tells how far off it
is.

A neighbour's photo is brought into a view by the view's own depth and poses. Where depth is right both
pictures are the same; what optical flow finds between them is a remaining shift, so each pixel has a
match in the neighbour to a fraction of a pixel, and a depth by triangulation. Of a line flow knows the shift
across it alone, so depth comes from that part of a shift that what is to be seen tells (the aperture
problem). It counts by how sure it is (there and back, same brightness) and by how many pixels the match moves
for a change of depth. A smooth correction of log depth takes it over, cut where depth jumps and where the
photo has an edge (one sparse linear system a view).

Sizes: V views, H W pixels of the maps, h w pixels of the photos.

Source: own derivation; flow: Kroeger, Timofte, Dai, Van Gool 2016, "Fast Optical Flow using Dense Inverse
Search", of OpenCV.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import cv2
import numpy as np
import scipy.sparse
import torch
from jaxtyping import UInt8
from scipy.sparse.linalg import cg
from torch import Tensor
from torch.nn import functional as F

from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.rig.neighbours import Neighbours, everyone
from langflash_core.rig.projected import project_points
from langflash_core.rig.rig import Rig
from langflash_core.rig.settings import REGISTRATION, Registration


@dataclass(frozen=True)
class _Known:
    """What is to be seen around each pixel tells of a shift: a symmetric matrix xx, xy, yy (h, w), whose
    eigenvalues, in [0, 1), say how sure the shift is that way; most: the larger one."""

    xx: np.ndarray
    xy: np.ndarray
    yy: np.ndarray
    most: np.ndarray

    @staticmethod
    def of(grey: np.ndarray, settings: Registration = REGISTRATION) -> "_Known":
        """S / (S + TEXTURE) of the structure tensor S of a photo (h, w), less its noise."""
        smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 1)
        across, down = (cv2.Sobel(smooth, cv2.CV_32F, *way) / 8 for way in ((1, 0), (0, 1)))
        products = (np.square(across), across * down, np.square(down))
        return _Known.of_tensor(*(cv2.blur(product, (7, 7)) for product in products), settings=settings)

    @staticmethod
    def of_tensor(
        xx: np.ndarray, xy: np.ndarray, yy: np.ndarray, settings: Registration = REGISTRATION
    ) -> "_Known":
        """Of a structure tensor, squared grey values a pixel."""
        middle, half = (xx + yy) / 2, np.sqrt(np.square((xx - yy) / 2) + np.square(xy))
        first, second = (np.maximum(energy - settings.flat, 0) for energy in (middle + half, middle - half))
        first, second = first / (first + settings.texture), second / (second + settings.texture)
        share = (first - second) / np.maximum(2 * half, 1e-9)  # of S less its smaller eigenvalue
        rest = second - share * (middle - half)
        return _Known(rest + share * xx, share * xy, rest + share * yy, first)

    def square(self, x: Any, y: Any) -> Any:
        """Of vectors (x, y) what is known, squared."""
        return self.xx * x * x + 2 * self.xy * x * y + self.yy * y * y

    def product(self, x: Any, y: Any, other_x: Any, other_y: Any) -> Any:
        """Of two vectors."""
        return (self.xx * x + self.xy * y) * other_x + (self.xy * x + self.yy * y) * other_y


@dataclass(frozen=True)
class _Matches:
    """x, y: (h, w) where each pixel of a view is in the neighbour's photo. sure: (h, w) in [0, 1]."""

    x: np.ndarray
    y: np.ndarray
    sure: np.ndarray


def register_depths(
    rig: Rig,
    photos: Sequence[UInt8[np.ndarray, "_ _"]],
    neighbours: Neighbours | None = None,
    check: Callable[[], None] = lambda: None,
    each: Callable[[int, Callable[[], Tensor]], Tensor] = lambda view, make: make(),
    settings: Registration = REGISTRATION,
) -> Rig:
    """Depths whose surfaces show the same in neighbouring photos; the expected errors stay.

    Args:
        rig: on the processor. photos: (h, w) uint8, grey, of each view, the rig's photos at their own size.
        neighbours: of each view, the best first; None: all others.
        check: called before each comparison; what it raises ends the work.
        each: gives the log depths (H, W) of a view, which it may have made, or know already.
    """
    logs, cells = rig.log_depths, rig.size
    near = neighbours or everyone(len(rig))
    height, width = (
        min(settings.largest * g, max(p, g)) for p, g in zip(photos[0].shape, cells, strict=True)
    )
    if min(height, width) < settings.smallest:
        return rig
    guides = [resize_photo(photo, cells).astype(np.float32) for photo in photos]
    pictures = _Pictures.of(photos, (height, width), rig.Ks, cells, settings)

    def corrected(view: int) -> Tensor:
        own, others = logs[view], near[view]
        for most in settings.rounds if len(others) > 1 else (1,):
            target, weight = torch.zeros(2, *cells)
            depths = F.interpolate(own[None, None], size=pictures.size, mode="bilinear")[0, 0]
            known = _Known.of(pictures.grey(view), settings)
            for other in others[:most]:
                check()
                pose = rig.viewmats[other] @ invert_rigid(rig.viewmats[view])
                change, counts = pictures.compare_views(view, other, depths, known, pose, settings=settings)
                target += _cells(counts * change, cells)
                weight += _cells(counts, cells)
            own = own + smooth(target, weight, own, guides[view], settings=settings)
        return own

    return rig.with_logs(torch.stack([each(view, partial(corrected, view)) for view in range(len(rig))]))


@dataclass(frozen=True)
class _Pictures:
    """Photos (h, w) uint8 of one size, by their numbers, and their intrinsics (V, 3, 3) there."""

    grey: Callable[[int], np.ndarray]
    size: tuple[int, int]
    Ks: Tensor

    @staticmethod
    def of(
        photos: Sequence[np.ndarray],
        size: tuple[int, int],
        Ks: Tensor,
        cells: tuple[int, int],
        settings: Registration = REGISTRATION,
    ) -> "_Pictures":
        """Ks: pixels of maps of so many cells."""
        ratio = torch.tensor([size[1] / cells[1], size[0] / cells[0], 1.0])
        grey = lru_cache(settings.at_hand)(lambda view: resize_photo(photos[view], size))
        return _Pictures(grey, size, Ks * ratio[:, None])

    def compare_views(
        self,
        view: int,
        other: int,
        depths: Tensor,
        known: _Known,
        pose: Tensor,
        settings: Registration = REGISTRATION,
    ) -> tuple[Tensor, Tensor]:
        """Changes of log depth (h, w) that another photo asks for, and what each counts; depths: log, (h,
        w)."""
        greys, Ks = (self.grey(view), self.grey(other)), (self.Ks[view], self.Ks[other])
        matches = _match_flow(depths, *greys, *Ks, pose, known, settings=settings)
        change, moved = _triangulate_matches(depths, matches, *Ks, pose, known, settings=settings)
        return change, torch.from_numpy(matches.sure) * moved / (settings.flow_error**2 * settings.one_shift)


def resize_photo(photo: UInt8[np.ndarray, "h w"], size: tuple[int, int]) -> UInt8[np.ndarray, "H W"]:
    """A photo at `size` = (H, W)."""
    if photo.shape == size:
        return photo
    method = cv2.INTER_AREA if size[0] < photo.shape[0] else cv2.INTER_CUBIC
    return cv2.resize(photo, (size[1], size[0]), interpolation=method)


def _cells(values: Tensor, size: tuple[int, int]) -> Tensor:
    return F.adaptive_avg_pool2d(values[None, None], size)[0, 0]


def _match_flow(
    log_depths: Tensor,
    grey: np.ndarray,
    other: np.ndarray,
    K: Tensor,
    other_K: Tensor,
    pose: Tensor,
    known: _Known,
    settings: Registration = REGISTRATION,
) -> _Matches:
    height, width = log_depths.shape
    points = unproject(log_depths.exp(), K).flatten(0, 1).T
    there = project_points(points, pose, other_K, (height, width))
    x, y, seen = (
        along.view(height, width).numpy() for along in (there.x, there.y, there.within(settings.margin))
    )
    x, y = (np.where(seen, along, -1e4).astype(np.float32) for along in (x, y))
    brought = _looked_up(other, x - 0.5, y - 0.5)
    flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    none: Any = None  # begins with no flow, which OpenCV's stubs deny
    there, back = flow.calc(grey, brought, none), flow.calc(brought, grey, none)
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    columns, rows = columns + there[..., 0], rows + there[..., 1]
    missed = there + _looked_up(back, columns, rows)
    missed = known.square(missed[..., 0], missed[..., 1]) / np.maximum(known.most, 1e-6)
    differs = _looked_up(brought, columns, rows).astype(np.float32) - grey
    differs -= cv2.blur(differs, (15, 15))
    differs = cv2.blur(np.square(differs), (5, 5))
    sure = 1 / (1 + missed / settings.there_and_back**2) ** 2 / (1 + differs / settings.brightness**2)
    inside = seen & (_looked_up(seen.astype(np.float32), columns, rows, cv2.BORDER_CONSTANT) > 0.999)
    sure = np.where(inside, sure, 0.0)
    if sure.sum() < settings.chance * seen.sum():
        sure[:] = 0
    return _Matches(_looked_up(x, columns, rows), _looked_up(y, columns, rows), sure)


def _looked_up(
    values: np.ndarray, columns: np.ndarray, rows: np.ndarray, border: int = cv2.BORDER_REPLICATE
) -> np.ndarray:
    return cv2.remap(values, columns, rows, cv2.INTER_LINEAR, borderMode=border)


def _triangulate_matches(
    log_depths: Tensor,
    matches: _Matches,
    K: Tensor,
    other_K: Tensor,
    pose: Tensor,
    known: _Known,
    settings: Registration = REGISTRATION,
) -> tuple[Tensor, Tensor]:
    """Changes of log depth (h, w) that bring each pixel nearest to its match, as far as that is known, and
    squared pixels (h, w) of what is known that the match moves for one unit nearer; 0 both where no depth
    does.

    With the ray a and the shift t in the other's frame, a point at inverse depth r is seen at a + r t: of
    each coordinate q, (q a_z - a_x) = r (t_x - q t_z), solved for r by least squares over both, in the metric
    of what is known.
    """
    ray = unproject(torch.ones_like(log_depths), K) @ pose[:3, :3].T
    q = [
        (torch.from_numpy(along).float() - other_K[i, 2]) / other_K[i, i]
        for i, along in enumerate((matches.x, matches.y))
    ]
    away = _turned_back([q[i] * ray[..., 2] - ray[..., i] for i in (0, 1)], pose)
    moving = _turned_back([pose[i, 3] - q[i] * pose[2, 3] for i in (0, 1)], pose)
    square = torch.from_numpy(known.square(*moving))
    inverse = torch.from_numpy(known.product(*away, *moving)) / square.clamp_min(1e-12)
    ahead = ray[..., 2] + pose[2, 3] * inverse
    usable = (inverse > 1e-6) & (ahead > 1e-3) & (square > 1e-12)
    change = (-inverse.clamp_min(1e-6).log() - log_depths).clamp(-settings.farthest, settings.farthest)
    pace = torch.where(usable, (-log_depths).exp() / ahead.clamp_min(1e-3) * other_K[0, 0], 0.0)
    return torch.where(usable, change, 0.0).nan_to_num(), (square * pace**2).nan_to_num()


def _turned_back(vectors: list[Tensor], pose: Tensor) -> list[np.ndarray]:
    """Vectors (h, w) in the other's picture as the view has them, by the angle between their uprights."""
    cosine, sine = float(pose[0, 0] + pose[1, 1]), float(pose[1, 0] - pose[0, 1])
    length = max(math.hypot(cosine, sine), 1e-9)
    (cosine, sine), (x, y) = (cosine / length, sine / length), vectors
    return [(cosine * x + sine * y).numpy(), (cosine * y - sine * x).numpy()]


def smooth(
    target: Tensor,
    weight: Tensor,
    log_depths: Tensor,
    guide: np.ndarray,
    settings: Registration = REGISTRATION,
) -> Tensor:
    """The correction x (H, W) that minimises sum w (x - t)^2 + x^2 / s^2 + sum g (x_i - x_j)^2 over cells and
    their neighbours, g cut where depth jumps or is no number, and at edges of the guide (H, W), the photo in
    cells; target: w t."""
    height, width = log_depths.shape
    across, down = (
        settings.stiff
        * _alike(guide, dim, settings=settings)
        * torch.exp(-((log_depths.diff(dim=dim) / settings.jump) ** 2)).nan_to_num()
        for dim in (1, 0)
    )
    cells = np.arange(height * width).reshape(height, width)
    first = np.concatenate((cells[:, :-1].ravel(), cells[:-1].ravel()))
    second = np.concatenate((cells[:, 1:].ravel(), cells[1:].ravel()))
    ties = np.concatenate((across.ravel(), down.ravel())).astype(np.float64)
    own = weight.double().numpy().ravel() + 1 / (settings.alike * settings.expected**2)
    own += np.bincount(first, ties, cells.size) + np.bincount(second, ties, cells.size)
    places = (np.concatenate((cells.ravel(), first, second)), np.concatenate((cells.ravel(), second, first)))
    system = scipy.sparse.coo_matrix((np.concatenate((own, -ties, -ties)), places)).tocsr()
    right = target.double().numpy().ravel()
    found, _ = cg(
        system, right, x0=right / own, rtol=1e-3, maxiter=settings.iterations, M=scipy.sparse.diags(1 / own)
    )
    return torch.from_numpy(found.reshape(height, width)).float()


def _alike(guide: np.ndarray, dim: int, settings: Registration = REGISTRATION) -> Tensor:
    """Of each two cells that follow each other, 1 where the guide shows one thing, less at an edge."""
    return torch.from_numpy(
        settings.across + (1 - settings.across) * np.exp(-np.square(np.diff(guide, axis=dim) / settings.edge))
    )
