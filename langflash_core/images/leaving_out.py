"""Views without some of their photos: what a stage that leaves photos out by a rule does."""

import re
from collections.abc import Sequence
from dataclasses import replace

from langflash_core.types import Lenses, Views


def views_without(views: Views, photos: Sequence[int], notes: Sequence[str] = ()) -> Views:
    """The other photos alone, as `load_views` of them alone has them, with what people are told of it;
    warnings that name one of `photos` go.

    Raises:
        ValueError: poses are given, and 0 is left out, whose camera is the world.
    """
    if views.viewmats is not None and 0 in photos:
        raise ValueError("photos: expected none of 0, whose camera is the world of the poses")
    rows = [row for row in range(views.num_views) if row not in photos]
    names, gone = tuple(views.names[row] for row in rows), [views.names[row] for row in photos]
    lenses = None if views.lenses is None else _lenses_of(views.lenses, rows, names)
    kept = tuple(w for w in views.warnings if (lenses and w == lenses.note) or not _names_one(w, gone))
    return replace(
        views,
        images=views.images[rows],
        Ks=views.Ks[rows],
        names=names,
        sources=tuple(views.sources[row] for row in rows) if views.sources else (),
        warnings=(*kept, *notes),
        viewmats=None if views.viewmats is None else views.viewmats[rows],
        lenses=lenses,
    )


def _lenses_of(lenses: Lenses, rows: Sequence[int], names: Sequence[str]) -> Lenses:
    """Those that took one of these photos, in the order of these."""
    kept = list(dict.fromkeys(lenses.of[row] for row in rows))
    straightened = lenses.straightened and tuple(lenses.straightened[lens] for lens in kept)
    return replace(
        lenses,
        of=tuple(kept.index(lenses.of[row]) for row in rows),
        fovs=tuple(lenses.fovs[lens] for lens in kept),
        doubts=tuple(lenses.doubts[lens] for lens in kept),
        recorded=tuple(lenses.recorded[lens] for lens in kept),
        note=lenses.note if _names_one(lenses.note, names) else "",
        straightened=straightened,
    )


def _names_one(line: str, names: Sequence[str]) -> bool:
    """Whether a line names one of these photos, and not one whose name has that one in it."""
    return any(re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w.-]*\w)", line) for name in names)
