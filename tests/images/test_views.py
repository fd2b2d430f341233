"""One shape for all photos; intrinsics, pixels and source JPEGs follow the same crop."""

import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import ImageError, InputError
from langflash_core.images.leaving_out import views_without
from langflash_core.images.pictures import fitting_size
from langflash_core.images.views import load_views
from langflash_core.types import Views
from tests.images.pictures import exif, room_picture, saved


@pytest.mark.parametrize("aspect", [0.2, 0.5, 9 / 16, 0.75, 1.0, 4 / 3, 1.5, 16 / 9, 2.0, 7.0])
@pytest.mark.parametrize(("area", "multiple"), [(224 * 224, 14), (256 * 256, 16), (512 * 512, 14), (100, 1)])
def test_sizes_are_multiples_near_the_area_and_the_shape(aspect, area, multiple):
    width, height = fitting_size(round(6000 * aspect), 6000, area, multiple)
    assert width % multiple == height % multiple == 0
    # One multiple of ~16 columns is 6 %; area and shape trade within about two of them.
    assert 0.85 < width * height / area < 1.18
    assert 0.9 < width / height / min(max(aspect, 0.5), 2) < 1.1


def test_the_common_shapes():
    assert fitting_size(4000, 4000, 224 * 224, 14) == (224, 224)
    assert fitting_size(4032, 3024, 224 * 224, 14) in ((252, 196), (266, 196))
    assert fitting_size(10, 10, 14 * 14, 14) == (14, 14)


def _dot_picture(width: int, height: int, x: int, y: int) -> Image.Image:
    """A white square of 24 pixels centred at the corner (x, y) of four pixels, on black."""
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[y - 12 : y + 12, x - 12 : x + 12] = 255
    return Image.fromarray(pixels)


def _centre_of_light(image: torch.Tensor) -> tuple[float, float]:
    light = image.mean(0).double()
    light = light / light.sum()
    xs, ys = torch.arange(light.shape[1]) + 0.5, torch.arange(light.shape[0]) + 0.5
    return float((light.sum(0) * xs).sum()), float((light.sum(1) * ys).sum())


@pytest.mark.parametrize(
    ("width", "height", "orientation", "kind"),
    [
        (640, 480, 1, "png"),
        (1000, 400, 1, "png"),
        (1300, 1111, 3, "png"),
        (2048, 1536, 1, "jpg"),
        (4096, 3072, 6, "jpg"),
    ],
)
def test_a_ray_through_a_dot_stays_the_same_ray(tmp_path, width, height, orientation, kind):
    """The dot's pixel in the view, unprojected with the view's K, is its ray in the photo."""
    upright = (height, width) if orientation == 6 else (width, height)
    x, y = round(upright[0] * 0.56), round(upright[1] * 0.41)
    picture = _dot_picture(*upright, x, y)
    turns = {6: Image.Transpose.ROTATE_90, 3: Image.Transpose.ROTATE_180}
    stored = picture.transpose(turns[orientation]) if orientation in turns else picture
    path = saved(stored, tmp_path / f"a.{kind}", quality=95, exif=exif(orientation=orientation))
    lens = (0.8 * upright[0], 0.7 * upright[0], 0.48 * upright[0], 0.53 * upright[1])
    views = load_views([path], intrinsics=lens)
    seen_x, seen_y = _centre_of_light(views.images[0])
    K = views.Ks[0]
    # The dot is symmetric, so its centre of light survives resampling to a few hundredths of a
    # pixel (8-bit rounding and JPEG ripple); a half-pixel convention error would be 0.5.
    assert seen_x == pytest.approx(float(K[0, 0]) * (x - lens[2]) / lens[0] + float(K[0, 2]), abs=0.06)
    assert seen_y == pytest.approx(float(K[1, 1]) * (y - lens[3]) / lens[1] + float(K[1, 2]), abs=0.06)


def test_others_are_cropped_to_the_shape_of_the_first(tmp_path):
    wide = saved(room_picture(800, 600), tmp_path / "wide.png")
    tall = saved(room_picture(600, 800, seed=1), tmp_path / "tall.png")
    views = load_views([wide, tall], fov=60)
    assert views.images.shape[0] == 2 and views.size == fitting_size(800, 600, 224 * 224, 14)
    assert views.images.dtype == torch.float32
    assert views.images.min() >= 0 and views.images.max() <= 1
    assert [note for note in views.warnings if "tall.png has another shape than wide.png" in note]
    # The crop of `tall` is as wide as the photo, so its focal length scales with its width.
    focal = 0.5 * 800 / np.tan(np.radians(30))
    assert float(views.Ks[1, 0, 0]) == pytest.approx(focal * views.size[0] / 600, rel=1e-5)
    assert float(views.Ks[1, 0, 2]) == pytest.approx(views.size[0] / 2, abs=1e-3)
    assert float(views.Ks[1, 1, 2]) == pytest.approx(views.size[1] / 2, abs=1e-3)


