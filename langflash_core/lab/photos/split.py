"""Which photos of a folder are learned from and which are kept to validate.

Neighbours in number are often the same room, so photos are never drawn at random: numbers fall into
runs without a gap, and every seventh run, from the fourth on, is kept whole. In NYU Depth v2 the gaps
of the training split are the test split's rooms, hence no room is on both sides.
"""

from collections.abc import Iterable, Sequence

from langflash_core.errors import InputError

PARTS = ("all", "train", "validation")
EVERY, FROM = 7, 3


def runs(ids: Sequence[str]) -> list[list[str]]:
    """Ids in order cut wherever the number does not go on by 1; an id that is no number is a run."""
    found: list[list[str]] = []
    last = None
    for id in ids:
        number = int(id) if id.isdigit() else None
        if found and number is not None and last is not None and number == last + 1:
            found[-1].append(id)
        else:
            found.append([id])
        last = number
    return found


def chosen_ids(
    ids: Sequence[str], part: str = "all", only: Iterable[tuple[int, int]] | None = None
) -> tuple[str, ...]:
    """Ids, in order, of one of `PARTS`, and of these only the numbers inside `only`, ends included.

    Raises:
        InputError: nothing is left.
    """
    if part not in PARTS:
        raise ValueError(f"part: expected one of {', '.join(PARTS)}, received {part!r}")
    kept = list(ids)
    if part != "all":
        validation = {id for run in runs(ids)[FROM::EVERY] for id in run}
        kept = [id for id in ids if (id in validation) == (part == "validation")]
    if only is not None:
        ranges = list(only)
        kept = [id for id in kept if id.isdigit() and any(low <= int(id) <= high for low, high in ranges)]
    if not kept:
        raise InputError(f"none of the {len(ids)} photos is chosen; choose another --part or --only")
    return tuple(kept)
