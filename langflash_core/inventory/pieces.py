"""Which Gaussians are one thing, and of which kind it is.

A piece is what touches and answers one kind of the vocabulary best. Things come in several: the top of a
desk looks like a table, its side like a kitchen island, and what is seen of it between the legs of a chair
like nothing at all. Two neighbours are one thing where one name does for both. With c_a the mean cosines of
piece a with all kinds, w_a its share of the photos, and c_ab the mean of both,

    price(a, b) = (w_a max c_a + w_b max c_b - (w_a + w_b) max c_ab) / min(w_a, w_b) >= 0,

what one name costs, in cosines of the smaller piece. The cheapest pair is joined first, until none costs less
than a share of the cosine from which a phrase counts as present: `PRESENCE.things` between two things,
    `PRESENCE.room` between
a thing and a wall, floor or ceiling. Pieces that touch with little of their borders stay apart.

Sizes: N Gaussians, G kinds, n pieces, m pairs. Source: own, after the joining of regions by Ward 1963.
"""

import heapq
from dataclasses import dataclass, field

import numpy as np
import torch
from jaxtyping import Float, Integer
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from langflash_core.inventory.settings import PRESENCE
from langflash_core.language.gaussians import gaussian_relevance
from langflash_core.language.relevance import compile_query
from langflash_core.language.spaces import language_space
from langflash_core.language.vocabulary import OWN
from langflash_core.scene.instances import touching
from langflash_core.types import Scene

STRUCTURE = ("wall", "floor", "ceiling")
"""Kinds that rooms are made of: no things."""
OPENINGS = ("door", "window")
"""Kinds that are in walls."""
KINDS = ("", *sorted(OWN))
"""Words of the vocabulary, after that of what answers none."""


@dataclass(frozen=True)
class Parts:
    """What a room is made of, walls and all. numbers: (N,), from 0; -1 of nothing. kinds: of each number.
    cosines: each one's mean with its kind. present: from which one counts."""

    numbers: Integer[np.ndarray, " N"] = field(repr=False)
    kinds: tuple[str, ...]
    cosines: tuple[float, ...]
    present: float


@torch.no_grad()
def parts_of_room(scene: Scene, shares: Float[np.ndarray, " N"]) -> Parts:
    """The parts of a scene.

    Args:
        shares: of the photos that each Gaussian makes up.

    Raises:
        PromptError: the scene has no language. WeightsError: it has no weights for it.
    """
    names = list(OWN)
    compiled = compile_query(scene, language_space(scene.semantics.space), names, mode="cosine")
    cosines = gaussian_relevance(scene.semantics, compiled).cpu().numpy()  # (G, N)
    starts, others = touching(scene.gaussians)
    numbers = _pieces(cosines.argmax(0), starts, others, shares)
    some = numbers >= 0
    count = int(numbers.max(initial=-1)) + 1
    masses = np.bincount(numbers[some], shares[some], count).astype(float)
    places = (shares[some], (numbers[some], np.flatnonzero(some)))
    means = csr_matrix(places, (count, len(numbers))) @ cosines.T / masses[:, None]
    pieces = Pieces(masses, means, _contacts(numbers, starts, others))
    into = pieces.joined(PRESENCE.things * compiled.threshold, PRESENCE.room * compiled.threshold)
    kept, into = np.unique(into, return_inverse=True)
    best = pieces.means[kept]
    kinds = tuple(names[kind] for kind in best.argmax(1)) if len(kept) else ()
    return Parts(
        np.where(some, np.append(into, -1)[numbers], -1),
        kinds,
        tuple(best.max(1).tolist()) if len(kept) else (),
        compiled.threshold,
    )


def kinds_of(scene: Scene) -> Integer[np.ndarray, " N"]:
    """(N,) places in `KINDS`: the kind of each Gaussian by itself. Of millions an array of words takes half a
    second, in which no other thread runs."""
    names = list(OWN)
    compiled = compile_query(scene, language_space(scene.semantics.space), names)
    best, which = gaussian_relevance(scene.semantics, compiled).max(0)
    places = np.array([KINDS.index(name) for name in names])
    return np.where((best >= compiled.threshold).numpy(), places[which.numpy()], 0)


