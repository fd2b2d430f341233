"""`langflash export --what boxes`: the same places and sizes as JSON, as a table and as bodies."""

import csv
import io
import json
import weakref
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

import langflash_core
from langflash_core import pipeline
from tests.app.cli.conftest import HEIGHT, WIDTH, stripes

ASKED = ("--what", "boxes", "--prompt", "armchair", "submarine", "--backend", "torch")


def exported(run, scene_file, path, *words):
    outcome = run("export", scene_file, *ASKED, *words, "-o", path)
    assert outcome.code == 0, outcome
    return path


def test_three_files_say_the_same(run, scene_file, tmp_path):
    rows = json.loads(exported(run, scene_file, tmp_path / "a.json").read_text())
    assert [(row["prompt"], row["found"]) for row in rows] == [("armchair", True), ("submarine", False)]
    box = rows[0]["box"]
    with exported(run, scene_file, tmp_path / "a.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [float(table[0][f"center_{axis}"]) for axis in "xyz"] == box["center"]
    assert [float(table[0][f"size_{axis}"]) for axis in "xyz"] == box["size"]
    assert table[1]["center_x"] == ""
    bodies = trimesh.load_scene(exported(run, scene_file, tmp_path / "a.glb"))
    assert list(bodies.geometry) == ["armchair (photo 1)"]
    (corners,) = bodies.bounds[None]
    np.testing.assert_allclose(corners.mean(0), np.array(box["center"]) * [-1, -1, 1], atol=1e-5)


def test_boxes_are_measured_in_a_view_as_large_as_its_photo(run, tmp_path, monkeypatch):
    """The network sees photos much smaller, and small things not at all."""
    sizes, query, stream = [], pipeline.query, io.BytesIO()

    def watched(*args, camera, **options):
        sizes.append((camera.width, camera.height))
        return query(*args, camera=camera, **options)

    Image.new("RGB", (2 * WIDTH, 2 * HEIGHT)).save(stream, "JPEG")
    scene = tmp_path / "scene.langflash"
    langflash_core.save(replace(stripes(), photos=(stream.getvalue(),) * 2), scene)
    monkeypatch.setattr(pipeline, "query", watched)
    exported(run, scene, tmp_path / "a.json")
    exported(run, scene, tmp_path / "b.json", "--size", "28x21")
    assert sizes == [(2 * WIDTH, 2 * HEIGHT), (28, 21)]


def test_every_photo_has_its_boxes(run, done, scene_file, tmp_path):
    words = ("--what", "boxes", "--prompt", "armchair", "--all-views", "--backend", "torch")
    done("export", scene_file, *words, "-o", tmp_path / "a.glb")
    views = json.loads(run("info", scene_file, "--json").out)["views"]
    assert len(trimesh.load_scene(tmp_path / "a.glb").geometry) == views


@pytest.mark.parametrize(
    ("name", "words", "hint"),
    [
        ("a.glb", ("--what", "boxes"), "--prompt"),
        ("a.glb", ("--what", "boxes", "--prompt", "submarine", "--backend", "torch"), "lower the threshold"),
        ("a.png", ("--what", "boxes", "--prompt", "armchair"), ".json or .csv or .glb"),
    ],
)
def test_what_cannot_be(refused, scene_file, tmp_path, name, words, hint):
    assert hint in refused("export", scene_file, *words, "-o", tmp_path / name)


@pytest.mark.parametrize("words", [("--prompt", "armchair"), ("--what", "boxes", "--prompt", "armchair")])
def test_a_json_of_another_kind_is_not_replaced(run, done, scene_file, tmp_path, words):
    camera = tmp_path / "camera.json"
    command = ("export", scene_file, "-o", camera, *words, "--backend", "torch")
    for other in ('{"viewmat": []}', '["a"]', "no JSON"):
        camera.write_text(other)
        outcome = run(*command)
        assert outcome.code == 2 and "--replace" in outcome.err, outcome
        assert outcome.err.count("\n") == 1 and camera.read_text() == other
    done(*command, "--replace")
    done(*command)  # its own kind


def test_one_view_after_the_other_is_in_memory(done, scene_file, tmp_path, monkeypatch):
    query, alive = pipeline.query, []

    def watched(*args, **options):
        result = query(*args, **options)
        alive.append(weakref.ref(result.frame.weight_maps))
        # The one that the loop lets go of with the next is still there.
        assert sum(one() is not None for one in alive) <= 2
        return result

    scene = langflash_core.load(scene_file)
    views = [0, 1, 0, 1]
    many = tmp_path / "many.langflash"
    langflash_core.save(replace(scene, viewmats=scene.viewmats[views], Ks=scene.Ks[views]), many)
    monkeypatch.setattr(pipeline, "query", watched)
    asked = ("--prompt", "armchair", "--backend", "torch")
    for words in (("a.json",), ("b.csv", "--all-views"), ("c.png", "--what", "labels", "--all-views")):
        alive.clear()
        done("export", many, "-o", tmp_path / words[0], *words[1:], *asked)
        assert len(alive) == 4
