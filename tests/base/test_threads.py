"""How threads wait is settled before torch is loaded, and a person's own setting wins."""

import os
import subprocess
import sys

import pytest

NAMES = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME")
PROGRAM = f"import os, langflash_core; print([os.environ.get(name) for name in {NAMES}])"


def settled(**own: str) -> str:
    """What a fresh process finds in its environment after the import."""
    clean = {key: value for key, value in os.environ.items() if key not in NAMES}
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=clean | own, capture_output=True, text=True, check=True
    )
    return run.stdout.strip()


def test_threads_sleep_unless_the_wait_is_short():
    assert settled() == "['PASSIVE', '3000', None]"


@pytest.mark.parametrize("name", NAMES)
def test_who_has_set_anything_keeps_it_and_nothing_is_added(name):
    expected = [("7" if name == other else None) for other in NAMES]
    assert settled(**{name: "7"}) == str(expected)
