"""What torch saves, whole or not at all."""

from pathlib import Path

import torch

from langflash_core.base.files import written_atomically


def save_whole(content: object, path: Path) -> None:
    """`torch.save`, atomically.

    Raises:
        OutputError: the folder cannot be made or written, or the disk is full.
    """
    with written_atomically(path) as temporary, temporary.open("wb") as stream:
        try:
            torch.save(content, stream)
        except RuntimeError as error:
            if isinstance(error.__context__, OSError):  # torch hides what the system said
                raise error.__context__ from None
            raise
