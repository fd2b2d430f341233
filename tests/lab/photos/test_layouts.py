"""Tiny data sets written in the published layouts, and what the converters make of them."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.io import savemat

from langflash_core.errors import InputError, MissingPackageError
from langflash_core.lab.photos import matlab as matlab_files
from langflash_core.lab.photos import open_folder
from langflash_core.lab.photos.layouts import convert
from langflash_core.lab.photos.reading import Source

HEIGHT, WIDTH, PHOTOS = 480, 640, 3


def cells(texts: list[str]) -> np.ndarray:
    array = np.empty((len(texts), 1), dtype=object)
    array[:, 0] = texts
    return array


def nyu_arrays() -> dict:
    """As MATLAB has them: rows, columns, colours, photos."""
    numbers = np.random.default_rng(0)
    labels = np.zeros((HEIGHT, WIDTH, PHOTOS), np.uint16)
    for photo in range(PHOTOS):
        labels[100:200, 100 + 50 * photo : 400, photo] = 1 + photo
    return {
        "images": numbers.integers(0, 255, (HEIGHT, WIDTH, 3, PHOTOS), dtype=np.uint8),
        "labels": labels,
        "depths": numbers.uniform(0.7, 9.9, (HEIGHT, WIDTH, PHOTOS)).astype(np.float32),
        "names": ["wall", "night stand", "refridgerator"],
    }


def write_hdf5(path: Path, arrays: dict) -> None:
    """A .mat of version 7.3: HDF5 behind a header of 512 bytes, axes in reverse, cells by reference."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        for key in ("images", "labels", "depths"):
            file[key] = np.ascontiguousarray(arrays[key].T)
        references = []
        for place, text in enumerate(arrays["names"]):
            file[f"#refs#/{place}"] = np.array([[ord(c)] for c in text], dtype=np.uint16)
            references.append(file[f"#refs#/{place}"].ref)
        file["names"] = np.array([references], dtype=h5py.ref_dtype)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))


@pytest.fixture(params=["old", "hdf5"])
def nyu(request, tmp_path: Path) -> Path:
    path, arrays = tmp_path / "nyu_depth_v2_labeled.mat", nyu_arrays()
    if request.param == "hdf5":
        write_hdf5(path, arrays)
    else:
        savemat(path, {**arrays, "names": cells(arrays["names"])})
    savemat(tmp_path / "splits.mat", {"trainNdxs": np.array([[3], [1]]), "testNdxs": np.array([[2]])})
    mapping = {
        "mapClass": np.array([[2, 1, 3]]),
        "className": cells(["night stand", "wall", "refridgerator"]),
    }
    savemat(tmp_path / "classMapping40.mat", mapping)
    return path


def test_nyu(nyu: Path, tmp_path: Path):
    arrays, stages = nyu_arrays(), []
    further = {"splits": tmp_path / "splits.mat", "classes": tmp_path / "classMapping40.mat"}
    source = Source(nyu, further, progress=lambda stage, fraction: stages.append(fraction))
    assert convert("nyu", source, tmp_path / "out") == 2 and stages == [0.0, 0.5]
    folder = open_folder(tmp_path / "out")
    assert folder.ids == ("0001", "0003") and folder.crop == (41, 45, 601, 471)
    names = [(name.text, name.label) for name in folder.names.values()]
    assert names == [("wall", "wall"), ("night stand", "night stand"), ("refrigerator", "refrigerator")]
    photo = folder.photo("0003")
    inside = np.s_[45:471, 41:601]
    assert photo.labels is not None and photo.depths is not None
    assert np.array_equal(photo.image, arrays["images"][..., 2][inside])
    assert np.array_equal(photo.labels, arrays["labels"][..., 2][inside])
    assert np.abs(photo.depths - arrays["depths"][..., 2][inside]).max() < 6e-4  # millimetres
    assert photo.intrinsics == pytest.approx((518.8579, 519.4696, 325.5824 - 41, 253.7362 - 45), abs=1e-3)


def test_nyu_without_further_files(nyu: Path, tmp_path: Path):
    assert convert("nyu", Source(nyu, limit=2), tmp_path / "out") == 2
    folder = open_folder(tmp_path / "out")
    assert folder.ids == ("0001", "0002") and folder.names[3].label == "refrigerator"


