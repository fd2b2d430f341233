"""The parts of a reconstruction that need no torch, begun before torch is imported.

Importing torch takes one processor longer than the network then takes both. Meanwhile the others read
the photos, match them and read the weights. This module and what it imports know numpy alone.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from langflash_core.errors import InputError, WeightsError
from langflash_core.images.pictures import Picture, read_pictures
from langflash_core.network.checkpoints.stored import Stored, read_header, read_stored, weights_file
from langflash_core.network.presets import PRESETS, GuidedDepth

SIZES = (56, 1024)  # pixels: below, the encoder's grid is 4 patches; above, attention's memory runs away
_WORKERS = 3  # at most; one processor stays with the import


@dataclass(frozen=True)
class Ahead:
    """What is under way: the photos, their key points (in the memory of `keypoints.match_sources`), and
    the file of weights, where they were asked for."""

    pictures: Future[list[Picture]]
    matched: Future[None]
    stored: Future[Stored] | None

    def check_photos(self) -> None:
        """Wait until the photos are read.

        Raises:
            ImageError, InputError: one cannot be used.
        """
        self.pictures.result()


def begin(
    photos: Sequence[Path | str],
    *,
    preset: str = "mini",
    weights: Path | str | None = None,
    size: int | None = None,
    read_weights: bool = True,
    check: Callable[[], None] = lambda: None,
) -> Ahead:
    """Start on a reconstruction; arguments as `pipeline.reconstruct` has them.

    Args:
        read_weights: also read the checkpoint, of presets that keep theirs in one file.
        check: called between photos and pairs; what it raises ends the work.

    Raises:
        WeightsError: there is no such preset, or the checkpoint's header cannot be read.
        InputError: the size is out of range.
    """
    if preset not in PRESETS:
        raise WeightsError(f"there is no preset '{preset}'; choose one of {', '.join(PRESETS)}")
    chosen = PRESETS[preset]
    area = chosen.native_area if size is None else _area(size)
    matches, stored = isinstance(chosen, GuidedDepth), None
    pool = ThreadPoolExecutor(
        min(_WORKERS, max(1, (os.cpu_count() or 1) - 1)), thread_name_prefix="langflash-ahead"
    )
    pictures = pool.submit(
        read_pictures, photos, area=area, multiple=chosen.patch, square=chosen.square, check=check
    )
    if read_weights and matches:
        path = weights_file(preset, None if weights is None else Path(weights))
        read_header(path)
        stored = pool.submit(_stored, pictures, path)
    matched = pool.submit(_match, pictures, check) if matches else _nothing()
    pool.shutdown(wait=False)
    return Ahead(pictures, matched, stored)


def _stored(pictures: Future[list[Picture]], path: Path) -> Stored:
    """After the photos, so that an error about one of them need not wait for the end of this."""
    pictures.result()
    return read_stored(path)


def _match(pictures: Future[list[Picture]], check: Callable[[], None]) -> None:
    from langflash_core.network.stereo.keypoints import match_sources  # OpenCV

    match_sources(tuple(picture.source for picture in pictures.result()), check)


def _nothing() -> Future[None]:
    done: Future[None] = Future()
    done.set_result(None)
    return done


def _area(size: int) -> int:
    low, high = SIZES
    if not low <= size <= high:
        raise InputError(f"the size {size} is out of range; choose {low} to {high} pixels")
    return int(size) ** 2
