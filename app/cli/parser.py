"""The words of the command line. Only the standard library is imported here."""

import argparse
from collections.abc import Iterable
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NoReturn

import langflash_core
from langflash_core.errors import InputError

from .overview import LAB, in_groups

_SCENES, _SHOWING = "words.scenes", "words.showing"
COMMANDS = {
    "view": _SCENES,
    "reconstruct": _SCENES,
    "add": _SCENES,
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
    "bench": _SHOWING,
    "weights": _SCENES,
    "words": _SCENES,
    "desktop": _SHOWING,
    "completion": _SHOWING,
    "lab": "lab.words",
}
"""Every command, and the module whose `add_COMMAND` has its words."""


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
        if value in LAB and self.prog == "langflash":
            raise UsageError(f'"{value}" is a command of the lab; {lab_remedy(value)}')
        if value == "lab":  # of a wheel, which leaves it out
            raise UsageError(f"the lab is not installed; {lab_remedy()}")
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
    there = [name for name in COMMANDS if name != "lab" or has_lab()]
    for name in [command] if command in there else there:
        words = import_module(f".{COMMANDS[name]}", __package__)
        getattr(words, f"add_{name.replace('-', '_')}")(commands)
    purposes = {name: below.description or "" for name, below in commands.choices.items()}
    about = "Makes 3D scenes from photos without poses, and finds things in them by words."
    parser.description = f"{about}\n\n{in_groups(purposes)}"
    return parser


def has_lab() -> bool:
    """Whether the commands that make and judge weights are here: a wheel leaves them out."""
    return find_spec(f"{__package__}.lab") is not None


def lab_remedy(command: str = "") -> str:
    """What helps somebody who asks for the lab or for a command of it."""
    said = " ".join(("langflash lab", command)).strip()
    if has_lab():
        return f'did you mean "{said}"?'
    return f'"{said}" runs in a checkout of the repository, after pip install -e ".[training]"'


def nearest(word: str, commands: Iterable[str]) -> str | None:
    """The command that somebody who wrote `word` most likely means: the first that begins so, or the one
    that is spelled most alike; None where none is."""
    from difflib import get_close_matches

    said, names = word.lower(), list(commands)
    begun = [name for name in names if len(said) > 1 and name.startswith(said)]
    return next(iter(begun or get_close_matches(said, names, 1)), None)
