"""Which way is up, and which way walls run: three directions across each other that a room is built along.

A straight edge of a photo and the camera's centre span a plane; an edge that is upright in the room has a
plane that holds `up`. So with m the unit normal of that plane, in the world, m . up = 0, and m . r = 0 for
edges along another direction r of the room. Surfaces tell the same, less exactly: their normals n are along
one of the directions. Edges do not know depth, so their directions are as exact as the photo is sharp.

Two steps. *Search*: of directions up to `MANHATTAN.most_pitch` from the camera's own up, each with the walls
that fit it best, those under which all edges are likeliest. *Fit*: from each of the best, Gauss-Newton on a
rotation R whose columns are the directions, every edge weighted by how well it fits the nearest one, narrower
from round to round; the likeliest of what comes out is the answer.

An edge is along one of the directions or along none. Logarithms of chances add up, so that many edges outvote
what is believed before: that people hold cameras level, and that what answers "floor" is level.

Sizes: L edges, n surfaces, V cameras. Everything in float64; angles in degrees where they say so.

Source: own composition; three directions and a robust assignment as in Coughlan and Yuille 1999, edges as
planes as in Kosecka and Zhang 2002.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from langflash_core.geometry.settings import MANHATTAN

_PITCHES = np.arange(-MANHATTAN.most_pitch, MANHATTAN.most_pitch + 1, 3.0)
_ROLLS = np.arange(-MANHATTAN.most_roll, MANHATTAN.most_roll + 1, 3.0)


@dataclass(frozen=True)
class Sights:
    """What tells directions, in the world.

    edges: (L, 3) unit normals of the planes through a camera and an edge. lengths: (L,) of the edges, in
    longer sides of a photo. normals: (n, 3) unit, of pieces of surface of the same area. cameras: (V, 3, 3)
    rotations of the world to cameras, +x right, +y down, +z ahead. floor: unit (3,), across what is known to
    be level, such as a floor, to some ten degrees; None: nothing is. held: people held the cameras level.
    """

    edges: Float[np.ndarray, "L 3"]
    lengths: Float[np.ndarray, " L"]
    normals: Float[np.ndarray, "n 3"]
    cameras: Float[np.ndarray, "V 3 3"]
    floor: Float[np.ndarray, " 3"] | None = None
    held: bool = True


@dataclass(frozen=True)
class Directions:
    """axes (3, 3): columns along one wall, along the other, and up; right-handed. error: degrees expected of
    up. edges: length of the edges that are upright, in longer sides of a photo."""

    axes: Float[np.ndarray, "3 3"]
    error: float
    edges: float

    @property
    def up(self) -> Float[np.ndarray, " 3"]:
        """Unit, in the world."""
        return self.axes[:, 2]


def found_directions(sights: Sights, up: Float[np.ndarray, " 3"] | None = None) -> Directions:
    """The directions that a room is built along.

    Args:
        up: is given; the walls' directions are sought around it. None: sought.

    Returns:
        The best of them; the camera's own where nothing tells any.
    """
    starts = _starts(sights) if up is None else [up / np.linalg.norm(up)]
    tried = [_fit_axes(sights, _walls_of(sights, start), fixed=up is not None) for start in starts]
    return max(tried, key=lambda found: _agreement(sights, found.axes))


def _starts(sights: Sights) -> list[np.ndarray]:
    """The directions up that most speaks for, `MANHATTAN.apart` from each other."""
    from scipy.spatial.transform import Rotation  # .08 s, which reading a scene has not to wait for

    home = sights.cameras[0].T
    turns = Rotation.from_euler("zx", [(roll, pitch) for roll in _ROLLS for pitch in _PITCHES], degrees=True)
    ups = (home @ turns.apply([0.0, -1.0, 0.0]).T).T  # (U, 3)
    scores = _edges_say(sights, ups) + _surfaces_say(sights, ups) + np.log(_prior_belief(sights, ups))
    chosen: list[np.ndarray] = []
    for row in np.argsort(-scores, kind="stable"):
        if all(ups[row] @ other < math.cos(math.radians(MANHATTAN.apart)) for other in chosen):
            chosen.append(ups[row])
        if len(chosen) == MANHATTAN.tried:
            break
    return chosen


def _edges_say(sights: Sights, ups: np.ndarray) -> np.ndarray:
    """(U,) how likely the longest edges are, for directions (U, 3), each with the walls that fit it best."""
    longest = np.argsort(-sights.lengths, kind="stable")[: MANHATTAN.searched]
    edges, lengths = sights.edges[longest], sights.lengths[longest]
    scores = np.zeros(len(ups))
    for row, up in enumerate(ups):
        upright = _near(np.abs(edges @ up), MANHATTAN.edge)[:, None]
        along, across = (_near(np.abs(edges @ sides.T), MANHATTAN.edge) for sides in _sides(up))  # (L, A)
        scores[row] = _likely(lengths, upright + along + across, MANHATTAN.edge).max()
    return scores


def _likely(lengths: np.ndarray, near: np.ndarray, width: float) -> np.ndarray:
    """(A,) logarithms of the chance of edges of which `near` (L, A) is how near they are to three directions,
    over that of edges along none, whose planes may lie in any way: their sines fill [0, 1] evenly."""
    peak = 2 / (math.sqrt(2 * math.pi) * math.radians(width))  # of a half Gaussian
    return lengths @ np.log(1 - 3 * MANHATTAN.along + MANHATTAN.along * peak * near) / MANHATTAN.witness


def _surfaces_say(sights: Sights, ups: np.ndarray) -> np.ndarray:
    """(U,) of surfaces that are level or upright, for directions (U, 3)."""
    if not len(sights.normals):
        return np.zeros(len(ups))
    lean = np.abs(sights.normals @ ups.T).clip(max=1.0)
    flat = _near(np.sqrt(1 - lean**2), MANHATTAN.surface) + _near(lean, MANHATTAN.surface)
    return MANHATTAN.surfaces_say * flat.mean(0)


def _prior_belief(sights: Sights, ups: np.ndarray) -> np.ndarray:
    """(U,) belief in directions before edges and surfaces are looked at: people hold cameras about level, and
    what is known to be level is across up."""
    belief = np.ones(len(ups))
    if sights.held:
        sideways, ahead = sights.cameras[:, 0] @ ups.T, sights.cameras[:, 2] @ ups.T  # (V, U)
        belief = _maybe(_near(np.abs(sideways), MANHATTAN.roll)).mean(0)
        belief = belief * _maybe(_near(np.abs(ahead), MANHATTAN.pitch)).mean(0)
    if sights.floor is not None:
        lean = np.sqrt((1 - (ups @ sights.floor) ** 2).clip(0))
        belief = belief * _maybe(_near(lean, MANHATTAN.floor))
    return belief


def _maybe(shares: np.ndarray) -> np.ndarray:
    """A belief that may be wrong in one of ten cases."""
    return 0.1 + 0.9 * shares


def _walls_of(sights: Sights, up: np.ndarray) -> np.ndarray:
    """Axes (3, 3) with this up, turned about it to where most edges and walls agree."""
    along, across = _sides(up)
    scores = np.zeros(len(along))
    if len(sights.lengths):
        fits = (np.abs(sights.edges @ side.T) for side in (along, across))
        near = np.maximum(*(_near(fit, 1.5 * MANHATTAN.edge) for fit in fits))
        scores += sights.lengths @ near / max(float(sights.lengths.sum()), 1e-9)
    if len(sights.normals):
        leans = ((sights.normals @ side.T) ** 2 for side in (along, across))
        near = np.maximum(*(_near(np.sqrt((1 - lean).clip(0)), MANHATTAN.surface) for lean in leans))
        scores += 0.5 * near.mean(0)
    best = int(scores.argmax())
    return np.stack((along[best], across[best], up), 1)


def _sides(up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (A, 3) around up, every two degrees of a quarter turn, and those across them."""
    away = np.eye(3)[np.abs(up).argmin()]
    first = np.cross(up, away) / np.linalg.norm(np.cross(up, away))
    angles = np.radians(np.arange(0.0, 90.0, 2.0))[:, None]
    along = np.cos(angles) * first + np.sin(angles) * np.cross(up, first)
    return along, np.cross(up, along)


