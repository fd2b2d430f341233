"""Photo files to pixels of one shape, read side by side. Neither this module nor what it needs imports
torch, so that photos are read while torch is still being imported.

A crop is a box in continuous pixel coordinates (pixel i covers [i, i + 1)), so one uniform
scale s maps it onto the output: x' = (x - left) s, hence f' = f s and c' = (c - left) s.
"""

import io
import math
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.images.decode import Photo, PhotoFacts, read_photo
from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.images.still_names import shown_name

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Picture:
    """A photo cut and scaled. box: what is seen of it, photo pixels. pixels: (H, W, 3) uint8, as the
    network sees it. source: the same crop as JPEG, up to 768 pixels long. grey: (h, w) uint8, the
    whole photo, its short side at most 360 pixels."""

    photo: PhotoFacts
    box: Box
    pixels: np.ndarray
    source: bytes
    grey: np.ndarray

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the pixels."""
        return self.pixels.shape[1], self.pixels.shape[0]


def read_pictures(
    photos: Sequence[Path | str],
    *,
    area: int = 224 * 224,
    multiple: int = 14,
    square: bool = False,
    check: Callable[[], None] = lambda: None,
) -> list[Picture]:
    """Photos in the first one's shape, the others centre-cropped to it.

    Args:
        photos: 1 to `PHOTO_LIMITS.max_photos` files.
        area: about this many pixels each. multiple: of which both sides are multiples.
        square: the centre square of every photo instead of the first one's shape.
        check: called before each photo; what it raises ends the work.

    Raises:
        ImageError: a photo cannot be used. InputError: no photo, or too many.
        ValueError: `multiple` < 1 or `area` < multiple^2.
    """
    if multiple < 1 or area < multiple**2:
        raise ValueError(f"area, multiple: expected area >= multiple^2 >= 1, received {area}, {multiple}")
    paths = photo_paths(photos)
    names = photo_names(paths)
    check()
    first = read_photo(paths[0], names[0])
    size = fitting_size(*((1, 1) if square else (first.width, first.height)), area, multiple)

    def rest(place: int) -> Picture:
        check()
        return _picture(read_photo(paths[place], names[place]) if place else first, size)

    with ThreadPoolExecutor(PHOTO_LIMITS.readers, thread_name_prefix="langflash-photos") as pool:
        try:
            return list(pool.map(rest, range(len(paths))))
        finally:
            pool.shutdown(cancel_futures=True)


def _picture(photo: Photo, size: tuple[int, int]) -> Picture:
    box = centre_box(photo.width, photo.height, size)
    pixels, source = np.asarray(_downscale(photo, box, size)), _source_jpeg(photo, box, size)
    return Picture(photo.facts, box, pixels, source, judged_grey(photo.image))


def photo_paths(photos: Sequence[Path | str]) -> list[Path]:
    """The files of an argument, one or several.

    Raises:
        InputError: none, or more than `PHOTO_LIMITS.max_photos`.
    """
    listed = [photos] if isinstance(photos, str | Path) else list(photos)
    if not listed:
        raise InputError("no photo was given; name one or more photos of a room")
    if len(listed) > PHOTO_LIMITS.max_photos:
        raise InputError(
            f"{len(listed)} photos are too many; choose at most {PHOTO_LIMITS.max_photos} that overlap well"
        )
    return [Path(photo) for photo in listed]


def photo_names(paths: list[Path]) -> tuple[str, ...]:
    """File names, of a film's frames the film and the time; with their folder where different files share a
    name."""
    plain = [shown_name(path.name) or str(path) for path in paths]
    files = Counter(path.name for path in set(paths))
    return tuple(
        f"{path.parent.name}/{name}" if files[path.name] > 1 and path.parent.name else name
        for path, name in zip(paths, plain, strict=True)
    )


def fitting_size(width: int, height: int, area: int, multiple: int) -> tuple[int, int]:
    """(width, height), multiples of `multiple`, nearest to the photo's shape at `area` pixels.

    The aspect ratio is held within 2:1. A wrong shape cuts content off and a wrong area only
    costs or saves time, so the shape counts double.
    """
    aspect = min(max(width / height, 1 / PHOTO_LIMITS.max_aspect), PHOTO_LIMITS.max_aspect)
    ideal = math.sqrt(area * aspect) / multiple, math.sqrt(area / aspect) / multiple
    choices = [
        (columns, rows)
        for columns in {max(1, math.floor(ideal[0])), math.ceil(ideal[0])}
        for rows in {max(1, math.floor(ideal[1])), math.ceil(ideal[1])}
    ]

    def misfit(choice: tuple[int, int]) -> tuple[float, int]:
        columns, rows = choice
        shape = abs(math.log(columns / rows / aspect))
        return 2 * shape + abs(math.log(columns * rows * multiple**2 / area)), columns

    columns, rows = min(choices, key=misfit)
    return columns * multiple, rows * multiple


def centre_box(width: int, height: int, size: tuple[int, int]) -> Box:
    """The largest centred (left, top, right, bottom) of the shape of `size`, photo pixels."""
    scale = min(width / size[0], height / size[1])
    crop_width, crop_height = scale * size[0], scale * size[1]
    left, top = (width - crop_width) / 2, (height - crop_height) / 2
    return left, top, left + crop_width, top + crop_height


def _downscale(photo: Photo, box: Box, size: tuple[int, int]) -> Image.Image:
    """Lanczos over the box; a long way down starts with whole-number box averages."""
    left, top, right, bottom = (side / photo.reduction for side in box)
    inside = max(0.0, left), max(0.0, top), min(right, photo.image.width), min(bottom, photo.image.height)
    return photo.image.resize(size, Image.Resampling.LANCZOS, box=inside, reducing_gap=3.0)


def judged_grey(image: Image.Image) -> np.ndarray:
    """The whole photo, (h, w) uint8, at the size where light and sharpness are judged."""
    ratio = min(1.0, PHOTO_LIMITS.judged_side / min(image.size))
    size = max(3, round(image.width * ratio)), max(3, round(image.height * ratio))
    return np.asarray(image.convert("L").resize(size, Image.Resampling.LANCZOS, reducing_gap=3.0))


def _source_jpeg(photo: Photo, box: Box, size: tuple[int, int]) -> bytes:
    """The crop as JPEG bytes of exactly the view's shape, up to 768 pixels long, never enlarged."""
    divisor = math.gcd(*size)
    columns, rows = size[0] // divisor, size[1] // divisor
    long_side = min(PHOTO_LIMITS.source_side, max(box[2] - box[0], box[3] - box[1]) + 1e-6)
    steps = max(1, int(long_side / max(columns, rows)))
    stream = io.BytesIO()
    _downscale(photo, box, (columns * steps, rows * steps)).save(
        stream, "JPEG", quality=PHOTO_LIMITS.source_quality
    )
    return stream.getvalue()
