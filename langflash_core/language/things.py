"""Things in front of somebody who looks, and how they stand to each other.

Points are in the viewer's axes: right, up (against gravity), away; the eye is at 0. "Left of", "in front of"
and "nearest" are as the viewer has them, "above", "under" and "on" as gravity has.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Integer

from langflash_core.language.settings import RELATIONS

RIGHT, UP, AWAY = 0, 1, 2


@dataclass(frozen=True)
class Thing:
    """What is connected and answers one word.

    rows: pixels or Gaussians that it is made of. places: of them, (m, 3), m >= 1, viewer's axes. share: of
    the view, or of the scene's surface. sure: relevance.
    """

    rows: Integer[np.ndarray, " m"]
    places: Float[np.ndarray, "m 3"]
    share: float = 0.0
    sure: float = 1.0

    @cached_property
    def points(self) -> Float[np.ndarray, "n 3"]:
        """Some of its places."""
        return self.places[:: max(1, len(self.places) // RELATIONS.most_points)]

    def without(self, other: "Thing") -> "Thing | None":
        """What is left of it where another thing is not; None of what is mostly the other."""
        left = ~np.isin(self.rows, other.rows)
        if left.all():
            return self
        return (
            replace(self, rows=self.rows[left], places=self.places[left])
            if left.mean() >= RELATIONS.left
            else None
        )

    @cached_property
    def low(self) -> Float[np.ndarray, "3"]:
        return np.quantile(self.points, RELATIONS.ends[0], axis=0)

    @cached_property
    def high(self) -> Float[np.ndarray, "3"]:
        return np.quantile(self.points, RELATIONS.ends[1], axis=0)

    @cached_property
    def middle(self) -> Float[np.ndarray, "3"]:
        return (self.low + self.high) / 2

    @cached_property
    def sizes(self) -> Float[np.ndarray, "3"]:
        return self.high - self.low

    @cached_property
    def extent(self) -> float:
        """Its longest side."""
        return float(max(self.sizes.max(), 1e-9))

    @cached_property
    def distance(self) -> float:
        """From the eye."""
        return float(np.linalg.norm(self.middle))

    @cached_property
    def columns(self) -> tuple[float, float]:
        """Directions of its ends, radians to the right."""
        angles = np.arctan2(self.points[:, RIGHT], self.points[:, AWAY])
        low, high = np.quantile(angles, RELATIONS.ends)
        return float(low), float(high)

    @property
    def elevation(self) -> float:
        """Of its middle over the eye's level, radians: of two lamps at a ceiling the nearer is the upper."""
        return float(np.arctan2(self.middle[UP], np.hypot(self.middle[RIGHT], self.middle[AWAY])))

    def away(self, first: float, last: float) -> float:
        """How far what lies in some directions is; all of it where nothing does."""
        angles = np.arctan2(self.points[:, RIGHT], self.points[:, AWAY])
        there = self.points[(angles >= first) & (angles <= last)]
        return float(np.median(there[:, AWAY])) if len(there) else float(self.middle[AWAY])

    @property
    def column(self) -> float:
        """Of its middle."""
        return sum(self.columns) / 2

    @property
    def touch(self) -> float:
        """How near something is that touches it."""
        return RELATIONS.touch * self.distance


