"""What many commands of the lab are told alike."""

from pathlib import Path
from typing import Any

from ...values import numbers, part, pixel_side, whole_count
from ...words.shared import add_backend, add_description, add_json


def add_path(
    command, name: str, metavar: str | tuple[str, ...], purpose: str | None = None, **more: Any
) -> None:
    """A file or a folder."""
    command.add_argument(name, type=Path, metavar=metavar, help=purpose, **more)


def add_count(command, name: str, purpose: str, usual: int | None = None, **more: Any) -> None:
    """A whole number, N."""
    command.add_argument(name, type=whole_count, default=usual, metavar="N", help=purpose, **more)


def add_folder(command, purpose: str, **more: Any) -> None:
    """Photos in a layout of ours: FOLDER, or with `name` an option for it."""
    name = more.pop("name", None)
    words = {} if name is None else {"dest": "folder"}
    add_path(command, name or "folder", "FOLDER", purpose, **words, **more)
    add_description(command)


def add_posed(command) -> None:
    """Photos instead of rooms."""
    add_folder(command, "instead, real photos of known poses", name="--posed")


def add_pack(command, purpose: str = "furniture, made by rooms pack", **more: Any) -> None:
    """PACK."""
    add_path(command, "pack", "PACK", purpose, **more)


def add_cache(command, purpose: str = "made by train cache") -> None:
    """CACHE."""
    add_path(command, "cache", "CACHE", purpose)


def add_part(command) -> None:
    """One of several processes."""
    purpose = "the I-th of N processes, from 0"
    command.add_argument("--part", type=part, default=(0, 1), metavar="I/N", help=purpose)


def add_preset(command, presets: tuple[str, ...] = ("mini",), usual: str = "mini") -> None:
    """Which network."""
    command.add_argument("--preset", choices=presets, default=usual, help=f"(default: {usual})")


def add_checkpoint(command, presets: tuple[str, ...] = ("mini",)) -> None:
    """Which network, and its weights."""
    add_preset(command, presets)
    add_path(command, "--weights", "PATH", "(default: the shipped ones)")


def add_apart(command) -> None:
    """How far two photos are from each other."""
    purpose = "numbers between two (default: 6 12 18 24)"
    command.add_argument("--apart", type=whole_count, nargs="+", metavar="N", help=purpose)


def add_lpips(command) -> None:
    """How alike pictures look."""
    add_path(command, "--lpips", "FILE", "LPIPS weights of VGG-16, .safetensors")


def add_tables(command, what: str = "the table as .md") -> None:
    """-o beside what is printed, and --json."""
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help=f"also write {what}")
    add_json(command)


def add_judging(command, presets: tuple[str, ...] = ("mini",)) -> None:
    """Which network judges, how and where, and what is written."""
    add_checkpoint(command, presets)
    purpose = "the network sees about PX x PX pixels (default: 224)"
    command.add_argument("--size", type=pixel_side, metavar="PX", help=purpose)
    add_backend(command)
    add_tables(command, "the tables as .md (default: print them)")


def add_processor(command) -> None:
    """On what it runs, the CPU unless it is said."""
    command.add_argument("--device", choices=("cpu", "cuda"), default="cpu", help="(default: cpu)")


def add_only(command) -> None:
    """Which photos, by their numbers."""
    command.add_argument("--only", type=numbers, metavar="N-M,...", help="only photos of these numbers")
