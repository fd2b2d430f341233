"""Scenes that were open lately, as they were left: beside the preferences a record and a small picture each.

A record is a session's (`sessions`) and lies under the digest of its scene's path. A picture names the file
that it is of, by a stamp of size and time, and counts for no other: what somebody hid in that file meanwhile
is not shown by it. What belongs to no scene any more is swept away.
"""

import io
import json
import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageOps

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import opened_picture

from ...places import PICTURE, project_file, projects_folder
from .sessions import DAMAGED, fields, understood
from .state import Kept, Project

SIDES = (270, 180)
"""Of a small picture, pixels: the tile of the empty window, also where the interface is large."""
MOST_BYTES = 10 * 1024  # of a small picture
MOST_RECORD = 2**18  # bytes; some thousand phrases
_QUALITIES = (80, 65, 50, 35, 20, 10)  # of JPEG, until it is small enough
_RECORD = ".json"


def stamp(path: Path) -> str:
    """Another text once the file is another; empty where there is none."""
    try:
        seen = path.stat()
    except (OSError, ValueError):
        return ""
    return f"langflash {seen.st_size} {seen.st_mtime_ns}"


def stamps(path: str) -> tuple[str, str]:
    """Of a scene's file and of its small picture: others once its tile is to show something else."""
    return stamp(Path(path)), stamp(project_file(path, PICTURE))


def keep(kept: Kept, views: int) -> None:
    """Write the record of `kept.scene`, which is made of so many photos; one that is too long is left out.

    Raises:
        OutputError: the folder cannot be written.
    """
    content = json.dumps({"views": views, "session": fields(kept)}).encode()
    if len(content) <= MOST_RECORD:
        _write(kept.scene, _RECORD, content)


def keep_picture(path: str, seen: UInt8[np.ndarray, "H W 3"], stamped: str) -> None:
    """Write the middle of what was seen as the small picture of the file that was so `stamped`; nothing where
    that has become another.

    Raises:
        OutputError: the folder cannot be written.
    """
    if not stamped or stamp(Path(path)) != stamped:
        drop_picture(path)
        return
    small = ImageOps.fit(Image.fromarray(np.ascontiguousarray(seen)), SIDES, Image.Resampling.BOX)
    for quality in _QUALITIES:
        stream = io.BytesIO()
        small.save(stream, "JPEG", quality=quality, comment=stamped.encode())
        if stream.tell() <= MOST_BYTES:
            _write(path, PICTURE, stream.getvalue())
            return
    drop_picture(path)


def read(path: str) -> Project:
    """What is remembered of a scene: its path alone where the record is damaged, another's, or not there."""
    file = project_file(path, _RECORD)
    try:
        content = json.loads(_bytes(file, MOST_RECORD))
        kept = understood(content["session"])
        views, when = int(content["views"]), datetime.fromtimestamp(file.stat().st_mtime)
        if kept.scene == path and not kept.edits and views >= 0:
            return Project(path, kept, views, when)
    except DAMAGED:
        pass
    return Project(path, Kept(scene=path))


def picture(path: str) -> UInt8[np.ndarray, "H W 3"] | None:
    """The small picture of a scene; None, and no file any more, where it is damaged, another's, or older than
    the scene."""
    file = project_file(path, PICTURE)
    try:
        with opened_picture(_bytes(file, MOST_BYTES), ("JPEG",)) as small:
            stamped = bytes(small.info.get("comment", b"")).decode(errors="replace")
            if stamped and stamped == stamp(Path(path)) and small.size == SIDES:
                return np.asarray(small.convert("RGB"))
    except Exception:  # whatever Pillow raises for damaged files
        pass
    drop_picture(path)
    return None


def drop_picture(path: str) -> None:
    """Remove the small picture of a scene; none there is fine."""
    with suppress(OSError):
        project_file(path, PICTURE).unlink(missing_ok=True)


def sweep(recent: Sequence[str]) -> tuple[str, ...]:
    """Remove what is kept of scenes that have gone, or are not among the recent ones; returns those that are
    there."""
    there = tuple(path for path in recent if path and os.path.isfile(path))
    names = {project_file(path, suffix).name for path in there for suffix in (_RECORD, PICTURE)}
    with suppress(OSError):
        _remove(file for file in projects_folder().iterdir() if file.name not in names)
    return there


def _remove(files: Iterable[Path]) -> None:
    for file in list(files):
        with suppress(OSError):
            file.unlink()


def _bytes(file: Path, most: int) -> bytes:
    """Raises: OSError: no file, or none that can be read; ValueError: it is longer than ours are."""
    if not file.is_file():
        raise FileNotFoundError(file)
    with file.open("rb") as stream:
        content = stream.read(most + 1)
    if len(content) > most:
        raise ValueError("expected a shorter file")
    return content


def _write(path: str, suffix: str, content: bytes) -> None:
    make_folder(projects_folder())
    write_atomically(project_file(path, suffix), content)
