"""The stage that goes on from taught weights with few labels: other photos teach through an averaged teacher.

The late halves (whole blocks) and what reads them, names and depth, learn at once, in the space of texts,
so that the network is whole after every step. A step sees labelled photos; photos of which little or
nothing is known, for which the average of the weights so far says what is where in the photo's own light,
as it is and mirrored, and the network has to say so in another, with pieces of other photos before it and
features left out; and every third step a rendered room. What the teacher is surer of than it usually is of
that class counts as a label; of the rest the network learns the odds, and its depth.

Sizes: B photos, h w pixels of the language map, P drawn pixels, N names, C channels.

Source: Tarvainen and Valpola 2017 (mean teacher); Sohn et al. 2020 (FixMatch); Zhang et al. 2021
(FlexMatch: a threshold of each class); Yun et al. 2019 (CutMix); Yang et al. 2025 (UniMatch V2).
"""

from copy import deepcopy
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.bank import NameBank
from langflash_core.lab.training.batches import RoomSet, SceneBatch
from langflash_core.lab.training.losses import depth_loss, error_loss, gradient_loss
from langflash_core.lab.training.pool import DrawnPhotos, PhotoPool
from langflash_core.lab.training.real import MODULES
from langflash_core.lab.training.stages.depth import depth_stage
from langflash_core.lab.training.stages.language import language_stage, thinned
from langflash_core.lab.training.stages.pixels import evenly_drawn, nearest
from langflash_core.lab.training.stages.stage import Loss, Stage, Words, guided
from langflash_core.network.encoders.late import with_taught
from langflash_core.network.encoders.shared import Tokens, tokens_to_maps
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.layers.dpt import double

RATES = {"late": 0.25, "deep": 0.25, "decoder": 0.4, "depth_head": 0.4, "averaged": 0.0}
"""Of the stage's rate."""
DEPTH = ("deep", "decoder", "depth_head")
"""What learns depth alone."""
TEMPERATURE = 16.0
"""Factor on cosines in every softmax."""
HIDDEN = 0.1
"""Share of token channels that are hidden from what reads them."""
CLASS_PIXELS, NAME_PIXELS, SILENT_PIXELS = 6000, 2500, 6000
"""Drawn from all photos of a step."""
TEACHER_DECAY = 0.99
"""Of the averaged teacher, at most; younger ones forget faster."""
SURE = 0.9
"""Of the softmax, from which the teacher counts for the class that it is usually surest of."""
SURE_DECAY = 0.98
"""Of what is remembered of how sure the teacher usually is."""
CUT = (0.3, 0.7)
"""Sides of a piece of another photo, in shares of the photo's."""
ATTRACTION = 0.25
"""Of 1 - cosine, which keeps features in the texts' own space."""


@dataclass(frozen=True)
class Weights:
    """What each part of a step's loss counts: names beside classes, what the teacher says and, of that, the
    odds; true depth, depth that the teacher says, rooms."""

    names: float = 0.5
    silent: float = 0.5
    odds: float = 1.0
    depth: float = 1.0
    said_depth: float = 0.3
    rooms: float = 0.5

    @property
    def deep(self) -> bool:
        """Whether anything is said of depth."""
        return self.depth > 0 or self.said_depth > 0


NAMES_ALONE = Weights(depth=0.0, said_depth=0.0)
"""Depth stays as it is: more steps in the same time, and its half reads no names."""


@dataclass(frozen=True)
class FewBatch:
    """Photos with labels; photos for the teacher, or None; one room of two views, or None."""

    told: DrawnPhotos
    silent: DrawnPhotos | None
    rooms: SceneBatch | None

    @property
    def seeds(self) -> tuple[int | str, ...]:
        """Names of the photos, and the room's seed."""
        silent = () if self.silent is None else self.silent.seeds
        return self.told.seeds + silent + (() if self.rooms is None else self.rooms.seeds)

    def to(self, device: str | torch.device) -> "FewBatch":
        parts = (self.told, self.silent, self.rooms)
        return FewBatch(*(None if part is None else part.to(device) for part in parts))  # type: ignore[arg-type]


