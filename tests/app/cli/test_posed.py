"""Photos with poses that are given, and splats that are lifted, through the commands."""

import json
from pathlib import Path

import pytest
import torch

from langflash_core.base.resources import asset_path
from langflash_core.export import export, read
from langflash_core.export.cameras import read_posed
from langflash_core.export.language import side_car
from langflash_core.lift import LIFTING
from tests.app.cli.conftest import stripes

TORCH = ("--backend", "torch")


def stereo_pair(folder: Path) -> tuple[list[Path], torch.Tensor]:
    """A shipped pair with its calibration as a transforms.json in a world of its own, in centimetres."""
    photos = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
    known = json.loads(asset_path("photos/stereo_calibration.json").read_text())
    first = torch.tensor([[0.0, 0, 1, 30], [0, -1, 0, 150], [1, 0, 0, -20], [0, 0, 0, 1]])  # camera to world
    second = first.clone()
    second[:3, 3] += first[:3, 0] * 100 * known["baseline_m"]
    lens = {"w": known["width"], "h": known["height"], "fl_x": known["fx"], "fl_y": known["fy"]}
    frames = [
        {"file_path": str(photo.name), "transform_matrix": pose.tolist()}
        for photo, pose in zip(photos, (first, second), strict=True)
    ]
    document = {**lens, "cx": known["cx"], "cy": known["cy"], "frames": frames}
    (folder / "transforms.json").write_text(json.dumps(document))
    return photos, read_posed(folder / "transforms.json").viewmats


@pytest.mark.slow
def test_photos_with_poses_give_a_scene_in_their_world(done, tmp_path):
    photos, viewmats = stereo_pair(tmp_path)
    words = ("reconstruct", *photos, "--poses", tmp_path / "transforms.json", "--detail", "low")
    outcome = done(*words, "-o", tmp_path / "a.langflash")
    assert "do not look" not in outcome.err  # right poses are not doubted
    scene = read(tmp_path / "a.langflash")
    assert torch.allclose(scene.viewmats.double(), viewmats, atol=1e-3)
    in_front = scene.gaussians.means @ scene.viewmats[0, :3, :3].T + scene.viewmats[0, :3, 3]
    depth = float(in_front[:, 2].median())
    assert 100 < depth < 600  # centimetres: a living room
    # And out again: the poses that came in, of photos that are cropped.
    done("export", tmp_path / "a.langflash", "-o", tmp_path / "colmap" / "cameras.txt")
    assert torch.allclose(read_posed(tmp_path / "colmap").viewmats, viewmats, atol=1e-3)
    # Lifted from there: the photos look like the scene.
    words = ("lift", tmp_path / "a.langflash", "--poses", tmp_path / "transforms.json", "--photos", *photos)
    right = done(*words, "-o", tmp_path / "b.langflash")
    assert "do not look" not in right.err


def test_words_about_poses_that_do_not_go_together(refused, tmp_path):
    photos, _ = stereo_pair(tmp_path)
    poses = ("--poses", tmp_path / "transforms.json")
    for words, hint in (
        (("reconstruct", *photos, *poses, "--fov", "60"), "--fov"),
        (("reconstruct", photos[0], *poses, "--preset", "full"), "mini"),
        (("reconstruct", photos[0], "--poses", tmp_path / "nowhere"), "no cameras.txt"),
        (("reconstruct", photos[0].with_name("aloe_left.jpg"), *poses), "no pose of aloe_left.jpg"),
        (("lift", photos[0], "--photos", photos[0]), "--poses"),
    ):
        assert hint in refused(*words, "-o", tmp_path / "a.langflash")


@pytest.mark.slow
def test_a_plain_splat_is_lifted(done, tmp_path):
    export(stripes(), tmp_path / "wall.ply")
    side_car(tmp_path / "wall.ply").unlink()
    words = ("lift", tmp_path / "wall.ply", "-o", tmp_path / "lifted.ply", "--json", *TORCH)
    outcome = done(*words)
    document = outcome.json()
    assert 1 < document["views"] <= LIFTING.views and document["atoms"] > 0
    lifted = read(tmp_path / "lifted.ply")
    assert lifted.semantics.num_atoms == document["atoms"] and lifted.semantics.space == "minilm"
    assert torch.equal(lifted.gaussians.means, stripes().gaussians.means)
    done("query", tmp_path / "lifted.ply", "wall", "-o", tmp_path / "out", *TORCH)
