"""Edits and their exact undoing; the scene they describe; their file."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.base.records import World
from langflash_core.errors import SceneFileError
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import LanguageSpace
from langflash_core.scene.changes import Moved, Recoloured
from langflash_core.scene.edited import edited_scene, first_marks, spoken_scene
from langflash_core.scene.edits import (
    History,
    Marks,
    Mask,
    change,
    delete,
    deny_atom,
    hide,
    invert,
    isolate,
    merge_atoms,
    rename_atom,
    select,
    show_all,
    toggle_atom,
)
from langflash_core.scene.edits_file import load_history, read_about, save_history, scene_digest
from langflash_core.scene.file import load, save
from langflash_core.scene.joining import join_scenes
from langflash_core.scene.tour import Note, Stop, Tour, told_tour
from langflash_core.splat import render
from langflash_core.types import Scene
from tests.splat.scenes import camera, cloud
from tests.splat.test_compose import layered

COUNT, ATOMS = 1003, 9  # not a multiple of 8


def random_history(seed: int, steps: int) -> tuple[History, list[Marks]]:
    """A history of random edits of every kind, with the marks after each."""
    generator = np.random.default_rng(seed)
    history = History(Marks.without_edits(COUNT, ATOMS))
    passed = [history.marks]
    while len(history.done) < steps:
        marks = history.marks
        found = Mask.of(generator.random(COUNT) < generator.choice([0.01, 0.3, 0.9]))
        atom, other = (int(k) for k in generator.choice(ATOMS, 2, replace=False))
        choices = (
            ("select", select(marks, found)),
            ("add", select(marks, found, "add")),
            ("remove", select(marks, found, "remove")),
            ("invert", invert(marks)),
            ("delete", delete(marks, found & marks.selected)),
            ("hide", hide(marks, marks.selected)),
            ("isolate", isolate(marks, marks.selected)),
            ("show", show_all(marks)),
            ("rename", rename_atom(marks, atom, f"thing {generator.integers(9)}")),
            ("toggle", toggle_atom(marks, atom)),
            ("merge", merge_atoms(marks, (atom, other))),
        )
        history = history.edited(*choices[generator.integers(len(choices))])
        if len(history.done) == len(passed):
            passed.append(history.marks)
    return history, passed


def test_masks_are_sets():
    generator = np.random.default_rng(0)
    a, b = generator.random(COUNT) < 0.5, generator.random(COUNT) < 0.2
    pairs = ((Mask.of(a) | Mask.of(b), a | b), (Mask.of(a) & Mask.of(b), a & b))
    pairs = (*pairs, (Mask.of(a) ^ Mask.of(b), a ^ b), (Mask.of(a) - Mask.of(b), a & ~b))
    for mask, expected in pairs:
        assert (mask.rows() == expected).all() and len(mask) == expected.sum()
        assert mask == Mask.of(expected)  # also the bits that fill the last byte
    assert len(Mask.full(COUNT)) == COUNT and not Mask.none(COUNT) and not Mask.none(0)
    with pytest.raises(ValueError, match="expected 1003 rows"):
        _ = Mask.none(COUNT) | Mask.none(COUNT + 1)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, COUNT])
@pytest.mark.parametrize("some", [0, 1, 8, 500, 2000])
def test_the_first_rows_are_as_of_their_booleans(count: int, some: int) -> None:
    assert Mask.first(count, some) == Mask.of(np.arange(count) < some)
    assert Mask.full(count) == Mask.of(np.ones(count, bool)) and len(Mask.full(count)) == count


def test_what_every_frame_asks_of_marks_unpacks_no_set(monkeypatch) -> None:
    """Of ten million Gaussians a byte for each took a frame's thread .1 s."""
    marks = Marks.without_edits(COUNT, ATOMS)
    gone = delete(marks, Mask.first(COUNT, 10))
    monkeypatch.setattr(np, "packbits", None)
    monkeypatch.setattr(np, "unpackbits", None)
    assert len(gone.visible) == len(gone.left) == COUNT - 10
    assert gone.visible is gone.visible and gone.written != marks.written


