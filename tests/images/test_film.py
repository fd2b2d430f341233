"""Films are read upright, with their times; what cannot be read is one sentence."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from langflash_core.errors import Cancelled, FilmError
from langflash_core.images.film import open_film
from langflash_core.images.settings import LOOKING
from tests import films

FIRST = films.seen(0.0)


def nothing() -> None:
    pass


def read(
    path: Path, start: float = 0.0, end: float | None = None, check: Callable[[], None] = nothing
) -> list[tuple[float, np.ndarray]]:
    with open_film(path) as reader:
        return list(reader.pictures(start, end, check))


@pytest.fixture(scope="module")
def film(tmp_path_factory) -> Path:
    return films.write(tmp_path_factory.mktemp("film") / "walk.mp4", films.walk(45), 15)


def alike(one: np.ndarray, other: np.ndarray) -> bool:
    return one.shape == other.shape and float(np.abs(one.astype(int) - other).mean()) < 8


@pytest.mark.parametrize("degrees, turn", [
    (90, cv2.ROTATE_90_COUNTERCLOCKWISE), (180, cv2.ROTATE_180), (270, cv2.ROTATE_90_CLOCKWISE),
])  # fmt: skip
def test_a_rotation_flag_is_followed(film: Path, degrees: int, turn: int) -> None:
    path = films.turned(film, degrees)
    _, first = read(path)[0]
    assert alike(first, cv2.rotate(FIRST, turn))
    with open_film(path) as reader:
        assert (reader.film.height, reader.film.width) == first.shape[:2]


def test_times_are_those_of_the_film(film: Path) -> None:
    pictures = read(film)
    assert alike(pictures[0][1], FIRST) and len(pictures) == 45
    np.testing.assert_allclose([seconds for seconds, _ in pictures], np.arange(45) / 15, atol=2e-3)
    part = read(film, 1.0, 2.0)
    assert part[0][0] == pytest.approx(1.0) and part[-1][0] == pytest.approx(2.0) and len(part) == 16


def test_of_many_frames_a_second_some_are_looked_at(tmp_path: Path) -> None:
    path = films.write(tmp_path / "fast.mp4", films.walk(60, 2.0), 60)
    assert len(read(path)) == pytest.approx(LOOKING.looks, abs=1)


def test_ten_bits_of_hevc_are_read(film: Path) -> None:
    out = film.with_name("hevc.mov")
    words = ("-c:v", "libx265", "-x265-params", "log-level=none", "-pix_fmt", "yuv420p10le")
    films.ffmpeg("-i", film, *words, out)
    assert alike(read(out)[0][1], FIRST)


def test_pixels_become_square(film: Path) -> None:
    out = film.with_name("wide.mp4")
    films.ffmpeg("-i", film, "-vf", "setsar=2", out)
    assert read(out)[0][1].shape == (240, 640, 3)
    on_its_side = films.turned(out, 90)
    assert read(on_its_side)[0][1].shape == (640, 240, 3)


def test_whoever_asks_to_stop_is_heard(film: Path) -> None:
    def stop() -> None:
        raise Cancelled("enough")

    with pytest.raises(Cancelled):
        read(film, check=stop)


def test_what_is_no_film_is_a_sentence(film: Path, tmp_path: Path, capfd) -> None:
    content = film.read_bytes()
    (tmp_path / "broken.mp4").write_bytes(content[:900])
    (tmp_path / "noise.mp4").write_bytes(np.random.default_rng(0).bytes(4000))
    (tmp_path / "empty.mp4").touch()
    films.ffmpeg("-f", "lavfi", "-i", "sine=d=1", tmp_path / "sound.m4a")
    films.write(tmp_path / "tiny.mp4", [frame[:48, :48] for frame in films.walk(4)])
    for name, said in (
        ("broken.mp4", "no film that can be decoded"), ("noise.mp4", "no film that can be decoded"),
        ("sound.m4a", "no film that can be decoded"), ("empty.mp4", "empty file"),
        ("gone.mp4", "there is no film"), ("tiny.mp4", "only 48 x 48"), (".", "is a folder"),
    ):  # fmt: skip
        with pytest.raises(FilmError, match=said) as raised:
            read(tmp_path / name)
        assert raised.value.exit_code == 2
    assert capfd.readouterr().err == "", "decoders say nothing themselves"


@pytest.fixture(scope="module")
def fields(film: Path) -> Path:
    """Of a walk of 50 pictures a second."""
    return films.write(film.with_name("fields.mp4"), films.walk(100, 3.0), 50)


@pytest.mark.parametrize("codec, suffix", [
    (films.H264, ".mp4"), (films.MPEG2, ".ts"), (films.MPEG2, ".mpg"),
    (("-c:v", "mpeg4", "-q:v", "2"), ".avi"), (("-c:v", "prores_ks"), ".mov"),
])  # fmt: skip
def test_interlaced_pictures_are_taken_apart(fields: Path, codec: tuple[str, ...], suffix: str) -> None:
    path = films.interlaced(fields, fields.with_name(f"interlaced{suffix}"), *codec)
    pictures = read(path)
    assert len(pictures) == pytest.approx(2.0 * LOOKING.looks, abs=1)
    part = read(path, 0.8, 1.4)
    assert part[0][0] == pytest.approx(0.8) and 1.4 - 1 / LOOKING.looks < part[-1][0] <= 1.4 + 1e-6
    for seconds, picture in (*pictures[::7], *part[::7]):  # of its two moments the first
        assert alike(picture, films.seen(3.0 * round(50 * seconds))), seconds


def test_interlaced_pictures_are_upright_and_their_pixels_square(fields: Path) -> None:
    path = films.interlaced(fields, fields.with_name("upright.mp4"), *films.H264)
    assert alike(read(films.turned(path, 90))[0][1], cv2.rotate(FIRST, cv2.ROTATE_90_COUNTERCLOCKWISE))
    assert alike(read(films.turned(path, 270))[0][1], cv2.rotate(FIRST, cv2.ROTATE_90_CLOCKWISE))
    wide = films.interlaced(fields, fields.with_name("wide.mp4"), *films.H264, "-aspect", "8:3")
    assert read(wide)[0][1].shape == (240, 640, 3)


def test_a_film_that_is_interlaced_from_the_middle_on_is_read_to_its_end(fields: Path) -> None:
    pictures = read(films.mixed(fields, 1.0))
    seconds, last = pictures[-1]
    assert seconds > 1.8 and alike(last, films.seen(3.0 * round(50 * seconds)))
    times = [each for each, _ in pictures]
    assert times == sorted(set(times)) and np.diff(times).max() < 0.15


def test_av1_is_read(film: Path) -> None:
    """OpenCV may open it, and decode none of its pictures."""
    out = film.with_name("av1.mkv")
    films.ffmpeg("-i", film, "-c:v", "libsvtav1", "-preset", "10", "-crf", "20", out)
    pictures = read(out)
    assert len(pictures) == pytest.approx(45, abs=1) and alike(pictures[0][1], FIRST)


def test_without_a_program_pictures_that_come_equal_are_doubtful(fields: Path, film: Path, alone) -> None:
    # A second of interlaced pictures: 15 looks, the last whole one that they repeat, and one by rounding.
    for path, least, most in ((films.mixed(fields, 1.0), 15, 17), (film, 0, 0)):
        with open_film(path) as reader:
            count = sum(1 for _ in reader.pictures(0.0, None, nothing))
            assert least <= reader.doubtful <= most < count
