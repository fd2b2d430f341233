"""Photos to `Views`: one shape for all, intrinsics following every crop and resize.

A crop is a box in continuous pixel coordinates (pixel i covers [i, i + 1)), so one uniform
scale s maps it onto the output: x' = (x - left) s, hence f' = f s and c' = (c - left) s.
"""

import io
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.images import triage
from langflash_core.images.decode import Photo, read_photo
from langflash_core.images.lens import ASSUMED_FOV, check_lens, photo_intrinsics
from langflash_core.types import Views

MAX_PHOTOS = 32
MAX_ASPECT = 2.0
SOURCE_SIDE = 768
SOURCE_QUALITY = 88
Box = tuple[float, float, float, float]


def load_views(
    photos: Sequence[Path | str],
    *,
    fov: float | Sequence[float | None] | None = None,
    intrinsics: tuple[float, float, float, float] | None = None,
    area: int = 224 * 224,
    multiple: int = 14,
    square: bool = False,
    check: Callable[[], None] = lambda: None,
) -> Views:
    """Photos as the network sees them: the first one's shape, the others centre-cropped to it.

    Args:
        photos: 1 to 32 files.
        fov: degrees of each photo's longer side, one for all or one per photo; None: EXIF, else
            65 with a note.
        intrinsics: (fx, fy, cx, cy) in pixels of the upright photos, the same for all.
        area: about this many pixels per view. multiple: of which both sides are multiples.
        square: the centre square of every photo instead of the first one's shape.
        check: called before each photo; what it raises ends the work.

    Returns:
        Views with triage notes in `warnings`, one sentence each.

    Raises:
        ImageError: a photo cannot be used. InputError: no photo, over 32, or an unusable lens.
        ValueError: `multiple` < 1 or `area` < multiple^2.
    """
    if multiple < 1 or area < multiple**2:
        raise ValueError(f"area, multiple: expected area >= multiple^2 >= 1, received {area}, {multiple}")
    paths = _paths(photos)
    fovs = _fovs(fov, len(paths))
    for each in dict.fromkeys(fovs):
        check_lens(each, intrinsics)
    names = _names(paths)
    size, first = (0, 0), (0, 0)
    images, Ks, sources, notes, assumed = [], [], [], [], []
    for path, name, own_fov in zip(paths, names, fovs, strict=True):
        check()
        photo = read_photo(path, name)
        if not images:
            first = (photo.width, photo.height)
            size = fitting_size(*((1, 1) if square else first), area, multiple)
        elif intrinsics is not None:
            _check_same_size(photo, first)
        K, guessed = photo_intrinsics(photo, own_fov, intrinsics)
        box = centre_box(photo.width, photo.height, size)
        images.append(_resized(photo, box, size))
        Ks.append(cropped_intrinsics(K, box, size))
        sources.append(_source_jpeg(photo, box, size))
        notes += triage.photo_notes(photo, images[-1]) + triage.crop_notes(
            photo, None if square else box, names[0]
        )
        if guessed:
            assumed.append(name)
        else:
            notes += triage.fov_notes(name, K, photo.width, photo.height)
    notes += triage.identical_notes(names, images)
    if assumed:
        notes.append(_assumption(assumed, len(names)))
    return Views(torch.stack(images), torch.stack(Ks), names, tuple(sources), tuple(notes))


def source_pictures(views: Views) -> list[Tensor]:
    """The largest version of every photo at hand, (3, h, w) in [0, 1]; the same crop as the views."""
    if not views.sources:
        return list(views.images)
    opened = [Image.open(io.BytesIO(source)).convert("RGB") for source in views.sources]
    return [torch.from_numpy(np.array(image, dtype=np.float32)).permute(2, 0, 1) / 255 for image in opened]


def fitting_size(width: int, height: int, area: int, multiple: int) -> tuple[int, int]:
    """(width, height), multiples of `multiple`, nearest to the photo's shape at `area` pixels.

    The aspect ratio is held within 2:1. A wrong shape cuts content off and a wrong area only
    costs or saves time, so the shape counts double.
    """
    aspect = min(max(width / height, 1 / MAX_ASPECT), MAX_ASPECT)
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


