"""Files a command reads and writes: checked before the work, written all or not at all."""

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from langflash_core.errors import InputError, OutputError, SceneFileError
from langflash_core.files import part_beside
from langflash_core.formats import kind_of


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


def checked_scene(path: Path) -> Path:
    """`path`, when it opens and, if it is one of our own files, is whole by its header; without torch.

    Raises:
        SceneFileError: missing, truncated, foreign, or of a newer version.
    """
    readable_file(path, "scene", SceneFileError)
    if path.suffix.lower() == ".langflash":
        from langflash_core.scene.container import check_container

        check_container(path)
    return path


def check_folder(folder: Path) -> None:
    """Prove that a file can be made in `folder`, or in the nearest parent that exists.

    Raises:
        OutputError: it cannot; nothing is left behind either way.
    """
    nearest = _nearest(folder)
    if not nearest.is_dir():
        raise OutputError(f"cannot write to {folder}: {nearest} is not a folder; choose another -o")
    try:
        tempfile.TemporaryFile(dir=nearest).close()
    except OSError as problem:
        raise OutputError(
            f"cannot write to {folder}: {problem.strerror or problem}; choose another -o"
        ) from None


def check_output_file(path: Path, suffixes: tuple[str, ...] = (), inputs: Iterable[Path] = ()) -> Path:
    """`path`, when one file can be written there without harm.

    Args:
        suffixes: lower-case endings that are allowed, any when empty.
        inputs: files the command reads, which it must not overwrite.

    Raises:
        OutputError: wrong ending, a folder, an input of the same command, or not writable.
    """
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder; give a file name")
    if any(path.exists() and other.exists() and path.samefile(other) for other in inputs):
        raise OutputError(f"{path} is also an input; choose another -o")
    if suffixes and kind_of(path) not in suffixes:
        raise OutputError(f"cannot write {path.name}: this command writes {', '.join(suffixes)}; rename -o")
    check_folder(path.parent)
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
    staging.mkdir(mode=0o700)
    try:
        yield staging
        files = (file for file in sorted(staging.rglob("*")) if file.is_file())
        move_all({file: folder / file.relative_to(staging) for file in files})
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def move_all(moves: dict[Path, Path]) -> None:
    """Move files (keys) to new places (values) on the same disk; what stops it is undone.

    Only a file that was overwritten before the failure is not brought back.

    Raises:
        OutputError: a folder is in the way, or may not be written.
    """
    for target in moves.values():
        if target.is_dir():
            raise OutputError(f"cannot write {target}: it is a folder; choose another -o")
    undo: list[Callable[[], None]] = []
    try:
        for source, target in moves.items():
            _make_folder(target.parent, undo)
            if not target.exists():
                undo.append(lambda target=target: target.unlink(missing_ok=True))
            os.replace(source, target)
    except BaseException as problem:
        for step in reversed(undo):
            with suppress(OSError):
                step()
        if isinstance(problem, OSError):
            where, why = problem.filename or "the output", problem.strerror or problem
            raise OutputError(f"cannot write {where}: {why}; choose another -o") from None
        raise


def _make_folder(folder: Path, undo: list[Callable[[], None]]) -> None:
    """Make `folder` and its parents; `undo` learns how to take the new ones away."""
    if folder.is_dir():
        return
    _make_folder(folder.parent, undo)
    folder.mkdir()
    undo.append(folder.rmdir)


def _nearest(folder: Path) -> Path:
    """`folder`, or the nearest parent that exists."""
    nearest = folder.absolute()
    while not nearest.exists() and nearest != nearest.parent:
        nearest = nearest.parent
    return nearest
