"""The words of showing scenes to others, of how fast they are drawn, and of shells and the desktop."""

import re
from pathlib import Path

from ..values import above_zero, atom_count, point, size, whole_count
from .shared import (
    add_backend,
    add_json,
    add_output,
    add_place,
    add_switch,
    add_value,
    new_actions,
    new_command,
)

SHELLS = ("bash", "zsh", "fish")
# The decisions that `bench` compares: app.bench.modes.AXES, which would bring torch along.
BENCH_AXES = ("precision", "relevance", "weights", "resolution", "detail", "rasteriser")


def add_tour(commands) -> None:
    """`langflash tour`."""
    purpose = "make a guided tour of a scene: named views, pinned notes and measures"
    actions = new_actions(commands, "tour", purpose)
    add_json(_action(actions, "list", "list stops in order, and notes"))
    _add_stop(actions)
    _add_note(actions)
    removing = _changing(actions, "remove", "remove stops and notes")
    add_value(removing, "stops STOP", str, "their names, or numbers from 1", nargs="*")
    told = "numbers, as `list` shows them"
    add_value(removing, "--note N", whole_count, told, nargs="+", default=[])
    order = _changing(actions, "order", "change the order of the stops")
    add_value(order, "stops STOP", str, "those that come first; the others follow", nargs="+")
    start = _changing(actions, "start", "choose where the scene opens")
    add_value(start, "stop STOP", str, "(default: where it opens without a tour)", nargs="?")
    add_output(_action(actions, "export", "the tour as JSON"), "FILE", "the .json to write")
    into = _changing(actions, "import", "a tour from JSON, instead of the scene's own")
    add_value(into, "file FILE", Path, "a file written by `langflash tour export`")


def _add_stop(actions) -> None:
    command = _changing(actions, "stop", "add a stop")
    add_value(command, "name NAME")
    add_place(command, ", as for `langflash render --camera`")
    add_value(command, "--text TEXT", str, "the text shown there", default="")
    add_value(command, "--phrase PHRASE", str, "the phrase asked there", default="")
    add_value(command, "--place N", whole_count, "its number among the stops, from 1 (default: last)")
    add_switch(command, "--start", "the scene opens at this stop")


def _add_note(actions) -> None:
    command = _changing(actions, "note", "pin a note to a point or to what a phrase finds, or add a measure")
    add_value(command, "text TEXT", str, "(default: the phrase)", nargs="?", default="")
    add_value(command, "--at X,Y,Z", point, "in scene units (default: the middle of what --phrase finds)")
    command._negative_number_matcher = re.compile(r"^-[\d.]")  # a point may begin with a minus
    add_value(command, "--to X,Y,Z", point, "measure the length from --at to here")
    add_value(command, "--phrase PHRASE", str, "the phrase asked when the note is chosen", default="")
    add_backend(command)


def _action(actions, name: str, purpose: str):
    command = new_command(actions, name, purpose)
    add_value(command, "scene SCENE", Path, "a .langflash")
    return command


def _changing(actions, name: str, purpose: str):
    command = _action(actions, name, purpose)
    add_output(command, "SCENE", "write here (default: into the scene itself)", required=False)
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
    purpose = "add a menu entry, and open .langflash files with a click (Linux)"
    way = new_command(commands, "desktop", purpose).add_mutually_exclusive_group(required=True)
    add_switch(way, "--install", "install for this user, in the XDG folders")
    add_switch(way, "--remove", "remove what --install wrote")


def add_bench(commands) -> None:
    """`langflash bench`."""
    purpose = "measure how fast each way of drawing is, and what it gets wrong"
    command = new_command(commands, "bench", purpose)
    add_value(command, "scene SCENE", Path, nargs="?")
    add_value(command, "--synthetic N", whole_count, "a generated room of N Gaussians")
    told = "the paper's size: 131,072 Gaussians, 128 atoms, 1 and 16 phrases, 988x731 and 1920x1080"
    add_switch(command, "--paper", told)
    add_value(command, "--atoms K", atom_count, "generated atoms, for a scene that has none")
    add_value(command, "--spread F", above_zero, "generated Gaussians F times as wide: more overdraw")
    add_value(command, "--prompt PHRASE", str, "up to 16 (default: three of a home)", nargs="+")
    add_value(command, "--size WxH", size, "pixels to draw (default: as the network saw it)")
    add_value(command, "--frames N", whole_count, "of the camera's way (default: 8)")
    command.add_argument("--only", nargs="+", choices=BENCH_AXES, help="what to compare (default: all)")
    add_output(command, "FOLDER", "also write bench.json and bench.csv", required=False)
    add_json(command)
