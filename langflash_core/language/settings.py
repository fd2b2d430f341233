"""Numbers that `language` decides by: one frozen record a subject, each number with its unit and its
reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Answering:
    """What counts as an answer (`language.answers`)."""

    covered_alpha: float = 0.5
    """A pixel shows the scene, rather than the background, from here on."""
    peak: float = 0.01
    """Of relevance, within which pixels are as relevant as the best."""
    top_fraction: float = 0.001
    """Of the covered pixels: their mean is the score, so no stray pixel decides."""
    min_area: float = 0.0005
    """Of all pixels: a smaller mask is noise (154 pixels at 640 x 480)."""
    box_quantiles: tuple[float, float] = (0.02, 0.98)
    """Of the mask's points along each axis: drops edges that bleed in depth."""
    principal_gain: float = 0.9
    """Of the world-axes box's volume, which the principal one must stay below."""
    few_points: int = 3
    """Fewer have no principal axes."""
    even: float = 0.5
    """Relevancy of what fits no better than what it is compared with."""
    nearly: float = 0.7
    """Of the way from there to the threshold. In the shipped room, at a threshold of 0.85, things that are
    not there reach 0.70 (of 14: a toilet), a curtain 0.80 and a rug 0.83."""

    half: float = 0.5
    """Of the log odds of a phrase's score, what a pixel needs to belong to its mask: beside a door of .98 the
    wall has .8, and a lamp of .8 fades out over its edge. More is nearer to photos' labels, but leaves out a
    thing that is a little less sure than another (MEASURED.md)."""
    surest: float = 0.9999
    """No score counts for more: beyond it float32 rounds."""

    def lit_from(self, score: float, threshold: float) -> float:
        """The relevancy from which pixels belong to a found phrase's mask, unless somebody chose it."""
        if score <= self.even or score < threshold:
            return threshold
        return 1 / (1 + (1 / min(score, self.surest) - 1) ** self.half)

    def maybe_from(self, threshold: float) -> float:
        """The score from which a phrase may be there, below its threshold."""
        return threshold - (1 - self.nearly) * max(threshold - self.even, 0.0)


ANSWERING = Answering()


@dataclass(frozen=True)
class Decoding:
    """From few channels back to language (`language.channels`)."""

    hidden: int = 512
    """Units of the hidden layer."""
    ridge: float = 1e-3
    """Of the mean square on the diagonal."""


DECODING = Decoding()


@dataclass(frozen=True)
class Hints:
    """Hints about words (`language.hints`)."""

    shortest: int = 4
    """Letters of a word that is taken for a slip."""
    long: int = 9
    """Letters from which on two edits are one slip."""
    most_words: int = 2
    """Of a phrase of the table that is a name: what longer ones say is no thing ("tells the time")."""


HINTS = Hints()


@dataclass(frozen=True)
class Lessons:
    """What was taught, and kept (`language.lessons`)."""

    same: float = 0.85
    """Cosine of looks from which groups of two scenes are taken for the same kind of thing."""
    most_lessons: int = 2_000
    """Lessons of a vocabulary."""
    most_denied: int = 64
    """Words that one lesson denies."""
    longest: int = 500
    """Characters of a word."""


LESSON_LIMITS = Lessons()


@dataclass(frozen=True)
class Looks:
    """What colours are called (`language.looks`)."""

    bright: tuple[float, float] = (0.9, 0.98)
    """Quantiles of brightness between which a picture's white is sought: above are lamps."""
    plain: float = 0.5
    """Of those the share with least colour, which tells white: a wooden table under a lamp is as bright."""
    most_gain: float = 2.0
    """Between two channels: a room lit by bulbs of 2700 K under a camera set to daylight has 1.9."""
    dimmest: float = 0.15
    """Linear; a white that is darker is not scaled further: nothing in the picture is white."""
    luma: tuple[float, float, float] = (0.2126, 0.7152, 0.0722)
    """Weights of linear red, green and blue in light (ITU-R BT.709)."""
    tint: float = 7.0
    """Chroma from which a colour has a hue: grey steel, and white walls under two kinds of lamps, have 5."""
    soft_l: float = 12.0
    """Width of the border between two lightnesses, of 100: as those below, some 5 just noticeable
    differences."""
    soft_c: float = 6.0
    """Width of the border between two chromas."""
    soft_h: float = 15.0
    """Degrees of the border between two hues."""


LOOK = Looks()


@dataclass(frozen=True)
class MiniLM:
    """The text model's sizes (`language.minilm`)."""

    max_tokens: int = 256
    """The model's declared maximum; longer phrases are cut."""
    layers: int = 6
    """Of the transformer."""
    heads: int = 12
    """Of its attention."""
    hidden_mlp: int = 1536
    """Units between a block's two products."""
    norm_eps: float = 1e-12
    """Added to a variance."""
    batch: int = 64
    """Phrases per pass: bounds the attention memory of a long list."""
    special_tokens: int = 2
    """[CLS] and [SEP]."""


MINILM = MiniLM()


