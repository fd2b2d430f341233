"""The small form of a report, which is kept beside the weights: numbers, tables and plots without pictures,
and the tables of documents that come from it.

A document marks where a table of the report stands:

    <!-- report ablations: Rivals -->
    ...
    <!-- end -->

`filled` writes there what the report says; so its numbers come from the report and from nothing else.
"""

import re
from collections.abc import Mapping
from textwrap import fill
from typing import Any

from langflash_core.lab.evaluation.report_page import Report, document_of
from langflash_core.lab.evaluation.report_plot import svg
from langflash_core.lab.evaluation.tables import Table, table_lines

LINE = 110
"""Letters of a document's line."""
_PLACE = re.compile(r"(<!-- report (\w+): (.+?) -->\n).*?(<!-- end -->)", re.DOTALL)


_STYLE = """><style>text { font: 12px sans-serif; fill: #62626d } .grid { stroke: #dcdce2 }</style>
<rect width="100%" height="100%" fill="white"/>"""
"""What a plot has of its page, where it stands alone."""


def small_document(report: Report) -> str:
    """JSON: means, labels and tables of every section, without intervals and scenes."""
    sections = {
        section.name: {
            "title": section.title,
            "about": section.about,
            **{
                name: section.result[name]
                for name in ("scenes", "measures", "labels")
                if name in section.result
            },
            "tables": [
                {
                    "title": table.title,
                    "header": list(table.header),
                    "rows": [list(row) for row in table.rows],
                }
                for table in section.tables
            ],
        }
        for section in report.sections
    }
    return document_of(report, sections)


def small_plots(report: Report) -> dict[str, str]:
    """SVG by file name: section and number."""
    return {
        f"{section.name}_{number}.svg": svg(plot).replace(">", _STYLE, 1) + "\n"
        for section in report.sections
        for number, plot in enumerate(section.plots)
        if plot.points
    }


def filled(text: str, document: Mapping[str, Any]) -> str:
    """A document with every marked table as the report has it.

    Raises:
        ValueError: the report lacks a section or a table that the document asks for.
    """

    def table(place: re.Match) -> str:
        opening, section, title, closing = place.groups()
        lines = table_lines(_table(document, section, title))
        about = document["sections"][section]["about"]
        told = fill(f"{about} Weights {document['weights']}, {document['made']}.", LINE)
        return "\n".join([opening.rstrip("\n"), told, "", *lines, closing])

    return _PLACE.sub(table, text)


def _table(document: Mapping[str, Any], section: str, title: str) -> Table:
    tables = document["sections"].get(section, {}).get("tables", [])
    for entry in tables:
        if entry["title"].startswith(title):
            rows = [tuple(row) for row in entry["rows"]]
            return Table("", tuple(entry["header"]), rows)
    known = ", ".join(f"'{entry['title']}'" for entry in tables) or "none"
    raise ValueError(f"{section}: expected a table '{title}', found {known}")
