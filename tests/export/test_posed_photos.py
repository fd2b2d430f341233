"""Poses stay with their photo: folders, EXIF, lenses, and COLMAP's files as programs really write them."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError, SceneFileError
from langflash_core.export import export
from langflash_core.export.cameras import read_posed
from langflash_core.export.settings import POINT_CLOUD
from langflash_core.geometry.cameras import MIRRORED, turned_camera
from langflash_core.images.decode import read_photo
from langflash_core.images.views import load_views
from tests.export.splats import random_gaussians, refusal
from tests.export.test_cameras import scene as scene

LENS = "1 PINHOLE 64 48 50 51 30 25\n"
EXIF = 0x0112


def picture(path: Path, size: tuple[int, int] = (64, 48), orientation: int = 1, kind: str = "JPEG") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    exif = Image.Exif()
    exif[EXIF] = orientation
    Image.new("RGB", size, (90, 120, 150)).save(path, kind, exif=exif)
    return path


def model(folder: Path, names: list[str], images: str | None = None, cameras: str = LENS) -> Path:
    """A COLMAP model; the pose of photo n is moved by n along x."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"{n} 1 0 0 0 {n} 0 0 1 {name}\n12.5 30.25 -1 40 50 7\n" for n, name in enumerate(names, 1)]
    (folder / "cameras.txt").write_text(cameras)
    (folder / "images.txt").write_text("".join(lines) if images is None else images)
    return folder


def moved(posed) -> list[float]:
    """By how much along x each pose is moved, which tells whose it is."""
    return posed.viewmats[:, 0, 3].tolist()


def transforms(path: Path, names: list[str], **lens) -> Path:
    known = {"w": 64, "h": 48, "fl_x": 50, **lens}
    eye = torch.eye(4).tolist()
    path.write_text(
        json.dumps({**known, "frames": [{"file_path": n, "transform_matrix": eye} for n in names]})
    )
    return path


def test_photos_of_one_name_are_told_by_their_folder(tmp_path):
    names = ["left/1.jpg", "right/1.jpg", "left/2.jpg"]
    photos = [picture(tmp_path / "images" / name) for name in names]
    posed = read_posed(model(tmp_path / "sparse" / "0", names).parent.parent)
    assert moved(posed.of(photos[::-1])) == [3, 2, 1]
    # Copies elsewhere: by as much of the path as the poses name, or by a name that is there once.
    assert moved(posed.of([picture(tmp_path / "small" / "right" / "1.jpg")])) == [2]
    assert moved(posed.of([picture(tmp_path / "small" / "2.jpg")])) == [3]
    with pytest.raises(SceneFileError, match=r"small/1\.jpg may be that of left/1\.jpg or of right/1\.jpg"):
        posed.of([picture(tmp_path / "small" / "1.jpg")])


def test_two_photos_never_share_a_pose(tmp_path):
    photos = [picture(tmp_path / side / "1.jpg") for side in ("left", "right")]
    posed = read_posed(model(tmp_path / "model", ["1.jpg"]))
    with pytest.raises(
        SceneFileError, match=r"left/1\.jpg and right/1\.jpg would both take the pose of 1\.jpg"
    ):
        posed.of(photos)
    assert len(posed.of([photos[0], photos[0]]).paths) == 2  # one photo twice is one photo


def test_a_photo_beside_those_of_the_poses_has_none(tmp_path):
    picture(tmp_path / "images" / "left" / "1.jpg")
    other = picture(tmp_path / "images" / "right" / "1.jpg")
    with pytest.raises(SceneFileError, match=r"no pose of right/1\.jpg"):
        read_posed(model(tmp_path / "sparse", ["left/1.jpg"])).of([other])


