"""Pairs of posed photos from published layouts: what is one thing in both, who reads what, and refusals."""

import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.lab.photos import Name
from langflash_core.lab.photos.fitting import FittedPhoto
from langflash_core.lab.training.objects import linked, tracked
from langflash_core.lab.training.scenes import SceneSet, chosen_photos, re10k_source, source_at
from langflash_core.lab.training.shards import NOTHING
from langflash_core.network import PRESETS
from tests.lab.photos import layouts_made

SMALL = replace(PRESETS["full"], native_area=64 * 64)
NAMES = {1: Name("chair", "chair"), 2: Name("wall", "wall")}


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    return layouts_made.wall(tmp_path_factory.mktemp("wall"), 6)


@pytest.fixture(scope="module")
def scannet(wall, tmp_path_factory):
    root = tmp_path_factory.mktemp("scannet")
    layouts_made.scannet_table(root)
    for number in range(3):
        layouts_made.lsm_scene(wall, root / f"scene000{number}_00")
    return root


@pytest.fixture
def labelled(wall, tmp_path):
    """Chunks of RealEstate10K, of which one has collected labels."""
    layouts_made.re10k_split(wall, tmp_path)
    split = tmp_path / "test"
    layouts_made.collect(wall, split / "000000.torch", keys=("bbbb",))
    return split


def _view(labels: torch.Tensor) -> FittedPhoto:
    """A wall at 4 m with chairs at 2 m, seen with a focal length of 20."""
    depths = torch.where(labels == 1, 2.0, 4.0)
    K = torch.tensor([[20.0, 0, 16], [0, 20.0, 16], [0, 0, 1]])
    return FittedPhoto(torch.zeros(3, 32, 32, dtype=torch.uint8), labels, depths, K, torch.full((32, 32), -1))


def test_two_chairs_keep_their_numbers_when_the_camera_steps_aside():
    first, second = (torch.full((32, 32), 2) for _ in range(2))
    first[10:20, 4:10] = first[10:20, 20:26] = 1
    second[10:20, 9:15] = second[10:20, 25:31] = 1  # 0.5 m aside: 5 pixels at 2 m
    viewmats = torch.eye(4).repeat(2, 1, 1)
    viewmats[1, 0, 3] = 0.5
    objects = linked([_view(first), _view(second)], NAMES, viewmats)
    assert [label.name for label in objects.labels].count("chair") == 2 and len(objects.labels) == 3
    left, right = objects.ids[0, 15, 5], objects.ids[0, 15, 22]
    assert left != right
    assert (objects.ids[1, 10:20, 9:15] == left).all() and (objects.ids[1, 10:20, 25:31] == right).all()
    assert (objects.ids[1][second == 2] == objects.ids[0, 0, 0]).all()


def test_a_chair_that_only_the_second_view_sees_is_another_one():
    first, second = (torch.full((32, 32), 2) for _ in range(2))
    first[10:20, 4:10] = second[10:20, 20:26] = 1  # the camera stands still
    objects = linked([_view(first), _view(second)], NAMES, torch.eye(4).repeat(2, 1, 1))
    assert objects.ids[1, 15, 22] not in (objects.ids[0, 15, 5], NOTHING)


def test_tracked_things_keep_their_vectors():
    maps = torch.tensor([[[0, 7], [7, 7]], [[0, 2], [2, 7]]])
    vectors = torch.eye(9)
    objects = tracked(maps, vectors)
    assert objects.vectors is not None and len(objects.labels) == 2
    for number in (2, 7):
        rows = objects.ids[maps == number].unique()
        assert len(rows) == 1 and torch.equal(objects.vectors[int(rows)], vectors[number - 1])
    assert (objects.ids[maps == 0] == NOTHING).all()


