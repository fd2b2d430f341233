"""Scenes seen from aside: the truth scores as the truth in any frame, and what breaks is counted."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.lab.evaluation import bench
from langflash_core.lab.evaluation.bench import Bench, files_of
from langflash_core.lab.evaluation.posed import Triple
from langflash_core.lab.evaluation.side_subjects import posed_cases
from langflash_core.lab.evaluation.sides import (
    aligned,
    camera_of,
    changes,
    covered_depths,
    judge_scene,
    run_sides,
    tables,
)
from langflash_core.lab.evaluation.tables import beside, markdown
from langflash_core.lab.photos import PhotoFolder
from langflash_core.splat import render
from langflash_core.types import Scene
from tests.lab.evaluation.real_photos import knowing, write_folder

TRIPLE = Triple("001", "004", "007", 6)
SIZE = (56, 42)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    return write_folder(tmp_path_factory.mktemp("sides") / "photos", 14)


@pytest.fixture
def scene(folder: PhotoFolder) -> Scene:
    """Every pixel of the pair in its place, at a quarter of the true length."""
    whole = knowing([folder.photo(id) for id in ("001", "007")], folder.names, scale=0.25)
    return replace(whole, view_ids=torch.arange(2).repeat_interleave(SIZE[0] * SIZE[1]))


def judged(scene: Scene, folder: PhotoFolder) -> dict:
    (case,) = posed_cases(folder, [TRIPLE])
    return judge_scene(scene, case.truth(SIZE), Bench(render))


def test_files_of_photos_show_the_same_pixels(folder: PhotoFolder):
    photos = [folder.photo(id) for id in folder.ids[:2]]
    with files_of(photos) as paths:
        assert [path.stem for path in paths] == ["001", "002"]
        for photo, path in zip(photos, paths, strict=True):
            assert np.array_equal(np.asarray(Image.open(path)), photo.image)


def test_the_truth_scores_as_the_truth(folder: PhotoFolder, scene: Scene):
    row = judged(scene, folder)
    assert row["misfit"] < 1e-4 and row["layers_p90"] < 1e-3 and row["rotation"] < 1e-2
    assert set(row["looks"]) >= {"001", "007", "004"}
    for look in row["looks"].values():
        assert look["sheets"] == 0 and look["holes"] == 0 and look["psnr"] > 20
    assert row["looks"]["001"]["group"] == "0" and row["looks"]["004"]["group"] == "between"
    assert row["boundary_f1"] is None  # a flat wall has no edge


def test_the_frame_of_a_scene_does_not_matter(folder: PhotoFolder, scene: Scene):
    """Turned and moved, its cameras with it: a look is still drawn from its own place."""
    turn = torch.eye(4)
    turn[:3, :3] = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1)))[0]
    turn[:3, :3] *= torch.linalg.det(turn[:3, :3]).sign()
    turn[:3, 3] = torch.tensor([0.3, -0.1, 0.2])
    gaussians = replace(scene.gaussians, means=scene.gaussians.means @ turn[:3, :3].T + turn[:3, 3])
    moved = replace(scene, gaussians=gaussians, viewmats=scene.viewmats @ invert_rigid(turn))
    (case,) = posed_cases(folder, [TRIPLE])
    placed = case.truth(SIZE).photos
    depths = [covered_depths(render(moved, moved.camera(view))) for view in (0, 1)]
    fit = aligned(moved, placed, depths)
    assert fit.scale == pytest.approx(4, rel=1e-4)
    for view, look in enumerate(placed):
        # The Gaussians' mean depth is the wall's to five digits.
        assert torch.allclose(camera_of(look, fit).viewmat, moved.viewmats[view], atol=1e-3)
    assert judged(moved, folder)["misfit"] < 1e-4


def test_two_surfaces_where_there_is_one_are_layers(folder: PhotoFolder, scene: Scene):
    means = scene.gaussians.means.clone()
    second = scene.view_ids == 1
    eye = invert_rigid(scene.viewmats[1])[:3, 3]
    means[second] = eye + 1.03 * (means[second] - eye)
    row = judged(replace(scene, gaussians=replace(scene.gaussians, means=means)), folder)
    assert row["layers_median"] == pytest.approx(0.03 / 1.015, rel=0.05)
    assert judged(replace(scene, view_ids=None), folder)["layers_median"] is None


def test_what_is_taken_away_is_a_hole(folder: PhotoFolder, scene: Scene):
    left = scene.gaussians.means[:, 0] < scene.gaussians.means[:, 0].median()
    row = judged(scene.rows(~left), folder)
    assert 0.3 < row["looks"]["004"]["holes"] < 0.7
    assert row["looks"]["004"]["psnr"] < judged(scene, folder)["looks"]["004"]["psnr"] - 3
    nothing = judged(scene.rows(torch.zeros_like(left)), folder)
    assert nothing["looks"]["004"]["holes"] == 1 and nothing["looks"]["004"]["sheets"] is None
    assert nothing["misfit"] is None and nothing["layers_median"] is None


def test_a_photo_without_a_place_is_left_out(folder: PhotoFolder, scene: Scene):
    alone = scene.rows(scene.view_ids == 0)
    alone = replace(alone, viewmats=alone.viewmats[:1], Ks=alone.Ks[:1])
    row = judged(alone, folder)
    assert row["placed"] == 0 and row["rotation"] is None and row["layers_median"] is None
    assert "007" not in row["looks"] and row["looks"]["004"]["holes"] > 0


def test_two_runs_are_told_beside_each_other(folder: PhotoFolder, scene: Scene, monkeypatch):
    monkeypatch.setattr(bench, "reconstruct", lambda paths, **options: scene)
    triples = [TRIPLE, Triple("002", "005", "008", 6)]
    before = run_sides(posed_cases(folder, triples), 2, Bench(render))
    assert [row["name"] for row in before["cases"]] == ["001-007", "002-008"]
    assert before["measures"]["placed"] == 1
    table = markdown(tables(before))
    assert "| between the photos | 2 | " in table and "| Second photo found its place | 1.000 |" in table
    after = json.loads(json.dumps(before))
    after["cases"][0]["looks"]["004"]["psnr"] += 1.5
    pairs = list(zip(before["cases"], after["cases"], strict=True))
    table = markdown([beside("measure", changes(pairs))])
    assert "+0.750 ± 0.750" in next(line for line in table.splitlines() if "between the photos: PSNR" in line)
    alone = markdown([beside("measure", changes(pairs[:1]))])
    assert "| +1.500 |" in alone  # of one case nobody knows an error
    with pytest.raises(InputError, match="nothing to judge"):
        run_sides([], 0, Bench(render))
