"""All pictures are opened in one place, within bounds and by formats that were asked for."""

import io
import re
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms

from langflash_core.base.picture_files import FORMATS, STORED, TooManyPixels, decoded_photo, opened_picture
from langflash_core.errors import ImageError
from langflash_core.images.decode import read_photo

ROOT = Path(__file__).resolve().parents[2]
# The one place, and the process that decodes HEIC and AVIF.
ALLOWED = {"langflash_core/base/picture_files.py", "langflash_core/base/apart/photos.py"}
RED = Image.new("RGB", (64, 48), (255, 0, 0))


def encoded(picture: Image.Image, kind: str, **options) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, kind, **options)
    return stream.getvalue()


def png(width: int, height: int, *chunks: tuple[bytes, bytes]) -> bytes:
    """A PNG with a header of our own, as small as its header is large."""
    head = (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    body = b"\x89PNG\r\n\x1a\n"
    for name, content in (head, *chunks, (b"IEND", b"")):
        body += struct.pack(">I", len(content)) + name + content
        body += struct.pack(">I", zlib.crc32(name + content))
    return body


def test_nobody_else_opens_pictures():
    """Image.open lets every plug-in of Pillow in, and OpenCV's readers know no bounds."""
    opens = re.compile(
        r"\bImage\.open\(|\bimread\(|VideoCapture\(|\bimdecode\(|imageio\.|from PIL\.Image import"
    )
    found = {
        str(path.relative_to(ROOT).as_posix())
        for folder in ("langflash_core", "app")
        for path in (ROOT / folder).rglob("*.py")
        if opens.search(path.read_text(encoding="utf-8"))
    }
    # Films have a process too; the others decode the JPEG that images/ wrote a moment before.
    others = {"base/apart/films.py", "cameras/keypoints.py", "images/straight.py", "network/model.py"}
    assert found == ALLOWED | {f"langflash_core/{name}" for name in others}


@pytest.mark.parametrize("kind", ["FITS", "EPS", "ICO", "PCX", "TGA", "SGI"])
def test_other_plug_ins_see_nothing(kind):
    Image.init()
    assert kind not in FORMATS
    content = b"SIMPLE  =                    T".ljust(2880) if kind == "FITS" else encoded(RED, kind)
    with pytest.raises(OSError, match="cannot identify"), opened_picture(content):
        pass
    assert decoded_photo(content) is None, "a photo in a scene"
    with pytest.raises(OSError, match="cannot identify"), opened_picture(encoded(RED, "TIFF"), STORED):
        pass


def test_pixels_at_the_bound_and_one_past_it(monkeypatch, tmp_path):
    monkeypatch.setenv("LANGFLASH_MOST_PIXELS", str(64 * 48))
    (tmp_path / "a.png").write_bytes(encoded(RED, "PNG"))
    assert read_photo(tmp_path / "a.png").image.size == (64, 48)
    monkeypatch.setenv("LANGFLASH_MOST_PIXELS", str(64 * 48 - 1))
    with pytest.raises(ImageError, match=r"too many pixels; scale it to 3,071 pixels or less"):
        read_photo(tmp_path / "a.png")


@pytest.mark.parametrize("kind", ["AVIF", "HEIF"])
def test_pixels_of_pictures_that_aredecoded_photo_apart(kind, monkeypatch, tmp_path):
    import pillow_heif

    (tmp_path / "a.avif").write_bytes(b"")
    if kind == "AVIF":
        content = encoded(RED, "AVIF")
    else:
        pillow_heif.from_pillow(RED).save(tmp_path / "a.heic")
        content = (tmp_path / "a.heic").read_bytes()
    monkeypatch.setenv("LANGFLASH_MOST_PIXELS", str(64 * 48))
    with opened_picture(content) as picture:
        assert picture.size == (64, 48)
    monkeypatch.setenv("LANGFLASH_MOST_PIXELS", str(64 * 48 - 1))
    with pytest.raises(TooManyPixels), opened_picture(content):
        pass


@pytest.mark.parametrize("size", [(60_000, 60_000), (2**31 - 1, 2**31 - 1), (170_000_001, 1)])
def test_a_bomb_is_refused_by_its_header(size, tmp_path):
    """In photos and in scenes, before any pixel is decoded."""
    bomb = png(*size, (b"IDAT", zlib.compress(bytes(2**20))))
    (tmp_path / "a.png").write_bytes(bomb)
    with pytest.raises(ImageError, match=r"too many pixels|damaged"):
        read_photo(tmp_path / "a.png")
    assert decoded_photo(bomb) is None


def test_of_pictures_that_move_the_first_is_read(tmp_path):
    """10,000 frames cost no more than one."""
    frames = [Image.new("RGB", (64, 48), (0, 0, shade)) for shade in range(1, 200)]
    for kind in ("GIF", "WEBP", "PNG", "TIFF"):
        content = encoded(RED, kind, save_all=True, append_images=frames)
        (tmp_path / "a").write_bytes(content)
        first = np.asarray(read_photo(tmp_path / "a").image)[5, 5]
        assert np.abs(first.astype(int) - (255, 0, 0)).max() < 8, kind


def test_colour_profiles_that_lie(tmp_path):
    """Noise, a cut one, one of another space, one that is too long: the plain formula instead."""
    whole = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    for profile in (b"x" * 500, whole[:60], whole, bytes(5 * 2**20)):
        (tmp_path / "a.jpg").write_bytes(encoded(RED, "JPEG", icc_profile=profile, quality=95))
        seen = np.asarray(read_photo(tmp_path / "a.jpg").image)[5, 5].astype(int)
        assert np.abs(seen - (255, 0, 0)).max() < 8
    bomb = b"icc\0\0" + zlib.compress(bytes(2**26))  # a profile of 64 MB in 65 KB
    (tmp_path / "a.png").write_bytes(png(64, 48, (b"iCCP", bomb), (b"IDAT", zlib.compress(bytes(48 * 193)))))
    try:
        assert read_photo(tmp_path / "a.png").image.size == (64, 48)
    except ImageError as error:
        assert "; " in str(error)


def exif(*entries: tuple[int, int, int, int]) -> bytes:
    """A block with one directory; entries: tag, type, count, value."""
    body = struct.pack("<2sHIH", b"II", 42, 8, len(entries))
    return b"Exif\0\0" + body + b"".join(struct.pack("<HHII", *entry) for entry in entries) + bytes(4)


@pytest.mark.parametrize(
    "block",
    [
        exif((0x8769, 4, 1, 8)),  # its sub-directory is itself
        exif((0x8769, 4, 1, 2**32 - 1)),
        exif((0x0112, 3, 2**32 - 1, 8)),
        exif((0x0112, 3, 1, 60_000)),  # no such orientation
        exif((0x0112, 2, 2**31, 2**31)),
        exif((0x920A, 5, 1, 2**31), (0xA405, 3, 1, 0)),
        exif(*[(tag, 4, 1, 8) for tag in range(0x4000, 0x4FA0)]),
        b"Exif\0\0" + b"II*\0" + b"\xff" * 60,
    ],
)
def test_exif_that_lies_counts_as_none(block, tmp_path):
    (tmp_path / "a.jpg").write_bytes(encoded(RED, "JPEG", exif=block))
    assert read_photo(tmp_path / "a.jpg").image.size == (64, 48)
