"""Speed against error: every way of drawing timed beside the default, frame by frame, and compared
with the float64 reference."""

from .cases import Case, generated_atoms_case, paper_cases, scene_case, synthetic_case
from .measure import measure
from .report import csv_text, document, table
from .run import measured_cases

__all__ = [
    "Case",
    "csv_text",
    "document",
    "generated_atoms_case",
    "measure",
    "measured_cases",
    "paper_cases",
    "scene_case",
    "synthetic_case",
    "table",
]
