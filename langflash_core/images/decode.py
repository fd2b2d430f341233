"""One photo file to upright 8-bit RGB pixels, whatever the file holds.

Choices: the first frame of a moving picture; alpha over mid-grey (128), which adds neither
light nor much of an edge; deeper than 8 bits is scaled to 8; an embedded colour profile is
converted to sRGB, and so is Adobe RGB that only EXIF speaks of; JPEGs much larger than needed
are decoded at 1/2, 1/4 or 1/8.
"""

import io
import struct
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageCms

from langflash_core.base.formats import is_film
from langflash_core.base.limits import PIXELS, PROFILE
from langflash_core.base.picture_files import TooManyPixels, opened_picture, picture_block
from langflash_core.errors import ImageError
from langflash_core.images.settings import DECODING

_REMEDY = "use a photo in JPEG, PNG, WebP, HEIC or TIFF format"
_DAMAGE = (
    OSError, SyntaxError, ValueError, TypeError, LookupError, ArithmeticError, EOFError, AttributeError,
    RuntimeError, NotImplementedError, struct.error, zlib.error,
)  # fmt: skip
_ORIENTATION_TAG = 0x0112
_INTEROP_TAG, _INTEROP_INDEX, _ADOBE_RGB = 0xA005, 1, "R03"  # DCF 2.0: the cameras' way to say Adobe RGB
_FROM_ADOBE = np.array([[1.398283, -0.398283, 0], [0, 1, 0], [0, -0.042938, 1.042938]], np.float32)
_ADOBE_GAMMA = 563 / 256
_UPRIGHT = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}


@dataclass(frozen=True)
class PhotoFacts:
    """What a photo file says besides its pixels. width, height: pixels, upright. exif: tags by number,
    the Exif block merged into the main one."""

    name: str
    width: int
    height: int
    exif: dict


@dataclass(frozen=True)
class Photo(PhotoFacts):
    """A decoded photo, upright.

    image: RGB, maybe decoded smaller by `reduction` (1, 2, 4 or 8): its point (x, y) is the
    photo's (x * reduction, y * reduction).
    """

    image: Image.Image
    reduction: float

    @property
    def facts(self) -> PhotoFacts:
        """All but the pixels."""
        return PhotoFacts(self.name, self.width, self.height, self.exif)


def read_photo(path: Path, name: str | None = None) -> Photo:
    """Decode one photo.

    Args:
        path: the file. name: what to call it in messages; the file name by default.

    Raises:
        ImageError: missing, a folder, empty, foreign, damaged, a decompression bomb, or under
            32 pixels a side; one sentence that names the file and a remedy.
    """
    name = name or path.name
    if is_film(path):
        raise ImageError(f"{name} is a film; `langflash frames` takes photos out of it")
    content = _read_bytes(path, name)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # PIL warns of large or odd files; it raises for bad ones
            return _decode(content, name)
    except Image.UnidentifiedImageError as error:
        raise ImageError(f"{name} is not a picture this program can read; {_REMEDY}") from error
    except TooManyPixels as error:
        raise ImageError(f"{name} has too many pixels; scale it to {PIXELS.told()} or less") from error
    except MemoryError as error:
        raise ImageError(f"{name} does not fit into memory; scale it down first") from error
    except _DAMAGE as error:
        said = " ".join(str(error).split())  # what decoders say may have line breaks
        raise ImageError(f"{name} is damaged or incomplete ({said}); copy or export it again") from error


def grey_photo(path: Path) -> np.ndarray:
    """The upright photo as (H, W) uint8, maybe decoded smaller.

    Raises:
        ImageError: as `read_photo`.
    """
    return np.asarray(read_photo(path).image.convert("L"))


def _read_bytes(path: Path, name: str) -> bytes:
    if path.is_dir():
        raise ImageError(f"{name} is a folder; name the photos inside it instead")
    if not path.exists():
        raise ImageError(f"photo {path} does not exist; check the path")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ImageError(f"{name} cannot be read ({error.strerror}); check its permissions") from error
    if not content:
        raise ImageError(f"{name} is an empty file; copy or export it again")
    return content


