"""Dropped and typed paths."""

import io
import os
from pathlib import Path

import pytest
from PIL import Image

from app.window.opening import native
from app.window.opening.work import listed
from app.window.scene.drops import (
    There,
    Typed,
    in_folder,
    look_up,
    sort_drop,
    told_few,
    typed_path,
    typed_scene,
)
from langflash_core.base.files import write_atomically
from langflash_core.base.formats import FILMS_IN, PHOTOS_IN
from langflash_core.base.outputs import SCENES_IN
from langflash_core.base.picture_files import FORMATS
from langflash_core.batch.sets import read_sets
from langflash_core.errors import OutputError
from langflash_core.export import export
from langflash_core.images.decode import read_photo
from tests.app.cli.conftest import stripes


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


def picture(kind: str = "JPEG") -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (64, 48), (90, 60, 30)).save(stream, kind)
    return stream.getvalue()


def test_every_usual_name_of_what_is_decoded_is_in_the_table() -> None:
    """Those that Pillow knows of the formats that the command line lets in; .pfm are depth maps."""
    Image.init()
    usual = {ending for ending, kind in Image.EXTENSION.items() if kind in FORMATS} - {".pfm"}
    heif = {".heic", ".heics", ".heif", ".heifs", ".hif"}  # of a plug-in that is not loaded here
    assert usual <= set(PHOTOS_IN) <= usual | heif | {".avif", ".avifs"} and ".jfif" in usual


@pytest.mark.parametrize("ending", [*PHOTOS_IN, ".JFIF", ".JPG"])
def test_a_photo_is_one_however_it_is_opened(tmp_path: Path, ending: str) -> None:
    """Named, as the command line does; dropped; from a folder; in the two dialogs; in a set of a batch."""
    folder = tmp_path / "sets" / "hall"
    folder.mkdir(parents=True)
    path = folder / f"a{ending}"
    path.write_bytes(picture())
    assert read_photo(path).width == 64
    one = (path.resolve(),)
    assert sort_drop([path]).photos == sort_drop([folder]).photos == one
    assert listed(folder).photos == (path,)
    assert read_sets(tmp_path / "sets", tmp_path / "out")[0].photos == (path,)
    assert f"*{ending}" in native.patterns(PHOTOS_IN).split()


@pytest.mark.parametrize("kind", [*SCENES_IN, *FILMS_IN])
def test_a_scene_or_film_that_the_command_line_opens_is_one_to_the_window(tmp_path: Path, kind: str) -> None:
    path = tmp_path / (f"a{kind}" if kind.startswith(".") else kind)
    path.touch()
    drop = sort_drop([path])
    assert (drop.films if kind in FILMS_IN else drop.scenes) == (path.resolve(),) and not drop.rejected
    assert (f"*{kind}" if kind.startswith(".") else kind) in native.patterns((*SCENES_IN, *FILMS_IN)).split()


@pytest.mark.parametrize("name", ["photo", "photo.jpg_large", "IMG_1.jpg~", "scan.pfm"])
def test_a_photo_whose_name_says_nothing_is_one_by_its_first_bytes(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    for content in (picture("JPEG"), picture("PNG"), picture("WEBP"), picture("BMP"), picture("TIFF")):
        path.write_bytes(content)
        assert read_photo(path).width == 64 and sort_drop([path]).photos == (path.resolve(),)
    path.write_bytes(b"\0\0\0\x18ftypheic" + bytes(90))
    assert sort_drop([path]).photos == (path.resolve(),)
    for content in (b"", b"P", b"no photo", b"%!PS-Adobe-3.0 EPSF", b"\0\0\0\x18ftypisom" + bytes(90)):
        path.write_bytes(content)
        assert sort_drop([path]).photos == () and "is no photo" in sort_drop([path]).rejected[0]


def test_a_folder_with_a_scene_in_pictures_is_that_scene(tmp_path: Path) -> None:
    """A SOG's pictures were taken for photos of a room."""
    export(stripes(), tmp_path / "meta.json")
    assert len(list(tmp_path.glob("*.webp"))) >= 4
    one = (tmp_path / "meta.json",)
    assert sort_drop([tmp_path]).scenes == one and sort_drop([tmp_path]).photos == ()
    assert listed(tmp_path).scenes == one and listed(tmp_path).photos == ()
    (tmp_path / "hall.webp").write_bytes(picture("WEBP"))
    assert [path.name for path in sort_drop([tmp_path]).photos] == ["hall.webp"]
    for foreign in (b"[]", b"{", b'{"means": 1}', b'{"a": {"files": 3}}'):
        (tmp_path / "meta.json").write_bytes(foreign)
        assert in_folder(tmp_path.iterdir()).scenes == () and len(in_folder(tmp_path.iterdir()).photos) > 4


@pytest.mark.skipif(os.name != "posix", reason="names are text there")
def test_a_name_that_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    """It would end the window: ImGui takes no text that is not UTF-8."""
    bad, good = Path(os.fsdecode(bytes(tmp_path) + b"/caf\xe9.jpg")), tmp_path / "a.jpg"
    for path in (bad, good):
        path.write_bytes(picture())
    link = tmp_path / "link.jpg"
    link.symlink_to(bad)
    drop = sort_drop([bad, good, link])
    assert [path.name for path in drop.photos] == ["a.jpg"] and len(drop.rejected) == 2
    assert "not UTF-8; rename it" in drop.rejected[0] and drop.rejected[0].encode()
    link.unlink()
    drop = sort_drop([tmp_path])
    assert [path.name for path in drop.photos] == ["a.jpg"] and "1 files" in drop.rejected[0]
    assert [path.name for path in listed(tmp_path).photos] == ["a.jpg"] and listed(tmp_path).unsaid == 1


def test_of_many_refusals_the_first_are_told_and_how_many_more(tmp_path: Path) -> None:
    rejected = sort_drop([tmp_path / f"{place}.jpg" for place in range(300)]).rejected
    told = told_few(rejected)
    assert told[:2] == rejected[:2] and told[2].startswith("298 more") and len(told) == 3
    assert told_few(rejected[:2]) == rejected[:2]
