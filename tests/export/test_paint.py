import os

import numpy as np
import torch
from PIL import Image

from langflash_core.export import paint
from langflash_core.export.colours import heat, label_colours
from langflash_core.export.png import label_picture
from langflash_core.export.settings import PAINTING
from langflash_core.types import Camera, Frame, PromptAnswer, QueryResult


def frame(height: int = 2, width: int = 3, atoms: int = 2) -> Frame:
    return Frame(
        rgb=torch.full((height, width, 3), 0.5),
        alphas=torch.ones(height, width),
        depths=torch.linspace(1, 2, height * width).reshape(height, width),
        weight_maps=torch.eye(atoms)[torch.arange(height * width) % atoms].reshape(height, width, atoms),
    )


def test_png_keeps_every_pixel(tmp_path):
    pixels = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    path = tmp_path / "new" / "a.png"
    paint.write_picture(path, pixels)
    assert np.array_equal(np.asarray(Image.open(path)), pixels)
    assert os.listdir(path.parent) == ["a.png"]


def test_empty_pixels_stay_black():
    empty = Frame(torch.zeros(1, 2, 3), torch.zeros(1, 2), torch.zeros(1, 2), torch.zeros(1, 2, 2))
    assert not paint.depth_picture(empty)[0].any()
    assert not paint.atom_picture(empty, torch.eye(2)).any()


def test_depth_runs_from_near_to_far():
    depths = torch.linspace(1, 5, 101)[None]
    picture, span = paint.depth_picture(Frame(torch.zeros(1, 101, 3), torch.ones(1, 101), depths))
    levels = (1 / depths - 1 / 4.92) / (1 / 1.08 - 1 / 4.92)  # 2nd and 98th percentile
    assert np.abs(picture - 255 * heat(levels).numpy()).max() <= 1  # rounding
    assert span is not None
    np.testing.assert_allclose(span, (1.08, 4.92), rtol=1e-6)
    flat = Frame(torch.zeros(1, 2, 3), torch.ones(1, 2), torch.ones(1, 2))
    assert paint.depth_picture(flat)[0].shape == (1, 2, 3)  # no range to divide by


def test_labels_take_the_best_phrase_that_is_present():
    relevance = torch.tensor([[[0.9, 0.2, 0.3]], [[0.6, 0.8, 0.4]]])
    black = Frame(torch.zeros(1, 3, 3), torch.ones(1, 3), torch.ones(1, 3))
    answers = tuple(PromptAnswer(word, True, 0.9, 0.5, 0.5, None, None) for word in "ab")
    camera = Camera(torch.eye(4), torch.eye(3), 3, 1)
    result = QueryResult(answers, "relevancy", relevance, relevance >= 0.5, black, camera)
    picture = label_picture(result).astype(int)
    assert np.abs(picture[0, :2] - PAINTING.label_opacity * label_colours(2)).max() <= 1  # rounding
    assert not picture[0, 2].any()  # nothing present


def test_atoms_and_weights():
    assert paint.weight_picture(frame(), 0).tolist() == [[255, 0, 255], [0, 255, 0]]
    picture = paint.atom_picture(frame(), torch.eye(2))
    first, second = (picture[paint.weight_picture(frame(), 0) == shown].astype(int) for shown in (255, 0))
    # Pixels of one atom are one colour, but for the rounding of a product to whole steps.
    assert (
        max(np.ptp(first, 0).max(), np.ptp(second, 0).max()) <= 1 and np.abs(first[0] - second[0]).max() > 100
    )
    none = Frame(torch.ones(2, 2, 3), torch.ones(2, 2), torch.ones(2, 2), torch.zeros(2, 2, 0))
    assert not paint.atom_picture(none, torch.zeros(0, 8)).any()
