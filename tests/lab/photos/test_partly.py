"""Photos that are labelled in part or not at all, made here in the layouts that they are published in."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.lab.photos import chosen_ids, open_folder
from langflash_core.lab.photos.layouts import convert
from langflash_core.lab.photos.partly import PANORAMA_VIEWS, painted, panorama_view, turned, unframed
from langflash_core.lab.photos.reading import Source
from langflash_core.lab.photos.split import runs


def photo(path: Path, size: tuple[int, int] = (80, 60), value: int = 99) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((size[1], size[0], 3), value, np.uint8)).save(path)


def polygons(root: Path, names: str = "names:\n- bed\n- chair\nnc: 2\n") -> Path:
    """Two photos, one of them once more in other light, as exports of augmented sets have it."""
    root.mkdir()
    (root / "data.yaml").write_text(f"train: train/images\n{names}")
    for split, stem in (
        ("train", "a_jpg.rf.1"),
        ("train", "a_jpg.rf.2"),
        ("valid", "b_png.rf.3"),
    ):
        photo(root / split / "images" / f"{stem}.jpg")
        outlines = root / split / "labels" / f"{stem}.txt"
        outlines.parent.mkdir(exist_ok=True)
        # A bed over the left half, a chair on it, and a box, which outlines nothing.
        bed, chair = "0 0 0 .5 0 .5 1 0 1", "1 .25 .25 .5 .25 .5 .75 .25 .75"
        outlines.write_text("\n".join((chair, bed, "1 .8 .8 .1 .1")) + "\n")
    return root


def test_polygons_lie_on_each_other_and_the_rest_is_unknown(tmp_path: Path):
    assert convert("polygons", Source(polygons(tmp_path / "set")), tmp_path / "out") == 3
    folder = open_folder(tmp_path / "out")
    labels = folder.photo(folder.ids[0]).labels
    assert labels is not None and labels.shape == (60, 80)
    said = {id: name.text for id, name in folder.names.items()} | {0: "unknown"}
    assert said[labels[5, 5]] == "bed" and said[labels[30, 30]] == "chair"
    assert (labels[:, 42:] == 0).all()
    assert folder.names[1].label == "bed"


def test_photos_that_came_from_one_stay_together(tmp_path: Path):
    convert("polygons", Source(polygons(tmp_path / "set")), tmp_path / "out")
    ids = open_folder(tmp_path / "out").ids
    assert [len(run) for run in runs(ids)] == [2, 1]


@pytest.mark.parametrize(
    ("names", "said"),
    [("names: ['bed', \"chair\"]\n", ["bed", "chair"]), ("names:\n  0: bed\n  1: chair\n", ["bed", "chair"])],
)
def test_names_in_other_spellings_of_yaml(tmp_path: Path, names, said):
    convert("polygons", Source(polygons(tmp_path / "set", names)), tmp_path / "out")
    assert [name.text for name in open_folder(tmp_path / "out").names.values()] == said


def test_bad_polygons(tmp_path: Path):
    root = polygons(tmp_path / "set")
    label = root / "train" / "labels" / "a_jpg.rf.1.txt"
    label.write_text("7 0 0 1 0 1 1\n")
    with pytest.raises(InputError, match=r"names class 7, data\.yaml has 2"):
        convert("polygons", Source(root), tmp_path / "a")
    label.write_text("bed 0 0 1 0 1 1\n")
    with pytest.raises(InputError, match="no outline"):
        convert("polygons", Source(root), tmp_path / "b")
    (root / "data.yaml").write_text("nc: 2\n")
    with pytest.raises(InputError, match="lists no names"):
        convert("polygons", Source(root), tmp_path / "c")
    with pytest.raises(InputError, match="cannot be read"):
        convert("polygons", Source(tmp_path), tmp_path / "d")


def things(root: Path) -> Path:
    """One photo with an outlined book on a table counted in runs, one with nothing."""
    table = root / "annotations" / "instances_train2017.json"
    table.parent.mkdir(parents=True)
    for number in (5, 9):
        photo(root / "train2017" / f"{number:012d}.jpg", (8, 6))
    mask = np.zeros((6, 8), bool)
    mask[2:] = True
    flat = mask.T.ravel()
    changes = np.flatnonzero(np.diff(np.concatenate(([False], flat)))).tolist()
    counts = np.diff([0, *changes, flat.size]).tolist()
    annotations = [
        {"image_id": 5, "category_id": 84, "segmentation": [[2, 3, 5, 3, 5, 5, 2, 5]]},
        {"image_id": 5, "category_id": 67, "segmentation": {"counts": counts, "size": [6, 8]}},
    ]
    images = [{"id": number, "file_name": f"{number:012d}.jpg", "width": 8, "height": 6} for number in (5, 9)]
    categories = [{"id": 84, "name": "book"}, {"id": 67, "name": "dining table"}]
    document = {"images": images, "annotations": annotations, "categories": categories}
    table.write_text(json.dumps(document))
    return table


def test_things_of_coco_from_outlines_and_runs(tmp_path: Path):
    assert convert("coco-things", Source(things(tmp_path)), tmp_path / "out") == 2
    folder = open_folder(tmp_path / "out")
    first, second = (folder.labels(id) for id in folder.ids)
    assert (first[:2] == 0).all() and (first[2:, 0] == 67).all() and first[4, 3] == 84
    assert not second.any(), "nothing outlined is nothing known"


def test_masks_in_another_code_are_refused(tmp_path: Path):
    table = things(tmp_path)
    document = json.loads(table.read_text())
    document["annotations"][1]["segmentation"]["counts"] = "PPYo0"
    table.write_text(json.dumps(document))
    with pytest.raises(InputError, match="not counted in runs"):
        convert("coco-things", Source(table), tmp_path / "out")


def test_plain_photos_lose_white_bars(tmp_path: Path):
    framed = np.full((100, 140, 3), 255, np.uint8)
    framed[:, 30:110] = np.random.default_rng(0).integers(0, 200, (100, 80, 3))
    (tmp_path / "in" / "rooms").mkdir(parents=True)
    Image.fromarray(framed).save(tmp_path / "in" / "rooms" / "framed.png")
    photo(tmp_path / "in" / "whole.jpg")
    assert convert("plain", Source(tmp_path / "in"), tmp_path / "out") == 2
    folder = open_folder(tmp_path / "out")
    pictures = [folder.photo(id).image for id in folder.ids]
    assert any(np.array_equal(picture, framed[:, 30:110]) for picture in pictures)
    assert sorted(picture.shape for picture in pictures) == [(60, 80, 3), (100, 80, 3)]
    assert not folder.labelled and len(chosen_ids(folder.ids, "train")) == 2


def test_white_photos_stay_whole():
    white = np.full((90, 90, 3), 255, np.uint8)
    assert unframed(white).shape == (90, 90, 3)
    white[40:50, 40:50] = 0
    assert unframed(white).shape == (90, 90, 3), "ten pixels are no photo"


def test_larger_shapes_lie_below(tmp_path: Path):
    small, large = np.array([[0, 0], [3, 0], [3, 3], [0, 3]]), np.array([[0, 0], [9, 0], [9, 9], [0, 9]])
    ids = painted((10, 10), [(1, [small]), (2, [large])])
    assert ids[1, 1] == 1 and ids[8, 8] == 2


def test_views_of_a_panorama_agree_where_they_overlap(tmp_path: Path):
    """A smooth sphere: a ray of two views shows one colour, by the poses that the folder tells."""
    rows, columns = np.meshgrid(np.arange(256), np.arange(512), indexing="ij")
    around, down = (columns + 0.5) / 512 * 2 * np.pi, (rows + 0.5) / 256 * np.pi
    colours = np.stack((np.sin(around), np.cos(around), np.cos(down)), -1)
    sphere = (120 + 100 * colours).round().astype(np.uint8)
    (tmp_path / "in").mkdir()
    Image.fromarray(sphere).save(tmp_path / "in" / "pano.png")
    assert convert("panoramas", Source(tmp_path / "in"), tmp_path / "out") == PANORAMA_VIEWS
    folder = open_folder(tmp_path / "out")
    assert len(runs(folder.ids)) == 1, "views of one place stay on one side of a split"
    for id in folder.ids:
        view = folder.photo(id)
        assert view.K is not None and view.pose is not None
        width = view.image.shape[1]
        pixels = torch.tensor([[60.5, 40.5, 1.0], [width - 20.5, 200.5, 1.0]], dtype=torch.float64)
        rays = pixels @ torch.linalg.inv(view.K.double()).T @ view.pose[:3, :3].T
        angle = torch.atan2(rays[:, 0], rays[:, 2]) + np.pi
        tilt = torch.atan2(rays[:, 1], rays[:, [0, 2]].norm(dim=1)) + np.pi / 2
        truth = 120 + 100 * torch.stack((angle.sin(), angle.cos(), tilt.cos()), 1)
        seen = torch.from_numpy(
            np.stack([view.image[int(y), int(x)] for x, y, _ in pixels.tolist()]).astype(float)
        )
        # Two roundings to whole numbers, and bilinear values of a curve whose step is 1.2 degrees.
        assert (seen - truth).abs().max() < 2.5, id


def test_a_turned_camera_looks_to_the_right():
    forward = turned(np.pi / 2)[:3, :3] @ torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    assert torch.allclose(forward, torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64), atol=1e-12)
    sphere = np.zeros((64, 128, 3), np.uint8)
    sphere[:, 96] = 255  # a quarter to the right of the middle
    view = panorama_view(sphere, turned(np.pi / 2), (40, 30), 30.0)
    assert view[15, 19:21].max() > 100 and view[:, :10].max() == 0


def test_other_pictures_are_no_panoramas(tmp_path: Path):
    photo(tmp_path / "in" / "a.png", (80, 60))
    with pytest.raises(InputError, match="twice as wide as high"):
        convert("panoramas", Source(tmp_path / "in"), tmp_path / "out")
