"""Numbers that `scene` decides by: one frozen record a subject, each number with its unit and its reason."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class FromAbove:
    """A scene seen from above (`scene.above`)."""

    core: tuple[float, float] = (0.01, 0.99)
    """Of the Gaussians along an axis: stray ones do not stretch the picture."""
    margin: float = 0.06
    """Around all places, of the longer side."""
    least: float = 0.5
    """Shorter side of the picture, of the longer one."""
    ground: int = 26
    """Of 255, where nothing stands."""
    blur: float = 0.9
    """Cells: closes the gaps between Gaussians."""
    full: float = 0.02
    """Of what the fullest hundredth of cells hold: shown as it is; less fades into the ground."""


FROM_ABOVE = FromAbove()


@dataclass(frozen=True)
class AtomPictures:
    """What photos show of an atom (`scene.atoms`)."""

    cell: int = 4
    """Pixels of a photo as the network saw it, along a side."""
    picture_side: int = 96
    """Pixels of an atom's picture."""
    near_enough: float = 1.05
    """Of the nearest depth in a cell: what lies behind is hidden."""


ATOM_PICTURES = AtomPictures()


@dataclass(frozen=True)
class BareViews:
    """Views of a scene without photos (`scene.bare`)."""

    view_size: tuple[int, int] = (960, 720)
    """Pixels, width and height."""
    fov: float = 50.0
    """Degrees of the longer side, from outside."""
    elevation: float = math.radians(15)
    """Radians from above: floors and table tops show."""
    most: int = 200_000
    """Gaussians looked at: medians need no more."""
    seen: float = 0.1
    """Opacity from which a Gaussian says where the scene is."""
    cone: float = math.tan(math.radians(50))
    """Slope of the rays looked along: wider than the field of view of photos."""
    in_cone: float = 0.98
    """Share of the Gaussians; the rest bled in depth."""
    shown: float = 0.97
    """Share of the slopes that the view from the origin shows."""
    deviations: float = 2.5
    """Median deviations from the middle that are shown: an even spread ends at 2, a normal one fades at 4."""
    margin: float = 1.2
    """Times that extent, which a view takes in."""
    farthest: float = 1e38
    """Float32 ends at 3.4e38, and a hostile file has means there."""


BARE_VIEWS = BareViews()


@dataclass(frozen=True)
class Changes:
    """What one change may do (`scene.changes`)."""

    darkest: float = 0.05
    """Mean luma of what is recoloured, at the least: black has no shading to keep."""
    scales: tuple[float, float] = (0.001, 1000.0)
    """Times the size, of one change."""


CHANGES = Changes()


@dataclass(frozen=True)
class Doubts:
    """When photos are told to be in doubt (`scene.doubts`)."""

    torn: float = 0.65
    """Likeness of a photo's edges to what its neighbours foresee (`foreseen`), below which they do not
    meet. Of 25 photos of two real walks it is .46 to .92; all nine below .65 look torn in pictures of
    their neighbours' layers, of the others single near things do. With one pose a degree wrong it is .46
    on average, with two .18."""
    alone: float = 0.5
    """Share of a photo that its neighbours show, below which it stands alone: at both ends of two real
    walks, behind which nobody stood, it is .71 to .80."""
    blurred: float = 26.0
    """DB of a photo's own layer beside it, below which one sees that they differ: layers of real photos
    reach 34 to 40, and 26 is what one surface of nine photos shows between them."""
    told: int = 6
    """Photos, and gaps between photos, that are told one by one."""


DOUBTS = Doubts()


@dataclass(frozen=True)
class Exposure:
    """The light of a place among photos (`scene.exposure`)."""

    far: float = 0.25
    """Radians: so far from the only photo, a picture is half in its light. Beside eight real photos .2 and
    .3 are best in the mean (MEASURED, "The light of a place")."""
    here: float = 1e-4
    """Radians, within which a place is a photo's own."""


EXPOSURE = Exposure()


@dataclass(frozen=True)
class Gaps:
    """Gaps of a picture that are filled (`scene.gaps`)."""

    reach: int = 8
    """The shorter side is this many times as long as what is filled from one side. Six validation rooms
    seen from 20 degrees aside: half the length loses .17 dB, twice as much gains .02."""


GAPS = Gaps()


