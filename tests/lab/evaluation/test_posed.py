"""Posed pairs: the truth scores as the truth, and what is wrong is told apart."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import bench, posed
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.posed import Triple, chosen_triples, run_posed, tables
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.lab.photos import PhotoFolder
from langflash_core.splat import render
from tests.lab.evaluation.real_photos import knowing, write_folder

TRIPLES = [Triple("001", "004", "007", 6), Triple("002", "008", "014", 12)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    return write_folder(tmp_path_factory.mktemp("posed") / "photos", 14)


@pytest.fixture
def program(folder: PhotoFolder, monkeypatch):
    """Sets what stands in for the network: a function of the pair's true scene."""

    def become(change=lambda scene: scene):
        def reconstruct(paths, **options):
            return change(
                knowing([folder.photo(Path(path).stem) for path in paths], folder.names, scale=0.25)
            )

        monkeypatch.setattr(bench, "reconstruct", reconstruct)

    return become


def test_the_truth_scores_as_the_truth(folder: PhotoFolder, program):
    program()
    result = run_posed(folder, TRIPLES, Bench(render))
    measures = result["measures"]
    assert result["pairs"] == 2 and measures["placed"] == 1 and measures["pose_right_share"] == 1
    assert measures["rotation_placed_median"] == measures["pose_rotation_median"]
    assert measures["pose_rotation_median"] < 1e-2 and measures["pose_direction_median"] < 1e-2
    assert measures["depth_abs_rel"] < 1e-3 and measures["depth_delta1"] == 1
    # 18 cm to the side move things by nine pixels of 112; the scene knows, the first photo does not.
    assert measures["psnr"] > measures["psnr_first_photo"] + 3 and measures["psnr"] > 20
    assert set(result["by_gap"]) == {"6", "12"} and result["by_gap"]["6"]["pairs"] == 1
    table = markdown(tables(result))
    assert f"| {measures['depth_abs_rel']:.3f} |" in table and "| 12 | 1.000 | 1.000 |" in table


def test_a_turned_camera_is_told(folder: PhotoFolder, program):
    angle = torch.tensor(10.0).deg2rad()
    turn = torch.eye(4)
    turn[0, 0] = turn[2, 2] = angle.cos()
    turn[0, 2], turn[2, 0] = angle.sin(), -angle.sin()

    def turned(scene):
        return replace(scene, viewmats=torch.stack((scene.viewmats[0], turn @ scene.viewmats[1])))

    program(turned)
    measures = run_posed(folder, TRIPLES[:1], Bench(render))["measures"]
    assert measures["pose_rotation_median"] == pytest.approx(10, abs=0.01)
    assert measures["pose_right_share"] == 0


def test_a_photo_without_a_place_counts_as_wrong(folder: PhotoFolder, program):
    def alone(scene):
        return replace(scene, viewmats=scene.viewmats[:1], Ks=scene.Ks[:1])

    program(alone)
    measures = run_posed(folder, TRIPLES[:1], Bench(render))["measures"]
    assert measures["placed"] == 0 and measures["pose_right_share"] == 0
    assert measures["pose_direction_median"] == posed.LEFT_OUT
    assert "rotation_placed_median" not in measures
    assert measures["psnr"] is not None  # the first photo's depth tells the scale


def test_without_depth_maps_the_cameras_tell_the_scale(tmp_path: Path, program):
    folder = write_folder(tmp_path / "photos", 7)
    for path in (folder.root / "depths").iterdir():
        path.unlink()
    program()
    measures = run_posed(folder, TRIPLES[:1], Bench(render))["measures"]
    assert "depth_abs_rel" not in measures
    assert measures["psnr"] > measures["psnr_first_photo"] + 3


def test_pairs_start_evenly_and_have_a_photo_between():
    ids = [f"{n:04d}" for n in range(0, 300, 3)]
    triples = chosen_triples(ids, 12)
    assert len(triples) == 12 == len(set(triples))
    assert sorted({t.apart for t in triples}) == [6, 12, 18, 24]
    for t in triples:
        assert int(t.second) - int(t.first) == t.apart == 2 * (int(t.between) - int(t.first))
    starts = [int(t.first) for t in triples if t.apart == 6]
    assert starts[0] < 60 and starts[-1] > 220
    assert len(chosen_triples(ids, 1000, [6])) == 98
    with pytest.raises(InputError, match="no two photos are 5 numbers apart"):
        chosen_triples(ids, 12, [5])


def test_a_photo_without_a_pose_is_named(folder: PhotoFolder, program):
    program()
    poses = {id: pose for id, pose in (folder.poses or {}).items() if id != "007"}
    with pytest.raises(InputError, match="photo 007 has no line"):
        run_posed(replace(folder, poses=poses), TRIPLES[:1], Bench(render))
