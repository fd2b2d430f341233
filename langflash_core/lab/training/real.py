"""The stage that teaches names and depth by real photos: first the late halves, then what reads them.

The late halves learn from a plain classifier (`teacher`), one names and one depth, on photos and now and
then a rendered room. Then they stay, cut to their rank, and language head, decoder and depth head learn on
top: photos teach by a softmax over the names of 37 classes, one over fine names, and their depths; every
second step a rendered room teaches phrases and depth as in the stages `language` and `depth`, so that what
no photo names is not lost. Measured before: all of it at once, in the space of texts, took four times the
steps (model card).

Sizes: B photos, H W pixels, h w the language head's own, P pixels, A phrases, C channels.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.fitting import fitted
from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.batches import RoomSet, SceneBatch
from langflash_core.lab.training.late import HALVES, make_cut, make_whole, soften
from langflash_core.lab.training.live import SIZES, LabelledBatch, LivePhotos, pictures
from langflash_core.lab.training.loop import LoopOptions, Validate, train_stage
from langflash_core.lab.training.losses import depth_loss, error_loss, gradient_loss
from langflash_core.lab.training.measures import (
    abs_rel,
    accuracy,
    align_scale,
    confusion,
    delta1,
    mean_iou,
    nan_mean,
)
from langflash_core.lab.training.photo_names import photo_label
from langflash_core.lab.training.stages.depth import depth_stage
from langflash_core.lab.training.stages.language import language_stage, thinned
from langflash_core.lab.training.stages.pixels import evenly_drawn, nearest
from langflash_core.lab.training.stages.stage import Loss, Stage, Words, guided
from langflash_core.lab.training.states import LoopState, save_cut
from langflash_core.lab.training.teacher import Names, Rows, Teacher, hand_over
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.precision import mixed_precision
from langflash_core.network.prior import resize

HEADS = ("language_head", "decoder", "depth_head")
MODULES = (*HALVES, *HEADS)
"""What is left in the network."""
RATES = {"late": 0.12, "deep": 0.12, "decoder": 0.5, "depth_head": 0.5}
"""Of a stage's rate: what has learned before moves less."""
LATE_SHARE = 0.6
"""Of the time, for the late halves; the rest is for the heads."""
ROOMS_EVERY = 3
"""A step of the late halves with a rendered room."""
TEMPERATURE = 16.0
"""Factor on cosines in both softmaxes."""
HIDDEN = 0.1
"""Share of token channels that are hidden from the language head."""
RARITY = 0.25
"""A class counts frequency^-RARITY: 0 is as pixels come, 1 all classes alike."""
CLASS_PIXELS, FINE_PIXELS = 8000, 3000
"""Drawn from all photos of a step."""
MIN_PHOTOS = 5
"""A fine name that fewer photos show teaches nothing; its class still does."""


@dataclass(frozen=True)
class PhotoTargets:
    """What ids of a folder are called: rows (largest id + 1,) of `classes` and of `fine`, -1 = nothing.

    classes (37, C) and fine (A, C): unit texts; names: of the rows of fine; balance (37,): what a pixel of
    a class counts; against (A, A) bool: which fine names speak against which (a class does not against
    its kinds).
    """

    classes: Tensor
    fine: Tensor
    class_of: Tensor
    fine_of: Tensor
    balance: Tensor
    against: Tensor
    names: tuple[str, ...]

    @property
    def rows(self) -> Rows:
        """By id."""
        return Rows(self.class_of, self.fine_of)

    @staticmethod
    def of(
        folder: PhotoFolder, photos: LivePhotos, encode: Callable[[Sequence[str]], Tensor]
    ) -> "PhotoTargets":
        """Targets of a folder, of which `photos` are learned from."""
        size = max(folder.names) + 1
        class_of, fine_of = torch.full((size,), -1), torch.full((size,), -1)
        counts, shown = torch.zeros(size), torch.zeros(size)
        for photo in photos.photos:
            if photo.labels is not None:
                pixels = torch.bincount(torch.from_numpy(photo.labels).flatten(), minlength=size)
                counts, shown = counts + pixels, shown + (pixels > 0)
        labels = {id: photo_label(name) for id, name in folder.names.items()}
        photos_of: dict[str, float] = {}
        for id, label in labels.items():
            if label is not None:
                photos_of[label.name] = photos_of.get(label.name, 0) + float(shown[id])
        names = sorted(name for name, count in photos_of.items() if count >= MIN_PHOTOS)
        bank = list(dict.fromkeys((*names, *CLASSES37)))
        rows = {text: row for row, text in enumerate(bank)}
        against = torch.ones(len(bank), len(bank), dtype=torch.bool)
        for id, name in folder.names.items():
            label = labels[id]
            if name.label in CLASSES37:
                class_of[id] = CLASSES37.index(name.label)
            if label is not None and label.name in names:
                fine_of[id] = rows[label.name]
                for other in (label.group, name.label, *label.words):
                    if other in rows and other != label.name:
                        against[rows[label.name], rows[other]] = False
        known = class_of >= 0
        pixels = torch.zeros(len(CLASSES37)).index_add_(0, class_of[known], counts[known])
        share = pixels / pixels.sum().clamp_min(1)
        balance = share.clamp_min(1e-5) ** -RARITY
        balance = balance / (balance * share).sum()
        return PhotoTargets(encode(CLASSES37), encode(bank), class_of, fine_of, balance, against, tuple(bank))


