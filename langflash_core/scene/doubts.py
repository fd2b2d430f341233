"""Which photos of a scene do not look right at or beside their own places, and what helps. Imports no torch.

Three things are told of a photo: its neighbours do not meet it, so the way past it looks torn (`foreseen`);
hardly any other photo shows what it shows; or its own layer is not like it. What its file itself shows, blur
and darkness, is among the scene's warnings, under its name.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from langflash_core.base.records import Record
from langflash_core.scene.settings import DOUBTS

_REMEDY = "take more photos {}, with more light, and hold still"
_AGAIN = "take {} again with more light, and hold still"
_REWORDED = ("as it is wide, only its centre", "as wide, only the centre")
"""What notes in files of before say, and how it is said now."""


def doubtful(record: Record, num_views: int) -> dict[int, str]:
    """What is wrong with each photo that does not look right, and what helps, a line each; by view. What is
    missing in the record, or speaks of other views, says nothing."""
    found = _Found.of(record, num_views)
    said: dict[int, list[str]] = {view: [] for view in range(num_views)}
    for view in found.torn:
        said[view].append(f"It does not meet the photos beside it; {_REMEDY.format(found.gap(view))}.")
    for view in found.alone:
        said[view].append(f"It stands alone; {_REMEDY.format(found.gap(view))}.")
    for view in found.blurred:
        said[view].append(f"The scene is blurred where it was taken; {_AGAIN.format('it')}.")
    for view, name in enumerate(record.photos[:num_views]):
        said[view] += [f"{note}." for note in record.warnings if note.startswith(f"{name} is ")]
    return {view: "\n".join(lines) for view, lines in said.items() if lines}


def told_warnings(record: Record, num_views: int) -> tuple[str, ...]:
    """A scene's warnings, and which of its photos do not look right."""
    line = doubt_line(record, num_views)
    return (*join_alike(record.warnings, record.photos), *((line,) if line else ()))


def join_alike(notes: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Notes of photos so named, with those that say the same of several as one: "photos 3 and 5 are dark". Of
    photos that were left out, which have no number, "NAME: what became of it" is joined by names, and so are
    those of which another has the name."""
    of_whom: dict[str, list[str]] = {}
    for note in (note.replace(*_REWORDED) for note in notes):
        named = next((name for name in names if name and note.startswith(f"{name} ")), "")
        who = named or (note.partition(": ")[0] if ": " in note else "")
        of_whom.setdefault(note[len(who) :], []).append(who)
    told = list[str]()
    for said, who in of_whom.items():
        numbered = all(names.count(name) == 1 for name in who)
        subject = _photos([names.index(name) for name in who]) if numbered else _list_some(who)
        told.append(f"{subject}{_plural(said)}" if len(who) > 1 and all(who) else f"{who[0]}{said}")
    return tuple(told)


def doubt_line(record: Record, num_views: int) -> str:
    """All photos that do not look right in one sentence, as warnings are; "" where there is none."""
    found = _Found.of(record, num_views)
    whole = (
        (found.torn, "does not meet the photos beside it", "do not meet the photos beside them"),
        (found.alone, "stands alone", "stand alone"),
        (found.blurred, "is blurred where it was taken", "are blurred where they were taken"),
    )
    parts = [f"{_photos(views)} {one if len(views) == 1 else many}" for views, one, many in whole if views]
    if 1 < num_views == len(found.torn):
        parts[0] = f"none of the {num_views} photos meets those beside it"
    if not parts:
        return ""
    gaps = list(dict.fromkeys(found.gap(view) for view in sorted((*found.torn, *found.alone))))
    if not gaps:
        return f"{_list_parts(parts)}; {_AGAIN.format('it' if len(found.blurred) == 1 else 'them')}"
    where = _list_parts(gaps) if len(gaps) <= DOUBTS.told else "between them and their neighbours"
    return f"{_list_parts(parts)}; {_REMEDY.format(where)}"


@dataclass(frozen=True)
class _Found:
    """Views that are torn, alone and blurred; of each view the one beside it."""

    torn: Sequence[int] = ()
    alone: Sequence[int] = ()
    blurred: Sequence[int] = ()
    nearest: Sequence[float] = ()

    @staticmethod
    def of(record: Record, num_views: int) -> "_Found":
        near = _numbers(record.detail, "photos_psnr_db", num_views)
        blurred = [view for view, value in enumerate(near) if value is not None and value < DOUBTS.blurred]
        columns = [_numbers(record.foreseen, name, num_views) for name in ("covered", "alike", "nearest")]
        rows = list(zip(*columns, strict=True)) if all(columns) else []
        nearest = [beside for _, _, beside in rows if beside in range(num_views)]
        if len(nearest) < num_views:  # nothing is known, or another version means something else
            return _Found(blurred=blurred)
        alone = [
            view for view, (shown, _, _) in enumerate(rows) if shown is not None and shown < DOUBTS.alone
        ]
        torn = [view for view, (_, like, _) in enumerate(rows) if like is not None and like < DOUBTS.torn]
        return _Found([view for view in torn if view not in alone], alone, blurred, nearest)

    def gap(self, view: int) -> str:
        """Where a photo is missing, counted from 1."""
        first, second = sorted((view, int(self.nearest[view])))
        return f"between {first + 1} and {second + 1}"


def _numbers(told: Mapping[str, Any], name: str, count: int) -> list[float | None]:
    """A number or None for each of so many views; [] where something else is said."""
    values = told.get(name)
    if not isinstance(values, list | tuple) or len(values) != count:
        return []
    known = all(v is None or (isinstance(v, int | float) and not isinstance(v, bool)) for v in values)
    return list(values) if known else []


def _photos(views: Sequence[int]) -> str:
    """Counted from 1."""
    return f"photo{'s' * (len(views) > 1)} {_list_some([str(view + 1) for view in views])}"


def _list_some(names: Sequence[str]) -> str:
    named, more = list(names[: DOUBTS.told]), len(names) - DOUBTS.told
    if more > 0:
        named.append("another one" if more == 1 else f"{more} others")
    return _list_parts(named)


def _plural(said: str) -> str:
    """What is said of one photo, of several."""
    for one, many in ((" is ", " are "), (" has ", " have ")):
        said = said.replace(one, many, 1) if said.startswith(one) else said
    return said.replace(" of it ", " of each ").replace(" it is ", " they are ").replace(" it ", " them ")


def _list_parts(parts: Sequence[str]) -> str:
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else parts[0]
