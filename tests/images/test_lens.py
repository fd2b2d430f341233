"""Focal lengths from the user, from EXIF, or assumed."""

import math

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import fov_degrees
from langflash_core.images.decode import read_photo
from langflash_core.images.lens import check_lens, exif_focal, known_lenses, photo_intrinsics
from langflash_core.images.settings import LENS_PRIOR
from langflash_core.types import FoundFocal, Lenses
from tests.images.pictures import exif, room_picture, saved

TOLERANCE = 1e-4  # EXIF rationals are stored as fractions, float32 in K


def photo_with(tmp_path, width=400, height=300, **tags):
    return read_photo(saved(room_picture(width, height), tmp_path / "a.jpg", exif=exif(**tags)))


def test_the_35mm_equivalent_compares_diagonals(tmp_path):
    focal = exif_focal(photo_with(tmp_path, focal_35mm=26))
    assert focal == pytest.approx(26 / math.hypot(36, 24) * 500, rel=TOLERANCE)


def test_the_35mm_equivalent_is_the_same_for_a_turned_photo(tmp_path):
    photo = photo_with(tmp_path, focal_35mm=26, orientation=6)
    assert (photo.width, photo.height) == (300, 400)
    assert exif_focal(photo) == pytest.approx(26 / math.hypot(36, 24) * 500, rel=TOLERANCE)


@pytest.mark.parametrize(("unit", "per_mm"), [(2, 1 / 25.4), (3, 1 / 10), (4, 1.0)])
def test_the_focal_plane_counts_pixels_of_the_picture_as_taken(tmp_path, unit, per_mm):
    density = 250.0 / per_mm
    tags = {"focal": 4.0, "plane_x": density, "plane_unit": unit, "pixel_x": 4000, "pixel_y": 3000}
    assert exif_focal(photo_with(tmp_path, **tags)) == pytest.approx(4.0 * 250 * 400 / 4000, rel=TOLERANCE)


def test_the_focal_plane_without_a_recorded_size_counts_the_photo_itself(tmp_path):
    tags = {"focal": 5.0, "plane_x": 2032.0, "plane_unit": 2}
    assert exif_focal(photo_with(tmp_path, **tags)) == pytest.approx(5.0 * 2032 / 25.4, rel=TOLERANCE)


@pytest.mark.parametrize(
    "tags", [{}, {"focal_35mm": 0}, {"focal_35mm": 1}, {"focal_35mm": 60000}, {"focal": 4.0}]
)
def test_absent_or_impossible_tags_say_nothing(tmp_path, tags):
    photo = photo_with(tmp_path, **tags)
    assert exif_focal(photo) is None
    K, assumed = photo_intrinsics(photo)
    assert assumed
    assert max(fov_degrees(K, 400, 300)) == pytest.approx(65, rel=TOLERANCE)


def test_what_the_user_gives_wins_over_exif(tmp_path):
    photo = photo_with(tmp_path, focal_35mm=26)
    K, assumed = photo_intrinsics(photo, fov=90)
    assert not assumed and K[0, 0] == pytest.approx(200, rel=TOLERANCE)
    K, assumed = photo_intrinsics(photo, intrinsics=(310, 320, 201, 149))
    assert not assumed
    assert torch.equal(K, torch.tensor([[310.0, 0, 201], [0, 320, 149], [0, 0, 1]]))


def test_a_principal_point_outside_the_photo_is_refused(tmp_path):
    with pytest.raises(InputError, match="principal point 900,10"):
        photo_intrinsics(photo_with(tmp_path), intrinsics=(300, 300, 900, 10))


@pytest.mark.parametrize(
    ("fov", "intrinsics", "message"),
    [
        (60, (1, 1, 1, 1), "only one"), (0, None, "1 to 179"), (180, None, "1 to 179"),
        (math.nan, None, "1 to 179"), (None, (1, 2, 3), "FX,FY,CX,CY"), (None, (0, 1, 1, 1), "above 0"),
        (None, (math.inf, 1, 1, 1), "pixels"),
    ],
)  # fmt: skip
def test_lenses_that_cannot_be_are_refused(fov, intrinsics, message):
    with pytest.raises(InputError, match=message):
        check_lens(fov, intrinsics)


def test_photos_of_one_camera_share_a_lens(tmp_path):
    plain = photo_with(tmp_path)
    turned = photo_with(tmp_path, width=300, height=400)
    smaller = photo_with(tmp_path, width=320, height=240)
    recorded = photo_with(tmp_path, focal_35mm=26)
    photos = [plain, turned, smaller, recorded, recorded]
    lenses = known_lenses(photos, [None] * 5, None, "assumed")
    assert lenses is not None and lenses.of == (0, 0, 1, 2, 2)
    assert lenses.fovs == pytest.approx([LENS_PRIOR.assumed_fov, LENS_PRIOR.assumed_fov, 67.3], abs=0.1)
    assert lenses.recorded == (False, False, True) and lenses.doubts[0] > 10 * lenses.doubts[2] > 0
    given = known_lenses(photos, [None, 70.0, None, None, None], None, "")
    assert given is not None and given.doubts[given.of[1]] == 0 and given.fovs[given.of[1]] == 70
    assert known_lenses(photos, [60.0] * 5, None, "") is None
    assert known_lenses(photos, [None] * 5, (300, 300, 200, 150), "") is None


def test_what_photos_tell_of_a_lens_is_said_in_degrees():
    lenses = Lenses((0, 0, 1), (65.0, 50.0), (0.35, 0.02), (False, True), "assumed")
    focal, error = 1.1, 0.01
    [found] = lenses.found([FoundFocal(focal, error, 8), None])
    half = math.tan(math.radians(32.5))
    wider, narrower = (2 * math.degrees(math.atan(half / (focal * (1 + d)))) for d in (-1e-5, 1e-5))
    assert found.fov == pytest.approx(2 * math.degrees(math.atan(half / focal)))
    assert found.error == pytest.approx((wider - narrower) / 2e-5 * error, rel=1e-4)
    assert str(found) == "60.2 ± 0.5 degrees, found from 8 photos (assumed: 65.0)"
    assert lenses.settled([found]) and not lenses.settled([])
    [recorded] = lenses.found([None, FoundFocal(1.0, error, 3)])
    assert "recorded: 50.0" in str(recorded) and not lenses.settled([recorded])
