"""Numbers that stages decide by: one frozen record a stage, each number with its unit and its reason.

A stage takes its record as `settings`, so that a trial can change one number; products take the defaults.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Registration:
    """Depth from what optical flow finds shifted (`depth.registration`)."""

    largest: int = 3
    """Times the maps' size, at which photos are compared."""
    smallest: int = 12
    """Pixels of a photo's side, with which flow works."""
    rounds: tuple[int, int] = (2, 4)
    """Neighbours that a view is compared with, round by round, each from where the one before ended: of many
    photos; a second photo alone says all it can at once. On two rendered walks the median error of depth fell
    from 2.6 % to 1.2 (2), 1.0 (4), 1.0 (2 and 2), .84 (2 and 4), .80 % (4 and 4)."""
    flow_error: float = 0.7
    """Pixels of the photo, standard deviation of a shift."""
    there_and_back: float = 0.7
    """Pixels by which the way back may miss."""
    brightness: float = 10.0
    """Of 255, difference that is still the same."""
    chance: float = 0.03
    """Mean certainty of what a neighbour sees, below which it shows something else."""
    texture: float = 2.0
    """Squared grey values a pixel, of gradient along a shift at which flow is half as sure."""
    flat: float = 0.1
    """Squared grey values a pixel, of that gradient, which are noise."""
    one_shift: int = 10
    """Cells of the maps: flow finds one shift for 16 x 16 pixels and more."""
    farthest: float = 0.3
    """Log depth that a match may ask for."""
    expected: float = 0.15
    """Log depth, what the maps may be off."""
    alike: int = 50
    """Cells that are off together: errors of the maps are slow."""
    stiff: float = 3000.0
    """1 over the square of a log depth: stiffness of the correction from a cell to the next."""
    jump: float = 0.03
    """Log depth between cells from which it is cut."""
    edge: float = 5.0
    """Of 255, difference of brightness between cells from which it is cut."""
    across: float = 0.02
    """What is left of it there: most edges are drawn on one surface."""
    iterations: int = 250
    """Of conjugate gradients, at most."""
    at_hand: int = 64
    """Pictures of one size that are kept."""
    margin: float = 1.0
    """Pixels at the border that say nothing."""


REGISTRATION = Registration()


@dataclass(frozen=True)
class PlaneSweep:
    """Things that depth maps have missed (`depth.planesweep`)."""

    planes: int = 48
    """Hypotheses in equal steps of inverse depth."""
    nearer: float = 2.0
    """Times nearer than all but a hundredth of the map, where planes begin."""
    reach: int = 2
    """Pixels: windows of 5 x 5."""
    noise: float = 5.0
    """Grey values, standard deviation: windows with less show nothing."""
    votes: int = 2
    """Neighbours that must show it: others may have it hidden."""
    alike: float = 0.7
    """Correlation of windows that show one thing."""
    better: float = 0.25
    """Of correlation, than at the map's depth."""
    other: float = 0.1
    """Log depth: nearer to the map registration finds it."""
    same: float = 0.05
    """Log depth within which a neighbour says the same."""
    error: float = 0.02
    """Log depth, of what is found."""
    smoothing: Registration = REGISTRATION
    """Over what corrections are carried."""


PLANE_SWEEP = PlaneSweep()


@dataclass(frozen=True)
class Flattening:
    """Surfaces that are flat as far as anybody can tell (`depth.planes`)."""

    radii: tuple[int, int, int, int] = (2, 4, 8, 14)
    """Of the windows, in pixels of maps of half the size, where a token has 7: the largest is four tokens."""
    share: float = 0.25
    """Of the expected error, which is mostly of whole surfaces; as large are ripples."""
    range: tuple[float, float] = (0.004, 0.015)
    """Of what is a ripple, relative depth: more is a thing, or a bend."""
    farthest: float = 2.5
    """Ripples by which a pixel's own depth may differ from the plane."""


FLATTENING = Flattening()


