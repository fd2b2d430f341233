"""`langflash lab eval real`: frames of a real place, or a film, beside what is drawn of them."""

import io
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from langflash_core.base.files import check_output_file, make_folder, readable_file, write_atomically
from langflash_core.base.formats import is_film, is_photo
from langflash_core.errors import ImageError, InputError

from ...films import look_through
from ...renderers import open_renderer
from ...report import ProgressBar, write_tables
from ..shared import colour_only, opened_lpips

if TYPE_CHECKING:
    from ..sheets.real import Sheet

PHOTOS = (4, 8, 16)


def real(args: Namespace, out: TextIO) -> None:
    """Judge the code that makes scenes by real frames.

    Raises:
        LangFlashError: frames, checkpoint or output cannot be used.
    """
    if args.output is not None:
        check_output_file(args.output, (".md",))
    if args.sheet is not None:
        check_output_file(args.sheet, (".png",), option="--sheet")
    from langflash_core.lab.evaluation.real import Bench, judge, summary
    from langflash_core.lab.evaluation.real_tables import real_markdown

    from ..sheets.real import Sheet

    with ProgressBar() as progress, open_renderer(args.backend) as renderer:
        frames = _frames(args.frames, progress)
        bench = Bench(
            colour_only(renderer),
            args.weights,
            args.size,
            args.fused,
            not args.no_own,
            opened_lpips(args.lpips),
        )
        cases, sheet = [], Sheet()
        for photos in sorted(set(args.photos or (n for n in PHOTOS if 2 * n - 1 <= len(frames)))):
            sheet = Sheet()
            cases.append(judge(frames, photos, bench, progress, sheet.shown))
    if not cases:
        raise InputError(f"{len(frames)} frames are too few; give 7 or more, or choose with --photos")
    if args.sheet is not None:
        _write(args.sheet, sheet)
    result = summary(cases)
    write_tables(args, result, real_markdown(result), out)


def _frames(given: Path, progress: ProgressBar) -> list[Path]:
    """Pictures of a folder in the order of their names, or the stills of a film.

    Raises:
        InputError: there is neither. FilmError: the film cannot be used.
    """
    if given.is_dir():
        return sorted(path for path in given.iterdir() if is_photo(path))
    if not is_film(given):
        raise InputError(f"{given} is neither a folder of frames nor a film; name one")
    readable_file(given, "film", ImageError)
    strip = look_through(given, progress)
    return [strip.path(index) for index in range(len(strip.stills))]


def _write(path: Path, sheet: "Sheet") -> None:
    stream = io.BytesIO()
    sheet.drawn().save(stream, "PNG")
    make_folder(path.parent)
    write_atomically(path, stream.getvalue())
