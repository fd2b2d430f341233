"""`langflash hide` and `langflash clean` as a person types them."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from app.window.recovery import tiles
from langflash_core.scene.file import load, save
from tests.app.cli.conftest import HEIGHT, WIDTH, stripes

RED = np.array([1, 0, 0])  # of the left third, the armchair


@pytest.fixture
def photographed(tmp_path):
    """The stripes with photos of their own, which hold text and a second picture beside their pixels."""
    scene, photos = stripes(), []
    for _ in range(2):
        pixels = np.zeros((HEIGHT, WIDTH, 3), np.uint8) + 40
        pixels[:, : WIDTH // 3 + 2] = (230, 20, 20)
        stream = io.BytesIO()
        Image.fromarray(pixels).save(stream, "JPEG", comment=b"secret text", quality=95)
        photos.append(stream.getvalue())
    path = tmp_path / "room.langflash"
    save(replace(scene, photos=tuple(photos)), path)
    return path


@pytest.mark.parametrize("how", ["blur", "pixels", "remove"])
def test_what_answers_is_hidden_in_scene_and_photos(done, photographed, tmp_path, how):
    out = tmp_path / "out" / "hidden.langflash"
    told = done("hide", photographed, "armchair", "-o", out, "--how", how, "--backend", "torch", "--json")
    report, hidden = told.json(), load(out)
    assert report["members"] > 500 and report["how"] == how and set(report["photos"]) == {"1", "2"}
    assert b"secret text" not in out.read_bytes()
    if how == "remove":
        pixels = np.asarray(Image.open(io.BytesIO(hidden.photos[0])).convert("RGB")) / 255
        assert not (np.abs(pixels - RED).max(-1) < 0.35).any()


def test_the_report_says_what_still_shows_it(done, photographed, tmp_path):
    told = done("hide", photographed, "armchair", "-o", tmp_path / "h.langflash", "--backend", "torch")
    assert "still show it" in told.out and "photo 1" in told.out


def test_no_small_picture_of_recent_scenes_shows_it_any_more(
    done, photographed, tmp_path, monkeypatch: pytest.MonkeyPatch
):
    """It lay on the disk until the window was opened next."""
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    other, out = tmp_path / "other.langflash", tmp_path / "public.langflash"
    for path in (other, out):
        path.write_bytes(photographed.read_bytes())
    seen = np.full((60, 90, 3), 200, np.uint8)
    for path in (photographed, other, out):
        tiles.keep_picture(str(path), seen, tiles.stamp(path))
    assert len(list(tmp_path.rglob("*.jpg"))) == 3
    done("hide", photographed.name, "armchair", "-o", out.name, "--backend", "torch")
    assert len(list(tmp_path.rglob("*.jpg"))) == 1 and tiles.picture(str(other)) is not None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("giraffe", "--threshold", ".999"), "nothing in the scene answers giraffe"),
        (("armchair", "--blocks", "40"), "40 blocks do not hide it"),
        (("armchair", "--how", "remove", "--blocks", "4"), "leave --blocks out"),
        (("armchair", "--open"), "leave --open out"),
        (("armchair", "--margin", "2"), "from 0 to 1"),
        (("armchair", "--preview", "p.txt"), "rename --preview"),
    ],
)
def test_bad_words_write_nothing(refused, scene_file, tmp_path, words, said):
    words = ("hide", scene_file, *words, "-o", tmp_path / "h.langflash", "--backend", "torch")
    assert said in refused(*words, warned=True)


def test_a_scene_is_not_hidden_in_itself(run, scene_file):
    before = scene_file.read_bytes()
    assert run("hide", scene_file, "armchair", "-o", scene_file).code == 2
    assert scene_file.read_bytes() == before


def test_a_recipe_does_again_what_was_asked_for(done, scene_file, tmp_path):
    first, second, recipe = (tmp_path / name for name in ("a.langflash", "b.langflash", "r.json"))
    words = ("--where", "colour~#eb8080:.1", "--crop=-.7,-.6,0,.8,.6,2", "--save-recipe", recipe)
    drawn = ("--preview", tmp_path / "p.png", "--backend", "torch")
    told = done("clean", scene_file, "-o", first, *words, *drawn)
    assert "outside the box" in told.out
    again = done("clean", scene_file, "-o", second, "--recipe", recipe, "--json")
    assert first.read_bytes() == second.read_bytes()
    assert again.json()["removed"] > 100 and again.json()["recipe"] == json.loads(recipe.read_text())
    with Image.open(tmp_path / "p.png") as picture:
        assert picture.size == (2 * WIDTH, 2 * HEIGHT)


def test_what_a_phrase_means_is_removed_and_filled(done, scene_file, tmp_path):
    out = tmp_path / "c.langflash"
    words = ("--where", "opacity>.1", "--within", "floor lamp", "--fill", "--backend", "torch", "--json")
    told = done("clean", scene_file, "-o", out, *words)
    assert told.json()["removed"] > 500 and told.json()["filled"] > 100
    assert len(load(out).gaussians) == told.json()["left"] + told.json()["filled"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--strength", "3"), "from 0 to 1"),
        (("--strength", "0"), "cleans nothing up"),
        (("--where", "weight<3"), "no measure 'weight'"),
        (("--where", "confidence<.5"), "how sure its depth is"),
        (("--crop", "1,2,3"), "is no box"),
        (("--recipe", "none.json"), "none.json"),
        (("--where", "opacity>0"), "nothing would be left"),
        (("--within", "giraffe", "--where", "opacity<.1"), "nothing in the scene answers"),
    ],
)
def test_bad_clean_ups_write_nothing(refused, scene_file, tmp_path, words, said):
    assert said in refused("clean", scene_file, "-o", tmp_path / "c.langflash", *words)


def test_a_recipe_and_other_words_exclude_each_other(refused, scene_file, tmp_path):
    (tmp_path / "r.json").write_text("{}")
    words = ("--recipe", tmp_path / "r.json", "--strength", ".5")
    said = refused("clean", scene_file, "-o", tmp_path / "c.langflash", *words)
    assert "leave --strength out" in said
