"""Tables of measures."""

from langflash_core.lab.evaluation.tables import measures_table


def test_measures_and_rivals_that_were_not_taken_are_left_out():
    rows = (
        ("Depth", "depth", "one depth", "flat"),
        ("PSNR", "psnr", "", ""),
        ("F1", "f1", "always found", "always"),
        ("SSIM", "ssim", "", ""),
    )
    measures = {"depth": 0.1, "flat": None, "psnr": None, "f1": 0.5, "always": 0.25}
    table = measures_table("", rows, measures)
    assert table.rows == [("Depth", "0.100", ""), ("F1", "0.500", "0.250 (always found)")]