@dataclass
class FewSet:
    """Labelled photos at every step, as many others beside them, a room at every `every`-th."""

    told: PhotoPool
    silent: PhotoPool | None
    rooms: RoomSet | None
    every: int = 3
    _step: int = 1

    def __len__(self) -> int:
        return sum(len(part) for part in (self.told, self.silent, self.rooms) if part is not None)

    def draw(self, count: int, views: int, generator: torch.Generator) -> FewBatch:
        """`count` photos of each kind; `views` says nothing."""
        turn = self._step % self.every == 1 % self.every
        room = self.rooms.draw(1, 2, generator) if self.rooms is not None and turn else None
        silent = None if self.silent is None else self.silent.draw(count, generator)
        return FewBatch(self.told.draw(count, generator), silent, room)

    def seek(self, step: int) -> None:
        """What is drawn next is for this step, from 1."""
        self._step = step


class Averaged(nn.Module):
    """The average of the weights so far, which says what is where in photos that nobody labelled.

    usual (37,): how sure it is of each class where it says it, on average; age (): steps it has followed.
    """

    usual: Tensor
    age: Tensor

    def __init__(self, network: GuidedDepthNet):
        super().__init__()
        head = network.language_head
        self.late, self.taught, self.out = deepcopy(network.late), deepcopy(head.taught), deepcopy(head.out)
        self.deep, self.decoder = deepcopy(network.deep), deepcopy(network.decoder)
        self.depth_head = deepcopy(network.depth_head)
        self.register_buffer("usual", torch.full((len(CLASSES37),), 1 / len(CLASSES37)))
        self.register_buffer("age", torch.tensor(0))

    @torch.no_grad()
    def follow(self, network: GuidedDepthNet) -> None:
        """Take a step towards the network."""
        self.age += 1
        decay = self._decay(TEACHER_DECAY)
        head = network.language_head
        pairs = (
            (self.late, network.late), (self.taught, head.taught), (self.out, head.out),
            (self.deep, network.deep), (self.decoder, network.decoder), (self.depth_head, network.depth_head),
        )  # fmt: skip
        for own, other in pairs:
            for mine, theirs in zip(own.parameters(), other.parameters(), strict=True):
                mine.lerp_(theirs, 1 - decay)

    def _decay(self, most: float) -> float:
        return min(most, int(self.age) / (9 + int(self.age)))

    @torch.no_grad()
    def looks(
        self, network: GuidedDepthNet, images: Tensor, Ks: Tensor, *, deep: bool = True
    ) -> tuple[Tensor, Tensor | None]:
        """What its last layer reads of photos (B, 1, 3, H, W), (B, h, w, F), and where it is asked for their
        log depths (B, H, W): means of the photos as they are and mirrored. (The last layer is linear.)"""
        self.eval()
        seen, logs = self._look(network, images, Ks, deep)
        other, turned = self._look(network, *mirrored(images, Ks), deep)
        means = None if logs is None or turned is None else (logs + turned.flip(-1)) / 2
        return (seen + other.flip(2)) / 2, means

    def _look(
        self, network: GuidedDepthNet, images: Tensor, Ks: Tensor, deep: bool
    ) -> tuple[Tensor, Tensor | None]:
        tokens, early = network.encoder(images)
        tokens = with_taught(tokens, early, network.encoder.vit, self.late, self.deep if deep else None)
        taught = double(self.taught(tokens.taught_maps()), align_corners=False)
        hidden = torch.cat((network.language_head.own(tokens), taught), 1).movedim(1, -1)
        return hidden, log_depths(self.decoder, self.depth_head, tokens, Ks) if deep else None

    @torch.no_grad()
    def surely(self, logits: Tensor) -> Tensor:
        """Rows of classes (...) that the teacher is sure of by its logits (..., 37), -1 elsewhere; remembers
        how sure it is.

        Hard classes, of which it is usually less sure, count from less on.
        """
        sure, said = logits.float().softmax(-1).max(-1)
        sums = torch.zeros_like(self.usual).index_add_(0, said.flatten(), sure.flatten())
        counts = torch.bincount(said.flatten(), minlength=len(self.usual)).to(sums)
        seen = counts > 0
        step = 1 - self._decay(SURE_DECAY)
        self.usual[seen] = self.usual[seen].lerp((sums / counts.clamp_min(1))[seen], step)
        needed = SURE * (self.usual / self.usual.max()).sqrt()
        return torch.where(sure >= needed[said], said, -1)


def log_depths(decoder: nn.Module, depth_head: nn.Module, tokens: Tokens, Ks: Tensor) -> Tensor:
    """Log depths (B, H, W) of single photos, in nats, as copies of a network's modules tell them."""
    deep = (tokens_to_maps(t.flatten(0, 1), tokens.grid) for t in decoder(tokens, Ks, None))
    return depth_head((tokens.maps(0), tokens.maps(1), *deep), tokens).log_depths[:, 0].float()