def test_names_of_transforms_are_told_by_their_folder(tmp_path):
    names = ["./images/a/1.jpg", "images\\b\\1.jpg"]
    photos = [picture(tmp_path / "images" / side / "1.jpg") for side in "ab"]
    posed = read_posed(transforms(tmp_path / "transforms.json", names))
    assert posed.names == ("a/1.jpg", "b/1.jpg")
    assert posed.of(photos[1:]).paths == (photos[1],)
    assert posed.of([]).upright().paths == tuple(photos)  # the files themselves are found, too


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_photo_that_exif_turns_takes_its_camera_along(tmp_path, orientation):
    """Twin: what Pillow makes of a marked pixel; the upright camera sees the same point there."""
    viewmat = torch.eye(4, dtype=torch.float64)
    viewmat[:3, 3] = torch.tensor([0.1, -0.2, 3.0])
    K = torch.tensor([[50.0, 0, 30], [0, 60, 25], [0, 0, 1]], dtype=torch.float64)
    size, pixel = (64, 48), (11, 37)
    if orientation in MIRRORED:
        with pytest.raises(ValueError, match="mirrors"):
            turned_camera(K, viewmat, size, orientation)
        return
    upright, pose, turned_size = turned_camera(K, viewmat, size, orientation)
    ray = torch.linalg.inv(K) @ torch.tensor([pixel[0] + 0.5, pixel[1] + 0.5, 1], dtype=torch.float64)
    point = torch.linalg.inv(viewmat) @ torch.cat((4 * ray, torch.ones(1, dtype=torch.float64)))
    seen = upright @ (pose @ point)[:3]
    values = np.zeros((48, 64), np.uint8)
    values[pixel[1], pixel[0]] = 255
    path, exif = tmp_path / "a.png", Image.Exif()
    exif[EXIF] = orientation
    Image.fromarray(values).save(path, exif=exif)
    shown = np.asarray(read_photo(path).image.convert("L"))
    row, column = np.argwhere(shown == 255)[0]
    assert (seen[:2] / seen[2]).tolist() == pytest.approx([column + 0.5, row + 0.5], abs=1e-9)
    assert turned_size == shown.shape[::-1] and float(torch.linalg.det(pose[:3, :3])) == pytest.approx(1)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF"])
def test_poses_are_of_stored_pixels(tmp_path, kind):
    photo = picture(tmp_path / f"a.{kind.lower()}", orientation=6, kind=kind)
    posed = read_posed(model(tmp_path, [photo.name])).of([photo]).upright()
    assert posed.sizes == ((48, 64),)
    assert posed.intrinsics == (pytest.approx((51, 50, 48 - 25, 30)),)
    views = load_views([photo], intrinsics=posed.intrinsics, area=24 * 32, multiple=4)
    assert views.size == (24, 32)
    assert float(views.Ks[0, 0, 2]) == pytest.approx(23 / 2, abs=1e-4)  # half as large


def test_poses_of_upright_photos_stay(tmp_path):
    """Of programs that turn photos first: the size that they say tells."""
    photo = picture(tmp_path / "a.jpg", orientation=6)
    posed = read_posed(model(tmp_path, ["a.jpg"], cameras="1 PINHOLE 48 64 51 50 23 30\n"))
    assert posed.upright().intrinsics == (pytest.approx((51, 50, 23, 30)),)
    assert torch.equal(posed.upright().viewmats, posed.viewmats) and posed.of([photo]).sizes == ((48, 64),)


def test_mirrored_and_cropped_photos_are_refused(tmp_path):
    picture(tmp_path / "a.jpg", orientation=5)
    with pytest.raises(SceneFileError, match="mirrored"):
        read_posed(model(tmp_path, ["a.jpg"])).upright()
    picture(tmp_path / "a.jpg", size=(64, 36))
    with pytest.raises(SceneFileError, match="64 x 36 pixels, its pose is of 64 x 48"):
        read_posed(tmp_path).upright()
    picture(tmp_path / "a.jpg", size=(33, 25))  # 33 x 24.75, rounded
    assert len(read_posed(tmp_path).upright().paths) == 1


def test_every_photo_keeps_its_own_lens(tmp_path):
    """Two lenses, off centre, of pixels that are not square."""
    names = ["a.jpg", "b.jpg"]
    photos = [picture(tmp_path / "images" / name) for name in names]
    images = "1 1 0 0 0 1 0 0 1 a.jpg\n\n2 1 0 0 0 2 0 0 2 b.jpg\n\n"
    posed = read_posed(model(tmp_path, names, images, LENS + "2 PINHOLE 128 96 90 140 50 60\n"))
    posed = posed.of(photos).upright()
    assert posed.intrinsics == (pytest.approx((50, 51, 30, 25)), pytest.approx((45, 70, 25, 30)))
    views = load_views(photos, intrinsics=posed.intrinsics, area=64 * 48, multiple=16)
    assert torch.allclose(views.Ks.double(), posed.Ks) and views.lenses is None
    with pytest.raises(InputError, match="2 intrinsics were given for 1 photos"):
        load_views(photos[:1], intrinsics=posed.intrinsics)
    with pytest.raises(InputError, match="not usable"):
        load_views(photos, intrinsics=(posed.intrinsics[0], (0.0, 1.0, 1.0, 1.0)))