@dataclass(frozen=True)
class Sharpening:
    """Edges of depth where the photo has them (`depth.sharpening`)."""

    reach: int = 12
    """Pixels: as far as a map smears an edge, 16 pixels a token."""
    rings: tuple[tuple[int, int], ...] = ((3, 6), (7, 9), (12, 12))
    """Radius in pixels, places looked at."""
    nearby: float = 12.0
    """Pixels, standard deviation of what a place counts."""
    flat: float = 0.01
    """Log depth a pixel: a slope of this counts half."""
    colour: float = 0.08
    """Standard deviation of what is one colour, of 1."""
    chroma: float = 1.5
    """Hue counts more than light, which shadows change."""
    least_gap: float = 0.15
    """Log depth between the parts."""
    parted: float = 4.5
    """Gap in standard deviations within the parts; a slanted plane has 3.2."""
    least_flat: float = 0.1
    """Weight of a part below which nobody knows its depth."""
    where: float = 1.5
    """What the side of the slope counts beside the colours, where those say nothing."""
    least_exponent: float = -20.0
    """Numbers too small for a normal float are slow to add."""
    floor: float = 0.02
    """Weight of colours that say nothing."""


SHARPENING = Sharpening()


@dataclass(frozen=True)
class Choice:
    """Which photos a photo is matched with (`rig.pairs`), and compared with (`rig.neighbours`)."""

    all_matched: int = 12
    """Photos up to which every pair is matched."""
    alike: int = 8
    """Of each of more photos, the most similar others that it is matched with,"""
    next: int = 3
    """and the next in the order in which they were given."""
    read: int = 15
    """Photos that each of many reads in the network's decoder."""

    sources: int = 4
    """Of each photo, by the angle."""
    asked: int = 16
    """Photos that are asked about one photo's points."""
    tried: int = 67
    """Points of a photo, of which one is looked for in the others."""
    step: int = 8
    """Pixels between sampled points."""
    surface: float = 0.3
    """Log depth by which the other map may differ and still show the point."""
    full: float = 8.0
    """Degrees between two rays, up to which worth grows."""
    best: float = 9.0
    """Degrees beyond which it falls,"""
    fall: float = 8.0
    """and by how many to 1 / e."""
    apart: float = 4.0
    """Degrees between two neighbours, from which on they say different things."""
    enough: float = 0.15
    """Worth that a point has from the start: what more of the same adds to it."""
    least: float = 0.01
    """Of gain a point, for a neighbour."""


CHOICE = Choice()


@dataclass(frozen=True)
class Straightening:
    """Monocular depth that matches straighten (`cameras.alignment`)."""

    prior_error: float = 0.08
    """Log-depth error that no smooth correction removes."""
    cauchy: float = 2.0
    """Standard deviations from which a match speaks less and less."""
    iterations: int = 15
    """Of least squares that are weighted again."""
    limit: float = 1.0
    """Log depth: a correction never exceeds a factor of e."""
    independent: int = 50
    """Errors of one map go together: all its matches count as this many."""


STRAIGHTENING = Straightening()


@dataclass(frozen=True)
class Graph:
    """Relative poses of pairs brought together (`cameras.graph`)."""

    sources: int = 4
    """Of each photo, whose pairs are looked at."""
    loop: float = 4.0
    """Degrees within which the turns around a triangle must close to confirm its edges."""
    robust: float = 3.0
    """Sigmas from which an edge speaks less and less (Geman-McClure)."""
    agrees: float = 40.0
    """Square of the gap in sigmas (7 degrees of freedom) up to which an edge is kept."""
    steps: int = 12
    """Of Gauss and Newton, at most."""
    damping: float = 1e-6
    """Share of the diagonal: views that no edge reaches stay."""
    turn_sigma: float = 0.3
    """Degrees: errors that matches of a pair share, so that no number of them removes it;"""
    shift_sigma: float = 0.03
    """of a shift, scene units per unit of depth;"""
    scale_sigma: float = 0.1
    """and of a log scale."""


GRAPH = Graph()