@dataclass(frozen=True)
class Instances:
    """Which Gaussians are one connected thing (`scene.instances`)."""

    link: float = 4.0
    """Mean radii within which two Gaussians touch. On scenes of photos the parts are the same from 3 to 8;
    below, surfaces fall apart, since neighbours of a pixel's size are 1.5 radii apart."""
    smallest: float = 0.02
    """Of the largest thing's surface: less is a crumb."""
    same: float = 0.1
    """Of the logarithm of depth, within which two layers show the same: as `DEPTH` of `splat.compose`."""
    shown: float = 0.25
    """Of the smaller of two parts, that a photo shows at the other's place: much of a thing may be hidden
    there, and what stands beside it meets it with its edge."""
    neighbours: int = 16
    """Asked of each: more than a surface needs to stay in one piece."""


INSTANCES = Instances()


@dataclass(frozen=True)
class Joining:
    """Two scenes put beside each other (`scene.joining`)."""

    most_atoms: int = 960
    """That the picture can show together (app/gl/packed.py)."""
    gap: float = 0.1
    """Between both, of the first one's width."""
    edge: float = 0.02
    """Share of the places on either side that counts as outliers."""


JOINING = Joining()


@dataclass(frozen=True)
class Lookouts:
    """Where people would stand in a scene without photos (`scene.lookouts`)."""

    fov: float = 70.0
    """Degrees of the longer side: a phone's main lens."""
    points: int = 8_000
    """That are looked at."""
    across: int = 9
    """Eyes along each side of the ground."""
    heights: tuple[float, ...] = (0.4, 0.55, 0.75, 1.0)
    """Of the box, from its floor."""
    around: float = 1.7
    """Times the box, in which eyes are tried."""
    deep: float = 0.5
    """Of the diagonal, that the box has at least: before a wall one stands, too."""
    free: float = 0.07
    """Of the box's diagonal, within which an eye has nothing."""
    far: float = 0.4
    """Of the diagonal, from which people look at things."""
    spread: float = 0.7
    """Standard deviation of the logarithm of that."""
    ways: int = 12
    """To look around."""
    pitches: tuple[float, float] = (0.0, 0.3)
    """Level, and a little down."""
    down: int = 16
    """Cells of a panorama from top to bottom."""
    around_cells: int = 32
    """Cells of a panorama all around."""
    informed: float = 0.05
    """Correlation of size and distance of the best eye, from which they tell anything."""
    sure: int = 3
    """Power of its correlation by which an eye is believed, the best one wholly."""
    doubted: float = 0.02
    """What an eye is believed at least."""
    least: float = 0.02
    """Of what the first view adds, that another one adds."""
    surface: float = 1.1
    """Times the nearest distance in a cell, within which others are seen, too."""


LOOKOUTS = Lookouts()


@dataclass(frozen=True)
class Regions:
    """What a click means (`scene.regions`). Chosen on 12 held-out rooms (seeds 900000200 to 211) beyond
    those that are judged; `thing`, `growth` and `of_one` also on those of `tests.tools.clicks`."""

    language: float = 1.5
    """What a difference of language counts."""
    colour: float = 1.0
    """What a difference of colour counts, in CIELAB over 100."""
    jump: float = 0.6
    """What a jump of depth counts."""
    alone: float = 1.0
    """What little overlap counts, of two regions that no photo shows side by side."""
    thing: tuple[float, float] = (0.06, 0.3)
    """Heights between which the border of a thing is looked for."""
    growth: float = 0.2
    """Power of how much larger the next region is, beside how long the border of a thing holds."""
    of_one: float = 0.15
    """Power of how much of a region is of the atom that was clicked."""
    most_growth: float = 4.0
    """Times as large, from which a next region tells no more."""
    size: float = 0.25
    """Power of the smaller region's share of the photos: specks are joined first."""
    step: float = 0.03
    """Of the logarithm of depth from a pixel to the next, beyond twice the steps beside: a jump."""
    same: float = 0.05
    """Of the logarithm of depth, within which two photos show the same place."""
    shade: float = 0.03
    """Of a colour, up to which neighbours are of one leaf."""
    filled: int = 8
    """Pixels that a Gaussian may be away from a pixel that it stands for."""
    partners: int = 4
    """Photos that each is compared with: what more of them show is joined by way of these."""
    least_overlap: float = 0.1
    """Of the smaller of two regions, below which they do not meet."""
    steps: tuple[float, float] = (1.5, 4.0)
    """Times as large: the next level of a click, at the least and at the most. Below, nobody sees what came;
    of 24 clicks in two real rooms most had a step above, up to 300, from a lamp to the whole ceiling."""
    leap: float = 8.0
    """The same where nothing smaller goes on: a sign on a box, and the box."""
    twin: float = 0.5
    """Of a leaf, that another photo shows as well: it is the same thing there."""
    least_thing: float = 0.0005
    """Of a photo: smaller regions are specks, unless someone asks for less."""
    all: float = 0.5
    """Of the scene: a region so large is no group."""


