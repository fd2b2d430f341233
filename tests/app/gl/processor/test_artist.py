"""The thread that draws beside the window: the newest order alone counts."""

import threading
import time

import pytest

from app.gl.processor.artist import Artist
from langflash_core.errors import Cancelled

PATIENCE = 20.0


@pytest.fixture
def told() -> threading.Semaphore:
    return threading.Semaphore(0)


@pytest.fixture
def artist(told):
    made = Artist(told.release)
    yield made
    made.stop()


def test_what_is_ordered_is_done_once(artist: Artist, told) -> None:
    artist.order("a", lambda stopping: 1)
    assert told.acquire(timeout=PATIENCE)
    assert artist.take() == ("a", 1) and artist.take() is None and not artist.busy


def test_a_new_order_stops_the_one_before(artist: Artist, told) -> None:
    begun, stopped = threading.Event(), threading.Event()

    def long(stopping):
        begun.set()
        end = time.monotonic() + PATIENCE
        while not stopping() and time.monotonic() < end:
            time.sleep(0.001)
        stopped.set()
        raise Cancelled("no longer wanted")

    artist.order("old", long)
    assert begun.wait(PATIENCE)
    artist.order("old", long)  # the same again changes nothing
    assert artist.busy and not stopped.is_set()
    artist.order("new", lambda stopping: 2)
    assert told.acquire(timeout=PATIENCE) and artist.take() == ("new", 2)
    assert stopped.is_set()


def test_what_is_dropped_never_comes(artist: Artist, told) -> None:
    go = threading.Event()
    artist.order("a", lambda stopping: go.wait(PATIENCE))
    artist.drop()
    go.set()
    artist.order("b", lambda stopping: 3)
    assert told.acquire(timeout=PATIENCE) and artist.take() == ("b", 3)


def test_a_failure_leaves_the_thread_alive(artist: Artist, told) -> None:
    artist.order("bad", lambda stopping: 1 / 0)
    assert told.acquire(timeout=PATIENCE) and artist.take() == ("bad", None)
    artist.order("good", lambda stopping: 4)
    assert told.acquire(timeout=PATIENCE) and artist.take() == ("good", 4)
