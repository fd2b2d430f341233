"""`langflash view`: the window."""

from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import readable_file
from langflash_core.errors import ImageError

from ..files import out_of_folders


def run(args: Namespace, out: TextIO) -> int:
    """Open the window on photos, a scene, or nothing; returns when it is closed."""
    paths = out_of_folders(args.paths)
    for path in paths:
        readable_file(path, "photo or scene", ImageError)
    from ...window import run as open_window

    return open_window(paths)
