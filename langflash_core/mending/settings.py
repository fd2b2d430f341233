"""Numbers that `mending` decides by: one frozen record a subject, each number with its unit and its
reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Cleaning:
    """What cleaning measures by (`mending.cleaning`)."""

    core: float = 0.01
    """Share of the places on either side of each axis that the box "core" leaves outside."""
    room: float = 0.1
    """Of its sides by which the box "room" goes beyond core and photos."""
    seen: float = 0.05
    """Pixels of a photo that a Gaussian makes up: it is seen there."""


CLEANING = Cleaning()


@dataclass(frozen=True)
class Cloning:
    """Surfaces that are copied (`mending.cloning`)."""

    scales: tuple[float, float] = (0.25, 4.0)
    """Of copies that are to be as close together as what is there."""
    far: float = 0.012
    """Of the depth: what lies on the surface, as in `filling.py`."""
    flat: float = 0.1
    """Of the brush's radius: what lies on the source's plane."""
    share: float = 0.05
    """Of the points that a plane holds at the least."""
    relief: float = 0.5
    """Of the brush's radius: farther from the source's plane is another thing."""
    nearest: int = 12
    """Points round a place: of its plane at the least, and of which a height is the median."""
    half: float = 0.5
    """Of a pixel's light, and of the pixels: there is a surface."""
    grazing: float = 0.02
    """Sine of the angle between a ray and the plane, below which they do not meet."""
    away: float = 1e4
    """Scene units: where the eye of parallel rays is taken to be."""
    rim: float = 1.0
    """Pixels by which copies reach over the edge."""


CLONING = Cloning()


@dataclass(frozen=True)
class Coarsening:
    """Parts made unrecognisable (`mending.coarse`)."""

    levels: int = 16
    """Of each channel of a colour: so few tell no pattern."""
    opacity: float = 0.99
    """Of the Gaussians of blocks."""
    places: int = 8
    """Places along a block's side, for which it is parted."""
    cover: float = 0.85
    """Deviation of a Gaussian over its spacing: closed (surface/elements.py)."""
    thin: float = 0.1
    """Thickness of theirs over their width."""
    tiles: int = 6
    """Gaussians along the side of a block."""
    around: int = 8
    """Blocks that run into each other."""


COARSENING = Coarsening()


@dataclass(frozen=True)
class Filling:
    """Holes of a scene that are filled (`mending.filling`)."""

    opacity: float = 0.99
    """Of the Gaussians that fill."""
    cover: float = 0.85
    """Deviation over spacing, as elements of a scene have."""
    thin: float = 0.1
    """Thickness over that."""
    finer: int = 2
    """Times the views' own grid at which they are looked at."""
    most_side: int = 512
    """Pixels of the longer side of that."""
    most_views: int = 6
    """Views that are looked at; from between them little more is open."""
    least: int = 12
    """Pixels of a hole."""
    ring: float = 0.08
    """Of the longer side: what is around a hole, of which its texture is made; twice that is drawn."""
    rim: int = 2
    """Pixels around a hole that still have the part's colours."""
    before: float = 0.97
    """Of the depth of what was taken away: nearer is no background."""
    dense: float = 0.6
    """Of the pixels around one, that other views see behind the part: fewer are errors of depth."""
    rare: float = 0.1
    """Of a hole's edge: groups that hold less of it are things beside it, which nobody wants copied."""


FILLING = Filling()


@dataclass(frozen=True)
class HidingBlocks:
    """What is hidden in photos (`mending.hiding`)."""

    blocks: float = 6.0
    """Blocks along a hidden part, unless more or fewer are asked for."""
    most_blocks: float = 16.0
    """Blocks along it: with more one recognises it."""
    matte: float = 0.02
    """Of a pixel's light: a photo shows the part from there on."""
    beside: float = 1.03
    """Times as deep as what a view shows: still that surface."""
    own: float = 0.5
    """Of an atom's opacity in what is hidden: a name of it may say who that was."""


HIDING = HidingBlocks()


@dataclass(frozen=True)
class Preview:
    """Pictures of before and after (`mending.looks`)."""

    shade: tuple[float, float, float] = (0.85, 0.1, 0.1)
    """Red, green and blue of what goes."""
    red: float = 0.75
    """Of that colour, mixed with its own."""
    least: float = 1 / 255
    """Of a pixel that is covered."""
    most_views: int = 4
    """Views in a picture of before and after."""


PREVIEW = Preview()


@dataclass(frozen=True)
class HiddenPhotos:
    """Photos that hide a part (`mending.photos`)."""

    quality: int = 90
    """Of JPEG."""
    patch: int = 5
    """Pixels of the squares that a photo is compared by."""
    strange: float = 0.12
    """Mean difference of a photo from the scene over such a square, from which it is not shown."""
    least: float = 2.0
    """Pixels around a mask that always belong to it."""
    rounded: float = 0.2
    """Of a blurred mask: it grows a little, and loses the corners of its pixels."""


HIDDEN_PHOTOS = HiddenPhotos()


@dataclass(frozen=True)
class PlaneFit:
    """Planes among points (`mending.planes`)."""

    triples: int = 500
    """Triples of points that are tried."""
    refits: int = 3
    """Times that a plane is fitted again to what lies on it."""


PLANE_FIT = PlaneFit()


@dataclass(frozen=True)
class Recipes:
    """What recipes say where nothing is said (`mending.recipes`)."""

    margin: float = 0.02
    """Around a part that is hidden in photos, of their longer side: the usual one,"""
    most_margin: float = 0.25
    """and the widest."""
    strength: float = 0.5
    """Of cleaning, in [0, 1]."""
    off: float = 0.1
    """Of a colour, where nothing is said."""


RECIPE_DEFAULTS = Recipes()


@dataclass(frozen=True)
class Crumbs:
    """How strongly crumbs are cleaned (`mending.strength`)."""

    apart: float = 3.0
    """Times `INSTANCES.link`: what is nearer to the rest is no crumb, but a part of its surface."""
    fewest: int = 16
    """Gaussians of which it can be said what is usual."""


CRUMBS = Crumbs()


@dataclass(frozen=True)
class Taking:
    """What goes with a part that is taken out (`mending.taking`)."""

    shown: float = 0.5
    """Of a pixel's light: it shows the part from there on."""
    margin: float = 0.01
    """Of a photo's longer side: so far colours of a thing run over its edge."""
    beside: float = 1.03
    """Times as deep as the part, either way: at its depth, as far as photos agree on that."""
    far: float = 0.02
    """Of the part's Gaussians along an axis, to each side: they may lie far off, where depth went wrong."""
    room: float = 0.05
    """Of the diagonal of the part's box, around it: what other layers have in its place lies there."""


TAKING = Taking()


@dataclass(frozen=True)
class Texture:
    """Texture that is carried on (`mending.texture`)."""

    reach: int = 3
    """Pixels of a patch to each side of its middle."""
    means: float = 0.03
    """Of a colour's range: so far means of patches differ, as light does along a wall."""
    decay: float = 1.3
    """By which a pixel counts less for each pixel that it is farther from what is known (Wexler)."""
    usual: float = 0.75
    """Quantile of what patches differ by, which is the variance of their weights (Wexler)."""
    rounds: int = 3
    """Times that patches are sought and the hole is painted, at full size; at half of it twice as often."""
    most: int = 12_000
    """Patches of a hole that are sought again at a size; more keep what half of it found: seconds."""
    fewest: int = 200
    """Patches that are known; with fewer only colours run in."""


TEXTURE = Texture()
