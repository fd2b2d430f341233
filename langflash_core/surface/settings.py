"""Numbers by which a prediction becomes a scene: one frozen record a stage, as in `rig.settings`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Upsampling:
    """Depth at the size of the photo (`surface.upsampling`)."""

    jump: float = 0.04
    """Log depth beyond what a plane has, from which neighbours are no longer one surface."""
    colour: float = 0.06
    """Standard deviation of a channel within one thing."""
    reach: float = 0.6
    """Cells, standard deviation of how far a colour's depth goes."""
    steep: float = 0.04
    """Log depth from a cell to the next: a floor has a quarter; more is the way from a thing to a wall."""
    farthest: float = 0.1
    """Relative inverse depth by which a cell's slope may change it."""
    steepest: float = 0.2
    """Of it, from a cell to the next: a jump, since planes at more than 2 degrees are flatter."""


UPSAMPLING = Upsampling()


@dataclass(frozen=True)
class Blocks:
    """Squares of a photo (`surface.blocks`)."""

    clear: tuple[float, float] = (0.5, 1.2)
    """Sides that must be clear around fine and around coarse squares."""
    bent: float = 0.01
    """Log depth by which the middle of a square may be off its corners' mean."""


BLOCKS = Blocks()


@dataclass(frozen=True)
class Borders:
    """Weights that end where the photo has borders (`surface.borders`)."""

    window: int = 5
    """Pixels, diameter of the bilateral filter,"""
    spread: float = 2.0
    """and its standard deviation."""
    like: float = 1e-6
    """Least likeness of a grid pixel of another colour; where all four are, they count as bilinear."""


BORDERS = Borders()


@dataclass(frozen=True)
class Covering:
    """Squares that become Gaussians (`surface.elements`)."""

    opacity: float = 0.99
    """Of every element; what passes a wall of them is in `surface.elements`."""
    flat_cover: float = 0.85
    """Standard deviations of coarse elements, in sides of a square,"""
    fine_cover: float = 0.5
    """of fine ones,"""
    ground_cover: float = 0.72
    """and of the ground under those."""
    uniform: float = 12**-0.5
    """Standard deviation of a square of side 1."""
    narrowest: float = 0.6
    """Pixels, deviation of what is drawn in."""
    thin: float = 0.1
    """Thickness over a side."""
    behind: float = 0.004
    """Log depth by which the ground lies behind,"""
    reach: float = 8.0
    """and by the slope of so many pixels more: no part of it may come before what lies on it."""
    farthest_behind: float = 0.06
    """Log depth: the ground lies no farther behind."""
    coarse_behind: float = 0.35
    """Of that, by which other coarse elements lie behind the fine ones beside them."""
    under: float = 7.0
    """Cells by which a surface goes on under a nearer one (`network/occlusion.py` has why)."""
    step: float = 0.2
    """Log depth from a cell to the next that opens a gap."""


COVERING = Covering()


@dataclass(frozen=True)
class Layers:
    """A scene of layers (`surface.detailed`, `surface.fine`)."""

    held: int = 8
    """Photos, what all of which see is held; each takes ten megabytes and a fiftieth of a second. As many
    stay decoded."""
    ground: int = 4
    """Pixels, side of the squares under what was parted."""
    most_enlarged: int = 3
    """Times the grid, the size up to which a photo is looked at."""
    most_gaussians: int = 2_500_000
    """Gaussians of all layers together: 160 MB in a file."""
    most: int = 62
    """Photos that keep one, unless it is said how many Gaussians there may be: the 2.5 million of a scene
    leave 40,000 for each, with which two real photos keep .78 and .82 of their structure (80,000: .86 and
    .90, 12,000: .50 and .55)."""


LAYERS = Layers()


@dataclass(frozen=True)
class Colours:
    """Colours that make each photo again (`surface.colours`, `surface.fused`)."""

    rounds: int = 8
    """Of least squares: each halves about what is left."""
    least: float = 0.5
    """Of a pixel's light, from which a picture says what is wrong there."""
    seen: float = 0.05
    """Contributions of a Gaussian over all pixels, below which its colour stays."""
    shown: float = 0.5
    """Alpha from which a cell shows the layer."""
    step: float = 1 / 255
    """Colour: the least range in which colours are solved for."""


COLOURS = Colours()


@dataclass(frozen=True)
class Consistency:
    """What other photos see through (`surface.consistency`)."""

    tolerance: float = 0.12
    """What is this much nearer (relative depth) than the surface another photo sees is in its way: beyond the
    depth error of the shipped network, so that double surfaces of good depth merge instead."""
    votes: int = 2
    """Photos that see through something, one of which may be wrong."""
    skirt: float = 0.05
    """Relative depth beyond all of the other's around a place, from which it is another surface."""
    around: int = 5
    """Pixels of a window,"""
    jump: float = 0.1
    """and log depth within it from which depth jumps there."""