@pytest.mark.parametrize("seed", range(3))
def test_200_random_edits_undone_give_the_first_state_bit_for_bit(seed):
    history, passed = random_history(seed, 200)
    assert len({m.selected.bits for m in passed}) > 50, "the edits change things"
    assert any(m.deleted for m in passed) and any(not a.on for m in passed for a in m.atoms)
    assert not any(m.selected & (m.deleted | m.hidden) for m in passed), "what is gone is never selected"
    back = history
    for marks in reversed(passed[:-1]):
        back = back.undo()
        assert back.marks == marks
    assert back.done == () and back.undo() == back
    forth = back.moved_to(200)
    assert forth == history and forth.redo() == forth
    assert history.moved_to(77).marks == passed[77] and back.moved_to(77) == history.moved_to(77)
    # A kilobyte of masks a scene: an edit stays within its three masks, and most are smaller.
    assert max(sum(len(bits) for _, bits in edit.flips) for edit in history.done) < 3 * (COUNT // 8 + 32)


def test_a_new_edit_forgets_what_was_undone_and_no_change_is_no_edit():
    history = History(Marks.without_edits(16, 0)).edited(
        "all", select(Marks.without_edits(16, 0), Mask.full(16))
    )
    assert history.edited("again", history.marks) is history
    undone = history.undo()
    assert undone.undone and undone.edited("hide", hide(undone.marks, Mask.full(16))).undone == ()


def test_an_edit_of_another_scene_is_refused():
    edit = History(Marks.without_edits(16, 2)).edited("x", invert(Marks.without_edits(16, 2))).done[0]
    with pytest.raises(ValueError, match="rows"):
        edit.apply(Marks.without_edits(800, 2))
    rename = (
        History(Marks.without_edits(8, 2))
        .edited("x", rename_atom(Marks.without_edits(8, 2), 1, "sofa"))
        .done[0]
    )
    with pytest.raises(ValueError, match="atom 1"):
        rename.apply(Marks.without_edits(8, 1))


# The scene that edits describe


class Tower:
    """Phrases as rows of a fixed random table."""

    def encode(self, texts):
        generator = torch.Generator().manual_seed(sum(map(ord, texts[0])))
        rows = torch.randn(len(texts), 16, generator=generator, dtype=torch.float64)
        return torch.nn.functional.normalize(rows, dim=-1)


SPACE = LanguageSpace("test", 16, 10.0, 0.5, 0.2, Tower)


@pytest.fixture
def scene() -> Scene:
    made = cloud(200, num_atoms=5, size=0.1)
    return replace(made, semantics=replace(made.semantics, space="test")).with_record(num_deleted=3)


def relevance(scene: Scene, frame_of: Scene) -> torch.Tensor:
    maps = render(frame_of, camera()).weight_maps
    assert maps is not None
    return relevance_maps(maps, compile_query(scene, SPACE, ["chair", "door"], negatives=["thing"]))


def test_untouched_marks_give_the_scene_itself(scene):
    marks = first_marks(scene)
    assert edited_scene(scene, marks) is scene and spoken_scene(scene, marks) is scene
    assert edited_scene(scene, hide(select(marks, Mask.full(200)), Mask.full(200))) is scene


def test_deleted_gaussians_are_left_out(scene):
    rows = np.zeros(200, bool)
    rows[10:60] = True
    smaller = edited_scene(scene, delete(first_marks(scene), Mask.of(rows)))
    assert len(smaller.gaussians) == 150 and smaller.record.num_deleted == 53
    assert torch.equal(smaller.gaussians.means, scene.gaussians.means[~torch.from_numpy(rows)])
    everything = edited_scene(scene, delete(first_marks(scene), Mask.full(200)))
    assert len(everything.gaussians) == 0 and everything.semantics.num_atoms == 5


def test_merged_atoms_answer_the_same_from_the_window_and_from_the_file(scene):
    marks = merge_atoms(first_marks(scene), (1, 3))
    spoken, saved = spoken_scene(scene, marks), edited_scene(scene, marks)
    assert saved.semantics.num_atoms == 4 and spoken.semantics.num_atoms == 5
    # Two float64 paths through the same sums; QR of matrices of different height.
    torch.testing.assert_close(relevance(spoken, scene), relevance(saved, saved), rtol=0, atol=1e-9)
    assert abs(relevance(spoken, scene) - relevance(scene, scene)).max() > 0.01
    merged = saved.semantics.dictionary[1]
    assert float(merged.norm()) == pytest.approx(1, abs=1e-12)


def test_a_silent_atom_answers_nothing_and_comes_back(scene):
    marks = toggle_atom(rename_atom(first_marks(scene), 2, " my chair "), 2)
    spoken, saved = spoken_scene(scene, marks), edited_scene(scene, marks)
    expected = relevance(spoken, scene)
    torch.testing.assert_close(relevance(saved, saved), expected, rtol=0, atol=1e-9)
    assert saved.record.atom_names == {2: "my chair"} and torch.equal(
        saved.semantics.dictionary, scene.semantics.dictionary
    )
    again = first_marks(saved)
    assert again.atoms == marks.atoms
    loud = spoken_scene(saved, rename_atom(toggle_atom(again, 2), 2, ""))
    torch.testing.assert_close(relevance(loud, saved), relevance(scene, scene), rtol=0, atol=1e-12)


def test_names_and_denials_are_kept_by_the_scene_and_taken_back(scene):
    marks = deny_atom(rename_atom(first_marks(scene), 2, "chair"), 2, " door ")
    assert (marks.atoms[2].name, marks.atoms[2].denied) == ("chair", ("door",))
    assert deny_atom(marks, 2, "door") is marks and not deny_atom(marks, 2, "chair").atoms[2].name
    assert rename_atom(marks, 2, "door").atoms[2].denied == ()
    spoken, saved = spoken_scene(scene, marks), edited_scene(scene, marks)
    torch.testing.assert_close(relevance(saved, saved), relevance(spoken, scene), rtol=0, atol=1e-9)
    assert abs(relevance(spoken, scene) - relevance(scene, scene)).max() > 0.01
    assert first_marks(saved).atoms == marks.atoms
    history = History(first_marks(scene)).edited("deny", marks)
    assert history.undo().marks == first_marks(scene)


def test_edits_cost_neither_torch_nor_scipy():
    program = "import sys, langflash_core.scene.edits; assert not {'torch', 'scipy'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", program], check=True, cwd=Path(__file__).parents[2])


