"""What a long session no longer needs goes back to the system; how much was held, and which errors say that
there is no more.

Giving back works with the GNU C library alone: elsewhere memory is kept and given back in the system's own
way.
"""

import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_SAID = ("not enough memory", "can't allocate memory", "out of memory", "insufficient memory", "bad_alloc")
_MMAP_THRESHOLD, _TRIM_THRESHOLD, _ARENA_MAX = -3, -1, -8  # M_* of malloc.h
LARGE_BYTES = 4 << 20
"""From here on an array has pages of its own, which go with it.

By itself the library would raise this border, up to 32 MB, with every larger array that is gone: others would
then lie between small things that stay, and hold the pages around them. After two rounds of opening, merging,
resizing and asking that was 479 MB in place of 437 (private memory). A smaller border costs time: still
pictures of 12,300 Gaussians at 640 x 480 take 2 % more of the processor with 4 MB, 11 % with 1 MB (400 MB
then), 24 % with 256 KB.
"""

COPIES = 2
"""Of all numbers, at most, while a file is opened: 10 million took 1.0 GB for 0.56 of their own."""


def keep_tidy() -> None:
    """From here on every large array has pages of its own, and what one thread gives back serves the others;
    before any thread or array is made.

    By itself the library gives each thread its own arena, up to eight per core, each with holes of its own: a
    window under random hands gained 59 MB within two and a half minutes, and 7 with one arena, which were
    asked for. Pictures at rest, drawn by two threads, take the same time.
    """
    _call("mallopt", _ARENA_MAX, 1)
    _call("mallopt", _MMAP_THRESHOLD, LARGE_BYTES)
    _call("mallopt", _TRIM_THRESHOLD, 2 * LARGE_BYTES)


def give_back() -> None:
    """Return what is free between things that stay: five reconstructions in a row kept 500 MB more than one.

    Tensors that nobody holds are gone without Python's collector, which would stop the window for a while.
    """
    _call("malloc_trim", 0)


def peak_memory_mb() -> int | None:
    """The most memory that this process has held so far, in MB; None where it cannot be asked."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024  # bytes there, KiB on Linux
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6)


def free_memory() -> int | None:
    """Bytes that this process can still have, by the system or a limit set to it; None where neither says."""
    known = [*_left_of_limits()]
    with suppress(OSError, IndexError, ValueError):
        lines = Path("/proc/meminfo").read_text().splitlines()
        known += [1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]
    return min(known, default=None)


def _left_of_limits() -> Iterator[int]:
    """What is left of the limits to a process's memory (ulimit -v and -d), bytes; Linux says what is used."""
    if sys.platform != "linux":
        return
    import resource

    with suppress(OSError, IndexError, ValueError):
        pages = Path("/proc/self/statm").read_text().split()
        for limit, used in ((resource.RLIMIT_AS, pages[0]), (resource.RLIMIT_DATA, pages[5])):
            most = resource.getrlimit(limit)[0]
            if most != resource.RLIM_INFINITY:
                yield max(0, most - int(used) * resource.getpagesize())


def told_bytes(count: int) -> str:
    """ "14.6 MB", or "1.5 GB"."""
    return f"{count / 1e9:,.1f} GB" if count >= 1e9 else f"{count / 1e6:,.1f} MB"


def check_room(gaussians: int, size: int, name: str, error: type[Exception]) -> None:
    """Before a file is opened: where memory runs out on the way, the system may end the program.

    Args:
        size: bytes that so many Gaussians are once they are opened. name: of the file.

    Raises:
        error: they do not fit into the memory that is free.
    """
    needed, free = COPIES * size, free_memory()
    if free is not None and needed > free:
        sizes = f"take {needed / 1e9:.1f} GB to open, and {max(free, 0) / 1e9:.1f} GB are free"
        raise error(
            f"{name} says that it holds {gaussians:,} Gaussians: they {sizes}; close other programs, or open "
            "it where there is more memory"
        )


def out_of_memory(error: BaseException) -> bool:
    """Whether an error says that memory has run out; torch and OpenCV have no class of their own for it."""
    words = str(error).lower()
    return isinstance(error, MemoryError) or any(said in words for said in _SAID)


def _call(name: str, *arguments: int) -> None:
    if sys.platform == "linux":
        import ctypes

        with suppress(OSError, AttributeError):
            getattr(ctypes.CDLL(None), name)(*arguments)
