"""Objects keep their numbers from frame to frame, and who comes late gets one, too."""

import numpy as np
import pytest

from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.collecting import Rules, collect
from langflash_core.lab.labels.following import MotionPropagator
from langflash_core.lab.labels.motion import by_flow
from langflash_core.lab.labels.protocols import Proposals
from tests.lab.labels.painted import ENTERS, FRAMES, Counting, Knowing, painted_clip


@pytest.fixture(scope="module")
def found():
    clip, true = painted_clip()
    labels = collect(clip, Knowing(clip, true), MotionPropagator(by_flow), Counting())
    return labels, true


def fits(labels, true: np.ndarray, id: int) -> tuple[int, np.ndarray]:
    """The one number that fits a true thing best over the clip, and its IoU where the thing is in sight."""
    numbers = [row.id for row in labels.objects]
    ious = np.array([[_iou(labels.ids[t] == n, true[t] == id) for t in range(len(true))] for n in numbers])
    best = int(ious.mean(1).argmax())
    return numbers[best], ious[best][(true == id).sum((1, 2)) > 300]


def _iou(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / max((a | b).sum(), 1))


@pytest.mark.parametrize("id", [2, 3])
def test_what_is_there_from_the_start_keeps_its_number_and_its_shape(found, id):
    labels, true = found
    _, ious = fits(labels, true, id)
    # Flow rounds each border by up to a pixel; a thing of 30 x 34 loses a tenth so.
    assert ious.mean() > 0.75


def test_what_comes_late_is_caught_within_a_look_and_grows_as_it_comes(found):
    labels, true = found
    number, ious = fits(labels, true, 4)
    row = labels.objects[number - 1]
    assert 0 < row.first <= ENTERS + Rules().look_every
    assert ious[-3:].mean() > 0.75  # by then it is all in sight


def test_no_two_things_share_a_number_and_repetitions_and_parts_get_none(found):
    labels, true = found
    assert len({fits(labels, true, id)[0] for id in (1, 2, 3, 4)}) == 4
    assert (
        len(labels.objects) <= 5
    )  # four, and at most one piece of the wall that came in with the last thing


def test_vectors_are_unit_and_objects_in_order_of_appearance(found):
    labels, _ = found
    assert np.allclose(np.linalg.norm(labels.vectors, axis=1), 1, atol=1e-6)
    firsts = [row.first for row in labels.objects]
    assert firsts == sorted(firsts) and [row.id for row in labels.objects] == list(range(1, len(firsts) + 1))
    assert all(0.9 < row.agreement <= 1 + 1e-9 for row in labels.objects)  # colours hardly change


def test_a_clip_in_which_nothing_is_found_has_no_objects():
    clip, _ = painted_clip()

    class Blind:
        def propose(self, image, where=None):
            return Proposals(np.zeros((0, *image.shape[:2]), bool), np.zeros(0))

    labels = collect(clip.part(0, 3, 1), Blind(), MotionPropagator(by_flow), Counting())
    assert labels.ids.max() == 0 and labels.vectors.shape == (0, 3) and labels.coverage.tolist() == [0, 0, 0]


def test_a_clip_of_one_frame_keeps_what_is_in_it():
    clip, true = painted_clip()
    labels = collect(clip.part(0, 1, 1), Knowing(clip, true), MotionPropagator(by_flow), Counting())
    assert len(labels.objects) == 3


def test_frames_are_asked_for_in_order_and_few_are_kept():
    clip, true = painted_clip()
    read: list[int] = []
    counted = Clip(clip.name, clip.ids, lambda t: (read.append(t), clip.read(t))[1])
    collect(counted, Knowing(clip, true), MotionPropagator(by_flow), Counting())
    assert read == list(range(FRAMES))  # each once: whoever asks again gets what is held
