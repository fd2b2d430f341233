"""The algorithm: propose, filter, follow, look for what is new, follow that too, embed, keep.

T frames, M objects, H W pixels, C channels. Source: the paper, Algorithm 1 (continuous semantic label
collection); which frames are looked at for new objects, and every number in `Rules`, are ours.
"""

import time
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, UInt16
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.masks import cleaned, split_ids, without_gaps, without_parts, without_repeats
from langflash_core.lab.labels.protocols import ImageTextEncoder, MaskPropagator, MaskProposer
from langflash_core.lab.labels.storage import ClipLabels, ObjectRow

_MOST = 2**16 - 1


@dataclass(frozen=True)
class Rules:
    """What counts.

    same: IoU from which two proposals are one. least: share of the frame below which nothing is an object.
    look_every: frames between two looks for what is new; look_at: share of the frame that newly belongs to
    nobody, at which one looks at once. new: share of a proposal that belongs to nobody, from which it is
    something new. whole: share of a known thing that a proposal must hold to be it, and so to carry it on to
    where nobody is; core: share of the proposal that the thing must be by then.
    embed_every: frames between two embeddings. least_frames: of an object that is kept.
    """

    same: float = 0.7
    least: float = 0.0015
    look_every: int = 4
    look_at: float = 0.05
    new: float = 0.6
    whole: float = 0.6
    core: float = 0.1
    embed_every: int = 6
    least_frames: int = 2


@dataclass
class _Seen:
    """What has been collected of one object."""

    first: int
    score: float
    frames: int = 0
    area: int = 0
    vectors: list[Float[np.ndarray, " C"]] = field(default_factory=list)  # as long as their area is wide


class _Collection:
    def __init__(self, clip: Clip, proposer: MaskProposer, encoder: ImageTextEncoder, rules: Rules) -> None:
        self.clip, self.proposer, self.encoder, self.rules = clip, proposer, encoder, rules
        self.seen: dict[int, _Seen] = {}
        self.seconds = {"propose": 0.0, "follow": 0.0, "embed": 0.0}
        self.last_nobody = 1.0

    def new_ids(self, frame: int, ids: UInt16[np.ndarray, "H W"]) -> UInt16[np.ndarray, "H W"]:
        """Numbers of what is new, where nobody is; all 0 if it is not time to look, or nothing is."""
        nobody = ids == 0
        grown = float(nobody.mean()) - self.last_nobody
        if frame % self.rules.look_every and grown < self.rules.look_at:
            return np.zeros_like(ids)
        start = time.perf_counter()
        found = self.proposer.propose(self.clip.read(frame), nobody if frame else None)
        large = found.masks.mean((1, 2)) >= self.rules.least
        chosen = without_parts(without_repeats(found.rows(large), self.rules.same))
        new = np.zeros_like(ids)
        for n in np.argsort(-chosen.masks.sum((1, 2)), kind="stable"):  # what lies on a thing comes after it
            self._placed(frame, chosen.masks[n], float(chosen.scores[n]), ids, new)
        self.seconds["propose"] += time.perf_counter() - start
        self.last_nobody = float((nobody & (new == 0)).mean())
        return new

    def _placed(self, frame: int, mask: np.ndarray, score: float, ids: np.ndarray, new: np.ndarray) -> None:
        """Write into `new` where a proposal is nobody's yet: as part of a known thing, or as a new one."""
        free = cleaned(mask & (ids == 0))
        if free.mean() < self.rules.least:
            return
        known = _holds(mask, ids, self.rules)
        if known is not None:
            new[free] = known
        elif free.sum() >= self.rules.new * mask.sum() and len(self.seen) < _MOST:
            number = len(self.seen) + 1
            self.seen[number] = _Seen(frame, score)
            new[free] = number

    def note(self, frame: int, ids: UInt16[np.ndarray, "H W"]) -> None:
        """Count a frame's objects, and embed them when it is time to, or for the first time."""
        numbers, masks = split_ids(ids)
        areas = masks.sum((1, 2))
        for number, area in zip(numbers.tolist(), areas.tolist(), strict=True):
            own = self.seen[number]
            own.frames, own.area = own.frames + 1, own.area + area
        due = frame % self.rules.embed_every == 0
        fresh = any(self.seen[number].frames == 1 for number in numbers.tolist())
        if len(numbers) and (due or fresh):
            start = time.perf_counter()
            vectors = self.encoder.embed(self.clip.read(frame), masks)
            self._remember(numbers, areas, vectors)
            self.seconds["embed"] += time.perf_counter() - start

    def _remember(self, numbers: np.ndarray, areas: np.ndarray, vectors: Tensor) -> None:
        for number, area, vector in zip(
            numbers.tolist(), areas.tolist(), vectors.double().numpy(), strict=True
        ):
            if np.isfinite(vector).all() and np.linalg.norm(vector) > 1e-6:
                self.seen[number].vectors.append(vector * np.sqrt(area))


