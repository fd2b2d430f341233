"""`lab eval real`: which frames are photos, which are held back, and the table of what was found."""

from pathlib import Path

import pytest

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.real import chosen_frames, real_markdown, summary


def _frames(count: int) -> list[Path]:
    return [Path(f"{place:04d}.png") for place in range(count)]


def _places(some: list[Path]) -> list[int]:
    return [int(path.stem) for path in some]


def test_a_frame_is_held_back_between_each_two_photos():
    kept, held = chosen_frames(_frames(17), 5)
    assert _places(kept) == [0, 4, 8, 12, 16] and _places(held) == [2, 6, 10, 14]


@pytest.mark.parametrize(("count", "photos"), [(17, 16), (32, 32), (9, 6), (2, 2)])
def test_where_frames_are_few_all_others_are_held_back(count, photos):
    kept, held = chosen_frames(_frames(count), photos)
    assert len(kept) == photos and sorted({*kept, *held}) == _frames(count)
    assert not {*kept} & {*held} and _places(kept)[0] == 0 and _places(kept)[-1] == count - 1


@pytest.mark.parametrize(("count", "photos"), [(5, 6), (5, 1), (0, 2)])
def test_more_photos_than_frames_are_refused(count, photos):
    with pytest.raises(InputError, match="cannot be chosen from"):
        chosen_frames(_frames(count), photos)


def test_the_table_says_the_worst_and_leaves_out_what_was_not_judged():
    row = {"psnr": 30.0, "structure": 0.9, "fog": 0.0, "covered": 1.0}
    case = {"photos": 2, "placed": 1.0, "gaussians": 9.0, "seconds": 1.0, "cpu_seconds": 1.0, "between": {}}
    case["own"] = {"a": row, "b": {**row, "psnr": 34.0, "fog": 0.1, "alone_psnr": 20.0}}  # one found nothing
    table = real_markdown(summary([case]))
    assert "32.00 (30.00)" in table and "5.00 (10.00)" in table and "held back" not in table
    assert "| 32.00 (30.00) | 20.00 (20.00) |" in table
