"""Two scenes of one room that lie on each other."""

import numpy as np
import pytest

from langflash_core.inventory import beside
from langflash_core.inventory.alignment import Fit

SAME = Fit(np.eye(3), 1.0, np.zeros(3), 40, 50)


@pytest.fixture
def aligned(monkeypatch) -> None:
    """Nobody has to find out how."""
    monkeypatch.setattr(beside, "align_scenes", lambda first, second, render: SAME)
