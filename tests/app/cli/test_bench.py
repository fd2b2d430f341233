"""`langflash bench` from the command line."""

import csv
import json

import pytest

from app.bench.modes import AXES
from app.cli.words.showing import BENCH_AXES
from app.gl import offscreen_context
from langflash_core.errors import GraphicsError
from langflash_core.scene.file import save
from tests.app.cli.conftest import stripes

SMALL = ("--frames", "1", "--size", "28x21", "--only", "precision")


@pytest.fixture(autouse=True, scope="module")
def graphics():
    try:
        offscreen_context().release()
    except GraphicsError as problem:
        pytest.skip(str(problem))


def test_the_parser_knows_the_axes():
    assert BENCH_AXES == AXES


def test_measures_a_scene_and_writes_two_files(done, scene_file, tmp_path):
    folder = tmp_path / "out" / "bench"
    outcome = done("bench", scene_file, "--prompt", "armchair", *SMALL, "-o", folder)
    assert "float32" in outcome.out and "armchair" in outcome.out and "2,352 Gaussians" in outcome.out
    assert {path.name for path in folder.iterdir()} == {"bench.json", "bench.csv"}
    document = json.loads((folder / "bench.json").read_text())
    rows = document["cases"][0]["rows"]
    assert [row["mode"] for row in rows] == ["default", "float32"]
    assert rows[0]["psnr_db"] > 50 and rows[0]["relevance_mean"] < 2e-3
    with (folder / "bench.csv").open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(rows)


def test_json_of_a_generated_room(run):
    document = run("bench", "--synthetic", 60, "--atoms", 5, "--spread", 2, *SMALL, "--json").json()
    scene = document["cases"][0]["scene"]
    assert scene["gaussians"] == 60 and scene["atoms"] == 5
    assert len(scene["notes"]) == 2


def test_the_papers_cases_at_a_chosen_size(run):
    document = run("bench", "--paper", "--synthetic", 60, *SMALL, "--json").json()
    assert [len(case["query"]["phrases"]) for case in document["cases"]] == [1, 16]
    assert all(case["scene"]["atoms"] == 128 for case in document["cases"])


def test_bad_input(refused, scene_file, tmp_path):
    assert "--synthetic" in refused("bench")
    assert "leave the scene file out" in refused("bench", scene_file, "--paper")
    assert "--spread" in refused("bench", scene_file, "--spread", "2")
    assert "above 0" in refused("bench", "--paper", "--spread", "0")
    assert "know no words" in refused("bench", "--synthetic", "60", "--prompt", "chair")
    assert "know no words" in refused("bench", scene_file, "--atoms", "5", "--prompt", "chair")
    assert "atoms of its own" in refused("bench", scene_file, "--atoms", "5")
    assert "no scene" in refused("bench", tmp_path / "missing.langflash")
    assert "invalid choice" in refused("bench", scene_file, "--only", "colour")
    assert "1 to 960" in refused("bench", "--synthetic", "60", "--atoms", "0")
    assert "empty" in refused("bench", scene_file, "--prompt", " ")
    assert "at most 16" in refused("bench", scene_file, "--prompt", *["chair"] * 17)


def test_the_output_is_no_file(refused, scene_file, tmp_path_factory):
    taken = tmp_path_factory.mktemp("taken") / "file"
    taken.write_text("")
    assert "it is a file" in refused("bench", scene_file, "-o", taken)


def test_a_scene_without_atoms_needs_some(run, refused, tmp_path_factory):
    import dataclasses

    scene = stripes()
    bare = dataclasses.replace(
        scene.semantics,
        weight_ids=scene.semantics.weight_ids[:, :0],
        weight_values=scene.semantics.weight_values[:, :0],
        dictionary=scene.semantics.dictionary[:0],
    )
    path = tmp_path_factory.mktemp("bare") / "bare.langflash"
    save(dataclasses.replace(scene, semantics=bare), path)
    assert "--atoms 64" in refused("bench", path)
    document = run("bench", path, "--atoms", 4, *SMALL, "--json").json()
    assert "generated" in document["cases"][0]["scene"]["notes"][0]
