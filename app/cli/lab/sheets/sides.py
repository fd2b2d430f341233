"""A sheet of scenes from ever farther aside, by one version of the code or by two beside each other.

The pictures of a version are PNG files of one folder: NUMBER_NAME_DEGREES.png, drawn by `draw_room` and
`draw_pairs`; NUMBER_NAME_true_DEGREES.png is how a room really looks.
"""

import io
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import opened_picture
from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError
from langflash_core.export.png import to_8bit
from langflash_core.export.sheet import captioned
from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.evaluation.side_pictures import SHOWN, room_pictures, scene_pictures
from langflash_core.lab.evaluation.side_subjects import Case
from langflash_core.pipeline import reconstruct
from langflash_core.reconstruction.networks import Networks
from langflash_core.types import Scene

ROOMS = 3
"""So many of the first rooms are shown."""
PAIRS = ("living_room", "desk", "toy")
"""Of the photos that come with the program."""
_HEIGHT = 200  # pixels of one picture
_GAP = 10  # between two angles


def draw_room(folder: Path, number: int, case: Case, scene: Scene, render: Render) -> None:
    """Keep what a room's scene shows, and the truth."""
    drawn, truth = room_pictures(scene, case, render)
    _keep(folder, f"{number}_room", drawn)
    _keep(folder, f"{number}_room_true", truth)


def draw_pairs(folder: Path, render: Render, weights: Path | None = None) -> None:
    """Keep what the scenes of three demo pairs show."""
    networks = Networks()
    for number, name in enumerate(PAIRS, ROOMS):
        photos = [next(asset_path("photos").glob(f"{name}_{side}.*")) for side in ("left", "right")]
        scene = reconstruct(photos, weights=weights, networks=networks)
        _keep(folder, f"{number}_{name}", scene_pictures(scene, render))


def _keep(folder: Path, name: str, pictures: Sequence[Tensor]) -> None:
    make_folder(folder)
    for degrees, picture in zip(SHOWN, pictures, strict=True):
        stream = io.BytesIO()
        Image.fromarray(to_8bit(picture)).save(stream, "PNG")
        write_atomically(folder / f"{name}_{degrees:02d}.png", stream.getvalue())


def side_sheet(folders: Sequence[tuple[str, Path]]) -> Image.Image:
    """A row a scene, an angle after the other; in each the truth where it is known, and the versions.

    Args:
        folders: (what a version is called, its pictures), one or two.

    Raises:
        InputError: the folders have no scene in common.
    """
    names = [{_scene(path) for path in folder.glob("*_00.png")} for _, folder in folders]
    shared = sorted(name for name in set.intersection(*names) if not name.endswith("_true"))
    if not shared:
        raise InputError(f"{folders[0][1]} holds no pictures; make them with eval sides PACK --results")
    bands = [_band(name, folders) for name in shared]
    width = max(band.shape[1] for band in bands)
    return Image.fromarray(
        np.concatenate([np.pad(b, ((0, _GAP), (0, width - b.shape[1]), (0, 0))) for b in bands])
    )


def _scene(path: Path) -> str:
    return re.sub(r"_\d\d$", "", path.stem)


def _band(name: str, folders: Sequence[tuple[str, Path]]) -> np.ndarray:
    sources = list(folders)
    if (folders[0][1] / f"{name}_true_00.png").is_file():
        sources.insert(0, ("truth", folders[0][1]))
    cells = []
    for degrees in SHOWN:
        for title, folder in sources:
            stem = f"{name}_true" if title == "truth" else name
            with opened_picture(folder / f"{stem}_{degrees:02d}.png") as stored:
                size = (round(stored.width * _HEIGHT / stored.height), _HEIGHT)
                picture = np.asarray(stored.convert("RGB").resize(size, Image.Resampling.LANCZOS))
            cells.append(captioned(picture, f"{degrees} degrees, {title}"))
        cells.append(np.zeros((cells[-1].shape[0], _GAP, 3), dtype=np.uint8))
    return np.concatenate(cells, axis=1)
