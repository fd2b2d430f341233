"""Labelled photos as training scenes: names, regions, shards that repeat and continue."""

from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.lab.photos import Name, PhotoFolder, open_folder
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.cache import encode_pictures
from langflash_core.lab.training.photo_names import group_of, may_be_taught, photo_label
from langflash_core.lab.training.photos import PhotoPlan, fill_photo_cache, photo_record, regions
from langflash_core.lab.training.shards import NOTHING, Label, dequantise_tokens
from langflash_core.lab.training.words import build_table
from langflash_core.language.vocabulary import EVALUATED, OWN, content

NAMES = {1: Name("wall", "wall"), 2: Name("chair", "chair"), 3: Name("unknown", "other prop")}


@pytest.fixture
def folder(tmp_path: Path) -> PhotoFolder:
    """Three photos of two shapes."""
    writer = FolderWriter(tmp_path / "small")
    for number, (width, height) in enumerate(((80, 60), (80, 60), (60, 80))):
        id = str(number)
        writer.photo(id, np.random.default_rng(number).integers(0, 255, (height, width, 3), dtype=np.uint8))
        labels = np.ones((height, width), np.int64)
        labels[10:30, 10:30] = 2
        writer.labels(id, labels)
        writer.depths(id, np.full((height, width), 2.5))
        writer.camera(id, 70, 70, width / 2, height / 2)
    writer.finish({1: ("wall", None), 2: ("chair", None)}, "drawn by a test")
    return open_folder(tmp_path / "small")


PLAN = PhotoPlan(("0", "1", "2"), copies=2, area=42 * 42)


def test_words_of_the_evaluation_are_never_taught():
    """Whatever a data set calls things: also written apart, and through the table that training reads."""
    names = [*EVALUATED, "night stand", "book shelf", "wind ow pane", "garbage can", "couch", "refrigerator"]
    labels = [label for text in names if (label := photo_label(Name(text, None))) is not None]
    table = build_table(
        labels, lambda phrases: torch.nn.functional.normalize(torch.ones(len(phrases), 4), dim=1)
    )
    kept = {content(phrase) for phrase in EVALUATED}
    for phrase in table.phrases:
        assert content(phrase) not in kept and content(phrase.replace(" ", "")) not in kept, phrase
    assert not may_be_taught("night stand") and may_be_taught("coffee table")


@pytest.mark.parametrize(
    ("name", "label", "expected"),
    [
        ("chair", "chair", Label("chair", "chair")),
        ("night stand", "night stand", Label("bedside table", "bedside table")),
        ("bookshelf", "bookshelf", Label("bookcase", "bookcase")),
        ("television", "television", Label("television", "tv")),
        ("magazine", "other prop", Label("magazine", "book")),
        ("rug", "floor mat", Label("rug", "rug", ("floor mat",))),
        ("sculpture", "other prop", Label("sculpture", "sculpture")),
        ("unknown", "other prop", None),
        ("other prop", "other prop", None),
    ],
)
def test_names_go_through_the_vocabulary(name, label, expected):
    assert photo_label(Name(name, label)) == expected


def test_classes_that_are_judged_apart_stay_apart():
    pairs = (
        ("blinds", "curtain"),
        ("shelves", "bookshelf"),
        ("desk", "table"),
        ("shower curtain", "curtain"),
    )
    for one, other in pairs:
        assert group_of(one) != group_of(other)
    assert group_of("sofa") in OWN


def test_regions_of_things_are_connected_and_walls_are_whole():
    ids = torch.ones(40, 40, dtype=torch.int64)
    ids[:, 18:22] = 3  # unknown, a wall on either side
    ids[5:15, 2:12] = ids[25:35, 25:38] = 2
    ids[0, 0] = 2  # too small to be seen
    ids[39] = 0
    instances, labels = regions(ids, NAMES)
    assert [label.name for label in labels] == ["wall", "chair", "chair"]
    assert (instances[:39, 18:22] == NOTHING).all() and (instances[39] == NOTHING).all()
    assert instances[0, 0] == NOTHING
    assert instances[1, 0] == instances[1, 39] == 0
    assert instances[10, 5] == 2 and instances[30, 30] == 1  # the larger first


def test_more_regions_than_fit_keep_the_largest():
    ids = torch.zeros(64, 64, dtype=torch.int64)
    ids[::2, ::2] = 2  # 1,024 single pixels: below the smallest region of 3.3
    instances, labels = regions(ids, NAMES)
    assert not labels and (instances == NOTHING).all()
    ids = torch.zeros(96, 96, dtype=torch.int64)
    for k in range(300):
        row, column = 4 * (k // 24), 4 * (k % 24)
        ids[row : row + 3, column : column + 3] = 2  # 9 pixels of 9,216
    instances, labels = regions(ids, NAMES)
    assert len(labels) == NOTHING and int(instances[instances != NOTHING].max()) == NOTHING - 1


def test_the_first_copy_is_the_photo_and_others_repeat(folder: PhotoFolder):
    plain, other = photo_record(folder, "1", 0, PLAN), photo_record(folder, "1", 1, PLAN)
    again = photo_record(folder, "1", 1, PLAN)
    assert torch.equal(other.rgb, again.rgb) and torch.equal(other.instances, again.instances)
    assert plain.seed != other.seed and not torch.equal(plain.Ks, other.Ks)
    assert plain.rgb.shape == other.rgb.shape == (1, 3, 42, 56)
    assert [label.name for label in plain.labels] == ["wall", "chair"]
    assert float(plain.depths.float().mean()) == pytest.approx(2.5, abs=1e-2)
    assert torch.equal(plain.viewmats, torch.eye(4)[None])


def test_a_cache_is_written_once_and_shared(folder: PhotoFolder, tmp_path: Path, network):
    encoder, out = network().encoder, tmp_path / "cache"
    assert fill_photo_cache(folder, out, PLAN, encoder, (0, 2)) == 2  # two shapes, a shard each
    assert fill_photo_cache(folder, out, PLAN, encoder, (1, 2)) == 4
    assert fill_photo_cache(folder, out, PLAN, encoder) == 0
    rooms = RoomSet(out)
    assert len(rooms) == 6
    batch = rooms.draw(2, 2, torch.Generator().manual_seed(0))
    assert batch.images.shape[:3] == (2, 1, 3) and batch.tokens is not None
    shard, index = rooms.entries[0]
    record = shard.record(index)
    expected = encode_pictures(encoder, record.rgb)
    assert record.tokens is not None and record.token_scales is not None
    found = dequantise_tokens(record.tokens, record.token_scales)
    assert float((found - expected).norm() / expected.norm()) < 0.02


def test_bad_plans_are_refused(folder: PhotoFolder, tmp_path: Path):
    with pytest.raises(ValueError, match="encoder"):
        fill_photo_cache(folder, tmp_path, PLAN, None)
    with pytest.raises(ValueError, match="part"):
        fill_photo_cache(folder, tmp_path, PhotoPlan(("0",), with_tokens=False), None, (2, 2))
    assert fill_photo_cache(folder, tmp_path, PhotoPlan(("0",), with_tokens=False), None) == 1
    assert RoomSet(tmp_path).entries[0][0].record(0).tokens is None