def together(things: list[Thing]) -> Float[np.ndarray, "n 3"]:
    """Some places of several things."""
    places = np.concatenate([each.places for each in things])
    return places[:: max(1, len(places) // RELATIONS.most_of_all)]


def is_related(thing: Thing, relation: str, others: list[list[Thing]]) -> bool:
    """Whether a thing stands in a relation of the grammar's to some of these.

    Args:
        others: the things of each word that the relation names, at least one of each; two words, or one of
            several things, for "between". "nearest to" and "farthest from" compare things: see `gap`.
    """
    thing = beside_others(thing, others)
    apart = [[other.without(thing) for other in some] for some in others]
    others = [[other for other in some if other is not None] for some in apart]
    if not all(others):
        return False
    if relation == "between":
        first, last = others[0], others[-1]
        return any(_between(thing, one, two) for one in first for two in last if one is not two)
    if relation == "on":
        return _on(thing, together(others[0]))
    if relation == "with":
        return gap(thing, others[0]) <= thing.touch
    return any(_PAIRS[relation](thing, other) for other in others[0])


def beside_others(thing: Thing, others: list[list[Thing]]) -> Thing:
    """A thing without what smaller ones share with it, unless that is nearly all: what hangs on a wall is
    none, though it answers "wall", too."""
    for other in (other for some in others for other in some if len(other.rows) < len(thing.rows)):
        thing = thing.without(other) or thing
    return thing


def gap(thing: Thing, others: list[Thing]) -> float:
    """Distance from a thing's points to the nearest of some others."""
    from scipy.spatial import KDTree  # a quarter of a second, which a plain phrase has not to wait for

    return float(KDTree(together(others)).query(thing.points)[0].min())


def _on(thing: Thing, places: Float[np.ndarray, "n 3"]) -> bool:
    """Touching it: from above where that lies level, flush with it where it stands, either where it is none
    of both, as a sofa; and near below a ceiling."""
    from scipy.spatial import KDTree

    distances = KDTree(thing.points).query(places)[0]
    if _hangs(thing, places):
        return True
    if distances.min() > thing.touch:
        return False
    normal = _normal(places[distances <= thing.touch + thing.extent / 2])
    near = places[distances <= thing.touch]
    height = float(np.median(near[:, UP]))
    above = thing.middle[UP] >= height - thing.touch / 4
    if normal is None:
        return bool(above)
    upright = abs(normal[UP])
    if upright >= RELATIONS.level:
        return bool(above and thing.low[UP] >= height - thing.sizes[UP] / 2 - thing.touch)
    off = abs((thing.points - near.mean(0)) @ normal)
    flush = float(np.quantile(off, 0.8)) <= 1.5 * thing.touch
    return bool(flush or (above and upright > 1 - RELATIONS.level))


def _hangs(thing: Thing, places: Float[np.ndarray, "n 3"]) -> bool:
    """Whether half of some places are over a thing's top, and the nearest of them not far over it."""
    over = places[places[:, UP] > thing.high[UP] - thing.touch]
    if len(over) < 0.5 * len(places) or np.ptp(over[:, [RIGHT, AWAY]], axis=0).max() < thing.extent:
        return False
    aside = np.hypot(*(over - thing.middle)[:, [RIGHT, AWAY]].T)
    reach = max(thing.extent, RELATIONS.hanging * thing.distance)
    return bool(((aside <= reach) & (over[:, UP] <= thing.high[UP] + reach)).any())


def _normal(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"] | None:
    """Of the plane of some points; None where they are none."""
    if len(points) < 3:
        return None
    values, vectors = np.linalg.eigh(np.cov((points - points.mean(0)).T))
    flat = values[0] <= (2 * RELATIONS.flat) ** 2 * values[1] if values[1] > 0 else False
    return vectors[:, 0] if flat else None


def _over(upper: Thing, lower: Thing) -> bool:
    """Whether one stands higher than the other, in one line from above or from the viewer."""
    reach = 0.3 * max(upper.sizes[RIGHT], lower.sizes[RIGHT])
    aside = max(upper.low[RIGHT] - lower.high[RIGHT], lower.low[RIGHT] - upper.high[RIGHT])
    behind = max(upper.low[AWAY] - lower.high[AWAY], lower.low[AWAY] - upper.high[AWAY])
    far = max(upper.extent, lower.extent) / 2 + upper.touch
    return bool(aside <= reach and behind <= far and upper.middle[UP] > lower.middle[UP])


def _above(thing: Thing, other: Thing) -> bool:
    lowest = other.high[UP] - 0.25 * other.sizes[UP] - thing.touch
    return _over(thing, other) and bool(thing.low[UP] >= lowest)


def _under(thing: Thing, other: Thing) -> bool:
    """Below its upper side, and within its outline or lower than all of it."""
    return _over(other, thing) and bool(thing.middle[UP] < other.high[UP] - other.touch)


def _beside(thing: Thing, other: Thing) -> bool:
    """Near it, and neither on top of it nor under it: at about its height, or aside of it seen from above, as
    a chair of the window whose sill is over its back."""
    near = max(RELATIONS.beside * min(thing.extent, other.extent), thing.touch)
    if gap(thing, [other]) > near:
        return False
    apart = max(thing.low[UP] - other.high[UP], other.low[UP] - thing.high[UP])
    return bool(apart <= -thing.touch / 2) or _aside(thing, other)


def _aside(thing: Thing, other: Thing) -> bool:
    """Whether most of one is not over or under the other."""
    from scipy.spatial import KDTree

    places = together([other])[:, [RIGHT, AWAY]]
    ground = KDTree(places)
    spacing = float(np.median(ground.query(places, 2)[0][:, -1]))
    return bool(np.median(ground.query(thing.points[:, [RIGHT, AWAY]])[0]) > thing.touch + 2 * spacing)


def _inside(thing: Thing, other: Thing) -> bool:
    slack = thing.touch + 0.1 * other.sizes
    return bool(((thing.middle >= other.low - slack) & (thing.middle <= other.high + slack)).all())


def _is_left_of(thing: Thing, other: Thing) -> bool:
    return thing.column < other.columns[0] + 0.1 * (other.columns[1] - other.columns[0])


def _right(thing: Thing, other: Thing) -> bool:
    return thing.column > other.columns[1] - 0.1 * (other.columns[1] - other.columns[0])


def _before(thing: Thing, other: Thing) -> bool:
    """In the way to the other: their directions meet, and there it is nearer to the viewer, or touches what
    is taller and wider. A wall is as far as it is behind the ladder, not as its middle is."""
    ends = max(thing.columns[0], other.columns[0]), min(thing.columns[1], other.columns[1])
    narrower = min(each.columns[1] - each.columns[0] for each in (thing, other))
    if ends[1] - ends[0] < RELATIONS.meets * narrower:
        return False
    if thing.away(*ends) < other.away(*ends) - thing.touch / 2:
        return True
    backed = other.low[UP] <= thing.middle[UP] <= other.high[UP] and other.sizes[UP] > thing.sizes[UP]
    return bool(backed) and other.extent > 2 * thing.extent and gap(thing, [other]) <= thing.touch


def _between(thing: Thing, one: Thing, two: Thing) -> bool:
    """Along the way from one to the other, seen from above, and off it by less than half its length."""
    start, end, place = (each.middle[[RIGHT, AWAY]] for each in (one, two, thing))
    way = end - start
    length = max(float(np.linalg.norm(way)), 1e-9)
    along = float((place - start) @ way) / length**2
    aside = abs(way[0] * (place - start)[1] - way[1] * (place - start)[0]) / length
    return bool(0.05 <= along <= 0.95 and aside <= length / 2)


_PAIRS = {
    "in": _inside,
    "under": _under,
    "above": _above,
    "beside": _beside,
    "in front of": _before,
    "behind": lambda thing, other: _before(other, thing),
    "left of": _is_left_of,
    "right of": _right,
}