@dataclass(frozen=True)
class Narrowing:
    """Phrases that say more than a thing (`language.narrowing`)."""

    side: int = 320
    """Pixels, about, of the longer side of the grid in which things are told apart."""
    jump: float = 0.06
    """Of the nearer depth: neighbours that differ by more are of two things."""
    mostly: float = 0.4
    """Of a thing's surface, from which on it is called by a look: the rest is shade and what lies on it."""
    hardly: float = 0.6
    """Of the look's best thing: less is another look."""
    stands_out: float = 0.2
    """Of a thing's surface, from which on it is the one called so where all others have a third."""
    most_colourful: float = 0.98
    """Quantile of chroma that a picture is as colourful as,"""
    grey: float = 4.0
    """and chroma: below, it is a grey one."""
    crumb: float = 0.05
    """Of the share of the largest thing: the same chair four times as far away has 0.06."""
    even: float = 0.5
    """Relevancy of what fits no better than what it is compared with."""
    likely: float = 0.6
    """Of the way from there to the threshold: so sure must a related thing be where none is surer."""
    cosine: float = 0.8
    """Of the threshold of cosines: so sure must a related thing be where none is surer."""
    upright: float = 0.2
    """Length of the view's direction seen from above, below which it looks up or down."""


NARROWING = Narrowing()


@dataclass(frozen=True)
class Parting:
    """Things that are several as people speak (`language.parting`)."""

    shade: float = 0.25
    """What lightness counts beside CIELAB's a and b: white and its own shade differ by 35."""
    another: float = 10.0
    """Of these, from which two parts are of different colours."""
    clearly: tuple[float, float] = (0.25, 0.5)
    """How well a part is called so that is not, or is, where another is."""
    cut: float = 0.08
    """Of a thing, from which on such a part is one: less lies on it, or is a handle."""
    most_places: int = 2000
    """Places of a thing that are looked at,"""
    around: int = 16
    """and how many of them next to each other are called as one: within 5 % of its side."""
    off: float = 0.04
    """Of the distance from the eye: how far a wall's places lie off its plane."""
    most_faces: int = 5
    """Walls that are seen at once: four, and one of a niche."""
    face: float = 0.15
    """Of all walls, from which on a plane is one of them: less is a pillar, or a reveal."""
    trials: int = 300
    """Planes that are tried: one wall of five is found by two of its places but once in 200,000."""


PARTING = Parting()


@dataclass(frozen=True)
class Relevance:
    """Scores of pixels (`language.relevance`)."""

    empty_norm: float = 1e-4
    """Length of F(p) below which a pixel is empty: just above the smallest normal float16 (6.1e-5), so
    that half-precision weight maps, too, have a direction wherever relevance is not 0."""
    same: float = 1e-6
    """Singular values, of the largest: atoms that differ by less, float32's rounding, are the same."""
    pixels_at_once: int = 1 << 13
    """Pixels at once on a processor, 33 KB a phrase: 100 phrases stay in the cache, 2.6 times as quick as
    1 << 16."""
    on_a_card: int = 1 << 18
    """Pixels at once where starting work costs more than memory: 105 MB for 100 phrases."""


RELEVANCE = Relevance()


@dataclass(frozen=True)
class Rivals:
    """Names that others lose against (`language.rivals`)."""

    kin: float = 0.6
    """Cosine of texts from which they mean the same: "couch" and "sofa" have .86, "lamp" and "ceiling"
    .46."""
    behind: float = 0.8
    """Of how much a phrase is behind the best other name, what it loses: with .6 fewer scores above .9 are
    right, with 1 fewer things are found."""
    lead: float = 0.09
    """Cosine that a phrase gets which nothing beats, as a mean over words (`language.leads`)."""
    nearer: float = 0.06
    """Cosine by which a score may be lower than the calibration's, which knew weaker rivals: with less fewer
    things are found, with more other things answer (MEASURED.md)."""


RIVALS = Rivals()


@dataclass(frozen=True)
class Spoken:
    """What is said about phrases (`language.spoken`)."""

    most_of_a_name: int = 3
    """Words: longer phrases describe."""
    near: float = 0.5
    """Cosine: a violin and an instrument have 0.67, a submarine and a sink 0.47."""


SPOKEN = Spoken()


@dataclass(frozen=True)
class Teaching:
    """How lessons move atoms (`language.taught`)."""

    alike: float = 0.9
    """Cosine of atoms from which a lesson about one is one about the other. In scenes of photos the groups
    of one thing lie above .95, a chair and a sofa below .8."""
    refused: float = 1.25
    """How far a group goes out of a denied word. In scenes of photos, with 1 one denial of twelve is not
    heeded; with 2 the group loses half of the other words that it answers (MEASURED.md, "A group that is
    not a word")."""


TEACHING = Teaching()


@dataclass(frozen=True)
class Relations:
    """How things stand to each other (`language.things`)."""

    ends: tuple[float, float] = (0.05, 0.95)
    """Quantiles of points that are a thing's ends: edges bleed in depth."""
    touch: float = 0.04
    """Of the distance from the eye: depth of photos is as wrong, and edges are as far from pixels."""
    beside: float = 0.5
    """Of the smaller thing's size: how far things stand from each other that are beside each other."""
    level: float = 0.75
    """Cosine with up from which a surface carries what stands on it."""
    flat: float = 0.1
    """Of the spread of points around a place: thinner is a plane."""
    hanging: float = 0.3
    """Of the distance from the eye: of a lamp below its ceiling."""
    meets: float = 0.3
    """Of the narrower of two things: so much of it the other covers, or is covered by it."""
    left: float = 0.2
    """Of a thing, below which it is the same as what covers the rest."""
    most_points: int = 800
    """Points of a thing."""
    most_of_all: int = 4000
    """Points of all that something is related to."""


RELATIONS = Relations()
