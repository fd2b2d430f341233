"""Cameras and photos out as COLMAP text and transforms.json, and in again: the same rays."""

import io
import json
from dataclasses import replace

import pytest
import torch
from PIL import Image

from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export import export
from langflash_core.export.cameras import read_posed
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Scene
from tests.export.splats import random_gaussians, refusal

WIDTH, HEIGHT = 84, 56
NAMES = ("cameras.txt", "transforms.json")


def jpeg(width: int, height: int) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (width, height), (90, 120, 150)).save(stream, "JPEG")
    return stream.getvalue()


@pytest.fixture
def scene() -> Scene:
    """Three views anywhere, of an off-centre lens; photos three times as large as the views."""
    rng = torch.Generator().manual_seed(2)
    quats = torch.nn.functional.normalize(torch.randn(3, 4, generator=rng), dim=-1)
    viewmats = torch.eye(4).repeat(3, 1, 1)
    viewmats[:, :3, :3] = quats_to_matrices(quats)
    viewmats[:, :3, 3] = torch.randn(3, 3, generator=rng) * 3
    Ks = torch.tensor([[70.0, 0, 40], [0, 72, 30], [0, 0, 1]]).repeat(3, 1, 1)
    made = bare_scene(random_gaussians(5), "made")
    photos = (jpeg(3 * WIDTH, 3 * HEIGHT),) * 3
    return replace(made, viewmats=viewmats, Ks=Ks, view_size=(WIDTH, HEIGHT), photos=photos)


@pytest.mark.parametrize("name", NAMES)
def test_cameras_out_and_in_again(tmp_path, scene, name):
    export(scene, tmp_path / "out" / name)
    posed = read_posed(tmp_path / "out" / name)
    assert torch.allclose(posed.viewmats.float(), scene.viewmats, atol=1e-5)
    expected = scene.Ks * torch.tensor([3.0, 3.0, 1.0])[:, None]
    assert torch.allclose(posed.Ks.float(), expected, atol=1e-4)
    assert posed.sizes == ((3 * WIDTH, 3 * HEIGHT),) * 3
    assert [path.read_bytes() for path in posed.paths] == list(scene.photos)
    assert posed.upright().intrinsics == tuple([pytest.approx((210, 216, 120, 90), abs=1e-4)] * 3)
    one = posed.of([posed.paths[2]])
    assert torch.equal(one.viewmats, posed.viewmats[2:]) and one.paths == posed.paths[2:]


def test_colmap_by_hand(tmp_path):
    """The example of COLMAP's documentation, with lists of points, below sparse/0."""
    model = tmp_path / "sparse" / "0"
    model.mkdir(parents=True)
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "a b.jpg").write_bytes(jpeg(300, 200))
    (model / "cameras.txt").write_text("# comment\n7 SIMPLE_RADIAL 600 400 500 300 200 0\n")
    (model / "images.txt").write_text("# two lines each\n1 0.5 0.5 0.5 0.5 1 2 3 7 a b.jpg\n1 2 -1 3 4 5\n")
    (model / "points3D.txt").write_text("")
    posed = read_posed(tmp_path)
    # 0.5 0.5 0.5 0.5 turns x to y, y to z, z to x.
    rotation = torch.tensor([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]], dtype=torch.float64)
    assert torch.allclose(posed.viewmats[0, :3, :3], rotation)
    assert posed.viewmats[0, :3, 3].tolist() == [1, 2, 3]
    assert posed.paths == (tmp_path / "images" / "a b.jpg",)
    assert posed.upright().intrinsics == (pytest.approx((250, 250, 150, 100)),)  # the photo is half as large


def test_transforms_of_nerf_by_hand(tmp_path):
    """camera_angle_x and names without a suffix; a camera that looks along -z of the world, y up."""
    (tmp_path / "r_0.png").write_bytes(jpeg(80, 40))
    document = {
        "camera_angle_x": 1.5707963267948966,
        "frames": [{"file_path": "r_0", "transform_matrix": torch.eye(4).tolist()}],
    }
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    posed = read_posed(tmp_path)
    assert torch.equal(posed.viewmats[0], torch.diag(torch.tensor([1.0, -1, -1, 1], dtype=torch.float64)))
    assert posed.Ks[0, 0, 0] == pytest.approx(40) and posed.Ks[0, :2, 2].tolist() == [40, 20]


def frame(matrix: str = "[[1,0,0,0],[0,1,0,0],[0,0,1,0]]", **own: float) -> str:
    """A transforms.json of one frame."""
    lens = {"w": 4, "h": 3, "fl_x": 1.0, **own}
    return json.dumps({**lens, "frames": [{"file_path": "a.jpg", "transform_matrix": json.loads(matrix)}]})


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "does not hold posed photos"),
        ("{", "does not hold posed photos"),
        ('{"frames": []}', "does not hold posed photos"),
        ('{"frames": [{"file_path": "a.jpg"}]}', "transform_matrix"),
        (frame(k1=0.2), "bends"),
        (frame(fl_x=0), "focal"),
        (frame("[[9,0,0,0],[0,1,0,0],[0,0,1,0]]"), "rotation"),
        (frame("[[-1,0,0,0],[0,1,0,0],[0,0,1,0]]"), "mirrors"),
        ("[" * 100_000, "does not hold posed photos"),
    ],
)
def test_transforms_that_cannot_be_used(tmp_path, text, word):
    (tmp_path / "transforms.json").write_text(text)
    assert word in refusal(lambda: read_posed(tmp_path / "transforms.json"))


@pytest.mark.parametrize(
    ("cameras", "images", "word"),
    [
        ("1 OPENCV 4 3 1 1 2 1 0.3 0 0 0\n", "1 1 0 0 0 0 0 0 1 a.jpg\n\n", "bends"),
        ("1 PINHOLE 4 3 1 1 2\n", "1 1 0 0 0 0 0 0 1 a.jpg\n\n", "3 numbers, not 4"),
        ("1 PINHOLE 4 3 1 1 2 1\n", "1 1 0 0 0 0 0 0 2 a.jpg\n\n", "posed photos"),
        ("1 PINHOLE 4 3 1 1 2 1\n", "1 1 0 0 0 0\n\n", "posed photos"),
        ("1 PINHOLE 4 3 1 1 2 1\n", "", "posed photos"),
        ("1 PINHOLE 4 3 nan 1 2 1\n", "1 1 0 0 0 0 0 0 1 a.jpg\n\n", "focal"),
    ],
)
def test_colmap_that_cannot_be_used(tmp_path, cameras, images, word):
    (tmp_path / "cameras.txt").write_text(cameras)
    (tmp_path / "images.txt").write_text(images)
    assert word in refusal(lambda: read_posed(tmp_path))


def test_what_is_missing_is_said(tmp_path, scene):
    with pytest.raises(SceneFileError, match=r"no cameras\.txt"):
        read_posed(tmp_path)
    with pytest.raises(OutputError, match="no photos"):
        export(replace(scene, photos=()), tmp_path / "transforms.json")
    assert not list(tmp_path.iterdir())
    export(scene, tmp_path / "transforms.json")
    posed = read_posed(tmp_path)
    with pytest.raises(SceneFileError, match=r"no pose of other\.jpg"):
        posed.of([tmp_path / "other.jpg"])
    posed.paths[0].unlink()
    with pytest.raises(SceneFileError, match="cannot be read"):
        posed.upright()
