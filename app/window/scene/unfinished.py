"""Work on many photos that is kept while it goes on, so that pausing it, or leaving the program, loses
little: a folder of `langflash_core/base/keeping.py` for each set of photos, in the user's folder of caches.

A folder is found again by the photos' sizes and first bytes, wherever they lie and whatever they are called,
in their order; that nothing is taken for what it is not is up to what the files in it are named by.
"""

import hashlib
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from langflash_core.base.files import held_alone
from langflash_core.base.keeping import forget, holds_steps
from langflash_core.base.resources import home_folder
from langflash_core.errors import OutputError

FEWEST = 4
"""Photos from which on it is worth it: fewer are done in seconds."""
MOST_FOLDERS, MOST_DAYS = 3, 14
"""Of unfinished work that is kept, the newest first."""
_FREE_MB, _FREE_MB_PHOTO = 1000, 40  # on the disk, without which nothing is kept
_READ = 65536  # bytes of a photo, by which it is known


def folder_of(photos: Sequence[Path]) -> Path | None:
    """Where work on these photos is kept; None where they are too few, or one cannot be read."""
    if len(photos) < FEWEST:
        return None
    digest = hashlib.sha256()
    try:
        for photo in photos:
            with photo.open("rb") as stream:
                digest.update(f"{os.fstat(stream.fileno()).st_size} ".encode())
                digest.update(hashlib.sha256(stream.read(_READ)).digest())
    except OSError:
        return None
    return _home() / digest.hexdigest()[:24]


def is_unfinished(photos: Sequence[Path]) -> bool:
    """Whether there is work on these photos to go on from."""
    folder = folder_of(photos) if _home().is_dir() else None
    return folder is not None and holds_steps(folder)


def drop(photos: Sequence[Path]) -> None:
    """Forget the work on these photos."""
    folder = folder_of(photos)
    if folder is not None and folder.is_dir():
        forget(folder)


@contextmanager
def kept(photos: Sequence[Path]) -> Iterator[Path | None]:
    """Where to keep work on these photos; None: nowhere. What ends well is forgotten, the rest stays."""
    folder = folder_of(photos)
    if folder is None or not _room_for(len(photos)):
        yield None
        return
    with ExitStack() as held:
        try:
            held.enter_context(held_alone(folder))
        except OutputError:  # another window works on them, or nothing can be written
            folder = None
        if folder is not None:
            sweep(folder)
        yield folder
    if folder is not None:
        forget(folder)


def sweep(but: Path) -> None:
    """Remove old work, and what is too much, but for one folder and those that other windows work in."""
    with suppress(OSError):
        others = sorted((f for f in _home().iterdir() if f.is_dir() and f != but), key=_changed, reverse=True)
        for place, folder in enumerate(others):
            if place >= MOST_FOLDERS - 1 or time.time() - _changed(folder) > MOST_DAYS * 86400:
                _forget_alone(folder)


def _forget_alone(folder: Path) -> None:
    """Forget work, unless another window is at it."""
    with suppress(OutputError, OSError):
        with held_alone(folder):
            forget(folder)
        folder.rmdir()  # what said who has it is gone


def _changed(folder: Path) -> float:
    return folder.stat().st_mtime


def _room_for(photos: int) -> bool:
    home = _home()
    with suppress(OSError):
        while not home.exists():
            home = home.parent
        return shutil.disk_usage(home).free > (_FREE_MB + photos * _FREE_MB_PHOTO) * 1_000_000
    return False


def _home() -> Path:
    return home_folder() / "unfinished"