def _pieces(
    kinds: Integer[np.ndarray, " N"],
    starts: Integer[np.ndarray, " m"],
    others: Integer[np.ndarray, " m"],
    shares: Float[np.ndarray, " N"],
) -> Integer[np.ndarray, " N"]:
    """(N,) numbers from 0 of what touches and is of one kind; -1 of what no photo shows."""
    same = kinds[starts] == kinds[others]
    size = (len(kinds), len(kinds))
    graph = coo_matrix((np.ones(int(same.sum()), bool), (starts[same], others[same])), size)
    numbers = connected_components(graph, directed=False)[1]
    large = np.bincount(numbers, shares) >= PRESENCE.least
    return np.where(large, large.cumsum() - 1, -1)[numbers]


def _contacts(numbers: np.ndarray, starts: np.ndarray, others: np.ndarray) -> list[dict[int, float]]:
    """Of each piece, its neighbours and the number of pairs of Gaussians that touch."""
    near: list[dict[int, float]] = [{} for _ in range(int(numbers.max(initial=-1)) + 1)]
    first, second = numbers[starts], numbers[others]
    apart = (first != second) & (first >= 0) & (second >= 0)
    pairs = np.sort(np.stack((first[apart], second[apart]), 1), 1)
    for (a, b), count in zip(*np.unique(pairs, axis=0, return_counts=True), strict=True):
        near[a][int(b)] = near[b][int(a)] = float(count)
    return near


class Pieces:
    """Pieces while they are joined.

    masses: (n,) of the photos. means: (n, G) cosines. near: of each piece its neighbours, and by how much
    they touch.
    """

    def __init__(
        self, masses: Float[np.ndarray, " n"], means: Float[np.ndarray, "n G"], near: list[dict[int, float]]
    ):
        self.masses, self.means, self.near = masses.copy(), means.copy(), near
        self._into = np.arange(len(masses))
        self._changes = np.zeros(len(masses), int)
        self._structure = np.isin(list(OWN), STRUCTURE)
        self._queue: list[tuple[float, int, int, int, int]] = []

    def joined(self, things: float, room: float) -> Integer[np.ndarray, " n"]:
        """Join what costs no more; (n,) the piece that each has become part of.

        Args:
            things: price up to which two things are joined. room: a thing and what is none.
        """
        for piece in range(len(self.masses)):
            self._offer(piece, things, room, after=piece)
        while self._queue:
            _, a, b, *changes = heapq.heappop(self._queue)
            if changes == [self._changes[a], self._changes[b]]:
                self._join(a, b)
                self._offer(a, things, room)
        into = self._into
        while (into[into] != into).any():
            into = into[into]
        return into

    def price(self, a: int, b: int) -> float:
        """What one name for both costs the smaller one."""
        first, second = self.masses[a], self.masses[b]
        both = first * self.means[a] + second * self.means[b]
        lost = first * self.means[a].max() + second * self.means[b].max() - both.max()
        return float(lost / min(first, second))

    def _offer(self, piece: int, things: float, room: float, after: int = -1) -> None:
        """Put its pairs into the queue that may be joined."""
        for other, contact in self.near[piece].items():
            if other <= after or contact < PRESENCE.contact * min(self._border(piece), self._border(other)):
                continue
            none = [bool(self._structure[self.means[each].argmax()]) for each in (piece, other)]
            if all(none):  # no things, whatever they are joined to
                continue
            limit = room if any(none) else things
            price = self.price(piece, other)
            if price <= limit:
                row = (price, piece, other, int(self._changes[piece]), int(self._changes[other]))
                heapq.heappush(self._queue, row)

    def _border(self, piece: int) -> float:
        return sum(self.near[piece].values())

    def _join(self, a: int, b: int) -> None:
        """Piece b becomes part of a."""
        whole = self.masses[a] + self.masses[b]
        self.means[a] = (self.masses[a] * self.means[a] + self.masses[b] * self.means[b]) / whole
        self.masses[a] = whole
        self._into[b] = a
        self._changes[[a, b]] += 1
        for other, contact in self.near[b].items():
            del self.near[other][b]
            if other != a:
                self.near[a][other] = self.near[other][a] = self.near[a].get(other, 0.0) + contact
        self.near[b] = {}
