"""Real photos for the grouping: what their pixels belong to, by names or by outlines alone.

A scene is one photo seen through two windows in two lights: what lies in both is one group in both, as in two
photos of a room, and no pose is needed to know it.

Sizes: B scenes, H W pixels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.lab.labels.outlines import outlined
from langflash_core.lab.photos import PhotoFolder, chosen_ids
from langflash_core.lab.photos.fitting import drawn_window, fitted
from langflash_core.lab.photos.folder import LabelledPhoto
from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.live import SIZES, relit
from langflash_core.lab.training.photos import regions
from langflash_core.lab.training.shards import NOTHING

WINDOWS = 2
"""Views of a scene."""


@dataclass(frozen=True)
class Outlined:
    """Photos of one folder. share: how often it is drawn from, beside others."""

    folder: PhotoFolder
    ids: tuple[str, ...]
    share: float

    def photo(self, row: int) -> LabelledPhoto:
        """A photo whose labels are instances + 1, 0 = nobody's: connected regions of names, or what was
        outlined."""
        id = self.ids[row]
        if not self.folder.labelled:
            photo = outlined(self.folder, id)
            assert photo.labels is not None, "the folder has maps of every photo"
            return _numbered(photo, photo.labels)
        photo = self.folder.photo(id)
        assert photo.labels is not None, "the folder is labelled"
        instances, _ = regions(torch.from_numpy(photo.labels), self.folder.names)
        return _numbered(photo, (instances.numpy().astype(np.int64) + 1) % (NOTHING + 1))


def _numbered(photo: LabelledPhoto, ids: np.ndarray) -> LabelledPhoto:
    """With these instances; beyond `NOTHING` of them the smallest are nobody's."""
    return LabelledPhoto(photo.id, photo.image, np.where(ids > NOTHING, 0, ids), None, False, photo.K, None)


@dataclass(frozen=True)
class OutlinedSet:
    """Draws scenes of photos of several folders."""

    folders: tuple[Outlined, ...]

    def __len__(self) -> int:
        return sum(len(one.ids) for one in self.folders)

    def part(self, number: int, count: int) -> "OutlinedSet":
        """That of one of so many batches of a step."""
        parts = (Outlined(one.folder, one.ids[number::count] or one.ids, one.share) for one in self.folders)
        return OutlinedSet(tuple(parts))

    def draw(self, count: int, views: int, generator: torch.Generator) -> SceneBatch:
        """Scenes of `count` pictures together, at one random size, fewer at a larger one; `views` says
        nothing."""
        size = SIZES[int(torch.randint(len(SIZES), (1,), generator=generator))]
        scenes = max(1, round(count / WINDOWS * SIZES[0][0] * SIZES[0][1] / (size[0] * size[1])))
        shares = torch.tensor([one.share for one in self.folders])
        images, instances, lenses, seeds = [], [], [], []
        for number in torch.multinomial(shares, scenes, replacement=True, generator=generator).tolist():
            one = self.folders[number]
            row = int(torch.randint(len(one.ids), (1,), generator=generator))
            seeds.append(row)
            views_of = _windows(one.photo(row), size, generator)
            images.append(torch.stack([rgb for rgb, _, _ in views_of]))
            instances.append(torch.stack([ids for _, ids, _ in views_of]))
            lenses.append(torch.stack([K for _, _, K in views_of]))
        ids = torch.stack(instances)
        return SceneBatch(
            images=torch.stack(images).float() / 255,
            depths=torch.zeros(ids.shape),
            instances=torch.where(ids == 0, NOTHING, ids - 1),
            viewmats=torch.eye(4).expand(scenes, WINDOWS, 4, 4),
            Ks=torch.stack(lenses),
            tokens=None,
            labels=((),) * scenes,
            seeds=tuple(seeds),
            partly=True,
        )


def _windows(
    photo: LabelledPhoto, size: tuple[int, int], generator: torch.Generator
) -> list[tuple[Tensor, Tensor, Tensor]]:
    """Picture in some light, instances + 1 and intrinsics, of each window; mirrored alike."""
    seeds = torch.randint(2**31, (WINDOWS,), generator=generator).tolist()
    windows = [drawn_window(photo, size, seed) for seed in seeds]
    views = [fitted(photo, size, window, windows[0][1]) for window, _ in windows]
    return [(relit(view.rgb, generator), view.labels, view.K) for view in views]


def outlined_set(folders: Sequence[PhotoFolder]) -> OutlinedSet:
    """Of each folder what `split` does not keep; folders count by the root of their photos' number.

    Raises:
        InputError: a folder is neither named nor outlined.
    """
    for folder in folders:
        if not folder.labelled and not (folder.root / "labels").is_dir():
            raise InputError(f"{folder.root} is neither named nor outlined; outline it with train outlines")
    rows = [(folder, chosen_ids(folder.ids, "train")) for folder in folders]
    return OutlinedSet(tuple(Outlined(folder, ids, len(ids) ** 0.5) for folder, ids in rows))