def test_scannet_gives_pairs_whose_things_are_the_same_in_both_views(scannet):
    scenes = SceneSet(source_at(scannet), SMALL)
    batch = scenes.draw(3, 2, torch.Generator().manual_seed(0))
    assert batch.images.shape == (3, 2, 3, 64, 64) and batch.partly
    # A pose times its inverse, in float32.
    assert torch.allclose(batch.viewmats[:, 0], torch.eye(4).expand(3, 4, 4), rtol=0, atol=1e-6)
    for ids, labels in zip(batch.instances, batch.labels, strict=True):
        both = set(ids[0].unique().tolist()) & set(ids[1].unique().tolist()) - {NOTHING}
        assert len(both) >= 3  # of the painted wall's things, which all photos show
        assert max(both) < len(labels)
    again = scenes.draw(3, 2, torch.Generator().manual_seed(0))
    assert torch.equal(again.images, batch.images) and again.seeds == batch.seeds


def test_batches_of_a_step_read_different_scenes(scannet):
    scenes = SceneSet(source_at(scannet), SMALL)
    parts = [scenes.part(number, 2).source.units for number in range(2)]
    assert sorted((*parts[0], *parts[1])) == sorted(scenes.source.units) and not set(parts[0]) & set(parts[1])
    assert [len(scenes.part(number, 4).source.units) for number in range(4)] == [1, 1, 1, 1]


def test_a_scene_gives_few_sets_of_photos_again_and_again(scannet):
    source = source_at(scannet)
    (scene,) = source.open(source.units[0])
    sets = [tuple(chosen_photos(scene, pair, 2, source.apart)) for pair in range(4)]
    assert sets == [tuple(chosen_photos(scene, pair, 2, source.apart)) for pair in range(4)]
    assert all(one != other for one, other in sets) and len(set(sets)) > 1


def test_labelled_videos_of_chunks_are_read_with_their_vectors(labelled):
    batch = SceneSet(source_at(labelled), SMALL).draw(2, 2, torch.Generator().manual_seed(0))
    assert len(batch.vectors) == 2
    for ids, vectors in zip(batch.instances, batch.vectors, strict=True):
        assert vectors is not None and vectors.shape[1] == layouts_made.VECTOR
        assert int(ids[ids != NOTHING].max()) < len(vectors)


def test_videos_without_labels_are_refused_in_one_sentence(wall, tmp_path):
    layouts_made.re10k_split(wall, tmp_path)
    source = re10k_source(tmp_path / "test")
    with pytest.raises(InputError, match="collect them with langflash lab labels"):
        SceneSet(source, SMALL).draw(1, 2, torch.Generator().manual_seed(0))


@pytest.mark.parametrize("spoil", ["ids", "vectors", "count"])
def test_damaged_labels_name_the_video(labelled, spoil):
    chunk = torch.load(labelled / "000000.torch", weights_only=True)
    entry = next(entry for entry in chunk if "labels" in entry)["labels"]
    if spoil == "count":
        entry["ids"] = entry["ids"][1:]
    elif spoil == "ids":
        entry["ids"] = [torch.zeros(9, dtype=torch.uint8) for _ in entry["ids"]]
    else:
        del entry["vectors"]
    torch.save(chunk, labelled / "000000.torch")
    with pytest.raises(InputError, match=r"bbbb cannot be read.*collect them again"):
        SceneSet(source_at(labelled), SMALL).draw(1, 2, torch.Generator().manual_seed(0))


def test_a_folder_of_another_layout_says_which_ones_are_known(tmp_path):
    with pytest.raises(InputError, match="neither index"):
        source_at(tmp_path)


def test_id_maps_are_png_of_any_depth(wall, tmp_path):
    layouts_made.re10k_split(wall, tmp_path)
    layouts_made.collect(wall, tmp_path / "test" / "000000.torch", keys=("aaaa",), offset=1000)
    (scene,) = re10k_source(tmp_path / "test").open("000000.torch")
    stream = Image.open(io.BytesIO(scene.folder.maps["000000"]))  # type: ignore[attr-defined]
    assert np.asarray(stream).max() > 1000
    assert scene.folder.labels("000000").max() > 1000
