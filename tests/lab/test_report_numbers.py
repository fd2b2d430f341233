"""What documents say of the report is what the report says."""

import json

import pytest

from langflash_core.lab.evaluation.report_small import filled
from tests.lab.report_numbers import DOCUMENTS, SMALL, current

TABLES = {
    "weights": "w",
    "made": "2026",
    "sections": {
        "rooms": {
            "about": "7 rooms.",
            "tables": [{"title": "Some: more", "header": ["a"], "rows": [["0.5"]]}],
        }
    },
}
TEXT = "before\n<!-- report rooms: Some -->\nold\n<!-- end -->\nafter\n"


@pytest.mark.parametrize("name", DOCUMENTS)
def test_tables_of_documents_are_those_of_the_report(name: str):
    text, expected = current(name)
    assert "<!-- report " in text, f"{name} marks no table"
    assert text == expected, f"run python -m tests.lab.report_numbers; {name} would be:\n{expected}"


def test_a_marked_table_is_replaced_and_nothing_else():
    done = filled(TEXT, TABLES)
    table = "7 rooms. Weights w, 2026.\n\n| a |\n| --- |\n| 0.5 |\n"
    assert done == f"before\n<!-- report rooms: Some -->\n{table}<!-- end -->\nafter\n"
    assert filled(done, TABLES) == done
    wrong = json.loads(json.dumps(TABLES).replace("0.5", "0.6"))
    assert filled(done, wrong) != done
    with pytest.raises(ValueError, match="expected a table 'Other', found 'Some: more'"):
        filled(TEXT.replace(": Some", ": Other"), TABLES)


def test_the_report_names_machine_weights_and_command():
    document = json.loads(SMALL.read_bytes())
    assert document["command"].startswith("langflash lab eval report")
    assert document["weights"] and document["machine"]["versions"] and document["made"]
    assert "/tmp" not in json.dumps(document) and "/work" not in json.dumps(document)
