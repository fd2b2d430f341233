"""Gaussians moved and recoloured, against a float64 twin; two scenes as one; a history with an end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.geometry.harmonics import sh_to_colour
from langflash_core.geometry.quaternions import multiply_quats, quats_to_matrices, unit_quats
from langflash_core.scene import edits
from langflash_core.scene.changed import apply_changes, changed_scene, mean_luma
from langflash_core.scene.changes import (
    Change,
    Moved,
    Recoloured,
    parse_change,
    product,
    turn_about,
    turn_matrix,
    with_change,
)
from langflash_core.scene.edited import edited_scene, first_marks
from langflash_core.scene.edits import History
from langflash_core.scene.edits_file import load_history, save_history
from langflash_core.scene.file import load, save
from langflash_core.scene.joining import join_scenes
from langflash_core.scene.mask import Mask
from langflash_core.splat import render
from langflash_core.types import LUMA, NO_LANGUAGE, Gaussians, Scene
from tests.geometry.spread import covariances
from tests.splat.scenes import camera, cloud

COUNT = 203  # not a multiple of 8


def wide_cloud(degree: int = 3, seed: int = 1, count: int = COUNT) -> Scene:
    """Random Gaussians, colours that depend on the view."""
    scene = cloud(count, seed=seed)
    generator = torch.Generator().manual_seed(seed)
    sh = 0.2 * torch.randn(count, (degree + 1) ** 2, 3, generator=generator)
    quats = unit_quats(scene.gaussians.quats)
    single = scene.semantics.dictionary.float(), scene.semantics.weight_values.float()
    semantics = replace(scene.semantics, dictionary=single[0], weight_values=single[1])
    gaussians = replace(scene.gaussians, sh=sh, quats=quats).map(lambda values: values.float())
    return replace(scene, gaussians=gaussians, semantics=semantics)


def some_rows(seed: int = 2, count: int = COUNT) -> Mask:
    return Mask.of(np.random.default_rng(seed).random(count) < 0.4)


def a_move(rows: Mask) -> Moved:
    return Moved.about(rows, (0.3, -0.2, 2.0), turn_about((1.0, 2.0, -0.5), 73.0), 1.7, (0.1, -0.4, 0.25))


def doubled(gaussians: Gaussians) -> Gaussians:
    return gaussians.map(lambda values: values.double())


def test_a_move_is_a_similarity_of_means_covariances_and_colours() -> None:
    """Twin: Sigma' = s^2 R Sigma R^T and c'(R d) = c(d), one Gaussian after the other, float64."""
    before, rows = doubled(wide_cloud().gaussians), some_rows()
    move = a_move(rows)
    after = apply_changes(before, (move,))
    R, pivot = turn_matrix(move.turn), np.array((0.3, -0.2, 2.0))
    sigma, moved = (covariances(g.quats, g.scales).numpy() for g in (before, after))
    directions = torch.nn.functional.normalize(torch.randn(COUNT, 3, dtype=torch.float64), dim=-1)
    colours = sh_to_colour(before.sh, directions)
    for i, inside in enumerate(rows.rows()):
        wanted, turned, seen = before.means[i].numpy(), sigma[i], directions[i]
        if inside:
            wanted = pivot + 1.7 * R @ (wanted - pivot) + (0.1, -0.4, 0.25)
            turned = 1.7**2 * R @ turned @ R.T
            seen = torch.from_numpy(R) @ seen
        # float64: some dozen roundings of numbers of about 10
        np.testing.assert_allclose(after.means[i].numpy(), wanted, atol=1e-12)
        np.testing.assert_allclose(moved[i], turned, atol=1e-12)
        # the turning of harmonics is solved by least squares of 64 directions
        torch.testing.assert_close(
            sh_to_colour(after.sh[i : i + 1], seen[None])[0], colours[i], atol=1e-9, rtol=0
        )
    assert after.opacities is before.opacities


def test_turns_against_the_formulas_of_quaternions() -> None:
    """Twin: geometry/quaternions.py in float64; 1e-12 is a thousand roundings of numbers up to 1."""
    generator = np.random.default_rng(4)
    for degrees in (0.0, 1e-9, -30.0, 180.0, 359.0, 400.0, *generator.uniform(-400, 400, 50)):
        axis, other = generator.normal(size=(2, 3))
        one, two = turn_about(tuple(axis), degrees), turn_about(tuple(other), 77.0)
        half = np.radians(degrees) / 2
        written = [np.cos(half), *(np.sin(half) * axis / np.linalg.norm(axis))]
        np.testing.assert_allclose(one, written, atol=1e-12)
        quats = torch.tensor([one, two], dtype=torch.float64)
        np.testing.assert_allclose(turn_matrix(one), quats_to_matrices(quats)[0], atol=1e-12)
        np.testing.assert_allclose(product(one, two), multiply_quats(quats[0], quats[1]), atol=1e-12)
        rough = parse_change("moved", some_rows(), [*(3.0 * quats[0]).tolist(), 1.0, 0.0, 0.0, 0.0])
        assert isinstance(rough, Moved)
        np.testing.assert_allclose(rough.turn, one, atol=1e-12)


def test_what_the_camera_moves_along_with_looks_the_same() -> None:
    """The whole scene moved, seen by a camera that moved along: the reference's picture stays, float64."""
    scene = wide_cloud(degree=2)
    move = a_move(Mask.full(COUNT))
    look, R = camera(48, 36), turn_matrix(move.turn)
    viewmat = look.viewmat.double().numpy()
    # x' = s R x + t; the camera frame scaled by s sees s (V x): V' = (V_R R^T, s V_t - V_R R^T t)
    turned = np.eye(4)
    turned[:3, :3] = viewmat[:3, :3] @ R.T
    turned[:3, 3] = 1.7 * viewmat[:3, 3] - turned[:3, :3] @ np.array(move.offset)
    there = replace(look, viewmat=torch.from_numpy(turned), K=look.K.double())
    here = replace(look, viewmat=look.viewmat.double(), K=look.K.double())
    whole = replace(scene, gaussians=doubled(scene.gaussians))
    moved = replace(whole, gaussians=apply_changes(whole.gaussians, (move,)))
    pictures = [render(each, at, weight_maps=False).rgb for each, at in ((whole, here), (moved, there))]
    # 1e-6: the 0.01 near plane is not scaled, but nothing is that near; the rest is rounding
    torch.testing.assert_close(pictures[0], pictures[1], atol=1e-6, rtol=0)


