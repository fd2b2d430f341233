"""More and more photos of one place: which are chosen, and that the truth scores as the truth."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import posed
from langflash_core.lab.evaluation.photo_tables import stretches_markdown
from langflash_core.lab.evaluation.stretches import chosen_stretches, run_stretches
from langflash_core.lab.photos import PhotoFolder
from langflash_core.splat import render
from tests.lab.evaluation.real_photos import knowing, write_folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    return write_folder(tmp_path_factory.mktemp("stretch") / "photos", 7)


def test_photos_spread_from_the_first_to_the_last_without_the_middle(folder: PhotoFolder):
    (stretch,) = chosen_stretches(folder, (2, 4), 1, length=6)
    first = min(folder.ids)
    assert stretch.chosen[2] == (first, f"{int(first) + 6:03d}")
    assert len(stretch.chosen[4]) == 4 == len(set(stretch.chosen[4]))
    assert stretch.between == f"{int(first) + 3:03d}" and stretch.between not in stretch.chosen[4]
    with pytest.raises(InputError, match="choose fewer with --photos"):
        chosen_stretches(folder, (2, 7), 1, length=6)
    with pytest.raises(InputError, match="look the same way"):
        chosen_stretches(folder, (2,), 1)  # 24 numbers apart


def test_a_camera_that_turned_away_begins_no_stretch(folder: PhotoFolder):
    turned = torch.diag(torch.tensor([-1.0, 1.0, -1.0, 1.0]))
    last = max(folder.ids)
    poses = {id: pose @ turned.to(pose) if id == last else pose for id, pose in (folder.poses or {}).items()}
    with pytest.raises(InputError, match="look the same way"):
        chosen_stretches(replace(folder, poses=poses), (2,), 1, length=6)


def test_the_truth_scores_as_the_truth_and_a_missing_photo_does_not(folder: PhotoFolder, monkeypatch):
    def reconstruct(paths, **options):
        scene = knowing([folder.photo(Path(path).stem) for path in paths], folder.names, scale=0.25)
        names = [str(path) for path in paths]
        if len(names) == 4:  # the second is left out
            keep = [0, 2, 3]
            scene = replace(scene, viewmats=scene.viewmats[keep], Ks=scene.Ks[keep])
            names = [names[k] for k in keep]
        return replace(scene, photos=(), view_ids=None).with_record(photos=tuple(names))

    monkeypatch.setattr(posed, "reconstruct", reconstruct)
    result = run_stretches(folder, chosen_stretches(folder, (2, 4), 1, length=6), render)
    two, four = result["by_photos"]["2"], result["by_photos"]["4"]
    assert two["rotation_last"] < 1e-2 and four["rotation_last"] < 1e-2 and two["direction"] < 1e-2
    assert two["placed"] == 1 and four["placed"] == 0.75
    assert four["direction"] == pytest.approx(posed.LEFT_OUT / 3, abs=0.1)
    assert two["depth_abs_rel"] < 1e-3 and two["psnr"] > 20
    assert "| Photos that found their place | 1.000 | 0.750 |" in stretches_markdown(result)
