"""A floor plan as DXF, release 12 in text, which every CAD program reads.

Metres (or the scene's units), +x east, +y north. Layers: WALLS, DOUBTED (walls that may be
none), DOORS, WINDOWS, THINGS, NAMES. A wall is a
line, a thing a closed outline with its name and size beside it.

Source: Autodesk's DXF reference, release 12 (AC1009): pairs of a group code and a value, a line each.
"""

from collections.abc import Sequence

from langflash_core.inventory.plan import Place, Plan
from langflash_core.writing.inventory.words import size

_COLOURS = {"WALLS": 7, "DOUBTED": 9, "DOORS": 3, "WINDOWS": 5, "THINGS": 30, "NAMES": 8}
_TEXT = 0.09  # height of names, of 4 units across
_UNITS = {"m": 6}  # $INSUNITS


def plan_dxf(plan: Plan) -> str:
    """The drawing."""
    (west, south), (east, north) = plan.bounds
    high = _TEXT * max(east - west, north - south) / 4
    pairs: list[tuple[int, object]] = [
        (0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"),
        (9, "$INSUNITS"), (70, _UNITS.get(plan.unit, 0)),
        (9, "$EXTMIN"), (10, west), (20, south), (30, 0.0),
        (9, "$EXTMAX"), (10, east), (20, north), (30, 0.0),
        (0, "ENDSEC"), (0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LAYER"), (70, len(_COLOURS)),
    ]  # fmt: skip
    for layer, colour in _COLOURS.items():
        pairs += [(0, "LAYER"), (2, layer), (70, 0), (62, colour), (6, "CONTINUOUS")]
    pairs += [(0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]
    for wall in plan.walls:
        pairs += _line("DOUBTED" if wall.doubt else "WALLS", wall.start, wall.end)
    for opening in plan.openings:
        layer = "WINDOWS" if opening.thing.kind == "window" else "DOORS"
        pairs += _line(layer, opening.start, opening.end)
        pairs += _text(opening.start, high, opening.thing.title)
    for thing in plan.things:
        pairs += _outline("THINGS", [(east, north) for east, north in thing.corners.tolist()])
        middle = (thing.place[0], thing.place[2])
        pairs += _text(middle, high, thing.title)
        pairs += _text((middle[0], middle[1] - 1.4 * high), high * 0.8, size(thing, plan.unit))
    pairs += [(0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code}\n{_ascii_line(value)}\n" for code, value in pairs)


def _line(layer: str, start: Place, end: Place) -> list[tuple[int, object]]:
    return [
        (0, "LINE"), (8, layer),
        (10, start[0]), (20, start[1]), (30, 0.0), (11, end[0]), (21, end[1]), (31, 0.0),
    ]  # fmt: skip


def _outline(layer: str, corners: Sequence[Place]) -> list[tuple[int, object]]:
    pairs: list[tuple[int, object]] = [(0, "POLYLINE"), (8, layer), (66, 1), (70, 1)]
    pairs += [(10, 0.0), (20, 0.0), (30, 0.0)]
    for east, north in corners:
        pairs += [(0, "VERTEX"), (8, layer), (10, east), (20, north), (30, 0.0)]
    return [*pairs, (0, "SEQEND"), (8, layer)]


def _text(place: Place, high: float, text: str) -> list[tuple[int, object]]:
    return [(0, "TEXT"), (8, "NAMES"), (10, place[0]), (20, place[1]), (30, 0.0), (40, high), (1, text)]


def _ascii_line(value: object) -> str:
    """A value in one line of ASCII; other signs as \\U+XXXX, which CAD programs read."""
    if isinstance(value, float):
        return f"{value:.6f}"
    text = " ".join(str(value).split()) or "-"
    return "".join(sign if sign.isascii() else f"\\U+{ord(sign):04X}" for sign in text)
