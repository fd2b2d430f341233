"""This side: `ask` a reader in a process of its own, and get what it read part by part.

A process serves one request after another, so that many photos start as many processes as read at once. It is
used again only after a request that ended well: one that refused a file, was left early or broke is ended.
"""

import atexit
import json
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from langflash_core.base.apart.serving import HEADER, OUT_OF_MEMORY, READERS
from langflash_core.base.limits import MEMORY, SECONDS

_ROOT = str(Path(__file__).resolve().parents[3])
_BOOT = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from langflash_core.base.apart.serving import serve; "
    "serve(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))"
)
_KINDS = "uif"  # of arrays: unsigned, signed, floating
_MOST_HEADER = 1 << 20  # bytes of what an answer says besides its arrays
_MOST_IDLE = 4  # processes of one reader that wait for the next request
_PIPE = 1 << 20  # bytes that a pipe holds where that can be said; Linux gives 64 KB unasked


@dataclass(frozen=True)
class Part:
    """One answer. facts: plain JSON values. arrays: by name, writable."""

    facts: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict)


class Refused(Exception):
    """The reader says what is wrong with the file; one line."""


class Ended(Exception):
    """The reader's process is gone or was ended; why, as half a sentence that "its reader" may begin."""


def ask(reader: str, request: Mapping[str, Any], content: bytes = b"") -> Generator[Part, None, None]:
    """What a reader answers, part by part; closing the iterator early ends its process.

    Args:
        reader: a name of `serving.READERS`. request: plain JSON values. content: bytes of a file, for readers
            that take these instead of a path.

    Raises:
        Refused: the file is no good. Ended: it broke, took too long, or wanted too much memory.
    """
    worker = _send_request(reader, request, content)
    try:
        try:
            part = worker.answer()
        except Ended:
            if not worker.served:
                raise
            worker.end()  # what it read before may have broken it
            worker = _send_request(reader, request, content, new=True)
            part = worker.answer()
        while part is not None:
            yield part
            part = worker.answer()
    except BaseException:
        worker.end()
        raise
    _keep(worker)


class _Worker:
    """A process with one of the readers' modules, and the two pipes to it."""

    def __init__(self, module: str) -> None:
        self.module = module
        path = [*dict.fromkeys(entry for entry in (*sys.path, _ROOT) if entry)]
        words = (json.dumps(path), module, str(MEMORY.value), str(SECONDS.value))
        self.bounds = MEMORY.value, SECONDS.value
        self.served, self._late = False, False
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", _BOOT, *words],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )  # fmt: skip
        assert self._process.stdin is not None and self._process.stdout is not None
        self._to, self._from = self._process.stdin, self._process.stdout
        _widen(self._from.fileno())

    @property
    def fit(self) -> bool:
        """Whether it runs, under the limits of now."""
        return self._process.poll() is None and self.bounds == (MEMORY.value, SECONDS.value)

    def send(self, reader: str, request: Mapping[str, Any], content: bytes) -> None:
        """Raises:
        OSError: it is gone.
        """
        head = json.dumps({"reader": reader, "request": dict(request), "size": len(content)}).encode()
        for part in (HEADER.pack(len(head)), head, content):
            view = memoryview(part)
            while view:
                view = view[self._to.write(view) :]

    def answer(self) -> Part | None:
        """The next part; None after the last.

        Raises:
            Refused, Ended: as `ask`.
        """
        with self._in_time():
            (size,) = HEADER.unpack(self._bytes(HEADER.size))
            if size > _MOST_HEADER:
                raise Ended("answered what cannot be true")
            try:
                head = json.loads(bytes(self._bytes(size)))
                kind, facts, described = head["kind"], dict(head["facts"]), list(head["arrays"])
                if kind == "part":
                    return Part(facts, dict(self._array(*one) for one in described))
            except (ValueError, TypeError, KeyError, AttributeError) as error:
                raise Ended("answered what cannot be true") from error
        if kind == "end":
            return None
        raise Refused(" ".join(str(facts.get("said", "it cannot be read")).split())[:300])

    def end(self) -> int:
        """Stop it for good; the code it ended with. May be called again."""
        with suppress(OSError):
            self._process.kill()
        code = self._process.wait()
        for stream in (self._to, self._from):
            with suppress(OSError):
                stream.close()
        return code

    @contextmanager
    def _in_time(self) -> Iterator[None]:
        """It is killed where it does not answer soon enough: a file can make a reader wait for ever."""
        timer = threading.Timer(self.bounds[1], self._expire)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _expire(self) -> None:
        self._late = True
        with suppress(OSError):
            self._process.kill()

    def _array(self, name: str, kind: str, shape: list[int]) -> tuple[str, np.ndarray]:
        dtype = np.dtype(str(kind))
        sides = [int(side) for side in shape]
        size = math.prod(sides) * dtype.itemsize
        if dtype.kind not in _KINDS or min(sides, default=0) < 0 or size > self.bounds[0]:
            raise ValueError("no array")
        values = np.empty(sides, dtype)
        self._fill(values.reshape(-1).view(np.uint8).data)
        return str(name), values

    def _bytes(self, size: int) -> bytearray:
        content = bytearray(size)
        self._fill(memoryview(content))
        return content

    def _fill(self, view: memoryview) -> None:
        """Raises:
        Ended: nothing comes any more.
        """
        while view:
            got = self._from.readinto(view)  # type: ignore[attr-defined] - a raw stream, since bufsize is 0
            if not got:
                raise Ended(self._reason())
            view = view[got:]

    def _reason(self) -> str:
        """Why it is gone."""
        if not self._late:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(5)  # it closed the pipe and may be on its way out
        code = self.end()
        if self._late or code == -getattr(signal, "SIGXCPU", 0):
            return f"took longer than {SECONDS.told()}; {SECONDS.remedy()}"
        if code == OUT_OF_MEMORY:
            return f"wanted more than {MEMORY.told()} of memory; {MEMORY.remedy()}"
        if code < 0:
            with suppress(ValueError):
                return f"crashed ({signal.Signals(-code).name})"
        return f"crashed (code {code})"


_idle: dict[str, list[_Worker]] = {}
_lock = threading.Lock()


def _send_request(reader: str, request: Mapping[str, Any], content: bytes, new: bool = False) -> _Worker:
    """A process that has the request: one that waits and served before, else a new one.

    Raises:
        Ended: it could not be started, or broke at once.
    """
    module = READERS[reader]
    while True:
        with _lock:
            waiting = [] if new else _idle.get(module, [])
            worker = waiting.pop() if waiting else None
        try:
            worker = _Worker(module) if worker is None else worker
        except OSError as error:
            raise Ended(f"could not be started ({error.strerror})") from error
        if worker.served and not worker.fit:
            worker.end()
            continue
        try:
            worker.send(reader, request, content)
            return worker
        except OSError:
            code = worker.end()
            if not worker.served:
                raise Ended(f"crashed (code {code})") from None


def _keep(worker: _Worker) -> None:
    worker.served = True
    with _lock:
        waiting = _idle.setdefault(worker.module, [])
        if len(waiting) < _MOST_IDLE:
            waiting.append(worker)
            return
    worker.end()


@atexit.register
def end_idle() -> None:
    """End the processes that wait."""
    with _lock:
        workers = [worker for waiting in _idle.values() for worker in waiting]
        _idle.clear()
    for worker in workers:
        worker.end()


def _forget() -> None:
    """A forked child owns none of its parent's processes."""
    global _lock
    _lock = threading.Lock()
    _idle.clear()


def _widen(pipe: int) -> None:
    if sys.platform == "linux":
        import fcntl

        with suppress(OSError):
            fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
