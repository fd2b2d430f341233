"""RealEstate10K's chunks with labels inside: everything else stays, nothing in them is executed."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.labels.clips import find_clips, open_clip
from langflash_core.lab.labels.re10k import ENTRY, as_entry, enrich, labels_inside
from langflash_core.lab.labels.storage import LABELS, write_labels
from langflash_core.lab.photos.published import re10k_scenes
from tests.lab.labels.test_storage import some_labels
from tests.lab.photos import layouts_made as made


@pytest.fixture
def split(tmp_path) -> Path:
    made.re10k_split(made.wall(tmp_path / "photos", 5), tmp_path / "re10k")
    return tmp_path / "re10k" / "test"


def labelled(folder: Path, key: str, frames: int = 5) -> Path:
    (folder / key).mkdir(parents=True)
    write_labels(some_labels(frames, name=key), folder / key)
    return folder


def test_videos_of_a_split_are_clips_with_cameras(split):
    places = find_clips(split)
    assert [place.key for place in places] == ["aaaa", "bbbb"]
    clip = open_clip(places[1])
    assert len(clip) == 5 and clip.Ks is not None and clip.viewmats is not None
    assert clip.read(4).dtype == np.uint8 and clip.read(4).ndim == 3


def test_labels_go_into_the_chunk_and_come_out_the_same(split, tmp_path):
    assert enrich(split, labelled(tmp_path / "out", "bbbb")) == 1
    (back,) = labels_inside(split)
    expected = some_labels(name="bbbb")
    assert back.name == "bbbb" and np.array_equal(back.ids, expected.ids) and back.objects == expected.objects
    assert np.abs(back.vectors - expected.vectors).max() < 5e-4


def test_everything_else_in_the_chunk_stays_and_other_readers_find_it(split, tmp_path):
    path = split / "000000.torch"
    before = torch.load(path, weights_only=True)
    enrich(split, labelled(tmp_path / "out", "bbbb"))
    after = torch.load(
        path, weights_only=True
    )  # as pixelSplat's loader reads it: keys by name, the rest unread
    for old, new in zip(before, after, strict=True):
        assert set(new) - set(old) == ({ENTRY} if old["key"] == "bbbb" else set())
        for name, value in old.items():
            if name == "images":
                assert all(torch.equal(a, b) for a, b in zip(value, new[name], strict=True))
            elif isinstance(value, torch.Tensor):
                assert torch.equal(value, new[name])
            else:
                assert value == new[name]
    assert [key for key, _ in re10k_scenes(split)] == ["aaaa", "bbbb"]


def test_enriching_again_replaces_what_changed_alone(split, tmp_path):
    out = labelled(tmp_path / "out", "bbbb")
    enrich(split, out)
    first = (split / "000000.torch").stat()
    assert enrich(split, out) == 1
    again = (split / "000000.torch").stat()
    assert again.st_mtime_ns == first.st_mtime_ns  # they are there already
    write_labels(replace(some_labels(name="bbbb"), seconds={"total": 9.0}), out / "bbbb")
    assert enrich(split, out) == 1 and (split / "000000.torch").stat().st_mtime_ns > first.st_mtime_ns
    (back,) = labels_inside(split)
    assert back.seconds == {"total": 9.0}


def test_only_the_videos_that_are_asked_for_are_enriched(split, tmp_path):
    out = labelled(labelled(tmp_path / "out", "aaaa"), "bbbb")
    assert enrich(split, out, {"aaaa", "cccc"}) == 1
    assert [labels.name for labels in labels_inside(split)] == ["aaaa"]


@pytest.mark.parametrize("key", ["../outside", "/outside", ".."])
def test_a_key_that_leads_out_of_the_output_is_refused(split, key):
    chunk, index = split / "000000.torch", split / "index.json"
    entries = torch.load(chunk, weights_only=True)
    entries[0] |= {"key": key, ENTRY: as_entry(some_labels(name="aaaa"), 5)}
    torch.save(entries, chunk)
    with pytest.raises(InputError, match="cannot be the name of a folder"):
        list(labels_inside(split))
    index.write_text(json.dumps({key: "000000.torch"}))
    with pytest.raises(InputError, match="cannot be the name of a folder"):
        find_clips(split)


def test_labels_that_give_themselves_another_name_go_by_their_video(split, tmp_path):
    out = labelled(tmp_path / "out", "bbbb")
    write_labels(some_labels(name="../outside"), out / "bbbb")
    enrich(split, out)
    assert [labels.name for labels in labels_inside(split)] == ["bbbb"]


def test_labels_of_other_frames_are_refused_and_the_chunk_stays(split, tmp_path):
    before = (split / "000000.torch").read_bytes()
    with pytest.raises(InputError, match="of 4 frames, the video has 5"):
        enrich(split, labelled(tmp_path / "out", "bbbb", frames=4))
    assert (split / "000000.torch").read_bytes() == before


def test_code_in_a_chunk_is_not_run(split, tmp_path):
    class Harm:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "harmed",))

    (split / "000000.torch").write_bytes(pickle.dumps([Harm()]))
    with pytest.raises(InputError, match="cannot be read safely"):
        enrich(split, labelled(tmp_path / "out", "bbbb"))
    assert not (tmp_path / "harmed").exists()


def test_damaged_labels_in_a_chunk_are_a_sentence(split, tmp_path):
    enrich(split, labelled(tmp_path / "out", "bbbb"))
    entries = torch.load(split / "000000.torch", weights_only=True)
    entries[1][ENTRY]["ids"] = entries[1][ENTRY]["ids"][:2]
    torch.save(entries, split / "000000.torch")
    with pytest.raises(InputError, match="bbbb cannot be read"):
        list(labels_inside(split))


def test_a_folder_without_frames_is_no_clip(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no frames"):
        find_clips(tmp_path)
    assert not (tmp_path / "empty" / LABELS).exists()
