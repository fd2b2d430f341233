"""Contact sheets: every tile is there, in order, under its caption."""

import numpy as np

from langflash_core.export.sheet import add_caption, contact_sheet


def plain(level: int, height: int = 60, width: int = 80) -> np.ndarray:
    return np.full((height, width, 3), level, np.uint8)


def test_tiles_stand_in_rows_as_they_come():
    sheet = contact_sheet([(f"tile {n}", plain(40 * (n + 1))) for n in range(5)], columns=3)
    height, width = sheet.shape[0] // 2, sheet.shape[1] // 3
    middles = [
        int(sheet[row * height + 110, column * width + 120, 0]) for row in range(2) for column in range(3)
    ]
    assert middles == [40, 80, 120, 160, 200, 0]


def test_a_caption_is_above_its_picture_and_stays_within():
    cell = add_caption(plain(0), "a caption that is much longer than eighty pixels")
    assert cell.shape[1] == 84 and cell[:18].max() > 200 and not cell[18:].any()
    assert not cell[:, -2:].any()
    assert np.array_equal(add_caption(plain(7), "")[18:-4, 2:-2], plain(7))


def test_one_tile_is_a_sheet():
    assert contact_sheet([("", plain(9))]).shape[1] == 244
