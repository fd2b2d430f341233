import io
import json
import math
from argparse import Namespace
from dataclasses import replace

import pytest
import torch
from PIL import Image

from app.cli.scenes import chosen_camera
from langflash_core.errors import ViewError
from langflash_core.writing.cameras import read_camera
from tests.app.cli.conftest import HEIGHT, WIDTH, stripes


def choice(**given):
    return chosen_camera(Namespace(**{"view": None, "camera": None, "size": None, "ortho": None, **given}))


def test_view_defaults_to_the_first():
    camera = choice().of(stripes())
    assert torch.equal(camera.viewmat, torch.eye(4))
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)


def test_size_keeps_the_field_of_view():
    scene = stripes()
    camera = choice(view=1, size=(2 * WIDTH, 3 * HEIGHT)).of(scene)
    assert (camera.width, camera.height) == (2 * WIDTH, 3 * HEIGHT)
    scale = torch.tensor([2.0, 3.0, 1.0])[:, None]
    assert torch.equal(camera.K, scene.Ks[1] * scale)


def jpeg(width: int, height: int) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (width, height), (90, 60, 30)).save(stream, "JPEG")
    return stream.getvalue()


def test_at_full_size_a_view_has_the_pixels_of_its_photo():
    """Of each its own; a size that is said counts more; a damaged photo says nothing."""
    sizes = ((2 * WIDTH, 2 * HEIGHT), (3 * WIDTH, 3 * HEIGHT))
    scene = replace(stripes(), photos=tuple(jpeg(*size) for size in sizes))
    for view, size in enumerate(sizes):
        camera = choice(view=view).at_full_size().of(scene)
        assert (camera.width, camera.height) == size
        assert torch.equal(camera.K[:2], scene.Ks[view][:2] * size[0] / WIDTH)
        plain = choice(view=view).of(scene)
        assert (plain.width, plain.height) == (WIDTH, HEIGHT)
        said = choice(view=view, size=(80, 60)).at_full_size().of(scene)
        assert (said.width, said.height) == (80, 60)
    for photos in ((), (b"no photo", b"none")):
        camera = choice().at_full_size().of(replace(scene, photos=photos))
        assert (camera.width, camera.height) == (WIDTH, HEIGHT)


def test_unknown_view_names_the_range():
    with pytest.raises(ViewError, match="no photo 3: this scene has 2; use --view 1 to 2"):
        choice(view=2).of(stripes())


def test_file_round_trip(tmp_path):
    turn = math.radians(30)
    viewmat = torch.eye(4)
    viewmat[0, 0] = viewmat[2, 2] = math.cos(turn)
    viewmat[0, 2], viewmat[2, 0] = math.sin(turn), -math.sin(turn)
    K = [[300.0, 0.0, 160.0], [0.0, 310.0, 120.0], [0.0, 0.0, 1.0]]
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({"viewmat": viewmat.tolist(), "K": K, "width": 320, "height": 240}))
    camera = read_camera(path)
    assert torch.equal(camera.viewmat, viewmat) and camera.K.tolist() == K
    drawn = choice(camera=path, size=(160, 120)).of(stripes())
    assert drawn.K[0].tolist() == [150.0, 0.0, 80.0]


def test_a_camera_file_may_have_parallel_rays(tmp_path):
    K = [[300.0, 0.0, 160.0], [0.0, 300.0, 120.0], [0.0, 0.0, 1.0]]
    described = {"viewmat": torch.eye(4).tolist(), "K": K, "width": 320, "height": 240}
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({**described, "orthographic": True}))
    assert choice(camera=path, size=(160, 120)).of(stripes()).orthographic
    path.write_text(json.dumps({**described, "orthographic": "yes"}))
    with pytest.raises(ViewError, match="must be true or false"):
        read_camera(path)


def test_ortho_keeps_the_middle_of_the_picture_as_large():
    scene = stripes()
    pinhole, flat = choice().of(scene), choice(ortho=True).of(scene)
    assert flat.orthographic and not pinhole.orthographic
    depth = float(scene.gaussians.means[:, 2].median())
    assert float(flat.K[0, 0]) == pytest.approx(float(pinhole.K[0, 0]) / depth, rel=0.05)
    assert torch.equal(flat.K[:2, 2], pinhole.K[:2, 2])


@pytest.mark.parametrize("number", [10**400, 1e39], ids=["integer", "decimal"])
def test_numbers_that_float32_does_not_hold_are_refused(tmp_path, number):
    viewmat = torch.eye(4).tolist()
    viewmat[0][3] = number
    K = [[300.0, 0.0, 160.0], [0.0, 300.0, 120.0], [0.0, 0.0, 1.0]]
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({"viewmat": viewmat, "K": K, "width": 320, "height": 240}))
    with pytest.raises(ViewError, match="a number is not finite"):
        read_camera(path)


@pytest.mark.filterwarnings("error")
def test_ortho_looks_past_gaussians_that_are_nowhere():
    scene = stripes()
    means = scene.gaussians.means.clone()
    means[0], means[1] = math.inf, math.nan
    broken = replace(scene, gaussians=replace(scene.gaussians, means=means))
    assert float(choice(ortho=True).of(broken).K[0, 0]) > 0
    nothing = scene.rows(torch.zeros(len(means), dtype=torch.bool))
    assert torch.equal(choice(ortho=True).of(nothing).K, scene.Ks[0])  # as if all were at 1
