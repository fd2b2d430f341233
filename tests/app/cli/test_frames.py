"""`langflash frames`, and films where photos are taken."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from langflash_core.images.film import Reader
from langflash_core.images.pictures import photo_names
from langflash_core.images.settings import PHOTO_LIMITS
from langflash_core.images.still_names import is_still
from tests import films


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("home")
    monkeypatch.setenv("LANGFLASH_HOME", str(folder))
    return folder


@pytest.fixture(scope="module")
def walk(tmp_path_factory) -> Path:
    return films.write(tmp_path_factory.mktemp("film") / "walk.mp4", films.walk(40, 10.0))


def test_a_folder_of_frames_named_by_their_times(done, walk: Path, tmp_path: Path) -> None:
    out, sheet = tmp_path / "frames", tmp_path / "sheet.png"
    outcome = done("frames", walk, "-o", out, "--most", 6, "--sheet", sheet, "--json")
    assert outcome.err == ""
    document = outcome.json()
    names = sorted(path.name for path in out.glob("*.jpg"))
    assert names == [frame["file"] for frame in document["frames"]] and len(names) == 6
    assert names == [f"walk.mp4 @ {frame['seconds']:.2f} s.jpg" for frame in document["frames"]]
    assert document["frames_looked_at"] == 40 == 6 + sum(document["left_out"].values())
    assert all(0.4 < frame["of_sharpest_near"] <= 1 for frame in document["frames"])
    moved = [frame["moved"] for frame in document["frames"][1:]]
    assert document["frames"][0]["moved"] is None and min(moved) > 0.1 and max(moved) < 0.4
    kept = json.loads((out / "frames.json").read_bytes())
    assert kept["frames"] == document["frames"]
    with Image.open(sheet) as picture:
        assert picture.width > 400 and np.asarray(picture).std() > 20


def test_the_folder_is_replaced_and_nothing_else_is(run, done, walk: Path, tmp_path: Path) -> None:
    out = tmp_path / "frames"
    done("frames", walk, "-o", out)
    first = sorted(out.iterdir())
    again = done("frames", walk, "-o", out, "--most", 3)
    assert "3 of 40 frames; 37 lay between the chosen ones" in again.out
    assert sum(map(is_still, os.listdir(out))) == 3 < len(first) - 1
    (out / "diary.txt").write_text("mine")
    refused = run("frames", walk, "-o", out)
    assert refused.code == 2 and "diary.txt" in refused.err and len(list(out.iterdir())) == 5
    assert run("frames", walk, "-o", walk).code == 2
    refused = run("frames", walk, "-o", tmp_path / "other", "--sheet", tmp_path / "sheet.txt")
    assert refused.code == 2 and refused.err.endswith("; rename --sheet\n")
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("words, said", [
    (("--most", "1"), "whole number from 2"), (("--from", "2", "--to", "1"), "not after"),
    (("--from", "-1"), "not below 0"), (("--from", "60"), "nothing from 60 s on"),
    (("--every", "0"), "above 0"),
])  # fmt: skip
def test_words_that_cannot_be_meant(refused, walk: Path, tmp_path: Path, words, said: str) -> None:
    assert said in refused("frames", walk, "-o", tmp_path / "frames", *words)


def test_a_film_of_nothing_writes_nothing(run, tmp_path: Path) -> None:
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(b"no film")
    still = films.write(tmp_path / "still.mp4", [films.seen(0)] * 10)
    for film, said in ((broken, "no film that can be decoded"), (still, "stands still")):
        for words in (
            ("frames", film, "-o", tmp_path / "out"),
            ("reconstruct", film, "-o", tmp_path / "a.langflash"),
        ):
            done = run(*words)
            assert done.code == 2 and said in done.err and done.err.count("\n") == 1
    assert not (tmp_path / "out").exists() and not (tmp_path / "a.langflash").exists()


def test_a_scene_out_of_a_film(run, done, walk: Path, tmp_path: Path, monkeypatch) -> None:
    """Photos are called by film and time; a second scene of the same film decodes nothing."""
    scene = tmp_path / "room.langflash"
    words = ("reconstruct", walk, "-o", scene, "--frames", 3, "--size", 56, "--json")
    outcome = done(*words)
    (told,) = outcome.json()["films"]
    assert told["film"] == "walk.mp4" and told["chosen"] == 3 and told["left_out"]["between"] == 37
    info = run("info", scene, "--json").json()
    assert all(name.startswith("walk.mp4 @ ") and name.endswith(" s") for name in info["photos"])
    monkeypatch.setattr(Reader, "pictures", None)
    done(*words)


def test_films_beside_photos_share_the_room(walk: Path, tmp_path: Path) -> None:
    from app.cli.films import with_frames

    def silent(stage: str, fraction: float) -> None:
        pass

    photos = [tmp_path / f"{number}.jpg" for number in range(PHOTO_LIMITS.max_photos - 5)]
    taken, told, _ = with_frames([photos[0], walk, *photos[1:]], silent)
    assert len(taken) == PHOTO_LIMITS.max_photos and taken[0] == photos[0] and told[0]["chosen"] == 5
    assert photo_names(taken)[1].startswith("walk.mp4 @ ")


@pytest.mark.parametrize("words, said", [
    (["--frames", "4"], "are for films"), (["--from", "1"], "are for films"),
])  # fmt: skip
def test_options_of_films_without_one(refused, tmp_path: Path, words: list[str], said: str) -> None:
    Image.new("RGB", (200, 200)).save(tmp_path / "a.png")
    assert said in refused("reconstruct", tmp_path / "a.png", "-o", tmp_path / "a.langflash", *words)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_killed_while_it_looks_it_leaves_nothing_and_begins_again(done, tmp_path: Path, home: Path) -> None:
    """Killed at once, in the middle of a film; and stopped by Ctrl-C."""
    film = films.write(tmp_path / "long.mp4", [films.seen(4.0 * (i % 300)) for i in range(900)])
    for number, code in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 130)):
        words = [sys.executable, "-m", "langflash_core", "frames", str(film), "-o", str(tmp_path / "out")]
        environment = {**os.environ, "LANGFLASH_PROGRESS": "lines", "LANGFLASH_HOME": str(home)}
        with subprocess.Popen(words, env=environment, stderr=subprocess.PIPE, text=True) as running:
            assert running.stderr is not None
            for line in running.stderr:
                if float(line.split("\t")[1]) > 0.1:
                    break
            running.send_signal(number)
            running.stderr.read()
            assert running.wait(60) == code
        assert not (tmp_path / "out").exists()
    time.sleep(0.1)
    done("frames", film, "-o", tmp_path / "out", "--to", 4)
    assert [path.name for path in (home / "films").iterdir() if path.name.startswith(".")] == []
