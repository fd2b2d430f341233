"""`langflash words` and `query --scenes`: what one scene was taught, asked of others."""

import csv
import json
from dataclasses import replace

import pytest
from PIL import Image

from app.cli.survey import scene_files
from langflash_core.errors import InputError
from langflash_core.language.lessons import read_lessons
from langflash_core.scene.file import load, save
from tests.app.cli.conftest import HEIGHT, WIDTH, striped_photo, stripes

TORCH = ("--backend", "torch")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two photographed scenes, of which the first was taught, one without photos, and a broken one."""
    root = tmp_path_factory.mktemp("scenes")
    first = replace(stripes(), photos=(striped_photo(0), striped_photo(1)))
    names = replace(first.record, atom_names={0: "heirloom"}, atom_denials={2: ("wooden floor",)})
    save(replace(first, record=names), root / "first.langflash")
    save(replace(stripes(), photos=(striped_photo(2), striped_photo(3))), root / "second.langflash")
    save(stripes(), root / "third.langflash")
    (root / "deep").mkdir()
    (root / "deep" / "broken.langflash").write_bytes(b"no scene")
    return root


def test_what_one_scene_was_taught_another_takes(run, done, folder, tmp_path):
    words, taught = tmp_path / "mine.words.json", tmp_path / "taught.langflash"
    learned = done("words", "learn", folder / "first.langflash", folder / "third.langflash", "-o", words)
    assert "learned 2" in learned.out
    again = run("words", "learn", folder / "first.langflash", "-o", words, "--json").json()
    assert again["learned"] == 2 and again["words"] == 2 == len(read_lessons(words))  # not twice
    assert "heirloom" in run("words", "list", words).out

    told = done("words", "teach", folder / "second.langflash", words, "-o", taught, "--json")
    groups = {group["group"]: group for group in told.json()["groups"]}
    assert groups[0]["name"] == "heirloom" and groups[2]["denied"] == ["wooden floor"] and 1 not in groups
    assert load(taught).record.atom_names == {0: "heirloom"}

    asked = ("query", folder / "second.langflash", "heirloom", "-o", tmp_path / "out", "--json", *TORCH)
    before, after = run(*asked).json(), run(*asked, "--words", words).json()
    assert not before["prompts"][0]["found"] and after["prompts"][0]["found"]


def test_nothing_taught_or_no_photo_is_one_sentence_and_writes_nothing(run, refused, folder, tmp_path):
    words = tmp_path / "mine.words.json"
    refused("words", "learn", folder / "second.langflash", "-o", words)
    refused("words", "learn", folder / "first.langflash", "-o", tmp_path / "mine.txt")
    run("words", "learn", folder / "first.langflash", "-o", words)
    said = refused("words", "teach", folder / "third.langflash", words, "-o", tmp_path / "no.langflash")
    assert "no photos" in said


def test_phrases_of_many_scenes_in_one_table(done, folder, tmp_path):
    phrases, out = tmp_path / "phrases.txt", tmp_path / "out"
    phrases.write_text("submarine\n\n# not this\narmchair\n")
    outcome = done("query", "--scenes", folder, "--prompts", phrases, "-o", out, "--json", *TORCH)
    left_out, untaught = outcome.err.splitlines()
    assert "deep/broken was left out" in left_out and '"submarine" is no thing' in untaught
    document = json.loads((out / "answers.json").read_text())
    assert {key: outcome.json()[key] for key in document} == document
    chair = document["prompts"][1]
    assert chair["prompt"] == "armchair" and sum(one["found"] for one in chair["scenes"]) == 3
    scores = [one["score"] for one in chair["scenes"]]
    assert scores == sorted(scores, reverse=True)
    rows = list(csv.DictReader((out / "answers.csv").read_text().splitlines()))
    assert len(rows) == 6 and [row["found"] for row in rows] == ["no"] * 3 + ["yes"] * 3
    assert {row["view"] for row in rows} <= {"1", "2"}, "photos count from 1"
    for row in rows:
        with Image.open(out / row["picture"]) as picture:
            assert picture.size == (WIDTH, HEIGHT)
    page = (out / "index.html").read_text()
    assert "armchair: found in 3 of 3" in page and "submarine: found in 0 of 3" in page
    assert "deep/broken" in page and "<script" not in page


def test_a_phrase_that_stands_there_twice_is_asked_once(run, folder, tmp_path):
    """It was "found in 6 of 6 scenes" of a folder of three."""
    asked = ("armchair", "wall", "Armchair", "armchair")
    outcome = run("query", "--scenes", folder, *asked, "-o", tmp_path / "out", "--json", *TORCH)
    rows = outcome.json()["prompts"]
    assert [(row["prompt"], len(row["scenes"])) for row in rows] == [("armchair", 3), ("wall", 3)]


def test_words_that_do_not_go_together_are_one_sentence(refused, folder, tmp_path):
    empty = tmp_path / "none.txt"
    empty.write_text("# nothing\n")
    (tmp_path / "bare").mkdir()
    out = ("-o", tmp_path / "out", *TORCH)
    for words in (
        ("query", *out),
        ("query", folder / "first.langflash", *out),
        ("query", "--scenes", folder, *out),
        ("query", "--scenes", folder, "chair", "--view", "1", *out),
        ("query", "--scenes", tmp_path / "bare", "chair", *out),
        ("query", folder / "first.langflash", "--prompts", empty, *out),
        ("query", folder / "first.langflash", "chair", "--words", empty, *out),
    ):
        refused(*words)
    with pytest.raises(InputError, match="no folder"):
        scene_files(tmp_path / "gone")
