"""What a phrase says beside its head, decided among the things that answer the head.

In a view everything is told by what it shows already, relevance, colour and depth of its pixels: no Gaussian
is drawn for it. In every n-th pixel things are told apart (connected, without a jump of depth) and chosen
from, and every pixel keeps its relevance, or loses it, with the thing that is nearest in the picture.

P phrases, R heads of things that they are related to.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from langflash_core.language.answers import world_points
from langflash_core.language.grammar import Modifier, Reading
from langflash_core.language.looks import LOOKS, lab, looking, room_white, tinted
from langflash_core.language.parting import called_part, wall_faces
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import ANSWERING, NARROWING
from langflash_core.language.things import AWAY, UP, Thing, beside_others, gap, is_related
from langflash_core.types import Camera, Frame


@dataclass(frozen=True)
class Sight:
    """What there is to choose among: n pixels of a view, or n Gaussians of a scene.

    points: (n, 3) in the viewer's axes (`things.py`). colours: (n, 3) CIELAB. areas: (n,) of the view or
    of the surface, sum 1. relevance: (n,) by head. limit, likely: relevance from which on something is
    there, or may be. parts: numbers (n,) of the connected parts of some members, -1 of others.
    """

    points: Float[np.ndarray, "n 3"]
    colours: Float[np.ndarray, "n 3"]
    areas: Float[np.ndarray, " n"]
    relevance: Mapping[str, Float[np.ndarray, " n"]]
    limit: float
    likely: float
    parts: Callable[[Bool[np.ndarray, " n"]], Int[np.ndarray, " n"]] = field(repr=False)

    def asked(self, relevance: Mapping[str, Float[np.ndarray, " n"]], limit: float, least: float) -> "Sight":
        """The same, asked this."""
        return replace(self, relevance=relevance, limit=limit, likely=least)

    def things(self, head: str, limit: float) -> list[Thing]:
        """What is connected and answers a head, as large as an answer has to be; of walls each by itself."""
        found = self.cut(head, self.relevance[head] >= limit)
        if head not in _WALLS:
            return found
        return [face for each in found for face in self._apart(head, each, wall_faces(each))]

    def _apart(self, head: str, thing: Thing, numbers: Int[np.ndarray, " m"]) -> list[Thing]:
        """What of a thing has the same number, as large as an answer has to be."""
        parts = (self._thing(head, thing.rows[numbers == number]) for number in np.unique(numbers))
        return [part for part in parts if part.share >= ANSWERING.min_area]

    def _thing(self, head: str, rows: Int[np.ndarray, " m"]) -> Thing:
        sure = float(self.relevance[head][rows].mean())
        return Thing(rows, self.points[rows], float(self.areas[rows].sum()), sure)

    def cut(self, head: str, members: Bool[np.ndarray, " n"]) -> list[Thing]:
        """The connected parts of some members."""
        if not members.any():
            return []
        numbers = self.parts(members)
        rows = np.flatnonzero(numbers >= 0)
        order = rows[np.argsort(numbers[rows], kind="stable")]
        split = np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1)
        parts = (self._thing(head, own) for own in split if len(own))
        return [part for part in parts if part.share >= ANSWERING.min_area]


@dataclass(frozen=True)
class Choice:
    """The things that a reading means, those of its head that it does not, and what people should know."""

    kept: list[Thing]
    dropped: list[Thing]
    note: str = ""


def choose(reading: Reading, sight: Sight, limit: float | None = None) -> Choice:
    """The things of a sight that a reading means. Looks come first, then relations, then what compares."""
    things = sight.things(reading.head, sight.limit if limit is None else limit)
    kept, notes = things, list[str]()
    for kind in ("look", "relation", "size", "place", "order", "count"):
        for modifier in reading.modifiers:
            if kept and modifier.kind == kind:
                kept, note = _CHOOSERS[kind](kept, modifier, sight, reading.head)
                notes += [note] if note else []
    left = {id(each) for each in kept}
    return Choice(kept, [each for each in things if id(each) not in left], "; ".join(notes))


Chosen = tuple[list[Thing], str]
_WALLS = ("wall", "walls")


def _looking(things: list[Thing], modifier: Modifier, sight: Sight, head: str) -> Chosen:
    """Things mostly called so, or parts of them beside other colours; where none is, the one that stands out;
    where none does, the same by hue, as an orange ladder in dim light is found; else the pixels that are.
    Crumbs do not count, alone or of a thing: what hangs on a wall makes it no red wall."""
    chroma = np.hypot(sight.colours[:, 1], sight.colours[:, 2])
    if LOOKS[modifier.word].hue and np.quantile(chroma, NARROWING.most_colourful) < NARROWING.grey:
        return things, f"its picture has no colours, so nothing here can be told to be {modifier.word}"
    for judged in (looking, tinted) if LOOKS[modifier.word].hue else (looking,):
        well = judged(sight.colours, modifier.word)
        parts = _parted(things, sight, head, well)
        shares = np.array([float(well[each.rows].mean()) for each in parts])
        if judged is tinted:  # of an orange ladder and a wall in its light the ladder is meant
            colour = np.array([float(np.median(chroma[each.rows])) for each in parts])
            best = colour[shares >= NARROWING.mostly].max(initial=NARROWING.grey)
            shares = shares * np.minimum(colour / best, 1.0)
        if modifier.negated:
            return [each for each, share in zip(parts, shares, strict=True) if share < NARROWING.mostly], ""
        if parts and (found := _called(parts, shares)):
            note = f"no {head} here is clearly {modifier.word}; this comes nearest"
            return found, "" if judged is looking else note
    members = np.zeros(len(sight.areas), bool)
    for each in _seen_well(things):
        if (looks := looking(sight.colours[each.rows], modifier.word) >= 0.5).mean() >= NARROWING.crumb:
            members[each.rows[looks]] = True
    found = sight.cut(head, members)
    return found, "" if found else f"no {head} here looks {modifier.word}"


def _called(things: list[Thing], shares: Float[np.ndarray, " t"]) -> list[Thing]:
    """Those that are called so in enough of their surface, or the one that stands out."""
    most = max(each.share for each in things)
    seen = [row for row, each in enumerate(things) if each.share >= NARROWING.crumb * most]
    *others, best = sorted(seen, key=lambda row: shares[row])
    enough = max(NARROWING.mostly, NARROWING.hardly * float(shares[best]))
    if shares[best] >= enough:
        return [each for each, share in zip(things, shares, strict=True) if share >= enough]
    stands_out = others and shares[best] >= max(NARROWING.stands_out, 3 * shares[others].max())
    return [things[best]] if stands_out else []


def _parted(things: list[Thing], sight: Sight, head: str, well: Float[np.ndarray, " n"]) -> list[Thing]:
    """Things; of one that is called so in a part alone, that part and the rest."""
    whole, called, rest = list[Thing](), np.zeros(len(sight.areas), bool), np.zeros(len(sight.areas), bool)
    for each in things:
        part = called_part(each, sight.colours[each.rows], well[each.rows])
        if part is None:
            whole.append(each)
        else:
            called[each.rows[part]], rest[each.rows[~part]] = True, True
    return [*whole, *sight.cut(head, called), *sight.cut(head, rest)]


def _relating(things: list[Thing], modifier: Modifier, sight: Sight, head: str) -> Chosen:
    others = [_others(other, sight) for other in modifier.others]
    for other, found in zip(modifier.others, others, strict=True):
        if not found:
            return [], f'no "{other}" is found here, to which the phrase relates it'
    if modifier.word in ("nearest to", "farthest from"):
        sign = 1 if modifier.word == "nearest to" else -1
        return [min(things, key=lambda each: sign * gap(each, others[0]))], ""
    found = [each for each in things if is_related(each, modifier.word, others) != modifier.negated]
    found = found if modifier.negated else [beside_others(each, others) for each in found]
    return found, "" if found else f"no {head} here is {modifier}"


def _others(reading: Reading, sight: Sight) -> list[Thing]:
    """Related things, less sure ones where there are no others."""
    found = choose(reading, sight).kept
    return found or choose(reading, sight, sight.likely).kept


def _measuring(things: list[Thing], modifier: Modifier, sight: Sight, head: str) -> Chosen:
    """Those that are most so; of several that are meant, those on that half of the scale."""
    things = _seen_well(things)
    values = np.array([_MEASURES[modifier.word](each) for each in things])
    if modifier.word == "middle":
        values = -abs(values - (values.min() + values.max()) / 2)
    if modifier.negated:
        values = -values
    enough = values.max() if modifier.most else (values.min() + values.max()) / 2
    return [each for each, value in zip(things, values, strict=True) if value >= enough], ""


def _seen_well(things: list[Thing]) -> list[Thing]:
    """Without crumbs, which no comparison is about."""
    most = max(each.share for each in things)
    return [each for each in things if each.share >= NARROWING.crumb * most]


_MEASURES: dict[str, Callable[[Thing], float]] = {
    "big": lambda thing: float(np.sort(thing.sizes)[1:].prod()),
    "small": lambda thing: -float(np.sort(thing.sizes)[1:].prod()),
    "tall": lambda thing: float(thing.sizes[UP]),
    "short": lambda thing: -float(thing.sizes[UP]),
    "wide": lambda thing: float(np.hypot(thing.sizes[0], thing.sizes[AWAY])),
    "narrow": lambda thing: -float(np.hypot(thing.sizes[0], thing.sizes[AWAY])),
    "left": lambda thing: -thing.column,
    "right": lambda thing: thing.column,
    "middle": lambda thing: thing.column,
    "upper": lambda thing: thing.elevation,
    "lower": lambda thing: -thing.elevation,
    "nearest": lambda thing: -thing.distance,
    "farthest": lambda thing: thing.distance,
}


def _ordering(things: list[Thing], modifier: Modifier, sight: Sight, head: str) -> Chosen:
    ranked = sorted(_seen_well(things), key=_MEASURES[modifier.word], reverse=True)
    place = modifier.number - 1 if modifier.number > 0 else len(ranked) - 1
    if place < len(ranked):
        return [ranked[place]], ""
    return [], f"only {len(ranked)} of them {'is' if len(ranked) == 1 else 'are'} seen here"


def _counting(things: list[Thing], modifier: Modifier, sight: Sight, head: str) -> Chosen:
    kept = sorted(things, key=lambda each: -each.share * each.sure)[: modifier.number]
    return kept, "" if len(kept) == modifier.number else f"only {len(kept)} seen here"


_CHOOSERS = {
    "look": _looking,
    "relation": _relating,
    "size": _measuring,
    "place": _measuring,
    "order": _ordering,
    "count": _counting,
}


def likely(limit: float, mode: str) -> float:
    """Relevance from which on a related thing may be there."""
    return (
        NARROWING.even + NARROWING.likely * max(limit - NARROWING.even, 0.0)
        if mode == "relevancy"
        else NARROWING.cosine * limit
    )


def viewer_axes(viewmat: Float[Tensor, "4 4"], up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Rows right, up, away of who looks with a camera, in the world; up is a unit vector of the world."""
    rotation = viewmat[:3, :3].double().cpu().numpy()
    ahead, above = rotation[2], -rotation[1]
    level = ahead - (ahead @ up) * up
    if np.linalg.norm(level) < NARROWING.upright:  # from above: what is above in the picture is away
        level = np.sign(-(ahead @ up)) * (above - (above @ up) * up)
    away = level / max(float(np.linalg.norm(level)), 1e-9)
    return np.stack((np.cross(away, up), up, away))


