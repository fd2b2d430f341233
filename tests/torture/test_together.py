"""Two programs at once, once each; 20 times by `python -m tests.torture together`."""

import contextlib
import random
import sys
import time

import pytest

from app.window.recovery import preferences
from app.window.scene.work import LoadScene
from langflash_core.errors import SceneFileError
from tests.torture import together

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="copies of a process"),
    pytest.mark.filterwarnings("ignore:This process"),  # threads of torch's, which the copy does not use
]


def test_two_programs_lose_nothing(own):
    rng = random.Random(1)
    finds = together.saves(own, rng) + together.settings(own, rng) + together.taught(rng)
    finds += together.one_scene(own, rng) + together.both_recover(rng)
    assert finds == []


def test_two_windows_that_die_together_are_both_had_back(own):
    assert together.windows(random.Random(1)) == []


def test_what_another_window_has_taken_over_is_a_sentence(own):
    kept = LoadScene(own / "a.langflash", own / "a.edits")
    with pytest.raises(SceneFileError, match="another window is using it"):
        kept.run(1, lambda *_: None, lambda: False)


def test_what_is_lost_without_a_lock_would_be_found(own, monkeypatch):
    monkeypatch.setattr(preferences, "one_at_a_time", lambda _: contextlib.nullcontext())
    merged = preferences.merged

    def slowly(*of):
        time.sleep(0.01)  # between reading and writing: on two processors the other one comes between
        return merged(*of)

    monkeypatch.setattr(preferences, "merged", slowly)
    assert any(together.settings(own, random.Random(number)) for number in range(12))