@dataclass(frozen=True)
class JointBatch:
    """Photos, and one room of two views or None."""

    photos: LabelledBatch
    rooms: SceneBatch | None

    @property
    def seeds(self) -> tuple[int | str, ...]:
        """Names of the photos, and the room's seed."""
        return self.photos.names + (() if self.rooms is None else self.rooms.seeds)

    def to(self, device: str | torch.device) -> "JointBatch":
        return JointBatch(self.photos.to(device), None if self.rooms is None else self.rooms.to(device))


@dataclass
class JointSet:
    """Photos at every step, a room at every `every`-th; None: photos alone."""

    photos: LivePhotos
    rooms: RoomSet | None
    every: int = 2
    _step: int = 1

    def __len__(self) -> int:
        return len(self.photos) + (0 if self.rooms is None else len(self.rooms))

    def draw(self, count: int, views: int, generator: torch.Generator) -> JointBatch:
        """`count` photos; `views` says nothing."""
        turn = self._step % self.every == 1 % self.every
        room = self.rooms.draw(1, 2, generator) if self.rooms is not None and turn else None
        return JointBatch(self.photos.draw(count, generator), room)

    def seek(self, step: int) -> None:
        """What is drawn next is for this step, from 1."""
        self._step = step


def late_stage(targets: PhotoTargets, names: Names, teacher: Teacher) -> Stage:
    """The late halves, whole, and their teacher (the network's `teacher` while this lasts)."""
    return Stage(
        "late_whole", (*HALVES, "teacher"), (), {1: 1.0}, 8, 1e-3,
        lambda network, batch, words: _taught(guided(network), teacher, batch, words, targets, names),
        rates=RATES,
    )  # fmt: skip


def heads_stage(targets: PhotoTargets) -> Stage:
    """What reads the late halves, bound to what the photos are called."""
    return Stage(
        "late_heads", HEADS, (), {1: 1.0}, 8, 6e-4,
        lambda network, batch, words: _loss(guided(network), batch, words, targets), rates=RATES,
    )  # fmt: skip


def _taught(
    network: GuidedDepthNet,
    teacher: Teacher,
    batch: JointBatch,
    words: Words,
    targets: PhotoTargets,
    names: Names,
) -> Loss:
    photos, generator = batch.photos, words.generator
    tokens = network.encode(photos.images, photos.Ks)
    total, told = teacher.loss(tokens, photos.ids, targets.rows, photos.depths, names, generator)
    if batch.rooms is None:
        return Loss(total, told)
    room = batch.rooms
    tokens = network.encode(room.images, room.Ks)
    rows = names.of_room(room.labels[0])
    said, _ = teacher.loss(tokens, room.instances[0], rows, room.depths[0], names, generator)
    return Loss(total + 0.5 * said, told | {"room": float(said.detach())})


def _loss(network: GuidedDepthNet, batch: JointBatch, words: Words, targets: PhotoTargets) -> Loss:
    photos = batch.photos
    with torch.no_grad():
        tokens = network.encode(photos.images, photos.Ks)
    features = network.language_head(thinned(tokens, HIDDEN, words.generator))[:, 0]
    names, told = named_loss(features, photos.ids, targets, words.generator)
    maps = network.monocular_depth(tokens, photos.Ks)
    logs, errors = maps.log_depths.flatten(0, 1).float(), maps.log_errors.flatten(0, 1).float()
    shape, slope = depth_loss(logs, photos.depths), gradient_loss(logs, photos.depths)
    depth = shape + 0.5 * slope + 0.05 * error_loss(logs, errors, photos.depths)
    total, told = names + 2 * depth, told | {"photos_shape": float(shape.detach())}
    if batch.rooms is None:
        return Loss(total, told)
    room = batch.rooms
    said, seen = language_stage(network, room, words), depth_stage(network, room, words)
    told |= {"phrases": float(said.total.detach()), "shape": seen.parts["shape"]}
    return Loss(total + 0.5 * said.total + 2 * seen.total, told)


