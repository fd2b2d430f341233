"""Small pictures on the graphics card: how many, and which go first."""

import numpy as np

from app.window.kit.textures import Thumbnails


def test_the_picture_nobody_asked_for_longest_goes_first(gl) -> None:
    thumbnails = Thumbnails(gl, most_bytes=3 * 3 * 10 * 20)  # three of them
    picture = np.zeros((10, 20, 3), np.uint8)
    for name in ("a", "b", "c"):
        thumbnails.put(name, picture)
    assert thumbnails.get("a") is not None  # b has waited longest now
    thumbnails.put("d", picture)
    assert [thumbnails.get(name) is not None for name in "abcd"] == [True, False, True, True]
    thumbnails.put("large", np.zeros((100, 100, 3), np.uint8))
    assert [thumbnails.get(name) is not None for name in ("a", "c", "d", "large")] == [
        False,
        False,
        False,
        True,
    ]
    thumbnails.release()
