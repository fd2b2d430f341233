"""Labels on disk: an id a pixel and a vector an object, and back."""

import numpy as np
import pytest

from langflash_core.errors import InputError
from langflash_core.lab.labels.storage import (
    LABELS,
    ClipLabels,
    ObjectRow,
    decoded_map,
    encoded_map,
    packed,
    pairs,
    read_labels,
    write_labels,
)


def some_labels(frames: int = 5, objects: int = 3, name: str = "kitchen") -> ClipLabels:
    rng = np.random.default_rng(1)
    ids = rng.integers(0, objects + 1, (frames, 24, 36)).astype(np.uint16)
    vectors = rng.normal(size=(objects, 16)).astype(np.float32)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    rows = tuple(ObjectRow(n + 1, 0, frames, 99, 0.9, 2, 0.95) for n in range(objects))
    names = tuple(f"{t:04d}" for t in range(frames))
    return ClipLabels(name, names, ids, rows, vectors, "minilm", {"total": 1.5})


def test_a_round_trip_keeps_every_id_and_vectors_to_half_precision(tmp_path):
    labels = some_labels()
    back = read_labels(write_labels(labels, tmp_path))
    assert np.array_equal(back.ids, labels.ids) and back.ids.dtype == np.uint16
    assert np.abs(back.vectors - labels.vectors).max() < 5e-4  # float16 has 11 bits below 1
    assert (back.name, back.frames, back.objects, back.space, back.seconds) == (
        labels.name, labels.frames, labels.objects, labels.space, labels.seconds,
    )  # fmt: skip


@pytest.mark.parametrize("most", [3, 255, 256, 65535])
def test_maps_are_lossless_in_8_and_16_bits(most):
    ids = np.random.default_rng(0).integers(0, most + 1, (40, 50)).astype(np.uint16)
    ids[0, 0] = most
    assert np.array_equal(decoded_map(encoded_map(ids)), ids)


def test_storage_does_not_grow_with_the_channels_of_a_pixel():
    """A feature a pixel would be 5 * 24 * 36 * 16 numbers; the file is a fraction of that."""
    assert len(packed(some_labels())) < 5 * 24 * 36 * 16


def test_features_are_those_of_the_objects_and_nothing_where_nobody_is():
    labels = some_labels()
    features = labels.features(2)
    for y, x in ((0, 0), (3, 7), (23, 35)):
        id = int(labels.ids[2, y, x])
        expected = labels.vectors[id - 1] if id else np.zeros(16)
        assert np.array_equal(features[y, x], expected)


def test_pairs_are_expanded_one_by_one_and_hold_only_their_own_objects():
    labels = some_labels(frames=4)
    labels.ids[2:] = np.where(labels.ids[2:] == 3, 0, labels.ids[2:])
    listed = list(pairs(labels, range(1, 3)))
    assert [pair.frames for pair in listed] == [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3)]
    last = listed[2]
    assert last.numbers.tolist() == [1, 2] and np.array_equal(last.vectors, labels.vectors[:2])
    assert np.array_equal(last.ids, labels.ids[[2, 3]])


@pytest.mark.parametrize("cut", [0, 7, 200, -30])
def test_damaged_files_are_refused_in_a_sentence(tmp_path, cut):
    content = packed(some_labels())
    (tmp_path / LABELS).write_bytes(content[:cut])
    with pytest.raises(InputError, match="make them again"):
        read_labels(tmp_path / LABELS)


def test_ids_without_an_object_are_refused(tmp_path):
    labels = some_labels()
    labels.ids[0, 0, 0] = 9
    with pytest.raises(InputError, match="names object 9 of 3"):
        read_labels(write_labels(labels, tmp_path))


def test_labels_that_are_not_there_are_missed(tmp_path):
    with pytest.raises(InputError, match="there are no labels"):
        read_labels(tmp_path / LABELS)
