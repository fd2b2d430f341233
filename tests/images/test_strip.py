"""The choice among stills against a twin that tries all; names; and the strip's index."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from langflash_core.errors import FilmError
from langflash_core.images import strip as module
from langflash_core.images.pictures import photo_names
from langflash_core.images.settings import CHOOSING, PHOTO_LIMITS
from langflash_core.images.still_names import is_still, shown_name, still_name
from langflash_core.images.strip import Still, Strip, choose, encode_index, read_strip


def strip(places, sharpness, why_not=None, **more) -> Strip:
    reasons = why_not or [""] * len(places)
    stills = tuple(
        Still(still_name("a.mp4", i / 10, 9), i / 10, float(s), float(p), 1, why_not=reason)
        for i, (p, s, reason) in enumerate(zip(places, sharpness, reasons, strict=True))
    )
    return Strip("a.mp4", Path("nowhere"), len(places) / 10, stills, **more)


@pytest.mark.parametrize("seed", range(8))
def test_the_choice_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, worth = np.cumsum(rng.uniform(0.02, 0.3, 9)), np.log(rng.uniform(0.2, 1, 9))
    count = int(rng.integers(2, 6))
    spacing = np.ptp(places) / (count - 1)

    def value(chosen: tuple[int, ...]) -> float:
        ratios = np.diff(places[list(chosen)]) / spacing
        ends = [(places[chosen[0]] - places[0]) / spacing, (places[-1] - places[chosen[-1]]) / spacing]
        cost = CHOOSING.uneven * (((ratios - 1) ** 2).sum() + np.square(ends).sum())
        return worth[list(chosen)].sum() - cost - 10.0 * (ratios < CHOOSING.narrowest).sum()

    found = tuple(module._best(places, worth, count).tolist())
    best = max(itertools.combinations(range(9), count), key=value)
    assert value(found) == pytest.approx(value(best))


def test_stills_of_elsewhere_and_repeats_take_no_room() -> None:
    reasons = ["", "", "", *["repeat"] * 20, "", "", ""]
    places = CHOOSING.spacing * np.arange(26)
    choice = choose(strip(places, np.ones(26), reasons), 32)
    assert set(choice.chosen) <= {0, 1, 2, 23, 24, 25} and choice.left["repeats"] == 20
    assert choice.gap < 1.5 * CHOOSING.spacing, "and not the twenty that lie between"


def test_a_film_without_a_way_is_refused() -> None:
    for places in ([0.0], [0.0, 0.001, 0.002]):
        with pytest.raises(FilmError, match="stands still"):
            choose(strip(places, np.ones(len(places))), 32)
    assert choose(strip([0.0, 0.03], [1.0, 1.0]), 32).chosen == (0, 1)
    assert len(choose(strip([0.0] * 3 + [0.05] * 3, np.ones(6)), 4, 4).chosen) == 4


def test_names_carry_the_time_and_sort_by_it() -> None:
    names = [still_name("my walk.mp4", seconds, 125.0) for seconds in (3.271, 21.0, 119.995)]
    assert names == sorted(names) and all(map(is_still, names))
    assert shown_name(names[0]) == "my walk.mp4 @ 3.27 s" and shown_name(names[1]).endswith("@ 21.00 s")
    assert shown_name(still_name("a.mp4", 0.0, 9.0)) == "a.mp4 @ 0.00 s"
    assert shown_name("IMG_1.jpg") == "IMG_1.jpg" and not is_still("IMG_1.jpg")
    assert photo_names([Path("x") / names[0], Path("b.jpg")]) == ("my walk.mp4 @ 3.27 s", "b.jpg")


def test_an_index_that_is_not_whole_is_none(tmp_path: Path) -> None:
    kept = strip([0.0, 0.1], [1.0, 2.0], notes=("a note",))
    assert read_strip(tmp_path) is None
    (tmp_path / module.INDEX).write_bytes(encode_index(kept))
    assert read_strip(tmp_path) is None, "the frames are missing"
    for still in kept.stills:
        (tmp_path / still.file).touch()
    found = read_strip(tmp_path)
    assert found is not None and found.stills == kept.stills and found.notes == kept.notes
    for content in (b"", b"[]", b"{}", encode_index(kept).replace(b'"format": 3', b'"format": 2')):
        (tmp_path / module.INDEX).write_bytes(content)
        assert read_strip(tmp_path) is None


def test_of_a_way_too_long_for_one_scene_the_begin_is_taken() -> None:
    places = np.linspace(0, 40, 401)
    long = strip(places, np.ones(401))
    choice = choose(long, PHOTO_LIMITS.film_photos)
    assert len(choice.chosen) == PHOTO_LIMITS.film_photos and choice.gap < 0.7
    more = choose(long, 2 * PHOTO_LIMITS.film_photos)
    assert (
        len(more.chosen) == 2 * PHOTO_LIMITS.film_photos
        and more.until is not None
        and choice.until is not None
    )
    assert more.until > 1.9 * choice.until
    assert choice.until is not None and choice.left["beyond"] == sum(
        s.seconds > choice.until for s in long.stills
    )
    assert sum(choice.left.values()) + len(choice.chosen) == 401
    assert any("what comes after" in note for note in module.notes_on(long, choice))
    assert choose(strip(places[:80], np.ones(80)), 32).until is None
