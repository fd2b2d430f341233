"""Folders of labelled photos on the command line: opened as the options describe them, and chosen from."""

from argparse import Namespace

from langflash_core.lab.photos import PhotoFolder, chosen_ids, open_folder


def opened_folder(args: Namespace) -> PhotoFolder:
    """The folder `args.folder` with --crop, --intrinsics and --depth-unit.

    Raises:
        InputError: it cannot be used.
    """
    folder = open_folder(args.folder)
    return folder.described(args.crop, args.intrinsics, args.depth_unit)


def chosen(args: Namespace, folder: PhotoFolder) -> tuple[str, ...]:
    """Ids that --part, --only and --limit leave; a limit takes them evenly from all.

    Raises:
        InputError: none is left.
    """
    ids = chosen_ids(folder.ids, args.part, args.only)
    if args.limit is None or args.limit >= len(ids):
        return ids
    return tuple(ids[(2 * k + 1) * len(ids) // (2 * args.limit)] for k in range(args.limit))
