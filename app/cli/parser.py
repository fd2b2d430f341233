"""The words of the command line. Only the standard library is imported here."""

import argparse
from collections.abc import Sequence
from typing import NoReturn

import langflash_core
from langflash_core.errors import InputError

from .words.judging import add_bench, add_bench_network, add_eval
from .words.scenes import (
    add_batch,
    add_clean,
    add_export,
    add_frames,
    add_hide,
    add_info,
    add_inventory,
    add_level,
    add_lift,
    add_query,
    add_reconstruct,
    add_render,
    add_view,
    add_weights,
    add_words,
)
from .words.showing import add_completion, add_desktop, add_tour
from .words.training import add_labels, add_rooms, add_train

LAB = ("bench-network", "eval", "labels", "rooms", "train")
"""Commands that make and judge the weights."""


class UsageError(InputError):
    """The command line itself cannot be understood."""


class Parser(argparse.ArgumentParser):
    """argparse that reports a mistake as one sentence instead of a page."""

    def error(self, message: str) -> NoReturn:
        """Raise `message` as a `UsageError`.

        Raises:
            UsageError: always.
        """
        raise UsageError(f"{message}; see {self.prog} --help")


def build_parser() -> Parser:
    """Every command this version has."""
    parser = Parser(
        prog="langflash",
        description="Unposed photos to a 3D Gaussian scene that answers words.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"langflash {langflash_core.__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in (
        add_view,
        add_reconstruct,
        add_frames,
        add_batch,
        add_query,
        add_render,
        add_export,
        add_tour,
        add_hide,
        add_clean,
        add_lift,
        add_level,
        add_inventory,
        add_info,
        add_bench,
        add_bench_network,
        add_rooms,
        add_labels,
        add_train,
        add_eval,
        add_weights,
        add_words,
        add_desktop,
        add_completion,
    ):
        add(commands)
    return parser


def joined(words: Sequence[str]) -> list[str]:
    """`bench network` is a command of its own, though `bench` takes a scene; ./network names a file."""
    return ["bench-network", *words[2:]] if list(words[:2]) == ["bench", "network"] else list(words)
