"""What `langflash lab eval sharp` judges: photos to make scenes of, and kept photos from between.

Photos are larger than the network's grid, and compared at their own size (`sharp_size`).
"""

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.images.decode import read_photo
from langflash_core.images.lens import Intrinsics
from langflash_core.images.pictures import centre_box
from langflash_core.lab.evaluation.bench import files_of
from langflash_core.lab.evaluation.posed import Triple
from langflash_core.lab.photos import LabelledPhoto, PhotoFolder
from langflash_core.lab.photos.folder import lenses_of
from langflash_core.lab.rooms import Pack, RoomRenderer, RoomViews
from langflash_core.lab.training.commands import set_rooms
from langflash_core.surface.settings import LAYERS

_LEFT = re.compile(r"(.+)_left")


@dataclass(frozen=True)
class Subject:
    """Photos to make a scene of: files, or pictures with what is known of them. between: kept from it, with
    a pose; then photos have theirs."""

    name: str
    photos: tuple[Path | LabelledPhoto, ...]
    between: LabelledPhoto | None = None

    @property
    def intrinsics(self) -> tuple[Intrinsics, ...] | None:
        known = [photo for photo in self.photos if not isinstance(photo, Path)]
        return lenses_of(known) if len(known) == len(self.photos) else None

    @contextmanager
    def files(self) -> Iterator[tuple[Path, ...]]:
        """The photos as files; pictures lie in a folder that goes."""
        known = [photo for photo in self.photos if isinstance(photo, LabelledPhoto)]
        with files_of(known) as paths:
            kept = iter(paths)
            yield tuple(photo if isinstance(photo, Path) else next(kept) for photo in self.photos)

    def photo(self, view: int) -> LabelledPhoto:
        """One of the photos, decoded.

        Raises:
            ImageError: it cannot be read.
        """
        known = self.photos[view]
        if isinstance(known, LabelledPhoto):
            return known
        return LabelledPhoto(known.stem, np.asarray(read_photo(known).image))


def sharp_size(photo: tuple[int, int], grid: tuple[int, int]) -> tuple[int, int]:
    """(width, height) at which a photo is compared: of exactly the grid's shape, as large as the photo's crop
    but at most `LAYERS.most_enlarged` times the grid; sizes are (width, height)."""
    left, _, right, _ = centre_box(*photo, grid)
    divisor = math.gcd(*grid)
    columns, rows = grid[0] // divisor, grid[1] // divisor
    steps = min(LAYERS.most_enlarged * divisor, max(1, int((right - left) / columns + 1e-6)))
    return columns * steps, rows * steps


def size_of(photo: LabelledPhoto, grid: tuple[int, int]) -> tuple[int, int]:
    """`sharp_size` of a decoded photo."""
    height, width = photo.image.shape[:2]
    return sharp_size((width, height), grid)


def pair_subjects(photos: Sequence[Path] = ()) -> list[Subject]:
    """Pairs of photos: of files, first and second in turn, of a folder of NAME_left and NAME_right, or, where
    none is given, those that come with the program.

    Raises:
        InputError: they make no pairs, or two of one name.
    """
    if len(photos) == 1 and photos[0].is_dir():
        return _named_pairs(photos[0])
    if not photos:
        return _named_pairs(asset_path("photos"))
    if len(photos) % 2:
        raise InputError(
            f"photos come in pairs, but these are {len(photos)}; give first and second in turn, or one folder"
        )
    pairs = list(zip(photos[::2], photos[1::2], strict=True))
    names = [_pair_name(*pair) for pair in pairs]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two pairs are called {name}; rename the photos of one")
    return [Subject(name, pair) for name, pair in zip(names, pairs, strict=True)]


def _pair_name(first: Path, second: Path) -> str:
    left = _LEFT.fullmatch(first.stem)
    if left and second.stem == f"{left[1]}_right":
        return left[1]
    return f"{first.stem}-{second.stem}"


def _named_pairs(folder: Path) -> list[Subject]:
    by_stem = {path.stem: path for path in sorted(folder.iterdir()) if path.is_file()}
    found = [
        Subject(left[1], (path, by_stem[f"{left[1]}_right"]))
        for stem, path in by_stem.items()
        if (left := _LEFT.fullmatch(stem)) and f"{left[1]}_right" in by_stem
    ]
    if not found:
        raise InputError(f"{folder} holds no photos NAME_left and NAME_right; name pairs so, or give files")
    return found


def posed_subjects(folder: PhotoFolder, triples: Sequence[Triple]) -> Iterator[Subject]:
    """Pairs of a posed folder, and the photo from half-way between."""
    for triple in triples:
        first, between, second = (folder.photo(id) for id in (triple.first, triple.between, triple.second))
        yield Subject(triple.name, (first, second), between)


def room_subjects(
    pack: Pack,
    renderer: RoomRenderer,
    *,
    kind: str = "held_out",
    count: int = 20,
    times: int = LAYERS.most_enlarged,
) -> Iterator[Subject]:
    """Rooms of a set of `lab train cache`, made again from their seeds, `times` as large, with their
    third view as the photo from between.

    Args:
        kind: "held_out" or "validation".
    """
    for staged in set_rooms(pack, renderer, kind, count, times=times):
        first, second, between = (_photo_of(staged.views, view) for view in range(3))
        yield Subject(str(staged.views.seed), (first, second), between)


def _photo_of(views: RoomViews, view: int) -> LabelledPhoto:
    pose = invert_rigid(torch.from_numpy(views.viewmats[view]).double())
    return LabelledPhoto(
        f"{views.seed}_{view}",
        views.images[view],
        depths=views.depths[view].astype(np.float32),
        metric=True,
        K=torch.from_numpy(views.Ks[view]).float(),
        pose=pose,
    )
