"""Numbers that `writing` decides by: one frozen record a subject, each number with its unit and its
reason."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Filming:
    """Films of a scene (`writing.films`)."""

    seconds: float = 6.0
    """Of a film, unless others are asked for."""
    longest: float = 600.0
    """Seconds of a film."""
    sway: tuple[float, float] = (math.radians(12), math.radians(4))
    """Radians of yaw and pitch around a single photo: further out are holes."""
    middle: tuple[float, float] = (0.02, 0.98)
    """Of what is orbited: stray Gaussians do not count."""
    asked: int = 8
    """Frames at least, if there are so many, in which a heat-map's phrase is scored: one drawing in twenty
    of a usual film."""


FILMING = Filming()


@dataclass(frozen=True)
class Cutouts:
    """Pictures of things (`writing.inventory.cutouts`)."""

    side: int = 220
    """Pixels of the longer side, at most."""
    margin: float = 0.08
    """Of the thing's longer side, around it."""
    quality: int = 82
    """Of JPEG."""
    least: float = 0.5
    """Of a pixel that is the thing's."""


CUTOUTS = Cutouts()


@dataclass(frozen=True)
class Paper:
    """A plan on paper (`writing.inventory.drawing`)."""

    scales: tuple[int, ...] = (10, 20, 25, 50, 100, 200, 500)
    """1 to so many, on paper."""
    room: tuple[float, float] = (118.0, 150.0)
    """Millimetres, width and height for the drawing itself: with its list it fits on A4."""
    edge: float = 14.0
    """Millimetres around the drawing."""
    top: float = 20.0
    """Millimetres above it."""
    list: float = 62.0
    """Millimetres for the list."""
    row: float = 7.4
    """Millimetres of the list."""
    hangs: float = 0.7
    """Of the height of its top, from which its lower end is over what stands below."""
    badge: float = 1.9
    """Millimetres, radius of a number's circle."""


PAPER = Paper()
