"""What all judges of scenes share: what scenes are made and drawn with, and photos as scenes saw them.

Sizes: H W pixels.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.images.pictures import centre_box
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.photos import LabelledPhoto
from langflash_core.lab.photos.fitting import FittedPhoto, fitted
from langflash_core.lab.photos.folder import lenses_of
from langflash_core.pipeline import reconstruct
from langflash_core.reconstruction.networks import Networks
from langflash_core.types import NO_LANGUAGE, Camera, Frame, Record, Scene, Semantics

Render = Callable[[Scene, Camera], Frame]


@dataclass(frozen=True)
class Bench:
    """What scenes are made and judged with. render: draws one; weights, preset, size: as `reconstruct` has
    them; lpips: None leaves it out; align: pictures are also judged from poses fitted to them."""

    render: Render
    weights: Path | None = None
    preset: str = "mini"
    size: int | None = None
    lpips: Lpips | None = None
    align: bool = False
    networks: Networks = field(default_factory=Networks, repr=False, compare=False)

    @property
    def made_with(self) -> str:
        """The weights' file, or the preset whose own ones they are."""
        return str(self.weights) if self.weights else self.preset

    @property
    def options(self) -> dict[str, Any]:
        """Of `reconstruct`."""
        return {"weights": self.weights, "preset": self.preset, "size": self.size}

    def scene(self, paths: Sequence[Path], **options: Any) -> Scene:
        """Photos through the whole program. options: more of `reconstruct`."""
        return reconstruct(paths, networks=self.networks, **self.options, **options)

    def scene_of(self, photos: Sequence[LabelledPhoto]) -> tuple[Scene, float]:
        """Photos with their lenses through the whole program, and the seconds that took."""
        with files_of(photos) as paths:
            start = time.perf_counter()
            scene = self.scene(paths, intrinsics=lenses_of(photos))
            return scene, time.perf_counter() - start


@contextmanager
def files_of(photos: Sequence[LabelledPhoto]) -> Iterator[list[Path]]:
    """The photos as files of one folder, which goes."""
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{photo.id}.png" for photo in photos]
        for path, photo in zip(paths, photos, strict=True):
            Image.fromarray(photo.image).save(path, "PNG", compress_level=1)
        yield paths


def as_seen(photo: LabelledPhoto, size: tuple[int, int]) -> FittedPhoto:
    """A photo as those of a scene were cut, whose `view_size` is given."""
    height, width = photo.image.shape[:2]
    return fitted(photo, size, centre_box(width, height, size))


def picture_of(photo: FittedPhoto) -> Tensor:
    """(H, W, 3) in [0, 1]."""
    return photo.rgb.permute(1, 2, 0).float() / 255


def pose_of(photo: LabelledPhoto) -> Tensor:
    """Camera to world (4, 4) float64.

    Raises:
        InputError: the photo has none.
    """
    if photo.pose is None:
        raise InputError(
            f"photo {photo.id} has no line in poses.txt; add it, or take the photo out of the folder"
        )
    return photo.pose.double()


def relative(first: LabelledPhoto, other: LabelledPhoto) -> Tensor:
    """World-to-camera matrix (4, 4) float64 of a photo, world = the first one's camera."""
    return torch.linalg.inv(pose_of(other)) @ pose_of(first)


def as_array(values: Tensor) -> np.ndarray:
    """Float64 on the processor."""
    return values.detach().cpu().double().numpy()


def wordless(scene: Scene) -> Scene:
    """The scene without language, which costs memory and time to draw; of its record what it is drawn by."""
    count = len(scene.gaussians)
    ids = torch.zeros(count, 0, dtype=torch.int64)
    nothing = Semantics(ids, torch.zeros(count, 0), torch.zeros(0, 0), NO_LANGUAGE)
    told = Record(light=scene.record.light, layered=scene.record.layered)
    return replace(scene, semantics=nothing, record=told)
