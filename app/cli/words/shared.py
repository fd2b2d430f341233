"""What several commands are told in the same words."""

import argparse
from pathlib import Path

from langflash_core.base.detail import DEFAULT_DETAIL, DETAILS, FEWEST, MOST
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


def add_output(
    command: argparse.ArgumentParser, metavar: str, purpose: str, *, required: bool = True
) -> None:
    """-o, where the command writes; where it is not `required`, the command can do without."""
    command.add_argument("-o", "--output", required=required, type=Path, metavar=metavar, help=purpose)


def add_network(command: argparse.ArgumentParser) -> None:
    """Which network sees the photos, how large, and where."""
    command.add_argument(
        "--preset", choices=("mini", "full"), default="mini", help="which network to use (default: mini)"
    )
    command.add_argument(
        "--weights",
        type=Path,
        metavar="PATH",
        help="use this checkpoint instead of the shipped or imported ones",
    )
    command.add_argument(
        "--size",
        type=pixel_side,
        metavar="PX",
        help="resize photos to about PX x PX pixels for the network (default: 224; full: 256)",
    )
    command.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")


def add_film_part(command: argparse.ArgumentParser) -> None:
    """Which part of a film counts."""
    command.add_argument(
        "--from",
        dest="start",
        type=film_time,
        default=0.0,
        metavar="S",
        help="start at this second of the film",
    )
    command.add_argument(
        "--to", dest="end", type=film_time, metavar="S", help="stop at this second of the film"
    )


def add_detail(command: argparse.ArgumentParser) -> None:
    """How many Gaussians a scene gets, and so how fine it is."""
    command.add_argument(
        "--detail",
        choices=tuple(DETAILS),
        default=DEFAULT_DETAIL,
        help="how fine the scene is: normal makes about 240,000 Gaussians from two photos, high 1.6 times as "
        f"many, low a third; preset mini only (default: {DEFAULT_DETAIL})",
    )
    command.add_argument(
        "--gaussians",
        type=gaussian_count,
        metavar="N",
        help=f"make about N Gaussians, {FEWEST:,} to {MOST:,}, instead of what --detail says",
    )


def add_colours(command: argparse.ArgumentParser) -> None:
    """How heat-maps are coloured."""
    command.add_argument(
        "--colormap",
        choices=COLOUR_MAPS,
        default=COLOUR_MAPS[0],
        help=f"colours of heat-maps (default: {COLOUR_MAPS[0]}, readable for colour-blind eyes)",
    )
    command.add_argument(
        "--span", type=span, metavar="LOW,HIGH", help="relevance that the first and the last colour stand for"
    )


def add_camera(command: argparse.ArgumentParser) -> None:
    """From where, and how large."""
    camera = command.add_mutually_exclusive_group()
    camera.add_argument(
        "--view", type=photo_index, metavar="N", help="look from this photo, counted from 1 (default: 1)"
    )
    camera.add_argument(
        "--camera",
        type=Path,
        metavar="FILE",
        help="look from this camera: JSON with viewmat (4 x 4), K (3 x 3), width and height",
    )
    command.add_argument(
        "--size",
        type=size,
        metavar="WxH",
        help="size in pixels (default: that of the photo in the scene)",
    )
    command.add_argument(
        "--ortho",
        action="store_const",
        const=True,
        help="orthographic (parallel rays) instead of perspective, at the scale of the picture's middle",
    )


def add_shown(command: argparse.ArgumentParser) -> None:
    """What a picture does where the scene knows little."""
    command.add_argument("--fade", action="store_true", help="fade out what no photo saw from near this view")
    command.add_argument(
        "--fill", action="store_true", help="fill gaps from what is around them, as the window does"
    )


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
    command.add_argument("--json", action="store_true", help="print one JSON document and nothing else")


def add_description(command: argparse.ArgumentParser) -> None:
    """What a folder of photos may not say of itself."""
    command.add_argument(
        "--crop",
        type=crop,
        metavar="LEFT,TOP,RIGHT,BOTTOM",
        help="part of every photo that counts, in pixels",
    )
    command.add_argument(
        "--intrinsics", type=intrinsics, metavar="FX,FY,CX,CY", help="in pixels of the photos before the crop"
    )
    command.add_argument(
        "--depth-unit", type=above_zero, metavar="METRES", help="a step of the depth maps (16 bits: 0.001)"
    )
