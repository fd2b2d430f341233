"""The n-th call of a kind fails, below our code: where Python asks the system, torch for memory, and moderngl
the driver. None of our own functions is replaced.

    with failing("write", 3, folder, errno.ENOSPC) as fault: ...

`fault.calls` says how many calls of the kind there were; where `fault.failed` is "", there was no third one.
Kinds: `KINDS`. What C libraries read and write by themselves (safetensors maps a checkpoint, ffmpeg writes a
film, OpenUSD a stage) is not seen by "place", "write" and "read"; `small_disk` bounds that by the system.
"""

import builtins
import io
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PLACES = ("open", "os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.truncate", "os.link", "os.symlink")
LOOKS = ("os.listdir", "os.scandir")
KINDS = {
    "place": "make, open to write, rename or remove a file or folder",
    "write": "write into a file, or fsync it",
    "read": "open a file to read, read of it, list a folder",
    "memory": "allocate 1 MiB or more for a tensor of torch",
    "graphics": "make a context, texture, buffer, framebuffer or program of OpenGL",
    "lost": "the same, but from the n-th on every one fails: the context is lost",
}
LARGE = 1 << 20  # bytes of an allocation that counts
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CREATORS = (
    "texture", "texture_array", "texture3d", "buffer", "framebuffer", "simple_framebuffer", "program",
    "vertex_array", "renderbuffer", "sampler",
)  # fmt: skip


@dataclass
class Fault:
    """One failure to come. folders: whose files count. failed: what did fail."""

    kind: str
    nth: int
    folders: tuple[str, ...]
    error: int
    calls: int = 0
    failed: str = ""

    def asks(self, kind: str, what: object, fail: Callable[[str], BaseException]) -> None:
        """A call of a kind comes: count it, and fail where its turn has come."""
        if kind != self.kind and (kind, self.kind) != ("graphics", "lost"):
            return
        self.calls += 1
        if self.calls == self.nth or (self.kind == "lost" and self.calls > self.nth):
            self.failed = self.failed or str(what)
            raise fail(str(what))

    def asks_of(self, kind: str, path: object, what: str) -> None:
        """As `asks`, of a file that may lie in `folders`."""
        if isinstance(path, str | bytes | os.PathLike):
            place = os.path.abspath(os.fsdecode(path))
            if place.startswith(self.folders):
                self.asks(
                    kind, f"{what} {place}", lambda _: OSError(self.error, os.strerror(self.error), path)
                )


_now: Fault | None = None
_listening = False


@contextmanager
def failing(kind: str, nth: int, folder: Path | tuple[Path, ...], error: int = 5) -> Iterator[Fault]:
    """The n-th call of a kind fails inside, counted from 1; of files only those in `folder`.

    Args:
        error: errno of "place", "write" and "read".
    """
    global _now
    if kind not in KINDS:
        raise ValueError(f"kind: expected one of {', '.join(KINDS)}, received {kind!r}")
    folders = (folder,) if isinstance(folder, Path) else folder
    fault = Fault(kind, nth, tuple(str(each.absolute()) for each in folders), error)
    _listen()
    within = {"memory": _memory, "graphics": _graphics, "lost": _graphics}.get(kind)
    with _streams(fault), within(fault) if within else nullcontext():
        _now = fault
        try:
            yield fault
        finally:
            _now = None


# --- files ----------------------------------------------------------------------------------------


def _listen() -> None:
    """Hear of every file that Python opens, makes or moves, before the system does."""
    global _listening
    if not _listening:
        _listening = True
        sys.addaudithook(_heard)


def _heard(event: str, arguments: tuple) -> None:
    fault = _now
    if fault is None or (event not in PLACES and event not in LOOKS):
        return
    if event in LOOKS:
        fault.asks_of("read", arguments[0], event)
    elif event == "open":
        mode, flags = arguments[1] or "", arguments[2] or 0
        writes = set(str(mode)) & set("wax+") or flags & _WRITES
        fault.asks_of("place" if writes else "read", arguments[0], event)
    else:
        fault.asks_of("place", arguments[0], event)


