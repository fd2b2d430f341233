"""Numbers that stages decide by: one frozen record a stage, as in `rig.settings`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Manhattan:
    """Directions that a room is built along (`geometry.manhattan`)."""

    most_pitch: float = 60.0
    """Degrees by which the first camera may look up or down,"""
    most_roll: float = 12.0
    """and lean to a side."""
    roll: float = 5.0
    """Degrees, how far people hold cameras from level to a side,"""
    pitch: float = 25.0
    """and up or down."""
    floor: float = 12.0
    """Degrees by which depth lets a floor lean."""
    apart: float = 6.0
    """Degrees between two directions that are both tried."""
    tried: int = 5
    """Directions up, from each of which it is fitted."""
    edge: float = 2.0
    """Degrees within which an edge agrees with a direction,"""
    surface: float = 15.0
    """and a surface."""
    rounds: tuple[float, ...] = (6.0, 4.0, 3.0, 2.0, 1.5, 1.0, 1.0, 0.7, 0.7)
    """Degrees, of the fit."""
    along: float = 0.2
    """Of edges, along each direction; the others are along none."""
    witness: float = 0.4
    """Longer sides of a photo: so much edge is one witness; edges come in pieces and in pairs."""
    searched: int = 500
    """Edges, the longest; the fit and the choice see all."""
    surfaces_say: float = 10.0
    """In logarithms of chances, where all of them are level or upright; edges say more."""
    surface_weight: float = 0.02
    """Of all surfaces beside all edges, in the fit: their depth leans."""
    few: float = 10.0
    """Longer sides of photos: as if there were so many edges, where there are fewer."""
    least: float = 0.25
    """Degrees: no answer is more certain than lenses and photos are."""


MANHATTAN = Manhattan()


@dataclass(frozen=True)
class Surfels:
    """Flat elements of a surface (`geometry.surfels`)."""

    stretch: float = 5.0
    """Footprints of a pixel, at most, that a surface seen edge-on reaches over."""
    flat: float = 0.5
    """Of a Gaussian's second axis, at most its third: it has a normal."""


SURFELS = Surfels()


@dataclass(frozen=True)
class Vantage:
    """Photos that stand for the others (`geometry.vantage`)."""

    near: float = 0.13
    """Mean distance of photos to the nearest that leads, which is near enough: of 1.9 m past a room three or
    four lead, be it eight photos or 32. Each more has errors of its own, which hang beside the surfaces of
    the others: of 32 photos in two rooms 8 leaders gave 28.68 and 30.00 dB between, 4 of them 28.78 and
    30.18; of eight photos all 8 gave 28.99 and 29.84, 3 and 4 of them 29.00 and 29.95, with 6 and 4 % fewer
    Gaussians."""
    many: int = 9
    """Photos from which on,"""
    share: int = 4
    """wherever they are, at most one of so many leads."""


VANTAGE = Vantage()


@dataclass(frozen=True)
class Fusion:
    """Depth maps to one surface (`geometry.fusion`)."""

    band: float = 4.0
    """Voxels on either side of a surface that count: below 3 noise tears holes, above it thickens edges."""
    most_voxels: int = 3_000_000
    """140 a side: 24 MB for the field and its counts."""
    slab: int = 1 << 18
    """Voxels projected at once."""


FUSION = Fusion()
