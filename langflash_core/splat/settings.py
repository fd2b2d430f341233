"""Numbers that `splat` decides by: one frozen record a subject, each number with its unit and its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mixing:
    """What pixels are made of (`splat.mixing`). Solved with and without what `faint` and `small` leave
    out, pictures differ by 0.1 dB where they are 32 dB from a photo."""

    faint: float = 1 / 64
    """Alpha below which a pair is left out: footprints end at 2.9 deviations instead of 3.3."""
    small: float = 0.01
    """Contribution below which a pair is left out: two thirds of all pairs go, 2 % of the light."""
    wide: int = 128
    """Pixels, a side from which footprints are cut to the picture."""
    at_once: int = 1 << 18
    """Pairs in work at once: within a core's cache."""
    slabs: int = 8
    """Slabs of Gaussians by depth."""
    least_slab: int = 8192
    """Gaussians of a slab, at least."""
    cells: tuple[int, ...] = (8, 16, 32, 64)
    """Pixels, in which pixels that still let light pass are sought for a footprint's square."""


MIXING = Mixing()


@dataclass(frozen=True)
class Outlines:
    """Lines around what was chosen (`splat.outlines`)."""

    side: int = 320
    """Pixels of the grid's longer side: a line a few pixels off would be seen, a finer one takes longer."""
    beside: float = 1.05
    """Of the depth of what is before it: as far as layers show the same."""
    widest: int = 6
    """Pixels of a square, to each side: larger Gaussians have neighbours within it."""
    least: int = 6
    """Pixels of an area that has a line."""
    smooth: float = 0.6
    """Pixels that a line may leave the border of pixels."""


OUTLINES = Outlines()


@dataclass(frozen=True)
class Tiles:
    """The rasteriser's tiles (`splat.tiles`)."""

    tile: int = 8
    """Pixels a side."""
    stop: float = 1e-4
    """Transmittance below which a pixel is full."""
    block: int = 16
    """Gaussians of a tile composited at once."""
    tiles_at_once: int = 256
    """1 MB of alphas a block: within a core's cache."""
    worth_packing: float = 0.75
    """Share of tiles that go on, from which down those that are done are put away."""


TILES = Tiles()
