"""What `frames.py` watches exists: a name that is gone would count as no time at all."""

from functools import reduce
from importlib import import_module

from tests.tools.watched import WATCHED


def test_everything_that_is_watched_is_there() -> None:
    for module, names in WATCHED.items():
        for name in names:
            assert reduce(getattr, name.split("."), import_module(module)), f"{module}.{name}"
