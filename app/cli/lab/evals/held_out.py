"""What commands that judge held-out rooms are given: furniture, and the numbers of the rooms."""

from argparse import Namespace

from langflash_core.base.files import check_folder, check_output_file, readable_file
from langflash_core.errors import InputError
from langflash_core.lab.rooms import Pack, load_pack
from langflash_core.lab.training.cache import HELD_OUT_SEED


def held_out(args: Namespace, rooms: int) -> tuple[Pack, range]:
    """The pack and the rooms' seeds, `rooms` unless --limit says how many; output and folder can be written.

    Raises:
        LangFlashError: the pack, the folder or the output cannot be used.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.keep is not None:
        check_folder(args.keep, "--keep")
    pack = load_pack(readable_file(args.pack, "furniture pack", InputError))
    return pack, range(HELD_OUT_SEED, HELD_OUT_SEED + (args.limit or rooms))