class _Raw(io.FileIO):
    """An open file whose reads and writes count; one that fails has written half, as a full disk has."""

    def write(self, content: Any) -> int:
        if _now is not None:
            try:
                _now.asks_of("write", self.name, "write")
            except OSError:
                super().write(memoryview(content)[: len(content) // 2])
                raise
        return super().write(content)

    def readinto(self, buffer: Any) -> int:
        if _now is not None:
            _now.asks_of("read", self.name, "read")
        return super().readinto(buffer)

    def readall(self) -> bytes:
        if _now is not None:
            _now.asks_of("read", self.name, "read")
        return super().readall()


@contextmanager
def _streams(fault: Fault) -> Iterator[None]:
    """`open` gives files whose reads and writes count, and fsync counts."""
    opened, synced = io.open, os.fsync

    def ours(
        file, mode="r", buffering=-1, encoding=None, errors=None, newline=None, closefd=True, opener=None
    ):
        given = file if isinstance(file, str | bytes | os.PathLike) else None
        if given is None or not os.path.abspath(os.fsdecode(given)).startswith(fault.folders):
            return opened(file, mode, buffering, encoding, errors, newline, closefd, opener)
        raw = _Raw(os.fsdecode(given), mode.replace("b", "").replace("t", ""), closefd, opener)
        if buffering == 0:
            return raw
        kinds = {True: io.BufferedRandom, False: io.BufferedWriter if raw.writable() else io.BufferedReader}
        buffered = kinds["+" in mode](raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, encoding or "utf-8", errors, newline)

    def sync(number: int) -> None:
        fault.asks("write", "fsync", lambda _: OSError(fault.error, os.strerror(fault.error)))
        synced(number)

    io.open = builtins.open = ours
    os.fsync = sync
    try:
        yield
    finally:
        io.open = builtins.open = opened
        os.fsync = synced


@contextmanager
def small_disk(size: int) -> Iterator[None]:
    """No file may grow beyond `size` bytes, whoever writes it: this process, or one that it starts."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)


# --- memory ---------------------------------------------------------------------------------------


def _memory(fault: Fault):
    """Every operation of torch in this thread whose result is new and large."""
    import torch
    from torch.utils._python_dispatch import TorchDispatchMode
    from torch.utils._pytree import tree_leaves

    def places(values: Any) -> dict[int, int]:
        tensors = (each for each in tree_leaves(values) if isinstance(each, torch.Tensor))
        plain = (each for each in tensors if each.layout is torch.strided and each.device.type == "cpu")
        return {each.untyped_storage().data_ptr(): each.untyped_storage().nbytes() for each in plain}

    class Mode(TorchDispatchMode):
        def __torch_dispatch__(self, func, types, args=(), kwargs=None):
            result = func(*args, **(kwargs or {}))
            before = None
            for place, size in places(result).items():
                if size < LARGE:
                    continue
                before = places((args, kwargs)) if before is None else before
                if place not in before:  # the words of torch's own allocator
                    words = (
                        "[enforce fail at alloc_cpu.cpp:127] err == 0. DefaultCPUAllocator: can't allocate "
                        f"memory: you tried to allocate {size} bytes. Error code 12 (Cannot allocate memory)"
                    )
                    fault.asks("memory", f"torch {func}", lambda _, words=words: RuntimeError(words))
            return result

    return Mode()


# --- OpenGL ---------------------------------------------------------------------------------------


@contextmanager
def _graphics(fault: Fault) -> Iterator[None]:
    """What moderngl raises where the driver gives no object, or a program does not compile."""
    import moderngl

    def guarded(name: str, call: Callable) -> Callable:
        def asked(*args, **kwargs):
            fault.asks("graphics", name, lambda what: moderngl.Error(f"cannot create {what}"))
            return call(*args, **kwargs)

        return asked

    kept = {name: getattr(moderngl.Context, name) for name in _CREATORS}
    made = moderngl.create_context
    for name, call in kept.items():
        setattr(moderngl.Context, name, guarded(name, call))
    moderngl.create_context = guarded("context", made)
    try:
        yield
    finally:
        for name, call in kept.items():
            setattr(moderngl.Context, name, call)
        moderngl.create_context = made
