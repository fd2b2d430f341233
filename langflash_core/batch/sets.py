"""Sets of photos: a folder whose sub-folders hold the photos of one place each, or a table of them."""

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from langflash_core.base.formats import is_photo
from langflash_core.errors import InputError

LEDGER, SUMMARY = "ledger.csv", "summary.html"
_LONGEST_NAME = 120  # bytes; with what is put around it while it is written, below 255
_UNFIT = re.compile(r'[/\\:*?"<>|\x00-\x1f]')  # in the name of a folder, on any system


@dataclass(frozen=True)
class PhotoSet:
    """Photos of one place, in order. The name is that of its folder in the output."""

    name: str
    photos: tuple[Path, ...]


def read_sets(source: Path, output: Path) -> list[PhotoSet]:
    """The sets of a folder or of a table, in their order; whether the photos are any good is not asked.

    Args:
        source: a folder of folders, or a .csv: a row a set, its name and then its photos, relative to the
            table; a first row that begins with "name" is a heading.
        output: folder of the results; where it lies beside the sets it is none of them.

    Raises:
        InputError: there is no set, or two share a name, or a name cannot be that of a folder.
    """
    if source.is_dir():
        if output.resolve() == source.resolve():
            raise InputError(f"{source} holds the photos; choose another -o")
        sets = list(_sub_folders(source, output))
        if not sets:
            raise InputError(f"{source} has no sub-folders; put the photos of each place into one of its own")
        return sets
    if not source.is_file():
        raise InputError(f"there is neither a folder nor a table of sets at {source}; check the path")
    sets = list(_table(source))
    if not sets:
        raise InputError(f"{source} names no set; give a row each: its name and its photos")
    return sets


def _sub_folders(source: Path, output: Path) -> Iterator[PhotoSet]:
    for folder in sorted(source.iterdir()):
        if not folder.is_dir() or folder.name.startswith(".") or folder.resolve() == output.resolve():
            continue
        photos = filter(is_photo, sorted(folder.iterdir()))
        yield PhotoSet(folder.name, tuple(photo for photo in photos if not photo.name.startswith(".")))


def _table(source: Path) -> Iterator[PhotoSet]:
    seen: dict[str, int] = {}
    for line, cells in _rows(source):
        name, photos = cells[0], [cell for cell in cells[1:] if cell]
        if line == 1 and name.casefold() == "name":
            continue
        check_name(name, f"{source}, line {line}")
        if not photos:
            raise InputError(f"{source}, line {line}: '{name}' has no photos; name them after it")
        before = seen.setdefault(name.casefold(), line)
        if before != line:
            raise InputError(
                f"{source}: lines {before} and {line} are both called '{name}'; "
                "names become folders, give each set its own"
            )
        yield PhotoSet(name, tuple(source.parent / photo for photo in photos))


def _rows(source: Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of each row that is not empty; cells lie between commas, or semicolons."""
    try:
        text = source.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise InputError(f"{source} cannot be read as a table ({problem}); save it as CSV in UTF-8") from None
    first = text.partition("\n")[0]
    table = csv.reader(io.StringIO(text), delimiter=";" if ";" in first and "," not in first else ",")
    try:
        for row in table:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield table.line_num, cells
    except csv.Error as problem:
        raise InputError(
            f"{source}, line {table.line_num}: not a table ({problem}); save it as CSV in UTF-8"
        ) from None


def check_name(name: str, where: str) -> None:
    """That a folder may be called so, on every system, and that it lies where it is put.

    Raises:
        InputError: it may not.
    """
    taken = name.casefold() in (LEDGER, SUMMARY)
    too_long = len(name.encode()) > _LONGEST_NAME
    if not name or name.startswith(".") or name.endswith(".") or taken or too_long or _UNFIT.search(name):
        said = " ".join(name.split())[:60]
        raise InputError(f"{where}: '{said}' cannot be the name of a folder; choose another")
