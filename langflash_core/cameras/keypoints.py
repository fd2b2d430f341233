"""Key points of several photos and which of each pair correspond. Imports no torch: photos are matched
while torch is still being imported."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int, Shaped, UInt8

from langflash_core.base.lazy import Lazy
from langflash_core.cameras.matching import at_side, detect, match_descriptors
from langflash_core.cameras.retrieval import likeness
from langflash_core.rig.pairs import likely_pairs
from langflash_core.rig.settings import MATCHING

Told = Callable[[str, int, int], None]


@dataclass(frozen=True)
class KeyPoints:
    """positions: per view (n, 2), pixels of the photo scaled to `MATCHING.working_side`. pairs: per pair of
    views i < j that may show the same, rows of both (m, 2) that correspond."""

    positions: tuple[Float[np.ndarray, "_ 2"], ...]
    pairs: dict[tuple[int, int], Int[np.ndarray, "_ 2"]]

    @property
    def counts(self) -> dict[tuple[int, int], int]:
        """How many matches each pair has."""
        return {pair: len(rows) for pair, rows in self.pairs.items()}

    def arrays(self) -> dict[str, Shaped[np.ndarray, "..."]]:
        """Both, end to end, to be kept."""
        rows = list(self.pairs.values())
        return {
            "positions": np.concatenate([*self.positions, np.zeros((0, 2))]),
            "of_views": np.array([len(own) for own in self.positions], np.int64),
            "edges": np.array(list(self.pairs), np.int64).reshape(-1, 2),
            "of_edges": np.array([len(own) for own in rows], np.int64),
            "rows": np.concatenate([*rows, np.zeros((0, 2), np.int64)]),
        }

    @staticmethod
    def of(arrays: Mapping[str, Shaped[np.ndarray, "..."]]) -> "KeyPoints":
        """What `arrays` had."""
        positions = np.split(arrays["positions"], np.cumsum(arrays["of_views"])[:-1])
        rows = np.split(arrays["rows"], np.cumsum(arrays["of_edges"])[:-1])
        edges = (tuple(edge) for edge in arrays["edges"].tolist())
        return KeyPoints(tuple(positions), dict(zip(edges, rows, strict=False)))


def match_sources(
    sources: tuple[bytes, ...],
    check: Callable[[], None] = lambda: None,
    told: Told = lambda what, done, count: None,
    pairs: Sequence[tuple[int, int]] | None = None,
) -> KeyPoints:
    """`match_photos` of pictures as JPEG bytes."""
    return match_photos(Lazy(lambda number: decode_grey(sources[number]), len(sources)), check, told, pairs)


def match_photos(
    greys: Sequence[UInt8[np.ndarray, "_ _"]],
    check: Callable[[], None] = lambda: None,
    told: Told = lambda what, done, count: None,
    pairs: Sequence[tuple[int, int]] | None = None,
) -> KeyPoints:
    """Key points of photos (h, w) uint8 of one shape, and what corresponds; deterministic. pairs: that are
    compared; None: those that are likely to show the same.

    `check` is called before each photo and each pair; what it raises ends the work. So is `told`, with what
    is done, how much of it was, and of how much.
    """
    limit = MATCHING.features_of_many if len(greys) > MATCHING.many else MATCHING.features
    positions, descriptors = [], []
    for number, grey in enumerate(greys):
        check()
        told("key points of photos", number, len(greys))
        own_positions, own_descriptors = detect(at_side(grey, MATCHING.working_side), limit)
        positions.append(own_positions)
        descriptors.append(own_descriptors)
    if pairs is None:
        pairs = likely_pairs(len(descriptors), lambda: likeness(descriptors))
    matched = {}
    for number, (i, j) in enumerate(pairs):
        check()
        told("matching pairs", number, len(pairs))
        matched[i, j] = match_descriptors(descriptors[i], descriptors[j])
    return KeyPoints(tuple(positions), matched)


def decode_grey(source: bytes) -> UInt8[np.ndarray, "h w"]:
    """A picture (h, w) uint8, grey, of JPEG bytes."""
    grey = cv2.imdecode(np.frombuffer(source, np.uint8), cv2.IMREAD_GRAYSCALE)
    assert grey is not None, "sources are JPEG bytes that images/ wrote"
    return grey
