"""`summary.html`: every row of a ledger in one page that needs no other file but for its links."""

import base64
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from langflash_core.base.files import write_atomically
from langflash_core.batch.ledger import FAILED, Row
from langflash_core.batch.sets import SUMMARY

THUMBNAIL = "thumbnail.jpg"  # in a set's folder
_NUMBERS = {
    "set": {"photos": "photos", "Gaussians": "gaussians", "groups": "groups", "found": "found"},
    "clip": {"frames": "photos", "objects": "groups", "quality": "found"},
}
"""By what a row is of: headings, and whose column of the ledger they are."""

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title><style>
:root {{ color-scheme: light dark; }}
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2em; }}
table {{ border-collapse: collapse; }}
th, td {{ text-align: left; vertical-align: top; padding: .35em .9em .35em 0; }}
tbody tr {{ border-top: 1px solid #8884; }}
th {{ cursor: pointer; white-space: nowrap; }}
.number {{ text-align: right; font-variant-numeric: tabular-nums; }}
.failed td {{ background: #d3302018; }}
.failed .status {{ color: #d33020; font-weight: 600; }}
small {{ display: block; max-width: 40em; opacity: .75; }}
img {{ height: 72px; display: block; }}
</style></head><body>
<h1>{title}</h1><p>{counts}. <a href="ledger.csv">ledger.csv</a>; click a heading to sort.</p>
<table><thead><tr>{headings}</tr></thead><tbody>
"""
_END = """</tbody></table><script>
for (const heading of document.querySelectorAll("th")) heading.onclick = () => {
  const body = document.querySelector("tbody"), place = heading.cellIndex;
  const key = row => row.cells[place].dataset.key ?? row.cells[place].textContent;
  const way = heading.dataset.way = heading.dataset.way === "1" ? -1 : 1;
  const rows = [...body.rows].sort((a, b) => way * key(a).localeCompare(key(b), undefined, {numeric: true}));
  body.append(...rows);
};
</script></body></html>
"""


def write_summary(rows: Sequence[Row], folder: Path, item: str = "set") -> None:
    """Write the page; thumbnails are read one by one, so that thousands need no memory.

    Args:
        rows: as the ledger has them; the page has failures first.
        folder: of the ledger and of the sets' folders. item: what a row is of, "set" or "clip".

    Raises:
        OutputError: it cannot be written.
    """
    ordered = sorted(rows, key=lambda row: row.status != FAILED)
    write_atomically(folder / SUMMARY, (part.encode() for part in _parts(ordered, folder, item)))


def _parts(rows: Sequence[Row], folder: Path, item: str) -> Iterator[str]:
    failed = sum(row.status == FAILED for row in rows)
    counts = f"{len(rows) - failed} done, {failed} failed" if failed else f"{len(rows)} done"
    headings = "".join(
        f"<th>{heading}</th>"
        for heading in ("", item, "status", "seconds", *_NUMBERS[item], "retried", "files")
    )
    yield _PAGE.format(title=escape(f"LangFlash: {len(rows)} {item}s"), counts=counts, headings=headings)
    for row in rows:
        yield _line(row, folder, item)
    yield _END


def _line(row: Row, folder: Path, item: str) -> str:
    own = folder / row.name
    notes = "".join(
        f"<small>{escape(note)}</small>" for note in (row.reason, *row.warnings.split(" | ")) if note
    )
    numbers = (f"{row.seconds:.1f}", *(getattr(row, name) for name in _NUMBERS[item].values()), row.retried)
    cells = "".join(f'<td class="number" data-key="{n}">{n or ""}</td>' for n in numbers)
    failed = row.status == FAILED
    return (
        f'<tr class="{row.status}"><td>{"" if failed else _picture(own)}</td>'
        f'<td data-key="{escape(row.name)}">{escape(row.name) if failed else _link(own, folder)}{notes}</td>'
        f'<td class="status">{row.status}</td>{cells}<td>{"" if failed else _files(own, folder)}</td></tr>\n'
    )


def _picture(own: Path) -> str:
    try:
        content = base64.b64encode((own / THUMBNAIL).read_bytes()).decode()
    except OSError:
        return ""
    return f'<img alt="" loading="lazy" src="data:image/jpeg;base64,{content}">'


def _files(own: Path, folder: Path) -> str:
    try:
        paths = sorted(path for path in own.iterdir() if path.name != THUMBNAIL)
    except OSError:
        return ""
    return " ".join(_link(path, folder) for path in paths)


def _link(path: Path, folder: Path) -> str:
    return f'<a href="{escape(quote(path.relative_to(folder).as_posix()))}">{escape(path.name)}</a>'
