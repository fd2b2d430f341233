"""The stage that teaches the weights what they say themselves of a photo that is looked at better.

What the network says of a photo, of its mirrored self and of a larger picture of it are three opinions, and
their mean is right more often than each. A copy of the weights that a run begins with looks at every photo
mirrored and larger, in its own light; the network, which sees it once and in another light, learns to say the
same: directions, the odds among names, depth where none is known. So photos without a label teach, and
nothing that the weights knew is forgotten, since it is what they teach. Labels count beside that.

Sizes: B photos, H W pixels, h w pixels of the language map, P drawn pixels, N names, C channels.

Source: Furlanello et al. 2018 (born again); Radosavovic et al. 2018 (data distillation: flips and sizes).
"""

from copy import deepcopy
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.training.bank import NameBank
from langflash_core.lab.training.fewlabels import (
    HIDDEN,
    TEMPERATURE,
    FewBatch,
    log_depths,
    mirrored,
    odds_apart,
    read,
    room_loss,
    told_loss,
    units_at,
)
from langflash_core.lab.training.losses import depth_loss, error_loss, gradient_loss
from langflash_core.lab.training.pool import DrawnPhotos
from langflash_core.lab.training.real import MODULES
from langflash_core.lab.training.stages.language import thinned
from langflash_core.lab.training.stages.stage import Loss, Stage, Words, guided
from langflash_core.network.encoders.late import with_taught
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.guided import GuidedDepthNet

RATES = {"late": 0.25, "deep": 0.25, "language_head": 0.5, "decoder": 0.75, "depth_head": 0.75}
"""Of the stage's rate, which is low: at ten times as much the classes are lost at once (MEASURED.md)."""
PIXELS = 8000
"""Drawn from all photos of a step."""


@dataclass(frozen=True)
class Weights:
    """What each part of a step's loss counts: direction and odds that the copy says, classes and names of
    labels, depth that the copy says beside true depth, rooms."""

    direction: float = 2.0
    classes: float = 1.0
    names: float = 0.5
    labels: float = 0.2
    said_depth: float = 0.7
    rooms: float = 0.5


class Copy:
    """What names photos and tells their depth, as it was when a run began; nothing of it learns."""

    def __init__(self, network: GuidedDepthNet):
        self.encoder = network.encoder
        parts = (network.late, network.deep, network.language_head, network.decoder, network.depth_head)
        self.late, self.deep, self.head, self.decoder, self.depth_head = (
            deepcopy(part).eval().requires_grad_(False) for part in parts
        )

    @torch.no_grad()
    def looks(self, images: Tensor, Ks: Tensor) -> tuple[Tensor, Tensor]:
        """Unit features (B, C, h, w) and log depths (B, H, W) of photos (B, 1, 3, H, W)."""
        tokens, early = self.encoder(images)
        tokens = with_taught(tokens, early, self.encoder.vit, self.late, self.deep)
        return self.head(tokens)[:, 0].float(), log_depths(self.decoder, self.depth_head, tokens, Ks)

    def says(self, photos: DrawnPhotos) -> tuple[Tensor, Tensor]:
        """The mean of two looks, at the photo's mirrored self and at its larger picture: unit vectors
        (B, h, w, C), log depths (B, H, W).

        Raises:
            ValueError: the photos were drawn without their larger pictures.
        """
        if photos.large is None or photos.large_Ks is None:
            raise ValueError("photos: expected larger pictures beside them, received none")
        features, logs = self.looks(*mirrored(photos.images, photos.Ks))
        features, logs = features.flip(-1), logs.flip(-1)
        more, deeper = self.looks(photos.large, photos.large_Ks)
        more = F.interpolate(more, size=features.shape[-2:], mode="bilinear", align_corners=False)
        deeper = F.interpolate(deeper[:, None], size=logs.shape[-2:], mode="bilinear", align_corners=False)
        return F.normalize(features + more, dim=1).movedim(1, -1), (logs + deeper[:, 0]) / 2


def twice_stage(bank: NameBank, copy: Copy, weights: Weights | None = None) -> Stage:
    """The late halves, whole, and what reads them, taught by a copy of what they were."""
    counts = weights or Weights()
    return Stage(
        "late_twice", MODULES, (), {1: 1.0}, 8, 4e-5,
        lambda network, batch, words: _loss(guided(network), batch, words, bank, copy, counts), rates=RATES,
    )  # fmt: skip


def _loss(
    network: GuidedDepthNet, batch: FewBatch, words: Words, bank: NameBank, copy: Copy, counts: Weights
) -> Loss:
    photos, generator = batch.told, words.generator
    vectors, logs = copy.says(photos)
    tokens = network.encode(photos.relit, photos.Ks)
    hidden, out = read(network, thinned(tokens, HIDDEN, generator)), network.language_head.out
    flat = vectors.flatten(0, 2)
    drawn = torch.randperm(len(flat), generator=generator)[:PIXELS]
    total, told = said_loss(units_at(hidden, out, drawn), flat[drawn.to(flat.device)], bank, counts)
    by_label, parts = told_loss(hidden, out, photos, bank, 1.5, generator)
    depth = _depth(network, tokens, photos, logs, counts.said_depth)
    total, told = total + counts.labels * by_label + depth, told | parts | {"depth": float(depth.detach())}
    if batch.rooms is not None:
        by_room, parts = room_loss(network, batch.rooms, words)
        total, told = total + counts.rooms * by_room, told | parts
    return Loss(total, told)


def said_loss(
    units: Tensor, said: Tensor, bank: NameBank, counts: Weights
) -> tuple[Tensor, dict[str, float]]:
    """Unit vectors (P, C) against those that the copy says: 1 - cosine, and how far the odds lie apart
    among the 37 classes, where rare ones count more, and among all names."""
    classes, names = bank.classes.to(units), bank.vectors.to(units)
    weights = bank.balance.to(units)[(said @ classes.T).argmax(-1)]
    apart = (1 - (units * said).sum(-1)).mean()
    by_class = (odds_apart(units, classes, TEMPERATURE * said @ classes.T) * weights).sum() / weights.sum()
    by_name = odds_apart(units, names, TEMPERATURE * said @ names.T).mean()
    told = {"apart": apart, "said_classes": by_class, "said_names": by_name}
    total = counts.direction * apart + counts.classes * by_class + counts.names * by_name
    return total, {key: float(value.detach()) for key, value in told.items()}


def _depth(
    network: GuidedDepthNet, tokens: Tokens, photos: DrawnPhotos, said: Tensor, share: float
) -> Tensor:
    """True depths of photos that have some, and times `share` what is said of the others."""
    maps = network.monocular_depth(tokens, photos.Ks)
    logs, errors = maps.log_depths.flatten(0, 1).float(), maps.log_errors.flatten(0, 1).float()
    known = (photos.depths > 0).flatten(1).any(1)
    total = logs.sum() * 0
    if bool(known.any()):
        truth = photos.depths[known]
        total = total + depth_loss(logs[known], truth) + 0.5 * gradient_loss(logs[known], truth)
        total = total + 0.05 * error_loss(logs[known], errors[known], truth)
    if not bool(known.all()):
        truth = said[~known].exp()
        total = total + share * (depth_loss(logs[~known], truth) + 0.5 * gradient_loss(logs[~known], truth))
    return total
