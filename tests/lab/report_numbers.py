"""Write the report's tables into the documents that show them: `python -m tests.lab.report_numbers`.

Afterwards every number between `<!-- report ... -->` and `<!-- end -->` is that of
`assets/report/report.json`, which `langflash lab eval report ... --small assets/report` makes.
"""

import json
import sys
from pathlib import Path

from langflash_core.lab.evaluation.report_small import filled

ROOT = Path(__file__).resolve().parents[2]
SMALL = ROOT / "assets" / "report" / "report.json"
DOCUMENTS = ("MEASURED.md",)


def current(name: str) -> tuple[str, str]:
    """A document as it is, and as the report has it."""
    text = (ROOT / name).read_text(encoding="utf-8")
    return text, filled(text, json.loads(SMALL.read_bytes()))


if __name__ == "__main__":
    for name in DOCUMENTS:
        before, after = current(name)
        if before != after:
            (ROOT / name).write_text(after, encoding="utf-8")
            sys.stdout.write(f"{name}: written\n")
