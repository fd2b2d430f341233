"""What the program can do, for people: the commands of a first day, and all commands in groups. Only the
standard library is imported here."""

import shutil
from collections.abc import Mapping
from textwrap import fill

LAB = ("rooms", "labels", "train", "eval", "bench-network")
"""Commands of `langflash lab`, which make and judge the weights."""

GROUPS = {
    "make scenes": ("reconstruct", "add", "frames", "batch", "lift"),
    "ask them": ("query", "inventory", "info", "words"),
    "show them": ("view", "render", "tour"),
    "edit them": ("clean", "hide", "level"),
    "share them": ("export",),
    "this program": ("weights", "bench", "completion", "desktop"),
    "the lab": ("lab",),
}
"""Every command, under the heading that `--help` gives it."""

FIRST_DAY = {
    "reconstruct photos/ -o room.langflash": "make a scene from photos",
    "view room.langflash": "open it in the window",
    'query room.langflash "armchair"': "find a thing in it",
    "render room.langflash -o room.png": "draw a picture of it",
    "export room.langflash -o room.html": "write it as a web page",
}
"""The words after `langflash` of an example each, and what it does."""

_INDENT = " " * 17  # two spaces, the longest command of 13 letters, two spaces


def first_day() -> str:
    """What `langflash` alone says."""
    wide = max(map(len, FIRST_DAY))
    examples = (f"  langflash {words:<{wide}}  {purpose}" for words, purpose in FIRST_DAY.items())
    return "\n".join(
        (
            "LangFlash makes 3D scenes from photos and finds things in them. To start:",
            "",
            *examples,
            "",
            "langflash --help lists all commands, langflash COMMAND --help its options.",
        )
    )


def in_groups(purposes: Mapping[str, str]) -> str:
    """The commands that have purposes, a line or several each, as wide as the terminal."""
    width = max(shutil.get_terminal_size().columns - 2, 2 * len(_INDENT))  # argparse leaves two, too
    blocks = []
    for heading, names in GROUPS.items():
        lines = [
            fill(purposes[name], width, initial_indent=f"  {name:<13}  ", subsequent_indent=_INDENT)
            for name in names
            if name in purposes
        ]
        blocks.append("\n".join((f"{heading}:", *lines)) if lines else "")
    return "\n\n".join(filter(None, blocks))
