"""What a score means, as the network's own measurement says."""

import pytest

from app.window.asking.reliability import reliability
from langflash_core.language.leads import shipped_leads

ROWS = [{"score": 0.9, "present": 0.6}, {"score": 0.5, "present": 0.1}]


def test_photos_go_before_rooms_and_shares_lie_on_a_line() -> None:
    found = reliability({"reliability": {"rooms": ROWS[:1] * 2, "photos": ROWS}})
    assert found is not None and found.on == "real photos" and found.scores == (0.5, 0.9)
    assert [found.at(s) for s in (0.0, 0.5, 0.7, 0.9, 1.0)] == pytest.approx([0.1, 0.1, 0.35, 0.6, 0.6])


def test_what_was_measured_with_leads_goes_before_the_scenes_own() -> None:
    found = reliability({"reliability": {"photos": ROWS}}, ((0.4, 0.3), (0.8, 0.7)))
    assert found is not None and found.on == "real photos" and found.at(0.6) == pytest.approx(0.5)
    assert reliability({}, ((0.4, 0.3), (0.8, 0.7))) is None


def test_the_shipped_leads_were_measured() -> None:
    rows = shipped_leads().reliability
    found = reliability({"reliability": {"photos": ROWS}}, rows)
    assert found is not None and found.at(0.3) < 0.2 and found.at(0.99) > 0.9


def test_what_nobody_measured_or_what_is_damaged_is_not_told() -> None:
    assert reliability({}) is None and reliability({"reliability": []}) is None
    assert reliability({"reliability": {"photos": [{"score": "high"}]}}) is None
    assert reliability({"reliability": {"photos": [{"score": float("nan"), "present": 1.0}] * 2}}) is None
    found = reliability({"reliability": {"photos": None, "rooms": ROWS}})
    assert found is not None and found.on == "rendered rooms"