def _decode(content: bytes, name: str) -> Photo:
    with opened_picture(content) as opened:
        if min(opened.size) < DECODING.min_side:
            size = f"{opened.width} x {opened.height}"
            raise ImageError(f"{name} is only {size} pixels; use a photo of at least 200 pixels a side")
        stored = opened.size
        if stored[0] % 8 == stored[1] % 8 == 0:  # else the last row and column show less than the rest
            opened.draft(None, _draft_size(stored))
        reduction = stored[0] / opened.width
        opened.load()
        exif = _exif(opened)
        profile = picture_block(opened, "icc_profile")
        image = _to_srgb(_to_8bit(opened), profile)
        if profile is None and _says_adobe_rgb(opened):
            image = _from_adobe_rgb(image)
    turn = _UPRIGHT.get(exif.get(_ORIENTATION_TAG, 1))
    if turn is not None:
        image = image.transpose(turn)
    turned = turn in (_UPRIGHT[5], _UPRIGHT[6], _UPRIGHT[7], _UPRIGHT[8])
    width, height = stored[::-1] if turned else stored
    return Photo(name, width, height, exif, image, reduction)


def _draft_size(size: tuple[int, int]) -> tuple[int, int]:
    """The smallest size that a JPEG decoder may reduce to; other formats ignore it."""
    ratio = min(1.0, DECODING.decoded_side / max(size))
    return max(1, round(size[0] * ratio)), max(1, round(size[1] * ratio))


def _exif(image: Image.Image) -> dict:
    """EXIF tags by number; a broken block counts as none, and so does one that is too long."""
    if PROFILE.passed_by(len(image.info.get("exif") or b"")):
        return {}
    try:
        tags = image.getexif()
        return {**dict(tags), **tags.get_ifd(0x8769)}
    except _DAMAGE:
        return {}


def _says_adobe_rgb(image: Image.Image) -> bool:
    """Whether EXIF says Adobe RGB, as cameras do that embed no profile."""
    if PROFILE.passed_by(len(image.info.get("exif") or b"")):
        return False
    try:
        said = str(image.getexif().get_ifd(_INTEROP_TAG).get(_INTEROP_INDEX, ""))
    except _DAMAGE:
        return False
    return said.strip("\0 ") == _ADOBE_RGB


def _from_adobe_rgb(image: Image.Image) -> Image.Image:
    """sRGB pixels of Adobe RGB ones; what sRGB does not hold is clipped. Source: Adobe RGB (1998), 4.3."""
    light = (np.arange(256) / 255) ** np.float32(_ADOBE_GAMMA)
    pixels = np.array(image)
    for first in range(0, len(pixels), DECODING.rows_at_once):
        some = slice(first, first + DECODING.rows_at_once)
        linear = (light.astype(np.float32)[pixels[some]] @ _FROM_ADOBE.T).clip(0, 1)
        shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        pixels[some] = np.round(255 * shown)
    return Image.fromarray(pixels)


def _to_8bit(image: Image.Image) -> Image.Image:
    """RGB or CMYK, 8 bits; transparency over mid-grey."""
    if image.mode in ("I", "F") or image.mode.startswith("I;16"):
        return Image.fromarray(_scaled_to_8bit(np.asarray(image), image.mode)).convert("RGB")
    if image.mode in ("LA", "La", "PA", "RGBA", "RGBa") or "transparency" in image.info:
        layer = image.convert("RGBA")
        return Image.alpha_composite(Image.new("RGBA", layer.size, DECODING.mid_grey), layer).convert("RGB")
    return image.copy() if image.mode in ("RGB", "CMYK") else image.convert("RGB")


def _scaled_to_8bit(values: np.ndarray, mode: str) -> np.ndarray:
    """16-bit counts by 65535; others by the first of 1 (floats only), 255, 65535, own maximum."""
    finite = np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0).clip(0)
    if mode.startswith("I;16"):
        top = 65535.0
    else:
        peak = float(finite.max())
        ranges = (1.0, 255.0, 65535.0) if mode == "F" else (255.0, 65535.0)
        top = next((limit for limit in ranges if peak <= limit), peak)
    return np.round(finite * (255.0 / top)).astype(np.uint8)


def _to_srgb(image: Image.Image, profile: bytes | None) -> Image.Image:
    """Through the embedded profile where it works, by plain formula where not."""
    if profile:
        try:
            source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
            target = ImageCms.createProfile("sRGB")
            converted = ImageCms.profileToProfile(image, source, target, outputMode="RGB")
            if converted is not None:
                return converted
        except (ImageCms.PyCMSError, OSError, ValueError):
            pass  # a profile that does not fit the pixels (often grey ones) says nothing of them
    return image.convert("RGB")
