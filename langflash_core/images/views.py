"""Photos to `Views`: one shape for all, intrinsics following every crop and resize."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.errors import InputError
from langflash_core.images import triage
from langflash_core.images.decode import PhotoFacts
from langflash_core.images.lens import Intrinsics, check_lens, known_lenses, photo_intrinsics
from langflash_core.images.pictures import Box, Picture, photo_names, photo_paths, read_pictures
from langflash_core.images.settings import LENS_PRIOR
from langflash_core.types import Views


def load_views(
    photos: Sequence[Path | str],
    *,
    fov: float | Sequence[float | None] | None = None,
    intrinsics: Intrinsics | Sequence[Intrinsics] | None = None,
    area: int = 224 * 224,
    multiple: int = 14,
    square: bool = False,
    check: Callable[[], None] = lambda: None,
    pictures: Callable[[], Sequence[Picture]] | None = None,
) -> Views:
    """Photos as the network sees them: the first one's shape, the others centre-cropped to it.

    Args:
        photos, area, multiple, square, check: as `read_pictures`.
        fov: degrees of each photo's longer side, one for all or one per photo; None: EXIF, else
            65 with a note.
        intrinsics: (fx, fy, cx, cy) in pixels of the upright photos, the same for all or one per photo.
        pictures: gives what `read_pictures` makes of these photos, begun earlier.

    Returns:
        Views with triage notes in `warnings`, one sentence each.

    Raises:
        ImageError: a photo cannot be used. InputError: no photo, too many, or an unusable lens.
        ValueError: `multiple` < 1 or `area` < multiple^2.
    """
    paths = photo_paths(photos)
    fovs = _fovs(fov, len(paths))
    lenses_given = _lenses_given(intrinsics, len(paths))
    for each in dict.fromkeys(zip(fovs, lenses_given, strict=True)):
        check_lens(*each)
    names = photo_names(paths)
    if pictures is None:
        read = read_pictures(paths, area=area, multiple=multiple, square=square, check=check)
    else:
        read = pictures()
    images = [_image(picture) for picture in read]
    Ks, notes, assumed = [], [], []
    for picture, name, own_fov, given, image in zip(read, names, fovs, lenses_given, images, strict=True):
        check()
        photo, box = picture.photo, picture.box
        if given is intrinsics is not None:
            _check_same_size(photo, read[0].photo)
        K, guessed = photo_intrinsics(photo, own_fov, given)
        Ks.append(cropped_intrinsics(K, box, picture.size))
        notes += triage.photo_notes(photo, image, picture.grey)
        notes += triage.crop_notes(photo, None if square else box, names[0])
        if guessed:
            assumed.append(name)
        else:
            notes += triage.fov_notes(name, K, photo.width, photo.height)
    notes += triage.identical_notes(names, images)
    assumption = _assumption(assumed, len(names)) if assumed else ""
    lenses = known_lenses([picture.photo for picture in read], fovs, intrinsics, assumption)
    notes += [assumption] if assumed else []
    sources = tuple(picture.source for picture in read)
    return Views(torch.stack(images), torch.stack(Ks), names, sources, tuple(notes), lenses=lenses)


def source_pictures(views: Views) -> list[Tensor]:
    """The largest version of every photo at hand, (3, h, w) in [0, 1]; the same crop as the views."""
    return [source_picture(views, view) for view in range(views.num_views)]


def source_picture(views: Views, view: int) -> Tensor:
    """The largest version of one photo at hand, (3, h, w) in [0, 1]; the same crop as the views."""
    if not views.sources:
        return views.images[view]
    return _decode_photo(views.sources[view])


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


def _fovs(fov: float | Sequence[float | None] | None, count: int) -> list[float | None]:
    """One per photo."""
    if fov is None or isinstance(fov, int | float):
        return [fov] * count
    if len(fov) != count:
        raise InputError(f"{len(fov)} fields of view were given for {count} photos; give one each, or one")
    return list(fov)


def _lenses_given(
    intrinsics: Intrinsics | Sequence[Intrinsics] | None, count: int
) -> list[Intrinsics] | list[None]:
    """One per photo."""
    if intrinsics is None:
        return [None] * count
    if not intrinsics or isinstance(intrinsics[0], int | float):
        return [cast(Intrinsics, intrinsics)] * count
    if len(intrinsics) != count:
        raise InputError(f"{len(intrinsics)} intrinsics were given for {count} photos; give one each, or one")
    return cast(list[Intrinsics], list(intrinsics))


def _check_same_size(photo: PhotoFacts, first: PhotoFacts) -> None:
    if (photo.width, photo.height) != (first.width, first.height):
        raise InputError(
            f"{photo.name} is {photo.width} x {photo.height} pixels but the first photo is "
            f"{first.width} x {first.height}; intrinsics need photos of one size, "
            "give a field of view instead"
        )


def _image(picture: Picture) -> Tensor:
    """(3, H, W) in [0, 1]."""
    pixels = picture.pixels.astype(np.float32)
    return torch.from_numpy(pixels).permute(2, 0, 1).contiguous() / 255


def _decode_photo(source: bytes) -> Tensor:
    """(3, h, w) in [0, 1]."""
    with opened_picture(source, STORED) as picture:
        pixels = np.array(picture.convert("RGB"), dtype=np.float32)
    return torch.from_numpy(pixels).permute(2, 0, 1) / 255


def _assumption(assumed: list[str], total: int) -> str:
    whose = "the photos do not record their lens" if len(assumed) == total > 1 else ""
    whose = whose or f"{' and '.join(assumed)} {'does' if len(assumed) == 1 else 'do'} not record the lens"
    return f"{whose}, so a field of view of {LENS_PRIOR.assumed_fov:g}° is assumed; set it with --fov"
