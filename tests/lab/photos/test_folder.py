"""The folder format: what is written comes back, crops move everything along, bad folders are refused."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import ImageError, InputError
from langflash_core.lab.photos import Name, chosen_ids, open_folder
from langflash_core.lab.photos.fitting import drawn_window, fitted, network_size, seen_through
from langflash_core.lab.photos.folder import LabelledPhoto, camera_matrix, lenses_of, photo_path
from langflash_core.lab.photos.writing import FolderWriter, NameTable

WIDTH, HEIGHT = 60, 45


def picture(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two photos with everything there is to know."""
    writer = FolderWriter(tmp_path / "photos")
    for number in (7, 8):
        id = f"{number:04d}"
        writer.photo(id, picture(number))
        labels = np.zeros((HEIGHT, WIDTH), dtype=np.int64)
        labels[:20], labels[20:] = 1, 300 if number == 8 else 2
        writer.labels(id, labels)
        writer.depths(id, np.linspace(0.5, 4.5, WIDTH)[None].repeat(HEIGHT, 0))
        writer.camera(id, 50.0, 51.0, 30.0, 22.0)
        pose = torch.eye(4, dtype=torch.float64)
        pose[0, 3] = number
        writer.pose(id, pose)
    names = {1: ("wall", None), 2: ("night stand", "night stand"), 300: ("refridgerator", None)}
    writer.finish(names, "drawn by a test")
    return tmp_path / "photos"


def test_what_is_written_comes_back(folder: Path):
    opened = open_folder(folder)
    assert opened.ids == ("0007", "0008") and opened.labelled
    assert opened.names[300] == Name("refrigerator", "refrigerator")
    photo = opened.photo("0008")
    assert np.array_equal(photo.image, picture(8))
    assert photo.labels is not None and sorted(np.unique(photo.labels)) == [1, 300]
    assert photo.depths is not None and photo.metric
    assert photo.depths[0, 0] == pytest.approx(0.5) and photo.depths[5, -1] == pytest.approx(4.5)
    assert photo.intrinsics == pytest.approx((50, 51, 30, 22))
    assert photo.pose is not None and photo.pose[0, 3] == 8


def test_a_crop_moves_maps_and_intrinsics_along(folder: Path):
    whole = open_folder(folder).photo("0007")
    cut = open_folder(folder).described(crop=(10, 5, 50, 35)).photo("0007")
    assert cut.image.shape == (30, 40, 3)
    assert np.array_equal(cut.image, whole.image[5:35, 10:50])
    assert cut.labels is not None and whole.labels is not None
    assert np.array_equal(cut.labels, whole.labels[5:35, 10:50])
    assert cut.intrinsics == pytest.approx((50, 51, 20, 17))


def test_a_folder_describes_itself_and_is_overruled(folder: Path):
    (folder / "photos.json").write_text(json.dumps({"crop": [0, 0, 40, 40], "depth_unit": 0.5}))
    opened = open_folder(folder)
    assert opened.photo("0007").image.shape == (40, 40, 3)
    depths, metric = opened.depths("0007") or (np.zeros(1), False)
    assert metric and depths[0, 0] == pytest.approx(250)
    told = opened.described(crop=(0, 0, 20, 20), depth_unit=1.0, intrinsics=(9.0, 9.0, 4.0, 4.0))
    assert told.photo("0007").image.shape == (20, 20, 3)
    assert told.photo("0007").intrinsics == pytest.approx((9, 9, 4, 4))


def test_eight_bits_of_depth_have_no_unit_unless_told(folder: Path):
    Image.fromarray(np.full((HEIGHT, WIDTH), 51, np.uint8)).save(folder / "depths" / "0007.png")
    depths, metric = open_folder(folder).depths("0007") or (np.zeros(1), True)
    assert not metric and depths.max() == 51
    depths, metric = open_folder(folder).described(depth_unit=0.1).depths("0007") or (np.zeros(1), False)
    assert metric and depths.max() == pytest.approx(5.1)


def test_a_shared_camera_and_no_tables(folder: Path):
    for name in ("names.csv", "intrinsics.csv", "poses.txt", "photos.json"):
        (folder / name).unlink()
    (folder / "K.txt").write_text("70 0 31\n0 71 23\n0 0 1\n")
    opened = open_folder(folder)
    photo = opened.photo("0007")
    assert not opened.labelled and photo.labels is None and photo.pose is None
    assert photo.intrinsics == pytest.approx((70, 71, 31, 23))