def _fit_axes(sights: Sights, axes: np.ndarray, fixed: bool) -> Directions:
    """Gauss-Newton from these axes; with `fixed`, about their up alone."""
    from scipy.spatial.transform import Rotation

    information = np.zeros((3, 3))
    for width in MANHATTAN.rounds:
        information, pull = _normal_equations(sights, axes, width)
        free = axes[:, 2:] if fixed else np.eye(3)
        step = free @ np.linalg.solve(
            free.T @ information @ free + 1e-9 * np.eye(free.shape[1]), free.T @ pull
        )
        axes = Rotation.from_rotvec(step).as_matrix() @ axes
    upright = float(sights.lengths @ _near(np.abs(sights.edges @ axes[:, 2]), 1.0))
    return Directions(axes, 0.0 if fixed else _error(information, axes), upright)


def _normal_equations(sights: Sights, axes: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Of a small turn w: d(m . r) = (r x m) . w for edges, and n x r, across r, for surfaces.

    An edge that fits two directions equally well tells nothing of either.
    """
    information, pull = np.zeros((3, 3)), np.zeros(3)
    if len(sights.lengths):
        fits = sights.edges @ axes
        best = np.abs(fits).argmin(1)
        residuals = np.take_along_axis(fits, best[:, None], 1)[:, 0]
        second = np.sort(np.abs(fits), 1)[:, 1]
        weights = sights.lengths * _near(np.abs(residuals), width) * (1 - _near(second, 2 * width))
        slopes = np.cross(axes.T[best], sights.edges)
        information += (weights[:, None] * slopes).T @ slopes
        pull -= (weights * residuals) @ slopes
    if len(sights.normals):
        leans = sights.normals @ axes
        best = np.abs(leans).argmax(1)
        signs = np.sign(np.take_along_axis(leans, best[:, None], 1))
        towards, own = axes.T[best], sights.normals * signs
        turns = np.cross(towards, own)  # the turn that brings r to n
        weights = _near(np.linalg.norm(turns, axis=1), max(2 * width, 6.0))
        weights *= MANHATTAN.surface_weight * max(float(sights.lengths.sum()), MANHATTAN.few) / len(weights)
        across = np.eye(3) - towards[:, :, None] * towards[:, None]
        information += np.einsum("n,nij->ij", weights, across)
        pull += weights @ turns
    return information, pull


def _error(information: np.ndarray, axes: np.ndarray) -> float:
    """Degrees expected of up: edges of one photo's side, each off by `MANHATTAN.edge`, told it to so much."""
    covariance = np.linalg.inv(information + 1e-6 * np.eye(3)) * math.radians(MANHATTAN.edge) ** 2
    sideways = axes[:, :2].T @ covariance @ axes[:, :2]
    return float(min(90.0, max(MANHATTAN.least, math.degrees(math.sqrt(np.trace(sideways) / 4)))))


def _agreement(sights: Sights, axes: np.ndarray) -> float:
    """How much speaks for three directions: logarithms of chances, of edges, of surfaces and of belief."""
    up, width = axes[:, 2][None], MANHATTAN.rounds[-1]
    near = _near(np.abs(sights.edges @ axes), width).sum(1, keepdims=True)
    told = (
        _likely(sights.lengths, near, width) + _surfaces_say(sights, up) + np.log(_prior_belief(sights, up))
    )
    return float(told[0])


def _near(sines: np.ndarray, degrees: float) -> np.ndarray:
    """1 at 0, falling like a Gaussian of so many degrees."""
    return np.exp(-0.5 * (sines / math.radians(degrees)) ** 2)
