"""The stage that learns what a second network's maps mean in the language space: `train second`.

The network itself stays as it is, so that its maps of every photo are found once and pixels of all photos
are drawn from them. One layer reads them and learns alone what they are called among the 37 classes, all
names that the photos' sets have and the phrases of rendered rooms, as L(x) did, in the texts' own space.
Whoever learned beside the first network, which knows the learned photos by heart, would be heard too little.
Rendered rooms lose by it nevertheless (MEASURED.md).

Sizes: P pixels, F channels of the maps, V views.

Vectors as long as they like name a few more classes (.375 instead of .370 beside L(x)), but leave the texts'
space: what is there is told from what is not less surely than without them (MEASURED.md).

Source: adding log odds of two that err independently is Bayes' rule.
"""

import logging
from dataclasses import dataclass, replace

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.errors import InputError
from langflash_core.lab.photos.fitting import fitted
from langflash_core.lab.training.bank import MIN_PHOTOS, NameBank
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.fewlabels import class_loss, name_loss
from langflash_core.lab.training.live import SIZES
from langflash_core.lab.training.losses import language_loss
from langflash_core.lab.training.measures import accuracy, confusion, mean_iou
from langflash_core.lab.training.pool import WHOLE, PhotoPool, labelled_share
from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.stages.language import phrase_bank
from langflash_core.lab.training.stages.pixels import balanced_pixels, nearest
from langflash_core.lab.training.stages.stage import Loss, Stage, Words, as_numbers, guided
from langflash_core.network.encoders.deeplab import CHANNELS, DeepLab
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet

log = logging.getLogger(__name__)

NAME = "second"
"""Of the stage, under which a run keeps it."""
MODULES = ("second_head", "deeplab")
NAMES, PHRASES = 0.5, 0.5
"""What names, and phrases of rooms, count beside classes."""
PIXELS = 1500
"""Named pixels of a photo, at most."""
PARTLY_PIXELS = 150
"""Of a photo that is labelled in part."""
ROOM_PIXELS = 300
"""Of a picture of a room."""
DRAWN = 750
"""Of a step, for each of its pictures."""
GRID = 3.5
"""Pixels of a photo to one of the maps along a side: four to a patch, as L(x) has them."""


@dataclass(frozen=True)
class RoomPixels:
    """Pixels of rendered rooms: maps (P, F); things (P,): which of the labels each shows."""

    maps: Tensor
    things: Tensor
    labels: tuple[Label, ...]

    @staticmethod
    @torch.inference_mode()
    def of(deeplab: DeepLab, rooms: RoomSet, words: Words) -> "RoomPixels":
        """The second network looks at two views of every room once; pixels are drawn class-balanced."""
        maps, things, at = [], [], {}
        for room in rooms.walk(1, views=2):
            labels = room.labels[0]
            row_of = torch.tensor([at.setdefault(label, len(at)) for label in labels])
            balance = words.sampler.balance(labels)
            for image, ids in zip(room.images[0], room.instances[0], strict=True):
                found = _maps(deeplab, image)
                small = nearest(ids, (found.shape[-2], found.shape[-1]))
                drawn = balanced_pixels(small, balance, ROOM_PIXELS, words.generator)
                maps.append(found.flatten(1).T[drawn.to(found.device)].half().cpu())
                things.append(row_of[small.flatten()[drawn]])
        log.info("%d rooms looked at", len(rooms))
        return RoomPixels(torch.cat(maps), torch.cat(things), tuple(at))

    def draw(self, count: int, generator: torch.Generator) -> "RoomPixels":
        """Some pixels."""
        rows = torch.randint(len(self.things), (count,), generator=generator)
        return RoomPixels(self.maps[rows], self.things[rows], self.labels)


@dataclass(frozen=True)
class PixelBatch:
    """maps (P, F); classes and names (P,) rows of a bank, -1 = none; sets (P,): which set each is of; rooms:
    others of rooms, or None. Drawn, the first half has classes, the other names."""

    maps: Tensor
    classes: Tensor
    names: Tensor
    sets: Tensor
    rooms: RoomPixels | None = None

    @property
    def seeds(self) -> tuple[int | str, ...]:
        """Rows of the classes, for the log of a step that failed."""
        return tuple(self.classes[:8].tolist())

    def to(self, device: str | torch.device) -> "PixelBatch":
        rooms = self.rooms
        if rooms is not None:
            rooms = RoomPixels(rooms.maps.to(device).float(), rooms.things, rooms.labels)
        classes, names, sets = (part.to(device) for part in (self.classes, self.names, self.sets))
        return PixelBatch(self.maps.to(device).float(), classes, names, sets, rooms)

    def at(self, rows: Tensor | slice) -> "PixelBatch":
        """Some pixels."""
        return PixelBatch(self.maps[rows], self.classes[rows], self.names[rows], self.sets[rows])


