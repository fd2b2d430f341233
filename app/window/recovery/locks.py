"""Locks of files that the system opens when their process dies, however it dies."""

import errno
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO

from langflash_core.errors import OutputError

_PATIENCE = 2.0  # seconds for another window's write, which takes milliseconds
_HELD = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)  # what systems say where another has it
_NO_LOCKS = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)  # of some network drives


def locked(path: Path) -> BinaryIO:
    """A lock file, held until it is closed or the process ends.

    Raises:
        OutputError: another process holds it, or it cannot be written.
    """
    with ExitStack() as opened:
        try:
            stream = opened.enter_context(path.open("wb", buffering=0))
            stream.write(b"\0")
            _lock(stream)
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
        opened.pop_all()
    return stream


def is_free(path: Path) -> bool:
    """Whether nobody holds a lock file."""
    try:
        with path.open("r+b") as stream:
            _lock(stream)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return True


@contextmanager
def one_at_a_time(path: Path) -> Iterator[None]:
    """Inside, no other window gets past this with the same lock file; where a drive has no locks, all do.

    Raises:
        OutputError: another one does not leave, or the file cannot be written.
    """
    with ExitStack() as opened:
        try:
            stream = opened.enter_context(path.open("ab", buffering=0))
            _wait(stream)
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror or error}; try again") from error
        yield


def _wait(stream: BinaryIO) -> None:
    """
    Raises:
        OSError: another process holds it for too long.
    """
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            return _lock(stream)
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return None
            if error.errno not in _HELD or time.monotonic() > end:
                raise
        time.sleep(0.005)


def _lock(stream: BinaryIO) -> None:
    """Without waiting.

    Raises:
        OSError: another process holds it.
    """
    if sys.platform == "win32":
        import msvcrt

        stream.seek(0)
        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
