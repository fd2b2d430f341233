"""`langflash lab rooms`: furnished rooms for training and tests."""

from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import check_folder, check_output_file, make_folder, readable_file
from langflash_core.errors import InputError
from langflash_core.lab.rooms.commands import run_pack, run_preview, run_render

from ..report import ProgressBar


def run(args: Namespace, out: TextIO) -> None:
    """Pack furniture, look at a contact sheet of rooms, or render rooms to files.

    Raises:
        LangFlashError: the furniture or the output cannot be used, or OpenGL is missing.
    """
    {"pack": _pack, "preview": _preview, "render": _render}[args.action](args, out)


def _pack(args: Namespace, out: TextIO) -> None:
    if not args.folder.is_dir():
        raise InputError(f"there is no folder {args.folder}; give the folder with the furniture libraries")
    check_output_file(args.output)
    make_folder(args.output.parent)
    count = run_pack(args.folder, args.output)
    print(f"{args.output}: {count} pieces of furniture", file=out)


def _preview(args: Namespace, out: TextIO) -> None:
    readable_file(args.pack, "furniture pack", InputError)
    check_output_file(args.output, (".png",))
    make_folder(args.output.parent)
    run_preview(args.pack, args.output, args.seed, args.count, args.held_out)
    print(f"{args.output}: rooms {args.seed} to {args.seed + args.count - 1}", file=out)


def _render(args: Namespace, out: TextIO) -> None:
    readable_file(args.pack, "furniture pack", InputError)
    check_folder(args.output)
    width, height = args.size
    with ProgressBar() as progress:
        rooms = run_render(
            args.pack,
            args.output,
            args.seed,
            args.count,
            args.held_out,
            num_views=args.views,
            size=(height, width),
        )
        for done, path in enumerate(rooms, 1):
            progress(path.name, done / args.count)
    print(f"{args.output}: {args.count} rooms", file=out)