def cropped_intrinsics(K: Tensor, box: Box, size: tuple[int, int]) -> Tensor:
    """K (3, 3) of the picture that shows `box` at `size` (width, height)."""
    left, top, right, bottom = box
    to_crop = torch.tensor(
        [
            [size[0] / (right - left), 0.0, -left * size[0] / (right - left)],
            [0.0, size[1] / (bottom - top), -top * size[1] / (bottom - top)],
            [0.0, 0.0, 1.0],
        ],
        dtype=torch.float64,
    )
    return (to_crop @ K.double()).float()


def _paths(photos: Sequence[Path | str]) -> list[Path]:
    listed = [photos] if isinstance(photos, str | Path) else list(photos)
    if not listed:
        raise InputError("no photo was given; name one or more photos of a room")
    if len(listed) > MAX_PHOTOS:
        raise InputError(f"{len(listed)} photos are too many; choose at most {MAX_PHOTOS} that overlap well")
    return [Path(photo) for photo in listed]


def _fovs(fov: float | Sequence[float | None] | None, count: int) -> list[float | None]:
    """One per photo."""
    if fov is None or isinstance(fov, int | float):
        return [fov] * count
    if len(fov) != count:
        raise InputError(f"{len(fov)} fields of view were given for {count} photos; give one each, or one")
    return list(fov)


def _names(paths: list[Path]) -> tuple[str, ...]:
    """File names; with their folder where different files share a name."""
    plain = [path.name or str(path) for path in paths]
    clashing = {a.name for a in paths for b in paths if a.name == b.name and a != b}
    return tuple(
        f"{path.parent.name}/{name}" if path.name in clashing and path.parent.name else name
        for path, name in zip(paths, plain, strict=True)
    )


def _check_same_size(photo: Photo, first: tuple[int, int]) -> None:
    if (photo.width, photo.height) != first:
        raise InputError(
            f"{photo.name} is {photo.width} x {photo.height} pixels but the first photo is "
            f"{first[0]} x {first[1]}; intrinsics need photos of one size, give a field of view instead"
        )


def _scaled(photo: Photo, box: Box, size: tuple[int, int]) -> Image.Image:
    """Lanczos over the box; a long way down starts with whole-number box averages."""
    left, top, right, bottom = (side / photo.reduction for side in box)
    inside = max(0.0, left), max(0.0, top), min(right, photo.image.width), min(bottom, photo.image.height)
    return photo.image.resize(size, Image.Resampling.LANCZOS, box=inside, reducing_gap=3.0)


def _resized(photo: Photo, box: Box, size: tuple[int, int]) -> Tensor:
    """(3, H, W) in [0, 1]."""
    pixels = np.array(_scaled(photo, box, size), dtype=np.float32)
    return torch.from_numpy(pixels).permute(2, 0, 1).contiguous() / 255


def _source_jpeg(photo: Photo, box: Box, size: tuple[int, int]) -> bytes:
    """The crop as JPEG bytes of exactly the view's shape, up to 768 pixels long, never enlarged."""
    divisor = math.gcd(*size)
    columns, rows = size[0] // divisor, size[1] // divisor
    long_side = min(SOURCE_SIDE, max(box[2] - box[0], box[3] - box[1]) + 1e-6)
    steps = max(1, int(long_side / max(columns, rows)))
    stream = io.BytesIO()
    _scaled(photo, box, (columns * steps, rows * steps)).save(stream, "JPEG", quality=SOURCE_QUALITY)
    return stream.getvalue()


def _assumption(assumed: list[str], total: int) -> str:
    whose = "the photos do" if len(assumed) == total > 1 else f"{' and '.join(assumed)} do"
    whose = f"{assumed[0]} does" if len(assumed) == 1 else whose
    assumption = f"assumed field of view {ASSUMED_FOV:g} degrees"
    return f"{assumption}, {whose} not record the lens; on the command line, --fov tells it"
