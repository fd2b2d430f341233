"""What the worker does for the tray and for what must last. Heavy imports wait until they are needed."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from app.window.messages import PairFound
from langflash_core.errors import LangFlashError
from langflash_core.scene.edits import Marks

if TYPE_CHECKING:
    from langflash_core.images.decode import Photo
    from langflash_core.types import Scene


def look_at(photo: "Photo") -> tuple[float | None, tuple[str, ...]]:
    """The recorded field of view of the longer side in degrees, if any, and the triage notes."""
    import math

    import numpy as np
    import torch

    from langflash_core.images.lens import exif_focal
    from langflash_core.images.triage import photo_notes

    focal = exif_focal(photo)
    side = max(photo.width, photo.height)
    fov = None if focal is None else 2 * math.degrees(math.atan(side / (2 * focal)))
    small = photo.image.copy()
    small.thumbnail((256, 256))  # about what the network sees
    image = torch.from_numpy(np.array(small, dtype=np.float32)).permute(2, 0, 1) / 255
    return fov, tuple(photo_notes(photo, image))


def keep_copy(scene: "Scene", path: Path, marks: Marks | None = None) -> None:
    """Write a scene where a crash cannot take it, as `marks` edit it.

    Raises:
        OutputError: the folder cannot be written.
    """
    from langflash_core.files import make_folder
    from langflash_core.scene.edited import edited_scene
    from langflash_core.scene.file import save

    make_folder(path.parent)
    save(scene if marks is None else edited_scene(scene, marks), path)


def find_pair(paths: tuple[Path, ...], cancelled: Callable[[], bool]) -> PairFound:
    """The best two of `paths`."""
    from langflash_core.pipeline import best_pair

    try:
        return PairFound(paths, best_pair(paths, cancelled=cancelled))
    except LangFlashError as error:
        return PairFound(paths, None, str(error))