def few_stage(bank: NameBank, weights: Weights | None = None) -> Stage:
    """The late halves, whole, and what reads them; `averaged` is the network's while this lasts. Where depth
    counts nothing its half stays as it is."""
    counts = weights or Weights()
    learn = MODULES if counts.deep else tuple(name for name in MODULES if name not in DEPTH)
    return Stage(
        "late_few", (*learn, "averaged"), (), {1: 1.0}, 6, 4e-4,
        lambda network, batch, words: _loss(guided(network), batch, words, bank, counts), rates=RATES,
    )  # fmt: skip


def _loss(network: GuidedDepthNet, batch: FewBatch, words: Words, bank: NameBank, counts: Weights) -> Loss:
    photos, generator = batch.told, words.generator
    tokens = encoded(network, photos.relit, counts.deep)
    hidden = read(network, thinned(tokens, HIDDEN, generator))
    total, told = told_loss(hidden, network.language_head.out, photos, bank, counts.names, generator)
    known = (photos.depths > 0).flatten(1).any(1)
    if counts.depth and bool(known.any()):
        depth = _depth(network, tokens.each(lambda hook: hook[known]), photos.Ks[known], photos.depths[known])
        total, told = total + counts.depth * depth, told | {"depth": float(depth.detach())}
    if batch.silent is not None:
        said, parts = _silent(network, batch.silent, bank, counts, generator)
        total, told = total + counts.silent * said, told | parts
    if batch.rooms is not None:
        said, parts = room_loss(network, batch.rooms, words, counts.depth)
        total, told = total + counts.rooms * said, told | parts
    return Loss(total, told)


def room_loss(
    network: GuidedDepthNet, room: SceneBatch, words: Words, depth: float = 1.0
) -> tuple[Tensor, dict[str, float]]:
    """Phrases and, times `depth`, depth of a rendered room, whose tokens are found anew."""
    own = SceneBatch(
        room.images, room.depths, room.instances, room.viewmats, room.Ks,
        encoded(network, room.images, depth > 0), room.labels, room.seeds,
    )  # fmt: skip
    said = language_stage(network, own, words)
    if not depth:
        return said.total, {"phrases": float(said.total.detach())}
    seen = depth_stage(network, own, words)
    told = {"phrases": float(said.total.detach()), "room_depth": float(seen.total.detach())}
    return said.total + depth * seen.total, told


def encoded(network: GuidedDepthNet, images: Tensor, deep: bool) -> Tokens:
    """Tokens of pictures (B, V, 3, H, W), as `GuidedDepthNet.encode` has them; without depth's half where
    nothing is said of depth."""
    tokens, early = network.encoder(images)
    return with_taught(tokens, early, network.encoder.vit, network.late, network.deep if deep else None)


def read(network: GuidedDepthNet, tokens: Tokens) -> Tensor:
    """What the last layer reads, (B, h, w, F); photos teach nothing to the reader of the frozen half."""
    head = network.language_head
    with torch.no_grad():
        own = head.own(tokens)
    return torch.cat((own, head.of_photos(tokens)), 1).movedim(1, -1)


def _depth(network: GuidedDepthNet, tokens: Tokens, Ks: Tensor, depths: Tensor) -> Tensor:
    maps = network.monocular_depth(tokens, Ks)
    logs, errors = maps.log_depths.flatten(0, 1).float(), maps.log_errors.flatten(0, 1).float()
    shape, slope = depth_loss(logs, depths), gradient_loss(logs, depths)
    return shape + 0.5 * slope + 0.05 * error_loss(logs, errors, depths)


def units_at(hidden: Tensor, out: nn.Conv2d, chosen: Tensor) -> Tensor:
    """Unit vectors (P, C) of some pixels of `hidden` (B, h, w, F); the last layer is per pixel."""
    drawn = hidden.flatten(0, 2)[chosen.to(hidden.device)]
    return F.normalize(F.linear(drawn, out.weight[:, :, 0, 0], out.bias).float(), dim=-1)


