"""The worker's side of editing on a room whose answers are known."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from app.window.asking.commands import Calibrated, EditPrompt, SetThreshold
from app.window.editing import commands as edit
from app.window.editing import work
from app.window.editing.state import Reading, Region
from app.window.editing.things import ThingFound
from app.window.requests import SceneTask
from app.window.scene.commands import SceneArrived
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.geometry.poses import orthographic, project, to_camera, units_per_pixel
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.scene.edited import spoken_scene
from langflash_core.scene.edits import Mask, deny_atom, hide, merge_atoms, rename_atom, select
from langflash_core.splat import render
from langflash_core.splat.picking import SEEN
from langflash_core.splat.reference import rasterize
from tests.app.window.scenes import CHAIR, PHRASES, after, room

SIZE = (224, 168)
CHAIRS = 2500
MIDDLE_OF_CHAIR = (70.0, 110.0)  # pixels of view 0


@pytest.fixture(scope="module")
def info():
    return describe_scene(room(language_space("minilm").encode(list(PHRASES))), serial=3, name="room")


def scene_of(info, marks=None):
    return info.serial, info.memory, marks or info.history.marks


def result(request: SceneTask) -> Any:
    """The command that a request comes to, behind news of how far it is."""
    *_, command = request.run(lambda: False)
    return command


def find(info, region: Region, through: bool = False, marks=None) -> np.ndarray:
    request = work.FindInRegion(*scene_of(info, marks), region, info.views[0], SIZE, through, "replace")
    return result(request).mask.rows()


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
    expected[candidates[most >= SEEN]] = True
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
    monkeypatch.setattr(work, "MOST_PIXELS", 1000)
    coarse = find(info, box)
    # A third of the resolution moves the box's rim by up to a pixel of three.
    assert (fine & coarse).sum() > 0.9 * (fine | coarse).sum()


def by_phrase(info, text: str, like: bytes = b"", threshold: float | None = 0.8) -> work.FindByPhrase:
    return work.FindByPhrase(*scene_of(info), text, like, (), threshold, "replace")


def test_a_phrase_selects_its_gaussians_and_a_place_those_like_it(info) -> None:
    chair = result(by_phrase(info, "armchair"))
    assert isinstance(chair, edit.Found) and chair.what == "by 'armchair'"
    assert (chair.mask.rows() == (np.arange(12_300) < CHAIRS)).all()
    like = info.scene.semantics.dictionary[1].numpy().tobytes()
    wall = result(by_phrase(info, "like this", like, 0.97))
    assert isinstance(wall, edit.Found)
    assert (wall.mask.rows() == (info.scene.semantics.weight_ids[:, 0].numpy() == 1)).all()


def test_a_phrase_selects_the_same_before_its_first_answer_as_after_it(info) -> None:
    """Until then 0.5 was its threshold: nearly twice as much was selected, and would have been hidden."""
    state = after(State(), SceneArrived(info), EditPrompt(0, "armchair"))
    marks, asked = state.editing.marks, edit.SelectByPhrase(0)
    assert marks is not None
    early = work.request_for(asked, state, info, marks, SIZE)
    query = compile_query(info.scene, language_space("minilm"), ["armchair"])
    known = after(state, Calibrated(query.threshold))
    assert query.threshold != 0.5 and work.request_for(asked, known, info, marks, SIZE) == early
    own = work.request_for(asked, after(known, SetThreshold(0, 0.97)), info, marks, SIZE)
    assert isinstance(own, work.FindByPhrase) and own.threshold == 0.97
    assert isinstance(early, work.FindByPhrase)
    assert result(early) == result(replace(early, threshold=query.threshold))


def test_an_atom_selects_itself_and_what_it_was_merged_with(info) -> None:
    marks = merge_atoms(info.history.marks, (0, 2))
    alone = result(work.FindAtom(*scene_of(info), 0, "add")).mask
    both = result(work.FindAtom(*scene_of(info, marks), 2, "add")).mask
    assert len(alone) == CHAIRS and len(both) == CHAIRS + 4900


def test_growing_stays_within_a_phrase(info) -> None:
    start = Mask.of(np.arange(12_300) == 1225)  # a middle one of the block
    marks = select(info.history.marks, start)
    free = result(work.GrowSelection(*scene_of(info, marks), 12.0, None)).mask
    within = work.GrowSelection(*scene_of(info, marks), 12.0, by_phrase(info, "wall"))
    assert len(free) > 20 and free.rows()[1225]
    assert result(within).mask == start


def test_a_place_is_composed_as_the_weight_maps_hold_it(info) -> None:
    reading = Reading((100.4, 120.2), (0.0, 0.0, 1.0), 1.0)
    request = work.Weigh(*scene_of(info), reading, info.views[0], SIZE)
    maps = render(info.scene, to_camera(info.views[0], *SIZE)).weight_maps
    assert maps is not None
    np.testing.assert_allclose(request.weigh(), maps[120, 100].numpy(), atol=1e-6)  # float32 out
    hidden = hide(info.history.marks, Mask.full(12_300))
    assert not work.Weigh(*scene_of(info, hidden), reading, info.views[0], SIZE).weigh().any()


def test_a_place_has_words_also_the_persons_own(info) -> None:
    reading = Reading(MIDDLE_OF_CHAIR, (0.0, 0.0, 0.65), 0.65)
    place = (reading, info.views[0], SIZE)
    named = result(work.NamePlace(*scene_of(info), *place, b"", ("red armchair", "armchair")))
    words = dict(named.words)
    assert named.words[0][0] == "armchair" and named.words[0][1] > 0.99
    assert "red armchair" in words and named.reading.atoms is not None and named.reading.atoms[0][1] > 0.95
    vector = np.frombuffer(named.vector, np.float32)
    assert vector @ info.scene.semantics.dictionary[0].numpy() > 0.9
    drawn = np.array([0.0, 0.7, 0.0], np.float32).tobytes()
    assert result(work.NamePlace(*scene_of(info), *place, drawn, ())).words[0][0] == "wall"


def test_a_place_answers_to_its_new_name_with_the_score_of_a_phrase(info) -> None:
    serial, memory, marks = scene_of(info)
    marks = deny_atom(rename_atom(marks, 1, "fresco"), 1, "wall")
    drawn = np.array([0.0, 0.7, 0.0], np.float32)
    place = (Reading((1.0, 2.0), (0, 0, 1), 1.0), info.views[0], (64, 48))
    named = result(work.NamePlace(serial, memory, marks, *place, drawn.tobytes(), ()))
    word, score = named.words[0]
    assert word == "fresco"
    query = compile_query(spoken_scene(info.scene, marks), language_space("minilm"), ["fresco", "wall"])
    relevance = relevance_maps(torch.from_numpy(drawn)[None], query)[:, 0].tolist()
    assert score == pytest.approx(relevance[0], abs=1e-6) and relevance[0] > query.threshold
    assert relevance[1] < 0.5 and "wall" not in dict(named.words)
    strange = rename_atom(marks, 0, "\U0001f6cb")  # a name without a word that the tower knows breaks nothing
    assert result(work.NamePlace(serial, memory, strange, *place, drawn.tobytes(), ())).words


def thing_at(info, at: tuple[float, float], marks=None) -> np.ndarray:
    return chosen(result(work.FindThing(*scene_of(info, marks), at, info.views[0], SIZE, "replace")))


def chosen(found: edit.Found | ThingFound) -> np.ndarray:
    """(N,) bool: what a click selects."""
    return (found.mask if isinstance(found, edit.Found) else found.levels[found.chosen]).rows()


def test_a_click_takes_the_whole_thing(info) -> None:
    found = thing_at(info, MIDDLE_OF_CHAIR)
    assert found[:CHAIRS].all() and not found[CHAIRS:].any()
    assert not thing_at(info, (-50.0, -50.0)).any(), "nothing is there"


def test_a_click_takes_one_of_two_things_of_a_group(info) -> None:
    apart = info.scene.gaussians.means.clone()
    right = apart[:CHAIRS, 0] > CHAIR[0]
    apart[:CHAIRS][right] += torch.tensor([0.5, 0.0, 0.0])
    moved = replace(info.scene, gaussians=replace(info.scene.gaussians, means=apart))
    found = thing_at(replace(info, scene=moved), (MIDDLE_OF_CHAIR[0] - 20, MIDDLE_OF_CHAIR[1]))
    assert found.sum() == int((~right).sum()) and not found[:CHAIRS][right.numpy()].any()


def test_a_ball_takes_what_is_near_in_space(info) -> None:
    place = (MIDDLE_OF_CHAIR, info.views[0], SIZE, "replace")
    found = result(work.FindInSphere(*scene_of(info), *place, 12.0)).mask.rows()
    means = info.scene.gaussians.means.numpy()
    K = to_camera(info.views[0], *SIZE).K
    assert found[:CHAIRS].any() and not found[CHAIRS:].any(), "the wall behind is too far away"
    across = np.ptp(means[found], axis=0)[:2]
    expected = 2 * 12.0 * (CHAIR[2] - 0.2) / float(K[0, 0])
    assert across == pytest.approx(expected, rel=0.1)  # rows of 0.008 in a ball of 0.08


def test_a_lasso_goes_around_pixel_centres() -> None:
    triangle = Region(((0.0, 0.0), (8.0, 0.0), (0.0, 8.0)), around=True)
    y, x = np.mgrid[:10, :10] + 0.5
    inside = triangle.pixels(10, 10)
    off_edge = abs(x + y - 8.0) > 1e-9
    assert (inside == (x + y < 8.0))[off_edge].all() and inside.sum() > 20
    turned = Region(triangle.points[::-1], around=True).pixels(10, 10)
    assert (turned == inside)[off_edge].all()
    assert not Region(((1.0, 1.0), (5.0, 5.0)), around=True).pixels(10, 10).any()
    assert Region(((-9.0, -9.0), (30.0, -9.0), (30.0, 30.0), (-9.0, 30.0)), around=True).pixels(10, 10).all()


def test_atoms_are_named(info) -> None:
    names = result(work.NameAtoms(*scene_of(info))).names
    assert [row[0] for row in names] == list(PHRASES)


def test_with_parallel_rays_a_region_a_ball_and_a_click_take_what_they_show(info) -> None:
    own = info.views[0]
    flat = orthographic(own, *info.extent)
    middle = np.array([CHAIR])
    found = project(middle, flat, SIZE)
    assert found is not None
    at = tuple(found[1][0].tolist())
    brush = work.FindInRegion(*scene_of(info), Region((at,), radius=6.0), flat, SIZE, False, "replace")
    brushed = result(brush).mask.rows()
    assert brushed.any() and not brushed[CHAIRS:].any()  # the block's front alone
    thing = chosen(result(work.FindThing(*scene_of(info), at, flat, SIZE, "replace")))
    assert thing[:CHAIRS].mean() > 0.99 and not thing[CHAIRS:].any()
    pixels = 20.0
    ball = result(work.FindInSphere(*scene_of(info), at, flat, SIZE, "replace", pixels)).mask.rows()
    means = info.scene.gaussians.means.numpy()
    reach = np.linalg.norm(means[ball] - means[ball].mean(0), axis=1).max()
    # Of a flat front: as wide as the ball, up to the spacing of its Gaussians and a pixel.
    assert reach == pytest.approx(pixels * units_per_pixel(flat, *SIZE), abs=0.02)