def test_silent_atoms_out_of_range_are_refused(scene):
    with pytest.raises(ValueError, match=r"silent_atoms: expected values in \[0, 5\), received 9 to 9"):
        scene.with_record(silent_atoms=(9,))
    with pytest.raises(ValueError, match="atom_names: expected values"):
        scene.with_record(atom_names={-1: "chair"})


def test_an_edited_scene_can_be_saved_and_read(scene, tmp_path: Path):
    single = replace(scene, gaussians=scene.gaussians.map(lambda v: v.float()))
    unit = torch.nn.functional.normalize(single.gaussians.quats, dim=-1)
    single = replace(single, gaussians=replace(single.gaussians, quats=unit))
    marks = delete(merge_atoms(first_marks(single), (0, 4, 2)), Mask.of(np.arange(200) < 50))
    save(edited_scene(single, marks), tmp_path / "s.langflash")
    again = load(tmp_path / "s.langflash")
    assert (len(again.gaussians), again.semantics.num_atoms) == (150, 3)


def test_what_was_told_is_undone_and_saved(scene):
    first = first_marks(scene)
    keys = ({"reach": 2.0},)
    history = History(first).edited("key", replace(first, camera_path=keys))
    history = history.edited("scale", replace(history.marks, metric_scale=1.5))
    saved = edited_scene(scene, history.marks)
    assert saved.record.camera_path == keys and saved.record.metric_scale == 1.5
    assert saved.gaussians is scene.gaussians and first_marks(saved).written == history.marks.written
    assert history.undo().marks.metric_scale == first.metric_scale
    assert history.undo().undo().marks == first and history.undo().redo().marks == history.marks
    back = edited_scene(saved, replace(first_marks(saved), camera_path=(), metric_scale=None))
    assert back.record.camera_path == () and back.record.metric_scale is None


# The file


def test_a_history_survives_its_file(scene, tmp_path: Path):
    history = History(first_marks(scene))
    history = history.edited("select", select(history.marks, Mask.of(np.arange(200) % 3 == 0)))
    history = history.edited("delete", delete(history.marks, history.marks.selected))
    told = replace(history.marks, camera_path=({"reach": 1.5, "shift": [0.1, 0.0]},), metric_scale=1.52)
    history = history.edited("told", told)
    history = history.edited("name", rename_atom(history.marks, 1, "café")).undo()
    path = tmp_path / "edits.json"
    save_history(history, scene, {"name": "my room"}, path)
    assert load_history(path, scene) == history
    assert read_about(path) == (scene_digest(scene), {"name": "my room"}, 3)
    with pytest.raises(SceneFileError, match="another scene"):
        load_history(path, cloud(200, seed=5))


def test_edits_of_the_version_before_open_and_newer_ones_name_their_version(scene, tmp_path: Path):
    history = History(first_marks(scene))
    history = history.edited("select", select(history.marks, Mask.of(np.arange(200) % 3 == 0)))
    path = tmp_path / "edits.json"
    save_history(history, scene, {}, path)
    content = json.loads(path.read_text())
    assert content["version"] == 4, "what a version reads without knowing it would be lost in silence"
    path.write_text(json.dumps({**content, "version": 2}))
    assert load_history(path, scene) == history
    del content["before"], content["forgotten"]
    path.write_text(json.dumps({**content, "version": 1}))
    assert load_history(path, scene) == history


