"""Speed against error as SVG: a point a way of doing it, its interval as a line, the best lower left."""

import math
from collections.abc import Callable, Sequence
from html import escape

from langflash_core.export.colours import label_colours
from langflash_core.lab.evaluation.report_parts import Plot, Point

WIDTH, HEIGHT = 640, 340
LEFT, RIGHT, TOP, BOTTOM = 72, 24, 18, 48
LETTER = 6.8
"""Width of a letter, about."""


def svg(plot: Plot) -> str:
    """The plot as one <svg> element; seconds are logarithmic where they differ by more than five times,
    errors where they do by more than a hundred."""
    points = [p for p in plot.points if math.isfinite(p.seconds) and math.isfinite(p.error)]
    if not points:
        return ""
    seconds = [max(p.seconds, 1e-6) for p in points]
    highs = [p.bounds[1] if p.bounds else p.error for p in points]
    lows = [p.bounds[0] if p.bounds else p.error for p in points]
    x, across = _axis(seconds, 5, (LEFT, WIDTH - RIGHT))
    y, up = _axis([*highs, *lows], 100, (HEIGHT - BOTTOM, TOP))
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img" '
        f'aria-label="{escape(plot.title)}" xmlns="http://www.w3.org/2000/svg">'
    ]
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    for tick in up:
        place = f"{y(tick):.1f}"
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{right}" y1="{place}" y2="{place}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{y(tick) + 4:.1f}" text-anchor="end">{_said(tick)}</text>')
    for tick in across:
        place = f"{x(tick):.1f}"
        parts.append(f'<line class="grid" x1="{place}" x2="{place}" y1="{TOP}" y2="{bottom}"/>')
        parts.append(f'<text x="{place}" y="{bottom + 17}" text-anchor="middle">{tick:.3g}</text>')
    middle = (LEFT + WIDTH - RIGHT) / 2
    parts.append(f'<text x="{middle}" y="{HEIGHT - 8}" text-anchor="middle">{escape(plot.across)}</text>')
    parts.append(
        f'<text transform="translate(14 {(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" '
        f'text-anchor="middle">{escape(plot.up)}</text>'
    )
    marks = [(x(own), y(point.error)) for point, own in zip(points, seconds, strict=True)]
    levels = _apart([(*_span(point, x), y) for point, (x, y) in zip(points, marks, strict=True)], marks)
    colours = [tuple(colour) for colour in label_colours(len(points)).tolist()]
    for row, (point, own, level) in enumerate(zip(points, seconds, levels, strict=True)):
        parts += _mark(point, x(own), y, level, _dark(colours[row]))
    return "\n".join([*parts, "</svg>"])


def _mark(point: Point, x: float, y: Callable[[float], float], level: float, colour: str) -> list[str]:
    """Point, interval and name; the name stands at `level`, where there is room."""
    place, anchor = (x + 9, "start") if _after(point, x) else (x - 9, "end")
    parts = []
    if point.bounds is not None:
        low, high = y(point.bounds[0]), y(point.bounds[1])
        parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{low:.1f}" y2="{high:.1f}" '
            f'stroke="{colour}" stroke-width="2"/>'
        )
    parts.append(f'<circle cx="{x:.1f}" cy="{y(point.error):.1f}" r="5" fill="{colour}"/>')
    parts.append(
        f'<text class="name" x="{place:.1f}" y="{level + 4:.1f}" style="fill: {colour}" '
        f'text-anchor="{anchor}">{escape(point.name)}</text>'
    )
    return parts


def _after(point: Point, x: float) -> bool:
    """Whether a name fits behind its point."""
    return x + 9 + LETTER * len(point.name) <= WIDTH


def _span(point: Point, x: float) -> tuple[float, float]:
    """Left and right of a name, about."""
    wide = LETTER * len(point.name)
    return (x + 9, x + 9 + wide) if _after(point, x) else (x - 9 - wide, x - 9)


def _apart(
    names: Sequence[tuple[float, float, float]], marks: Sequence[tuple[float, float]], least: float = 15
) -> list[float]:
    """Heights of names (left, right, height), each moved as little as it takes to touch no mark (x, y) and no
    name before it."""
    placed = [(x - 5, x + 5, y) for x, y in marks]
    moved = [0.0] * len(names)
    for place in sorted(range(len(names)), key=lambda place: names[place][2]):
        left, right, wanted = names[place]
        steps = (wanted + sign * least * step / 3 for step in range(90) for sign in (1, -1))
        moved[place] = next(
            (
                level
                for level in steps
                if TOP <= level <= HEIGHT - BOTTOM
                and all(right < a or left > b or abs(level - c) >= least for a, b, c in placed)
            ),
            wanted,
        )
        placed.append((left, right, moved[place]))
    return moved


def _said(tick: float) -> str:
    """A tick in few letters."""
    return f"{tick:.0e}".replace("e-0", "e-") if 0 < abs(tick) < 1e-3 else f"{tick:.3g}"


def _dark(colour: tuple[int, int, int]) -> str:
    """Readable on white paper and on black."""
    return f"rgb({', '.join(str(value * 3 // 4) for value in colour)})"


def _axis(
    values: Sequence[float], factor: float, ends: tuple[float, float]
) -> tuple[Callable[[float], float], list[float]]:
    """Where a value lies between two ends, and ticks; logarithmic where the largest is `factor` times the
    smallest."""
    logarithmic = min(values) > 0 and max(values) > factor * min(values)
    ticks = _ticks(values, logarithmic)
    scaled = math.log if logarithmic else float
    low, high = scaled(ticks[0]), scaled(ticks[-1])

    def place(value: float) -> float:
        return ends[0] + (scaled(value) - low) / (high - low) * (ends[1] - ends[0])

    return place, ticks


def _ticks(values: Sequence[float], logarithmic: bool) -> list[float]:
    """Round numbers around the values, at least two."""
    low, high = min(values), max(values)
    if logarithmic:
        powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        steps = (1, 2, 5) if len(powers) < 6 else (1,)
        marks = [float(f"{m}e{p}") for p in powers for m in steps]
        below, above = max(m for m in marks if m <= low), min(m for m in marks if m >= high)
        return [m for m in marks if below <= m <= above]
    reach = (high - low) or abs(high) or 1.0
    step = 10.0 ** math.floor(math.log10(reach))
    step = next(step * m for m in (0.2, 0.5, 1, 2, 5) if reach / (step * m) <= 5)
    first, last = math.floor(low / step - 0.2), math.ceil(high / step + 0.2)
    return [round(n * step, 12) for n in range(first, last + 1)]
