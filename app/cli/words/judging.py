"""The words of what says how fast drawing is."""

from pathlib import Path

from ..values import above_zero, atom_count, size, whole_count
from .shared import add_json, new_command

# The decisions that `bench` compares: app.bench.modes.AXES, which would bring torch along.
BENCH_AXES = ("precision", "relevance", "weights", "resolution", "detail", "rasteriser")


def add_bench(commands) -> None:
    """`langflash bench`."""
    command = new_command(
        commands, "bench", "measure how fast each way of drawing is, and what it gets wrong"
    )
    command.add_argument("scene", nargs="?", type=Path, metavar="SCENE")
    command.add_argument("--synthetic", type=whole_count, metavar="N", help="a generated room of N Gaussians")
    command.add_argument(
        "--paper",
        action="store_true",
        help="the paper's size: 131,072 Gaussians, 128 atoms, 1 and 16 phrases, 988x731 and 1920x1080",
    )
    command.add_argument(
        "--atoms", type=atom_count, metavar="K", help="generated atoms, for a scene that has none"
    )
    command.add_argument(
        "--spread", type=above_zero, metavar="F", help="generated Gaussians F times as wide: more overdraw"
    )
    command.add_argument("--prompt", nargs="+", metavar="PHRASE", help="up to 16 (default: three of a home)")
    command.add_argument(
        "--size", type=size, metavar="WxH", help="pixels to draw (default: as the network saw it)"
    )
    command.add_argument("--frames", type=whole_count, metavar="N", help="of the camera's way (default: 8)")
    command.add_argument("--only", nargs="+", choices=BENCH_AXES, help="what to compare (default: all)")
    command.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="also write bench.json and bench.csv"
    )
    add_json(command)
