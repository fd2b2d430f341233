"""How a film moves: small grey pictures, and how far what they show has gone from one to the next.

Lengths are shares of the picture's side, the root of its area. A few hundred corners are followed from one
picture to the next, there and back; how far it moved is how far four fifths of them have gone since the last
anchor at most, so a hand that shakes around one place goes nowhere. Not the median: where a camera goes
around something, that stays in the middle, and what is before and behind it moves. But where two fifths
have not moved at all, the camera stands, and somebody walks through what it sees.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from langflash_core.images.settings import MOTION

Grey = UInt8[np.ndarray, "H W"]
Points = Float32[np.ndarray, "P 2"]


@dataclass(frozen=True)
class Look:
    """One picture, judged. sharpness: variance of its Laplacian. rise: pixels over which even its sharpest
    edges rise; 0 where there are too few to tell. light: its 90th percentile in [0, 1]."""

    grey: Grey
    sharpness: float
    rise: float
    light: float


def look_at(picture: UInt8[np.ndarray, "H W 3"]) -> Look:
    """Judge a picture."""
    grey = cv2.cvtColor(_shrunk(picture, MOTION.sharp_side), cv2.COLOR_BGR2GRAY)
    smooth = _smooth(grey)
    sharpness = float(cv2.Laplacian(smooth, cv2.CV_32F).var())
    return Look(_shrunk(grey, MOTION.side), sharpness, _farther(smooth), float(np.percentile(grey, 90)) / 255)


def _smooth(grey: Grey) -> Grey:
    """Grain and coding are no detail."""
    return cv2.GaussianBlur(grey, (3, 3), 0).astype(np.uint8, copy=False)


def _farther(smooth: Grey) -> float:
    """A hand that moves smears one direction."""
    return max(_rise(smooth), _rise(np.ascontiguousarray(smooth.T)))


def _rise(grey: Grey) -> float:
    """Contrast / steepest slope along x of edges, the sharpest fifth; whatever their contrast."""
    values = grey.astype(np.float32)
    slope, across = np.abs(np.diff(values, axis=1)), np.ones((1, MOTION.reach), np.uint8)
    contrast = (cv2.dilate(values, across) - cv2.erode(values, across))[:, 1:]
    edges = (contrast > MOTION.edge) & (slope >= 0.99 * cv2.dilate(slope, across))
    if edges.sum() < MOTION.edges:
        return 0.0
    return float(np.percentile(contrast[edges] / slope[edges], 20))


@dataclass(frozen=True)
class Moved:
    """How far a picture has moved since the anchor, and since the mark."""

    since_anchor: float
    since_mark: float


class Follower:
    """Follows a film from its anchor on. last: the picture that was followed last."""

    def __init__(self) -> None:
        self.last: np.ndarray | None = None
        self._anchored = self._marked = self._now = np.empty((0, 2), np.float32)
        self._count = 0  # of corners at the anchor

    def anchor(self, grey: Grey) -> bool:
        """Begin here; whether there is enough to follow."""
        points = _corners(grey)
        if len(points) < MOTION.fewest:
            return False
        self.last, self._count = grey, len(points)
        self._anchored = self._marked = self._now = points
        return True

    def mark(self) -> None:
        """Tell from here on, too, how far it moves."""
        self._marked = self._now

    def follow(self, grey: Grey) -> Moved | None:
        """How far this picture has moved; None where it shows another place."""
        if self.last is None or self.last.shape != grey.shape:
            return None
        there, found = _track_corners(self.last, grey, self._now)
        share = float(found.mean()) if len(found) else 0.0
        # a step too wide for corners: the whole picture tells about where to seek them
        if share < MOTION.weak:
            on, again = _track_corners(self.last, grey, self._now, _shift(self.last, grey))
            if again.sum() > found.sum():
                there, found, share = on, again, float(again.mean())
        if share < MOTION.lost or found.sum() < MOTION.fewest // 2:
            return None
        self._anchored, self._marked = self._anchored[found], self._marked[found]
        self._now, self.last = there[found], grey
        return Moved(_way_gone(self._anchored, self._now, grey), _way_gone(self._marked, self._now, grey))

    @property
    def weak(self) -> bool:
        """Whether few of the anchor's corners are left."""
        return len(self._now) < MOTION.weak * self._count


def trackable(grey: Grey) -> bool:
    """Whether a picture shows enough to be followed."""
    return len(_corners(grey)) >= MOTION.fewest


def tiny(grey: Grey) -> Float32[np.ndarray, " T"]:
    """A picture as a vector of unit length, for comparing many."""
    small = cv2.resize(grey, MOTION.tiny, interpolation=cv2.INTER_AREA).astype(np.float32).ravel()
    small -= small.mean()
    return small / max(float(np.linalg.norm(small)), 1e-6)


