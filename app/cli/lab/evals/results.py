"""What `--results` of a judgement keeps, and two of them beside each other."""

import io
import json
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from PIL import Image

from langflash_core.base.files import check_output_file, make_folder, readable_file, write_atomically
from langflash_core.errors import InputError

from ...report import write_tables

PICTURES = "pictures"
"""The folder of results that sheets are made of."""
Versions = Sequence[tuple[str, Path]]
"""What a version is called, its pictures."""


@dataclass(frozen=True)
class Results:
    """Of one judgement. command: `eval COMMAND`; file: in a folder of results, for the numbers; keys: that it
    has; alike: what to say where two results have no case in common; sheet: of pictures of versions, if
    kept."""

    command: str
    file: str
    keys: frozenset[str]
    alike: str
    sheet: Callable[[Versions], Image.Image] | None = None

    def write(self, folder: Path, result: dict) -> None:
        """The numbers of a run."""
        make_folder(folder)
        write_atomically(folder / self.file, json.dumps(result, indent=1).encode())

    def read(self, folder: Path) -> dict:
        """The numbers that a folder holds.

        Raises:
            InputError: none of this judgement.
        """
        path = readable_file(folder / self.file, f"result of eval {self.command}", InputError)
        try:
            found = json.loads(path.read_bytes())
        except ValueError:
            found = None
        if not isinstance(found, dict) or not self.keys <= found.keys():
            raise InputError(f"{path} is no result of eval {self.command}; make it with --results")
        return found

    def draw(self, path: Path, versions: Versions) -> None:
        """A sheet of the pictures that folders of results hold.

        Raises:
            InputError: this judgement keeps no pictures.
        """
        if self.sheet is None:
            raise InputError(f"eval {self.command} keeps no pictures; leave --sheet out")
        write_sheet(path, self.sheet([(title, folder / PICTURES) for title, folder in versions]))

    def beside(self, args: Namespace, markdown: Callable[[dict, dict], str], out: TextIO) -> None:
        """Two results of the same cases in one table.

        Raises:
            InputError: a folder holds no results, or they have no case in common.
        """
        before, after = self.read(args.before), self.read(args.after)
        if not {row["name"] for row in before["cases"]} & {row["name"] for row in after["cases"]}:
            raise InputError(f"these results have no {self.alike}")
        if args.sheet is not None:
            self.draw(args.sheet, [("before", args.before), ("after", args.after)])
        write_tables(args, {}, markdown(before, after), out)


def check_files(args: Namespace) -> None:
    """The table and the sheet can be written.

    Raises:
        InputError, OutputError: not so.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if getattr(args, "sheet", None) is not None:
        check_output_file(args.sheet, (".png",), option="--sheet")


def write_sheet(path: Path, sheet: Image.Image) -> None:
    """As a PNG."""
    stream = io.BytesIO()
    sheet.save(stream, "PNG", optimize=True)
    make_folder(path.parent)
    write_atomically(path, stream.getvalue())