def test_harmonics_of_degree_4_turn_up_to_degree_3_and_stay_elsewhere() -> None:
    gaussians, rows = wide_cloud(degree=4).gaussians, some_rows()
    after = apply_changes(gaussians, (a_move(rows),))
    inside = torch.from_numpy(rows.rows())
    assert after.sh.shape == gaussians.sh.shape and bool((after.sh[inside][:, 16:] == 0).all())
    assert torch.equal(after.sh[~inside], gaussians.sh[~inside])


def test_a_tint_keeps_light_and_shade_and_has_its_colour_on_average() -> None:
    gaussians, rows = doubled(wide_cloud(degree=1).gaussians), some_rows()
    gaussians = replace(gaussians, sh=0.3 * gaussians.sh)  # nothing is clamped at 0
    inside = torch.from_numpy(rows.rows())
    luma, wanted = mean_luma(gaussians, inside), (0.2, 0.5, 0.8)
    directions = torch.nn.functional.normalize(torch.randn(COUNT, 3, dtype=torch.float64), dim=-1)
    before = sh_to_colour(gaussians.sh, directions)
    for strength in (0.0, 0.4, 1.0):
        after = apply_changes(gaussians, (Recoloured.tint(rows, wanted, strength, luma),))
        shade = (before @ torch.tensor(LUMA, dtype=torch.float64))[:, None] / luma
        mixed = (1 - strength) * before + strength * torch.tensor(wanted, dtype=torch.float64) * shade
        expected = torch.where(inside[:, None], mixed, before).clamp_min(0)
        torch.testing.assert_close(sh_to_colour(after.sh, directions), expected, atol=1e-12, rtol=0)
    assert torch.equal(after.quats, gaussians.quats) and after.means is gaussians.means


def test_two_changes_of_the_same_rows_are_one() -> None:
    gaussians, rows = doubled(wide_cloud().gaussians), some_rows()
    tint = Recoloured.tint(rows, (1.0, 0.2, 0.1), 0.6, 0.5)
    for one, other in ((a_move(rows), Moved.about(rows, (1, 2, 3), turn_about((0, 1, 0), 40))), (tint, tint)):
        joined_up = with_change((one,), other)
        assert len(joined_up) == 1
        apart, together = apply_changes(gaussians, (one, other)), apply_changes(gaussians, joined_up)
        torch.testing.assert_close(together.means, apart.means, atol=1e-12, rtol=0)
        torch.testing.assert_close(together.sh, apart.sh, atol=1e-9, rtol=0)
        torch.testing.assert_close(
            quats_to_matrices(together.quats), quats_to_matrices(apart.quats), atol=1e-12, rtol=0
        )
    assert len(with_change((a_move(rows),), a_move(some_rows(9)))) == 2
    assert len(with_change((a_move(rows),), tint)) == 2


