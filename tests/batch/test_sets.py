"""Sets from folders and tables; what cannot be one is refused with its place."""

import pytest

from langflash_core.batch.sets import read_sets
from langflash_core.errors import InputError


def _named(sets):
    return [(each.name, [photo.name for photo in each.photos]) for each in sets]


def test_folders(tmp_path):
    for path in ("b/2.jpg", "b/1.JPG", "b/notes.txt", "b/.3.jpg", "a/x.heic", ".git/x.jpg", "out/x.jpg"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).touch()
    (tmp_path / "empty").mkdir()
    (tmp_path / "loose.jpg").touch()
    expected = [("a", ["x.heic"]), ("b", ["1.JPG", "2.jpg"]), ("empty", [])]
    assert _named(read_sets(tmp_path, tmp_path / "out")) == expected


@pytest.mark.parametrize(
    "text",
    [
        "name,photos\nhall,in/a.jpg,b.jpg\n\nden,c.jpg,,\n",
        "hall,in/a.jpg,b.jpg\nden, c.jpg",
        "\ufeffName;first;second\r\nhall;in/a.jpg;b.jpg\r\nden;c.jpg;\r\n",
        'hall,"in/a.jpg",b.jpg\nden,"c.jpg"',
    ],
)
def test_tables(tmp_path, text):
    table = tmp_path / "sets.csv"
    table.write_text(text, encoding="utf-8", newline="")
    sets = read_sets(table, tmp_path / "out")
    assert _named(sets) == [("hall", ["a.jpg", "b.jpg"]), ("den", ["c.jpg"])]
    assert sets[0].photos[0] == tmp_path / "in" / "a.jpg"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "names no set"),
        (b"name,photos\n", "names no set"),
        (b"hall,a.jpg\nden\n", "line 2: 'den' has no photos"),
        (b"hall,a.jpg\nden,b.jpg\nHall,c.jpg\n", "lines 1 and 3 are both called 'Hall'"),
        (b"../hall,a.jpg\n", "line 1: '../hall' cannot be the name of a folder"),
        (b"..,a.jpg\n", "cannot be the name"),
        (b",a.jpg\n", "cannot be the name"),
        (b"summary.html,a.jpg\n", "cannot be the name"),
        (b"x" * 300 + b",a.jpg\n", "cannot be the name"),
        (b"\xff\xfe\x00,a.jpg\n", "CSV in UTF-8"),
        (b"hall,a" + b"x" * 200_000 + b"\n", "not a table"),
    ],
)
def test_bad_tables(tmp_path, content, said):
    table = tmp_path / "sets.csv"
    table.write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_sets(table, tmp_path / "out")
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_no_sets(tmp_path):
    for path, said in ((tmp_path, "no sub-folders"), (tmp_path / "nowhere", "neither a folder nor")):
        with pytest.raises(InputError, match=said):
            read_sets(path, tmp_path / "out")
    with pytest.raises(InputError, match="choose another -o"):
        read_sets(tmp_path, tmp_path)
