"""`langflash lab eval sharp` on a small pair, one version beside another."""

import json

import pytest
from PIL import Image

from langflash_core.base.resources import asset_path


@pytest.fixture
def pair(tmp_path):
    """The toys, 120 pixels wide: about twice what the network then sees."""
    folder = tmp_path / "photos"
    folder.mkdir()
    for side in ("left", "right"):
        with Image.open(asset_path(f"photos/toy_{side}.png")) as photo:
            photo.convert("RGB").resize((120, 90), Image.Resampling.LANCZOS).save(folder / f"toy_{side}.png")
    return folder


def test_a_pair_is_judged_kept_and_judged_beside_what_was_kept(run, pair, tmp_path):
    kept, results = tmp_path / "kept", tmp_path / "results"
    words = ("lab", "eval", "sharp", pair, "--size", "56")
    outcome = run(*words, "--keep", kept, "--results", results, "--json")
    assert outcome.code == 0, outcome.err
    document = outcome.json()
    assert document == json.loads((results / "sharp.json").read_text())
    (row,) = document["cases"]
    width, height = row["size"]
    assert row["name"] == "toy" and row["grid"][0] < width <= 120 and height <= 90
    columns = ("plain", "normal", "grid")
    plain, normal, grid = (document["measures"][column]["photos"] for column in columns)
    assert 10 < plain["psnr"] < min(normal["psnr"], grid["psnr"])
    assert plain["detail"] < 1 and 0 < plain["opaque"] < 1
    file = kept / "plain" / "toy.langflash"
    assert document["measures"]["plain"]["once"]["bytes"] == file.stat().st_size
    table = tmp_path / "new" / "table.md"
    again = run(*words[:3], *sorted(pair.iterdir()), *words[4:], "--beside", kept / "normal", "-o", table)
    assert again.code == 0 and again.out == table.read_text()
    assert "| measure | photo through the grid | plain | normal | other version |" in again.out
    change = next(line for line in again.out.splitlines() if line.startswith("| The photos' own places"))
    assert change.endswith("| +0.00 |")  # the same version; one pair has no standard error


def test_a_scene_that_is_not_beside_is_named(run, pair, tmp_path):
    (tmp_path / "other").mkdir()
    words = ("lab", "eval", "sharp", pair, "--size", "56", "--beside", tmp_path / "other")
    outcome = run(*words)
    assert outcome.code == 2 and "toy.langflash" in outcome.err and outcome.err.count("\n") == 1
