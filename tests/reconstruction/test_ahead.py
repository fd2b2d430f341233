"""What is begun beside a reconstruction ends with it."""

import time
import weakref

import numpy as np
import pytest

from langflash_core.base.resources import asset_path
from langflash_core.cameras import keypoints
from langflash_core.errors import Cancelled
from langflash_core.reconstruction import ahead

PHOTOS = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]


def test_what_is_ended_stops_at_the_next_photo_and_holds_nothing(monkeypatch) -> None:
    held, photos = [], []

    def detect(grey, limit):
        found = np.zeros((limit, 2))
        held.append(weakref.ref(found))
        photos.append(grey)
        begun.ended.wait(60)  # it is ended while the first photo is under way
        return found, found

    monkeypatch.setattr(keypoints, "detect", detect)
    begun = ahead.begin(PHOTOS, read_weights=False)
    begun.check_photos()
    while not photos:
        time.sleep(0.002)
    begun.end()
    assert len(photos) == 1
    with pytest.raises(Cancelled):
        begun.matched.result()
    assert held[0]() is None  # though the task still has the error, with its frames


def test_what_has_come_to_its_end_is_there_after_it() -> None:
    begun = ahead.begin(PHOTOS, read_weights=False)
    found = begun.matched.result()
    begun.end()
    assert begun.matched.result() is found
    assert len(begun.pictures.result()) == 2