def test_version_7_3_needs_h5py(tmp_path: Path, monkeypatch):
    write_hdf5(tmp_path / "new.mat", nyu_arrays())
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'langflash\[photos\]' brings it"):
        matlab_files.open_mat(tmp_path / "new.mat")


def test_bad_matlab_files(tmp_path: Path):
    (tmp_path / "no.mat").write_bytes(b"nothing like it" * 20)
    with pytest.raises(InputError, match="no MATLAB file"):
        matlab_files.open_mat(tmp_path / "no.mat")
    savemat(tmp_path / "other.mat", {"x": 1})
    with pytest.raises(InputError, match="holds no 'images'"):
        convert("nyu", Source(tmp_path / "other.mat"), tmp_path / "out")
    with pytest.raises(InputError, match="cannot be read"):
        matlab_files.open_mat(tmp_path / "gone.mat")


def coco(root: Path) -> Path:
    """One photo of two segments, whose numbers need all three colours."""
    table, pngs, photos = root / "annotations" / "panoptic_val2017.json", None, root / "val2017"
    pngs = table.with_suffix("")
    pngs.mkdir(parents=True)
    photos.mkdir()
    Image.fromarray(np.full((40, 50, 3), 99, np.uint8)).save(photos / "000000000139.jpg")
    numbers = np.zeros((40, 50), np.int64)
    numbers[:20], numbers[30:] = 3_226_956, 77
    colours = np.stack((numbers % 256, numbers // 256 % 256, numbers // 65536), -1).astype(np.uint8)
    Image.fromarray(colours).save(pngs / "000000000139.png")
    segments = [{"id": 3_226_956, "category_id": 199}, {"id": 77, "category_id": 63}]
    document = {
        "images": [{"id": 139, "file_name": "000000000139.jpg"}],
        "annotations": [{"image_id": 139, "file_name": "000000000139.png", "segments_info": segments}],
        "categories": [{"id": 199, "name": "wall-other-merged"}, {"id": 63, "name": "couch"}],
    }
    table.write_text(json.dumps(document))
    return table


def test_coco(tmp_path: Path):
    assert convert("coco", Source(coco(tmp_path)), tmp_path / "out") == 1
    folder = open_folder(tmp_path / "out")
    photo = folder.photo("000000000139")
    assert photo.labels is not None
    assert photo.labels[0, 0] == 199 and photo.labels[25, 0] == 0 and photo.labels[35, 49] == 63
    assert folder.names[199].text == "wall" and folder.names[63].label == "sofa"


def test_coco_with_photos_elsewhere_and_bad_tables(tmp_path: Path):
    table = coco(tmp_path)
    (tmp_path / "val2017").rename(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="cannot be read"):
        convert("coco", Source(table), tmp_path / "a")
    assert convert("coco", Source(table, {"images": tmp_path / "elsewhere"}), tmp_path / "b") == 1
    table.write_text('{"images": []}')
    with pytest.raises(InputError, match="holds no 'annotations'"):
        convert("coco", Source(table), tmp_path / "c")
    table.write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        convert("coco", Source(table), tmp_path / "d")


def test_ade20k(tmp_path: Path):
    root = tmp_path / "ADEChallengeData2016"
    for kind in ("images", "annotations"):
        for split in ("training", "validation"):
            (root / kind / split).mkdir(parents=True)
    rows = [
        "Idx\tRatio\tTrain\tVal\tName",
        "1\t0.1576\t11664\t1172\twall",
        "9\t0.01\t5\t1\twindowpane, window ",
    ]
    (root / "objectInfo150.txt").write_text("\n".join(rows))
    for split, name in (("training", "ADE_train_00000007"), ("validation", "ADE_val_00000001")):
        Image.fromarray(np.full((40, 50, 3), 99, np.uint8)).save(root / "images" / split / f"{name}.jpg")
        Image.fromarray(np.full((40, 50), 9, np.uint8)).save(root / "annotations" / split / f"{name}.png")
    assert convert("ade20k", Source(root), tmp_path / "out") == 1
    folder = open_folder(tmp_path / "out")
    assert folder.ids == ("00000007",) and folder.names[9].text == "window"
    photo = folder.photo("00000007")
    assert photo.labels is not None and np.unique(photo.labels).tolist() == [9]
    with pytest.raises(InputError, match="give the folder ADEChallengeData2016"):
        convert("ade20k", Source(tmp_path), tmp_path / "no")


def sun_photo(folder: Path, names: list[str]) -> None:
    for kind in ("image", "depth_bfx"):
        (folder / kind).mkdir(parents=True)
    Image.fromarray(np.full((40, 50, 3), 99, np.uint8)).save(folder / "image" / "x.jpg")
    millimetres = np.full((40, 50), 3210, np.uint16)
    turned = (millimetres << 3) | (millimetres >> 13)
    Image.fromarray(turned).save(folder / "depth_bfx" / "x.png")
    (folder / "intrinsics.txt").write_text("529.5 0 365 0 529.5 265 0 0 1")
    labels = np.zeros((40, 50), np.uint8)
    labels[10:20], labels[20:] = 1, 2
    savemat(folder / "seg.mat", {"seglabel": labels, "names": cells(names)})


def test_sun_rgbd(tmp_path: Path):
    sun_photo(tmp_path / "SUNRGBD" / "kv2" / "a", ["wall", "night_stand"])
    sun_photo(tmp_path / "SUNRGBD" / "xtion" / "b", ["chair", "wall"])
    sun_photo(tmp_path / "SUNRGBD" / "kv1" / "NYUdata" / "NYU0001", ["wall", "bed"])
    assert convert("sunrgbd", Source(tmp_path / "SUNRGBD"), tmp_path / "out") == 2
    folder = open_folder(tmp_path / "out")
    assert [name.text for name in folder.names.values()] == ["wall", "night stand", "chair"]
    first, second = folder.photo("00001"), folder.photo("00002")
    assert first.labels is not None and second.labels is not None and second.depths is not None
    assert first.labels[::10, 0].tolist() == [0, 1, 2, 2] and second.labels[::10, 0].tolist() == [0, 3, 1, 1]
    assert second.depths.min() == second.depths.max() == pytest.approx(3.21)
    assert second.intrinsics == pytest.approx((529.5, 529.5, 365, 265))


def test_posed_frames(tmp_path: Path):
    root = tmp_path / "seq-01"
    root.mkdir()
    for number in range(3):
        stem = f"frame-{number:06d}"
        Image.fromarray(np.full((40, 50, 3), 99, np.uint8)).save(root / f"{stem}.color.png")
        depths = np.full((40, 50), 1500, np.uint16)
        depths[0] = 65535
        Image.fromarray(depths).save(root / f"{stem}.depth.png")
        pose = np.eye(4)
        pose[2, 3] = np.nan if number == 1 else number
        np.savetxt(root / f"{stem}.pose.txt", pose)
    assert convert("frames", Source(root), tmp_path / "out") == 2
    folder = open_folder(tmp_path / "out")
    photo = folder.photo("000002")
    assert folder.ids == ("000000", "000002") and photo.pose is not None and photo.depths is not None
    assert photo.pose[2, 3] == 2 and photo.depths[0, 0] == 0 and photo.depths[1, 0] == pytest.approx(1.5)
    assert photo.intrinsics == pytest.approx((585, 585, 320, 240))
    (tmp_path / "K.txt").write_text("50 0 25 0 50 20 0 0 1")
    source = Source(root, {"camera": tmp_path / "K.txt"}, limit=1)
    assert convert("frames", source, tmp_path / "few") == 1
    assert open_folder(tmp_path / "few").photo("000000").intrinsics == pytest.approx((50, 50, 25, 20))


def test_unknown_layouts_and_empty_folders(tmp_path: Path):
    with pytest.raises(InputError, match="there is no layout 'voc'"):
        convert("voc", Source(tmp_path), tmp_path / "out")
    with pytest.raises(InputError, match="holds no photo in the layout 'plain'"):
        convert("plain", Source(tmp_path), tmp_path / "out")
