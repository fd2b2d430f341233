"""The worker's side of editing on a room whose answers are known, and edits that survive a crash."""

import os
from pathlib import Path

import numpy as np
import pytest
import torch

from app.window import autosave, chores
from app.window import edit_messages as ask
from app.window.editing import Reading, Region
from app.window.messages import LoadScene
from app.window.poses import to_camera
from app.window.state import NEGATIVES
from app.window.worker import describe_scene, make_scene
from langflash_core.language.spaces import language_space
from langflash_core.scene.edits import Mask, delete, hide, merge_atoms, rename_atom, select
from langflash_core.splat import render
from langflash_core.splat.reference import rasterize
from tests.app.window.scenes import PHRASES, room

SIZE = (224, 168)
CHAIRS = 2500
MIDDLE_OF_CHAIR = (70.0, 110.0)  # pixels of view 0


@pytest.fixture(scope="module")
def info():
    return describe_scene(room(language_space("minilm").encode(list(PHRASES))), serial=3, name="room")


@pytest.fixture(autouse=True)
def state_folder(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


def scene_of(info, marks=None):
    return info.serial, info.scene, marks or info.history.marks


def find(info, region: Region, through: bool = False, marks=None) -> np.ndarray:
    request = ask.FindInRegion(*scene_of(info, marks), region, info.views[0], SIZE, through, "replace")
    return chores.find_in_region(request).mask.rows()


def test_a_brush_selects_what_it_shows(info) -> None:
    region = Region((MIDDLE_OF_CHAIR,), radius=9.0)
    found = find(info, region)
    # The float64 reference with one feature for each Gaussian that might matter, the rest black.
    gaussians = info.scene.gaussians.map(lambda v: v.double())
    camera = to_camera(info.views[0], *SIZE)
    candidates = np.flatnonzero(find(info, region, through=True))
    features = torch.zeros(len(gaussians), len(candidates), dtype=torch.float64)
    features[candidates, np.arange(len(candidates))] = 1.0
    maps, _ = rasterize(gaussians, features, camera)
    most = maps[torch.from_numpy(region.pixels(*SIZE))].amax(0).numpy()
    expected = np.zeros(len(found), bool)
    expected[candidates[most >= chores.SEEN]] = True
    assert (found == expected).all()
    assert found[:CHAIRS].sum() > 50 and not found[CHAIRS:].any()
    assert len(candidates) - found.sum() > 0  # the floor or wall behind is found only through


def test_what_is_hidden_neither_covers_nor_is_found(info) -> None:
    chairs = Mask.of(np.arange(12_300) < CHAIRS)
    marks = hide(info.history.marks, chairs)
    behind = find(info, Region((MIDDLE_OF_CHAIR,), radius=9.0), marks=marks)
    assert behind[CHAIRS:].any() and not behind[:CHAIRS].any()


def test_a_large_box_is_looked_at_coarser(info, monkeypatch) -> None:
    box = Region(((40.0, 90.0), (100.0, 140.0)))
    fine = find(info, box)
    monkeypatch.setattr(chores, "MOST_PIXELS", 1000)
    coarse = find(info, box)
    # A third of the resolution moves the box's rim by up to a pixel of three.
    assert (fine & coarse).sum() > 0.9 * (fine | coarse).sum()


def by_phrase(info, text: str, like: bytes = b"", threshold: float = 0.8) -> ask.FindByPhrase:
    return ask.FindByPhrase(*scene_of(info), text, like, NEGATIVES, threshold, "replace")


def test_a_phrase_selects_its_gaussians_and_a_place_those_like_it(info) -> None:
    result = chores.run(by_phrase(info, "armchair"))
    assert isinstance(result, ask.SelectionFound) and result.what == "by 'armchair'"
    assert (result.mask.rows() == (np.arange(12_300) < CHAIRS)).all()
    like = info.scene.semantics.dictionary[1].numpy().tobytes()
    wall = chores.run(by_phrase(info, "like this", like, 0.97))
    assert isinstance(wall, ask.SelectionFound)
    assert (wall.mask.rows() == (info.scene.semantics.weight_ids[:, 0].numpy() == 1)).all()


def test_an_atom_selects_itself_and_what_it_was_merged_with(info) -> None:
    marks = merge_atoms(info.history.marks, (0, 2))
    alone = chores.find_atom(ask.FindAtom(*scene_of(info), 0, "add")).mask
    both = chores.find_atom(ask.FindAtom(*scene_of(info, marks), 2, "add")).mask
    assert len(alone) == CHAIRS and len(both) == CHAIRS + 4900


def test_growing_stays_within_a_phrase(info) -> None:
    start = Mask.of(np.arange(12_300) == 1225)  # a middle one of the block
    marks = select(info.history.marks, start)
    free = chores.grow_selection(ask.GrowSelection(*scene_of(info, marks), 12.0, None)).mask
    within = ask.GrowSelection(*scene_of(info, marks), 12.0, by_phrase(info, "wall"))
    assert len(free) > 20 and free.rows()[1225]
    assert chores.grow_selection(within).mask == start


def test_a_place_is_composed_as_the_weight_maps_hold_it(info) -> None:
    reading = Reading((100.4, 120.2), (0.0, 0.0, 1.0), 1.0)
    request = ask.Weigh(*scene_of(info), reading, info.views[0], SIZE)
    maps = render(info.scene, to_camera(info.views[0], *SIZE)).weight_maps
    assert maps is not None
    np.testing.assert_allclose(chores.weigh(request), maps[120, 100].numpy(), atol=1e-6)  # float32 out
    hidden = hide(info.history.marks, Mask.full(12_300))
    assert not chores.weigh(ask.Weigh(*scene_of(info, hidden), reading, info.views[0], SIZE)).any()


def test_a_place_has_words_also_the_persons_own(info) -> None:
    reading = Reading(MIDDLE_OF_CHAIR, (0.0, 0.0, 0.65), 0.65)
    place = (reading, info.views[0], SIZE)
    named = chores.name_place(ask.NamePlace(*scene_of(info), *place, b"", ("red armchair", "armchair")))
    words = dict(named.words)
    assert named.words[0][0] == "armchair" and named.words[0][1] > 0.99
    assert "red armchair" in words and named.reading.atoms is not None and named.reading.atoms[0][1] > 0.95
    vector = np.frombuffer(named.vector, np.float32)
    assert vector @ info.scene.semantics.dictionary[0].numpy() > 0.9
    drawn = np.array([0.0, 0.7, 0.0], np.float32).tobytes()
    assert chores.name_place(ask.NamePlace(*scene_of(info), *place, drawn, ())).words[0][0] == "wall"


def test_atoms_are_named(info) -> None:
    names = chores.name_atoms(ask.NameAtoms(*scene_of(info))).names
    assert [row[0] for row in names] == list(PHRASES)


def test_floaters_are_scored_for_every_row(info) -> None:
    result = chores.run(ask.ScoreFloaters(*scene_of(info)))
    assert isinstance(result, ask.FloatersScored) and len(result.scores) == 4 * 12_300


# Edits that survive


def edited(info):
    history = info.history.edited("Delete 5", delete(info.history.marks, Mask.of(np.arange(12_300) < 5)))
    return history.edited("Name", rename_atom(history.marks, 1, "Wand"))


def restore(offer) -> object:
    job = LoadScene(offer.edits.with_suffix(".langflash"), offer.edits)
    return make_scene(job, 9, lambda *_: None, lambda: False).info


def test_edits_are_offered_and_restored_whole(info, state_folder: Path) -> None:
    assert autosave.find(info.scene) is None
    history = edited(info)
    chores.run(ask.KeepEdits(info.serial, info.scene, history, "room", Path("/p/room.langflash"), "me"))
    offer = autosave.find(info.scene)
    assert offer is not None and (offer.name, offer.count) == ("room", 2)
    again = restore(offer)
    assert again.history == history and again.name == "room" and again.path == Path("/p/room.langflash")  # type: ignore[attr-defined]
    assert autosave.find(None) == offer
    chores.run(ask.ForgetEdits(info.scene, "somebody else"))
    assert autosave.find(info.scene) == offer
    chores.run(ask.ForgetEdits(info.scene, "me"))
    assert autosave.find(info.scene) is None and list(state_folder.iterdir()) == []


def test_edits_of_a_saved_scene_are_found_by_its_path(info) -> None:
    autosave.keep(info.scene, edited(info), "room", Path("/p/room.langflash"), "me")
    other = describe_scene(room(torch.eye(3)), serial=4, name="other").scene
    assert autosave.find(other) is None
    assert autosave.find(other, Path("/p/room.langflash")) is not None


def test_only_the_newest_are_kept_and_damaged_ones_passed_over(info, state_folder: Path) -> None:
    for number in range(autosave.MOST_KEPT + 2):
        edits = autosave.keep(info.scene, edited(info), f"room {number}", None, f"t{number}")
        os.utime(edits, (1000 + number, 1000 + number))
    assert len(list(state_folder.glob("*.edits"))) == autosave.MOST_KEPT
    newest = autosave.find(info.scene)
    assert newest is not None and newest.name == f"room {autosave.MOST_KEPT + 1}"
    newest.edits.write_text("{")
    passed = autosave.find(info.scene)
    assert passed is not None and passed.name == f"room {autosave.MOST_KEPT}"
