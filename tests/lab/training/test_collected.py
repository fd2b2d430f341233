"""What `langflash lab labels` collects of a clip comes back as things to learn from, numbers and vectors."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.labels.clips import ClipPlace, find_clips, open_clip
from langflash_core.lab.labels.collecting import collect
from langflash_core.lab.labels.following import MotionPropagator
from langflash_core.lab.labels.motion import by_flow
from langflash_core.lab.labels.re10k import enrich
from langflash_core.lab.labels.storage import ClipLabels, write_labels
from langflash_core.lab.photos.fitting import fitted
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.objects import tracked
from langflash_core.lab.training.scenes import SceneSource, source_at
from langflash_core.lab.training.shards import NOTHING
from langflash_core.lab.training.stages.aggregation import NamedParts, collected_texts
from tests.lab.labels.painted import HEIGHT, WIDTH, Counting, Knowing, painted_clip
from tests.lab.photos.layouts_made import jpeg

VIEWS = (0, 9)
CAMERA = (100.0, 100.0, WIDTH / 2, HEIGHT / 2)


def collected(place: ClipPlace, out: Path) -> ClipLabels:
    """Label a clip where it lies; who proposes masks knows the truth, the rest is what makes labels."""
    clip, true = open_clip(place).held(), painted_clip()[1]
    labels = collect(clip, Knowing(clip, true), MotionPropagator(by_flow), Counting())
    (out / place.name).mkdir(parents=True)
    write_labels(labels, out / place.name)
    return labels


def posed_clip(folder: Path, poses: bool = True) -> None:
    """The painted clip as `images/`, intrinsics and poses."""
    clip, _ = painted_clip()
    writer = FolderWriter(folder)
    for t, id in enumerate(clip.ids):
        writer.photo(id, clip.read(t))
        writer.camera(id, *CAMERA)
        if poses:
            pose = torch.eye(4, dtype=torch.float64)
            pose[0, 3] = 0.1 * t
            writer.pose(id, pose)
    writer.finish({}, "painted")


def chunked_clip(split: Path) -> None:
    """The painted clip as one video of a chunk of RealEstate10K."""
    clip, _ = painted_clip()
    split.mkdir()
    cameras = torch.zeros(len(clip), 18)
    cameras[:, :4] = torch.tensor([CAMERA[0] / WIDTH, CAMERA[1] / HEIGHT, 0.5, 0.5])
    for t in range(len(clip)):
        viewmat = torch.eye(4)
        viewmat[0, 3] = -0.1 * t
        cameras[t, 6:] = viewmat[:3].flatten()
    images = [jpeg(clip.read(t)) for t in range(len(clip))]
    torch.save([{"key": "hall", "cameras": cameras, "images": images}], split / "000000.torch")
    (split / "index.json").write_text(json.dumps({"hall": "000000.torch"}))


def assert_the_same_things(source: SceneSource, labels: ClipLabels) -> None:
    (unit,) = source.units
    (scene,) = source.open(unit)
    assert len(scene.folder.ids) == len(labels.frames)
    photos = [scene.folder.photo(scene.folder.ids[t]) for t in VIEWS]
    assert all(photo.K is not None and photo.pose is not None for photo in photos)
    views = [fitted(photo, (WIDTH, HEIGHT)) for photo in photos]
    objects = scene.objects(views, torch.eye(4).repeat(2, 1, 1))
    ids = labels.ids[list(VIEWS)].astype(int)
    numbers = sorted(set(np.unique(ids).tolist()) - {0})
    assert len(numbers) >= 3 and objects.vectors is not None
    assert len(objects.vectors) == len(numbers)
    for number in numbers:
        (row,) = objects.ids[torch.from_numpy(ids == number)].unique().tolist()  # the same in both views
        assert bool((objects.ids.numpy() == row)[ids != number].any()) is False
        # Written as float16: 5e-4 of each number of a unit vector.
        assert np.abs(objects.vectors[row].numpy() - labels.vectors[number - 1]).max() < 5e-4
    assert (objects.ids.numpy()[ids == 0] == NOTHING).all()


def test_from_an_enriched_chunk(tmp_path):
    split = tmp_path / "train"
    chunked_clip(split)
    (place,) = find_clips(split)
    labels = collected(place, tmp_path / "out")
    assert enrich(split, tmp_path / "out") == 1
    assert_the_same_things(source_at(split), labels)


def test_from_a_folder_of_posed_clips(tmp_path):
    posed_clip(tmp_path / "clips" / "hall")
    (place,) = find_clips(tmp_path / "clips")
    labels = collected(place, tmp_path / "out")
    assert_the_same_things(source_at(tmp_path / "clips", tmp_path / "out"), labels)


def test_clips_without_poses_or_labels_are_refused_in_a_sentence(tmp_path):
    posed_clip(tmp_path / "clips" / "hall", poses=False)
    with pytest.raises(InputError, match="collect them with langflash lab labels"):
        source_at(tmp_path / "clips", tmp_path / "out")
    (place,) = find_clips(tmp_path / "clips")
    collected(place, tmp_path / "out")
    source = source_at(tmp_path / "clips", tmp_path / "out")
    with pytest.raises(InputError, match=r"without poses; put all into its poses\.txt"):
        source.open("hall")
    (tmp_path / "clips" / "hall" / "images").rename(tmp_path / "clips" / "plain")
    plain = source_at(tmp_path / "clips" / "plain", labels_called(tmp_path / "out", "plain"))
    with pytest.raises(InputError, match="has no poses; put its frames into"):
        plain.open("plain")


def labels_called(out: Path, name: str) -> Path:
    (out / "hall").rename(out / name)
    return out


def test_a_thing_of_which_nothing_is_known_is_nobodys():
    objects = tracked(torch.tensor([[[1, 2], [2, 0]]]), torch.tensor([[1.0, 0], [0, 0]]))
    assert objects.ids.flatten().tolist() == [0, NOTHING, NOTHING, NOTHING] and len(objects.labels) == 1


def test_vectors_of_another_space_are_refused_with_the_remedy():
    instances, atoms = torch.tensor([2, 0]), torch.zeros(2, 512)
    found = NamedParts(atoms=atoms, pooled=atoms, instances=instances, quality=torch.ones(2))
    texts = collected_texts(torch.eye(512)[:3], found, "clip")
    assert torch.equal(texts.truth, torch.eye(512)[instances]) and len(texts.bank) == 3
    with pytest.raises(InputError, match=r"have 384 numbers, those of the network 512; .*--vectors clip"):
        collected_texts(torch.zeros(3, 384), found, "clip")
