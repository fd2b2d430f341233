"""Everything that can be exported says what it is."""

from app.window.exporting.panel import HINTS
from app.window.exporting.state import What


def test_every_choice_has_its_sentence():
    assert set(HINTS) == set(What)
