"""Every kind of photo becomes upright 8-bit RGB; everything else one sentence."""

import struct
import sys

import numpy as np
import pillow_heif
import pytest
from PIL import Image, ImageCms

from langflash_core.errors import ImageError
from langflash_core.images.decode import read_photo
from tests.images.pictures import encoded, exif, room_picture, saved


def pixels(path) -> np.ndarray:
    photo = read_photo(path)
    assert photo.image.mode == "RGB"
    assert photo.image.size == (photo.width, photo.height)
    return np.asarray(photo.image).astype(int)


@pytest.mark.parametrize("suffix", ["png", "tiff", "bmp", "webp", "gif", "ppm"])
def test_lossless_formats_keep_every_pixel(tmp_path, suffix):
    image = room_picture().quantize(200).convert("RGB")  # few colours, so that GIF is exact too
    options = {"lossless": True} if suffix == "webp" else {}
    path = saved(image, tmp_path / f"a.{suffix}", **options)
    assert np.array_equal(pixels(path), np.asarray(image))


@pytest.mark.parametrize("suffix", ["jpg", "heic", "avif", "jp2"])
def test_lossy_formats_stay_close(tmp_path, suffix):
    image = room_picture()
    path = tmp_path / f"a.{suffix}"
    if suffix == "heic":
        pillow_heif.from_pillow(image).save(path, quality=90)
    else:
        image.save(path, quality=90)
    # Lossy codecs at quality 90, colour subsampled: a mean error of a few counts at flat patches.
    assert np.abs(pixels(path) - np.asarray(image)).mean() < 6


def test_grey_16_bit_and_float_scale_to_8(tmp_path):
    ramp = np.linspace(0, 65535, 64 * 64).reshape(64, 64)
    expected = np.round(ramp / 257).astype(int)
    deep = saved(Image.fromarray(ramp.astype(np.uint16)), tmp_path / "a.png")
    floats = saved(Image.fromarray((ramp / 65535).astype(np.float32)), tmp_path / "b.tiff")
    whole = saved(Image.fromarray(ramp.astype(np.int32)), tmp_path / "c.tiff")
    for path in (deep, floats, whole):
        # Rounding to 8 bits after a 16-bit rounding may differ by one count.
        assert np.abs(pixels(path)[..., 0] - expected).max() <= 1
        assert pixels(path).shape == (64, 64, 3)


def test_float_pixels_that_are_not_numbers_become_black(tmp_path):
    values = np.full((40, 40), 0.5, np.float32)
    values[0, 0], values[1, 1] = np.nan, np.inf
    read = pixels(saved(Image.fromarray(values), tmp_path / "a.tiff"))
    assert read[0, 0, 0] == read[1, 1, 0] == 0
    assert read[5, 5, 0] == 128


def test_transparency_lies_over_mid_grey(tmp_path):
    image = Image.new("RGBA", (64, 64), (255, 0, 0, 255))
    image.paste((255, 255, 255, 0), (0, 0, 32, 64))
    read = pixels(saved(image, tmp_path / "a.png"))
    assert read[10, 10].tolist() == [128, 128, 128]
    assert read[10, 50].tolist() == [255, 0, 0]
    palette = image.convert("RGB").quantize(4)
    palette.info["transparency"] = palette.getpixel((50, 10))
    read = pixels(saved(palette, tmp_path / "b.png", transparency=palette.getpixel((50, 10))))
    assert read[10, 50].tolist() == [128, 128, 128]


@pytest.mark.parametrize("mode", ["L", "LA", "1", "P", "CMYK", "YCbCr"])
def test_other_colour_models_become_rgb(tmp_path, mode):
    image = room_picture().convert(mode)
    path = saved(image, tmp_path / "a.tiff")
    expected = np.asarray(image.convert("RGB")).astype(int)
    # YCbCr TIFF and the alpha blend round once more than the direct conversion.
    assert np.abs(pixels(path) - expected).mean() < 2


def test_colour_profiles_become_srgb(tmp_path):
    """Two sides of one profile: sRGB changes nothing, Lab-based swaps change much."""
    image = room_picture()
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    same = pixels(saved(image, tmp_path / "a.png", icc_profile=srgb))
    # 8-bit rounding inside the colour engine.
    assert np.abs(same - np.asarray(image)).max() <= 1
    broken = pixels(saved(image, tmp_path / "b.png", icc_profile=b"not a profile at all"))
    assert np.array_equal(broken, np.asarray(image))


@pytest.mark.parametrize(("said", "green"), [("R03", (0, 255, 0)), ("R98", (144, 255, 60))])
def test_adobe_rgb_that_only_exif_speaks_of(tmp_path, said, green):
    """Cameras write no profile: index R03 alone says it. Green of sRGB is (144, 255, 60) there."""
    tags = Image.Exif()
    tags[0x8769] = {0xA001: 0xFFFF, 0xA005: {1: said}}
    picture = Image.new("RGB", (320, 240), (144, 255, 60))
    picture.paste((90, 90, 90), (0, 0, 160, 240))
    shown = pixels(saved(picture, tmp_path / "a.jpg", exif=tags.tobytes(), quality=100, subsampling=0))
    assert np.abs(shown[100, 300] - green).max() <= 3  # JPEG rounds, and 12.92 times a step near black
    grey = 255 * (1.055 * (90 / 255) ** (563 / 256 / 2.4) - 0.055) if said == "R03" else 90
    assert np.abs(shown[100, 20] - grey).max() <= 1.5


