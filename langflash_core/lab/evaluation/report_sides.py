"""The section of a report that walks around scenes: rooms seen from aside, kept room by room."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from langflash_core.lab.evaluation.labelled import Render
from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.posed import scene_of
from langflash_core.lab.evaluation.report_parts import Table
from langflash_core.lab.evaluation.side_subjects import Case, room_cases
from langflash_core.lab.evaluation.side_tables import LOOKS, ONCE, place_name, told
from langflash_core.lab.evaluation.sides import judge, summary
from langflash_core.lab.evaluation.tallies import Shelf, collected
from langflash_core.lab.rooms import RoomRenderer, load_pack
from langflash_core.reconstruction.networks import Networks


@dataclass
class Tally:
    """Rows of `sides.judge`, one a room."""

    rows: list[dict] = field(default_factory=list)


def side_tallies(
    pack: Path,
    count: int,
    render: Render,
    weights: Path | None = None,
    *,
    preset: str = "mini",
    lpips: Lpips | None = None,
    shelf: Shelf | None = None,
) -> Iterator[tuple[str, Tally]]:
    """Seed and tally of every room, in order; those on the shelf are not judged again.

    Raises:
        InputError: the pack cannot be used. WeightsError: the checkpoint does not fit.
    """
    networks = Networks()

    def judged(case: Case) -> Tally:
        scene, seconds = scene_of(
            case.photos, case.intrinsics, weights=weights, preset=preset, networks=networks
        )
        row = judge(scene, case.truth(scene.view_size), render, lpips)
        return Tally([{"name": case.name, "seconds": round(seconds, 3), **row}])

    furniture = load_pack(pack)
    with RoomRenderer(furniture) as renderer:
        cases = room_cases(furniture, renderer, count=count)
        yield from collected(((case.name, case) for case in cases), judged, shelf)


def side_summary(tally: Tally) -> dict:
    """Means over rooms, without the rooms themselves; plain JSON."""
    found = summary(tally.rows)
    return {"measures": found["measures"], "by_look": found["by_look"]}


def side_tables(result: dict) -> tuple[Table, Table]:
    """What a scene has once, and what it shows by where it is seen from."""
    measures, looks = result["measures"], result["by_look"]
    once = [(title, told(key, measures[key])) for title, key in ONCE if measures.get(key) is not None]
    columns = [(title, key) for title, key in LOOKS if any(key in row for row in looks.values())]
    rows = [
        (place_name(group), str(row["cases"]), *(told(key, row.get(key)) for _, key in columns))
        for group, row in looks.items()
    ]
    header = ("seen from", "scenes", *(title for title, _ in columns))
    return Table("Scenes", ("measure", "mean"), once), Table("Looks", header, rows)
