"""Films are read upright, with their times; what cannot be read is one sentence."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from langflash_core.errors import Cancelled, FilmError
from langflash_core.images.film import LOOKS, opened
from tests import films

FIRST = films.seen(0.0)


def nothing() -> None:
    pass


def read(
    path: Path, start: float = 0.0, end: float | None = None, check: Callable[[], None] = nothing
) -> list[tuple[float, np.ndarray]]:
    with opened(path) as reader:
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
    with opened(path) as reader:
        assert (reader.film.height, reader.film.width) == first.shape[:2]


def test_times_are_those_of_the_film(film: Path) -> None:
    pictures = read(film)
    assert alike(pictures[0][1], FIRST) and len(pictures) == 45
    np.testing.assert_allclose([seconds for seconds, _ in pictures], np.arange(45) / 15, atol=2e-3)
    part = read(film, 1.0, 2.0)
    assert part[0][0] == pytest.approx(1.0) and part[-1][0] == pytest.approx(2.0) and len(part) == 16


def test_of_many_frames_a_second_some_are_looked_at(tmp_path: Path) -> None:
    path = films.write(tmp_path / "fast.mp4", films.walk(60, 2.0), 60)
    assert len(read(path)) == pytest.approx(LOOKS, abs=1)


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
