"""Dropped and typed paths."""

from pathlib import Path

import pytest

from app.window.scene.drops import There, Typed, look_up, sort_drop, typed_path, typed_scene
from langflash_core.errors import OutputError
from langflash_core.files import write_atomically


def test_paths_that_no_disk_takes_are_said_to_be_missing() -> None:
    long = "a" * 300  # of a name most file systems take 255 bytes
    assert typed_scene(Typed(long)) == Path(f"{long}.langflash")  # writing it fails, with a sentence
    assert sort_drop([long, "nul\0"]).rejected == tuple(
        f"{path} does not exist; check the path." for path in (long, "nul\0")
    )
    with pytest.raises(OutputError, match="too long; choose another place"):
        write_atomically(Path(f"{long}.langflash"), b"")


def test_typed_paths_name_a_scene_or_nothing(tmp_path: Path) -> None:
    (tmp_path / "a room.langflash").touch()
    looked = [Typed(text, look_up(text, scene=True)) for text in ("", "  ", "/", "~", str(tmp_path))]
    assert [typed_scene(typed) for typed in looked] == [None] * 5
    assert look_up(f"{tmp_path}/a room", scene=True) is There.FILE, "what would be written"
    assert look_up(f"{tmp_path}/a room", scene=False) is There.NOTHING
    assert typed_scene(Typed(" room ")) == Path("room.langflash")
    assert typed_scene(Typed("~/a.scene")) == Path.home() / "a.scene"
    assert typed_path("~nobody-here/x") == Path("~nobody-here/x")


def test_drops_are_sorted(tmp_path: Path) -> None:
    folder = tmp_path / "a room"
    folder.mkdir()
    for name in ("b.JPG", "a.heic", "notes.txt", ".hidden.jpg"):
        (folder / name).touch()
    scene, text, empty = tmp_path / "s.langflash", tmp_path / "t.txt", tmp_path / "empty"
    scene.touch()
    text.touch()
    empty.mkdir()
    drop = sort_drop([folder, scene, text, empty, tmp_path / "gone.jpg", folder / "b.JPG"])
    assert [p.name for p in drop.photos] == ["a.heic", "b.JPG"]
    assert [p.name for p in drop.scenes] == ["s.langflash"]
    (tmp_path / "bonsai.PLY").touch()
    assert [p.name for p in sort_drop([tmp_path / "bonsai.PLY"]).scenes] == ["bonsai.PLY"]
    assert [s.split(" ")[0] for s in drop.rejected[:1]] == ["t.txt"]
    assert "holds no photo" in drop.rejected[1] and "does not exist" in drop.rejected[2]
