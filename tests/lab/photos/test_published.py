"""Published layouts, written tiny and read where they lie; damaged and hostile files are one sentence."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.io import savemat

from langflash_core.errors import InputError
from langflash_core.lab.photos import LabelledPhoto, PhotoFolder
from langflash_core.lab.photos.published import (
    open_frames,
    open_masked,
    open_nyu,
    open_scannet,
    re10k_scenes,
    scannet_names,
)
from tests.lab.photos import layouts_made as made


@pytest.fixture(scope="module")
def wall(tmp_path_factory) -> PhotoFolder:
    return made.wall(tmp_path_factory.mktemp("wall") / "photos", 5)


def assert_placed(photo: LabelledPhoto, truth: LabelledPhoto) -> None:
    """The same pose; cameras of RealEstate10K are float32."""
    assert photo.pose is not None and truth.pose is not None
    assert torch.allclose(photo.pose, truth.pose, atol=1e-6)


def assert_same(photo, truth, *, scale: int = 10, colours: float = 12) -> None:
    """A photo that was written as JPEG, with ids times `scale`; the same camera and depth."""
    assert np.abs(photo.image.astype(int) - truth.image).mean() < colours
    assert photo.K is not None and torch.allclose(photo.K, truth.K, atol=1e-3)
    if photo.labels is not None:
        assert (photo.labels == scale * truth.labels).all()
    if photo.depths is not None:
        assert np.allclose(photo.depths[1:], truth.depths[1:], atol=1e-3) and photo.metric


def test_a_scene_of_lsm_is_read(wall: PhotoFolder, tmp_path: Path):
    made.scannet_table(tmp_path)
    made.lsm_scene(wall, tmp_path / "scene0700_00")
    names = scannet_names(tmp_path)
    assert names[40].text == "desk" and names[40].label == "desk" and names[30].label == "chair"
    scene = open_scannet(tmp_path / "scene0700_00", names)
    assert scene.ids == ("0", "20", "40", "60", "80")
    photo, truth = scene.photo("40"), wall.photo("003")
    assert_same(photo, truth)
    assert_placed(photo, truth)


def test_a_scene_extracted_from_scannet_is_read(wall: PhotoFolder, tmp_path: Path):
    made.scannet_table(tmp_path)
    made.extracted_scene(wall, tmp_path / "scene0000_00")
    scene = open_scannet(tmp_path / "scene0000_00", scannet_names(tmp_path))
    assert scene.ids == ("0", "1", "3", "4")  # the third has no finite pose
    assert_same(scene.photo("3"), wall.photo("004"))


def test_chunks_of_realestate10k_are_read(wall: PhotoFolder, tmp_path: Path):
    made.re10k_split(wall, tmp_path)
    scenes = dict(re10k_scenes(tmp_path / "test"))
    assert list(scenes) == ["aaaa", "bbbb"] and len(scenes["aaaa"].ids) == 5
    assert list(dict(re10k_scenes(tmp_path / "test", {"bbbb": 0}))) == ["bbbb"]
    photo, truth = scenes["bbbb"].photo("000002"), wall.photo("003")
    assert_same(photo, truth)
    assert_placed(photo, truth)
    assert photo.labels is None and photo.depths is None


def test_code_in_a_chunk_is_refused_and_not_run(tmp_path: Path):
    class Hostile:
        def __reduce__(self):
            return (os.mkdir, (str(tmp_path / "ran"),))

    (tmp_path / "index.json").write_text('{"aaaa": "000000.torch"}')
    chunk = tmp_path / "000000.torch"
    torch.save([Hostile()], chunk)
    with pytest.raises(InputError, match="safely"):
        list(re10k_scenes(tmp_path))
    chunk.write_bytes(pickle.dumps(Hostile()))
    with pytest.raises(InputError, match="safely"):
        list(re10k_scenes(tmp_path))
    assert not (tmp_path / "ran").exists()
    torch.save([{"key": "aaaa"}], tmp_path / "000000.torch")
    with pytest.raises(InputError, match="no chunk"):
        list(re10k_scenes(tmp_path))


def test_masks_of_3d_ovs_are_read(wall: PhotoFolder, tmp_path: Path):
    made.masked_scene(wall, tmp_path / "bed")
    scene = open_masked(tmp_path / "bed")
    assert [scene.names[n].text for n in sorted(scene.names)] == ["chair", "desk", "floor", "wall"]
    assert sorted(scene.annotated) == ["00", "03"]
    labels, truth = scene.labels("03"), wall.labels("004")
    for number, own in ((1, 3), (2, 4), (3, 2), (4, 1)):
        assert ((labels == number) == (truth == own)).all()
    assert not scene.labels("01").any()
    assert scene.photo("00").pose is None


def test_photos_annotated_in_that_manner_may_have_cameras(wall: PhotoFolder, tmp_path: Path):
    made.masked_scene(wall, tmp_path / "room", with_cameras=True)
    photo = open_masked(tmp_path / "room").photo("03")
    assert_placed(photo, wall.photo("004"))
    (tmp_path / "room" / "segmentations" / "00" / "wall.png").unlink()
    with pytest.raises(InputError, match=r"wall\.png"):
        open_masked(tmp_path / "room").labels("00")


def test_frames_of_7_scenes_are_read(wall: PhotoFolder, tmp_path: Path):
    made.frames(wall, tmp_path / "seq-01")
    scene = open_frames(tmp_path / "seq-01")
    assert scene.ids == ("000000", "000001", "000002", "000003")
    photo = scene.photo("000001")
    assert photo.depths is not None and photo.K is not None
    assert (photo.depths[0] == 0).all() and np.allclose(photo.depths[1:], 2)
    assert photo.labels is None and float(photo.K[0, 0]) == 585


def test_the_labelled_nyu_is_read(tmp_path: Path):
    generator = np.random.default_rng(0)
    count = 3
    images = generator.integers(0, 255, (480, 640, 3, count), dtype=np.uint8)
    labels = generator.integers(0, 3, (480, 640, count)).astype(np.uint16)
    depths = generator.uniform(1, 4, (480, 640, count)).astype(np.float32)
    names = np.array([["chair"], ["night stand"]], dtype=object)
    path = tmp_path / "nyu_depth_v2_labeled.mat"
    savemat(path, {"images": images, "labels": labels, "depths": depths, "names": names})
    folder = open_nyu(path)
    assert folder.ids == ("0001", "0002", "0003")
    photo = folder.photo("0002")
    assert photo.image.shape == (426, 560, 3) and (photo.image == images[45:471, 41:601, :, 1]).all()
    assert (photo.labels == labels[45:471, 41:601, 1]).all()
    assert photo.depths is not None and np.allclose(photo.depths, depths[45:471, 41:601, 1])
    assert folder.names[2].label == "night stand"
    savemat(tmp_path / "splits.mat", {"trainNdxs": [[1]], "testNdxs": [[2], [3]]})
    assert open_nyu(path).ids == ("0002", "0003") and len(open_nyu(path, None).ids) == 3


def test_what_is_missing_is_one_sentence(wall: PhotoFolder, tmp_path: Path):
    with pytest.raises(InputError, match="scannetv2-labels"):
        scannet_names(tmp_path)
    made.scannet_table(tmp_path)
    (tmp_path / "scene" / "images").mkdir(parents=True)
    with pytest.raises(InputError, match="no posed photo"):
        open_scannet(tmp_path / "scene", scannet_names(tmp_path))
    with pytest.raises(InputError, match="no frame-N"):
        open_frames(tmp_path)
    with pytest.raises(InputError, match="there is no"):
        open_masked(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        list(re10k_scenes(tmp_path))
    made.lsm_scene(wall, tmp_path / "scene0001_00")
    (tmp_path / "scene0001_00" / "images" / "20.npz").write_bytes(b"PK")
    with pytest.raises(InputError, match=r"20\.npz holds no camera"):
        open_scannet(tmp_path / "scene0001_00", scannet_names(tmp_path))
