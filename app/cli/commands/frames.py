"""`langflash frames`: the frames of a film that a scene is made of, as photos in a folder."""

import io
import json
import os
import shutil
from argparse import Namespace
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from PIL import Image

from langflash_core.base.files import (
    check_folder,
    check_output_file,
    filled_atomically,
    make_folder,
    write_atomically,
)
from langflash_core.base.picture_files import opened_picture
from langflash_core.errors import OutputError
from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.images.still_names import is_still, shown_name
from langflash_core.images.strip import Choice, Strip, choose, notes_on

from ..films import look_through, sentence, summary
from ..report import ProgressBar, say_warnings, tell

INDEX = "frames.json"


def run(args: Namespace, out: TextIO) -> None:
    """Look through the film, choose, and write a folder that is whole or as it was."""
    _check_output(args)
    with ProgressBar() as progress:
        strip = look_through(args.film, progress, start=args.start, end=args.end, every=args.every)
        choice = choose(strip, args.most or PHOTO_LIMITS.film_photos)
        progress("writing", 1.0)
        document = _document(args.output, strip, choice)
        with filled_atomically(args.output) as folder:
            for index in choice.chosen:
                shutil.copyfile(strip.path(index), folder / strip.stills[index].file)
            write_atomically(folder / INDEX, (json.dumps(document, indent=2) + "\n").encode())
        if args.sheet is not None:
            _write_sheet(args.sheet, args.output, strip, choice)
            document["sheet"] = str(args.sheet)
    say_warnings(notes_on(strip, choice))
    tell(args, document, [f"{args.output}: {sentence(strip, choice)}"], out)


def _check_output(args: Namespace) -> None:
    folder = args.output
    if os.path.isfile(folder):
        raise OutputError(f"cannot write {folder}: a file of that name is in the way; choose another -o")
    if os.path.isdir(folder):
        foreign = [name for name in sorted(os.listdir(folder)) if not (is_still(name) or name == INDEX)]
        if foreign:
            raise OutputError(f"{folder} holds other files, such as {foreign[0]}; name a new or empty folder")
    check_folder(folder.absolute().parent)
    if args.sheet is not None:
        check_output_file(args.sheet, (".png", ".jpg", ".jpeg"), inputs=(args.film,), option="--sheet")


def _document(folder: Path, strip: Strip, choice: Choice) -> dict[str, Any]:
    """For programs; frames in order of time."""
    frames, before = [], None
    for index in choice.chosen:
        still = strip.stills[index]
        moved = None if before is None else round(still.place - before, 4)
        before = still.place
        frames.append(
            {
                "file": still.file,
                "seconds": still.seconds,
                "sharpness": round(still.sharpness, 2),
                "of_sharpest_near": round(float(choice.relative[index]), 3),
                "moved": moved,
            }
        )
    return {"folder": str(folder), **summary(strip, choice), "frames": frames}


def _write_sheet(path: Path, folder: Path, strip: Strip, choice: Choice) -> None:
    """The chosen frames with their times."""
    from langflash_core.export.sheet import contact_sheet, thumbnail

    tiles = []
    for index in choice.chosen:
        file = strip.stills[index].file
        with opened_picture(folder / file) as frame:
            small = thumbnail(np.asarray(frame.convert("RGB")))
        tiles.append((shown_name(file).rpartition("@ ")[2], small))
    stream = io.BytesIO()
    kind = "PNG" if path.suffix.lower() == ".png" else "JPEG"
    Image.fromarray(contact_sheet(tiles)).save(stream, kind)
    make_folder(path.parent)
    write_atomically(path, stream.getvalue())