def test_sources_are_small_jpegs_of_the_same_crop(tmp_path):
    views = load_views([saved(room_picture(1600, 900), tmp_path / "a.png")], fov=60)
    with Image.open(io.BytesIO(views.sources[0])) as source:
        assert source.format == "JPEG" and 700 < max(source.size) <= 768
        assert source.width * views.size[1] == source.height * views.size[0]
        small = np.asarray(source.resize(views.size, Image.Resampling.LANCZOS)).astype(int)
    seen = np.asarray(views.images[0].permute(1, 2, 0) * 255).round().astype(int)
    # JPEG at quality 88 and one more resampling; another crop would differ by tens of counts.
    assert np.abs(small - seen).mean() < 4


def test_a_small_photo_is_enlarged_but_its_source_is_not(tmp_path):
    views = load_views([saved(room_picture(80, 60), tmp_path / "a.png")])
    assert views.size[0] > 200
    with Image.open(io.BytesIO(views.sources[0])) as source:
        assert max(source.size) <= 80


def test_a_panorama_is_cropped_to_two_to_one(tmp_path):
    views = load_views([saved(room_picture(2000, 400), tmp_path / "pano.jpg")])
    assert views.size[0] / views.size[1] == pytest.approx(2, rel=0.1)
    assert [note for note in views.warnings if note.startswith("pano.jpg is 5.0 times")]


def test_exif_decides_when_nothing_is_given(tmp_path):
    known = saved(room_picture(400, 300), tmp_path / "known.jpg", exif=exif(focal_35mm=28))
    unknown = saved(room_picture(400, 300, seed=2), tmp_path / "unknown.jpg")
    views = load_views([known, unknown])
    scale = views.size[0] / 400 if views.size[0] * 300 < views.size[1] * 400 else views.size[1] / 300
    focal = 28 / np.hypot(36, 24) * 500
    scale = max(views.size[0] / 400, views.size[1] / 300)  # the crop keeps the tighter side
    assert float(views.Ks[0, 0, 0]) == pytest.approx(focal * scale, rel=1e-4)
    assumed = [note for note in views.warnings if "a field of view of 65° is assumed" in note]
    assert (
        len(assumed) == 1
        and assumed[0].startswith("unknown.jpg does not")
        and "known.jpg and" not in assumed[0]
    )
    assert not [note for note in load_views([unknown], fov=60).warnings if "assumed" in note]


def test_views_without_some_are_those_of_the_other_photos_alone(tmp_path):
    """Photos of two lenses and one that does not say, each left out in turn; and given poses."""
    said = ({"exif": exif(focal_35mm=28)}, {}, {"exif": exif(focal_35mm=50)})
    paths = [
        saved(room_picture(400, 300, seed=seed), tmp_path / f"{seed}.jpg", **kept)
        for seed, kept in enumerate(said)
    ]
    whole = load_views(paths)
    for gone in ([2], [1], [0], [0, 2]):
        some = views_without(whole, gone, ["left out"])
        alone = load_views([path for row, path in enumerate(paths) if row not in gone])
        assert (some.images == alone.images).all() and (some.Ks == alone.Ks).all()
        assert (some.names, some.sources, some.lenses) == (alone.names, alone.sources, alone.lenses)
        assert some.warnings == (*alone.warnings, "left out")
    posed = replace(whole, viewmats=torch.eye(4).repeat(3, 1, 1))
    poses = views_without(posed, [1]).viewmats
    assert poses is not None and poses.shape == (2, 4, 4)
    with pytest.raises(ValueError, match="expected none of 0"):
        views_without(posed, [0])


def test_a_warning_goes_with_its_photo_and_not_with_one_whose_name_is_a_part_of_it():
    lines = (
        "1.jpg is blurred; take it again",
        "11.jpg is blurred",
        "1.jpg.jpg is dark",
        "1.jpg and b.jpg are dark",
    )
    names = ("a.jpg", "1.jpg", "11.jpg", "1.jpg.jpg", "b.jpg")
    views = Views(torch.zeros(5, 3, 14, 14), torch.eye(3).repeat(5, 1, 1), names, warnings=lines)
    assert views_without(views, [1]).warnings == ("11.jpg is blurred", "1.jpg.jpg is dark")


def test_files_of_one_name_are_told_apart(tmp_path):
    paths = []
    for folder, seed in (("left", 0), ("right", 1)):
        (tmp_path / folder).mkdir()
        paths.append(saved(room_picture(seed=seed), tmp_path / folder / "photo.png"))
    assert load_views(paths).names == ("left/photo.png", "right/photo.png")


def test_counts_and_mixed_sizes_are_refused(tmp_path):
    path = saved(room_picture(), tmp_path / "a.png")
    with pytest.raises(InputError, match="no photo"):
        load_views([])
    with pytest.raises(InputError, match="301 photos are too many"):
        load_views([path] * 301)
    other = saved(room_picture(400, 300), tmp_path / "b.png")
    with pytest.raises(InputError, match="photos of one size"):
        load_views([path, other], intrinsics=(300, 300, 160, 120))
    with pytest.raises(ImageError, match="does not exist"):
        load_views([path, tmp_path / "c.png"])
    with pytest.raises(ValueError, match="multiple"):
        load_views([path], area=10, multiple=14)