@pytest.mark.parametrize(
    "lens",
    [
        {"camera_model": "OPENCV_FISHEYE"},
        {"camera_model": "EQUIRECTANGULAR"},
        {"camera_model": "FISHEYE624", "k1": 0},
        {"is_fisheye": True},
        {"k1": float("nan")},
        {"k5": 0.1},
        {"distortion_params": [0.1, 0, 0, 0, 0, 0]},
    ],
)
def test_lenses_that_are_no_pinhole_are_refused_by_name(tmp_path, lens):
    said = refusal(lambda: read_posed(transforms(tmp_path / "transforms.json", ["a.jpg"], **lens)))
    assert "no pinhole" in said or "bends" in said
    assert str(lens.get("camera_model", next(iter(lens)) if "is_fisheye" in lens else "")) in said
    document = json.loads((tmp_path / "transforms.json").read_text())
    document["frames"][0] |= {name: document.pop(name) for name in lens}  # said of one frame
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    with pytest.raises(SceneFileError, match=r"no pinhole|bends"):
        read_posed(tmp_path)


@pytest.mark.parametrize("name", ["PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL", "radial", None])
def test_pinholes_pass(tmp_path, name):
    assert len(read_posed(transforms(tmp_path / "transforms.json", ["a.jpg"], camera_model=name, k1=0)).paths)


def test_colmap_that_is_no_pinhole_is_refused_by_name(tmp_path):
    with pytest.raises(SceneFileError, match="OPENCV_FISHEYE, which is no pinhole"):
        read_posed(model(tmp_path, ["a.jpg"], cameras="1 OPENCV_FISHEYE 64 48 50 51 30 25 0 0 0 0\n"))


@pytest.mark.parametrize(
    "images",
    [
        "1 1 0 0 0 1 0 0 1 a.jpg\n2 1 0 0 0 2 0 0 1 b c.jpg\n3 1 0 0 0 3 0 0 1 0003\n",  # no lines of points
        "1 1 0 0 0 1 0 0 1 a.jpg\n\n2 1 0 0 0 2 0 0 1 b c.jpg\n\n3 1 0 0 0 3 0 0 1 0003\n",
        "1 1 0 0 0 1 0 0 1 a.jpg\n1 2 3\n2 1 0 0 0 2 0 0 1 b c.jpg\n3 1 0 0 0 3 0 0 1 0003\n4 5 6 7 8 9\n",
        "1 1 0 0 0 1 0 0 1 a.jpg\n1 2 1 4 5 1 7 8 1 2\n2 1 0 0 0 2 0 0 1 b c.jpg\n\n3 1 0 0 0 3 0 0 1 0003\n",
        "1, 1, 0, 0, 0, 1, 0, 0, 1, a.jpg\n2,1,0,0,0,2,0,0,1,b c.jpg\n3,1,0,0,0,3,0,0,1,0003\n",
        "1 1,0 0 0 0 1,0 0 0 1 a.jpg\n1,5 2,5 -1\n2 1 0 0 0 2,0 0 0 1 b c.jpg\n3 1 0 0 0 3,0 0 0 1 0003\n",
    ],
)
def test_lines_of_images_as_programs_write_them(tmp_path, images):
    posed = read_posed(model(tmp_path, [], images))
    assert posed.names == ("a.jpg", "b c.jpg", "0003") and moved(posed) == [1, 2, 3]


@pytest.mark.parametrize(
    "cameras",
    [
        "﻿1 PINHOLE 64 48 50.5 51 30 25\n",
        "1 PINHOLE 64 48 50,5 51,0 30 25\r\n",
        "1, PINHOLE, 64, 48, 50.5, 51, 30, 25\n",
        "1,PINHOLE,64,48,50.5,51,30,25\n",
        "1, PINHOLE, 64, 48, 50,5, 51, 30, 25\n",
        "﻿# Camera list\n1 PINHOLE 64 48 50.5 51 30 25\n",
    ],
)
def test_lines_of_cameras_as_programs_write_them(tmp_path, cameras):
    picture(tmp_path / "images" / "left" / "1.jpg")
    posed = read_posed(model(tmp_path, ["left\\1.jpg"], cameras=cameras)).upright()
    assert posed.intrinsics == ((50.5, 51, 30, 25),)
    assert posed.names == ("left/1.jpg",)


def test_commas_that_cannot_be_told_apart_are_refused(tmp_path):
    with pytest.raises(SceneFileError, match="has 6 numbers, not 4"):
        read_posed(model(tmp_path, ["a.jpg"], cameras="1,PINHOLE,64,48,50,5,51,0,30,25\n"))


