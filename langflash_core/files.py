"""Files and folders that are whole or absent: written beside their place, then moved onto it.

The hidden one beside it is called `.NAME.HOST-PROCESS-RANDOM.part`. A killed process leaves its own
behind; the next write into the folder from the same computer sweeps it up.
"""

import hashlib
import os
import platform
import re
import secrets
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from langflash_core.errors import OutputError

# Of a shared folder, only parts of this computer can be judged by their process number.
_HOST = hashlib.sha256(platform.node().encode()).hexdigest()[:6]
_PART = re.compile(rf"\..*\.{_HOST}-(\d+)-[0-9a-f]{{12}}\.part", re.DOTALL)
_HELD = "held"  # names the part that says who has a folder
_STILL_ACTIVE = 259  # what Windows has for the exit code of a process that runs


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
    temporary = part_beside(path)
    with _cleared(path, temporary):
        with temporary.open("xb") as stream:
            for part in (content,) if isinstance(content, bytes) else content:
                stream.write(part)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)


@contextmanager
def written_atomically(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to, moved onto it when the block ends well; for large files.

    Raises:
        OutputError: the folder cannot be made or written, or the disk is full.
    """
    make_folder(path.parent)
    temporary = part_beside(path)
    with _cleared(path, temporary):
        yield temporary
        os.replace(temporary, path)


@contextmanager
def filled_atomically(folder: Path) -> Iterator[Path]:
    """A new folder beside `folder` to fill, put in its place when the block ends well; what was there goes.

    Raises:
        OutputError: the folder cannot be made or written, a file is in its place, or the disk is full.
    """
    make_folder(folder.parent)
    temporary, old = part_beside(folder), part_beside(folder)
    if os.path.isfile(folder):
        raise OutputError(f"cannot write {folder}: a file of that name is in the way; choose another place")
    with _cleared(folder, temporary, old):
        temporary.mkdir()
        yield temporary
        if os.path.isdir(folder):
            os.replace(folder, old)
        os.replace(temporary, folder)


@contextmanager
def held_alone(folder: Path) -> Iterator[None]:
    """Inside, no other process of this computer gets past this with the same folder.

    Raises:
        OutputError: one has it, or the folder cannot be made or written.
    """
    make_folder(folder)
    own = part_beside(folder / _HELD)
    try:
        if _others_hold(own):
            raise OutputError(
                f"another run is writing to {folder}; wait for its end, or choose another place"
            )
        yield
    finally:
        _remove(own)


def _others_hold(own: Path) -> bool:
    """Mark a folder as held by this process; whether another holds it, too.

    Raises:
        OutputError: it cannot be written.
    """
    folder = own.parent
    try:
        own.touch()
        others = [name for name in os.listdir(folder) if name.startswith(f".{_HELD}.") and name != own.name]
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write to {folder}: {reason}; choose another place") from error
    return any(_PART.fullmatch(name) for name in others)


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


@contextmanager
def _cleared(path: Path, *temporaries: Path) -> Iterator[None]:
    """The system's refusals inside are sentences about `path`; `temporaries` are gone afterwards.

    Raises:
        OutputError: the system refused something.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"cannot write {path}: {reason}; choose another place for it") from error
    finally:
        for temporary in temporaries:
            _remove(temporary)


def part_beside(path: Path) -> Path:
    """The hidden file or folder to write to beside `path`; those of processes that are gone are swept up."""
    with suppress(OSError):
        for name in os.listdir(path.parent):
            found = _PART.fullmatch(name)
            if found and not _runs(int(found[1])):
                _remove(path.parent / name)
    return path.parent / f".{path.name[:100]}.{_HOST}-{os.getpid()}-{secrets.token_hex(6)}.part"


def _runs(process: int) -> bool:
    """Whether a process of this number exists on this computer."""
    if sys.platform == "win32":  # there, os.kill ends what it is asked about
        import ctypes

        kernel = ctypes.windll.kernel32
        handle = kernel.OpenProcess(0x1000, False, process)  # PROCESS_QUERY_LIMITED_INFORMATION
        if not handle:
            return False
        code = ctypes.c_ulong()
        known = kernel.GetExitCodeProcess(handle, ctypes.byref(code))
        kernel.CloseHandle(handle)
        return not known or code.value == _STILL_ACTIVE
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OverflowError, PermissionError):
        return True
    return True


def _remove(temporary: Path) -> None:
    """Best effort: the error that led here matters more."""
    if os.path.isdir(temporary) and not os.path.islink(temporary):
        shutil.rmtree(temporary, ignore_errors=True)
        return
    try:
        temporary.unlink(missing_ok=True)
    except OSError:
        return
