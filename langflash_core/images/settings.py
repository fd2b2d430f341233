"""Numbers that `images` decides by: one frozen record a subject, each number with its unit and its reason."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Decoding:
    """How files become pixels (`images.decode`)."""

    min_side: int = 32
    """Pixels of a photo's side: a smaller one shows nothing that could be placed."""
    mid_grey: tuple[int, ...] = (128, 128, 128, 255)
    """Red, green, blue and alpha of what is put behind transparent photos, of 255."""
    decoded_side: int = 1536
    """Pixels on the long side that a reduced JPEG decode keeps at least."""
    rows_at_once: int = 256
    """Of a picture whose colours are changed in floats."""


DECODING = Decoding()


@dataclass(frozen=True)
class Looking:
    """What of a film is looked at (`images.film`)."""

    looks: float = 15.0
    """Pictures a second that are looked at, at most."""
    min_side: int = 64
    """Pixels of a film's side."""


LOOKING = Looking()


@dataclass(frozen=True)
class Stills:
    """Which frames of a film are kept as stills (`images.frames`)."""

    piece: float = 0.02
    """Of the side that the picture moves in a piece, of which one frame is kept."""
    ruler: float = 0.08
    """Of the side: who turns back where he goes on has gone so far, whose hand shakes has not."""
    fast: float = 0.12
    """Of the side from one picture to the next: a hand does that, and may then be lost."""
    most_stills: int = 600
    """Stills of a film: with more, every second one goes."""
    still_side: int = 1920
    """Pixels of the longer side of a kept frame, at most."""
    quality: int = 92
    """Of a kept frame's JPEG."""
    dark: float = 0.08
    """Of 1: a frame whose brightest tenth stays below is left out."""
    kept_films: int = 8
    """Films of which stills are kept."""
    unseen: float = 0.3
    """Of the side, that the film is taken to have moved where it was lost in a fast turn."""
    most_shots: int = 12
    """Shots that are compared with each other."""
    compared_stills: int = 3
    """Stills of a shot that are compared with those of others."""


STILLS = Stills()


@dataclass(frozen=True)
class LensPrior:
    """What a lens is taken for before photos tell it (`images.lens`)."""

    assumed_fov: float = 65.0
    """Degrees on the longer side: a phone's main camera (24-28 mm equivalent)."""
    plausible_fov: tuple[float, float] = (5.0, 150.0)
    """Degrees; EXIF that says otherwise is wrong."""
    film_diagonal: float = math.hypot(36.0, 24.0)
    """Millimetres, of the film that focal lengths are compared by."""
    assumed_doubt: float = 0.35
    """Standard deviation of the logarithm of an assumed focal length: a wide lens is at -.6, twice the
    zoom at +.7."""
    recorded_doubt: float = 0.02
    """The same of a recorded one, which is rounded to a millimetre of some 26 and changes with the focus."""


LENS_PRIOR = LensPrior()


@dataclass(frozen=True)
class Motion:
    """How a film's camera moves from picture to picture (`images.motion`)."""

    side: int = 320
    """Pixels of the longer side in which corners are followed."""
    sharp_side: int = 768
    """Pixels of the longer side in which sharpness is judged: that of the finest elements of a scene."""
    corners: int = 300
    """Corners that are followed, at most."""
    fewest: int = 20
    """Corners with which a motion can be told."""
    back: float = 1.0
    """Pixels by which a corner may miss its place on the way back."""
    lost: float = 0.15
    """Of the corners followed: below, this is another shot."""
    weak: float = 0.45
    """Of those at the anchor: below, fresh ones are taken."""
    same: float = 0.02
    """Of the side: two pictures between which most of what is seen moved less are from one place,"""
    alike: float = 0.85
    """and correlate by this much."""
    far: int = 80
    """Per cent of the corners that move no farther than the picture as a whole."""
    most: int = 85
    """Per cent of the corners that stand for most of what is seen."""
    stay: int = 40
    """Per cent of the corners that stand still where a camera turns around a thing."""
    moves: float = 1.0
    """Pixels: less is where corners are found, not where they are."""
    edge: int = 30
    """Steps of grey of an edge that tells of blur."""
    edges: int = 40
    """Edges that are needed to tell."""
    reach: int = 15
    """Pixels across an edge."""
    joins: int = 16
    """Matches that agree with one motion: two pictures show one room,"""
    agree: float = 0.5
    """and their share of all."""
    tiny: tuple[int, int] = (32, 24)
    """Pixels, width and height, in which pictures are compared as wholes."""
    window: tuple[int, int] = (21, 21)
    """Pixels that corners are followed by."""
    levels: int = 3
    """Halvings of the picture, over which corners are followed."""