@pytest.mark.parametrize(
    ("spoil", "hint"),
    [
        (lambda f: (f / "labels" / "0007.png").unlink(), "there is no label map"),
        (lambda f: (f / "labels" / "0007.png").write_bytes(b"no picture"), "is no label map"),
        (lambda f: Image.new("RGB", (WIDTH, HEIGHT)).save(f / "labels" / "0007.png"), "one channel"),
        (lambda f: Image.new("L", (WIDTH, HEIGHT), 9).save(f / "labels" / "0007.png"), "holds the id 9"),
        (lambda f: Image.new("L", (WIDTH, 9), 1).save(f / "labels" / "0007.png"), "bring both to one size"),
        (lambda f: (f / "names.csv").write_text("number,name\n1,wall\n"), "columns id and name"),
        (lambda f: (f / "names.csv").write_text("id,name,class40\n1,wall,walls\n"), "class40"),
        (lambda f: (f / "photos.json").write_text("[]"), "it is no object"),
        (lambda f: (f / "photos.json").write_text('{"crop": [1, 2]}'), "four whole numbers"),
        (lambda f: (f / "photos.json").write_text('{"crop": [0, 0, 99, 9]}'), "does not fit"),
        (lambda f: (f / "photos.json").write_text('{"depth_unit": -1}'), "above 0"),
        (lambda f: (f / "poses.txt").write_text("0007 1 2 3\n"), "16 numbers"),
        (lambda f: (f / "intrinsics.csv").write_text("id,fx\n0007,1\n"), "holds no intrinsics"),
        (lambda f: (f / "images" / "0007.png").write_bytes(b""), "empty file"),
    ],
)
def test_bad_folders_are_refused(folder: Path, spoil, hint):
    spoil(folder)
    with pytest.raises(InputError, match=hint):
        open_folder(folder).photo("0007")


def test_no_folder_and_no_photos(tmp_path: Path):
    with pytest.raises(InputError, match="there is no folder"):
        open_folder(tmp_path / "gone")
    (tmp_path / "images").mkdir()
    with pytest.raises(InputError, match="holds no"):
        open_folder(tmp_path)
    (tmp_path / "images" / "3.jpg").write_bytes(b"text")
    with pytest.raises(ImageError):
        open_folder(tmp_path).photo("3")


def test_an_interrupted_conversion_continues(folder: Path):
    kept = folder / "images" / "0007.png"
    os.utime(kept, ns=(1, 1))
    writer = FolderWriter(folder)
    writer.photo("0007", picture(7))
    assert writer.count == 1 and kept.stat().st_mtime_ns == 1


def test_depths_beyond_the_range_are_unknown(tmp_path: Path):
    writer = FolderWriter(tmp_path)
    writer.photo("1", picture())
    metres = np.full((HEIGHT, WIDTH), 2.0)
    metres[0, :5] = (np.nan, np.inf, -1.0, 0.0, 70.0)
    writer.depths("1", metres)
    depths, _ = open_folder(tmp_path).depths("1") or (np.ones(1), True)
    assert depths[0, :5].max() == 0 and depths[0, 5] == pytest.approx(2)


def test_names_are_numbered_once():
    table = NameTable()
    assert [table.id(n) for n in ("night_stand", "Wall", "unlabeled", "night stand")] == [1, 2, 0, 1]


