"""Which frames of a film are taken: sharp ones, spaced by what moves; and what is not decoded twice."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from langflash_core.errors import Cancelled, FilmError
from langflash_core.images import frames
from langflash_core.images.film import Reader
from langflash_core.images.frames import remaining, strip_of
from langflash_core.images.settings import STILLS
from langflash_core.images.strip import Choice, Strip, choose, notes_on
from tests import films


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def chosen(path: Path, most: int = 32, **options) -> tuple[Strip, Choice]:
    strip = strip_of(path, **options)
    choice = choose(strip, most)
    assert sum(choice.left.values()) + len(choice.chosen) == strip.num_looked_at
    return strip, choice


def times(strip: Strip, choice: Choice) -> np.ndarray:
    return np.array([strip.stills[index].seconds for index in choice.chosen])


def test_frames_are_spaced_by_what_moves_and_not_by_time(tmp_path: Path) -> None:
    """Two seconds slow, two seconds still with a hand that shakes, two seconds fast."""
    rng = np.random.default_rng(0)
    ways = [np.linspace(0, 120, 30), 120 + rng.normal(0, 0.7, 30), np.linspace(120, 840, 30)]
    path = films.write(tmp_path / "walk.mp4", [films.seen(x) for x in np.concatenate(ways)])
    strip, choice = chosen(path)
    of = [int(((times(strip, choice) >= a) & (times(strip, choice) < a + 2)).sum()) for a in (0, 2, 4)]
    assert of[1] <= 1 and of[0] >= 3 and of[2] > 3 * of[0], of
    gaps = np.diff([strip.stills[index].place for index in choice.chosen])
    assert gaps.min() > 0.06 and gaps.max() < 0.2
    assert choice.left["repeats"] == 0 and strip.shots == 1 and not notes_on(strip, choice)


def around(share: float) -> np.ndarray:
    """A wall behind boxes on every second stripe, from a way around them: the eye turns aside and back, and
    what is near goes on."""
    aside = 40 * np.sin(np.pi * share)
    far, near = films.seen(aside), films.seen(aside + 90 * share, picture=films.wall(7))
    stripes = (np.arange(films.SIZE[1]) // 24 % 2 == 0)[:, None, None]
    return np.where(stripes, far, near)


def test_who_goes_around_something_is_followed_to_the_end(tmp_path: Path) -> None:
    """Though what the middle of the corners shows has come back to where it was."""
    strip, choice = chosen(films.write(tmp_path / "walk.mp4", [around(i / 89) for i in range(90)]))
    taken = times(strip, choice) / strip.seconds
    assert taken[0] < 0.1 and taken[-1] > 0.9 and len(taken) >= 8
    assert np.diff(taken).max() < 0.4, "where the eye turns back it takes a ruler's length to be noticed"


def test_a_hand_that_sways_goes_nowhere(tmp_path: Path) -> None:
    """By up to a picture's fortieth around one place, some two degrees in all, for eight seconds."""
    ways = [7 * np.sin(np.arange(120) / 15 * each) for each in (3.1, 2.3)]
    path = films.write(
        tmp_path / "hand.mp4", [films.seen(60 + x, 100 + y) for x, y in zip(*ways, strict=True)]
    )
    strip, choice = chosen(path)
    assert strip.stills[-1].place - strip.stills[0].place < STILLS.ruler and len(choice.chosen) <= 3


def passed(share: float) -> np.ndarray:
    """A wall before which somebody walks, a fifth of the picture wide, as full of corners."""
    picture, wide = films.seen(60), films.SIZE[0] // 5
    left = round(share * (films.SIZE[0] + wide)) - wide
    begin, end = max(left, 0), min(left + wide, films.SIZE[0])
    picture[30:, begin:end] = films.seen(0, picture=films.wall(7))[30:, begin - left : end - left]
    return picture


def test_who_walks_through_moves_no_camera(tmp_path: Path) -> None:
    """Three times past a camera on a tripod, a fifth of its picture wide."""
    path = films.write(tmp_path / "tripod.mp4", [passed(i / 60 % 1) for i in range(180)])
    with pytest.raises(FilmError, match="stands still"):
        frames.frames(path)


def test_blurred_frames_are_left_out_and_counted(tmp_path: Path) -> None:
    pictures = [film if i % 3 == 1 else films.smeared(film) for i, film in enumerate(films.walk(60))]
    strip, choice = chosen(films.write(tmp_path / "walk.mp4", pictures))
    sharp = np.round(times(strip, choice) * films.RATE).astype(int) % 3 == 1
    assert sharp.mean() > 0.9 and choice.left["blurred"] > 20
    assert choice.relative[list(choice.chosen)].min() > 0.4


def test_where_all_is_blurred_something_is_taken_still(tmp_path: Path) -> None:
    """Else what is seen there would be missing."""
    pictures = [films.smeared(film) if 20 <= i < 45 else film for i, film in enumerate(films.walk(65, 12.0))]
    strip, choice = chosen(films.write(tmp_path / "walk.mp4", pictures))
    assert ((times(strip, choice) > 22 / 15) & (times(strip, choice) < 43 / 15)).any()
    assert choice.gap < 0.4


