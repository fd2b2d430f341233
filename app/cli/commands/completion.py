"""`langflash completion`: the script that makes a shell complete its words."""

from argparse import Namespace
from typing import TextIO

from ..completions import script
from ..parser import build_parser


def run(args: Namespace, out: TextIO) -> None:
    """Print it."""
    out.write(script(build_parser(), args.shell))