@pytest.mark.parametrize("orientation", range(1, 9))
def test_all_orientations_come_out_upright(tmp_path, orientation):
    upright = room_picture(96, 64)
    undo = {
        2: Image.Transpose.FLIP_LEFT_RIGHT, 3: Image.Transpose.ROTATE_180, 4: Image.Transpose.FLIP_TOP_BOTTOM,
        5: Image.Transpose.TRANSPOSE, 6: Image.Transpose.ROTATE_90, 7: Image.Transpose.TRANSVERSE,
        8: Image.Transpose.ROTATE_270,
    }  # fmt: skip
    stored = upright.transpose(undo[orientation]) if orientation in undo else upright
    path = saved(stored, tmp_path / "a.png", exif=exif(orientation=orientation))
    assert np.array_equal(pixels(path), np.asarray(upright))


def test_a_large_jpeg_is_decoded_small_and_says_how_much(tmp_path):
    image = room_picture(4096, 3072)
    photo = read_photo(saved(image, tmp_path / "a.jpg", exif=exif(orientation=6)))
    assert (photo.width, photo.height, photo.reduction) == (3072, 4096, 2.0)
    assert photo.image.size == (1536, 2048)


def _mangled(kind: str) -> bytes:
    picture = room_picture()
    return {
        "empty.jpg": b"",
        "text.jpg": b"these are not the pixels you are looking for\n" * 20,
        "script.ps": b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 99 99\nshowpage\n",
        "cut.png": encoded(picture, "PNG")[:600],
        "cut.jpg": encoded(picture, "JPEG")[:900],
        "cut.webp": encoded(picture, "WEBP")[:700],
        "cut.tiff": encoded(picture, "TIFF")[:5000],
        "cut.heic": b"\0\0\0\x18ftypheic" + bytes(400),
        "dot.png": encoded(Image.new("RGB", (1, 1)), "PNG"),
        "strip.png": encoded(Image.new("RGB", (400, 31)), "PNG"),
    }[kind]


@pytest.mark.parametrize(
    "name",
    [
        "empty.jpg", "text.jpg", "script.ps", "cut.png", "cut.jpg", "cut.webp", "cut.tiff", "cut.heic",
        "dot.png", "strip.png",
    ],
)  # fmt: skip
def test_unusable_files_get_one_sentence_with_the_name_and_a_remedy(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(_mangled(name))
    with pytest.raises(ImageError) as caught:
        read_photo(path)
    message = str(caught.value)
    assert message.startswith(name)
    assert ";" in message and "\n" not in message
    assert caught.value.exit_code == 2


def test_a_folder_and_a_missing_file(tmp_path):
    with pytest.raises(ImageError, match="is a folder"):
        read_photo(tmp_path)
    with pytest.raises(ImageError, match="does not exist"):
        read_photo(tmp_path / "nowhere.jpg")


def test_what_a_decoder_says_over_several_lines_becomes_one(tmp_path, monkeypatch):
    def broken(_, __):
        raise RuntimeError("Invalid input:\n  no 'pitm' box\n")

    monkeypatch.setattr("langflash_core.images.decode._decode", broken)
    (tmp_path / "a.heic").write_bytes(b"heic")
    with pytest.raises(ImageError, match=r"\(Invalid input: no 'pitm' box\); copy"):
        read_photo(tmp_path / "a.heic")


@pytest.mark.skipif(sys.platform == "win32", reason="libtiff's functions are hidden inside Pillow's own")
def test_a_bad_tiff_is_told_of_in_the_error_alone(tmp_path, capfd, caplog):
    """libtiff writes to the terminal by itself, and Pillow logs."""
    whole = encoded(room_picture(64, 48), "TIFF", compression="tiff_adobe_deflate")
    pixels_of_it = whole.index(b"\x78\x9c")  # where a zlib stream starts
    cut = whole[: pixels_of_it + 40] + bytes(20) + whole[pixels_of_it + 60 :]
    samples = whole.index(struct.pack("<HHI", 277, 3, 1)) + 8
    many = whole[:samples] + struct.pack("<I", 3072) + whole[samples + 4 :]
    for content in (cut, many):
        (tmp_path / "a.tiff").write_bytes(content)
        with pytest.raises(ImageError):
            read_photo(tmp_path / "a.tiff")
    assert capfd.readouterr() == ("", "")
    assert not caplog.records


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "WEBP", "TIFF", "HEIF"])
def test_damage_anywhere_gives_pixels_or_an_image_error(tmp_path, kind):
    """Random flips and cuts: decoders may repair or refuse, nothing else may come out."""
    pillow_heif.register_heif_opener()
    whole = encoded(room_picture(64, 48), kind, exif=exif(focal_35mm=26, orientation=6).tobytes())
    rng = np.random.default_rng(3)
    path = tmp_path / "a.bin"
    for _ in range(15 if kind == "HEIF" else 60):  # each refused HEIC ends its decoder's process
        damaged = bytearray(whole)
        for place in rng.integers(0, len(whole), 4):
            damaged[place] = rng.integers(0, 256)
        path.write_bytes(bytes(damaged[: rng.integers(8, len(whole) + 1)] if rng.random() < 0.3 else damaged))
        try:
            photo = read_photo(path)
        except ImageError:
            continue
        assert photo.image.mode == "RGB"
