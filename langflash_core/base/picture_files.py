"""The one place where picture files are opened: photos, maps of data sets, pictures inside scenes.

Only the formats that were asked for are let in, and no more pixels than `base/limits.py` allows,
before anything is decoded. HEIC and AVIF are decoded in a process of their own (`base/apart/`);
whatever happens to it is an `OSError` here. Of pictures that move, the first is given.
"""

import ctypes
import io
import logging
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from io import BufferedIOBase
from pathlib import Path
from typing import IO, Any, cast

import numpy as np
from jaxtyping import Shaped, UInt8
from PIL import Image

from langflash_core.base.limits import PIXELS, PROFILE

FORMATS = ("JPEG", "MPO", "PNG", "WEBP", "TIFF", "HEIF", "AVIF", "JPEG2000", "BMP", "GIF", "PPM")
"""Of photos and of the maps beside them. No other plug-in of Pillow sees a byte (no PostScript, no FITS)."""
STORED = ("JPEG", "PNG", "WEBP")
"""Of pictures inside scenes and other files of ours."""
_APART = frozenset(("HEIF", "AVIF"))
_BRANDS = frozenset(  # of files that begin as films do, too
    (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1", b"avif", b"avis")
)
_ORIENTATION = 0x0112
_DAMAGE = (OSError, SyntaxError, ValueError, TypeError, LookupError, ArithmeticError, AttributeError,
           RuntimeError, struct.error)  # fmt: skip


class TooManyPixels(OSError):
    """A picture promises more pixels than are let in."""


@contextmanager
def opened_picture(
    source: Path | str | bytes | BufferedIOBase, formats: tuple[str, ...] = FORMATS
) -> Iterator[Image.Image]:
    """A picture, to be decoded when its pixels are asked for (HEIC and AVIF at once).

    Args:
        source: a path, the bytes of a file, or an open file. formats: names of Pillow's plug-ins.

    Raises:
        TooManyPixels: more than `limits.PIXELS`. OSError: missing, or of no format of these. Whatever else
            Pillow raises for damaged files: OSError, SyntaxError, ValueError and others.
    """
    file = io.BytesIO(source) if isinstance(source, bytes) else source
    stream: BufferedIOBase = open(file, "rb") if isinstance(file, Path | str) else file  # noqa: SIM115 - closed below
    try:
        start = stream.read(12)
        stream.seek(0)
        if start[4:8] == b"ftyp" and _APART & set(formats):
            yield _decoded_apart(stream.read())
        else:
            with _identify(stream, formats, start) as picture:
                yield picture
    except Image.DecompressionBombError as error:
        raise TooManyPixels(f"it has more than {PIXELS.told()}") from error
    finally:
        if stream is not source:
            stream.close()


def is_picture(path: Path) -> bool:
    """Whether a file begins as one of `FORMATS` does, whatever it is called; no pixel is decoded."""
    try:
        with path.open("rb") as stream:
            start = stream.read(12)
        if start[4:8] == b"ftyp":
            return start[8:] in _BRANDS
        with opened_picture(path):
            return True
    except _DAMAGE:
        return False


def picture_block(picture: Image.Image, name: str) -> bytes | None:
    """A block of a picture's file, "icc_profile" or "exif"; None where there is none, or one too long."""
    block = picture.info.get(name)
    return block if isinstance(block, bytes) and block and not PROFILE.passed_by(len(block)) else None


def decoded_photo(photo: bytes, mode: str = "RGB") -> UInt8[np.ndarray, "H W *c"] | None:
    """The pixels of a picture inside a scene, in a mode of Pillow's; None where it is damaged."""
    try:
        with opened_picture(photo, STORED) as opened:
            return np.asarray(opened.convert(mode))
    except (OSError, SyntaxError, ValueError):
        return None


def encoded(picture: Shaped[np.ndarray, "..."] | Image.Image, kind: str, **options: Any) -> bytes:
    """A picture's file. kind, options: a format of Pillow's, and how it writes it."""
    stream = io.BytesIO()
    image = picture if isinstance(picture, Image.Image) else Image.fromarray(np.ascontiguousarray(picture))
    image.save(stream, kind, **options)
    return stream.getvalue()


def stored_shape(picture: Image.Image) -> tuple[tuple[int, int], int]:
    """(width, height) of the pixels as they are stored, and EXIF's orientation of them, 1 to 8; of a picture
    that was opened and not yet decoded. A broken block, or one that is too long, counts as none."""
    try:
        known = {} if PROFILE.passed_by(len(picture.info.get("exif") or b"")) else picture.getexif()
        orientation = int(known.get(_ORIENTATION, 1))
    except _DAMAGE:
        orientation = 1
    orientation = orientation if 1 <= orientation <= 8 else 1
    told_upright = picture.format == "TIFF" and orientation >= 5  # Pillow turns these by itself
    width, height = picture.size
    return (height, width) if told_upright else (width, height), orientation


def _identify(stream: BufferedIOBase, formats: tuple[str, ...], start: bytes) -> Image.Image:
    if start[:2] in (b"II", b"MM"):
        _quiet_tiff()
    Image.init()  # all plug-ins; only those named are let in
    Image.MAX_IMAGE_PIXELS = PIXELS.value  # Pillow itself refuses twice as many, also inside a file
    known = [kind for kind in formats if kind in Image.OPEN and kind not in _APART]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of large or odd files; the bound is ours
        picture = Image.open(cast(IO[bytes], stream), formats=known)
    if PIXELS.passed_by(picture.width * picture.height):
        raise TooManyPixels(f"it has {picture.width:,} x {picture.height:,} pixels")
    return picture


def _decoded_apart(content: bytes) -> Image.Image:
    """Raises:
    OSError: it is damaged, or its decoder broke. TooManyPixels.
    """
    from langflash_core.base.apart import Ended, Refused, ask  # a module that few photos need

    bounds = {"pixels": PIXELS.value, "profile": PROFILE.value}
    try:
        (part,) = ask("photo", bounds, content)
    except Refused as error:
        raise OSError(str(error)) from error
    except Ended as error:
        raise OSError(f"its decoder {error}") from error
    mode, size = str(part.facts["mode"]), (int(part.facts["width"]), int(part.facts["height"]))
    if PIXELS.passed_by(size[0] * size[1]):
        raise TooManyPixels(f"it has {size[0]:,} x {size[1]:,} pixels")
    picture = Image.frombytes(mode, size, part.arrays["pixels"])
    for name in ("exif", "icc_profile", "xmp"):
        if name in part.arrays:
            picture.info[name] = part.arrays[name].tobytes()
    return picture


@cache
def _quiet_tiff() -> None:
    """What is wrong with a TIFF is told once, in the error: libtiff and Pillow's log would write it to the
    terminal as well. Where libtiff's functions are hidden inside Pillow's own (Windows), it still does."""
    logging.getLogger("PIL.TiffImagePlugin").setLevel(logging.CRITICAL)
    library = ctypes.CDLL(Image.core.__file__)  # a look-up goes on into the libraries that it needs
    for name in ("TIFFSetErrorHandler", "TIFFSetWarningHandler"):
        if hasattr(library, name):
            getattr(library, name)(None)