MOTION = Motion()


@dataclass(frozen=True)
class Photos:
    """Photos as they are taken in (`images.pictures`)."""

    max_photos: int = 300
    """Photos of a scene, at most."""
    film_photos: int = 32
    """Frames of a film that a scene is made of unless more are asked for: each takes as long as a photo."""
    max_aspect: float = 2.0
    """Longer to shorter side; more is cut off."""
    source_side: int = 768
    """Pixels of the longer side of a photo as the scene keeps it."""
    source_quality: int = 88
    """Of that one's JPEG."""
    judged_side: int = 360
    """Pixels of the short side at which light and sharpness are judged."""
    readers: int = 4
    """Photos in memory at once, as they were decoded."""


PHOTO_LIMITS = Photos()


@dataclass(frozen=True)
class Straighten:
    """Photos of bent lenses, drawn as straight ones take them (`images.straight`)."""

    quality: int = 95
    """Of JPEG: what was stored once already loses no more than it must."""
    scales: tuple[float, float] = (0.25, 4.0)
    """Times the focal length that is looked for."""
    steps: int = 30
    """Of halving: to a thousandth of a pixel."""
    steepest: float = 0.1
    """Of a straight lens: what is magnified along the radius, at least."""


STRAIGHTEN = Straighten()


@dataclass(frozen=True)
class Choosing:
    """Which frames of a film make a scene (`images.strip`)."""

    spacing: float = 0.05
    """Of the side, the root of a picture's area, from one chosen frame to the next."""
    narrowest: float = 0.4
    """Of the spacing, to which gaps between frames may shrink."""
    widest: float = 0.35
    """Of the side, to which they may grow: nearly half of a picture may then be new."""
    near: float = 0.25
    """Of the side: frames that are compared for sharpness."""
    blurred: float = 0.4
    """Of the sharpness of the sharpest frame near: less is blurred."""
    smeared: float = 1.5
    """Times the usual width of edges: wider ones are smeared."""
    apart: float = 0.35
    """Of the side: frames that are farther from each other have too little in common."""
    stands: float = 0.02
    """Of the side: a film that moves less is a still."""
    uneven: float = 1.5
    """What a gap twice as wide as the others costs, in factors of e of sharpness."""


CHOOSING = Choosing()


@dataclass(frozen=True)
class Judging:
    """Which photos are told to be of no use (`images.triage`)."""

    small_side: int = 200
    """Pixels of the short side, below which a photo is small."""
    dark_lights: float = 0.22
    """A photo whose brightest 10 % stay below this is too dark."""
    blank_spread: float = 4 / 255
    """A photo whose pixels differ by less shows nothing; the darkest usable ones have 7."""
    burnt_share: float = 0.5
    """Share of pixels at the top of the range."""
    blur_width: float = 4.0
    """Pixels at that size over which even the sharpest edges rise."""
    edge_contrast: float = 0.12
    """An edge weaker than this says nothing about sharpness."""
    edge_blocks: int = 40
    """Fewer stretches with an edge: a plain wall, not judged."""
    same_difference: float = 1.5 / 255
    """Mean absolute difference of two views of the same picture."""
    alike_one_by_one: int = 3
    """Photos that show the same as others: so many are named, more are counted."""
    lost_share: float = 0.25
    """Of a photo's area, that the crop may cut off without a note."""
    fov_range: tuple[float, float] = (25.0, 110.0)
    """Degrees of the longer side."""
    block: int = 12
    """Pixels of the stretches that edges are looked for in."""
    window: int = 25
    """Pixels along an edge's rise."""


JUDGING = Judging()