def test_parts_are_whole_runs_of_numbers():
    ids = [f"{n:04d}" for start in range(0, 300, 10) for n in range(start, start + 4)]  # 30 runs
    validation, training = chosen_ids(ids, "validation"), chosen_ids(ids, "train")
    assert set(validation) | set(training) == set(ids) and not set(validation) & set(training)
    runs = {int(id) // 10 for id in validation}
    assert runs == {3, 10, 17, 24} and len(validation) == 4 * len(runs)
    assert chosen_ids(ids, only=[(30, 31), (40, 40)]) == ("0030", "0031", "0040")
    with pytest.raises(InputError, match="none of the 120"):
        chosen_ids(ids, "validation", only=[(0, 9)])
    with pytest.raises(ValueError, match="part"):
        chosen_ids(ids, "test")


def test_fitting_keeps_picture_maps_and_camera_together(folder: Path):
    """A point of the photo stays on its label, its depth and its ray, whatever the window."""
    photo = open_folder(folder).photo("0007")
    size = network_size(photo, 28 * 28, 14)
    assert size[0] % 14 == size[1] % 14 == 0 and photo.K is not None and photo.depths is not None
    for window, mirrored in ((None, False), ((9.0, 3.0, 49.0, 33.0), True)):
        view = fitted(photo, size, window, mirrored)
        rays = ((torch.arange(size[0]) + 0.5) - view.K[0, 2]) / view.K[0, 0]
        columns = ((-rays if mirrored else rays) * photo.K[0, 0] + photo.K[0, 2] - 0.5).numpy()
        expected = np.interp(columns, np.arange(WIDTH), photo.depths[0])
        slope = 4.0 / (WIDTH - 1)
        assert np.abs(view.depths[0].numpy() - expected).max() <= slope  # nearest value, half a pixel
        assert view.rgb.shape == (3, size[1], size[0]) and view.labels.shape == (size[1], size[0])


def test_windows_repeat_and_stay_inside(folder: Path):
    photo = open_folder(folder).photo("0007")
    size = network_size(photo, 28 * 28, 14)
    boxes = [drawn_window(photo, size, seed) for seed in range(40)]
    assert boxes == [drawn_window(photo, size, seed) for seed in range(40)]
    assert len({mirrored for _, mirrored in boxes}) == 2
    for (left, top, right, bottom), _ in boxes:
        assert 0 <= left < right <= WIDTH + 1e-6 and 0 <= top < bottom <= HEIGHT + 1e-6
        assert (right - left) / (bottom - top) == pytest.approx(size[0] / size[1])


def test_a_map_is_seen_under_pixel_centres():
    values = np.arange(12).reshape(3, 4)
    assert seen_through(values, (0, 0, 4, 3), (4, 3)).tolist() == values.tolist()
    assert seen_through(values, (2, 1, 4, 3), (1, 1)).tolist() == [[11]]


def test_unlabelled_and_unknown_become_nothing(folder: Path):
    for name in ("names.csv", "intrinsics.csv"):
        (folder / name).unlink()
    Image.fromarray(np.full((HEIGHT, WIDTH), 51, np.uint8)).save(folder / "depths" / "0007.png")
    view = fitted(open_folder(folder).photo("0007"), (28, 28))
    assert int(view.labels.max()) == 0 and float(view.depths.max()) == 0  # no unit, so no metres
    fov = 2 * torch.rad2deg(torch.atan(WIDTH / 2 / (view.K[0, 0] * (HEIGHT / 28))))
    assert float(fov) == pytest.approx(65, abs=0.5)


def test_a_centre_that_rounding_moves_outside_is_taken_from_the_edge():
    """455 x 640 at 196 x 266: the widest centre begins 3e-14 pixels left of the photo."""
    image = np.random.default_rng(0).integers(0, 255, (640, 455, 3), dtype=np.uint8)
    assert fitted(LabelledPhoto("1", image), (196, 266)).rgb.shape == (3, 266, 196)


def test_a_photo_that_exif_turns_takes_camera_and_pose_along(folder: Path):
    """Twin: a point in front of the stored photo is where the upright one shows it."""
    plain = open_folder(folder)
    path = photo_path(folder, "0007")
    stored = Image.open(path).convert("RGB")
    for name in ("labels", "depths"):
        (folder / name / "0007.png").unlink(missing_ok=True)
    (folder / "names.csv").unlink()
    (folder / "photos.json").unlink(missing_ok=True)
    before = open_folder(folder).photo("0007")
    assert before.K is not None and before.pose is not None and plain.ids
    exif = Image.Exif()
    exif[0x0112] = 6  # to be shown turned to the right: (x, y) comes to (height - y, x)
    stored.save(path, exif=exif)
    after = open_folder(folder).photo("0007")
    assert after.K is not None and after.pose is not None
    assert after.image.shape[:2] == before.image.shape[1::-1]
    point = before.pose @ torch.tensor([0.3, -0.2, 2.0, 1.0], dtype=before.pose.dtype)
    old, new = (p.K @ (torch.linalg.inv(p.pose) @ point)[:3].to(p.K) for p in (before, after))
    x, y = (old[:2] / old[2]).tolist()
    assert (new[:2] / new[2]).tolist() == pytest.approx([stored.height - y, x], abs=1e-3)
    exif[0x0112] = 2
    stored.save(path, exif=exif)
    with pytest.raises(InputError, match="mirrored"):
        open_folder(folder).photo("0007")


def test_every_photo_has_its_own_lens(folder: Path):
    photo = open_folder(folder).photo("0007")
    other = replace(photo, K=camera_matrix(1.0, 2.0, 3.0, 4.0))
    assert lenses_of((other, photo)) == ((1, 2, 3, 4), photo.intrinsics)
    assert lenses_of((photo, replace(photo, K=None))) is None