def test_there_and_back_is_taken_once(tmp_path: Path) -> None:
    there = films.walk(30, 12.0)
    _, choice = chosen(films.write(tmp_path / "walk.mp4", [*there, *there[::-1]]))
    _, alone = chosen(films.write(tmp_path / "there.mp4", there))
    assert choice.left["repeats"] >= 10 and len(choice.chosen) <= len(alone.chosen) + 1


def test_of_two_places_the_longer_one_is_taken(tmp_path: Path) -> None:
    other = films.wall(7)
    pictures = [films.seen(9.0 * i, picture=other) for i in range(15)] + films.walk(40)
    strip, choice = chosen(films.write(tmp_path / "walk.mp4", pictures))
    assert strip.shots == 2 and choice.left["other_shots"] == 15 and times(strip, choice).min() >= 1.0
    (note,) = notes_on(strip, choice)
    assert "2 places" in note and "--from" in note


def test_a_flash_or_a_fast_turn_parts_no_room(tmp_path: Path) -> None:
    pictures = films.walk(40)
    pictures[20] = np.random.default_rng(0).integers(0, 255, pictures[20].shape).astype(np.uint8)
    strip, choice = chosen(films.write(tmp_path / "walk.mp4", pictures))
    taken = times(strip, choice)
    assert taken.min() < 0.5 and taken.max() > 2.2 and not np.isclose(taken, 20 / 15, atol=0.01).any()
    turn = [films.seen(x) for x in (*range(0, 160, 8), *range(260, 460, 8))]
    strip, choice = chosen(films.write(tmp_path / "turn.mp4", turn))
    assert strip.shots == 1 and choice.left["other_shots"] == 0


def test_number_and_part(tmp_path: Path) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(60))
    strip, choice = chosen(path, 5)
    assert len(choice.chosen) == 5 and np.diff(times(strip, choice)).std() < 0.2
    part, choice = chosen(path, start=1.0, end=2.0)
    assert times(part, choice).min() >= 1 and times(part, choice).max() <= 2.01
    assert len(choose(part, 32, 14).chosen) == 14 > len(choice.chosen), "more than are needed, if asked for"
    strip, choice = chosen(path, every=0.5)
    assert len(choice.chosen) == 8 and np.all(np.abs(np.diff(times(strip, choice)) - 0.5) < 0.5)
    few = films.write(tmp_path / "wide.mp4", [films.seen(70.0 * i) for i in range(18)])
    assert any("far apart" in note for note in notes_on(*chosen(few, 3)))


def test_what_shows_nothing_is_a_sentence(tmp_path: Path, home: Path) -> None:
    rng = np.random.default_rng(0)
    black, wall = np.zeros((240, 320, 3), np.uint8), np.full((240, 320, 3), 170, np.uint8)
    noisy = [np.clip(14 + rng.normal(0, 3, black.shape), 0, 255).astype(np.uint8) for _ in range(20)]
    for name, pictures, said in (
        ("still.mp4", [films.seen(0)] * 20, "stands still"), ("black.mp4", [black] * 20, "too dark"),
        ("dark.mp4", noisy, "too dark"), ("wall.mp4", [wall] * 20, "bare wall"),
        ("one.mp4", [films.seen(0)], "single picture"),
    ):  # fmt: skip
        with pytest.raises(FilmError, match=said):
            chosen(films.write(tmp_path / name, pictures))
    with pytest.raises(FilmError, match="nothing from 9 s on"):
        chosen(tmp_path / "still.mp4", start=9.0)
    assert len(list((home / "films").iterdir())) == 1, "nothing of those is kept but the still's frame"


def test_what_the_decoder_does_is_not_blamed_on_who_filmed(tmp_path: Path, alone, home: Path) -> None:
    """Black, still, bare: OpenCV gives whatever lay in its memory for interlaced pictures."""
    whole = films.write(tmp_path / "my walk.mp4", films.walk(60, 4.0), 30)
    path = films.interlaced(whole, tmp_path / "my tape.ts", *films.MPEG2)
    with pytest.raises(FilmError) as refused:
        strip_of(path)
    said = str(refused.value)
    assert said.startswith("my tape.ts comes as equal pictures from the decoder, as interlaced films do; ")
    assert "langflash[video]" in said and said.endswith("ffmpeg -i 'my tape.ts' -vf yadif converted.mp4")
    assert not any((home / "films").iterdir())
    films.ffmpeg("-i", path, *said.split("'my tape.ts' ")[1].split()[:2], tmp_path / "converted.mp4")
    strip, choice = chosen(tmp_path / "converted.mp4")
    assert not notes_on(strip, choice) and len(choice.chosen) > 4, "as the sentence says"


