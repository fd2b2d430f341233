"""Which of a scene's photos trust is read from, without OpenGL."""

from itertools import pairwise

from app.gl.photos import MOST_PHOTOS, spread


def test_of_many_photos_some_are_asked_from_the_first_to_the_last() -> None:
    for count in (1, 2, MOST_PHOTOS):
        assert spread(count) == list(range(count))
    for count in (MOST_PHOTOS + 1, 128, 300):
        views = spread(count)
        assert len(set(views)) == MOST_PHOTOS and views[0] == 0 and views[-1] == count - 1
        gaps = [b - a for a, b in pairwise(views)]
        assert max(gaps) - min(gaps) <= 1