def edited(scene: Scene, *changes: Change) -> History:
    history = History(first_marks(scene))
    for number, change in enumerate(changes):
        history = history.edited(f"change {number}", edits.change(history.marks, change))
    return history


def test_changes_are_undone_exactly_saved_and_still_carry_their_groups(tmp_path: Path) -> None:
    scene, rows = wide_cloud(), some_rows()
    move, tint = a_move(rows), Recoloured.tint(some_rows(5), (0.9, 0.1, 0.1), 0.8, 0.4)
    history = edited(scene, move, tint, Moved(rows, offset=(0.5, 0.0, 0.0)))
    assert history.undo().undo().undo().marks == first_marks(scene)
    assert history.moved_to(1).moved_to(3).marks == history.marks
    save(edited_scene(scene, history.marks), tmp_path / "moved.langflash")
    again = load(tmp_path / "moved.langflash")
    wanted = changed_scene(scene, history.marks)
    torch.testing.assert_close(again.gaussians.means, wanted.gaussians.means, atol=1e-6, rtol=0)
    assert torch.equal(again.semantics.weight_ids, scene.semantics.weight_ids)
    assert torch.equal(changed_scene(scene, history.moved_to(0).marks).gaussians.means, scene.gaussians.means)
    save_history(history.undo(), scene, {}, tmp_path / "a.edits")
    assert load_history(tmp_path / "a.edits", scene) == history.undo()


def test_two_scenes_become_one_whose_undoing_leaves_the_first(tmp_path: Path) -> None:
    first = wide_cloud(degree=1, seed=1).with_record(atom_names={1: "lamp"}, metric_scale=2.0)
    second = wide_cloud(degree=2, seed=7, count=90).with_record(
        atom_names={0: "cat"}, silent_atoms=(2,), metric_scale=1.0
    )
    whole = join_scenes(first, second)
    atoms = first.semantics.num_atoms
    assert whole.record.atom_names == {1: "lamp", atoms: "cat"} and whole.record.silent_atoms == (atoms + 2,)
    theirs = whole.rows(torch.arange(COUNT, COUNT + 90))
    weights, own = theirs.semantics.dense_weights(), second.semantics.dense_weights()
    assert torch.equal(weights[:, atoms:], own) and not weights[:, :atoms].any()
    assert torch.equal(theirs.semantics.dictionary[atoms:], second.semantics.dictionary)
    torch.testing.assert_close(theirs.gaussians.scales, second.gaussians.scales * 0.5)  # in the first's unit
    low, high = theirs.gaussians.means.quantile(0.05, dim=0), first.gaussians.means.quantile(0.95, dim=0)
    assert low[0] > high[0]  # beside each other

    history = edited(first, a_move(some_rows())).of_size(len(whole.gaussians), first_marks(whole).atoms)
    before = history.marks
    there = (len(whole.gaussians), whole.semantics.num_atoms)
    history = history.edited("Merge", replace(before, there=there))
    assert len(edited_scene(whole, history.marks).gaussians) == COUNT + 90
    alone = edited_scene(whole, history.undo().marks)
    wanted = edited_scene(first, edited(first, a_move(some_rows())).marks)
    assert torch.equal(alone.gaussians.means, wanted.gaussians.means)
    assert torch.equal(alone.semantics.dictionary, first.semantics.dictionary)
    assert alone.record.atom_names == {1: "lamp"} and not history.undo().marks.visible.rows()[COUNT:].any()
    save_history(history, whole, {}, tmp_path / "a.edits")
    again = load_history(tmp_path / "a.edits", whole)
    assert again == history and again.first.there == (COUNT, atoms)
    back = history.undo().of_size(COUNT, before.atoms[:atoms])  # as before the merge
    assert back.moved_to(0).marks == first_marks(first)


