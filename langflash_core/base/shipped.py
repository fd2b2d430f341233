"""The weights that come with the program are those that were shipped: their SHA-256 stands beside them.

`assets/weights/SHA256SUMS` has a line a file, as `sha256sum --check` reads it. It finds a bad disk, a copy
that was cut or patched, and an installation of mixed versions; who can change both files can also change the
program.
"""

import hashlib
from functools import cache
from pathlib import Path

from langflash_core.base.resources import asset_path
from langflash_core.errors import WeightsError

SUMS = "weights/SHA256SUMS"


def check_shipped(path: Path) -> None:
    """A file of the folder of shipped weights is as it was shipped; others are not looked at.

    Raises:
        WeightsError: it differs, or cannot be read.
    """
    sums = _sums()
    if path.name not in sums or path.resolve().parent != asset_path("weights").resolve():
        return
    try:
        with path.open("rb") as stream:
            found = hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise WeightsError(f"{path} cannot be read ({error.strerror}); check its permissions") from error
    if found != sums[path.name]:
        raise WeightsError(
            f"{path} is not the file that was shipped (its SHA-256 begins {found[:12]}, expected "
            f"{sums[path.name][:12]}); reinstall LangFlash"
        )


@cache
def _sums() -> dict[str, str]:
    """Digest by file name; none where the list is not there."""
    try:
        lines = asset_path(SUMS).read_text("utf-8").splitlines()
    except FileNotFoundError:
        return {}
    return {name.lstrip("* "): digest for digest, _, name in (line.partition(" ") for line in lines)}
