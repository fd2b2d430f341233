"""Two scenes of one room: what moved, came and went, and how one comes onto the other."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from langflash_core.base.records import Guess
from langflash_core.errors import InputError
from langflash_core.inventory import alignment, inventory
from langflash_core.inventory.beside import difference
from langflash_core.inventory.settings import ALIGNMENT
from langflash_core.language.spaces import language_space
from langflash_core.splat import render
from tests.boxroom import CHAIRS, METRES, TABLE, WORDS, box_room


@pytest.fixture(scope="module")
def room():
    return inventory(box_room().with_record(metric_scale=METRES))


def test_the_turn_scale_and_shift_of_matches_are_found_among_wrong_ones():
    rng = np.random.default_rng(0)
    theirs = rng.uniform(-2, 2, (60, 3))
    turn = Rotation.from_euler("y", 90.7, degrees=True).as_matrix()
    ours = 1.3 * theirs @ turn.T + [0.5, 0.1, -1.0]
    ours[::3] = rng.uniform(-3, 3, (20, 3))
    fit = alignment._fit_transform(ours, theirs, 1.0)
    assert fit is not None and fit.matches >= 40 and fit.tried == 60
    assert fit.scale == pytest.approx(1.3, abs=0.01) and np.allclose(fit.turn, turn, atol=0.01)
    good = np.arange(60) % 3 > 0
    assert np.allclose(fit.placed(theirs[good]), ours[good], atol=0.02)


def test_matches_that_agree_on_nothing_are_no_fit():
    rng = np.random.default_rng(1)
    fit = alignment._fit_transform(rng.uniform(-2, 2, (30, 3)), rng.uniform(-2, 2, (30, 3)), 1.0)
    assert fit is None or fit.matches < ALIGNMENT.least
    assert alignment._fit_transform(np.zeros((1, 3)), np.zeros((1, 3)), 1.0) is None


@pytest.mark.parametrize("times", [1.8, 0.55])
def test_a_wrong_guess_of_lengths_is_put_up_with_and_lengths_told_wrong_are_said(room, monkeypatch, times):
    """A told scale beside a guess, 1.8 times off, was called too little in common."""
    rng = np.random.default_rng(2)
    theirs = rng.uniform(-2, 2, (60, 3))
    ours = times * theirs + [0.5, 0.1, -1.0]
    monkeypatch.setattr(alignment, "_describe_keypoints", lambda found, render: ())
    monkeypatch.setattr(alignment, "_match_keypoints", lambda first, second: (ours, theirs))
    seen = replace(room, scene=replace(room.scene, photos=(b"", b"")))
    guessed = replace(seen, guess=Guess(2.0, 1.7, 2.4, ("door",)))
    assert alignment.align_scenes(guessed, seen, render).scale == pytest.approx(times, abs=0.01)
    assert alignment.align_scenes(seen, guessed, render).matches == 60
    with pytest.raises(InputError, match=r"told for both scenes, and they differ by 1\.8 times"):
        alignment.align_scenes(seen, seen, render)
    monkeypatch.setattr(alignment, "_match_keypoints", lambda first, second: (ours, theirs[::-1]))
    with pytest.raises(InputError, match="too little in common"):
        alignment.align_scenes(guessed, seen, render)


def test_three_changes_are_told_by_numbers(room, aligned):
    """A chair goes 80 cm, the table goes away, and nothing else changes."""
    moved = ((CHAIRS[0][0] + 0.8, CHAIRS[0][1]), CHAIRS[1])
    after = inventory(box_room(chairs=moved, table=None).with_record(metric_scale=METRES))
    found = difference(room, after, render)
    assert len(found.moved) == 1 and found.moved[0].by == pytest.approx(0.8, abs=0.08)
    assert found.moved[0].before.kind == "chair"
    assert [thing.kind for thing in found.went] == ["table"] and not found.came
    assert sorted(pair.before.kind for pair in found.stayed) == ["chair", "door"]
    back = difference(after, room, render)
    assert [thing.kind for thing in back.came] == ["table"] and not back.went
    assert len(back.moved) == 1


def test_a_room_beside_itself_is_the_same(room, aligned):
    found = difference(room, room, render)
    assert not (found.moved or found.came or found.went or found.unseen)
    # The identity is a product in float64, of places within ten metres.
    assert len(found.stayed) == len(room.things) and max(pair.by for pair in found.stayed) < 1e-13


def test_what_the_other_scene_calls_something_else_is_not_said_to_have_gone(room, aligned):
    scene = box_room().with_record(metric_scale=METRES)
    atoms = scene.semantics.dictionary.clone()
    atoms[WORDS.index("table")] = language_space("minilm").encode(("stool",))[0]
    misnamed = inventory(replace(scene, semantics=replace(scene.semantics, dictionary=atoms)))
    assert "table" not in misnamed.counts and misnamed.counts["stool"] == 1
    found = difference(room, misnamed, render)
    assert not (found.moved or found.went or found.came)
    assert ("table", "stool") in [(pair.before.kind, pair.after.kind) for pair in found.stayed]


def test_what_no_photo_of_the_other_scene_looks_at_is_not_said_to_have_gone(room, aligned):
    aside = box_room(table=None).with_record(metric_scale=METRES, world=room.world)
    turned = aside.viewmats.clone()
    turned[:, :3, :3] = turned.new_tensor([[-1.0, 0, 0], [0, 1, 0], [0, 0, -1]]) @ turned[:, :3, :3]
    looking_back = inventory(replace(aside, viewmats=turned), least=0.0)
    found = difference(room, looking_back, render)
    assert not found.went and TABLE and "table" in [thing.kind for thing in found.unseen]


def test_scenes_without_photos_are_refused(room):
    with pytest.raises(InputError, match="photos"):
        difference(room, room, render)


def test_scenes_of_two_languages_are_refused(room):
    semantics = replace(room.scene.semantics, space="another")
    other = replace(room, scene=replace(room.scene, semantics=semantics))
    with pytest.raises(InputError, match="speaks minilm, the other another"):
        difference(room, other, render)
