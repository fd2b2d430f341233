"""The inventory as a page to print: a plan, a picture of each thing, names, sizes, places and sureness.

One HTML file that needs no other and loads nothing.
"""

from collections.abc import Mapping
from html import escape

from langflash_core.inventory.plan import Plan
from langflash_core.inventory.things import Inventory, Thing
from langflash_core.writing.inventory.drawing import plan_svg
from langflash_core.writing.inventory.words import doubt_of, length, scale_note, size
from langflash_core.writing.job import plural

_HEAD = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}: inventory</title><style>
:root {{ color-scheme: light; --ink: #1d2126; --soft: #5a626c; --line: #dfe3e8; --accent: #a8792b; }}
* {{ box-sizing: border-box; }}
body {{ font: 15px/1.45 "Helvetica Neue", Helvetica, Arial, sans-serif; margin: 0; background: #f4f5f7;
 color: var(--ink); }}
main {{ max-width: 960px; margin: 0 auto; padding: 32px 36px 48px; background: #fff; min-height: 100vh; }}
h1 {{ font-size: 28px; margin: 0 0 2px; }} h2 {{ font-size: 18px; margin: 36px 0 8px; }}
p {{ margin: 4px 0; }} .soft {{ color: var(--soft); }}
.kinds {{ display: flex; flex-wrap: wrap; gap: 6px; margin: 16px 0 0; padding: 0; list-style: none; }}
.kinds li {{ border: 1px solid var(--line); border-radius: 999px; padding: 2px 11px; font-size: 13.5px; }}
.kinds b {{ color: var(--accent); }}
figure {{ margin: 0; }} figure svg {{ width: 100%; height: auto; }}
table {{ border-collapse: collapse; width: 100%; }}
th {{ text-align: left; font-weight: 600; font-size: 13px; color: var(--soft); }}
th, td {{ padding: 8px 14px 8px 0; vertical-align: middle; border-bottom: 1px solid var(--line); }}
td.picture {{ width: 116px; }}
td.picture img {{ display: block; max-width: 104px; max-height: 78px; margin: auto; }}
td.number {{ width: 30px; color: var(--accent); font-weight: 600; }}
td.size {{ white-space: nowrap; font-variant-numeric: tabular-nums; }}
td small {{ display: block; color: var(--soft); }}
.bar {{ width: 74px; height: 6px; border-radius: 3px; background: var(--line); margin-bottom: 3px; }}
.bar i {{ display: block; height: 100%; border-radius: 3px; background: var(--accent); }}
@media (max-width: 640px) {{ main {{ padding: 20px 16px; }} .place, .photos {{ display: none; }} }}
@page {{ size: A4; margin: 14mm; }}
@media print {{ body {{ background: none; font-size: 11pt; }} main {{ padding: 0; max-width: none; }}
 figure svg {{ width: auto; max-width: 100%; }} tr, figure {{ break-inside: avoid; }}
 thead {{ display: table-header-group; }} }}
</style></head><body><main>
"""


def page_of(found: Inventory, plan: Plan, cutouts: Mapping[str, str], title: str) -> str:
    """The page.

    Args:
        cutouts: a data URL of a picture by the thing's id.
    """
    photos = found.scene.num_views if found.scene.photos else 0
    seen = f", seen by {plural(photos, 'photo')}" if photos else ""
    kinds = "".join(f"<li><b>{number}</b> {escape(kind)}</li>" for kind, number in found.counts.items())
    numbers = {thing.id: number + 1 for number, thing in enumerate(plan.things)}
    rows = "".join(
        _row(thing, numbers.get(thing.id), cutouts.get(thing.id), found, doubt_of(thing, plan))
        for thing in (*plan.things, *(thing for thing in found.things if thing not in plan.things))
    )
    return (
        _HEAD.format(title=escape(title))
        + f"<h1>{escape(title)}</h1><p>{plural(len(found.things), 'thing')}{seen}</p>"
        + f'<p class="soft">{escape(scale_note(found.guess, found.unit))} '
        + "Sizes are those of what photos saw.</p>"
        + f'<ul class="kinds">{kinds}</ul>'
        + f"<h2>Plan</h2><figure>{plan_svg(plan, title, headed=False)}</figure>"
        + "<h2>Things</h2><table><thead><tr><th></th><th></th><th>What</th><th>Width × depth × height</th>"
        + '<th class="place">Where</th><th>How sure</th><th class="photos">Photos</th></tr></thead>'
        + f"<tbody>{rows}</tbody></table></main></body></html>\n"
    )


def _row(thing: Thing, number: int | None, cutout: str | None, found: Inventory, doubt: str) -> str:
    picture = f'<img alt="{escape(thing.title)}" src="{cutout}">' if cutout else ""
    own = f"<small>{escape(thing.id)}</small>" if thing.name else ""
    maybe = f"<small>{doubt}</small>" if doubt else ""
    cut = "<small>goes on beyond the photos</small>" if thing.cut else ""
    east, _, north = thing.place
    sides = ("east" if east >= 0 else "west"), ("north" if north >= 0 else "south")
    where = f"{length(abs(east), found.unit)} {sides[0]}, {length(abs(north), found.unit)} {sides[1]}"
    high = f"<small>{length(thing.bottom, found.unit)} above the floor</small>"
    above = high if thing.bottom > 0.15 else ""
    return (
        f'<tr><td class="number">{number or ""}</td><td class="picture">{picture}</td>'
        f"<td>{escape(thing.title)}{own}{maybe}</td>"
        f'<td class="size">{size(thing, found.unit)}{cut}</td><td class="place">{where}{above}</td>'
        f'<td><div class="bar"><i style="width:{100 * thing.sure:.0f}%"></i></div>{thing.sure:.0%}</td>'
        f'<td class="photos">{", ".join(str(view + 1) for view in thing.photos)}</td></tr>\n'
    )