def test_a_film_that_the_decoder_reads_in_part_says_so(tmp_path: Path, alone) -> None:
    film = films.write(tmp_path / "walk.mp4", films.walk(150, 3.0), 50)
    notes = notes_on(*chosen(films.mixed(film, 2.0)))
    # 15 of 45 looks, the last whole picture that they repeat, and one by rounding.
    shares = tuple(f"{share}% of mixed.mkv comes as equal pictures" for share in range(33, 39))
    assert any(note.startswith(shares) for note in notes), notes


@pytest.mark.parametrize(("part", "said"), [
    ((1.0, 1.03), "shows one picture only from 1 to 1.03 s; take a longer part with --from and --to"),
    ((0.0, 0.03), "one picture only from 0 to 0.03 s"), ((1.26, None), "one picture only from 1.26 s on"),
    ((1.01, 1.03), "shows no picture from 1.01 to 1.03 s"),
])  # fmt: skip
def test_a_part_that_is_too_short_says_so(
    tmp_path: Path, part: tuple[float, float | None], said: str
) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(20))
    with pytest.raises(FilmError) as refused:
        strip_of(path, start=part[0], end=part[1])
    assert said in str(refused.value)


def test_a_strip_is_as_long_as_its_film_says(tmp_path: Path) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(30))
    assert strip_of(path).seconds == 2.0 == strip_of(path, end=60.0).seconds
    assert strip_of(path, start=0.5, end=1.5).seconds == 1.0


def test_a_film_of_a_picture_a_second_ends_where_its_last_one_does(tmp_path: Path) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(20)[::10], 1)
    strip = strip_of(path)
    assert strip.seconds == 2.0 and not strip.notes


def test_a_film_that_ends_too_early_says_so(tmp_path: Path) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(60), films.RATE, "-movflags", "+faststart")
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    strip, choice = chosen(path)
    assert any("cannot be decoded" in note for note in notes_on(strip, choice))
    assert strip.seconds < 3.5, "of 4 it says"


def test_nothing_is_decoded_twice(tmp_path: Path, home: Path, monkeypatch) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(30))
    first = strip_of(path)
    with monkeypatch.context() as patch:
        patch.setattr(Reader, "pictures", None)
        assert strip_of(path) == first
    assert all(path.is_file() for path in map(first.path, range(len(first.stills))))
    first.path(0).unlink()
    assert strip_of(path) == first and first.path(0).is_file(), "what is not whole is made again"
    films.write(path, films.walk(40))
    assert strip_of(path).num_looked_at > first.num_looked_at, "another film of the same name"


def test_only_the_last_films_are_kept(tmp_path: Path, home: Path, monkeypatch) -> None:
    monkeypatch.setattr(frames, "STILLS", replace(frames.STILLS, kept_films=2))
    for name in ("a", "b", "c"):
        last = strip_of(films.write(tmp_path / f"{name}.mp4", films.walk(8)))
    assert len(list((home / "films").iterdir())) == 2 and last.folder.is_dir()


def test_whoever_stops_it_leaves_nothing(tmp_path: Path, home: Path) -> None:
    path, seen = films.write(tmp_path / "walk.mp4", films.walk(40)), list[float]()

    def stop() -> None:
        if seen and seen[-1] > 0.5:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        strip_of(path, progress=lambda stage, share: seen.append(share), check=stop)
    assert seen == sorted(seen) and list((home / "films").iterdir()) == []


def test_a_long_film_keeps_a_bounded_number(tmp_path: Path, monkeypatch) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(90))
    many = strip_of(path)
    monkeypatch.setattr(frames, "STILLS", replace(frames.STILLS, most_stills=10))
    few = strip_of(path, start=1e-9)  # another key of the cache
    assert len(few.stills) <= 10 < len(many.stills) and few.num_looked_at == many.num_looked_at
    assert len(list(few.folder.glob("*.jpg"))) == len(few.stills)
    assert choose(few, 32).gap < 1.0


def test_large_pictures_are_kept_smaller(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(frames, "STILLS", replace(frames.STILLS, still_side=160))
    strip = strip_of(films.write(tmp_path / "walk.mp4", films.walk(20)))
    kept = cv2.imread(str(strip.path(0)))
    assert kept is not None and kept.shape == (120, 160, 3)


def test_the_same_film_gives_the_same_frames(tmp_path: Path, home: Path) -> None:
    path = films.write(tmp_path / "walk.mp4", films.walk(40))
    first = strip_of(path)
    first.folder.rename(home / "films" / "elsewhere")
    second = strip_of(path)
    assert replace(second, folder=first.folder) == first
    for index in range(len(first.stills)):
        elsewhere = home / "films" / "elsewhere" / first.stills[index].file
        assert elsewhere.read_bytes() == second.path(index).read_bytes()


def test_what_remains_is_told_once_it_is_known() -> None:
    assert remaining(0.01, 0.0, 10.0) == "" and remaining(0.5, 0.0, 0.5) == ""
    assert remaining(0.25, 0.0, 10.0) == ", 30 s left"
