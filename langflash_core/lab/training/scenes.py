"""Scenes of several posed photos, read where a data set lies, for the stages that learn what things are.

A source is cut into units (a chunk of videos, a scene), of which a batch of a step reads its own alone: of
n batches the k-th reads units k, k + n, ... Processes share the batches, so units are shared by rank, and
what is learned does not depend on how many processes there are. Of each scene some pairs are fixed once and
for all, so that what frozen networks say of them can be kept (`frozen`).

Sizes: B scenes, V views, H W pixels.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Protocol, runtime_checkable

import torch

from langflash_core.errors import InputError
from langflash_core.lab.labels.clips import find_clips
from langflash_core.lab.labels.posed import open_collected
from langflash_core.lab.labels.storage import LABELS
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.photos.fitting import FittedPhoto, fitted, network_size
from langflash_core.lab.photos.published import open_scannet, re10k_scenes, scannet_names
from langflash_core.lab.photos.reading import read_table
from langflash_core.lab.training.batches import SceneBatch, collate
from langflash_core.lab.training.objects import Objects, linked, tracked
from langflash_core.lab.training.photo_names import photo_label
from langflash_core.lab.training.shards import Label, RoomRecord
from langflash_core.network.presets import Preset

PAIRS = 4
"""Of each scene; so many different sets of its photos are ever drawn."""
FRAMES_APART = (15, 60)
"""Of a video, between two views."""
_HELD = 2  # units in memory; a chunk of RealEstate10K takes about 100 MB
_OBJECT = Label("object", "object")


@runtime_checkable
class Scene(Protocol):
    """Photos of one place, with poses."""

    @property
    def key(self) -> str:
        """Its name in the data set."""
        ...

    @property
    def folder(self) -> PhotoFolder:
        """The photos."""
        ...

    def objects(self, views: Sequence[FittedPhoto], viewmats: torch.Tensor) -> Objects:
        """Things in some of the photos, the same number in all views."""
        ...


@dataclass(frozen=True)
class NamedScene:
    """Photos whose pixels are named; things are found by `objects.linked`."""

    key: str
    folder: PhotoFolder

    def objects(self, views: Sequence[FittedPhoto], viewmats: torch.Tensor) -> Objects:
        return linked(views, self.folder.names, viewmats)


@dataclass(frozen=True)
class TrackedScene:
    """Frames of a clip whose things were collected, which have followed them; vectors (M, C), one a thing."""

    key: str
    folder: PhotoFolder
    vectors: torch.Tensor

    def objects(self, views: Sequence[FittedPhoto], viewmats: torch.Tensor) -> Objects:
        maps = torch.stack([view.labels for view in views])
        if int(maps.max()) > len(self.vectors):
            raise InputError(
                f"the labels of {self.key} name thing {int(maps.max())} of {len(self.vectors)}; collect them "
                "again"
            )
        return tracked(maps, self.vectors)


@dataclass(frozen=True)
class SceneSource:
    """units: names; open: the scenes of one; apart: how many photos lie between two neighbours of a draw, at
    least and at most; labels: all that a scene may be called, for the table of phrases."""

    units: tuple[str, ...]
    open: Callable[[str], Sequence[Scene]]
    apart: tuple[int, int]
    labels: tuple[Label, ...] = (_OBJECT,)


def scannet_source(root: Path) -> SceneSource:
    """Scenes as `SensReader` extracts them, or in LSM's layout; a unit each.

    Raises:
        InputError: there is no scene, or no table of names.
    """
    names = scannet_names(root)
    units = tuple(sorted(path.name for path in root.glob("scene*") if path.is_dir()))
    if not units:
        raise InputError(f"{root} holds no scene of ScanNet; give the folder of scene0000_00 and others")
    labels = [photo_label(name) for name in names.values()]
    return SceneSource(
        units,
        lambda unit: [NamedScene(unit, open_scannet(root / unit, names))],
        (1, 2),
        tuple(dict.fromkeys(label for label in labels if label is not None)) or (_OBJECT,),
    )


def re10k_source(root: Path) -> SceneSource:
    """Videos in pixelSplat's chunks, a unit each, of which those with collected labels are read.

    Raises:
        InputError: the index cannot be used.
    """
    index = read_table(root / "index.json")
    chunks = tuple(sorted({str(chunk) for chunk in index.values()}))

    def opened(unit: str) -> Sequence[Scene]:
        keys = {key: chunk for key, chunk in index.items() if str(chunk) == unit}
        scenes = [
            TrackedScene(key, scene, scene.vectors)
            for key, scene in re10k_scenes(root, keys)
            if scene.vectors is not None
        ]
        if not scenes:
            raise InputError(
                f"{root / unit} holds no labels of its videos, without which nothing can be learned of what "
                "things are; collect them with langflash lab labels"
            )
        return scenes

    return SceneSource(chunks, opened, FRAMES_APART)


def clip_source(clips: Path, labelled: Path) -> SceneSource:
    """Posed clips, a unit each, of which those with labels are read.

    Args:
        clips: a clip, or a folder of them. labelled: what `langflash lab labels` wrote of them.

    Raises:
        InputError: there are no clips, or no labels of any.
    """
    places = {
        place.name: place.path for place in find_clips(clips) if (labelled / place.name / LABELS).is_file()
    }
    if not places:
        raise InputError(
            f"{labelled} holds no labels of what lies in {clips}; collect them with langflash lab labels"
        )

    def opened(unit: str) -> Sequence[Scene]:
        folder = open_collected(places[unit], labelled / unit)
        return [TrackedScene(unit, folder, torch.from_numpy(folder.collected.vectors))]

    return SceneSource(tuple(sorted(places)), opened, FRAMES_APART)


def source_at(root: Path, labelled: Path | None = None) -> SceneSource:
    """The source that lies in a folder.

    Args:
        labelled: of clips, what `langflash lab labels` wrote of them.

    Raises:
        InputError: it is of no known layout.
    """
    if labelled is not None:
        return clip_source(root, labelled)
    for place in (root, root / "train"):
        if (place / "index.json").is_file():
            return re10k_source(place)
    if any(root.glob("scene*")):
        return scannet_source(root)
    raise InputError(
        f"{root} holds neither index.json and chunks (RealEstate10K as pixelSplat has it) nor scene* folders "
        "(ScanNet); give one that does, or, of clips, their labels with --labels"
    )


@dataclass(frozen=True)
class SceneSet:
    """Draws pairs, or more views, of scenes of a source, as a network takes them."""

    source: SceneSource
    preset: Preset
    pairs: int = PAIRS
    _opened: Callable[[str], Sequence[Scene]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_opened", lru_cache(_HELD)(self.source.open))

    def part(self, number: int, count: int) -> "SceneSet":
        """That of one of `count` batches; where there are fewer units than batches some share one."""
        units = self.source.units[number % len(self.source.units) :: count]
        return replace(self, source=replace(self.source, units=units))

    def draw(self, count: int, views: int, generator: torch.Generator) -> SceneBatch:
        """`count` random scenes of one random unit, `views` of their photos each.

        Raises:
            InputError: a photo or a map cannot be used.
        """
        units = self.source.units
        scenes = self._opened(units[int(torch.randint(len(units), (1,), generator=generator))])
        picked = torch.randint(len(scenes), (count,), generator=generator).tolist()
        which = torch.randint(self.pairs, (count,), generator=generator).tolist()
        size = self._size(scenes[picked[0]])
        read = [self._record(scenes[s], k, views, size) for s, k in zip(picked, which, strict=True)]
        vectors = tuple(objects.vectors for _, objects in read)
        return replace(collate([record for record, _ in read]), partly=True, vectors=vectors)

    def _size(self, scene: Scene) -> tuple[int, int]:
        """(width, height) of a draw: squares, or the shape of its first photo."""
        if self.preset.square:
            side = round(self.preset.native_area**0.5)
            return side, side
        photo = scene.folder.photo(scene.folder.ids[0])
        return network_size(photo, self.preset.native_area, self.preset.patch)

    def _record(
        self, scene: Scene, pair: int, views: int, size: tuple[int, int]
    ) -> tuple[RoomRecord, Objects]:
        ids = chosen_photos(scene, pair, views, self.source.apart)
        photos = [scene.folder.photo(id) for id in ids]
        poses = torch.stack([torch.eye(4).double() if p.pose is None else p.pose.double() for p in photos])
        viewmats = torch.linalg.inv(poses).float()
        seen = [fitted(photo, size) for photo in photos]
        objects = scene.objects(seen, viewmats)
        record = RoomRecord(
            seed=_seed(scene.key, pair),
            rgb=torch.stack([view.rgb for view in seen]),
            depths=torch.stack([view.depths for view in seen]).half(),
            instances=objects.ids,
            viewmats=viewmats,
            Ks=torch.stack([view.K.float() for view in seen]),
            labels=objects.labels,
        )
        return record, objects


def chosen_photos(scene: Scene, pair: int, views: int, apart: tuple[int, int]) -> list[str]:
    """Ids of the `pair`-th set of photos of a scene, the same ones every time; of a scene too short for the
    distances those that it has."""
    ids, generator = scene.folder.ids, torch.Generator().manual_seed(_seed(scene.key, pair))
    low, high = (min(gap, max(1, (len(ids) - 1) // max(1, views - 1))) for gap in apart)
    gap = int(torch.randint(low, high + 1, (1,), generator=generator))
    first = int(torch.randint(max(1, len(ids) - gap * (views - 1)), (1,), generator=generator))
    chosen = [ids[min(first + gap * n, len(ids) - 1)] for n in range(views)]
    return chosen if int(torch.randint(2, (1,), generator=generator)) else chosen[::-1]


def _seed(key: str, pair: int) -> int:
    return zlib.crc32(f"{key}/{pair}".encode())
