"""`langflash reconstruct FOLDER`: what of a folder is taken, and in which order."""

import shutil
from pathlib import Path

import pytest

from langflash_core import pipeline
from langflash_core.base.resources import asset_path
from langflash_core.errors import ImageError
from langflash_core.images.settings import PHOTO_LIMITS

PHOTO = asset_path("photos/books_left.jpg")


@pytest.fixture
def taken(monkeypatch) -> list[list[str]]:
    """Names of the photos of every reconstruction that is asked for; none is done."""
    found = []

    def reconstruct(photos, **others):
        found.append([Path(photo).name for photo in photos])
        raise ImageError("no scene is wanted; this is a test")

    monkeypatch.setattr(pipeline, "reconstruct", reconstruct)
    return found


@pytest.fixture
def folder(tmp_path) -> Path:
    place = tmp_path / "kitchen"
    (place / "older.jpg").mkdir(parents=True)
    return place


def test_its_photos_in_the_order_of_their_names(run, taken, folder, tmp_path):
    for name in ("c.JPG", "a.jpg", "b.jpeg", ".b.jpg"):
        shutil.copyfile(PHOTO, folder / name)
    (folder / "clip.mp4").write_bytes(b"beside photos a film does not count")
    (folder / "notes.txt").write_text("flour, eggs")
    alone = tmp_path / "z.jpg"
    shutil.copyfile(PHOTO, alone)
    for words in ((folder,), (alone, folder)):
        assert "this is a test" in run("reconstruct", *words, "-o", tmp_path / "a.langflash").err
    assert taken == [["a.jpg", "b.jpeg", "c.JPG"], ["z.jpg", "a.jpg", "b.jpeg", "c.JPG"]]


def test_its_films_where_it_has_no_photos(refused, folder, tmp_path):
    (folder / "clip.mp4").write_bytes(b"no film, but that is seen when it is opened")
    assert "clip.mp4" in refused("reconstruct", folder, "-o", tmp_path / "a.langflash")


def test_nothing_usable(refused, taken, folder, tmp_path):
    (folder / "notes.txt").write_text("flour, eggs")
    said = refused("reconstruct", folder, "-o", tmp_path / "a.langflash")
    assert not taken and said.startswith(f"langflash: the folder {folder} holds no photos and no films; ")


def test_more_photos_than_a_scene_takes(refused, taken, folder, tmp_path):
    for number in range(PHOTO_LIMITS.max_photos + 1):
        (folder / f"{number:03}.jpg").touch()
    said = refused("reconstruct", folder, "-o", tmp_path / "a.langflash")
    assert not taken and f"{PHOTO_LIMITS.max_photos + 1} photos are too many" in said
