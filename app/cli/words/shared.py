"""What several commands are told in the same words."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from langflash_core.base.detail import DEFAULT_DETAIL, DETAILS, FEWEST, MOST
from langflash_core.base.devices import DEVICES
from langflash_core.base.formats import AXES, COLOUR_MAPS

from ..values import (
    above_zero,
    crop,
    film_time,
    gaussian_count,
    intrinsics,
    photo_index,
    pixel_side,
    size,
    span,
)


def new_command(commands, name: str, purpose: str, **more) -> argparse.ArgumentParser:
    """A command of the table, with its purpose where help is asked for."""
    return commands.add_parser(name, help=purpose, description=purpose, allow_abbrev=False, **more)


def new_actions(commands, name: str, purpose: str):
    """A command that has commands of its own."""
    command = new_command(commands, name, purpose)
    return command.add_subparsers(dest="action", metavar="ACTION", required=True)


def add_value(
    command: argparse._ActionsContainer,
    said: str,
    read: Callable[[str], Any] = str,
    purpose: str | None = None,
    **more: Any,
) -> None:
    """What takes a value, read by `read`; said as in help: "--frames N", or "scene SCENE" of a bare word."""
    *names, metavar = said.split()
    command.add_argument(*names, type=read, metavar=metavar, help=purpose, **more)


def add_switch(command: argparse._ActionsContainer, name: str, purpose: str) -> None:
    """An option without a value, off unless it is given."""
    command.add_argument(name, action="store_true", help=purpose)


def add_output(
    command: argparse.ArgumentParser, metavar: str, purpose: str, *, required: bool = True, **more: Any
) -> None:
    """-o, where the command writes; where it is not `required`, the command can do without."""
    add_value(command, f"-o --output {metavar}", Path, purpose, required=required, **more)


def add_network(command: argparse.ArgumentParser) -> None:
    """Which network sees the photos, how large, and where."""
    command.add_argument(
        "--preset", choices=("mini", "full"), default="mini", help="which network to use (default: mini)"
    )
    add_value(command, "--weights PATH", Path, "use this checkpoint instead of the shipped or imported ones")
    add_value(
        command,
        "--size PX",
        pixel_side,
        "resize photos to about PX x PX pixels for the network (default: 224; full: 256)",
    )
    add_device(command)


def add_device(command: argparse.ArgumentParser) -> None:
    """What the network runs on."""
    command.add_argument("--device", choices=DEVICES, default="auto")


def add_film_part(command: argparse.ArgumentParser) -> None:
    """Which part of a film counts."""
    add_value(command, "--from S", film_time, "start at this second of the film", dest="start", default=0.0)
    add_value(command, "--to S", film_time, "stop at this second of the film", dest="end")


def add_detail(command: argparse.ArgumentParser) -> None:
    """How many Gaussians a scene gets, and so how fine it is."""
    command.add_argument(
        "--detail",
        choices=tuple(DETAILS),
        default=DEFAULT_DETAIL,
        help="how fine the scene is: normal makes about 240,000 Gaussians from two photos, high 1.6 times as "
        f"many, low a third; preset mini only (default: {DEFAULT_DETAIL})",
    )
    add_value(
        command,
        "--gaussians N",
        gaussian_count,
        f"make about N Gaussians, {FEWEST:,} to {MOST:,}, instead of what --detail says",
    )


def add_colours(command: argparse.ArgumentParser) -> None:
    """How heat-maps are coloured."""
    command.add_argument(
        "--colormap",
        choices=COLOUR_MAPS,
        default=COLOUR_MAPS[0],
        help=f"colours of heat-maps (default: {COLOUR_MAPS[0]}, readable for colour-blind eyes)",
    )
    add_value(command, "--span LOW,HIGH", span, "relevance that the first and the last colour stand for")


def add_place(command: argparse.ArgumentParser, described: str) -> None:
    """From where; described: what is said of the camera's file."""
    place = command.add_mutually_exclusive_group()
    add_value(place, "--view N", photo_index, "look from this photo, counted from 1 (default: 1)")
    add_value(place, "--camera FILE", Path, f"look from this camera{described}")


def add_camera(command: argparse.ArgumentParser) -> None:
    """From where, and how large."""
    add_place(command, ": JSON with viewmat (4 x 4), K (3 x 3), width and height")
    add_value(command, "--size WxH", size, "size in pixels (default: that of the photo in the scene)")
    command.add_argument(
        "--ortho",
        action="store_const",
        const=True,
        help="orthographic (parallel rays) instead of perspective, at the scale of the picture's middle",
    )


def add_shown(command: argparse.ArgumentParser) -> None:
    """What a picture does where the scene knows little."""
    add_switch(command, "--fade", "fade out what no photo saw from near this view")
    add_switch(command, "--fill", "fill gaps from what is around them, as the window does")


def add_backend(command: argparse.ArgumentParser) -> None:
    """Who draws."""
    command.add_argument(
        "--backend",
        choices=("gl", "torch"),
        help="what draws: gl, the window's renderer, or torch, the slow reference (default: gl if OpenGL "
        "works)",
    )


def add_axes(command: argparse.ArgumentParser, written: bool = False) -> None:
    """Of a .spz, which may not say them; also of one that is written."""
    command.add_argument(
        "--axes",
        type=str.lower,
        choices=AXES,
        metavar="AXES",
        help="of a .spz that does not say: where its x, y and z point; rub: right, up, back, as the "
        "format has it (default); rdf: right, down, front, as SuperSplat and splat-transform write it;"
        " others alike" + ("; a .spz that is written gets these axes, and says so" if written else ""),
    )


def add_json(command: argparse.ArgumentParser) -> None:
    """One document for programs instead of lines for people."""
    add_switch(command, "--json", "print one JSON document and nothing else")


def add_description(command: argparse.ArgumentParser) -> None:
    """What a folder of photos may not say of itself."""
    add_value(command, "--crop LEFT,TOP,RIGHT,BOTTOM", crop, "part of every photo that counts, in pixels")
    add_value(command, "--intrinsics FX,FY,CX,CY", intrinsics, "in pixels of the photos before the crop")
    add_value(command, "--depth-unit METRES", above_zero, "a step of the depth maps (16 bits: 0.001)")
