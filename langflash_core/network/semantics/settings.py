"""Numbers that `semantics` decides by: one frozen record a subject, each number with its unit and its
reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Crops:
    """Crops that a language tower sees (`network.semantics.crops`)."""

    side: int = 224
    """Pixels; what CLIP ViT-B/32 sees."""
    tail: float = 0.02
    """Of a group's mass may lie outside its box on every side: stray pixels."""
    margin: float = 0.1
    """Of the box's longer side is added on every side: things are known by where they stand."""
    smallest: float = 1 / 16
    """Of the picture's side."""


CROPS = Crops()


@dataclass(frozen=True)
class Lifting:
    """Masks of photos as groups of a scene (`network.semantics.lifting`)."""

    same_depth: float = 0.05
    """Of the depth: points further apart are different surfaces."""
    same_mask: float = 0.5
    """Of the pixels that two masks cover together where both photos see."""
    soft: int = 5
    """Pixels over which a group's border fades: borders of masks are that sure."""


LIFTING = Lifting()


@dataclass(frozen=True)
class PartNaming:
    """Names of parts (`network.semantics.naming`)."""

    place: int = 10
    """Numbers that `places` gives of a part."""
    deep: int = 4
    """Hooks that tell what a thing is, two frozen and two taught; the earlier ones tell one make of it
    from another."""
    min_points: int = 6
    """Points of a part that say where it is."""
    voters: int = 1200
    """Normals that vote for the room's up."""
    level: float = 0.6
    """A normal within 53 degrees of the camera's own up may be the room's."""
    same: float = 0.995
    """Cosine of normals that vote for each other,"""
    near: float = 0.985
    """and of those that are averaged."""


PART_NAMING = PartNaming()


@dataclass(frozen=True)
class Outlining:
    """Outlines of groups (`network.semantics.outlines`)."""

    seen: int = 512
    """Pixels of the square that MobileSAM sees."""
    smallest: int = 24
    """Pixels of the grid that a group covers in a photo, at least, to be asked for there."""
    same: float = 0.5
    """IoU with the group's own mask from which an answer means the same thing."""
    sure: float = 6.0
    """Logits are cut there: beyond it no group outvotes another."""
    at_once: int = 16
    """Prompts; more need more memory and are no quicker on a processor."""


OUTLINING = Outlining()


@dataclass(frozen=True)
class Opinion:
    """What other networks say (`network.semantics.second`)."""

    counts: float = 1.5
    """What they count beside an atom, whose length is 1; what they say is as long as its pixels agree
    (MEASURED.md)."""
    steepness: float = 10.0
    """Of what tells photos from rooms, so that it learns as fast as the words do: channels that tell them
    apart are many and faint."""
    together: float = 2.0
    """A scene's pixels tell together what they show this much more surely than each alone."""
    photos: float = 3.0
    """Scenes of photos for one of rendered pictures, before anything was seen."""


OPINION = Opinion()


@dataclass(frozen=True)
class Splitting:
    """Groups that are split (`network.semantics.splitting`)."""

    iterations: int = 6
    """Of clustering."""
    directions: int = 32
    """Dimensions that clustering needs: a fifth of the time, and cosines stay."""
    whole: int = 16
    """Views, all pixels of which are looked at for parts; of more, as many pixels."""
    seeds_from: int = 1500
    """Pixels; enough to seed from, and seeding is the only serial step."""


SPLITTING = Splitting()