def with_levels(scene: Scene) -> Scene:
    """Every third Gaussian coarse, and sure of nothing."""
    count = len(scene.gaussians)
    return replace(
        scene, levels=(torch.arange(count) % 3 > 0).to(torch.uint8), confidences=torch.linspace(0, 0.9, count)
    )


def test_who_knows_no_level_is_coarse_and_sure_beside_who_does() -> None:
    plain, second = wide_cloud(), wide_cloud(seed=7, count=90)
    known = with_levels(second)
    assert known.levels is not None and known.confidences is not None
    whole = join_scenes(plain, known)
    assert whole.levels is not None and whole.confidences is not None
    assert not bool(whole.levels[:COUNT].any()) and torch.equal(whole.levels[COUNT:], known.levels)
    assert bool((whole.confidences[:COUNT] == 1).all())
    assert torch.equal(whole.confidences[COUNT:], known.confidences)
    other = join_scenes(known, plain)
    assert other.levels is not None and torch.equal(other.levels[:90], known.levels)
    assert not bool(other.levels[90:].any())
    assert join_scenes(plain, second).levels is None and join_scenes(plain, second).confidences is None
    both = join_scenes(known, with_levels(plain))
    assert both.levels is not None and int(both.levels.sum()) == 60 + COUNT - -(-COUNT // 3)
    # Undone, the first scene is what it was.
    undone = replace(first_marks(whole), there=(COUNT, plain.semantics.num_atoms))
    alone = edited_scene(whole, undone)
    assert alone.levels is None and alone.confidences is None
    undone = replace(first_marks(other), there=(90, known.semantics.num_atoms))
    alone = edited_scene(other, undone)
    assert alone.levels is not None and torch.equal(alone.levels, known.levels)


def test_edits_keep_levels_and_confidences() -> None:
    scene = with_levels(wide_cloud())
    marks = edits.delete(edited(scene, a_move(some_rows())).marks, Mask.first(COUNT, 10))
    after = edited_scene(scene, marks)
    assert scene.levels is not None and scene.confidences is not None
    assert after.levels is not None and torch.equal(after.levels, scene.levels[10:])
    assert after.confidences is not None and torch.equal(after.confidences, scene.confidences[10:])


def test_scenes_that_speak_differently_are_refused_and_mute_ones_taken(tmp_path: Path) -> None:
    first, second = wide_cloud(), wide_cloud(seed=3)
    other = replace(second, semantics=replace(second.semantics, space="clip"))
    with pytest.raises(InputError, match=r"b\.langflash speaks clip and a speaks .*; merge scenes"):
        join_scenes(first, other, ("a", "b.langflash"))
    empty = second.rows(torch.zeros(COUNT, dtype=torch.bool))
    with pytest.raises(InputError, match="holds no Gaussian"):
        join_scenes(first, empty)
    mute = replace(
        second,
        semantics=replace(
            second.semantics,
            weight_ids=torch.zeros(COUNT, 0, dtype=torch.int64),
            weight_values=torch.zeros(COUNT, 0),
            dictionary=torch.zeros(0, 0),
            space=NO_LANGUAGE,
        ),
    )
    for one, two in ((first, mute), (mute, first)):
        whole = join_scenes(one, two)
        assert whole.semantics.space == first.semantics.space
        assert whole.semantics.num_atoms == first.semantics.num_atoms
        total = whole.semantics.weight_values.sum(1)
        silent = slice(COUNT, None) if two is mute else slice(0, COUNT)
        assert bool((total[silent] == 0).all())
    undone = replace(first_marks(join_scenes(mute, first)), there=(COUNT, 0))
    save(edited_scene(join_scenes(mute, first), undone), tmp_path / "mute.langflash")
    assert load(tmp_path / "mute.langflash").semantics.space == NO_LANGUAGE


def test_a_history_forgets_its_oldest_steps_and_still_knows_what_was_opened(tmp_path: Path) -> None:
    scene = wide_cloud()
    history = edited(scene, *(Moved(some_rows(n), offset=(n + 1.0, 0.0, 0.0)) for n in range(6)))
    short = history.drop_oldest(most_edits=2)
    assert (len(short.done), short.forgotten, short.marks) == (2, 4, history.marks)
    assert short.first == first_marks(scene) and short.moved_to(0).marks == history.moved_to(4).marks
    assert len(history.drop_oldest(most_bytes=1).done) == 1  # the last one can always be undone
    save_history(short.undo(), scene, {}, tmp_path / "a.edits")
    assert load_history(tmp_path / "a.edits", scene) == short.undo()
