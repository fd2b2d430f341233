"""Photos that no scene is in: two of them here, all of them by `python -m tests.torture photos`."""

import pytest
import torch

from langflash_core.errors import ImageError
from langflash_core.images.settings import JUDGING
from langflash_core.images.triage import check_shown
from tests.torture import hard_photos
from tests.torture.rows import Row


@pytest.mark.parametrize("name", ["black", "constant"])
def test_photos_of_nothing_make_no_scene(name, tmp_path):
    hard = next(each for each in hard_photos.sets() if each.name == name)
    row = Row(name)
    assert hard_photos.made(hard, hard_photos.written(hard, tmp_path), row) is None
    assert row.finds == [] and row.told.startswith("the photos show nothing")


def test_what_is_nearly_dark_is_still_taken():
    """A ramp of just so much, and a little less; one photo that shows something is enough."""
    ramp = torch.linspace(0, 1, 101).expand(3, 8, 101)
    check_shown(["a"], [ramp * JUDGING.blank_spread / 0.98])
    check_shown(["a", "b"], [ramp * 0, ramp])
    with pytest.raises(ImageError, match="a shows nothing"):
        check_shown(["a"], [ramp * JUDGING.blank_spread / 1.1])


def test_two_photos_of_noise_make_a_finite_scene(tmp_path):
    """And what would not be finite is found."""
    hard = next(each for each in hard_photos.sets() if each.name == "noise")
    row = Row(hard.name)
    scene = hard_photos.made(hard, hard_photos.written(hard, tmp_path), row)
    assert scene is not None and row.finds == []
    scene.gaussians.means[3] = torch.nan
    assert next(iter(hard_photos._wrong(scene))) == "means is not finite"
