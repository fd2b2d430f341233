"""COCO instances: the document's own rules, and run lengths that decode to the mask."""

import json

import numpy as np
import pytest
import torch

from langflash_core.export.coco import coco, run_lengths, write_coco
from langflash_core.types import Camera, Frame, PromptAnswer, QueryResult

HEIGHT, WIDTH = 12, 17


def decoded(counts: list[int], height: int, width: int) -> np.ndarray:
    """Run lengths to a mask, pixel by pixel, as the format describes them."""
    flat = [bool(index % 2) for index, length in enumerate(counts) for _ in range(length)]
    return np.array([[flat[column * height + row] for column in range(width)] for row in range(height)])


def view(masks: torch.Tensor) -> QueryResult:
    frame = Frame(torch.rand(HEIGHT, WIDTH, 3), torch.ones(HEIGHT, WIDTH), torch.ones(HEIGHT, WIDTH))
    answers = tuple(
        PromptAnswer(text, bool(mask.any()), 0.9, 0.6, 0.4, None, None)
        for text, mask in zip(("chair", "Tür"), masks, strict=True)
    )
    camera = Camera(torch.eye(4), torch.eye(3), WIDTH, HEIGHT)
    return QueryResult(answers, "relevancy", masks.float(), masks, frame, camera)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_run_lengths_decode_to_the_mask(share):
    mask = np.random.default_rng(0).random((HEIGHT, WIDTH)) < share
    counts = run_lengths(mask)
    assert sum(counts) == mask.size and all(length > 0 for length in counts[1:])
    assert np.array_equal(decoded(counts, HEIGHT, WIDTH), mask)


def test_the_document(tmp_path):
    block = torch.zeros(2, HEIGHT, WIDTH, dtype=torch.bool)
    block[0, 2:5, 3:9] = True
    both = block.clone()
    both[1, -1, -1] = True
    write_coco([view(block), view(both)], ["a.png", "b.png"], tmp_path / "m.json")
    document = json.loads((tmp_path / "m.json").read_text("utf-8"))
    assert [(i["id"], i["file_name"], i["width"], i["height"]) for i in document["images"]] == [
        (1, "a.png", WIDTH, HEIGHT),
        (2, "b.png", WIDTH, HEIGHT),
    ]
    assert [(c["id"], c["name"]) for c in document["categories"]] == [(1, "chair"), (2, "Tür")]
    found = document["annotations"]
    assert [(a["id"], a["image_id"], a["category_id"]) for a in found] == [(1, 1, 1), (2, 2, 1), (3, 2, 2)]
    assert found[0]["bbox"] == [3, 2, 6, 3] and found[0]["area"] == 18
    assert found[2]["bbox"] == [WIDTH - 1, HEIGHT - 1, 1, 1] and found[2]["area"] == 1
    assert all(a["iscrowd"] == 0 and a["segmentation"]["size"] == [HEIGHT, WIDTH] for a in found)
    assert np.array_equal(decoded(found[0]["segmentation"]["counts"], HEIGHT, WIDTH), block[0].numpy())


@pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")  # pycocotools' own
def test_pycocotools_agrees(tmp_path):
    coco_api = pytest.importorskip("pycocotools.coco")
    masks = torch.rand(2, HEIGHT, WIDTH, generator=torch.Generator().manual_seed(0)) > 0.6
    write_coco([view(masks)], ["a.png"], tmp_path / "m.json")
    loaded = coco_api.COCO(str(tmp_path / "m.json"))
    for annotation, mask in zip(loaded.loadAnns(loaded.getAnnIds()), masks, strict=True):
        assert np.array_equal(loaded.annToMask(annotation).astype(bool), mask.numpy())


def test_nothing_found_is_a_document_without_annotations():
    document = coco([view(torch.zeros(2, HEIGHT, WIDTH, dtype=torch.bool))], ["a.png"])
    assert document["annotations"] == [] and len(document["images"]) == 1
