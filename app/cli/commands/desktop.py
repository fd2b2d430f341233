"""`langflash desktop`: an entry in the menu, and .langflash files that open with a click."""

import sys
from argparse import Namespace
from typing import TextIO

from langflash_core.errors import InputError

from ..desktop_files import data_folder, install, own_command, remove


def run(args: Namespace, out: TextIO) -> None:
    """Write or remove the files of the desktop.

    Raises:
        LangFlashError: it is no Linux, or a file is somebody else's or cannot be written.
    """
    if not sys.platform.startswith("linux"):
        raise InputError(
            "the desktop entry is for Linux; on other systems choose the program for a file by hand"
        )
    paths = install(data_folder(), own_command()) if args.install else remove(data_folder())
    for path in paths:
        print(path if args.install else f"removed {path}", file=out)
    if not paths:
        print("nothing was installed", file=out)
