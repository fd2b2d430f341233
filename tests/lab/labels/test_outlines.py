"""Outlines of photos that nobody labelled: what a proposer says, made one map; a folder that can be gone on
with."""

import numpy as np
import pytest

from langflash_core.errors import InputError
from langflash_core.lab.labels.outlines import SMALLEST, objects_of, outlined, write_outlines
from langflash_core.lab.photos import open_folder
from langflash_core.lab.photos.writing import FolderWriter
from tests.lab.labels.painted import Knowing, painted_clip


class Counting(Knowing):
    asked = 0

    def propose(self, image, where=None):
        self.asked += 1
        return super().propose(image, where)


@pytest.fixture
def clip():
    return painted_clip()


def test_every_object_is_one_number_and_repetitions_parts_and_crumbs_are_none(clip):
    frames, true = clip
    found = objects_of(frames.read(0), Knowing(frames, true))
    shown = np.unique(true[0])
    assert set(np.unique(found)) == set(range(1, len(shown) + 1))
    for id in shown:
        inside = np.bincount(found[true[0] == id])
        assert inside.max() == inside.sum(), "an object is of one number"
    assert SMALLEST * found.size > 1, "a crumb of one pixel is too small"


def test_a_folder_goes_on_and_keeps_the_numbers_of_its_photos(clip, tmp_path):
    frames, true = clip
    writer = FolderWriter(tmp_path / "plain")
    for t in (0, 3):
        writer.photo(str(7 + t), frames.read(t))
    writer.finish({}, "drawn by a test")
    plain, proposer = open_folder(tmp_path / "plain"), Counting(frames, true)
    for ids in (("7",), ("7", "10"), ("7", "10")):
        write_outlines(plain, ids, FolderWriter(tmp_path / "out"), proposer, "who knows")
    assert proposer.asked == 2
    folder = open_folder(tmp_path / "out")
    assert folder.ids == ("7", "10") and not folder.labelled
    photo = outlined(folder, "10")
    assert photo.labels is not None and np.array_equal(photo.labels, objects_of(frames.read(3), proposer))
    (tmp_path / "out" / "labels" / "7.png").unlink()
    with pytest.raises(InputError, match="label map"):
        outlined(folder, "7")
