"""`langflash lab eval phrases`: what people ask of a real place, right, partly, wrong or missed."""

import io
from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import numpy as np
from PIL import Image, ImageOps

from langflash_core.base.files import check_output_file, make_folder, write_atomically
from langflash_core.base.formats import is_photo
from langflash_core.base.picture_files import opened_picture
from langflash_core.errors import InputError

from ...renderers import open_renderer
from ...report import ProgressBar, write_tables

if TYPE_CHECKING:
    from langflash_core.lab.evaluation.phrases import Place, Shown

PHOTOS = 8
"""Photos of a scene beside the frames that are asked, evenly from the first to the last."""
_OUTLINE = (60, 220, 90)  # of regions
_LIT = np.array((127, 0, 0), dtype=np.uint8)


def phrases(args: Namespace, out: TextIO) -> None:
    """Judge what phrases light in a scene of real frames.

    Raises:
        LangFlashError: frames, place, checkpoint or output cannot be used.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.sheet is not None:
        check_output_file(args.sheet, (".png",), option="--sheet")
    from langflash_core.lab.evaluation.phrases import judge_place, phrases_markdown, read_place, shares
    from langflash_core.pipeline import reconstruct

    place = read_place(args.place)
    frames = _chosen(args.frames, place, args.photos)
    shown: Shown = {}
    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        scene = reconstruct(frames, weights=args.weights, size=args.size, progress=progress)
        views = {path.name: view for view, path in enumerate(map(Path, scene.record.photos))}
        known = {path.stem: (views[path.name], _size(path)) for path in frames if path.name in views}
        verdicts = judge_place(scene, place, known, renderer, progress, shown)
    if args.sheet is not None:
        _write_sheet(args.sheet, shown)
    result = {"shares": shares(verdicts), "phrases": [asdict(one) for one in verdicts]}
    write_tables(args, result, phrases_markdown(place.name, verdicts), out)


def _chosen(folder: Path, place: "Place", photos: int | None) -> list[Path]:
    """The place's own frames, and others evenly from the first to the last, in order.

    Raises:
        InputError: there is no such folder, or it lacks frames of the place.
    """
    if not folder.is_dir():
        raise InputError(f"there is no folder {folder}; name the one with the place's frames")
    frames = sorted(path for path in folder.iterdir() if is_photo(path))
    missing = set(place.frames) - {path.stem for path in frames}
    if missing:
        raise InputError(f"{folder} lacks frames of {place.name}: {', '.join(sorted(missing))}; add them")
    count = min(len(frames), PHOTOS if photos is None else photos)
    some = {frames[row] for row in np.linspace(0, len(frames) - 1, count).round().astype(int)}
    return [path for path in frames if path in some or path.stem in place.frames]


def _size(path: Path) -> tuple[int, int]:
    with opened_picture(path) as picture:
        return ImageOps.exif_transpose(picture).size


def _write_sheet(path: Path, shown: "Shown") -> None:
    """A tile a phrase and frame: what is lit is red, its regions are lined in green. What is not there and
    lights nothing needs none."""
    import cv2

    from langflash_core.export.sheet import contact_sheet

    tiles = []
    for (phrase, frame), (rgb, mask, regions) in shown.items():
        if not (mask.any() or regions.any()):
            continue
        picture = np.where(mask[..., None], rgb // 2 + _LIT, rgb)
        lines, _ = cv2.findContours(regions.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        picture = cv2.drawContours(np.ascontiguousarray(picture), lines, -1, _OUTLINE, 1)
        tiles.append((f"{phrase} ({frame})", picture))
    stream = io.BytesIO()
    Image.fromarray(contact_sheet(tiles)).save(stream, "PNG")
    make_folder(path.parent)
    write_atomically(path, stream.getvalue())