@dataclass(frozen=True)
class Adjustment:
    """All photos and lenses adjusted together (`cameras.adjustment`)."""

    observations: tuple[int, int] = (150, 400)
    """Of each view, in the first round and in the second: more change nothing but the time."""
    sigma: float = 0.4
    """Pixels at the working size, of a key point."""
    agrees: float = 2.0
    """Times the tolerance of pairs, within which matches join once poses are known."""
    shared: float = 3.0
    """Standard errors of a lens are so many times those of independent observations: errors of key points
    depend on what they show, and go together."""
    known: float = 0.03
    """Standard error of a focal length, of itself, above which it is not taken."""
    fields: tuple[float, float] = (20.0, 120.0)
    """Degrees of the longer side: what photos of rooms are taken with."""
    bend_doubt: float = 0.15
    """Standard deviation expected of a bend: action cameras have as much."""
    bend_sure: float = 3.0
    """Standard errors from which a bend is one."""
    bend_seen: float = 4.0
    """Pixels at the working size by which a bend moves a photo's corner, at least: the focal length makes up
    for three quarters of that, and key points are sure to the rest."""
    steepest: float = 0.1
    """Of a straight lens: what a bent one magnifies a photo's corner along the radius, at least."""
    fewest: int = 3
    """Photos of one lens from which it is sought, and photos from which all are adjusted together."""


ADJUSTMENT = Adjustment()


@dataclass(frozen=True)
class Pairing:
    """Poses of pairs, and which photos tell a lens first (`cameras.poses`)."""

    min_share: float = 0.25
    """Of the matches, that must agree with a pose."""
    max_depth_sigma: float = 0.2
    """Log-depth error beyond which a triangulated match says too little."""
    min_points: int = 10
    """Matches needed to correct a map."""
    few: int = 40
    """Inliers among key points, below which dense matches are asked as well."""
    first: int = 8
    """Photos that tell the lens first."""
    enough: int = 100
    """Matches with one of them."""
    other_lens: float = 0.05
    """Change of a focal length, as a logarithm, from which pairs are looked at again."""
    dense_cost: float = 2.75
    """Cost from which dense matches are not believed: on validation rooms the wrong ones began at 2.8."""
    checked: int = 4
    """Pairs of known poses that are sought as well."""
    bridges: int = 4
    """Pairs that are asked, at most, to connect two parts: ten place no photo of four walks more."""
    graph: Graph = GRAPH
    """How the poses of pairs are brought together."""
    adjustment: Adjustment = ADJUSTMENT
    """How all photos are adjusted."""
    straightening: Straightening = STRAIGHTENING
    """How their depth maps are corrected."""
    other_depth: float = 0.01
    """Change of the focal length, as a logarithm, from which depth is predicted anew: it is known no
    better."""


PAIRING = Pairing()


@dataclass(frozen=True)
class Bundle:
    """Bundle adjustment (`cameras.bundle`); how sure depth is has `Matching`."""

    independent: int = 1
    """Observations as which all of a map count: many views know depths themselves. On four walks of 4 and 8
    photos the turns were wrong by .15, .11, .53, 1.0 degrees with 1, by .13, .38, .75, 4.0 with a pair's
    20."""
    cauchy: float = 2.0
    """Sigmas from which an observation speaks less and less."""
    outlier: float = 4.0
    """Sigmas beyond which an observation is none."""
    iterations: int = 25
    """Steps of a round, at most."""
    rounds: int = 2
    """Between which outliers are left out."""
    converged: float = 1e-4
    """Share of the cost below which a step's gain ends the last round,"""
    nearly: float = 1e-3
    """and the rounds before."""
    damped: float = 1e-2
    """Damping above which a small gain says nothing of what is left."""
    nearer: float = 0.3
    """A step leaves each point this share of its depth, in any camera."""
    longest: int = 32
    """Observations of a point that are adjusted."""


BUNDLE = Bundle()


