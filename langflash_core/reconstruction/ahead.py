"""The parts of a reconstruction that need no torch, begun before torch is imported.

Importing torch takes one processor longer than the network then takes both. Meanwhile the others read
the photos, match them and read the weights. This module and what it imports know numpy alone.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from traceback import clear_frames
from typing import Any

from langflash_core.base.keeping import MATCHES, Arrays, Keep, not_kept
from langflash_core.base.running import Kept
from langflash_core.errors import Cancelled, InputError, WeightsError
from langflash_core.images.pictures import Picture, read_pictures
from langflash_core.network.checkpoints.stored import Stored, read_header, read_stored, weights_file
from langflash_core.network.presets import PRESETS, GuidedDepth

SIZES = (56, 1024)  # pixels: below, the encoder's grid is 4 patches; above, attention's memory runs away
_WORKERS = 3  # at most; one processor stays with the import


@dataclass(frozen=True)
class Ahead:
    """What is under way: the photos, their key points as arrays where the preset matches photos, and the file
    of weights, where it was asked for. gone_on: steps that an earlier run kept, once they are used."""

    pictures: Future[list[Picture]]
    matched: Future[Arrays | None]
    stored: Future[Stored] | None
    matching: "Matching" = field(default_factory=lambda: Matching())
    ended: Event = field(default_factory=Event)
    gone_on: list[str] = field(default_factory=list)

    def end(self) -> None:
        """What is still under way stops at its next photo or pair; returns when it has.

        An error that was raised from a task holds frames that hold the task: what they hold goes here, not
        when Python's collector comes by.
        """
        self.ended.set()
        tasks: list[Future[Any]] = [self.pictures, self.matched, *([self.stored] if self.stored else [])]
        wait(tasks)
        for error in filter(None, (task.exception() for task in tasks)):
            clear_frames(error.__traceback__)

    def check_photos(self) -> None:
        """Wait until the photos are read.

        Raises:
            ImageError, InputError: one cannot be used.
        """
        self.pictures.result()

    def with_keypoints(self, kept: Kept, sources: tuple[bytes, ...]) -> Kept:
        """`kept`, but for the key points of these photos, where they are those that were matched here."""
        found = self.matched.result()
        if found is None or sources != _sources(self.pictures):
            return kept
        return lambda name, make: found if name == MATCHES else kept(name, make)


@dataclass
class Matching:
    """How far key points and matches are: what is being done, how much of it was, of how much."""

    what: str = "weights"
    done: int = 0
    count: int = 0

    def tell(self, what: str, done: int, count: int) -> None:
        """From the thread that matches."""
        self.what, self.done, self.count = what, done, count

    def __str__(self) -> str:
        return f"{self.what}: {self.done + 1} of {self.count}" if self.count else self.what

    @property
    def share(self) -> float:
        """Of what is being done; key points and matches are a half each."""
        half = 0.5 * self.done / max(self.count, 1)
        return half + (0.5 if self.what.startswith("matching") else 0.0)


def begin(
    photos: Sequence[Path | str],
    *,
    preset: str = "mini",
    weights: Path | str | None = None,
    size: int | None = None,
    read_weights: bool = True,
    check: Callable[[], None] = lambda: None,
    keep: Path | None = None,
) -> Ahead:
    """Start on a reconstruction; arguments as `pipeline.reconstruct` has them.

    Args:
        read_weights: also read the checkpoint, of presets that keep theirs in one file.
        check: called between photos and pairs; what it raises ends the work.
        keep: a folder where matches are kept, and those of an earlier run are; None: nowhere.

    Raises:
        WeightsError: there is no such preset, or the checkpoint's header cannot be read.
        InputError: the size is out of range.
    """
    if preset not in PRESETS:
        raise WeightsError(f"there is no preset '{preset}'; choose one of {', '.join(PRESETS)}")
    chosen = PRESETS[preset]
    area = chosen.native_area if size is None else _area(size)
    matches, stored = isinstance(chosen, GuidedDepth), None
    ended = Event()

    def going_on() -> None:
        check()
        if ended.is_set():
            raise Cancelled("the reconstruction has ended without it")

    pool = ThreadPoolExecutor(
        min(_WORKERS, max(1, (os.cpu_count() or 1) - 1)), thread_name_prefix="langflash-ahead"
    )
    pictures = pool.submit(
        read_pictures, photos, area=area, multiple=chosen.patch, square=chosen.square, check=going_on
    )
    if read_weights and matches:
        path = weights_file(preset, None if weights is None else Path(weights))
        read_header(path)
        stored = pool.submit(_store_sources, pictures, path)
    matching, gone_on = Matching(), list[str]()
    matched = pool.submit(_match, pictures, going_on, matching, keep, gone_on) if matches else _nothing()
    pool.shutdown(wait=False)
    return Ahead(pictures, matched, stored, matching, ended, gone_on)


def _store_sources(pictures: Future[list[Picture]], path: Path) -> Stored:
    """After the photos, so that an error about one of them need not wait for the end of this."""
    pictures.result()
    return read_stored(path)


def _match(
    pictures: Future[list[Picture]],
    check: Callable[[], None],
    matching: Matching,
    keep: Path | None,
    gone_on: list[str],
) -> Arrays | None:
    from langflash_core.cameras.keypoints import match_sources  # OpenCV

    sources = _sources(pictures)
    kept = not_kept if keep is None else Keep.of(keep, {}, sources, gone_on)
    return kept(MATCHES, lambda: match_sources(sources, check, matching.tell).arrays())


def _sources(pictures: Future[list[Picture]]) -> tuple[bytes, ...]:
    return tuple(picture.source for picture in pictures.result())


def _nothing() -> Future[Arrays | None]:
    done: Future[Arrays | None] = Future()
    done.set_result(None)
    return done


def _area(size: int) -> int:
    low, high = SIZES
    if not low <= size <= high:
        raise InputError(f"the size {size} is out of range; choose {low} to {high} pixels")
    return int(size) ** 2
