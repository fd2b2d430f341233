"""A floor plan as SVG, to scale on paper: lengths of the drawing are millimetres.

North is up. Walls are dark, doors leaves with their swing, windows double lines; things are outlines with a
number, and a list beside the plan has their names and sizes. So no name covers another,
however full the room is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from langflash_core.inventory.plan import Opening, Place, Plan, PlanWall
from langflash_core.inventory.things import Thing
from langflash_core.writing.inventory.words import doubt_of, scale_note, size
from langflash_core.writing.settings import PAPER

_STYLE = """
.plan text { font-family: 'Helvetica Neue', Helvetica, Arial, sans-serif; fill: #1d2126; }
.plan .wall { stroke: #1d2126; stroke-width: 1.5; stroke-linecap: square; fill: none; }
.plan .doubt { stroke: #8a929c; stroke-width: .7; stroke-dasharray: 2 1.4; fill: none; }
.plan .gap { stroke: #fff; stroke-width: 1.9; }
.plan .leaf { stroke: #1d2126; stroke-width: .35; fill: none; }
.plan .swing { stroke: #8a929c; stroke-width: .18; stroke-dasharray: .8 .6; fill: none; }
.plan .glass { stroke: #2f7fb8; stroke-width: .3; fill: none; }
.plan .thing { fill: #f3e3c7; stroke: #a8792b; stroke-width: .25; }
.plan .high { fill: none; stroke: #a8792b; stroke-width: .25; stroke-dasharray: 1 .7; }
.plan .unsure { fill: #eef0f2; stroke: #8a929c; stroke-width: .25; }
.plan .badge { fill: #fff; stroke: #a8792b; stroke-width: .22; }
.plan .number { font-size: 2.3px; font-weight: 600; text-anchor: middle; }
.plan .eye { fill: #c2473a; }
.plan .size { stroke: #5a626c; stroke-width: .15; fill: none; }
.plan .measure { font-size: 2.6px; fill: #5a626c; text-anchor: middle; }
.plan .title { font-size: 5px; font-weight: 600; } .plan .note { font-size: 2.5px; fill: #5a626c; }
.plan .name { font-size: 2.8px; font-weight: 600; } .plan .sizes { font-size: 2.5px; fill: #5a626c; }
"""


@dataclass(frozen=True)
class _Paper:
    """From places in the room to millimetres of paper. per: mm a unit; west, north: of its corner."""

    per: float
    west: float
    north: float

    def at(self, place: Place) -> tuple[float, float]:
        return PAPER.edge + (place[0] - self.west) * self.per, PAPER.top + PAPER.edge + (
            self.north - place[1]
        ) * self.per


def plan_svg(plan: Plan, title: str, *, headed: bool = True) -> str:
    """The drawing, complete in itself; `headed`, with its title over it."""
    (west, south), (east, north) = plan.bounds
    wide, high = max(east - west, 1e-3), max(north - south, 1e-3)
    ratio = next(
        (r for r in PAPER.scales if 1000 / r * wide <= PAPER.room[0] and 1000 / r * high <= PAPER.room[1]),
        PAPER.scales[-1],
    )
    per = 1000 / ratio if plan.unit == "m" else min(PAPER.room[0] / wide, PAPER.room[1] / high)
    paper = _Paper(per, west, north)
    largest_first = sorted(plan.things, key=lambda thing: -thing.size[0] * thing.size[1])
    listed = [*plan.things, *(opening.thing for opening in plan.openings)]
    width = 2 * PAPER.edge + wide * per + (PAPER.list if listed else 0)
    height = PAPER.top + max(2 * PAPER.edge + high * per + 10, PAPER.edge + 6 + PAPER.row * len(listed))
    skipped = 0.0 if headed else 12.0  # where the title would be
    width, height = max(width, 110.0), height + 6 - skipped
    said = f"1 : {ratio}" if plan.unit == "m" else "not to scale: nobody told a length"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.1f}mm" height="{height:.1f}mm" '
        f'viewBox="0 {skipped} {width:.1f} {height:.1f}" class="plan" role="img">',
        f"<title>Floor plan of {escape(title)}</title><style>{_STYLE}</style>",
        f'<rect y="{skipped}" width="{width:.1f}" height="{height:.1f}" fill="#fff"/>',
        f'<text class="title" x="{PAPER.edge}" y="12">{escape(title)}</text>' if headed else "",
        f'<text class="note" x="{PAPER.edge}" y="17">Floor plan, {said}. '
        f"{escape(scale_note(plan.guess, plan.unit))}</text>",
        *(_thing(paper, thing, doubt_of(thing, plan)) for thing in largest_first),
        *(_wall(paper, wall) for wall in plan.walls),
        *(_opening(paper, opening, plan) for opening in plan.openings),
        *(_badge(number + 1, place) for number, place in enumerate(_place_badges(paper, plan.things))),
        *(_eye(paper, eye, number) for number, eye in enumerate(plan.eyes)),
        *_sizes(paper, plan),
        _list(plan, 2 * PAPER.edge + wide * per, listed),
        _bar(paper, plan, PAPER.top + 2 * PAPER.edge + high * per + 4),
        _legend_note(plan, PAPER.top + 2 * PAPER.edge + high * per + 10),
        _arrow(2 * PAPER.edge + wide * per - 6, PAPER.top + 4),
        "</svg>",
    ]
    return "\n".join(part for part in parts if part)


def _wall(paper: _Paper, wall: PlanWall) -> str:
    """A line; grey and dashed, with the reason, where it may be none."""
    line = _drawn_line("doubt" if wall.doubt else "wall", paper.at(wall.start), paper.at(wall.end))
    return f"<g><title>Perhaps no wall: {wall.doubt}</title>{line}</g>" if wall.doubt else line


def _thing(paper: _Paper, thing: Thing, doubt: str) -> str:
    """Its outline; dashed where it hangs above heads, grey where it is doubted."""
    hangs = thing.bottom > PAPER.hangs * max(1e-6, abs(thing.bottom) + thing.size[2])
    kind = "high" if hangs else "unsure" if doubt else "thing"
    points = " ".join(f"{x:.2f},{y:.2f}" for x, y in (paper.at((e, n)) for e, n in thing.corners.tolist()))
    title = f"<title>{escape(thing.title)}{f': {doubt}' if doubt else ''}</title>"
    return f'<polygon class="{kind}" points="{points}" stroke-linejoin="round">{title}</polygon>'


def _place_badges(paper: _Paper, things: Sequence[Thing]) -> list[tuple[float, float]]:
    """Where badges go: at the middles of their things, or as near as others leave room."""
    chosen: list[tuple[float, float]] = []
    for thing in things:
        x, y = paper.at((thing.place[0], thing.place[2]))
        ways = [(x, y)] + [
            (x + ring * math.cos(angle), y + ring * math.sin(angle))
            for ring in (2.0, 4.0, 6.0, 8.0)
            for angle in (k * math.pi / 4 for k in range(8))
        ]
        free = (way for way in ways if all(math.dist(way, other) >= 2.15 * PAPER.badge for other in chosen))
        chosen.append(next(free, (x, y)))
    return chosen


def _badge(number: int, place: tuple[float, float]) -> str:
    x, y = place
    return (
        f'<circle class="badge" cx="{x:.2f}" cy="{y:.2f}" r="{PAPER.badge}"/>'
        f'<text class="number" x="{x:.2f}" y="{y + 0.8:.2f}">{number}</text>'
    )


def _opening(paper: _Paper, opening: Opening, plan: Plan) -> str:
    start, end = paper.at(opening.start), paper.at(opening.end)
    gap = _drawn_line("gap", start, end)
    if opening.thing.kind == "window":
        x, y = _across(start, end, 0.55)
        lines = [((start[0] + k * x, start[1] + k * y), (end[0] + k * x, end[1] + k * y)) for k in (-1, 0, 1)]
        return gap + "".join(_drawn_line("glass", *pair) for pair in lines)
    # A leaf that opens into the room, as its plan has the photos' side.
    radius = math.dist(start, end)
    if radius < 1e-6:
        return gap
    inward = _across(start, end, radius)
    middle = [(a + b) / 2 for a, b in zip(start, end, strict=True)]
    eyes = [paper.at(eye) for eye in plan.eyes] or [tuple(middle)]
    eye = [sum(values) / len(eyes) for values in zip(*eyes, strict=True)]
    if sum(i * (e - m) for i, e, m in zip(inward, eye, middle, strict=True)) < 0:
        inward = (-inward[0], -inward[1])
    tip = (start[0] + inward[0], start[1] + inward[1])
    cross = (end[0] - start[0]) * inward[1] - (end[1] - start[1]) * inward[0]
    sweep = 0 if cross < 0 else 1
    return (
        gap
        + _drawn_line("leaf", start, tip)
        + f'<path class="swing" d="M{end[0]:.2f} {end[1]:.2f} A{radius:.2f} {radius:.2f} 0 0 {sweep} '
        f'{tip[0]:.2f} {tip[1]:.2f}"/>'
    )


def _across(start: Place, end: Place, length: float) -> tuple[float, float]:
    """So long, across a line."""
    full = max(math.dist(start, end), 1e-9)
    return (-(end[1] - start[1]) / full * length, (end[0] - start[0]) / full * length)


def _eye(paper: _Paper, eye: Place, number: int) -> str:
    x, y = paper.at(eye)
    return f'<circle class="eye" cx="{x:.2f}" cy="{y:.2f}" r=".7"><title>Photo {number + 1}</title></circle>'


def _sizes(paper: _Paper, plan: Plan) -> list[str]:
    """The lengths of the walls, outside of them."""
    if not plan.walls:
        return []
    ends = [end for wall in plan.walls for end in (wall.start, wall.end)]
    centre = paper.at((sum(e for e, _ in ends) / len(ends), sum(n for _, n in ends) / len(ends)))
    drawn = []
    for wall in plan.walls:
        start, end = paper.at(wall.start), paper.at(wall.end)
        out = _across(start, end, 4.2)
        at = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
        if (at[0] - centre[0]) * out[0] + (at[1] - centre[1]) * out[1] < 0:
            out = (-out[0], -out[1])
        ends = [(p[0] + out[0], p[1] + out[1]) for p in (start, end)]
        turn = math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))
        turn = turn - 180 if turn > 90.5 else turn + 180 if turn < -90 else turn
        x, y = at[0] + out[0], at[1] + out[1]
        drawn.append(_drawn_line("size", *ends))
        dx, dy = out[0] / 6, out[1] / 6
        drawn += [_drawn_line("size", (p[0] - dx, p[1] - dy), (p[0] + dx, p[1] + dy)) for p in ends]
        drawn.append(
            f'<text class="measure" transform="translate({x:.2f} {y:.2f}) rotate({turn:.1f})" y="-.8">'
            f"{wall.length:.2f}</text>"
        )
    return drawn


def _list(plan: Plan, left: float, listed: list[Thing]) -> str:
    rows = []
    for number, thing in enumerate(listed):
        y = PAPER.top + PAPER.edge + PAPER.row * number
        badge = number + 1 if number < len(plan.things) else ""
        mark = (
            f'<circle class="badge" cx="{left:.1f}" cy="{y:.2f}" r="{PAPER.badge}"/>'
            f'<text class="number" x="{left:.1f}" y="{y + 0.8:.2f}">{badge}</text>'
            if badge
            else ""
        )
        maybe = "?" if doubt_of(thing, plan) else ""
        rows.append(
            f'{mark}<text class="name" x="{left + 4:.1f}" y="{y:.2f}">{escape(thing.title)}{maybe}</text>'
            f'<text class="sizes" x="{left + 4:.1f}" y="{y + 3.1:.2f}">{size(thing, plan.unit)}</text>'
        )
    return "".join(rows)


def _bar(paper: _Paper, plan: Plan, y: float) -> str:
    """A length to compare with."""
    if plan.unit != "m":
        return ""
    x, full = PAPER.edge, paper.per
    halves = [
        f'<rect x="{x + k * full / 2:.2f}" y="{y:.2f}" width="{full / 2:.2f}" height="1.1" '
        f'fill="{"#1d2126" if k % 2 == 0 else "#fff"}" stroke="#1d2126" stroke-width=".15"/>'
        for k in range(2)
    ]
    return "".join(halves) + f'<text class="note" x="{x + full + 1.5:.2f}" y="{y + 1.2:.2f}">1 m</text>'


def _legend_note(plan: Plan, y: float) -> str:
    """What the dots are, and how what is doubted is drawn."""
    said = ["where the photos were taken"] * bool(plan.eyes)
    said += ["dashed: perhaps no wall"] * any(wall.doubt for wall in plan.walls)
    said += ["grey, ?: in doubt"] * any(doubt_of(thing, plan) for thing in plan.things)
    dot = f'<circle class="eye" cx="{PAPER.edge + 0.7}" cy="{y:.2f}" r=".7"/>' if plan.eyes else ""
    x = PAPER.edge + (2.5 if plan.eyes else 0.0)
    return dot + f'<text class="note" x="{x}" y="{y + 0.9:.2f}">{"; ".join(said)}</text>' if said else ""


def _arrow(x: float, y: float) -> str:
    return (
        f'<path d="M{x} {y + 7} L{x + 2.2} {y} L{x + 4.4} {y + 7} L{x + 2.2} {y + 5.4} Z" fill="#1d2126"/>'
        f'<text class="number" x="{x + 2.2}" y="{y - 1}">N</text>'
    )


def _drawn_line(kind: str, start: Place, end: Place) -> str:
    return (
        f'<line class="{kind}" x1="{start[0]:.2f}" y1="{start[1]:.2f}" x2="{end[0]:.2f}" y2="{end[1]:.2f}"/>'
    )
