"""Walks in more and more photos: which frames are photos, and that the truth scores as the truth."""

import json
import os
import signal
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import bench, walk_scenes
from langflash_core.lab.evaluation.tables import beside, markdown
from langflash_core.lab.evaluation.tallies import Rows, Shelf
from langflash_core.lab.evaluation.walk import (
    OWN,
    TRUTH,
    by_photos,
    changes,
    flat,
    judge,
    pictured_at,
    run_walks,
    tables,
)
from langflash_core.lab.evaluation.walk_scenes import Bench, made_of
from langflash_core.lab.evaluation.walk_subjects import planned, posed_walks
from langflash_core.lab.photos import PhotoFolder
from langflash_core.splat import render
from tests.lab.evaluation.real_photos import knowing, write_folder

BENCH = Bench(render)
PLAN = planned((2, 4), 2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    return write_folder(tmp_path_factory.mktemp("walk") / "photos", 7)


@pytest.mark.parametrize("numbers", [(2, 4, 8, 16, 32), (3, 5, 9), (2, 64), (2,)])
def test_kept_frames_are_the_same_for_all_and_never_photos(numbers):
    plan = planned(numbers, 6)
    assert len(plan.kept) == min(6, max(numbers) - 1)
    for photos, chosen in plan.chosen.items():
        assert len(set(chosen)) == photos and chosen[0] == 0 and chosen[-1] == plan.last
        assert not set(chosen) & set(plan.kept) and plan.between(photos) == plan.kept
        gaps = [after - before for before, after in pairwise(chosen)]
        assert max(gaps) - min(gaps) <= 3  # even, but for a frame that gives way on either side
    for frame in plan.kept:
        assert plan.own(max(numbers), frame) == (frame - 1, frame + 1)


def test_photos_as_far_apart_go_farther_and_keep_what_they_had():
    plan = planned((2, 4, 8), 4, "apart")
    assert plan.chosen == {2: (0, 2), 4: (0, 2, 4, 6), 8: (0, 2, 4, 6, 8, 10, 12, 14)}
    assert plan.between(2) == (1,) and plan.between(4) == (1, 3, 5) and plan.between(8) == (1, 3, 5, 9, 13)
    assert plan.own(4, 3) == plan.own(8, 3) == (2, 4)


def test_numbers_of_photos_that_make_no_walk(folder: PhotoFolder):
    for numbers in ((), (1, 4)):
        with pytest.raises(InputError, match="two photos or more"):
            planned(numbers)
    with pytest.raises(InputError, match="15 photos with poses, but photos has 7"):
        next(posed_walks(folder, planned((8,)), 1))
    with pytest.raises(InputError, match="nothing to judge"):
        run_walks([], 0, BENCH)


def true_scenes(
    folder: PhotoFolder, monkeypatch, *, lost: int | None = None, nearer: float = 1.0, lens: float = 1.0
):
    """`reconstruct` that knows the truth at a quarter of its length, but for what is asked.

    lost: a photo that is left out where there are four. nearer: factor on depths, from each photo. lens: on
    focal lengths.
    """
    made = []

    def reconstruct(paths, **options):
        names = [Path(path).stem for path in paths]
        made.append(names)
        scene = knowing([folder.photo(name) for name in names], folder.names, scale=0.25)
        eyes = torch.stack([-v[:3, :3].T @ v[:3, 3] for v in scene.viewmats])
        eyes = eyes.repeat_interleave(len(scene.gaussians) // len(names), 0)
        means = eyes + nearer * (scene.gaussians.means - eyes)
        means[:, 2] *= lens  # all look along z: as deep as the lens is long
        Ks = scene.Ks * torch.tensor([lens, lens, 1.0])[:, None] ** torch.tensor(
            [[1, 1, 0], [1, 1, 0], [0, 0, 0]]
        )
        scene = replace(scene, gaussians=replace(scene.gaussians, means=means), Ks=Ks)
        if lost is not None and len(names) == 4:
            keep = [k for k in range(4) if k != lost]
            scene = replace(scene, viewmats=scene.viewmats[keep], Ks=scene.Ks[keep])
            names = [names[k] for k in keep]
        return scene.with_record(photos=tuple(f"{name}.png" for name in names))

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    return made


def test_the_truth_scores_as_the_truth(folder: PhotoFolder, monkeypatch):
    made = true_scenes(folder, monkeypatch)
    (walk,) = posed_walks(folder, PLAN, 1)
    seen = {}
    row = judge(walk, BENCH, shown=lambda _, frame, title, rgb: seen.setdefault((frame, title), rgb))
    two, four = row["photos"]["2"], row["photos"]["4"]
    assert walk.name == "001-007" and list(two["frames"]) == list(four["frames"]) == ["1", "5"]
    for scene in (two, four):
        assert scene["placed"] == 1 and scene["places"] < 1e-4 and scene["rotation"] < 1e-2
        assert scene["focal"] == 0
        assert scene["depth_abs_rel"] < 1e-3 and scene["depth_delta1"] == 1
        assert scene["length"] == pytest.approx(0.36)
        for numbers in scene["frames"].values():
            assert numbers["psnr_covered"] > 20 and numbers["large_psnr_covered"] > 18
            assert numbers["depth"] < 1e-3
    assert four["gaussians"] == 2 * two["gaussians"]
    # Own photos are made once each, and those of a scene of two are that scene.
    assert sorted(map(tuple, made)) == sorted(
        [("001", "007"), ("001", "003", "005", "007"), ("001", "003"), ("005", "007")]
    )
    frame = four["frames"]["1"]
    assert frame["alone_psnr"] > 20 and frame["alone_photos_placed"] == 1
    assert two["frames"]["1"]["alone_psnr"] == two["frames"]["1"]["psnr"]
    assert {title for _, title in seen} == {TRUTH, "2", "4", OWN}
    assert seen[1, TRUTH].shape == seen[1, "4"].shape


def test_what_is_wrong_is_told(folder: PhotoFolder, monkeypatch):
    """A photo that is left out, surfaces in layers and a lens that is too long."""
    (walk,) = posed_walks(folder, planned((4,), 1), 1)
    true_scenes(folder, monkeypatch)
    right = judge(walk, replace(BENCH, alone=False))["photos"]["4"]
    true_scenes(folder, monkeypatch, lost=2)
    lost = judge(walk, replace(BENCH, alone=False))["photos"]["4"]
    assert lost["placed"] == 0.75 and lost["places"] < 1e-4 and "alone_psnr" not in lost["frames"]["3"]
    true_scenes(folder, monkeypatch, nearer=0.7)
    near = judge(walk, replace(BENCH, alone=False))["photos"]["4"]
    assert near["depth_abs_rel"] == pytest.approx(0.3, abs=0.01) and near["depth_own_scale"] < 1e-2
    assert near["frames"]["3"]["depth"] == pytest.approx(0.3, abs=0.02)
    assert near["frames"]["3"]["psnr_covered"] < right["frames"]["3"]["psnr_covered"] - 1
    true_scenes(folder, monkeypatch, lens=1.2)
    long = judge(walk, replace(BENCH, alone=False))["photos"]["4"]
    assert long["focal"] == pytest.approx(0.2, abs=1e-3)
    # The same camera took the frame, so it is drawn through that lens, too.
    assert long["frames"]["3"]["psnr_covered"] == pytest.approx(right["frames"]["3"]["psnr_covered"], abs=0.5)


def test_a_place_that_is_off_is_found_in_the_picture(folder: PhotoFolder, monkeypatch):
    true_scenes(folder, monkeypatch)
    (walk,) = posed_walks(folder, planned((2,)), 1)
    made = made_of(walk, (0, 2), BENCH)
    right = pictured_at(made, walk, 1, BENCH)[1]["psnr"]
    shift = made.fit.shift + np.array([0.03, 0, 0])  # three quarters of a pixel
    off = replace(
        made, frames=(-2, 0), fit=replace(made.fit, shift=shift)
    )  # and no neighbour that knows better
    numbers = pictured_at(off, walk, 1, replace(BENCH, align=True))[1]
    assert numbers["psnr"] < right - 2 and numbers["aligned_psnr"] > numbers["psnr"] + 1.5


def test_neighbours_know_a_place_where_the_walk_bends(folder: PhotoFolder, monkeypatch):
    """The fit is off by metres, so that no picture tells the way back."""
    true_scenes(folder, monkeypatch)
    (walk,) = posed_walks(folder, planned((2,)), 1)
    made = made_of(walk, (0, 2), BENCH)
    off = replace(made, fit=replace(made.fit, shift=made.fit.shift + np.array([5.0, 0, 0])))
    numbers = pictured_at(off, walk, 1, replace(BENCH, align=True))[1]
    assert numbers["psnr"] < 10 and numbers["aligned_psnr"] > 20


def test_a_single_photo_in_place_has_the_scale_of_its_depth(folder: PhotoFolder, monkeypatch):
    def reconstruct(paths, **options):
        scene = knowing([folder.photo(Path(paths[0]).stem)], folder.names, scale=0.25)
        return scene.with_record(photos=(str(paths[0]),))

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    (walk,) = posed_walks(folder, planned((2,)), 1)
    row = judge(walk, BENCH)["photos"]["2"]
    assert row["placed"] == 0.5 and row["places"] is None and row["depth_abs_rel"] < 1e-3
    assert row["frames"]["1"]["psnr_covered"] > 20


def test_what_reconstruct_is_told(folder: PhotoFolder, monkeypatch):
    told = []

    def reconstruct(paths, **options):
        told.append(options)
        names = [Path(path).stem for path in paths]
        return knowing([folder.photo(name) for name in names], folder.names).with_record(photos=tuple(names))

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    (walk,) = posed_walks(folder, planned((2,)), 1)
    judge(walk, BENCH)
    judge(walk, replace(BENCH, assume_lens=True))
    assert [lens[0] for lens in told[0]["intrinsics"]] == [100, 100]
    assert told[1]["intrinsics"] is None


def test_walks_are_kept_and_told_beside_each_other(folder: PhotoFolder, monkeypatch, tmp_path):
    made = true_scenes(folder, monkeypatch)
    shelf = Shelf(tmp_path, {"photos": 4}, Rows)
    plan = planned((2, 3), 2)
    before = run_walks(posed_walks(folder, plan, 2), 2, BENCH, shelf=shelf)
    assert [row["name"] for row in before["cases"]] == ["001-005", "003-007"]
    count = len(made)
    assert run_walks(posed_walks(folder, plan, 2), 2, BENCH, shelf=shelf) == before and len(made) == count
    assert before["by_photos"]["3"]["walks"] == 2 and before["by_photos"]["3"]["placed"] == 1
    table = markdown(tables(before))
    assert "| mean of 2 walks | 2 photos | 3 photos |" in table
    assert "| photos placed (%) | 100.00 | 100.00 |" in table
    after = json.loads(json.dumps(before))
    for row, change in zip(after["cases"], (1.0, 2.0), strict=True):
        for frame in row["photos"]["3"]["frames"].values():
            frame["psnr"] += change
    pairs = list(zip(before["cases"], after["cases"], strict=True))
    lines = markdown([beside("measure", changes(pairs))]).splitlines()
    assert "+1.50 ± 0.50" in next(
        line for line in lines if line.startswith("| 3 photos: PSNR between, whole (dB) |")
    )
    assert "+0.00 ± 0.00" in next(
        line for line in lines if line.startswith("| 2 photos: PSNR between, whole (dB) |")
    )
    own = "| 3 photos: PSNR between, whole (dB), own two photos alone |"
    assert sum(line.startswith(own) for line in lines) == 1


def test_more_photos_are_set_against_fewer_at_the_frames_that_both_have():
    photos = {
        "2": {"placed": 1.0, "frames": {"1": {"psnr": 20.0}}},
        "4": {"placed": None, "frames": {"1": {"psnr": 21.0}, "3": {"psnr": 30.0}}},
    }
    found = flat(photos, "4")
    assert found["between_psnr"] == 25.5 and found["gain_psnr"] == 1.0
    assert "gain_psnr" not in flat(photos, "2")
    row = by_photos([{"name": "a", "photos": photos}])["4"]
    assert row["placed"] is None and row["gain_psnr"] == 1.0


def _killed(*args):
    os.kill(os.getpid(), signal.SIGKILL)  # as Linux does where memory ends


def test_a_scene_whose_process_the_system_ends_is_told_as_want_of_memory(monkeypatch):
    monkeypatch.setattr(walk_scenes, "_saved", _killed)
    with pytest.raises(MemoryError, match="ended the process"):
        walk_scenes._made_apart([], {})
