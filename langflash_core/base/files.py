"""Files and folders that are whole or absent: written beside their place, then moved onto it; and what is
checked of them before the work.

The hidden one beside it is called `.NAME.HOST-PROCESS-RANDOM.part`. A killed process leaves its own
behind; the next write into the folder from the same computer sweeps it up. A symbolic link stays: the place
of a file is the one that it leads to.
"""

import errno
import json
import os
import re
import shutil
import stat
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from langflash_core.base.formats import is_film, is_photo, kind_of
from langflash_core.errors import ImageError, InputError, OutputError

_HELD = "held"  # names the part that says who has a folder
_STILL_ACTIVE = 259  # what Windows has for the exit code of a process that runs


def write_atomically(path: Path, content: bytes | Iterable[bytes]) -> None:
    """Write `content`, whole or in parts, to `path`; whatever stops it, the old file or none is there.

    Raises:
        OutputError: the folder is missing, is a file, or cannot be written; see `place_of`.
    """
    if os.path.isdir(path):  # unlike Path, without an error for a name that is too long
        raise OutputError(f"cannot write {path}: it is a folder; name a file in it")
    place = place_of(path)
    folder = place.parent
    if not os.path.isdir(folder):
        state = "is a file" if os.path.exists(folder) else "does not exist"
        raise OutputError(f"cannot write {path}: {folder} {state}; create that folder first")
    temporary = part_beside(place)
    with _clear_temporaries(path, temporary):
        with temporary.open("xb") as stream:
            for part in (content,) if isinstance(content, bytes) else content:
                stream.write(part)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, place)


@contextmanager
def written_atomically(path: Path, library: type[Exception] = OSError) -> Iterator[Path]:
    """A path beside `path` to write to, moved onto it when the block ends well; for large files.

    Args:
        library: what is raised by one that writes by itself where the system refuses.

    Raises:
        OutputError: the folder cannot be made or written, or the disk is full; see `place_of`.
    """
    place = place_of(path)
    make_folder(place.parent)
    temporary = part_beside(place)
    with _clear_temporaries(path, temporary, library=library):
        yield temporary
        os.replace(temporary, place)


@contextmanager
def filled_atomically(folder: Path) -> Iterator[Path]:
    """A new folder beside `folder` to fill, put in its place when the block ends well; what was there goes.

    Raises:
        OutputError: the folder cannot be made or written, a file is in its place, or the disk is full.
    """
    folder = _end_of_links(folder)
    make_folder(folder.parent)
    temporary, old = part_beside(folder), part_beside(folder)
    if os.path.exists(folder) and not os.path.isdir(folder):
        raise OutputError(f"cannot write {folder}: a file of that name is in the way; choose another place")
    with _clear_temporaries(folder, temporary, old):
        temporary.mkdir()
        yield temporary
        if os.path.isdir(folder):
            os.replace(folder, old)
        os.replace(temporary, folder)


def place_of(path: Path) -> Path:
    """Where a file called so is written: `path`, or what the symbolic link there leads to, which need not be
    there yet.

    Raises:
        OutputError: links lead in a circle, or into a folder that is not there; what is there is no plain
            file (a device, a pipe), or is read-only: moving a file onto it would do away with it all the
            same.
    """
    place = _end_of_links(path)
    if place != path and not os.path.isdir(place.parent):
        leads = f"it is a symbolic link to {place}, and that folder does not exist"
        raise OutputError(f"cannot write {path}: {leads}; create it, or choose another place")
    try:
        mode = os.stat(place).st_mode
    except (OSError, ValueError):  # nothing is there, or no disk takes such a name: writing says so
        return place
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise OutputError(
            f"cannot write {path}: {_itself(place, path)} is no plain file; choose another place"
        )
    if not mode & 0o222 or not os.access(place, os.W_OK):  # root may write all files
        remedy = "make it writable, or choose another place"
        raise OutputError(f"cannot write {path}: {_itself(place, path)} is read-only; {remedy}")
    return place


def _end_of_links(path: Path) -> Path:
    """What the symbolic link `path` leads to in the end; any other path as it is.

    Raises:
        OutputError: it leads in a circle.
    """
    if not os.path.islink(path):
        return path
    place = Path(os.path.realpath(path))
    if os.path.islink(place):
        raise OutputError(f"cannot write {path}: its symbolic links lead in a circle; choose another place")
    return place


