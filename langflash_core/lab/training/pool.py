"""Photos of several sets, read when they are drawn: labelled, labelled in part, or not at all.

Every photo is drawn through another window; rare names make a photo likelier. What the teacher sees is in
the photo's own light, what learns sees it in another.

Sizes: B photos, H W pixels.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor

from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.fitting import FittedPhoto, drawn_window, fitted
from langflash_core.lab.photos.folder import LabelledPhoto
from langflash_core.lab.training.bank import NameBank, NamedSet, Shown
from langflash_core.lab.training.live import SIZES, relit, weathered

RARER = 0.5
"""A photo is drawn by (how many photos show its rarest name)^-RARER."""
WHOLE = 0.5
"""A set of whose pixels at least this share has a name is labelled; others are in part, or not at all."""


@dataclass(frozen=True)
class DrawnPhotos:
    """images and relit (B, 1, 3, H, W) in [0, 1], own light and another; classes and names (B, H, W) rows of
    the bank, -1 = unknown; sets (B,): which set each is of; depths (B, H, W) metres, 0 = unknown; Ks
    (B, 1, 3, 3); opinions (B, H, W) of another network, -1 = none; seeds (B): of the photos.

    Drawn, they are whole numbers of one and two bytes, which processes pass on; `to` makes them these."""

    images: Tensor
    relit: Tensor
    classes: Tensor
    names: Tensor
    sets: Tensor
    depths: Tensor
    Ks: Tensor
    opinions: Tensor
    seeds: tuple[str, ...] = ()

    def to(self, device: str | torch.device) -> "DrawnPhotos":
        own = {field.name: getattr(self, field.name) for field in fields(self)}
        moved = {
            name: _whole(values.to(device)) for name, values in own.items() if isinstance(values, Tensor)
        }
        return replace(self, **moved)


def _whole(values: Tensor) -> Tensor:
    if values.dtype == torch.uint8:
        return values.float() / 255
    return values.long() if values.dtype == torch.int16 else values


@dataclass(frozen=True)
class PhotoSet:
    """Photos of one folder that are learned from. share: how often it is drawn from, beside other sets;
    chances (n,): of its photos; held: photos in memory, by place (others are read when they are drawn)."""

    folder: PhotoFolder
    ids: tuple[str, ...]
    share: float
    named: NamedSet
    chances: Tensor
    held: tuple[LabelledPhoto, ...] = ()

    @staticmethod
    def of(folder: PhotoFolder, ids: Sequence[str], share: float, *, hold: bool = False) -> "PhotoSet":
        """All labels are read once, to count what they show.

        Raises:
            InputError: a photo or its labels cannot be used.
        """
        held = tuple(folder.photo(id) for id in ids) if hold else ()
        shown = [Shown.of(folder.labels(id)) for id in ids] if folder.labelled else []
        named = NamedSet(folder.names, shown)
        return PhotoSet(folder, tuple(ids), share, named, _chances(shown, len(ids)), held)

    def photo(self, row: int) -> LabelledPhoto:
        """One photo."""
        return self.held[row] if self.held else self.folder.photo(self.ids[row])


def _chances(shown: Sequence[Shown], count: int) -> Tensor:
    if not shown:
        return torch.ones(count)
    photos_of = Counter(id for photo in shown for id in photo.seen)
    rarest = [min((photos_of[id] for id in photo.seen), default=len(shown)) for photo in shown]
    return torch.tensor(rarest, dtype=torch.float32) ** -RARER


def labelled_share(photos: PhotoSet) -> float:
    """Share of the pixels of a set that have a name."""
    shown = photos.named.shown
    return sum(sum(one.pixels.values()) / one.size for one in shown) / max(len(shown), 1)


@dataclass(frozen=True)
class PhotoPool:
    """Some of the sets that a bank knows. numbers: their places in it; strong: their other light is always
    that of another camera, and they keep their own beside it."""

    sets: tuple[PhotoSet, ...]
    numbers: tuple[int, ...]
    bank: NameBank
    strong: bool = False

    def __len__(self) -> int:
        return sum(len(one.ids) for one in self.sets)

    def draw(self, count: int, generator: torch.Generator) -> DrawnPhotos:
        """`count` photos at one random size; fewer at a larger one."""
        size = SIZES[int(torch.randint(len(SIZES), (1,), generator=generator))]
        count = max(1, min(count, round(count * SIZES[0][0] * SIZES[0][1] / (size[0] * size[1]))))
        shares = torch.tensor([one.share for one in self.sets])
        drawn = torch.multinomial(shares, count, replacement=True, generator=generator).tolist()
        rows = [int(torch.multinomial(self.sets[s].chances, 1, generator=generator)) for s in drawn]
        seeds = torch.randint(2**31, (count,), generator=generator).tolist()
        photos = [self.sets[s].photo(row) for s, row in zip(drawn, rows, strict=True)]
        windows = [drawn_window(photo, size, seed) for photo, seed in zip(photos, seeds, strict=True)]
        views = [fitted(photo, size, *window) for photo, window in zip(photos, windows, strict=True)]
        light: Callable = weathered if self.strong else relit
        other = torch.stack([light(view.rgb, generator) for view in views])[:, None]
        numbers = [self.numbers[s] for s in drawn]
        return DrawnPhotos(
            _pictures(views),
            other,
            _looked_up(views, [self.bank.class_of[n] for n in numbers]),
            _looked_up(views, [self.bank.name_of[n] for n in numbers]),
            torch.tensor(numbers),
            torch.stack([view.depths for view in views]),
            _lenses(views),
            torch.stack([view.opinions for view in views]).short(),
            tuple(f"{self.sets[s].folder.root.name}/{p.id}" for s, p in zip(drawn, photos, strict=True)),
        )


def _pictures(views: Sequence[FittedPhoto]) -> Tensor:
    return torch.stack([view.rgb for view in views])[:, None]


def _lenses(views: Sequence[FittedPhoto]) -> Tensor:
    return torch.stack([view.K for view in views])[:, None]


def _looked_up(views: Sequence[FittedPhoto], tables: Sequence[Tensor]) -> Tensor:
    """Rows (B, H, W) by each photo's own table."""
    return torch.stack([table[view.labels] for view, table in zip(views, tables, strict=True)]).short()
