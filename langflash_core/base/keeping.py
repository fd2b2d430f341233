"""Work that is kept: finished steps of a long run as files, so that one which was ended goes on where it was.

A step is named by what it is of, and its file also by the fingerprint of all that its result hangs on:
photos, weights, settings, version. So files of other photos or settings are never taken for one's own. A
file is whole or absent; one that cannot be read is made again.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from langflash_core.base.files import written_atomically

Arrays = Mapping[str, np.ndarray]
Made = Callable[[], Arrays]
STEPS = 2
"""Raised whenever a step comes to mean something else: what an older program kept is then made anew."""
MATCHES = "matches"
"""The step that finds key points and what corresponds: begun ahead, asked for by the network."""
_ENDING = ".kept.npz"


@dataclass(frozen=True)
class Keep:
    """Steps in a folder. key: the fingerprint of what they hang on. found: the names of those that were there
    are added to it, as they are asked for."""

    folder: Path
    key: str
    found: list[str] = field(default_factory=list, compare=False)

    @staticmethod
    def of(
        folder: Path, said: Mapping[str, Any], parts: Iterable[bytes] = (), found: list[str] | None = None
    ) -> "Keep":
        """said: settings, as JSON has them. parts: what else results hang on. found: as the field; None: a
        list of its own."""
        digest = hashlib.sha256(json.dumps([STEPS, said], sort_keys=True, default=str).encode())
        for part in parts:
            digest.update(hashlib.sha256(part).digest())
        return Keep(folder, digest.hexdigest()[:24], [] if found is None else found)

    def __call__(self, name: str, make: Made) -> Arrays:
        """The result of a step: what was kept of it, else what `make` gives, which is kept then.

        Raises:
            OutputError: it cannot be written.
        """
        path = self.folder / f"{name}-{self.key}{_ENDING}"
        found = _load_arrays(path)
        if found is not None:
            self.found.append(name)
            return found
        made = make()
        with written_atomically(path) as temporary, temporary.open("wb") as stream:
            np.savez(stream, allow_pickle=False, **made)
        return made


def not_kept(name: str, make: Made) -> Arrays:
    """As a `Keep`, without a folder."""
    return make()


def forget(folder: Path) -> None:
    """Remove all steps that were kept in a folder, and the folder where nothing else is in it."""
    for path in folder.glob(f"*{_ENDING}"):
        path.unlink(missing_ok=True)
    with suppress(OSError):
        folder.rmdir()


def holds_steps(folder: Path) -> bool:
    """Whether steps were kept in a folder."""
    return next(folder.glob(f"*{_ENDING}"), None) is not None


def _load_arrays(path: Path) -> dict[str, np.ndarray] | None:
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            found = {name: stored[name] for name in stored.files}
            # What is no array in an archive comes as its bytes.
            return found if all(isinstance(each, np.ndarray) for each in found.values()) else None
    except Exception:  # zipfile, zlib and numpy have a dozen errors for what is damaged; it is made again
        return None