def collect(
    clip: Clip,
    proposer: MaskProposer,
    propagator: MaskPropagator,
    encoder: ImageTextEncoder,
    rules: Rules | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> ClipLabels:
    """Label a clip.

    Args:
        progress: called with each frame and the share that is done.

    Returns:
        Ids of every frame and a row an object, sorted by when it first shows; times in seconds.
    """
    rules, clip = rules or Rules(), clip.held()
    work = _Collection(clip, proposer, encoder, rules)
    following = propagator.follow(clip)
    maps = np.zeros((len(clip), *clip.read(0).shape[:2]), np.uint16)  # once: a long clip takes gigabytes
    begin = time.perf_counter()
    for frame in range(len(clip)):
        progress(f"frame {frame + 1} of {len(clip)}", frame / len(clip))
        start = time.perf_counter()
        ids = following.to(frame)
        work.seconds["follow"] += time.perf_counter() - start
        new = work.new_ids(frame, ids)
        if new.any():
            following.add(frame, new)
            ids = np.where(ids > 0, ids, new).astype(np.uint16)
        work.note(frame, ids)
        maps[frame] = without_gaps(ids)
    return _finished(clip, maps, work, time.perf_counter() - begin)


def _holds(mask: Bool[np.ndarray, "H W"], ids: UInt16[np.ndarray, "H W"], rules: Rules) -> int | None:
    """The known thing that a mask is: it has the most of it, and most of it is in the mask."""
    inside = np.bincount(ids[mask], minlength=2)
    inside[0] = 0
    best = int(inside.argmax())
    if inside[best] < rules.core * mask.sum() or best == 0:
        return None
    return best if inside[best] >= rules.whole * (ids == best).sum() else None


def _finished(clip: Clip, maps: np.ndarray, work: _Collection, seconds: float) -> ClipLabels:
    """Without objects that hardly showed; numbers in order, from 1, written over those in the maps."""
    kept = {n: own for n, own in work.seen.items() if own.frames >= work.rules.least_frames}
    if len(clip) < work.rules.least_frames:
        kept = {n: own for n, own in work.seen.items() if own.frames}
    table = np.zeros(len(work.seen) + 1, np.uint16)
    rows, vectors = [], np.zeros((len(kept), work.encoder.dimension), np.float32)
    for row, (number, own) in enumerate(
        sorted(kept.items(), key=lambda item: (item[1].first, -item[1].area))
    ):
        table[number] = row + 1
        total = np.sum(own.vectors, 0) if own.vectors else np.zeros(work.encoder.dimension)
        vectors[row] = total / max(float(np.linalg.norm(total)), 1e-12)
        rows.append(
            ObjectRow(row + 1, own.first, own.frames, own.area, own.score, len(own.vectors), _agreement(own))
        )
    times = {**{name: round(value, 3) for name, value in work.seconds.items()}, "total": round(seconds, 3)}
    for ids in maps:
        ids[:] = table[ids]
    return ClipLabels(clip.name, clip.ids, maps, tuple(rows), vectors, work.encoder.space, times)


def _agreement(own: _Seen) -> float:
    """Mean cosine of an object's vectors with their sum's direction, in [-1, 1]; 1 for a single one."""
    if not own.vectors:
        return 0.0
    units = np.stack([vector / np.linalg.norm(vector) for vector in own.vectors])
    total = np.sum(own.vectors, 0)
    return float((units @ total).mean() / max(float(np.linalg.norm(total)), 1e-12))
