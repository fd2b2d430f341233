"""What converters of published layouts read from, and tables that they read alike."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from langflash_core.base.running import Progress
from langflash_core.errors import InputError


@dataclass(frozen=True)
class Source:
    """What a converter reads. path: the file or folder; further: other files by role (a layout says
    which); limit: only the first so many photos; progress: stage and fraction done."""

    path: Path
    further: dict[str, Path] = field(default_factory=dict)
    limit: int | None = None
    progress: Progress = lambda stage, fraction: None

    def walk(self, items: Iterable) -> Iterator:
        """Items up to the limit, with progress."""
        listed = list(items)[: self.limit]
        for done, item in enumerate(listed):
            self.progress(f"photo {done + 1} of {len(listed)}", done / len(listed))
            yield item


def read_table(path: Path) -> dict:
    """A JSON object.

    Raises:
        InputError: it cannot be read, or is something else.
    """
    try:
        document = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check the path") from None
    except ValueError as error:
        raise InputError(f"{path} is not JSON ({error}); download it again") from None
    if not isinstance(document, dict):
        raise InputError(f"{path} is no table of names; download it again")
    return document


def read_json(path: Path, keys: tuple[str, ...]) -> dict:
    """A JSON object that holds `keys`.

    Raises:
        InputError: it does not, or cannot be read.
    """
    document = read_table(path)
    missing = [key for key in keys if key not in document]
    if missing:
        raise InputError(f"{path} holds no '{missing[0]}'; it is not the file this layout needs")
    return document
