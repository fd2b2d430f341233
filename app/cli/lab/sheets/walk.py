"""A sheet of walks: frames that were kept, as they are and as scenes of more and more photos show them.

The pictures are PNG files of one folder, WALK_FRAME_TITLE.png: "truth", numbers of photos, "own two".
"""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import opened_picture
from langflash_core.errors import InputError
from langflash_core.export.png import to_8bit
from langflash_core.export.sheet import add_caption
from langflash_core.lab.evaluation.walk import OWN, TRUTH, Shown

MOST = 12
"""So many kept frames are shown."""
_HEIGHT = 260  # pixels of one picture
_GAP = 8  # between two versions


def keeper(folder: Path) -> Shown:
    """Keeps pictures of kept frames in a folder."""

    def shown(name: str, frame: int, title: str, rgb: Tensor) -> None:
        make_folder(folder)
        stream = io.BytesIO()
        Image.fromarray(to_8bit(rgb)).save(stream, "PNG")
        write_atomically(folder / f"{name}_{frame:03d}_{title}.png", stream.getvalue())

    return shown


def walk_sheet(folders: Sequence[tuple[str, Path]]) -> Image.Image:
    """A row a kept frame: the truth, then for each version what its scenes show and what the frame's own two
    photos do.

    Args:
        folders: (what a version is called, its pictures), one or two.

    Raises:
        InputError: the folders have no frame in common.
    """
    end = f"_{TRUTH}.png"
    frames = [{path.name.removesuffix(end) for path in folder.glob(f"*{end}")} for _, folder in folders]
    shared = sorted(set.intersection(*frames))
    if not shared:
        raise InputError(f"{folders[0][1]} holds no pictures; make them with eval walk --results")
    step = max(1, -(-len(shared) // MOST))
    numbers = {path.stem.split("_")[-1] for _, folder in folders for path in folder.glob("*.png")}
    titles = [*sorted((title for title in numbers if title.isdigit()), key=int), OWN]
    bands = [_band(stem, folders, titles) for stem in shared[::step]]
    width = max(band.shape[1] for band in bands)
    return Image.fromarray(
        np.concatenate([np.pad(b, ((0, 0), (0, width - b.shape[1]), (0, 0))) for b in bands])
    )


def _band(stem: str, folders: Sequence[tuple[str, Path]], titles: Sequence[str]) -> np.ndarray:
    """Black where a frame lies beyond the photos of a scene."""
    cells = [_cell(folders[0][1] / f"{stem}_{TRUTH}.png", stem.replace("_", ", frame "))]
    height, width = cells[0].shape[:2]
    for version, folder in folders:
        said = f" ({version})" if len(folders) > 1 else ""
        cells.append(np.zeros((height, _GAP, 3), dtype=np.uint8))
        for title in titles:
            path = folder / f"{stem}_{title}.png"
            name = "its own two photos" if title == OWN else f"{title} photos"
            known = path.is_file()
            cells.append(_cell(path, name + said) if known else np.zeros((height, width, 3), np.uint8))
    return np.concatenate(cells, axis=1)


def _cell(path: Path, title: str) -> np.ndarray:
    with opened_picture(path) as stored:
        size = (round(stored.width * _HEIGHT / stored.height), _HEIGHT)
        return add_caption(np.asarray(stored.convert("RGB").resize(size, Image.Resampling.LANCZOS)), title)
