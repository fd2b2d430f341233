"""A report as one HTML page without anything from elsewhere, as Markdown, JSON and CSV."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from langflash_core.lab.evaluation.report_parts import Section, Shown
from langflash_core.lab.evaluation.report_plot import svg
from langflash_core.lab.evaluation.tables import Table, table_lines
from langflash_core.lab.evaluation.tallies import numbers_of

_STYLE = """
:root { color-scheme: light dark;
  --ink: #1d1d22; --soft: #62626d; --line: #dcdce2; --paper: #fff; --row: #f6f6f9; --link: #2f6fb0; }
@media (prefers-color-scheme: dark) { :root {
  --ink: #e8e8ee; --soft: #a0a0ac; --line: #3a3a42; --paper: #17171b; --row: #202026; --link: #7ab0e6; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1160px; padding: 32px 24px 80px; background: var(--paper);
  color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 28px; margin: 0 0 4px; }
h2 { font-size: 22px; margin: 48px 0 4px; }
h3 { font-size: 16px; margin: 28px 0 8px; }
p { margin: 4px 0 12px; max-width: 78ch; }
.soft { color: var(--soft); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; display: block; overflow-x: auto; }
th, td { padding: 5px 14px 5px 0; text-align: left; border-bottom: 1px solid var(--line); }
td { white-space: nowrap; }
th { color: var(--soft); font-weight: 500; vertical-align: bottom; }
tbody tr:hover { background: var(--row); }
code { font: 13px ui-monospace, monospace; background: var(--row); padding: 2px 6px;
  border-radius: 4px; overflow-wrap: anywhere; }
figure { margin: 0 0 22px; }
figcaption { display: flex; flex-wrap: wrap; gap: 4px 18px; margin-bottom: 4px; }
figcaption b { min-width: 9em; }
.titles { display: grid; color: var(--soft); font-size: 13px; }
.legend { display: flex; flex-wrap: wrap; gap: 0 14px; color: var(--soft); font-size: 13px; }
.legend i { display: inline-block; width: 11px; height: 11px; margin-right: 5px; border-radius: 2px; }
figure img { width: 100%; display: block; border-radius: 4px; }
svg { max-width: 100%; height: auto; }
svg text { font: 12px system-ui, sans-serif; fill: var(--soft); }
svg .name { fill: var(--ink); }
svg .grid { stroke: var(--line); stroke-width: 1; }
nav a { margin-right: 18px; }
a { color: var(--link); }
"""


@dataclass(frozen=True)
class Report:
    """sections in order; command: how to make it again; machine: facts of it, plain JSON; made: a date."""

    sections: Sequence[Section]
    published: Table
    command: str
    machine: Mapping[str, Any]
    weights: str
    made: str


def html(report: Report) -> str:
    """The page; every text is escaped."""
    links = "".join(f'<a href="#{escape(s.name)}">{escape(s.title)}</a>' for s in report.sections)
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">',
        f"<title>LangFlash: what it can do, measured</title><style>{_STYLE}</style></head><body>",
        "<h1>LangFlash: what it can do, measured</h1>",
        f'<p class="soft">Weights {escape(report.weights)}, {escape(report.made)}. Intervals hold 95 % '
        "of draws of scenes, with replacement.</p>",
        f"<nav>{links}</nav>",
    ]
    for section in report.sections:
        parts += _section(section)
    parts += ['<h2 id="published">Published elsewhere</h2>', _table(report.published)]
    parts += ['<h2 id="again">Machine, and how to make this again</h2>']
    parts += [f"<p><code>{escape(report.command)}</code></p>", _table(_machine(report.machine))]
    return "\n".join([*parts, "</body></html>"]) + "\n"


def _section(section: Section) -> list[str]:
    parts = [
        f'<h2 id="{escape(section.name)}">{escape(section.title)}</h2>',
        f"<p>{escape(section.about)}</p>",
    ]
    if section.scenes:
        parts += ["<h3>The worst first, then the best</h3>", *(_figure(shown) for shown in section.scenes)]
    parts += [_table(table) for table in section.tables]
    for plot in section.plots:
        parts += [f"<h3>{escape(plot.title)}</h3>", svg(plot)]
    return parts


def _figure(shown: Shown) -> str:
    numbers = "".join(
        f'<span class="soft">{escape(name.replace("_", " "))} {value:.3g}</span>'
        for name, value in shown.numbers.items()
    )
    titles = "".join(f"<span>{escape(title)}</span>" for title in shown.titles)
    legend = "".join(
        f'<span><i style="background: rgb{tuple(colour)}"></i>{escape(label)}</span>'
        for label, colour in shown.legend.items()
    )
    return (
        f"<figure><figcaption><b>{escape(shown.name)}</b>{numbers}</figcaption>"
        f'<div class="titles" style="grid-template-columns: repeat({len(shown.titles)}, 1fr)">{titles}</div>'
        f'<img loading="lazy" alt="{escape(shown.name)}" src="{shown.uri}">'
        f'<div class="legend">{legend}</div></figure>'
    )


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in table.header)
    wide = len(table.header) > 4
    body = "".join(
        "<tr>" + "".join(f"<td>{_cell(text, wide)}</td>" for text in row) + "</tr>" for row in table.rows
    )
    title = f"<h3>{escape(table.title)}</h3>" if table.title else ""
    return f"{title}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(text: str, wide: bool) -> str:
    """In wide tables an interval stands below its number."""
    number, bracket, rest = text.partition(" (")
    if wide and bracket and number[:1].isdigit():
        return f'{escape(number)}<br><small class="soft">({escape(rest)}</small>'
    return escape(text)


def _machine(facts: Mapping[str, Any]) -> Table:
    rows = []
    for name, value in facts.items():
        text = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, Mapping) else str(value)
        rows.append((name, text or "-"))
    return Table("", ("machine", ""), rows)


def markdown(report: Report) -> str:
    """The tables alone."""
    lines = [f"# LangFlash, measured: weights {report.weights}, {report.made}", ""]
    for section in report.sections:
        lines += [f"## {section.title}", "", section.about, ""]
        for table in section.tables:
            lines += [*table_lines(table), ""]
    lines += ["## Published elsewhere", "", *table_lines(report.published), ""]
    lines += ["## Again", "", f"`{report.command}`", "", *table_lines(_machine(report.machine))]
    return "\n".join(lines) + "\n"


def document(report: Report) -> str:
    """Every number, as JSON."""
    sections = {
        section.name: {"title": section.title, **section.result, "intervals": section.intervals}
        for section in report.sections
    }
    return document_of(report, sections)


def document_of(report: Report, sections: Mapping[str, Any]) -> str:
    """JSON of sections under what was judged, when, with which command and on which machine."""
    whole = {
        "weights": report.weights,
        "made": report.made,
        "command": report.command,
        "machine": report.machine,
        "sections": sections,
    }
    return json.dumps(whole, indent=1, allow_nan=False) + "\n"


def numbers_csv(report: Report) -> str:
    """section, measure, value, low, high."""
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("section", "measure", "value", "low", "high"))
    for section in report.sections:
        for path, value in numbers_of(section.result).items():
            low, high = section.intervals.get(path) or ("", "")
            writer.writerow((section.name, path, "" if math.isnan(value) else value, low, high))
    return stream.getvalue()
