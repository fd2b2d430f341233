"""The things of a room as a table and as one document."""

import csv
import io
import json
from dataclasses import asdict
from typing import Any

from langflash_core.base.records import world_to_json
from langflash_core.inventory.beside import Difference, Pair
from langflash_core.inventory.plan import Opening, Plan, PlanWall
from langflash_core.inventory.things import Inventory, Thing

COLUMNS = (
    "id", "name", "kind", "sure", "width", "depth", "height", "bottom", "east", "north", "turn", "photos",
    "cut", "unit", "guessed",
)  # fmt: skip


def entry(thing: Thing) -> dict[str, Any]:
    """One thing in plain values, lengths in the inventory's unit to a thousandth, photos counted from 1."""
    width, depth, height = (round(side, 3) for side in thing.size)
    return {
        "id": thing.id,
        "name": thing.title,
        "kind": thing.kind,
        "sure": round(thing.sure, 3),
        "width": width,
        "depth": depth,
        "height": height,
        "bottom": round(thing.bottom, 3),
        "east": round(thing.place[0], 3),
        "north": round(thing.place[2], 3),
        "turn": round(thing.turn, 1),
        "photos": [view + 1 for view in thing.photos],
        "cut": thing.cut,
    }


def table_csv(found: Inventory) -> str:
    """A row a thing."""
    stream = io.StringIO(newline="")
    table = csv.writer(stream)
    table.writerow(COLUMNS)
    for thing in found.things:
        row = entry(thing) | {"unit": found.unit, "guessed": found.guess is not None}
        row["photos"] = " ".join(map(str, row["photos"]))
        table.writerow(row[name] for name in COLUMNS)
    return stream.getvalue()


def document(found: Inventory, plan: Plan | None = None) -> dict[str, Any]:
    """The inventory, and the plan where there is one, as plain JSON values."""
    said: dict[str, Any] = {
        "unit": found.unit,
        "guess": None if found.guess is None else asdict(found.guess),
        "world": world_to_json(found.world),
        "counts": found.counts,
        "things": [entry(thing) for thing in found.things],
    }
    if plan is not None:
        said["plan"] = {
            "turn": round(plan.turn, 2),
            "walls": [{**_line(wall), "doubt": wall.doubt} for wall in plan.walls],
            "astray": sorted(plan.astray),
            "openings": [{"id": each.thing.id, **_line(each)} for each in plan.openings],
            "eyes": [[round(value, 3) for value in eye] for eye in plan.eyes],
        }
    return said


def table_json(found: Inventory, plan: Plan) -> str:
    """`document` as text."""
    return json.dumps(document(found, plan), indent=2, ensure_ascii=False, allow_nan=False)


def difference_document(changed: Difference) -> dict[str, Any]:
    """What changed as plain JSON values; lengths in the first scene's unit."""

    def pair(each: Pair) -> dict[str, Any]:
        return {"before": each.before.id, "after": each.after.id, "by": round(each.by, 3)}

    return {
        "matches": changed.fit.matches,
        "matches_tried": changed.fit.tried,
        "scale": round(changed.fit.scale, 4),
        "unit": changed.unit,
        "stayed": [pair(each) for each in changed.stayed],
        "moved": [pair(each) for each in changed.moved],
        "came": [thing.id for thing in changed.came],
        "went": [thing.id for thing in changed.went],
        "not_looked_at": [thing.id for thing in changed.unseen],
    }


def _line(drawn: PlanWall | Opening) -> dict[str, list[float]]:
    return {
        "start": [round(value, 3) for value in drawn.start],
        "end": [round(value, 3) for value in drawn.end],
    }