@dataclass(frozen=True)
class Matching:
    """Key points, matches and the poses of pairs (`cameras.matching`)."""

    features: int = 4000
    """Key points of a photo, at most."""
    contrast: float = 0.01
    """Of SIFT: walls have little, and the default of .04 finds nothing on them."""
    ratio: float = 0.8
    """Lowe's test."""
    fewest: int = 15
    """Matches that must agree with a pose."""
    depth_sigma: float = 0.25
    """Log-depth error expected of a monocular map."""
    scale_sigma: float = 0.3
    """Log ratio expected between the scales of two monocular maps."""
    independent: int = 20
    """Errors of one map go together: at all matches of a pair they count as this many. On 48 validation rooms
    the mean errors were .53 and 2.4 degrees with 50, .48 and 2.1 with 20, .57 and 2.0 with 10; without the
    rounds below .63 and 3.0 with 50. On 32 held-out rooms the medians went from .68 and 2.2 to .31 and
    1.7."""
    rounds: int = 2
    """Times that the matches which agree are chosen anew and the pose is refined on them."""
    inlier: float = 3.0
    """Sigmas of reprojection."""
    cauchy: float = 2.0
    """Residuals beyond this many sigma lose weight."""
    iterations: int = 40
    """Of Levenberg and Marquardt, at most."""
    converged: float = 1e-5
    """Share of the cost below which a step's gain ends the search. Against searching on, the errors of 16
    validation pairs changed by at most .03 (rotation) and .11 degrees (direction); no right pose was lost."""
    working_side: int = 768
    """Pixels of the longer side at which photos are matched."""
    many: int = 4
    """Photos; of more"""
    features_of_many: int = 1500
    """each has so many key points, which keeps the pairs affordable."""
    min_cosine: float = 0.8
    """Of two cells' local features that match."""
    dense_sigma: float = 3.0
    """Pixels at the working size: a third of a cell."""


MATCHING = Matching()


@dataclass(frozen=True)
class KnownPoses:
    """Poses that are given, against the photos (`cameras.known`)."""

    tolerance: float = 3.0
    """Standard deviations of a match from its epipolar line."""
    least_parallax: float = 2.0
    """Standard deviations of a match that its depth must move it by."""
    loose: float = 6.0
    """Standard deviations within which a pose explains a match: two thirds of a degree of a usual lens."""
    agreed: float = 0.5
    """Share of the matches which poses explain that are sought: given ones that fit explain as many and
    more."""
    fewest: int = 12
    """Matches that say a map's scale."""


KNOWN_POSES = KnownPoses()


@dataclass(frozen=True)
class FilmPair:
    """The best two of several photos (`cameras.pairs`)."""

    side: int = 640
    """Pixels of the longer side at which photos are compared."""
    features: int = 1500
    """Key points of a photo, at most."""
    fewest: int = 20
    """Agreeing matches below which two photos share nothing."""
    tolerance: float = 1.5
    """Pixels at that side."""
    enough: float = 0.01
    """Parallax, in sides, from which more makes a pair no better."""
    least: float = 0.05
    """What a pair without parallax is worth."""


FILM_PAIR = FilmPair()


@dataclass(frozen=True)
class Retrieval:
    """How alike photos look (`cameras.retrieval`)."""

    words: int = 64
    """Kinds of descriptors."""
    samples: int = 8000
    """Descriptors that they are learned from."""
    rounds: int = 8
    """Of Lloyd."""


RETRIEVAL = Retrieval()


@dataclass(frozen=True)
class Adding:
    """A photo more for a finished scene (`reconstruction.adding`)."""

    beside: int = 4
    """Photos of the scene that each new one is reconstructed with: a view is blended of as many."""
    same_lens: float = 0.5
    """Degrees by which recorded fields of view of one lens differ: of a millimetre of some 26, to which they
    are rounded."""
    misses: float = 2.0
    """Pixels of the photo, 768 long, by which a point of the scene may miss its key point at first."""
    sigma: float = 1.0
    """Pixels of the photo, 768 long, standard deviation of a key point."""
    depth_sigma: float = 0.05
    """Log depth that a layer may be off. The ninth photo of a kitchen then stands .02 degrees and .03 % of
    the depth beside where all nine put it; .22 and .3 without adjustment."""
    cauchy: float = 2.0
    """Standard deviations from which a key point speaks less and less."""
    least: int = 6
    """Points that agree: fewer determine no pose beyond their own noise."""
    solid: float = 0.5
    """Opacity from which a Gaussian is a surface."""


ADDING = Adding()
