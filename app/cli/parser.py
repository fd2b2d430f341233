"""The words of the command line. Only the standard library is imported here."""

import argparse
from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import Any, NoReturn

import langflash_core
from langflash_core.errors import InputError

from .overview import in_groups

_JUDGING, _SCENES, _SHOWING, _TRAINING = "judging", "scenes", "showing", "training"
COMMANDS = {
    "view": _SCENES,
    "reconstruct": _SCENES,
    "frames": _SCENES,
    "batch": _SCENES,
    "query": _SCENES,
    "render": _SCENES,
    "export": _SCENES,
    "tour": _SHOWING,
    "hide": _SCENES,
    "clean": _SCENES,
    "lift": _SCENES,
    "level": _SCENES,
    "inventory": _SCENES,
    "info": _SCENES,
    "bench": _JUDGING,
    "bench-network": _JUDGING,
    "rooms": _TRAINING,
    "labels": _TRAINING,
    "train": _TRAINING,
    "eval": _JUDGING,
    "weights": _SCENES,
    "words": _SCENES,
    "desktop": _SHOWING,
    "completion": _SHOWING,
}
"""Every command, and the module of `words` whose `add_COMMAND` has its words."""


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

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """As argparse; of a word that is no command the nearest is offered, instead of a list of all.

        Raises:
            UsageError: it is no command.
        """
        if not isinstance(action, argparse._SubParsersAction) or value in action.choices:
            return super()._check_value(action, value)
        near = nearest(value, action.choices)
        offered = f'did you mean "{self.prog} {near}"?' if near else f"{self.prog} --help lists them"
        raise UsageError(f'"{self.prog} {value}" is not a command; {offered}')


def build_parser(command: str | None = None) -> Parser:
    """Every command this version has; `command` alone where it is one of them, which is sooner there."""
    parser = Parser(
        prog="langflash",
        usage="langflash [-h] [--version] COMMAND ...",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="langflash COMMAND --help lists the options of a command.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"langflash {langflash_core.__version__}")
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", required=True, prog="langflash", help=argparse.SUPPRESS
    )
    for name in [command] if command in COMMANDS else COMMANDS:
        words = import_module(f".words.{COMMANDS[name]}", __package__)
        getattr(words, f"add_{name.replace('-', '_')}")(commands)
    purposes = {name: below.description or "" for name, below in commands.choices.items()}
    about = "Makes 3D scenes from photos without poses, and finds things in them by words."
    parser.description = f"{about}\n\n{in_groups(purposes)}"
    return parser


def nearest(word: str, commands: Iterable[str]) -> str | None:
    """The command that somebody who wrote `word` most likely means: the first that begins so, or the one
    that is spelled most alike; None where none is."""
    from difflib import get_close_matches

    said, names = word.lower(), list(commands)
    begun = [name for name in names if len(said) > 1 and name.startswith(said)]
    return next(iter(begun or get_close_matches(said, names, 1)), None)


def joined(words: Sequence[str]) -> list[str]:
    """`bench network` is a command of its own, though `bench` takes a scene; ./network names a file."""
    return ["bench-network", *words[2:]] if list(words[:2]) == ["bench", "network"] else list(words)
