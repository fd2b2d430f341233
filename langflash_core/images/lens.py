"""Intrinsics of a photo: given by the user, read from EXIF, or assumed.

K (3, 3) in pixels of the upright photo, square pixels, centre of the top-left pixel (0.5, 0.5).
"""

import math
from collections.abc import Sequence

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import intrinsics_from_fov
from langflash_core.images.decode import PhotoFacts
from langflash_core.images.settings import LENS_PRIOR
from langflash_core.types import Lenses

Intrinsics = tuple[float, float, float, float]
"""fx, fy, cx, cy."""
_FOCAL_35MM, _FOCAL, _PLANE_X, _PLANE_UNIT = 0xA405, 0x920A, 0xA20E, 0xA210
_PIXEL_X, _PIXEL_Y = 0xA002, 0xA003
_UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}


def check_lens(fov: float | None, intrinsics: tuple[float, ...] | None) -> None:
    """Refuse what cannot describe a lens, before any photo is read.

    Raises:
        InputError: both given, a field of view outside 1-179 degrees, or not four finite numbers
            with positive focal lengths.
    """
    if fov is not None and intrinsics is not None:
        raise InputError("both a field of view and intrinsics were given; give only one of them")
    if fov is not None and not 1.0 < fov < 179.0:
        raise InputError(f"a field of view of {fov:g} degrees is impossible; give 1 to 179")
    if intrinsics is None:
        return
    if len(intrinsics) != 4 or not all(math.isfinite(v) for v in intrinsics) or min(intrinsics[:2]) <= 0:
        received = ",".join(f"{v:g}" for v in intrinsics)
        raise InputError(
            f"intrinsics {received} are not usable; give FX,FY,CX,CY in pixels, FX and FY above 0"
        )


def photo_intrinsics(
    photo: PhotoFacts, fov: float | None = None, intrinsics: tuple[float, ...] | None = None
) -> tuple[Tensor, bool]:
    """K (3, 3) float32 of the upright photo, and whether it had to be assumed.

    Args:
        fov: degrees of the longer side. intrinsics: (fx, fy, cx, cy) pixels. Checked by
            `check_lens`; without either, EXIF decides, and without EXIF 65 degrees.

    Raises:
        InputError: the principal point lies outside the photo.
    """
    if intrinsics is not None:
        fx, fy, cx, cy = intrinsics
        if not (0 <= cx <= photo.width and 0 <= cy <= photo.height):
            size = f"{photo.width} x {photo.height}"
            raise InputError(
                f"the principal point {cx:g},{cy:g} lies outside {photo.name} ({size} pixels); "
                "give intrinsics in pixels of the photos as they are"
            )
        return torch.tensor([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), False
    if fov is not None:
        return intrinsics_from_fov(fov, photo.width, photo.height), False
    focal = exif_focal(photo)
    if focal is None:
        return intrinsics_from_fov(LENS_PRIOR.assumed_fov, photo.width, photo.height), True
    centre_x, centre_y = photo.width / 2, photo.height / 2
    return torch.tensor([[focal, 0.0, centre_x], [0.0, focal, centre_y], [0.0, 0.0, 1.0]]), False


def known_lenses(
    photos: Sequence[PhotoFacts],
    fovs: Sequence[float | None],
    intrinsics: Intrinsics | Sequence[Intrinsics] | None,
    note: str,
) -> Lenses | None:
    """What is known of the photos' lenses; None where all are given.

    Photos of one size (also on their side) whose files record the same focal length, or none, share a lens.

    Args:
        fovs: given, degrees, one per photo or None. note: the warning that an assumption is worth.
    """
    if intrinsics is not None or all(fov is not None for fov in fovs):
        return None
    keys: dict[tuple, int] = {}
    fields, doubts, recorded, of = [], [], [], []
    for photo, fov in zip(photos, fovs, strict=True):
        longer = max(photo.width, photo.height)
        focal = exif_focal(photo) if fov is None else None
        key = (longer, min(photo.width, photo.height), fov, focal and round(focal, 2))
        if key not in keys:
            keys[key] = len(keys)
            own = fov or LENS_PRIOR.assumed_fov
            fields.append(own if focal is None else 2 * math.degrees(math.atan(longer / (2 * focal))))
            doubts.append(
                0.0
                if fov is not None
                else LENS_PRIOR.assumed_doubt
                if focal is None
                else LENS_PRIOR.recorded_doubt
            )
            recorded.append(focal is not None)
        of.append(keys[key])
    return Lenses(tuple(of), tuple(fields), tuple(doubts), tuple(recorded), note)


def exif_fov(photo: PhotoFacts) -> float | None:
    """Degrees of the longer side, or None where `exif_focal` is."""
    focal = exif_focal(photo)
    return focal and 2 * math.degrees(math.atan(max(photo.width, photo.height) / (2 * focal)))


def exif_focal(photo: PhotoFacts) -> float | None:
    """Focal length in pixels of the photo, or None where EXIF does not say or cannot be right.

    The 35 mm equivalent compares diagonals (CIPA DCG-001-2005, section 2.4). Without it, the
    focal length in mm times the pixels per mm of the focal plane; those are pixels of the
    picture as taken, so a photo scaled later is followed by its recorded size.
    """
    focal = _focal_from_35mm(photo) or _focal_from_plane(photo)
    if focal is None:
        return None
    fov = 2 * math.degrees(math.atan(max(photo.width, photo.height) / (2 * focal)))
    return focal if LENS_PRIOR.plausible_fov[0] <= fov <= LENS_PRIOR.plausible_fov[1] else None


def _focal_from_35mm(photo: PhotoFacts) -> float | None:
    equivalent = _number(photo.exif.get(_FOCAL_35MM))
    return equivalent and equivalent / LENS_PRIOR.film_diagonal * math.hypot(photo.width, photo.height)


def _focal_from_plane(photo: PhotoFacts) -> float | None:
    focal_mm, density = _number(photo.exif.get(_FOCAL)), _number(photo.exif.get(_PLANE_X))
    unit_mm = _UNIT_MM.get(photo.exif.get(_PLANE_UNIT, 2))
    if focal_mm is None or density is None or unit_mm is None:
        return None
    recorded = [_number(photo.exif.get(tag)) for tag in (_PIXEL_X, _PIXEL_Y)]
    taken = max((side for side in recorded if side), default=max(photo.width, photo.height))
    return focal_mm * density / unit_mm * max(photo.width, photo.height) / taken


def _number(value: object) -> float | None:
    """A positive finite float, or None (0 means unknown in EXIF)."""
    try:
        number = float(value)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if math.isfinite(number) and number > 0 else None
