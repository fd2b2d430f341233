"""The words of showing scenes to others: tours, completion of commands, the desktop."""

import re
from pathlib import Path

from ..values import photo_index, point, whole_count
from .shared import add_backend, add_json, new_actions, new_command

SHELLS = ("bash", "zsh", "fish")


def add_tour(commands) -> None:
    """`langflash tour`."""
    actions = new_actions(
        commands, "tour", "make a guided tour of a scene: named views, pinned notes and measures"
    )
    listing = _action(actions, "list", "its stops, in order, and its notes")
    add_json(listing)
    _add_stop(actions)
    _add_note(actions)
    removing = _changing(actions, "remove", "take stops and notes away")
    removing.add_argument("stops", nargs="*", metavar="STOP", help="names, or numbers from 1")
    removing.add_argument(
        "--note", nargs="+", type=whole_count, default=[], metavar="N", help="numbers, as `list` has them"
    )
    order = _changing(actions, "order", "the stops in another order")
    order.add_argument("stops", nargs="+", metavar="STOP", help="those that come first; the others follow")
    start = _changing(actions, "start", "where the scene opens")
    start.add_argument("stop", nargs="?", metavar="STOP", help="(default: where it opens without a tour)")
    out = _action(actions, "export", "the tour as JSON")
    out.add_argument("-o", "--output", required=True, type=Path, metavar="FILE", help="the .json to write")
    into = _changing(actions, "import", "a tour from JSON, instead of the scene's own")
    into.add_argument("file", type=Path, metavar="FILE", help="as `langflash tour export` writes it")
    into.add_argument("--add", action="store_true", help="behind the scene's own stops and notes")


def _add_stop(actions) -> None:
    command = _changing(actions, "stop", "one more stop")
    command.add_argument("name", metavar="NAME")
    seen = command.add_mutually_exclusive_group()
    seen.add_argument(
        "--view", type=photo_index, metavar="N", help="as that photo saw it, from 1 (default: 1)"
    )
    seen.add_argument("--camera", type=Path, metavar="FILE", help="as of `langflash render --camera`")
    command.add_argument("--text", default="", metavar="TEXT", help="what is told there")
    command.add_argument("--phrase", default="", metavar="PHRASE", help="what is asked there")
    command.add_argument(
        "--place", type=whole_count, metavar="N", help="in the order, from 1 (default: last)"
    )
    command.add_argument("--start", action="store_true", help="the scene opens there")


def _add_note(actions) -> None:
    command = _changing(actions, "note", "words pinned to a point, or to what a phrase finds, or a measure")
    command.add_argument("text", nargs="?", default="", metavar="TEXT", help="(default: the phrase)")
    command.add_argument(
        "--at",
        type=point,
        metavar="X,Y,Z",
        help="in scene units (default: the middle of what --phrase finds)",
    )
    command._negative_number_matcher = re.compile(r"^-[\d.]")  # a point may begin with a minus
    command.add_argument("--to", type=point, metavar="X,Y,Z", help="measures the length from --at to there")
    command.add_argument(
        "--phrase", default="", metavar="PHRASE", help="what is asked by who chooses the note"
    )
    add_backend(command)


def _action(actions, name: str, purpose: str):
    command = new_command(actions, name, purpose)
    command.add_argument("scene", type=Path, metavar="SCENE", help="a .langflash")
    return command


def _changing(actions, name: str, purpose: str):
    command = _action(actions, name, purpose)
    command.add_argument(
        "-o", "--output", type=Path, metavar="SCENE", help="write there (default: into the scene itself)"
    )
    return command


def add_completion(commands) -> None:
    """`langflash completion`."""
    command = new_command(
        commands,
        "completion",
        "print what makes a shell complete commands, options and their words",
        epilog='bash: eval "$(langflash completion bash)"; zsh: the same with zsh; '
        "fish: langflash completion fish | source",
    )
    command.add_argument("shell", choices=SHELLS)


def add_desktop(commands) -> None:
    """`langflash desktop`."""
    command = new_command(
        commands, "desktop", "add an entry to the menu, and open .langflash files by a click (Linux)"
    )
    way = command.add_mutually_exclusive_group(required=True)
    way.add_argument("--install", action="store_true", help="for this user, in the XDG folders")
    way.add_argument("--remove", action="store_true", help="take away what --install wrote")
