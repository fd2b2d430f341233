"""`langflash tour`: every action, in place and to another file; and films along stops."""

import itertools
import json
import shutil

import pytest
import torch

from langflash_core.errors import ViewError
from langflash_core.geometry.poses import FLIGHT, STAY
from langflash_core.scene.file import load
from langflash_core.scene.tour import read_tour, told_tour
from langflash_core.showing.tours import place_of, tour_in
from langflash_core.splat import render
from langflash_core.writing import films
from tests.app.cli.conftest import stripes
from tests.scene.test_tour import TOUR

TORCH = ("--backend", "torch")


@pytest.fixture
def scene(scene_file, tmp_path):
    return shutil.copy(scene_file, tmp_path / "room.langflash")


def test_a_tour_from_nothing_to_json_and_back(done, scene, tmp_path):
    def tour(*words) -> str:
        return done("tour", *words).out

    assert "no tour" in tour("list", scene)
    tour("stop", scene, "Door", "--text", "Come in.")
    tour("stop", scene, "Window", "--view", "2", "--phrase", "armchair", "--start", "--place", "1")
    tour("note", scene, "Lamp", "--at", "-0.1,0.2,1", "--phrase", "floor lamp")
    tour("note", scene, "Width", "--at", "0,0,1", "--to", "0.3,0.4,1")
    listed = tour("list", scene)
    assert "stop 1: Window (start)" in listed and "stop 2: Door: Come in." in listed
    assert 'note 1 at -0.10, 0.20, 1.00: Lamp [asks "floor lamp"]' in listed and "0.500 scene units" in listed
    tour("order", scene, "Door")
    assert tour_in(scene)[0].names == ("Door", "Window")
    written = tmp_path / "tour.json"
    tour("export", scene, "-o", written)
    other = tmp_path / "other.langflash"
    tour("remove", scene, "Door", "--note", "1", "-o", other)
    assert tour_in(scene)[0].names == ("Door", "Window") and tour_in(other)[0].names == ("Window",)
    tour("start", other)
    assert tour_in(other)[0].start == "" and len(tour_in(other)[0].notes) == 1
    tour("import", other, written)
    assert tour_in(other)[0] == tour_in(scene)[0]
    assert json.loads(tour("list", other, "--json"))["start"] == "Window"
    assert torch.equal(load(other).gaussians.means, stripes().gaussians.means)


def test_a_note_finds_its_place_by_a_phrase(done, scene):
    done("tour", "note", scene, "--phrase", "armchair", *TORCH)
    (note,) = tour_in(scene)[0].notes
    x, _, z = note.at
    assert note.text == note.phrase == "armchair" and -0.8 < x < -0.3 and z == pytest.approx(1, abs=0.05)
    assert place_of(load(scene), "armchair", render) == pytest.approx(note.at, abs=1e-4)


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (("note", "SCENE", "Lamp"), "needs a place"),
        (("note", "SCENE", "--phrase", "submarine", *TORCH), "not found in any view: submarine"),
        (("note", "SCENE", "Lamp", "--at", "1,2"), "expected X,Y,Z"),
        (("stop", "SCENE", "Far", "--view", "9"), "there is no photo 9: this scene has 2; use --view 1 to 2"),
        (("stop", "SCENE", "Far", "--view", "0"), "photos count from 1"),
        (("stop", "SCENE", " "), "1 to 60 letters"),
        (("remove", "SCENE"), "nothing was named"),
        (("remove", "SCENE", "Cellar"), "no stop Cellar"),
        (("remove", "SCENE", "--note", "1"), "no note 1"),
        (("import", "SCENE", "SCENE"), "holds no tour"),
        (("list", "scene.ply"), "there is no scene"),
        (("export", "SCENE", "-o", "SCENE"), "also an input"),
    ],
)
def test_bad_input_is_one_sentence_and_changes_nothing(refused, scene, words, hint):
    assert hint in refused("tour", *(scene if word == "SCENE" else word for word in words))


def test_a_film_of_a_tour_stays_at_its_stops():
    scene = stripes().with_record(tour=told_tour(TOUR))
    cameras = films.way("tour", scene, scene, (64, 48), None)
    assert len(cameras) == round(films.RATE * (2 * STAY + FLIGHT))
    still = [torch.equal(a.viewmat, b.viewmat) for a, b in itertools.pairwise(cameras)]
    assert still[:40] == [True] * 40 and still[-40:] == [True] * 40 and sum(still) < len(still) - 60
    assert len(films.way("tour", scene, scene, None, 2.0)) == 2 * films.RATE
    with pytest.raises(ViewError, match="has no tour"):
        films.way("tour", stripes(), stripes(), None, None)
    assert read_tour(scene.record.tour) == TOUR
