"""`langflash add`: from a photo to a scene that has it, too."""

import io

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.base.resources import asset_path
from langflash_core.scene.file import load, save
from tests.app.cli.conftest import stripes


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """A desk from two places, small, and the right one again, in a file that is called as ours could be."""
    folder = tmp_path_factory.mktemp("desk")
    for name in ("left", "right"):
        with Image.open(asset_path(f"photos/desk_{name}.png")) as picture:
            picture = picture.convert("RGB")
            picture.thumbnail((480, 480))
            picture.save(folder / f"{name}.jpg", quality=95)
            if name == "right":
                picture.save(folder / "1.jpg", quality=85)
    return folder


@pytest.fixture(scope="module")
def scene(photos, tmp_path_factory):
    from langflash_core.pipeline import reconstruct

    path = tmp_path_factory.mktemp("scene") / "desk.langflash"
    save(reconstruct([photos / "left.jpg", photos / "right.jpg"], detail="low", size=196), path)
    return path


def test_a_photo_taken_again_stands_where_it_stood(done, scene, photos, tmp_path):
    output = tmp_path / "more.langflash"
    outcome = done("add", scene, photos / "1.jpg", "-o", output)
    assert "1 photo more, 3 in all" in outcome.out
    before, after = load(scene), load(output)
    assert after.record.photos == ("left.jpg", "right.jpg", "1.jpg") and len(after.photos) == 3
    assert (after.view_size, after.record.detail["level"]) == (before.view_size, "low")
    assert torch.allclose(after.Ks[2], after.Ks[1], rtol=0.02)  # pixels of one size, the lens assumed alike
    count = len(before.gaussians)
    assert torch.equal(after.gaussians.means[:count], before.gaussians.means)
    assert 1.2 * count < len(after.gaussians) < 1.8 * count  # a layer like the other two
    # Key points of a copy are the same but for JPEG's noise, a tenth of a pixel at a focal length of 650. A
    # place along the rays of two photos is known from the layer's depths, right to a hundredth.
    moved = after.viewmats[2] - after.viewmats[1]
    assert float(moved[:3, :3].abs().max()) < 0.005 and float(moved[:3, 3].abs().max()) < 0.01
    ours, theirs = (
        np.asarray(Image.open(io.BytesIO(photo)).convert("L").resize((64, 48)), float)
        for photo in (after.photos[2], after.photos[1])
    )
    assert np.abs(ours - theirs).mean() < 3  # JPEG's noise


def test_a_photo_of_another_place_is_refused(refused, scene, tmp_path):
    said = refused("add", scene, asset_path("photos/aloe_left.jpg"), "-o", tmp_path / "more.langflash")
    assert "aloe_left.jpg could not be placed beside the scene's photos; take one" in said


def test_a_scene_without_layers_is_refused_with_a_remedy(refused, photos, tmp_path):
    save(stripes(), tmp_path / "plain.langflash")
    said = refused("add", tmp_path / "plain.langflash", photos / "1.jpg", "-o", tmp_path / "more.langflash")
    assert "keeps no layer and picture of each photo, as those" in said
    assert "; reconstruct it again with all photos" in said


def test_a_scene_is_not_written_over_by_what_was_added_to_it(run, scene, photos):
    before = scene.read_bytes()
    outcome = run("add", scene, photos / "1.jpg", "-o", scene)
    assert outcome.code == 2 and scene.read_bytes() == before
