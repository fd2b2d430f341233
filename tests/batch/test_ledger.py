"""The ledger reads what it wrote, whatever ended the run that wrote it."""

from dataclasses import replace

import pytest

from langflash_core.batch.ledger import COLUMNS, Ledger, Row
from langflash_core.errors import OutputError

FULL = Row("hall, the", "done", "", 1, 2.5, 3, 4, 5, "1/2", 600, 'said "no" | twice', "abc")


@pytest.fixture
def path(tmp_path):
    return tmp_path / "ledger.csv"


def test_round_trip_in_order(path):
    ledger, failed = Ledger(path), Row("den", "failed", "no picture; take\nanother")
    ledger.begin(())
    for row in (FULL, failed, Row("of another run", "done")):
        ledger.add(row)
    assert list(Ledger(path).rows.values()) == list(ledger.rows.values())
    ledger.settle(["den", "hall, the"])
    assert list(Ledger(path).rows.values()) == [failed, FULL, Row("of another run", "done")]


def test_a_row_cut_short_counts_as_none(path):
    ledger = Ledger(path)
    ledger.begin(())
    ledger.add(FULL)
    whole = path.read_bytes()
    ledger.add(replace(FULL, name="den"))
    end = path.read_bytes()
    for length in range(len(whole), len(end) - 1):
        path.write_bytes(end[:length])
        rows = Ledger(path).rows
        assert rows.pop(FULL.name) == FULL
        # Cut inside its last cell a row is whole, with a fingerprint that no photos have.
        assert all(row.fingerprint != FULL.fingerprint for row in rows.values())


def test_sets_begun_again_have_no_row(path):
    ledger = Ledger(path)
    ledger.begin(())
    ledger.add(FULL)
    again = Ledger(path)
    again.begin([FULL.name])
    assert path.read_text() == ",".join(COLUMNS) + "\n"


@pytest.mark.parametrize("content", [b"", b"a,b\n1,2\n", b"\xff\xfe\0"])
def test_another_file_is_not_overwritten(path, content):
    path.write_bytes(content)
    with pytest.raises(OutputError, match="not a ledger"):
        Ledger(path)
    assert path.read_bytes() == content
