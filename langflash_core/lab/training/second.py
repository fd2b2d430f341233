"""The stage that learns what other networks' maps mean in the language space: `train second`.

Those networks stay as they are, so that their maps of every photo are found once and pixels of all photos
are drawn from them. One layer reads them and learns alone what they are called among the 37 classes and all
names that the photos' sets have, and that none of them is "object", "things", "stuff" or "texture", which
phrases are compared with. Whoever learned beside the first network, which knows the learned photos by heart,
would be heard too little. What DeepLab's own scores say counts beside the labels: its 150 names are more
than these photos show, and its odds say more than one name does. Another layer learns to tell photos' pixels
from those of rendered rooms, of which the others know nothing that the first does not. Every fourth photo is
seen as small as rooms are, so that it is not sharpness that tells them apart.

Sizes: P pixels, F channels of the maps, V views.

Vectors as long as they like, with attraction or without, and rooms' phrases beside them, were tried: they
name as many classes, but other words less surely than without them (MEASURED.md).

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
from langflash_core.lab.training.fewlabels import TEMPERATURE, class_loss, name_loss
from langflash_core.lab.training.live import SIZES
from langflash_core.lab.training.measures import accuracy, confusion, mean_iou
from langflash_core.lab.training.pool import WHOLE, PhotoPool, labelled_share
from langflash_core.lab.training.stages.pixels import nearest
from langflash_core.lab.training.stages.stage import Loss, Stage, as_numbers, guided
from langflash_core.network.encoders.others import CHANNELS, SIDE, OtherEyes
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet

log = logging.getLogger(__name__)

NAME = "second"
"""Of the stage, under which a run keeps it."""
MODULES = ("second_head", "others")
NAMES = 0.5
"""What names count beside classes."""
SCORED = 0.5
"""What DeepLab's own names count beside classes."""
PIXELS = 1500
"""Named pixels of a photo, at most."""
PARTLY_PIXELS = 150
"""Of a photo that is labelled in part."""
ROOM_PIXELS = 300
"""Of a picture of a room."""
DRAWN = 750
"""Of a step, for each of its pictures."""
GRID = 3.5
"""Pixels of a photo, as the first network sees it, to one of the maps along a side: four to a patch, as L(x)
has them."""
SMALL = 4
"""Of so many photos one is seen as the first network sees it."""
_SHARP = (SIDE, round(SIDE * SIZES[0][1] / SIZES[0][0]))  # (width, height) at which the others see them


@torch.inference_mode()
def room_pixels(others: OtherEyes, rooms: RoomSet, generator: torch.Generator) -> Tensor:
    """Maps (P, F) of pixels of two views of every room, half precision."""
    maps = []
    for room in rooms.walk(1, views=2):
        for image in room.images[0]:
            found = _maps(others, image, (image.shape[-2], image.shape[-1])).flatten(1).T
            drawn = torch.randperm(len(found), generator=generator)[:ROOM_PIXELS]
            maps.append(found[drawn.to(found.device)].half().cpu())
    log.info("%d rooms looked at", len(rooms))
    return torch.cat(maps)


@dataclass(frozen=True)
class PixelBatch:
    """maps (P, F); classes and names (P,) rows of a bank, -1 = none; sets (P,): which set each is of; rooms:
    maps (R, F) of pixels of rooms, where some are drawn. Then the first half has classes, the other names."""

    maps: Tensor
    classes: Tensor
    names: Tensor
    sets: Tensor
    rooms: Tensor | None = None

    @property
    def seeds(self) -> tuple[int | str, ...]:
        """Rows of the classes, for the log of a step that failed."""
        return tuple(self.classes[:8].tolist())

    def to(self, device: str | torch.device) -> "PixelBatch":
        classes, names, sets = (part.to(device) for part in (self.classes, self.names, self.sets))
        rooms = None if self.rooms is None else self.rooms.to(device).float()
        return PixelBatch(self.maps.to(device).float(), classes, names, sets, rooms)

    def at(self, rows: Tensor | slice) -> "PixelBatch":
        """Some pixels."""
        return PixelBatch(self.maps[rows], self.classes[rows], self.names[rows], self.sets[rows])


