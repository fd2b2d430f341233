"""What another network's opinions are worth: counts, evidence, and what a teacher says with it."""

import math

import numpy as np
import pytest
import torch
from PIL import Image
from torch.nn import functional as F

from langflash_core.lab.photos import open_folder
from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.bank import NameBank
from langflash_core.lab.training.fewlabels import TEMPERATURE, told_by
from langflash_core.lab.training.further import Sets
from langflash_core.lab.training.heard import OTHER, SMOOTH, VALUES, WEIGHT, counted, evidence

from .conftest import encode

WALL, CHAIR = CLASSES37.index("wall"), CLASSES37.index("chair")


def folder(root, count: int = 2):
    """Photos of a wall, with a chair and a bottle in it; the other network says 17 of the chair, 5 else."""
    writer = FolderWriter(root)
    labels = np.ones((60, 80), np.int64)
    labels[10:40, 8:40], labels[50:, 60:], labels[:5] = 2, 3, 0
    (root / "opinions").mkdir(parents=True, exist_ok=True)
    for number in range(1, count + 1):
        writer.photo(str(number), (labels[..., None] * np.array([60, 20, 40])).astype(np.uint8))
        writer.labels(str(number), labels)
        said = np.where(labels == 2, 17, 5).astype(np.uint8)
        Image.fromarray(said[::2, ::2]).save(root / "opinions" / f"{number}.png")
    writer.finish({1: ("wall", None), 2: ("chair", None), 3: ("bottle", None)}, "drawn by a test")
    return open_folder(root)


def test_what_is_said_is_counted_by_class(tmp_path):
    made = folder(tmp_path)
    counts = counted(made.names, map(made.photo, made.ids))
    assert counts.shape == (OTHER + 1, VALUES)
    assert counts[CHAIR, 17] == 2 * 30 * 32 and counts[OTHER, 5] == 2 * 10 * 20
    assert counts[WALL, 5] == 2 * (55 * 80 - 30 * 32 - 10 * 20)
    assert counts.sum() == 2 * 55 * 80, "what is not labelled counts nothing"


def test_evidence_is_that_of_a_plain_loop():
    counts = torch.zeros(OTHER + 1, VALUES, dtype=torch.float64)
    counts[WALL, 5], counts[WALL, 17], counts[CHAIR, 17], counts[OTHER, 5] = 9000, 100, 800, 50
    found = evidence(counts)
    assert found.shape == (VALUES + 1, OTHER + 1) and bool(torch.isfinite(found).all())
    for value in (5, 17):
        usual = float(counts[:, value].sum() / counts.sum())
        for row in (WALL, CHAIR, OTHER, 20):
            likely = (float(counts[row, value]) + SMOOTH * VALUES * usual) / (
                float(counts[row].sum()) + SMOOTH * VALUES
            )
            assert float(found[value, row]) == pytest.approx(WEIGHT * math.log(likely / usual), abs=1e-5)
    assert float(found[17, CHAIR]) > 0 > float(found[17, WALL])
    assert not found[VALUES].any() and not found[200].any(), "nothing was said; never counted"


def bank(evidence_of=None) -> NameBank:
    texts = F.normalize(torch.randn(len(CLASSES37) + 1, 384, generator=torch.manual_seed(0)), dim=1)
    rows = torch.tensor([*range(len(CLASSES37)), OTHER])
    even, against = torch.ones(len(CLASSES37)), torch.ones(1, 1, 1)
    return NameBank((*CLASSES37, "bottle"), texts, texts[:-1], even, (), (), against, rows, evidence_of)


def test_a_teacher_in_doubt_is_told_by_another():
    said = torch.zeros(VALUES + 1, OTHER + 1)
    said[17, CHAIR], said[17, OTHER] = 3.0, -2.0
    names = bank(said)
    vectors = F.normalize(names.classes[WALL] + 0.95 * names.classes[CHAIR], dim=0)[None].repeat(3, 1)
    plain, told = (told_by(vectors, torch.tensor([17, 5, -1]), one) for one in (bank(), names))
    assert plain.by_class.argmax(1).tolist() == [WALL] * 3 and bool(plain.alike.all())
    assert told.by_class.argmax(1).tolist() == [CHAIR, WALL, WALL]
    assert told.alike.tolist() == [False, True, True]
    assert torch.equal(told.by_class[1:], plain.by_class[1:]), "nothing said of it"
    moved = told.by_name[0] - plain.by_name[0]
    assert float(moved[CHAIR]) == pytest.approx(3.0, abs=1e-4)
    assert float(moved[-1]) == pytest.approx(-2.0, abs=1e-4), "a bottle is something else"
    truth = TEMPERATURE * vectors.double() @ names.classes.double().T
    assert torch.allclose(plain.by_class.double(), truth, atol=1e-5)  # float32, sums of 384


def test_opinions_are_drawn_through_the_window_of_their_photo(tmp_path):
    main = folder(tmp_path / "main", 3)
    sets = Sets.of(main, main.ids, [folder(tmp_path / "more", 2)], encode)
    assert sets.told.bank.evidence is not None
    drawn = sets.told.draw(4, torch.Generator().manual_seed(0)).to("cpu")
    chair = drawn.classes == CHAIR
    assert bool(chair.any()) and bool((drawn.opinions >= 0).all())
    assert torch.equal(drawn.opinions == 17, chair), "the chair's edges lie on the grid of opinions"