def _itself(place: Path, path: Path) -> str:
    return "it" if place == path else f"{place}, to which it is a symbolic link,"


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
    return any(_part().fullmatch(name) for name in others)


def make_folder(folder: Path) -> None:
    """Create `folder` and its parents where missing.

    Raises:
        OutputError: something in the way is a file, or cannot be written.
    """
    try:
        _end_of_links(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file of that name is in the way" if isinstance(error, FileExistsError) else error.strerror
        raise OutputError(f"cannot create the folder {folder}: {reason}; choose another place") from error


@contextmanager
def _clear_temporaries(path: Path, *temporaries: Path, library: type[Exception] = OSError) -> Iterator[None]:
    """The system's refusals inside are sentences about `path`; `temporaries` are gone afterwards.

    Raises:
        OutputError: the system refused something.
    """
    try:
        yield
    except (OSError, library) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(f"cannot write {path}: {reason}; choose another place for it") from error
    finally:
        for temporary in temporaries:
            _remove(temporary)


def part_beside(path: Path) -> Path:
    """The hidden file or folder to write to beside `path`; those of processes that are gone are swept up."""
    _sweep(path.parent)
    return path.parent / f".{path.name[:100]}.{_host()}-{os.getpid()}-{os.urandom(6).hex()}.part"


@cache
def _host() -> str:
    """Six digits for this computer: of a shared folder, only its own parts can be judged by their process."""
    import hashlib  # these two take longer than the words of a command
    import platform

    return hashlib.sha256(platform.node().encode()).hexdigest()[:6]


@cache
def _part() -> re.Pattern[str]:
    return re.compile(rf"\..*\.{_host()}-(\d+)-[0-9a-f]{{12}}\.part", re.DOTALL)


def _sweep(folder: Path) -> None:
    """Remove what processes left half-written that are gone."""
    with suppress(OSError):
        for name in os.listdir(folder):
            found = _part().fullmatch(name)
            if found and not _runs(int(found[1])):
                _remove(folder / name)


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
    with suppress(OSError):
        temporary.unlink(missing_ok=True)


# --- what a command checks before its work ---------------------------------------------------------


def readable_file(path: Path, what: str, error: type[InputError]) -> Path:
    """`path`, when it is a file that opens.

    Raises:
        error: it is missing, a folder, or may not be read; `what` names its role.
    """
    if path.is_dir():
        raise error(f"{path} is a folder; give the {what} itself")
    try:
        path.open("rb").close()
    except FileNotFoundError:
        raise error(f"there is no {what} at {path}; check the path") from None
    except (OSError, ValueError) as problem:  # ValueError: a NUL character in the path
        reason = getattr(problem, "strerror", None) or problem
        raise error(f"the {what} {path} cannot be read: {reason}") from None
    return path


def photos_in(folder: Path) -> list[Path]:
    """The photos that lie directly in a folder, else its films, in the order of their names; none of what
    is hidden.

    Raises:
        ImageError: it cannot be read.
    """
    try:
        files = sorted(path for path in folder.iterdir() if not path.name.startswith(".") and path.is_file())
    except OSError as problem:
        reason = problem.strerror or problem
        raise ImageError(f"the folder {folder} cannot be read: {reason}; choose another") from None
    return list(filter(is_photo, files)) or list(filter(is_film, files))


def check_folder(folder: Path, option: str = "-o") -> None:
    """Prove that a file can be made in `folder`, or in the nearest parent that exists.

    Args:
        option: that named it.

    Raises:
        OutputError: it cannot; nothing is left behind either way.
    """
    nearest = _nearest(folder)
    if not nearest.is_dir():
        raise OutputError(f"cannot write to {folder}: {nearest} is not a folder; choose another {option}")
    import tempfile

    try:
        tempfile.TemporaryFile(dir=nearest).close()
    except OSError as problem:
        raise OutputError(
            f"cannot write to {folder}: {problem.strerror or problem}; choose another {option}"
        ) from None


def check_output_file(
    path: Path, suffixes: tuple[str, ...] = (), inputs: Iterable[Path] = (), option: str = "-o"
) -> Path:
    """`path`, when one file can be written there without harm.

    Args:
        suffixes: lower-case endings that are allowed, any when empty.
        inputs: files the command reads, which it must not overwrite.
        option: that named it.

    Raises:
        OutputError: wrong ending, a folder, an input of the same command, or not writable; see `place_of`.
    """
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder; give a file name")
    place = place_of(path)
    if any(path.exists() and other.exists() and path.samefile(other) for other in inputs):
        raise OutputError(f"{path} is also an input; choose another {option}")
    if suffixes and kind_of(path) not in suffixes:
        wanted = f"this command writes {', '.join(suffixes)}"
        raise OutputError(f"cannot write {path.name}: {wanted}; rename {option}")
    check_folder(place.parent, option)
    return path


def check_beside(path: Path, document: Path, picture: Path) -> None:
    """Prove that a file which is written unnamed, beside the one of -o, replaces only its own kind.

    A legend and its picture, a COCO file and its pictures belong together where the JSON `document` that
    is there names the `picture`.

    Raises:
        OutputError: something else has the name `path`.
    """
    if path.exists() and not _names(document, picture.name):
        what = f"{path.name} would be written too, and is there as something else"
        raise OutputError(f"{what}; choose another -o, or add --replace")


def check_same_kind(path: Path, keys: Iterable[str]) -> None:
    """Prove that what is at `path` is of the kind that will replace it, since .json says little about it.

    Args:
        keys: that its object has, or every entry of its list.

    Raises:
        OutputError: it is something else.
    """
    if not path.exists():
        return
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        content = None
    entries = content if isinstance(content, list) else [content]
    if not all(isinstance(entry, dict) and entry.keys() >= set(keys) for entry in entries):
        raise OutputError(f"{path.name} is there as something else; choose another -o, or add --replace")


def _names(document: Path, name: str) -> bool:
    """Whether a JSON file has a name in it as a text."""
    try:
        text = document.read_text("utf-8")
    except (OSError, ValueError):
        return False
    return json.dumps(name, ensure_ascii=False) in text


@contextmanager
def staged_folder(folder: Path) -> Iterator[Path]:
    """A hidden folder to write into; its files move to `folder` together, at the end.

    An error or Ctrl-C inside the `with` leaves `folder` as it was, also not made.

    Raises:
        OutputError: a file cannot be moved, because a folder of its name is in the way.
    """
    staging = part_beside(_nearest(folder) / "export")  # "." has no name of its own
    _sweep(folder.absolute().parent)  # where it lay before `folder` was there
    staging.mkdir(mode=0o700)
    try:
        yield staging
        files = (file for file in sorted(staging.rglob("*")) if file.is_file())
        move_all({file: folder / file.relative_to(staging) for file in files})
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def move_all(moves: dict[Path, Path]) -> None:
    """Move files (keys) to new places (values); what stops it is undone.

    Only a file that was overwritten before the failure is not brought back.

    Raises:
        OutputError: a folder is in the way, or may not be written; see `place_of`.
    """
    for target in moves.values():
        if target.is_dir():
            raise OutputError(f"cannot write {target}: it is a folder; choose another -o")
    places = {source: place_of(target) for source, target in moves.items()}
    undo: list[Callable[[], None]] = []
    try:
        for source, place in places.items():
            _make_folder(place.parent, undo)
            if not place.exists():
                undo.append(lambda place=place: place.unlink(missing_ok=True))
            _move(source, place)
    except BaseException as problem:
        for step in reversed(undo):
            with suppress(OSError):
                step()
        if isinstance(problem, OSError):
            where, why = problem.filename or "the output", problem.strerror or problem
            raise OutputError(f"cannot write {where}: {why}; choose another -o") from None
        raise


def _move(source: Path, place: Path) -> None:
    """Also onto another disk, where a symbolic link may lead: then through a copy beside the place."""
    try:
        os.replace(source, place)
    except OSError as problem:
        if problem.errno != errno.EXDEV:
            raise
        copy = part_beside(place)
        try:
            shutil.copyfile(source, copy)
            os.replace(copy, place)
        finally:
            _remove(copy)


def _make_folder(folder: Path, undo: list[Callable[[], None]]) -> None:
    """Make `folder` and its parents; `undo` learns how to take the new ones away."""
    folder = _end_of_links(folder)
    if folder.is_dir():
        return
    _make_folder(folder.parent, undo)
    folder.mkdir()
    undo.append(folder.rmdir)


def _nearest(folder: Path) -> Path:
    """`folder`, or the nearest parent that exists, of what a symbolic link on the way leads to."""
    nearest = folder.absolute()
    while not nearest.exists() and nearest != nearest.parent:
        nearest = _end_of_links(nearest) if nearest.is_symlink() else nearest.parent
    return nearest
