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
    listing = _action(actions, "list", "list stops in order, and notes")
    add_json(listing)
    _add_stop(actions)
    _add_note(actions)
    removing = _changing(actions, "remove", "remove stops and notes")
    removing.add_argument("stops", nargs="*", metavar="STOP", help="their names, or numbers from 1")
    removing.add_argument(
        "--note", nargs="+", type=whole_count, default=[], metavar="N", help="numbers, as `list` shows them"
    )
    order = _changing(actions, "order", "change the order of the stops")
    order.add_argument("stops", nargs="+", metavar="STOP", help="those that come first; the others follow")
    start = _changing(actions, "start", "choose where the scene opens")
    start.add_argument("stop", nargs="?", metavar="STOP", help="(default: where it opens without a tour)")
    out = _action(actions, "export", "the tour as JSON")
    out.add_argument("-o", "--output", required=True, type=Path, metavar="FILE", help="the .json to write")
    into = _changing(actions, "import", "a tour from JSON, instead of the scene's own")
    into.add_argument("file", type=Path, metavar="FILE", help="a file written by `langflash tour export`")


def _add_stop(actions) -> None:
    command = _changing(actions, "stop", "add a stop")
    command.add_argument("name", metavar="NAME")
    seen = command.add_mutually_exclusive_group()
    seen.add_argument(
        "--view", type=photo_index, metavar="N", help="look from this photo, counted from 1 (default: 1)"
    )
    seen.add_argument(
        "--camera",
        type=Path,
        metavar="FILE",
        help="look from this camera, as for `langflash render --camera`",
    )
    command.add_argument("--text", default="", metavar="TEXT", help="the text shown there")
    command.add_argument("--phrase", default="", metavar="PHRASE", help="the phrase asked there")
    command.add_argument(
        "--place", type=whole_count, metavar="N", help="its number among the stops, from 1 (default: last)"
    )
    command.add_argument("--start", action="store_true", help="the scene opens at this stop")


def _add_note(actions) -> None:
    command = _changing(actions, "note", "pin a note to a point or to what a phrase finds, or add a measure")
    command.add_argument("text", nargs="?", default="", metavar="TEXT", help="(default: the phrase)")
    command.add_argument(
        "--at",
        type=point,
        metavar="X,Y,Z",
        help="in scene units (default: the middle of what --phrase finds)",
    )
    command._negative_number_matcher = re.compile(r"^-[\d.]")  # a point may begin with a minus
    command.add_argument("--to", type=point, metavar="X,Y,Z", help="measure the length from --at to here")
    command.add_argument(
        "--phrase", default="", metavar="PHRASE", help="the phrase asked when the note is chosen"
    )
    add_backend(command)


def _action(actions, name: str, purpose: str):
    command = new_command(actions, name, purpose)
    command.add_argument("scene", type=Path, metavar="SCENE", help="a .langflash")
    return command


def _changing(actions, name: str, purpose: str):
    command = _action(actions, name, purpose)
    command.add_argument(
        "-o", "--output", type=Path, metavar="SCENE", help="write here (default: into the scene itself)"
    )
    return command


def add_completion(commands) -> None:
    """`langflash completion`."""
    command = new_command(
        commands,
        "completion",
        "print a script that lets a shell complete commands and options",
        epilog='bash: eval "$(langflash completion bash)"; zsh: the same with zsh; '
        "fish: langflash completion fish | source",
    )
    command.add_argument("shell", choices=SHELLS)


def add_desktop(commands) -> None:
    """`langflash desktop`."""
    command = new_command(
        commands, "desktop", "add a menu entry, and open .langflash files with a click (Linux)"
    )
    way = command.add_mutually_exclusive_group(required=True)
    way.add_argument("--install", action="store_true", help="install for this user, in the XDG folders")
    way.add_argument("--remove", action="store_true", help="remove what --install wrote")
