"""A thread that works for the picture beside the window: one order at a time, the newest alone counts.

Still pictures and their answers take a machine without a graphics card a second or two. Here no frame waits
for them, and what is no longer wanted stops at the next of its steps.
"""

import logging
import os
import sys
import threading
from collections.abc import Callable, Hashable
from contextlib import suppress
from typing import Any

from langflash_core.errors import Cancelled

log = logging.getLogger(__name__)

Stopping = Callable[[], bool]
Work = Callable[[Stopping], Any]
_NICE = 10  # below the window's own threads, which share the processor


class Artist:
    """`order` and `take` return at once. `notify` is called, from the thread, when an order is done."""

    def __init__(self, notify: Callable[[], None]) -> None:
        self._notify = notify
        self._changed = threading.Condition()
        self._wanted: tuple[Hashable, Work] | None = None
        self._done: tuple[Hashable, Any] | None = None
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name="langflash-artist", daemon=True)
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether an order is under way."""
        return self._wanted is not None

    def order(self, name: Hashable, work: Work) -> None:
        """Do this next, instead of whatever was ordered before; nothing where it is on its way."""
        with self._changed:
            ordered = self._wanted or self._done
            if ordered is None or ordered[0] != name:
                self._wanted, self._done = (name, work), None
                self._changed.notify()

    def drop(self) -> None:
        """Nothing is wanted any more."""
        with self._changed:
            self._wanted = self._done = None

    def take(self) -> tuple[Hashable, Any] | None:
        """What was ordered last, by name, once it is done; None for a result where it failed."""
        with self._changed:
            done, self._done = self._done, None
            return done

    def stop(self, patience: float = 2.0) -> None:
        """End the thread; may be called twice."""
        with self._changed:
            self._stopping, self._wanted = True, None
            self._changed.notify()
        self._thread.join(patience)

    def _run(self) -> None:
        if sys.platform == "linux":
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._wanted is not None)
                if self._stopping:
                    return
                wanted = self._wanted
            assert wanted is not None
            result = self._made(wanted)
            with self._changed:
                current = self._wanted is wanted
                if current:
                    self._wanted, self._done = None, (wanted[0], result)
            del wanted, result  # a picture and its scene, while this thread waits
            if current:
                self._notify()

    def _made(self, wanted: tuple[Hashable, Work]) -> Any:
        try:
            return wanted[1](lambda: self._wanted is not wanted)
        except Cancelled:
            return None
        except Exception:  # the picture that is on show stays
            log.exception("a still picture could not be drawn")
            return None