CONSISTENCY = Consistency()


@dataclass(frozen=True)
class Exposure:
    """One light over all photos (`surface.exposure_compensation`)."""

    gain_range: tuple[float, float] = (0.4, 2.5)
    """In sRGB values; almost three stops of exposure each way. What is farther off is drawn back into it."""
    largest_offset: float = 0.25
    """Of 1, in the light of all; what is farther off is drawn back, too."""
    block: int = 4
    """Pixels a side."""
    exposed: tuple[float, float] = (0.03, 0.97)
    """sRGB values that the sensor and the curve still tell apart."""
    agrees: float = 0.05
    """Relative difference of depths that show one surface."""
    confident: float = 1 / 3
    """An expected error of a fifth of the depth and less."""
    sources: int = 5
    """Photos that each is compared with."""
    sigma: float = 0.05
    """Difference from which a pair speaks less and less."""
    alike: float = 0.5
    """Share of the pairs of two photos that one light has to bring together. In a real office it was .75 and
    more with true poses and depths, .35 and less with overlaps that the network had found and that were
    none."""
    log_gain: float = 0.3
    """Tau: logarithm of a gain by which photos of one room are expected to differ,"""
    offset: float = 0.05
    """and an offset, of 1."""
    together: float = 32.0
    """Pairs beside each other err together: so many count as one."""
    at_once: int = 16
    """Pairs of photos, so that what is multiplied stays near the processor."""
    coarse: int = 4
    """Every so many blocks of a row and of a column tell which photos overlap."""


EXPOSURE = Exposure()


@dataclass(frozen=True)
class Foreseeing:
    """What neighbours show of a photo (`surface.foreseen`)."""

    cell: int = 3
    """Pixels a side: a neighbour up to three times as far away still leaves a point in each."""
    front: float = 0.1
    """Of the depth behind the nearest point of a cell, within which others are its surface, too."""
    grey: tuple[float, float, float] = (0.299, 0.587, 0.114)
    """Of red, green and blue in brightness (BT.601)."""


FORESEEING = Foreseeing()


@dataclass(frozen=True)
class Pruning:
    """Gaussians that no picture misses (`surface.prune`)."""

    cut: float = 1 / 255
    """The smallest step of an 8-bit picture."""
    max_opacity: float = 0.9999
    """log(1 - o) stays finite."""
    chunk: int = 65_536
    """Merged Gaussians whose dense weights are held at once."""
    min_scale: float = 1e-7
    """Scene units; below it a covariance is singular in float32."""


PRUNING = Pruning()


@dataclass(frozen=True)
class Transients:
    """What others contradict (`surface.transients`)."""

    least: int = 3
    """Photos, from which on two may contradict one."""
    cell: int = 2
    """Pixels a side."""
    around: int = 3
    """Cells a side of the window in which colours may lie."""
    other: float = 0.1
    """sRGB, beyond all colours around, from which it is another colour."""
    alike: float = 0.1
    """sRGB and log depth, within which others foresee one thing."""
    through: float = 0.12
    """Log depth by which a surface lies behind another."""
    votes: int = 2
    """Photos that must foresee something else: one may be wrong."""
    asked: int = 8
    """Photos that are asked about one."""
    few: int = 3
    """Of them, of which one is enough to show what another denies."""
    window: int = 5
    """Cells a side of a window,"""
    full: float = 0.6
    """and the share of them that is contradicted inside a region."""
    smallest: float = 0.004
    """Of a photo."""
    farthest: int = 24
    """Cells, by which a region may go on."""
    margin: int = 2
    """Cells beyond its border."""
    near: int = 3
    """Pixels a side of the window,"""
    like: float = 0.06
    """and sRGB, within which a pixel is found again."""
    found: float = 0.5
    """Of a region's pixels, at one depth."""
    denies: float = 0.5
    """Of a region, that another photo must look at or through to deny it."""
    in_view: float = 0.3
    """Of a region, that another photo must have before it to say anything."""


TRANSIENTS = Transients()


@dataclass(frozen=True)
class ViewSelection:
    """Which photo covers which surface (`surface.view_selection`)."""

    behind: float = 0.12
    """Log depth: how far behind another photo's surface a pixel still shows the same one,"""
    before: float = 0.12
    """and how far before it."""
    about: float = 0.2
    """Relative depth by which what covers a cell may lie behind it."""
    all: int = 8
    """Photos, up to which all are compared with all."""
    tried: int = 8
    """Cells of a row and of a column, of which one is tried; and the side of a block."""
    border: int = 2
    """Cells, at the border of a photo that leads, that take nothing over."""
    finer: float = 2.0
    """Area that a pixel of the earlier photo covers over that of a later one which takes it over."""


VIEW_SELECTION = ViewSelection()