class PixelSet:
    """Named pixels of all photos, from which those of a step are drawn, and pixels of rooms (R, F), unnamed;
    maps in half precision, 1,152 bytes each."""

    def __init__(self, table: PixelBatch, rooms: Tensor | None = None):
        self.table, self.rooms = table, rooms
        self._classed = (table.classes >= 0).nonzero()[:, 0]
        counts = torch.bincount(table.names.clamp_min(-1) + 1)[1:]
        self._by_name = table.names.argsort(stable=True)[len(table.names) - int(counts.sum()) :]
        self._shown = counts.nonzero()[:, 0]
        self._counts, self._starts = counts, counts.cumsum(0) - counts

    @staticmethod
    @torch.inference_mode()
    def of(
        others: OtherEyes, pool: PhotoPool, generator: torch.Generator, rooms: Tensor | None = None
    ) -> "PixelSet":
        """The other networks look at every photo once.

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
                photo = one.photo(row)
                view = fitted(photo, SIZES[0])
                sharp = view if row % SMALL == 0 else fitted(photo, _SHARP)
                maps = _maps(others, sharp.rgb.float() / 255, (view.rgb.shape[-2], view.rgb.shape[-1]))
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
        if self.rooms is None:
            return drawn
        return replace(drawn, rooms=self.rooms[torch.randint(len(self.rooms), (each,), generator=generator)])


@dataclass(frozen=True)
class KeptPixels:
    """Judges the layer alone by named pixels of photos that it does not learn from: the 37 classes."""

    pixels: PixelSet
    bank: NameBank

    @torch.inference_mode()
    def __call__(self, network: LangFlashNet) -> dict[str, float]:
        head, table = guided(network).second_head, self.pixels.table
        texts, device = self.bank.classes, head.words.weight.device
        said = [
            (head(maps.to(device).float()).cpu() @ texts.T).argmax(-1) for maps in table.maps.split(100_000)
        ]
        counts = confusion(torch.cat(said), table.classes, len(texts))
        return {"classes_accuracy": accuracy(counts), "classes_miou": mean_iou(counts)}


@dataclass(frozen=True)
class Scored:
    """What DeepLab's own last layer says: weight (N, D) and bias (N,) of its scores, of its maps alone, which
    come first; the first score is for what has no name. texts (N - 1, C): unit vectors of the names."""

    weight: Tensor
    bias: Tensor
    texts: Tensor

    def loss(self, maps: Tensor, units: Tensor) -> Tensor:
        """Cross-entropy of what vectors (P, C) answer among the names against its odds at maps (P, F)."""
        weight, bias, texts = (part.to(maps.device) for part in (self.weight, self.bias, self.texts))
        odds = (maps[:, : weight.shape[1]] @ weight.T + bias).softmax(-1)[:, 1:]
        return -(odds * (TEMPERATURE * units @ texts.T).log_softmax(-1)).sum(1).mean()


def second_stage(bank: NameBank, scored: Scored | None = None) -> Stage:
    """The layers that read the other networks, which themselves learn nothing."""
    return Stage(
        NAME, MODULES, (), {1: 1.0}, 8, 2e-3,
        lambda network, batch, words: _loss(guided(network), batch, bank, scored), rates={"others": 0.0},
    )  # fmt: skip


def _loss(network: GuidedDepthNet, batch: PixelBatch, bank: NameBank, scored: Scored | None) -> Loss:
    head, half = network.second_head, len(batch.classes) // 2
    units = head(batch.maps).float()
    by_class = class_loss(units[:half], batch.classes[:half], bank)
    by_name = name_loss(units[half:], batch.names[half:], batch.sets[half:], bank)
    total, told = by_class + NAMES * by_name, as_numbers(classes=by_class, names=by_name)
    if scored is not None:
        by_score = scored.loss(batch.maps, units)
        total, told = total + SCORED * by_score, told | as_numbers(scored=by_score)
    if batch.rooms is None:
        return Loss(total, told)
    apart = _photo_loss(head.photo_odds(batch.maps).float(), head.photo_odds(batch.rooms).float())
    return Loss(total + apart, told | as_numbers(photos=apart))


def _photo_loss(photos: Tensor, rooms: Tensor) -> Tensor:
    """Cross-entropy of log odds of pixels of both kinds, as if there were as many of each: whoever looks at a
    scene expects neither."""
    return (F.softplus(-photos).mean() + F.softplus(rooms).mean()) / 2


def _maps(others: OtherEyes, picture: Tensor, seen: tuple[int, int]) -> Tensor:
    """Maps (F, h, w) of one picture (3, H, W) in [0, 1], as many a patch as L(x) has where the first network
    sees it at `seen` (height, width)."""
    size = (round(seen[0] / GRID), round(seen[1] / GRID))
    maps = others(picture[None].to(others.deeplab.stem.weight.device))
    return F.interpolate(maps, size, mode="bilinear", align_corners=False)[0]