def narrow_view(
    compiled: CompiledQuery,
    relevance: Float[Tensor, "P H W"],
    others: Float[Tensor, "R H W"] | None,
    frame: Frame,
    camera: Camera,
    up: Float[np.ndarray, "3"],
    limits: Sequence[float],
) -> tuple[Float[Tensor, "P H W"], CompiledQuery]:
    """Relevance of phrases, 0 where it belongs to things that they do not mean; the query with notes of that.

    Args:
        relevance: by the phrases' heads. others: of `compiled.others`.
        frame: of the view, as `camera` sees it. up: unit vector of the world. limits: thresholds (P,).
    """
    narrowed, notes = relevance.clone(), []
    view = _View.of(frame, camera, up)
    named = (
        {}
        if others is None or compiled.others is None
        else dict(zip(compiled.others.texts, others, strict=True))
    )
    related_to = {head: view.pick_samples(own) for head, own in named.items()}
    told = compiled.notes or ("",) * len(limits)
    for row, (reading, limit) in enumerate(zip(compiled.readings, limits, strict=True)):
        note = ""
        if reading.narrows:
            by_head = {**related_to, reading.head: view.pick_samples(relevance[row])}
            choice = choose(reading, view.sight(by_head, limit, likely(limit, compiled.mode)))
            note = choice.note
            if choice.dropped:
                narrowed[row] *= view.spread(choice).to(narrowed)
        notes.append("; ".join(filter(None, (told[row], note))))
    return narrowed, replace(compiled, notes=tuple(notes))


