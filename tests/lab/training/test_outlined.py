"""Real photos for the grouping: two windows of one photo share their numbers, and nothing else is judged."""

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.lab.photos import open_folder
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.outlined import Outlined, OutlinedSet, outlined_set
from langflash_core.lab.training.shards import NOTHING
from langflash_core.lab.training.stages.grouping import grouping_stage

LEFT, RIGHT = (200, 30, 30), (30, 30, 200)


@pytest.fixture
def folders(tmp_path):
    """The same photos, red on the left and blue on the right, outlined (the red half as number 5, a stripe of
    nobody's between) and named."""
    for kind in ("outlined", "named"):
        writer = FolderWriter(tmp_path / kind)
        for number in range(0, 32, 2):  # each a run of numbers
            image, ids = np.zeros((90, 120, 3), np.uint8), np.zeros((90, 120), np.int64)
            image[:, :60], image[:, 60:] = LEFT, RIGHT
            ids[:, :56], ids[:, 64:] = (5, 2) if kind == "outlined" else (1, 2)
            writer.photo(str(number), image)
            writer.labels(str(number), ids)
        writer.finish({1: ("wall", None), 2: ("chair", None)} if kind == "named" else {}, "drawn by a test")
    return [open_folder(tmp_path / kind) for kind in ("outlined", "named")]


def test_windows_of_a_photo_share_their_numbers(folders):
    batch = OutlinedSet((Outlined(folders[0], folders[0].ids, 1.0),)).draw(
        8, 1, torch.Generator().manual_seed(0)
    )
    scenes, windows = batch.images.shape[:2]
    assert windows == 2 and batch.partly and scenes <= 4
    red = batch.images[:, :, 0] > batch.images[:, :, 2]
    for number, side in ((4, red), (1, ~red)):
        assert bool(side[batch.instances == number].all())
    assert set(batch.instances.unique().tolist()) == {1, 4, NOTHING}
    mirrored = red[..., -1].float().mean((2,)) > 0.5  # red on the right
    assert torch.equal(mirrored[:, 0], mirrored[:, 1]) and 0 < int(mirrored[:, 0].sum()) < scenes
    assert not torch.equal(batch.images[:, 0], batch.images[:, 1]), "another window in another light"


def test_names_become_regions(folders):
    photo = Outlined(folders[1], folders[1].ids, 1.0).photo(0)
    assert photo.labels is not None
    assert [photo.labels[0, x] for x in (10, 60, 110)] == [1, 0, 2]


def test_more_outlines_than_numbers_leave_the_last_to_nobody(folders, tmp_path):
    writer = FolderWriter(tmp_path / "many")
    writer.photo("1", np.zeros((80, 80, 3), np.uint8))
    writer.labels("1", np.arange(6400).reshape(80, 80) // 16)
    writer.finish({}, "drawn by a test")
    photo = Outlined(open_folder(tmp_path / "many"), ("1",), 1.0).photo(0)
    assert photo.labels is not None and photo.labels.max() == NOTHING
    assert (photo.labels == 0).sum() == 16 * (400 - 255)


def test_what_is_kept_to_judge_is_not_drawn(folders):
    learned = outlined_set(folders)
    assert len(learned) == sum(len(one.ids) for one in learned.folders) < 32
    parts = [learned.part(number, 2) for number in range(2)]
    assert sum(map(len, parts)) == len(learned)


def test_photos_without_names_or_outlines_of_their_size_are_refused(folders, tmp_path):
    outlined = folders[0].root / "labels"
    Image.fromarray(np.ones((30, 40), np.uint16)).save(outlined / "0.png")
    with pytest.raises(InputError, match="another size"):
        Outlined(folders[0], ("0",), 1.0).photo(0)
    outlined.rename(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="neither named nor outlined"):
        outlined_set(folders)


def test_the_grouping_learns_from_them(folders, words, network):
    net = network()
    optimiser = torch.optim.Adam(net.grouping.parameters(), lr=1e-3)
    photos, losses = outlined_set(folders), []
    batch = photos.draw(2, 1, torch.Generator().manual_seed(1))
    for _ in range(3):
        optimiser.zero_grad()
        loss = grouping_stage(net, batch, words).total
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert losses[-1] < losses[0]