def binary(folder: Path, kind: int = 1) -> tuple[bytes, bytes]:
    """COLMAP's binary model of two photos, the first with two points."""
    cameras = struct.pack("<QIiQQ4d", 1, 7, kind, 64, 48, 50, 51, 30, 25)
    first = struct.pack("<I7dI", 1, 1, 0, 0, 0, 1, 0, 0, 7) + b"left/1.jpg\0"
    points = struct.pack("<Q2dq2dq", 2, 1.5, 2.5, -1, 3.5, 4.5, 7)
    second = struct.pack("<I7dI", 2, 1, 0, 0, 0, 2, 0, 0, 7) + b"right/1.jpg\0" + struct.pack("<Q", 0)
    images = struct.pack("<Q", 2) + first + points + second
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cameras.bin").write_bytes(cameras)
    (folder / "images.bin").write_bytes(images)
    return cameras, images


@pytest.mark.parametrize("named", [".", "sparse/0", "sparse/0/cameras.bin", "sparse/0/images.bin"])
def test_binary_models_are_read(tmp_path, named):
    binary(tmp_path / "sparse" / "0")
    posed = read_posed(tmp_path / named)
    assert moved(posed) == [1, 2] and posed.names == ("left/1.jpg", "right/1.jpg")
    assert posed.intrinsics == ((50, 51, 30, 25),) * 2 and posed.sizes == ((64, 48),) * 2


def test_binary_models_that_are_cut_or_lie_are_refused(tmp_path):
    cameras, images = binary(tmp_path)
    for name, whole in (("cameras.bin", cameras), ("images.bin", images)):
        for wrong in (*(whole[:size] for size in range(len(whole))), whole + b"\0", b"\xff" * 8 + whole[8:]):
            (tmp_path / name).write_bytes(wrong)
            refusal(lambda: read_posed(tmp_path))
        (tmp_path / name).write_bytes(whole)
    points = images.index(struct.pack("<Q", 2), 8)
    (tmp_path / "images.bin").write_bytes(images[:points] + b"\xff" * 8 + images[points + 8 :])
    with pytest.raises(SceneFileError, match="ends before"):
        read_posed(tmp_path)
    binary(tmp_path, kind=5)
    with pytest.raises(SceneFileError, match="OPENCV_FISHEYE, which is no pinhole"):
        read_posed(tmp_path)
    binary(tmp_path, kind=99)
    with pytest.raises(SceneFileError, match="number 99"):
        read_posed(tmp_path)


def test_what_is_written_begins_in_every_trainer(tmp_path, scene, monkeypatch):
    """transforms.json says the model that all readers take; points3D.txt holds points, as 3DGS reads it."""
    export(scene, tmp_path / "transforms.json")
    document = json.loads((tmp_path / "transforms.json").read_text())
    assert document["camera_model"] == "OPENCV"
    assert [document[name] for name in ("k1", "k2", "p1", "p2")] == [0, 0, 0, 0]
    export(scene, tmp_path / "cameras.txt")
    rows = [line.split() for line in (tmp_path / "points3D.txt").read_text().splitlines() if line[0] != "#"]
    solid = scene.gaussians.opacities >= 0.1
    assert len(rows) == int(solid.sum()) > 0 and {len(row) for row in rows} == {8}
    places = torch.tensor([[float(word) for word in row[1:4]] for row in rows])
    assert torch.allclose(places, scene.gaussians.means[solid], rtol=1e-6)
    shades = torch.tensor([[int(word) for word in row[4:7]] for row in rows])
    expected = (0.5 + 0.28209479 * scene.gaussians.sh[solid, 0]).clamp(0, 1) * 255
    assert float((shades - expected).abs().max()) <= 0.5 + 1e-3  # rounded to whole numbers
    monkeypatch.setattr("langflash_core.export.cameras.POINT_CLOUD", replace(POINT_CLOUD, most_points=2))
    export(scene, tmp_path / "cameras.txt")
    assert 1 <= len((tmp_path / "points3D.txt").read_text().splitlines()) - 1 <= 2
    assert POINT_CLOUD.most_points >= 10_000 and len(random_gaussians(5)) == len(scene.gaussians)


def test_texts_in_other_encodings_are_refused_in_one_sentence(tmp_path):
    model(tmp_path, ["a.jpg"])
    (tmp_path / "cameras.txt").write_bytes(LENS.encode("utf-16"))
    assert "does not hold posed photos" in refusal(lambda: read_posed(tmp_path))
