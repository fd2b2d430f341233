"""JSON, CSV and table say the same."""

import csv
import io
import json
import math

import pytest

from app.bench import csv_text, document, measure, table
from app.bench.machine import machine
from app.bench.modes import modes_for
from app.bench.report import COLUMNS, FORMAT
from langflash_core.lab.evaluation.report_drawing import drawing_section
from tests.app.bench.conftest import silent, small_case


@pytest.fixture(scope="module")
def measured(context) -> dict:
    case = small_case()
    with context:  # current, whoever else drew in between
        results = [measure(context, case, modes_for(case.scene), silent)]
        return document(machine(context), results)


def test_json_holds_plain_values(measured):
    assert json.loads(json.dumps(measured, allow_nan=False)) == measured
    assert measured["format"] == FORMAT
    for name in ("gpu", "vendor", "driver", "processor", "cpus", "versions"):
        assert measured["machine"][name]
    (case,) = measured["cases"]
    assert case["scene"]["gaussians"] == 400 and case["scene"]["atoms"] == 30
    assert case["scene"]["channels"] == 512 and case["scene"]["rank"] == 30
    assert case["picture"] == [64, 48]
    assert case["stages"]["map_passes"] == 2 and case["stages"]["layers_a_pixel"] > 1
    assert case["rows"][0]["mode"] == "default" and case["rows"][0]["times_default"] == 1
    for row in case["rows"]:
        assert tuple(row) == COLUMNS
        assert row["ms_median"] <= row["ms_p95"]


def test_csv_has_the_rows_of_the_json(measured):
    lines = list(csv.DictReader(io.StringIO(csv_text(measured))))
    rows = [row for case in measured["cases"] for row in case["rows"]]
    assert len(lines) == len(rows)
    for line, row in zip(lines, rows, strict=True):
        assert line["case"] == measured["cases"][0]["name"]
        for name, value in row.items():
            assert line[name] == ("" if value is None else str(value))


def test_a_section_has_every_mode_in_table_plot_and_numbers(measured):
    section = drawing_section(measured)
    rows = measured["cases"][0]["rows"]
    (shown,), (plot,) = section.tables, section.plots
    assert (
        [row[0] for row in shown.rows] == [point.name for point in plot.points] == [r["mode"] for r in rows]
    )
    assert shown.rows[0][1] == "1.00" and all(len(row) == len(shown.header) for row in shown.rows)
    for row, point in zip(rows, plot.points, strict=True):
        assert (1e3 * point.seconds, point.error) == pytest.approx((row["ms_median"], row["relevance_mean"]))
        assert section.result["measures"][f"{row['mode']}: psnr_db"] == row["psnr_db"]
    assert "400 Gaussians" in section.about and measured["machine"]["gpu"] in section.about


def test_the_table_names_machine_scene_and_every_mode(measured):
    text = table(measured)
    for words in (measured["machine"]["gpu"], measured["machine"]["driver"], "400 Gaussians", "K = 30"):
        assert words in text
    for row in measured["cases"][0]["rows"]:
        assert f"\n  {row['mode']} " in text


def test_equal_pictures_and_no_error_have_a_row_too(measured):
    row = {**measured["cases"][0]["rows"][0], "psnr_db": None, "relevance_mean": 0.0}
    perfect = {**measured, "cases": [{**measured["cases"][0], "rows": [row]}]}
    assert "-" in table(perfect).splitlines()[-1]
    assert math.isfinite(perfect["cases"][0]["rows"][0]["ms_median"])