def named_loss(
    features: Tensor, ids: Tensor, targets: PhotoTargets, generator: torch.Generator
) -> tuple[Tensor, dict[str, float]]:
    """Cross-entropy among the classes, and half of that among fine names, each with a quarter of
    attraction 1 - cos, which keeps features in the texts' own space.

    Args:
        features: (B, C, h, w), unit norm. ids: (B, H, W).
    """
    units = features.permute(0, 2, 3, 1).flatten(0, 2)
    own = (
        nearest(ids, (features.shape[-2], features.shape[-1])).flatten().cpu()
    )  # drawn where the generator is
    texts, names = targets.classes.to(units), targets.fine.to(units)
    classes, fine = targets.class_of[own], targets.fine_of[own]
    drawn = (classes >= 0).nonzero()[:, 0]
    drawn = drawn[torch.randperm(len(drawn), generator=generator)[:CLASS_PIXELS]]
    rows = classes[drawn].to(units.device)
    weights = targets.balance.to(units)[rows]
    each = F.cross_entropy(TEMPERATURE * units[drawn] @ texts.T, rows, reduction="none")
    by_class = (each * weights).sum() / weights.sum().clamp_min(1e-6)
    near = _attraction(units[drawn], texts[rows])
    chosen = evenly_drawn(fine, FINE_PIXELS, generator)
    rows = fine[chosen].to(units.device)
    silent = ~targets.against.to(units.device)[rows]
    logits = (TEMPERATURE * units[chosen] @ names.T).masked_fill(silent, -1e4)
    by_name = F.cross_entropy(logits, rows, reduction="sum") / max(len(rows), 1)
    total = by_class + 0.5 * by_name + 0.25 * (near + _attraction(units[chosen], names[rows]))
    return total, {"classes": float(by_class.detach()), "names": float(by_name.detach())}


def _attraction(units: Tensor, texts: Tensor) -> Tensor:
    return (1 - (units * texts).sum(-1)).sum() / max(len(units), 1)


@dataclass(frozen=True)
class KeptPhotos:
    """Judges a network by photos that it does not learn from: 37 classes by argmax over 2D features
    (accuracy, mIoU), and depth up to scale (AbsRel, delta < 1.25)."""

    photos: LivePhotos
    targets: PhotoTargets
    device: str = "cpu"

    def __call__(self, network: LangFlashNet) -> dict[str, float]:
        counts = torch.zeros(len(CLASSES37), len(CLASSES37), dtype=torch.int64)
        rel: list[float] = []
        near: list[float] = []
        for photo in self.photos.photos:
            view = fitted(photo, SIZES[0])
            images, Ks = (
                view.rgb[None, None].to(self.device).float() / 255,
                view.K[None, None].to(self.device),
            )
            with mixed_precision(self.device):
                tokens = network.encode(images, Ks)
                features = network.language(tokens, images)[0].float().cpu()
                depth = guided(network).monocular_depth(tokens, Ks).depths[0, 0].float().cpu()
            said = torch.einsum("gc,vchw->vghw", self.targets.classes, features)
            best = resize(said, (view.labels.shape[0], view.labels.shape[1]))[0].argmax(0)
            counts += confusion(best.flatten(), self.targets.class_of[view.labels].flatten(), len(counts))
            if bool((view.depths > 0).any()):
                aligned = align_scale(depth, view.depths)
                rel.append(abs_rel(aligned, view.depths))
                near.append(delta1(aligned, view.depths))
        return {
            "classes_accuracy": accuracy(counts),
            "classes_miou": mean_iou(counts),
            "abs_rel": nan_mean(rel),
            "delta1": nan_mean(near),
        }


def train_late(
    network: LangFlashNet,
    targets: PhotoTargets,
    joint: JointSet,
    words: Words,
    run_dir: Path,
    options: LoopOptions,
    validate: Validate | None = None,
) -> LoopState:
    """Train whole late blocks, cut them, train what reads them: `RUN/late.pt` is what later stages and
    `train export` read, `RUN/late_whole.pt` and `RUN/late_heads.pt` what a run goes on from."""
    net = guided(network)
    labels = joint.rooms.labels() if joint.rooms is not None else []
    names = Names.of(targets.names, targets.against, targets.balance, labels)
    teacher = Teacher(net.late.preset, len(names.texts))
    net.begin_halves()
    make_whole(net)
    net.teacher = teacher
    first = replace(options, minutes=LATE_SHARE * options.minutes)
    rarely = replace(joint, every=ROOMS_EVERY)
    train_stage(net, late_stage(targets, names, teacher), rarely, words, run_dir, first)
    del net.teacher
    hand_over(teacher.cpu(), net.language_head.cpu(), targets.classes)
    for name in HALVES:
        soften(getattr(net, name), net.encoder.vit)
    make_cut(net, pictures(joint.photos.photos))
    second = replace(options, minutes=options.minutes - first.minutes)
    state = train_stage(net, heads_stage(targets), joint, words, run_dir, second, validate)
    save_cut(run_dir / "late.pt", net, replace(heads_stage(targets), name="late", modules=MODULES), state)
    return state