def told_loss(
    hidden: Tensor,
    out: nn.Conv2d,
    photos: DrawnPhotos,
    bank: NameBank,
    share: float,
    generator: torch.Generator,
) -> tuple[Tensor, dict[str, float]]:
    """Cross-entropy among the classes and, times `share`, among the names that a photo's set denies, each
    with attraction to the text that is true."""
    size = (hidden.shape[1], hidden.shape[2])
    classes = nearest(photos.classes, size).flatten().cpu()  # drawn where the generator is
    names = nearest(photos.names, size).flatten().cpu()
    known = (classes >= 0).nonzero()[:, 0]
    drawn = known[torch.randperm(len(known), generator=generator)[:CLASS_PIXELS]]
    by_class = class_loss(units_at(hidden, out, drawn), classes[drawn], bank)
    chosen = evenly_drawn(names, NAME_PIXELS, generator)
    of_set = photos.sets[chosen.to(photos.sets.device) // (size[0] * size[1])]
    by_name = name_loss(units_at(hidden, out, chosen), names[chosen], of_set, bank)
    told = {"classes": float(by_class.detach()), "names": float(by_name.detach())}
    return by_class + share * by_name, told


def class_loss(units: Tensor, rows: Tensor, bank: NameBank) -> Tensor:
    """Balanced cross-entropy of unit vectors (P, C) among the 37 classes, with attraction."""
    texts, rows = bank.classes.to(units), rows.to(units.device)
    weights = bank.balance.to(units)[rows]
    each = F.cross_entropy(TEMPERATURE * units @ texts.T, rows, reduction="none")
    return (each * weights).sum() / weights.sum().clamp_min(1e-6) + ATTRACTION * _apart(units, texts[rows])


def name_loss(units: Tensor, rows: Tensor, of_set: Tensor, bank: NameBank) -> Tensor:
    """Cross-entropy of unit vectors (P, C) among the names that their sets (P,) deny, with attraction."""
    texts, rows, of_set = bank.vectors.to(units), rows.to(units.device), of_set.to(units.device)
    silent = ~bank.against.to(units.device)[of_set, rows]
    logits = (TEMPERATURE * units @ texts.T).masked_fill(silent, -1e4)
    by_name = F.cross_entropy(logits, rows, reduction="sum") / max(len(rows), 1)
    return by_name + ATTRACTION * _apart(units, texts[rows])


def _apart(units: Tensor, texts: Tensor) -> Tensor:
    return (1 - (units * texts).sum(-1)).sum() / max(len(units), 1)


def _silent(
    network: GuidedDepthNet, photos: DrawnPhotos, bank: NameBank, counts: Weights, generator: torch.Generator
) -> tuple[Tensor, dict[str, float]]:
    """What labels say where there are some, and the teacher elsewhere, of photos mixed with each other."""
    teacher, out = network.averaged, network.language_head.out
    assert isinstance(teacher, Averaged)
    teacher.follow(network)
    seen, logs = teacher.looks(network, photos.images, photos.Ks, deep=counts.said_depth > 0)
    size = (seen.shape[1], seen.shape[2])
    grid = (size[0] // 4, size[1] // 4)
    boxes, other = cut_boxes(len(seen), grid, generator)
    patch = photos.images.shape[-2] // grid[0]
    pictures = pasted(photos.relit, scaled(boxes, patch), other)
    places = torch.arange(seen[..., 0].numel()).unflatten(0, seen.shape[:3])
    drawn = torch.randperm(places.numel(), generator=generator)[:SILENT_PIXELS]
    origin = pasted(places, scaled(boxes, 4), other).flatten()[drawn]  # where the teacher saw the same
    with torch.no_grad():
        target = told_by(units_at(seen, teacher.out, origin), _at(photos.opinions, size, origin), bank)
    known = _at(photos.classes, size, origin)
    said = torch.where(known >= 0, known, teacher.surely(target.by_class))
    sure = said >= 0
    tokens = encoded(network, pictures, counts.said_depth > 0)
    hidden = read(network, thinned(tokens, HIDDEN, generator))
    units = units_at(hidden, out, drawn)
    by_class = class_loss(units[sure], said[sure], bank)
    share = float(sure.float().mean())
    by_odds = odds_loss(units, target, bank)
    alike = target.alike
    total = (
        share * by_class + ATTRACTION * _apart(units[alike], target.vectors[alike]) + counts.odds * by_odds
    )
    told = {"silent": float(by_class.detach()), "sure": share, "odds": float(by_odds.detach())}
    if logs is not None:
        truth = without(logs.exp(), scaled(boxes, patch))
        deep = _depth(network, tokens, photos.Ks, truth)
        total, told = total + counts.said_depth * deep, told | {"said_depth": float(deep.detach())}
    rows = _at(photos.names, size, origin).cpu()
    chosen = evenly_drawn(rows, NAME_PIXELS, generator)
    if len(chosen):
        of_set = photos.sets[(origin[chosen] // (size[0] * size[1])).to(photos.sets.device)]
        said = name_loss(units[chosen.to(units.device)], rows[chosen], of_set, bank)
        total, told = total + counts.names * said, told | {"silent_names": float(said.detach())}
    return total, told


def _at(maps: Tensor, size: tuple[int, int], places: Tensor) -> Tensor:
    """Values (P,) of maps (B, H, W) at places of maps of `size`."""
    return nearest(maps, size).flatten()[places.to(maps.device)]


@dataclass(frozen=True)
class Target:
    """What a teacher says of pixels: unit vectors (P, C), logits of the classes (P, 37) and of all names
    (P, N); alike (P,): its vector and its logits say the same class."""

    vectors: Tensor
    by_class: Tensor
    by_name: Tensor
    alike: Tensor


def told_by(vectors: Tensor, opinions: Tensor, bank: NameBank) -> Target:
    """What a teacher's unit vectors (P, C) say, with the evidence of what another network says (P,)."""
    by_class, by_name = (
        (TEMPERATURE * vectors @ texts.to(vectors).T).float() for texts in (bank.classes, bank.vectors)
    )
    heard = bank.heard(opinions)
    if heard is None:
        return Target(vectors, by_class, by_name, torch.ones_like(opinions, dtype=torch.bool))
    own = by_class.argmax(-1)
    by_class, by_name = by_class + heard[0], by_name + heard[1]
    return Target(vectors, by_class, by_name, by_class.argmax(-1) == own)


def odds_loss(units: Tensor, said: Target, bank: NameBank) -> Tensor:
    """How far the odds of unit vectors (P, C) lie from those that a teacher says: among the 37 classes,
    where rare ones count more, and among all names."""
    weights = bank.balance.to(units)[said.by_class.argmax(-1)]
    by_class = (odds_apart(units, bank.classes.to(units), said.by_class) * weights).sum() / weights.sum()
    return by_class + odds_apart(units, bank.vectors.to(units), said.by_name).mean()


def odds_apart(units: Tensor, texts: Tensor, logits: Tensor) -> Tensor:
    """Kullback-Leibler divergence (P,) of softmaxes over texts (N, C), in nats: what is said from logits
    (P, N) from what unit vectors (P, C) say."""
    ours = (TEMPERATURE * units @ texts.T).float().log_softmax(-1)
    theirs = logits.float().log_softmax(-1)
    return (theirs.exp() * (theirs - ours)).sum(-1)


def mirrored(images: Tensor, Ks: Tensor) -> tuple[Tensor, Tensor]:
    """Photos (..., H, W) with left and right changed, and their intrinsics (..., 3, 3)."""
    other = Ks.clone()
    other[..., 0, 2] = images.shape[-1] - Ks[..., 0, 2]
    return images.flip(-1), other


def cut_boxes(
    count: int, grid: tuple[int, int], generator: torch.Generator
) -> tuple[list[tuple[int, int, int, int]], list[int]]:
    """For every photo a box (top, left, bottom, right) of whole patches, empty for half of them, and the
    photo that shows in it."""
    boxes, others = [], []
    for place in range(count):
        u = torch.rand(5, generator=generator).tolist()
        high, wide = (round((CUT[0] + (CUT[1] - CUT[0]) * x) * n) for x, n in zip(u[:2], grid, strict=True))
        top, left = round(u[2] * (grid[0] - high)), round(u[3] * (grid[1] - wide))
        empty = u[4] < 0.5 or count == 1
        boxes.append((0, 0, 0, 0) if empty else (top, left, top + high, left + wide))
        others.append((place + 1) % count)
    return boxes, others


def scaled(boxes: list[tuple[int, int, int, int]], factor: int) -> list[tuple[int, int, int, int]]:
    """Boxes of patches in pixels of a map with `factor` pixels a patch."""
    return [(factor * a, factor * b, factor * c, factor * d) for a, b, c, d in boxes]


def pasted(maps: Tensor, boxes: list[tuple[int, int, int, int]], others: list[int]) -> Tensor:
    """Maps (B, ..., H, W), each with another's box in its place."""
    answer = maps.clone()
    for place, ((top, left, bottom, right), other) in enumerate(zip(boxes, others, strict=True)):
        answer[place, ..., top:bottom, left:right] = maps[other, ..., top:bottom, left:right]
    return answer


def without(maps: Tensor, boxes: list[tuple[int, int, int, int]]) -> Tensor:
    """Maps (B, H, W), 0 inside the boxes."""
    answer = maps.clone()
    for place, (top, left, bottom, right) in enumerate(boxes):
        answer[place, top:bottom, left:right] = 0
    return answer