KEPT = Path(__file__).parents[1] / "fixtures"
KEPT_EDITS = tuple(KEPT / "edits" / f"version_{number}.edits" for number in (1, 2, 3, 4))


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_kept_edits_of_each_version_open_with_all_they_say(version):
    """Each written by the last program of its version, of the kept scene of format 2; then one undone."""
    scene = load(KEPT / "scenes" / "version_2.langflash")
    path = KEPT_EDITS[version - 1]
    assert json.loads(path.read_text())["version"] == version
    history, rows = load_history(path, scene), [Mask.of(np.arange(54) % 7 == k) for k in range(4)]
    first = first_marks(scene)
    want = rename_atom(delete(first, rows[0]), 1, "door")
    want = replace(deny_atom(want, 0, "wall"), metric_scale=1.25)
    if version >= 2:
        want = change(want, Moved(rows[1], offset=(0.25, 0.0, -0.5)))
        want = change(want, Recoloured.tint(rows[2], (0.5, 0.25, 1.0), 0.5, 0.5))
    if version >= 3:
        stop = Stop("The wall", Pose(Vector(0.0, 0.0, -1.0)), "look")
        tour = Tour((stop,), (Note("A note", Vector(0.0, 0.0, 1.0)),))
        want = replace(want, tour=told_tour(tour))
    if version >= 4:
        world = World((1.0, 0.0, 0.0, 0.0), (0.0, 1.5, 0.0))
        want = replace(want, thing_names={"1": "my chair"}, world=world)
    assert history.marks == want and history.first == first
    assert history.redo().marks == hide(want, rows[3])
    assert edited_scene(scene, history.marks).gaussians.means.shape == (54 - len(rows[0]), 3)


def with_done(text: str, **changes) -> str:
    """The file with one more edit in it, of these fields."""
    return json.dumps({**json.loads(text), "done": [{"label": "x", "flips": {}, "swaps": [], **changes}]})


def whole(text: str) -> list[int]:
    """How much there is of the scene of a file."""
    return [json.loads(text)[part] for part in ("gaussians", "atoms")]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text[: len(text) // 2],
        lambda text: "[]",
        lambda text: text.replace("langflash-edits", "something"),
        lambda text: json.dumps({**json.loads(text), "done": [{"label": "x"}]}),
        lambda text: with_done(text, flips={"deleted": "AAAA"}),
        lambda text: with_done(text, flips={"gone": ""}),
        lambda text: with_done(text, swaps=[[7, [1, "", True], [1, "", False]]]),
        lambda text: json.dumps({**json.loads(text), "version": 99}),
        lambda text: json.dumps({**json.loads(text), "version": float("inf")}),
        lambda text: with_done(text, swaps=[[float("inf"), [1, "", True], [1, "", False]]]),
        lambda text: with_done(text, told=[["atoms", None, None]]),
        lambda text: with_done(text, told=[["metric_scale", None, -1.0]]),
        lambda text: with_done(text, told=[["camera_path", [], [3]]]),
        lambda text: with_done(text, told=[["metric_scale", 2.0, 3.0]]),
        lambda text: with_done(text, told=[["metric_scale", 2.0]]),
        lambda text: with_done(text, told=[["there", whole(text), [999, 1]]]),
        lambda text: with_done(text, told=[["there", whole(text), [1, 999]]]),
    ],
)
def test_a_damaged_history_is_refused(scene, tmp_path: Path, spoil):
    path = tmp_path / "edits.json"
    save_history(History(first_marks(scene)), scene, {}, path)
    path.write_text(spoil(path.read_text()))
    with pytest.raises(SceneFileError, match="edits\\.json"):
        load_history(path, scene)


def test_what_a_merge_brought_is_saved_in_every_layer(tmp_path: Path):
    first = layered([(2, 0.2, 0), (2, 0.8, 1)], [0.0, 0.5])
    second = first.rows(torch.arange(20)).with_record(layered=False)
    whole = join_scenes(first, second)
    saved = edited_scene(whole, first_marks(whole))
    save(saved, tmp_path / "saved.langflash")
    again = load(tmp_path / "saved.langflash")
    assert again.layered and len(again.layer(0).gaussians) == len(first.layer(0).gaussians) + 20
    with pytest.raises(ValueError, match="without layers"):
        join_scenes(second, first)
    plain = join_scenes(first.with_record(layered=False), second)
    assert edited_scene(plain, first_marks(plain)).view_ids is None