class PixelSet:
    """Named pixels of all photos, from which those of a step are drawn; maps in half precision, 512 bytes
    each."""

    def __init__(self, table: PixelBatch, rooms: RoomPixels | None = None):
        self.table, self.rooms = table, rooms
        self._classed = (table.classes >= 0).nonzero()[:, 0]
        counts = torch.bincount(table.names.clamp_min(-1) + 1)[1:]
        self._by_name = table.names.argsort(stable=True)[len(table.names) - int(counts.sum()) :]
        self._shown = counts.nonzero()[:, 0]
        self._counts, self._starts = counts, counts.cumsum(0) - counts

    @staticmethod
    @torch.inference_mode()
    def of(
        deeplab: DeepLab, pool: PhotoPool, generator: torch.Generator, rooms: RoomPixels | None = None
    ) -> "PixelSet":
        """The second network looks at every photo once, as it is.

        Raises:
            InputError: a photo or its labels cannot be used.
        """
        most_of = [PIXELS if labelled_share(one) >= WHOLE else PARTLY_PIXELS for one in pool.sets]
        room = sum(most * len(one.ids) for most, one in zip(most_of, pool.sets, strict=True))
        classes, names, sets = torch.empty(3, room, dtype=torch.int64)
        # At once: pieces between what a look takes would keep memory from its reuse.
        table = PixelBatch(torch.empty(room, CHANNELS, dtype=torch.float16), classes, names, sets)
        filled = 0
        for one, number, most in zip(pool.sets, pool.numbers, most_of, strict=True):
            for row in range(len(one.ids)):
                view = fitted(one.photo(row), SIZES[0])
                maps = _maps(deeplab, view.rgb.float() / 255)
                ids = nearest(view.labels, (maps.shape[-2], maps.shape[-1])).flatten()
                of_class, of_name = pool.bank.class_of[number][ids], pool.bank.name_of[number][ids]
                known = ((of_class >= 0) | (of_name >= 0)).nonzero()[:, 0]
                drawn = known[torch.randperm(len(known), generator=generator)[:most]]
                own = slice(filled, filled + len(drawn))
                filled = own.stop
                table.maps[own] = maps.flatten(1).T[drawn.to(maps.device)].cpu()
                table.classes[own], table.names[own] = of_class[drawn], of_name[drawn]
                table.sets[own] = number
            log.info("%s: %d photos looked at", one.folder.root.name, len(one.ids))
        return PixelSet(table.at(slice(filled)), rooms)

    def __len__(self) -> int:
        return len(self.table.classes)

    def check(self) -> None:
        """
        Raises:
            InputError: there is nothing to draw.
        """
        if not len(self._classed) or not len(self._shown):
            raise InputError(
                f"the photos show none of the 37 classes, or no name that {MIN_PHOTOS} of them show; give "
                "more labelled photos"
            )

    def draw(self, count: int, views: int, generator: torch.Generator) -> PixelBatch:
        """`count` times `DRAWN` pixels, half of them as classes come, half of all names alike."""
        each = count * DRAWN // 2
        by_class = self._classed[torch.randint(len(self._classed), (each,), generator=generator)]
        name = self._shown[torch.randint(len(self._shown), (each,), generator=generator)]
        inside = (torch.rand(each, generator=generator) * self._counts[name]).long()
        by_name = self._by_name[self._starts[name] + inside]
        drawn = self.table.at(torch.cat((by_class, by_name)))
        return drawn if self.rooms is None else replace(drawn, rooms=self.rooms.draw(each, generator))


@dataclass(frozen=True)
class KeptPixels:
    """Judges the layer alone by named pixels of photos that it does not learn from: the 37 classes."""

    pixels: PixelSet
    bank: NameBank

    @torch.inference_mode()
    def __call__(self, network: LangFlashNet) -> dict[str, float]:
        head, table = guided(network).second_head, self.pixels.table
        texts, device = self.bank.classes, head.weight.device
        said = [
            (head(maps.to(device).float()).cpu() @ texts.T).argmax(-1) for maps in table.maps.split(100_000)
        ]
        counts = confusion(torch.cat(said), table.classes, len(texts))
        return {"classes_accuracy": accuracy(counts), "classes_miou": mean_iou(counts)}


def second_stage(bank: NameBank) -> Stage:
    """The layer that reads the second network, which itself learns nothing."""
    return Stage(
        NAME, MODULES, (), {1: 1.0}, 8, 2e-3,
        lambda network, batch, words: _loss(guided(network), batch, words, bank), rates={"deeplab": 0.0},
    )  # fmt: skip


def _loss(network: GuidedDepthNet, batch: PixelBatch, words: Words, bank: NameBank) -> Loss:
    head, half = network.second_head, len(batch.classes) // 2
    units = head(batch.maps).float()
    by_class = class_loss(units[:half], batch.classes[:half], bank)
    by_name = name_loss(units[half:], batch.names[half:], batch.sets[half:], bank)
    total = by_class + NAMES * by_name
    if batch.rooms is None:
        return Loss(total, as_numbers(classes=by_class, names=by_name))
    by_phrase = _phrase_loss(head(batch.rooms.maps).float(), batch.rooms, words)
    return Loss(total + PHRASES * by_phrase, as_numbers(classes=by_class, names=by_name, phrases=by_phrase))


def _phrase_loss(units: Tensor, rooms: RoomPixels, words: Words) -> Tensor:
    sampler, texts = words.sampler, words.sampler.table.embeddings.to(units)
    said = sampler.draw([rooms.labels[thing] for thing in rooms.things.tolist()], words.generator)
    bank = phrase_bank(said, words)
    true = sampler.true(rooms.labels)[:, bank][rooms.things]
    return language_loss(
        units, texts[said.to(units.device)], texts[bank.to(units.device)], true=true.to(units.device)
    )


def _maps(deeplab: DeepLab, image: Tensor) -> Tensor:
    """Maps (F, h, w) of one picture (3, H, W) in [0, 1], as many a patch as L(x) has."""
    size = (round(image.shape[-2] / GRID), round(image.shape[-1] / GRID))
    maps = deeplab(image[None].to(deeplab.stem.weight.device))
    return F.interpolate(maps, size, mode="bilinear", align_corners=False)[0]
