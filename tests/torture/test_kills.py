"""A few kills of each kind here, 1,400 of them by `python -m tests.torture kills --count 1000`."""

import random
import sys

import pytest

from tests.torture import kills

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="copies of a process, and signals")


@pytest.mark.filterwarnings("ignore:This process")  # threads of torch's, which the copy does not use
def test_a_few_kills_lose_nothing(own):
    rng = random.Random(3)
    rows = [*kills.writing(own, 20, rng), kills.recovering(2, rng, False), kills.recovering(2, rng, True)]
    assert [row.finds for row in rows] == [[]] * len(rows)
    assert sum(row.count for row in rows) == 24 and sum(row.inside for row in rows) > 12


@pytest.mark.filterwarnings("ignore:This process")
def test_a_torn_file_would_be_found(own):
    """What writes without care is caught."""
    path, finds = own / "a", 0

    def careless(say):
        say(0)
        for _ in range(10_000):
            path.write_bytes(b"x" * 2_000_000)

    for number in range(20):
        done, inside = kills.killed(careless, 0.002 * number)
        assert done == [0] and inside
        finds += path.stat().st_size != 2_000_000 if path.exists() else 0
    assert finds > 0
