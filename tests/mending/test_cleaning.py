"""Recipes: as files, in words, and what they take from a scene, against plain loops."""

import json

import numpy as np
import pytest

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.mending.cleaning import apply_recipe, box_of, inside, taken_out
from langflash_core.mending.recipes import Recipe, load_recipe, parsed_box, parsed_rule, save_recipe
from langflash_core.scene.instances import disc_radii


def test_a_recipe_comes_back_from_its_file(tmp_path):
    rules = (parsed_rule("opacity<.1,size>.2"), parsed_rule("colour~#80c0ff:.2"), parsed_rule("depth>1"))
    for crop in (None, "core", (-1.0, -2.0, 0.5, 1.0, 2.0, 3.5)):
        recipe = Recipe(0.5, ("sheets",), rules, ("chair",), True, crop)
        save_recipe(recipe, tmp_path / "r.json")
        assert load_recipe(tmp_path / "r.json") == recipe


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "damaged"),
        ('{"format": "other"}', "no recipe"),
        ("[1]", "no recipe"),
        ({"version": 2}, "newer"),
        ({"colour": 1}, "newer"),
        ({"strength": 7}, "out of range"),
        ({"kinds": ["dust"]}, "no kind 'dust'"),
        ({"kinds": 5}, "damaged"),
        ({"rules": [{"opacity": [None, None]}]}, "lacks a number"),
        ({"rules": [{"opacity": ["a", 1]}]}, "finite numbers"),
        ({"rules": [{"weight": [0, 1]}]}, "no measure 'weight'"),
        ({"rules": [{}]}, "needs a condition"),
        ({"within": [3]}, "phrases"),
        ({"crop": [0, 0, 0, 1, 1]}, "is no box"),
        ({"crop": [0, 0, 0, 1, 1, -1]}, "low corner"),
        ({"crop": "attic"}, "no box 'attic'"),
        ({"strength": float("nan")}, "out of range"),
    ],
)
def test_a_damaged_recipe_is_one_sentence(tmp_path, content, said):
    if isinstance(content, dict):
        content = json.dumps({"format": "langflash-recipe", "version": 1, **content})
    (tmp_path / "r.json").write_text(content)
    with pytest.raises(InputError, match=said) as caught:
        load_recipe(tmp_path / "r.json")
    assert "\n" not in str(caught.value)


def test_a_missing_recipe_is_said(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_recipe(tmp_path / "none.json")


@pytest.mark.parametrize("text", ["opacity", "opacity<x", "mass<1", "", "colour~#12", "opacity<nan"])
def test_words_that_are_no_rule_are_refused(text):
    with pytest.raises(InputError):
        parsed_rule(text)


def test_a_rule_holds_where_all_of_its_conditions_do(known):
    scene = known.scene
    radii = disc_radii(scene.gaussians)
    limit = float(np.median(radii))
    eyes = invert_rigid(scene.viewmats.double())[:, :3, 3].numpy()
    recipe = Recipe(rules=(parsed_rule(f"size>{limit},depth<1"), parsed_rule("confidence<.5")))
    found = apply_recipe(scene, recipe).rows
    assert scene.confidences is not None
    for row in range(0, len(found), 37):
        mean = scene.gaussians.means[row].double().numpy()
        depth = min(np.linalg.norm(mean - eye) for eye in eyes)
        expected = (radii[row] > limit and depth < 1) or float(scene.confidences[row]) < 0.5
        assert found[row] == expected
    assert 0 < found.sum() < len(found)


def test_colours_and_photos_can_be_asked_for(known):
    dark = apply_recipe(known.scene, Recipe(rules=(parsed_rule("colour~#264d53:.12"),))).rows
    assert (dark & known.members.numpy()).sum() > 0.5 * dark.sum() > 20
    unseen = apply_recipe(known.scene, Recipe(rules=(parsed_rule("photos<1"),))).rows
    seen = apply_recipe(known.scene, Recipe(rules=(parsed_rule("photos>0"),))).rows
    assert unseen.any() and seen.any() and (unseen ^ seen).all()


def test_a_rule_is_told_in_its_own_order(known):
    recipe = Recipe(rules=(parsed_rule("size>.2,colour~#264d53:.12,depth<1"),))
    assert [*apply_recipe(known.scene, recipe).counts] == ["size > 0.2 and colour and depth < 1"]


def test_inverted_and_boxed(known):
    scene = known.scene
    rule = (parsed_rule("opacity>.5"),)
    found, others = (apply_recipe(scene, Recipe(rules=rule, invert=invert)) for invert in (False, True))
    assert (found.rows ^ others.rows).all() and found.rows.any()
    boxed = apply_recipe(scene, Recipe(crop="core"))
    assert 0 < boxed.rows.sum() < 0.1 * len(found.rows)
    assert sum(boxed.counts.values()) == boxed.rows.sum()


def test_boxes_by_name_hold_what_they_say(known):
    scene, every = known.scene, np.ones(len(known.members), bool)
    core, room = (box_of(scene, name, every) for name in ("core", "room"))
    assert 0.93 < inside(scene, core).mean() < 1
    assert all(a >= b for a, b in zip(core[:3], room[:3], strict=True))
    eyes = invert_rigid(scene.viewmats)[:, :3, 3].numpy()
    assert ((eyes >= room[:3]) & (eyes <= room[3:])).all()
    assert parsed_box("0,0,0,1,2,3") == (0, 0, 0, 1, 2, 3)


def test_what_goes_is_counted_and_its_hole_can_be_filled(known, draw):
    rows = known.members.numpy()
    left = taken_out(known.scene, rows)
    assert len(left.gaussians) == (~rows).sum() and left.record.num_deleted == rows.sum()
    assert len(taken_out(known.scene, rows, draw).gaussians) >= len(left.gaussians)
    with pytest.raises(InputError, match="nothing would be left"):
        taken_out(known.scene, np.ones(len(rows), bool))