def from_one_place(one: Grey, other: Grey) -> bool:
    """Whether two pictures show the same from the same place, near things too."""
    if one.shape != other.shape:
        return False
    points = _corners(one)
    if len(points) < MOTION.fewest:
        return False
    there, found = _track_corners(one, other, points)
    return bool(found.mean() > 0.5) and _way_gone(points[found], there[found], one, MOTION.most) < MOTION.same


@dataclass(frozen=True)
class Marks:
    """What a picture is known again by from elsewhere: P places in it, pixels, and what is seen there."""

    places: Points
    seen: Float32[np.ndarray, "P 128"]


def marks_of(grey: Grey) -> Marks:
    """SIFT features, the strongest few hundred."""
    points, seen = cv2.SIFT.create(400).detectAndCompute(grey, np.full(grey.shape, 255, np.uint8))
    if seen is None or not len(points):
        return Marks(np.empty((0, 2), np.float32), np.empty((0, 128), np.float32))
    return Marks(np.array([point.pt for point in points], np.float32), np.asarray(seen, np.float32))


def step_between(one: Marks, other: Marks, grey: Grey) -> float | None:
    """How far what two pictures have in common has moved between them, from wherever they show it; None where
    there is nothing. grey: one of them."""
    if min(len(one.places), len(other.places)) < MOTION.joins:
        return None
    pairs = cv2.BFMatcher().knnMatch(one.seen, other.seen, k=2)
    good = [pair[0] for pair in pairs if len(pair) == 2 and pair[0].distance < 0.75 * pair[1].distance]
    if len(good) < MOTION.joins:
        return None
    here = one.places[[match.queryIdx for match in good]]
    there = other.places[[match.trainIdx for match in good]]
    _, agree = cv2.findFundamentalMat(here, there, cv2.FM_RANSAC, 1.5, 0.999)
    if agree is None or agree.sum() < max(MOTION.joins, MOTION.agree * len(good)):
        return None
    kept = agree.ravel() == 1
    return _way_gone(here[kept], there[kept], grey)


def _shrunk(picture: np.ndarray, side: int) -> np.ndarray:
    """With a longer side of at most `side` pixels."""
    height, width = picture.shape[:2]
    ratio = side / max(height, width)
    if ratio >= 1:
        return picture
    size = max(1, round(width * ratio)), max(1, round(height * ratio))
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)


def _corners(grey: np.ndarray) -> np.ndarray:
    """(P, 2) float32. Those that stand out less than a fiftieth of the contrast are noise."""
    if float(grey.std()) < 2.0:
        return np.empty((0, 2), np.float32)
    found = cv2.goodFeaturesToTrack(grey, MOTION.corners, 0.01, 6)
    return np.empty((0, 2), np.float32) if found is None else found.reshape(-1, 2).astype(np.float32)


def _shift(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(2,) by which one picture as a whole has moved to the other, pixels."""
    pair = [cv2.resize(each, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA) for each in (one, other)]
    first, second = (each.astype(np.float32) for each in pair)
    window = cv2.createHanningWindow((first.shape[1], first.shape[0]), cv2.CV_32F)
    moved, _ = cv2.phaseCorrelate(first, second, window)
    return 2 * np.array(moved, np.float32)


def _track_corners(
    one: np.ndarray, other: np.ndarray, points: np.ndarray, shift: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Where `points` (P, 2) of one picture are in the other, sought from `shift` on, and which were found
    there and back."""
    if not len(points):
        return points, np.zeros(0, bool)
    start, by = points.reshape(-1, 1, 2), np.zeros(2, np.float32) if shift is None else shift
    there, on, _ = _flow(one, other, start, start + by)
    back, off, _ = _flow(other, one, there, there - by)
    there, back = there.reshape(-1, 2), back.reshape(-1, 2)
    height, width = one.shape
    inside = (there >= 0).all(1) & (there[:, 0] < width) & (there[:, 1] < height)
    found = (on.ravel() == 1) & (off.ravel() == 1) & inside
    return there, found & (np.abs(back - points).max(1) < MOTION.back)


def _flow(one: np.ndarray, other: np.ndarray, points: np.ndarray, guess: np.ndarray):
    return cv2.calcOpticalFlowPyrLK(
        one,
        other,
        points,
        guess,
        winSize=MOTION.window,
        maxLevel=MOTION.levels,
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )


def _way_gone(before: np.ndarray, now: np.ndarray, grey: np.ndarray, percent: float = MOTION.far) -> float:
    """Way that so many per cent of the corners do not exceed, share of the side."""
    stay, far = np.percentile(np.linalg.norm(now - before, axis=1), (MOTION.stay, percent))
    return float(stay if stay < MOTION.moves else far) / math.sqrt(grey.size)
