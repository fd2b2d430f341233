"""What recipes draw with: draws at random, materials, the design in the making. Metres, y up, front +z."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from langflash_core.lab.rooms.builtin import KIND_FABRIC, KIND_PLAIN
from langflash_core.lab.rooms.objfile import Material
from langflash_core.lab.rooms.solids import Triangles, Vector, box, cylinder, laid, lathe, rounded, tube

NUM_WOODS = 10

Look = tuple[Material, int]
"""A material and the kind by which shaders draw it."""
Choice = TypeVar("Choice")


def plain(colour: Vector, gloss: float = 0.0, opacity: float = 1.0) -> Look:
    """One even sRGB colour."""
    return Material(colour, opacity, gloss), KIND_PLAIN


WHITE = plain((0.94, 0.94, 0.93), 0.5)
BLACK = plain((0.04, 0.04, 0.045), 0.5)
DARK = plain((0.16, 0.16, 0.17), 0.3)
STEEL = plain((0.72, 0.72, 0.73), 0.7)
LINEN = plain((0.93, 0.92, 0.89))
_WICKERS = ((0.62, 0.47, 0.3), (0.4, 0.28, 0.18), (0.8, 0.76, 0.68), (0.2, 0.18, 0.17))
_LEATHERS = ((0.08, 0.07, 0.07), (0.30, 0.17, 0.10), (0.45, 0.26, 0.14), (0.85, 0.82, 0.76), (0.4, 0.1, 0.09))


@dataclass(frozen=True)
class Draw:
    """Sizes, choices and materials at random."""

    rng: np.random.Generator

    def between(self, low: float, high: float) -> float:
        """Any number from low to high."""
        return float(self.rng.uniform(low, high))

    def count(self, low: int, high: int) -> int:
        """A whole number, both ends included."""
        return int(self.rng.integers(low, high + 1))

    def style(self, many: int) -> int:
        """One of 0 ... many - 1."""
        return int(self.rng.integers(many))

    def chance(self, share: float) -> bool:
        """True in this share of cases."""
        return bool(self.rng.random() < share)

    def one_of(self, *choices: Choice) -> Choice:
        """Any of them, all alike."""
        return choices[self.style(len(choices))]

    def colour(self, vivid: float, low: float = 0.15, high: float = 0.95) -> Vector:
        """sRGB of any hue, up to `vivid` away from grey, brightest channel from low to high."""
        hue, depth, value = self.rng.random(), self.rng.uniform(0, vivid), self.rng.uniform(low, high)
        wheel = 0.5 + 0.5 * np.cos(2 * np.pi * (hue + np.array([0.0, 1 / 3, 2 / 3])))
        red, green, blue = (float(v) for v in np.clip(value * (1 - depth * (1 - wheel)), 0.03, 0.97))
        return red, green, blue

    def wooden(self) -> Look:
        """One of the woods (`parametric.wood_textures`), raw to varnished."""
        gloss = self.between(0, 0.3)
        return Material(gloss=gloss, texture=f"wood{self.style(NUM_WOODS)}"), KIND_PLAIN

    def painted(self) -> Look:
        """Lacquer: near white, or any colour."""
        colour = self.colour(0.15, 0.75, 0.97) if self.chance(0.55) else self.colour(0.6)
        return plain(colour, self.between(0.05, 0.4))

    def body(self) -> Look:
        """What cupboards and tables are made of."""
        return self.wooden() if self.chance(0.6) else self.painted()

    def metal(self) -> Look:
        """Black iron to chrome, a little warm or cold."""
        value = self.one_of(0.08, 0.35, 0.6, 0.8)
        tone = (value, value, value * self.between(0.85, 1.05))
        return plain(tone, self.between(0.4, 0.9))

    def legs(self) -> Look:
        """What frames and feet are made of."""
        return self.metal() if self.chance(0.4) else self.body()

    def cloth(self) -> Look:
        """Muted or vivid, plain or patterned."""
        colour = self.colour(0.25, 0.3, 0.9) if self.chance(0.5) else self.colour(0.8)
        return Material(colour), KIND_FABRIC if self.chance(0.3) else KIND_PLAIN

    def upholstery(self) -> Look:
        """Leather or cloth."""
        return plain(self.one_of(*_LEATHERS), 0.4) if self.chance(0.25) else self.cloth()

    def ceramic(self) -> Look:
        """White or coloured, matt to glazed."""
        colour = (0.93, 0.93, 0.91) if self.chance(0.45) else self.colour(0.8)
        return plain(colour, self.between(0.1, 0.8))

    def vivid(self) -> Look:
        """A strong colour, a little glossy."""
        return plain(self.colour(0.9, 0.5), self.between(0.1, 0.6))

    def vivid_paint(self) -> Look:
        """A strong or dark colour, glossy."""
        return plain(self.colour(0.9), 0.35)

    def casing(self) -> Look:
        """What a device is made of outside."""
        return self.one_of(BLACK, DARK, WHITE, STEEL, self.vivid_paint())

    def woven(self) -> Look:
        """Wicker or cord."""
        return Material(self.one_of(*_WICKERS)), KIND_FABRIC


@dataclass
class Design:
    """One thing in the making: triangles with a look each, and what the catalogue will say of it."""

    name: str
    group: str
    tags: tuple[str, ...] = ()
    parts: list[tuple[Triangles, Look]] = field(default_factory=list)
    elevation: float = 0.0
    light: bool = False
    category: str = "Parametric"

    def add(self, triangles: Triangles, look: Look) -> None:
        """Any triangles."""
        self.parts.append((triangles, look))

    def box(self, size: Vector, centre: Vector, look: Look) -> None:
        """A board, a bar or a block."""
        self.add(box(size, centre), look)

    def soft(self, size: Vector, centre: Vector, look: Look, squareness: float = 6.0) -> None:
        """A box with soft edges; squareness 2 is an ellipsoid."""
        self.add(rounded(size, centre, squareness), look)

    def tube(self, points: Sequence[Vector], radius: float, look: Look, segments: int = 8) -> None:
        """A round rod along a path."""
        self.add(tube(points, radius, segments), look)

    def cylinder(
        self, radius: float, height: float, foot: Vector, look: Look, top: float | None = None
    ) -> None:
        """An upright cylinder, or a cone frustum with its upper radius."""
        self.add(cylinder(radius, height, foot, top), look)

    def roll(self, radius: float, length: float, place: Vector, look: Look, segments: int = 16) -> None:
        """A cylinder that lies along z, from `place` forwards."""
        self.add(laid(cylinder(radius, length, (0, 0, 0), segments=segments), place), look)

    def lathe(
        self, profile: Sequence[tuple[float, float]], look: Look, segments: int = 20, squash: float = 1.0
    ) -> None:
        """A profile of (radius, height) turned about the y axis."""
        self.add(lathe(profile, (0, 0, 0), segments, squash), look)


@dataclass(frozen=True)
class Face:
    """A rectangle of a front: its lower left corner, its size, and how far forward it is."""

    left: float
    foot: float
    width: float
    height: float
    z: float
