"""Files that are whole or absent: written beside their place, then moved onto it."""

import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from langflash_core.errors import OutputError


def write_atomically(path: Path, content: bytes | Iterable[bytes]) -> None:
    """Write `content`, whole or in parts, to `path`; whatever stops it, the old file or none is there.

    Raises:
        OutputError: the folder is missing, is a file, or cannot be written.
    """
    folder = path.parent
    if os.path.isdir(path):  # unlike Path, without an error for a name that is too long
        raise OutputError(f"cannot write {path}: it is a folder; name a file in it")
    if not os.path.isdir(folder):
        state = "is a file" if os.path.exists(folder) else "does not exist"
        raise OutputError(f"cannot write {path}: {folder} {state}; create that folder first")
    temporary = folder / f".{path.name[:100]}.{secrets.token_hex(6)}.part"
    try:
        with temporary.open("xb") as stream:
            for part in (content,) if isinstance(content, bytes) else content:
                stream.write(part)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write {path}: {reason}; choose another place for it") from error
    finally:
        _remove(temporary)


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to, moved onto it when the block ends well; for large files.

    Raises:
        OutputError: the folder cannot be made or written, or the disk is full.
    """
    make_folder(path.parent)
    temporary = path.parent / f".{path.name[:100]}.{secrets.token_hex(6)}.part"
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write {path}: {reason}; choose another place for it") from error
    finally:
        _remove(temporary)


def make_folder(folder: Path) -> None:
    """Create `folder` and its parents where missing.

    Raises:
        OutputError: something in the way is a file, or cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file of that name is in the way" if isinstance(error, FileExistsError) else error.strerror
        raise OutputError(f"cannot create the folder {folder}: {reason}; choose another place") from error


def _remove(temporary: Path) -> None:
    """Best effort: the error that led here matters more."""
    try:
        temporary.unlink(missing_ok=True)
    except OSError:
        return
