"""Numbers that stages decide by: one frozen record a stage, as in `rig.settings`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Elements:
    """Gaussians of pixels (`network.gaussians`)."""

    cover: float = 0.6
    """Standard deviation in pixel spacings: neighbours blend into a closed surface."""
    thin: float = 0.1
    """Thickness of a surface element over its pixel footprint."""
    scale_range: float = 1.0
    """The head enlarges a scale by at most e."""
    colour_range: float = 0.1
    """And a colour by at most this."""


ELEMENTS = Elements()


@dataclass(frozen=True)
class Occlusion:
    """What goes on behind nearer things (`network.occlusion`)."""

    under: float = 10.0
    """Pixels: what a gap measures where depth is a twentieth off and the camera 20 degrees aside."""
    jump: float = 0.2
    """Log depth from one pixel to the next."""
    end: float = 0.05
    """Log depth, where a thing ends: below it, and below twice the step before, it is a slope."""
    back: float = 0.3
    """Pixels by which the last element is drawn back."""
    short: float = 0.5
    """And how long it is, of its length."""


OCCLUSION = Occlusion()


@dataclass(frozen=True)
class Resection:
    """Cameras of point maps (`network.points.resection`)."""

    points: int = 4000
    """A regular sample; more change the pose by less than its error."""
    tolerance: float = 2.0
    """Pixels at 256: how far points stray in a good map."""
    min_share: float = 0.25
    """Of the sample must agree, or the map is no picture of one place."""
    half_trust: float = 3.0
    """Pixels of error that count as confidence 1/2."""
    nearest: float = 1e-4
    """Share of the median depth; points behind the camera are put there."""


RESECTION = Resection()


@dataclass(frozen=True)
class PointHeads:
    """Where the heads of point maps start (`network.points.heads`)."""

    scale_step: float = 1e-3
    """Of a softplus; lengths where the cameras of a pair are about 1 apart."""
    max_scale: float = 0.3
    """In the same lengths, at most."""
    degree_step: float = 0.25
    """Each further degree of the harmonics starts this much smaller."""
    first_degree: float = 0.1
    """Of the first degree, beside the colour."""


POINT_HEADS = PointHeads()


@dataclass(frozen=True)
class Prior:
    """Depth of a photo by itself, and of the sweep (`network.prior`, `network.sweep`)."""

    typical_log_depth: float = 0.8
    """Log of 2.2 m: where an untrained head starts."""
    log_range: tuple[float, float] = (-4.0, 5.0)
    """2 cm to 150 m: exp never overflows."""
    log_error_range: tuple[float, float] = (-5.0, 1.0)
    """Of the logarithm of its error, from .7 % to e."""
    typical_log_error: float = -1.5
    """Centres the error channel that the network reads."""
    at_once: int = 10_000
    """Places whose vectors are gathered together."""


PRIOR = Prior()