REGIONS = Regions()


@dataclass(frozen=True)
class Report:
    """What is said of a scene (`scene.report`)."""

    core: tuple[float, float] = (0.01, 0.99)
    """The middle 98 % along each axis: stray points do not stretch the box."""
    named: int = 4
    """Photos, of which it is said what was left out."""
    short: int = 40
    """Letters, up to which names of photos are read; else photos are numbered."""


REPORT = Report()


@dataclass(frozen=True)
class Selection:
    """Stray Gaussians (`scene.selection`)."""

    neighbours: int = 12
    """That a Gaussian on a surface has around it, two rings of a square grid."""
    mad_to_deviation: float = 1.4826
    """Of a normal distribution."""
    least_deviation: float = 0.1
    """Of a logarithm: a perfect grid has spread 0, and tenths there are no news."""


SELECTION = Selection()


@dataclass(frozen=True)
class Standing:
    """Which way up a scene without photos stands (`scene.standing`)."""

    level: float = math.cos(math.radians(30))
    """Cosine with up, from which a surface is level."""
    seen: float = 0.1
    """Opacity from which a Gaussian says where the scene is."""
    most: int = 20_000
    """Gaussians looked at: opening takes a fiftieth longer."""
    end: float = 0.2
    """Of the height, at its bottom and at its top."""
    times: float = 4.0
    """So much more level surface at the top than at the bottom."""
    share: float = 0.1
    """Of all surface, at least, that is level and at the top."""


STANDING = Standing()


@dataclass(frozen=True)
class Surroundedness:
    """Where in a scene something is known (`scene.surroundings`)."""

    most: int = 9000
    """Samples of a scene."""
    a_photo: int = 32 * 24
    """Cells of a photo's grid, at the most."""
    quantiles: tuple[float, float, float] = (0.1, 0.5, 0.9)
    """Of the depths in a cell, each a sample: a table seen aslant has no hole, and an edge both its sides."""
    solid: float = 0.1
    """Opacity from which a Gaussian is a surface."""
    clear: float = 0.18
    """Of the scene's depth, that a camera keeps from surfaces: what is nearer than a tenth fills the
    picture with a few Gaussians, and samples lie up to a tenth apart."""
    aside: float = math.cos(math.radians(60.0))
    """Degrees between camera and photo, at a surface, up to which it counts as seen: there a picture has
    faded to the half (langflash_core/scene/trust.py)."""
    close: float = 1.1
    """Times the depth of what is seen from aside, up to which what is seen well is not hidden by it."""
    cells: tuple[int, int] = (16, 12)
    """Of a picture, of which it is asked whether they show something."""
    levels: int = 5
    """Of cells, each twice as large: the largest is the picture."""


SURROUNDINGS = Surroundedness()


@dataclass(frozen=True)
class Tours:
    """What a tour can hold (`scene.tour`)."""

    most_stops: int = 100
    """Stops of a tour."""
    most_notes: int = 200
    """Notes of a tour."""
    longest_name: int = 60
    """Letters of a name."""
    longest_text: int = 400
    """Letters of a text."""


TOURS = Tours()


@dataclass(frozen=True)
class Trust:
    """What is shown of surfaces seen from aside (`scene.trust`). Chosen by eye on the demo pairs: at 45
    degrees a table still stands, at 65 what was smeared behind things hides them."""

    full: float = 30.0
    """Degrees aside up to which a surface is shown whole."""
    none: float = 75.0
    """Degrees aside from which it is not shown at all."""


TRUST = Trust()