@dataclass(frozen=True)
class _View:
    """A grid (h, w) of every `step`-th pixel of a view (H, W), and the n of them that show the scene."""

    size: tuple[int, int]
    step: int
    depths: Float[np.ndarray, "h w"]
    shown: Bool[np.ndarray, "h w"]
    points: Float[np.ndarray, "n 3"]
    colours: Float[np.ndarray, "n 3"]

    @staticmethod
    def of(frame: Frame, camera: Camera, up: Float[np.ndarray, "3"]) -> "_View":
        from scipy.ndimage import uniform_filter  # .3 s with all of scipy, for what only few phrases ask

        height, width = frame.alphas.shape
        step = max(1, round(max(height, width) / NARROWING.side))
        some = slice(step // 2, None, step)
        shown = (frame.alphas >= ANSWERING.covered_alpha).cpu().numpy()[some, some]
        axes = viewer_axes(camera.viewmat, up)
        eye = camera.viewmat.double().inverse()[:3, 3].cpu().numpy()
        places = world_points(frame.depths.double().cpu(), camera).numpy()[some, some][shown]
        straight = frame.rgb.cpu() / frame.alphas.cpu().clamp_min(ANSWERING.covered_alpha)[..., None]
        rgb = uniform_filter(straight.numpy(), step + 2, axes=(0, 1))[some, some][shown]
        return _View(
            (height, width),
            step,
            frame.depths.double().cpu().numpy()[some, some],
            shown,
            (places - eye) @ axes.T,
            lab(rgb, room_white(rgb)),
        )

    def pick_samples(self, values: Float[Tensor, "H W"]) -> Float[np.ndarray, " n"]:
        some = slice(self.step // 2, None, self.step)
        return values.cpu().numpy()[some, some][self.shown]

    def sight(self, relevance: Mapping[str, np.ndarray], limit: float, least: float) -> Sight:
        areas = np.full(len(self.points), 1 / self.shown.size)
        return Sight(self.points, self.colours, areas, relevance, limit, least, self.parts)

    def parts(self, members: Bool[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Numbers of what is connected in the grid, -1 of others; neighbours are up to eight. Edges, where
        depths are between those of two things, are none where something is as thick as three."""
        from scipy.ndimage import maximum_filter, minimum_filter
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        inside = np.zeros(self.shown.shape, bool)
        inside[self.shown] = members
        numbers = np.arange(inside.size).reshape(inside.shape)
        starts, ends = list[np.ndarray](), list[np.ndarray]()
        for one, two in _NEIGHBOURS:
            near, far = self.depths[one], self.depths[two]
            tied = inside[one] & inside[two] & (abs(near - far) <= NARROWING.jump * np.minimum(near, far))
            starts.append(numbers[one][tied])
            ends.append(numbers[two][tied])
        pairs = np.concatenate(starts), np.concatenate(ends)
        graph = coo_matrix((np.ones(len(pairs[0]), bool), pairs), shape=(inside.size, inside.size))
        found = connected_components(graph, directed=False)[1].reshape(inside.shape)
        numbers = np.where(inside, found, -1)
        thick = numbers[(minimum_filter(numbers, 3) == maximum_filter(numbers, 3)) & inside]
        if len(thick):
            numbers = np.where(np.isin(numbers, thick), numbers, -1)
        return numbers[self.shown].astype(np.int64)

    def spread(self, choice: Choice) -> Bool[Tensor, "H W"]:
        """Pixels whose nearest thing in the picture is one that is meant."""
        from scipy.ndimage import distance_transform_edt

        owner = np.zeros(self.shown.shape, np.int8)
        flat = np.zeros(len(self.points), np.int8)
        for value, things in ((1, choice.dropped), (2, choice.kept)):  # parts of a thing go before the thing
            for each in things:
                flat[each.rows] = value
        owner[self.shown] = flat
        nearest = np.asarray(distance_transform_edt(owner == 0, return_distances=False, return_indices=True))
        kept = torch.from_numpy(owner[nearest[0], nearest[1]] == 2)
        fine = kept.repeat_interleave(self.step, 0).repeat_interleave(self.step, 1)
        rows, columns = (
            torch.arange(side).clamp_max(own - 1) for side, own in zip(self.size, fine.shape, strict=True)
        )
        return fine[rows][:, columns]


_ALL, _FROM, _TO = slice(None), slice(1, None), slice(None, -1)
_NEIGHBOURS = (
    ((_ALL, _TO), (_ALL, _FROM)),
    ((_TO, _ALL), (_FROM, _ALL)),
    ((_TO, _TO), (_FROM, _FROM)),
    ((_TO, _FROM), (_FROM, _TO)),
)
