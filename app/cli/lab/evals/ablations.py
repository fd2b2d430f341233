"""`langflash lab eval ablations`: which part of the method pays, and what its rivals cost."""

from argparse import Namespace
from typing import TextIO

from langflash_core.base.files import check_folder, check_output_file
from langflash_core.errors import InputError

from ...report import ProgressBar, write_tables


def ablations(args: Namespace, out: TextIO) -> None:
    """Judge every rival on the same rooms.

    Raises:
        LangFlashError: cache, checkpoint or output cannot be used.
    """
    if not args.cache.is_dir():
        raise InputError(f"there is no folder {args.cache}; make it with langflash lab train cache")
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.work is not None:
        check_folder(args.work, "--work")
    from langflash_core.lab.evaluation.ablations.study import Tally, room_studies
    from langflash_core.lab.evaluation.ablations.tables import ablation_markdown, summary
    from langflash_core.lab.evaluation.tallies import Shelf, identity, intervals, merged

    key = {"weights": identity(args.weights, "mini"), "data": str(args.cache.resolve())}
    shelf = None if args.work is None else Shelf(args.work, key, Tally)
    with ProgressBar() as progress:
        _, count, studies = room_studies(
            args.cache,
            args.weights,
            limit=args.limit,
            shelf=shelf,
            progress=progress,
        )
        tallies = []
        for name, tally in studies:
            tallies.append(tally)
            progress(f"room {name}, {len(tallies)} of {count}", len(tallies) / count)
    result = {
        "weights": str(args.weights) if args.weights else "mini",
        "scenes": len(tallies),
        **summary(merged(tallies)),
        "intervals": intervals(tallies, summary),
    }
    write_tables(args, result, ablation_markdown(result), out)
