"""The ledger of a run, `ledger.csv`: one row a set (or a clip, of labels) that was done or failed.

While a run lasts rows are appended, so that whatever ends it leaves every row before the last whole; at its
end the file is written anew, in order. A row that cannot be read counts as none: its set is done again.
"""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import OutputError

DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class Row:
    """What became of one set.

    status: "done" or "failed". reason: why it failed, a sentence. retried: how often it was begun again
    because its worker died. seconds: of the last try. photos, gaussians, groups: counts. found: phrases
    that were found, of those asked. memory_mb: the most that its worker had held by then. warnings:
    sentences. fingerprint: of photos and options.
    """

    name: str
    status: str
    reason: str = ""
    retried: int = 0
    seconds: float = 0.0
    photos: int = 0
    gaussians: int = 0
    groups: int = 0
    found: str = ""
    memory_mb: int = 0
    warnings: str = ""
    fingerprint: str = ""


COLUMNS = tuple(field.name for field in fields(Row))
_KINDS = {name: type(value) for name, value in asdict(Row("", "")).items()}


class Ledger:
    """The rows by name, and their file."""

    def __init__(self, path: Path, item: str = "set") -> None:
        """Read what a run before has left.

        Args:
            item: what a row is of, "set" or "clip".

        Raises:
            OutputError: a file of that name is something else.
        """
        self.path, self.item = path, item
        self.rows: dict[str, Row] = {row.name: row for row in _read_rows(path)}

    def begin(self, again: Iterable[str]) -> None:
        """Forget the rows of sets that are about to be done again, and make the file.

        Raises:
            OutputError: it cannot be written.
        """
        for name in again:
            self.rows.pop(name, None)
        make_folder(self.path.parent)
        self._write()

    def add(self, row: Row) -> None:
        """Note a set that has ended.

        Raises:
            OutputError: the disk is full.
        """
        self.rows[row.name] = row
        try:
            with self.path.open("ab") as stream:
                stream.write(_lines([row]))
        except OSError as problem:
            raise OutputError(f"cannot write {self.path}: {problem.strerror}; make room for it") from problem

    def settle(self, order: Sequence[str]) -> None:
        """Write the file anew: rows in this order, then those of sets from other runs."""
        places = {name: place for place, name in enumerate(order)}
        ordered = sorted(self.rows.values(), key=lambda row: places.get(row.name, len(places)))
        self.rows = {row.name: row for row in ordered}
        self._write()

    def _write(self) -> None:
        heading = ",".join(COLUMNS).encode() + b"\n"
        write_atomically(self.path, (heading, _lines(self.rows.values())))


def _lines(rows: Iterable[Row]) -> bytes:
    stream = io.StringIO(newline="")
    table = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    table.writerows({**asdict(row), "seconds": f"{row.seconds:.2f}"} for row in rows)
    return stream.getvalue().encode()


def _read_rows(path: Path) -> list[Row]:
    try:
        text = path.read_bytes().decode(errors="replace")
    except FileNotFoundError:
        return []
    except OSError as problem:
        raise OutputError(f"cannot read {path}: {problem.strerror}; choose another -o") from problem
    lines = list(csv.reader(io.StringIO(text.replace("\0", ""))))
    if not lines or tuple(lines[0]) != COLUMNS:
        raise OutputError(f"{path} is not a ledger of this version; move it away, or choose another -o")
    return [row for row in map(_row, lines[1:]) if row is not None]


def _row(cells: list[str]) -> Row | None:
    """None: the row is not whole."""
    if len(cells) != len(COLUMNS):
        return None
    try:
        values = {name: _KINDS[name](cell) for name, cell in zip(COLUMNS, cells, strict=True)}
    except ValueError:
        return None
    return Row(**values)
