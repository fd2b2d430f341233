"""A rendered clip has the truth it is judged by; the truth judged by itself is perfect."""

from dataclasses import replace

import numpy as np
import pytest

from langflash_core.lab.evaluation.clips import (
    LATE,
    SHOWS,
    STRUCTURE,
    TrueClip,
    clips_markdown,
    clips_result,
    judged,
    rendered_clip,
)
from langflash_core.lab.labels.storage import ClipLabels, ObjectRow
from langflash_core.lab.rooms import RoomRenderer, load_pack
from langflash_core.lab.rooms.catalogue import HELD_OUT_LIBRARIES
from tests.lab.labels.painted import painted_clip
from tests.lab.rooms.conftest import TINY_PACK


@pytest.fixture(scope="module")
def painted() -> TrueClip:
    """The painted clip; its wall becomes structure and its things come after it."""
    clip, ids = painted_clip()
    names = ("", "wall", "floor", "ceiling", "mat", "box", "late box")
    table = np.array([0, 1, STRUCTURE + 1, STRUCTURE + 2, STRUCTURE + 3], np.uint16)
    return TrueClip(clip, table[ids], names)


def test_the_truth_judged_by_itself_is_perfect(painted):
    scores = judged(painted, painted.ids)
    assert [score.name for score in scores] == ["mat", "box", "late box"]
    assert all(score.iou == 1 and score.constant == 1 and score.found for score in scores)
    assert [score.late for score in scores] == [False, False, True]
    assert [score.delay for score in scores] == [0, 0, 0]


def test_an_id_that_changes_in_the_middle_counts_for_half(painted):
    ids = painted.ids.copy()
    half = len(ids) // 2
    ids[half:][ids[half:] == STRUCTURE + 1] = 99
    (mat, *_) = judged(painted, ids)
    assert 0.4 < mat.iou < 0.7 and mat.constant < 0.7


def test_an_id_that_another_thing_has_is_not_counted_twice(painted):
    ids = np.where(painted.ids > STRUCTURE, 5, 0).astype(np.uint16)  # no other id is left over
    assert sum(score.iou > 0 for score in judged(painted, ids)) == 1


def test_nothing_collected_is_nothing_found(painted):
    assert all(s.iou == 0 and s.delay is None for s in judged(painted, np.zeros_like(painted.ids)))


def test_a_rendered_clip_knows_what_each_pixel_shows():
    pack = load_pack(TINY_PACK)
    items = tuple(replace(item, library=HELD_OUT_LIBRARIES[0]) for item in pack.items)
    pack = replace(pack, items=items)
    with RoomRenderer(pack) as renderer:
        found = (rendered_clip(seed, pack, renderer, (72, 96), 8) for seed in range(20))
        truth = next(clip for clip in found if clip is not None)
    assert truth.ids.shape == (8, 72, 96) and truth.clip.read(7).shape == (72, 96, 3)
    assert truth.clip.viewmats is not None and truth.clip.Ks is not None
    turned = truth.clip.viewmats[0, :3, :3] @ truth.clip.viewmats[-1, :3, :3].T
    assert float(turned.trace()) < 3 - 1e-6  # radians squared: the camera turned
    assert all(truth.shares(id).max() >= SHOWS for id in truth.things) and LATE < 8
    assert all(truth.names[id] for id in truth.things)


def test_tables_say_what_was_found(painted):
    rows = tuple(ObjectRow(n, 0, 12, 9, 0.9, 1, 1.0) for n in range(1, STRUCTURE + 4))
    vectors = np.zeros((len(rows), 3), np.float32)
    labels = ClipLabels("painted", painted.clip.ids, painted.ids, rows, vectors, "minilm", {"total": 6.0})
    result = clips_result([(labels, judged(painted, painted.ids))])
    (clip,) = result["clips"]
    assert (clip["found"], clip["late_found"], clip["iou"], clip["frames_per_second"]) == (3, 1, 1.0, 2.0)
    table = clips_markdown(result)
    assert "| painted | 3 of 3 | 1 of 1 | 1.000 | 100% |" in table and "late box, comes in late" in table
    nothing = clips_result([(labels, judged(painted, np.zeros_like(painted.ids))), (labels, [])])
    assert [clip["constant"] for clip in nothing["clips"]] == [None, None]  # of nothing found
    assert [clip["iou"] for clip in nothing["clips"]] == [0, None] and nothing["iou"] == 0
    assert "| painted | 0 of 0 | 0 of 0 | - | - |" in clips_markdown(nothing)
