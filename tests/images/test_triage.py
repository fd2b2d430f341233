"""Constructed faults are named, real photos pass without a false alarm."""

import numpy as np
import pytest
from PIL import Image, ImageFilter

from langflash_core.base.resources import asset_path
from langflash_core.images.views import load_views
from tests.images.pictures import room_picture, saved

PAIRS = ("books", "aloe", "living_room", "desk", "toy")


def real_photos(pair: str):
    suffix = "jpg" if pair in ("books", "aloe") else "png"
    return [asset_path(f"photos/{pair}_{side}.{suffix}") for side in ("left", "right")]


def warnings_of(tmp_path, *images: Image.Image, fov: float = 60) -> tuple[str, ...]:
    return load_views(
        [saved(image, tmp_path / f"{i}.png") for i, image in enumerate(images)], fov=fov
    ).warnings


def dimmed(image: Image.Image, gain: float) -> Image.Image:
    return Image.fromarray((np.asarray(image) * float(gain)).clip(0, 255).astype(np.uint8))


@pytest.mark.parametrize("pair", PAIRS)
def test_real_photos_give_no_false_alarm(pair):
    """Both views are usable by eye, also the dim books: only the lens is unknown."""
    assert load_views(real_photos(pair), fov=60).warnings == ()
    assert len(load_views(real_photos(pair)).warnings) == 1


@pytest.mark.parametrize("pair", PAIRS)
def test_faults_put_into_real_photos_are_named(tmp_path, pair):
    photo = Image.open(real_photos(pair)[0]).convert("RGB")
    soft = photo.filter(ImageFilter.GaussianBlur(0.008 * min(photo.size)))
    pixels = np.asarray(photo).astype(float)
    shifts = range(round(0.03 * photo.height))
    smeared = np.mean([np.roll(pixels, shift, axis=1) for shift in shifts], axis=0)
    faults = {
        "blurred": soft,
        "is blurred": Image.fromarray(smeared.astype(np.uint8)),
        "very dark": dimmed(photo, 0.15),
        "over-exposed": dimmed(photo, 6),
    }
    for words, picture in faults.items():
        (note,) = warnings_of(tmp_path, picture)
        assert note.startswith("0.png") and words in note, (pair, words, note)


def test_blur_is_judged_at_any_resolution(tmp_path):
    sharp = room_picture(1600, 1200)
    assert warnings_of(tmp_path, sharp) == ()
    unseen = sharp.filter(ImageFilter.GaussianBlur(2))  # 0.17 % of the side
    assert warnings_of(tmp_path, unseen) == ()
    (note,) = warnings_of(tmp_path, sharp.filter(ImageFilter.GaussianBlur(10)))
    assert "blurred" in note
    (note,) = warnings_of(tmp_path, sharp.filter(ImageFilter.GaussianBlur(10)).resize((400, 300)))
    assert "blurred" in note


def test_plain_walls_are_not_called_blurred(tmp_path):
    shading = np.linspace(120, 200, 480)[None, :, None] * np.ones((360, 1, 3))
    wall = Image.fromarray(shading.astype(np.uint8))
    assert warnings_of(tmp_path, wall) == ()
    noisy = shading + np.random.default_rng(0).normal(0, 4, shading.shape)
    noisy[:, 230:235] = 60  # one sharp pole
    assert warnings_of(tmp_path, Image.fromarray(noisy.clip(0, 255).astype(np.uint8))) == ()


def test_small_identical_and_extreme_lenses_are_named(tmp_path):
    (note,) = warnings_of(tmp_path, room_picture(240, 180))
    assert "0.png is small (240 x 180 pixels)" in note
    first, again = room_picture(), room_picture()
    (note,) = warnings_of(tmp_path, first, room_picture(seed=1), again)
    assert note.startswith("0.png and 2.png show the same picture; take them from")
    assert len(warnings_of(tmp_path, *[first] * 4)) == 3
    (note,) = warnings_of(tmp_path, *[first] * 5)
    assert note.startswith("4 of 5 photos show the same picture as one before them")
    assert "very narrow field of view (20 degrees)" in warnings_of(tmp_path, first, fov=20)[0]
    assert "very wide field of view (120 degrees)" in warnings_of(tmp_path, first, fov=120)[0]
    assert warnings_of(tmp_path, first, fov=25) == warnings_of(tmp_path, first, fov=110) == ()


def test_every_note_is_one_plain_sentence(tmp_path):
    notes = warnings_of(
        tmp_path, room_picture(500, 100), room_picture(100, 500), dimmed(room_picture(), 0.1), fov=170
    )
    assert len(notes) >= 6
    for note in notes:
        assert "\n" not in note and len(note) < 200
        assert any(name in note for name in ("0.png", "1.png", "2.png"))
