"""Commands write where they were told to and nowhere else."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from app.cli import main
from langflash_core.export import export
from tests.app.cli.conftest import stripes
from tests.base.test_picture_files import RED, encoded

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_seen: list[set[str]] = []


def _note(event: str, arguments: tuple) -> None:
    """Remember what is opened to write, made, moved or removed while a test listens."""
    if not _seen:
        return
    if event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
        mode, flags = arguments[1] or "", arguments[2] or 0
        if set(mode) & set("wax+") or (not mode and flags & _WRITES):
            _seen[-1].add(os.path.abspath(os.fsdecode(arguments[0])))
    elif event in ("os.mkdir", "os.remove", "os.rename", "os.link", "os.symlink", "os.truncate"):
        paths = arguments[:2] if event in ("os.rename", "os.link", "os.symlink") else arguments[:1]
        _seen[-1] |= {os.path.abspath(os.fsdecode(path)) for path in paths if not isinstance(path, int)}


sys.addaudithook(_note)


@contextmanager
def written() -> Iterator[set[str]]:
    _seen.append(set())
    try:
        yield _seen[-1]
    finally:
        _seen.pop()


@pytest.fixture
def scene(tmp_path, monkeypatch) -> Path:
    for name in ("LANGFLASH_HOME", "LANGFLASH_STATE", "LANGFLASH_CONFIG"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    photos = (encoded(RED, "JPEG"),) * 2
    posed = replace(stripes(), photos=photos).with_record(photos=("../../left.jpg", "/etc/right.jpg"))
    export(posed, tmp_path / "in.langflash")
    return tmp_path / "in.langflash"


@pytest.mark.parametrize(
    "name",
    ["a.ply", "a.compressed.ply", "a.splat", "a.sog", "meta.json", "a.glb", "a.langflash", "transforms.json",
     "cameras.txt", "a.html"],
)  # fmt: skip
def test_export_stays_in_its_folder(scene, tmp_path, name):
    """Also of a scene whose photos are called after places elsewhere."""
    out = tmp_path / "out"
    out.mkdir()
    with written() as places:
        assert main(["export", str(scene), "-o", str(out / name)]) == 0
    assert places and all(Path(place).is_relative_to(out) or place == os.devnull for place in places)
    assert (out / name).is_file() and not (tmp_path / "home").exists()


def test_looking_writes_nothing(scene, tmp_path, capsys):
    with written() as places:
        assert main(["info", str(scene)]) == 0
        assert main(["info", "--limits"]) == 0
        assert main(["info", str(tmp_path / "gone.ply")]) == 2
    assert not {place for place in places if place != os.devnull}
    assert not (tmp_path / "home").exists()


def test_the_watch_sees_writes(tmp_path):
    with written() as places:
        (tmp_path / "a").write_bytes(b"x")
        os.rename(tmp_path / "a", tmp_path / "b")
    assert places == {str(tmp_path / "a"), str(tmp_path / "b")}


@pytest.mark.parametrize(
    ("words", "name"),
    [
        *((("export",), f"a{ending}") for ending in (".ply", ".langflash", ".sog", ".spz", ".html")),
        (("export", "--what", "depth"), "a.png"),
        (("export", "--prompt", "armchair", "--what", "labels"), "a.png"),
        (("export", "--prompt", "armchair", "--what", "boxes", "--replace"), "a.json"),
        (("render",), "a.png"),
        (("level",), "a.langflash"),
        (("clean", "--strength", "0.5"), "a.langflash"),
    ],
)
def test_a_symbolic_link_is_written_through(scene, tmp_path, capsys, words, name):
    """The link stays one, and the file that it leads to is the new one."""
    link, target = tmp_path / "out" / name, tmp_path / "far" / "kept.bin"
    link.parent.mkdir()
    target.parent.mkdir()
    target.write_bytes(b"old")
    link.symlink_to(target)
    command, *others = words
    code = main([command, str(scene), *others, "-o", str(link)])
    assert code == 0, capsys.readouterr().err
    assert link.is_symlink() and target.stat().st_size > 3 and os.listdir(target.parent) == ["kept.bin"]


@pytest.mark.parametrize("command", ["export", "render", "level"])
@pytest.mark.parametrize("kind", ["circle", "nowhere", "device", "read-only"])
def test_a_link_that_nothing_can_be_written_through_is_refused_before_the_work(
    scene, tmp_path, capsys, command, kind
):
    name = "a.png" if command == "render" else "a.langflash"
    link, target = tmp_path / "out" / name, tmp_path / "target"
    link.parent.mkdir()
    if kind == "circle":
        target.symlink_to(link)
    elif kind == "nowhere":
        target = tmp_path / "gone" / "target"
    elif kind == "device":
        target = Path(os.devnull)
    else:
        target.write_bytes(b"old")
        target.chmod(0o444)
    link.symlink_to(target)
    with written() as places:
        assert main([command, str(scene), "-o", str(link)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and name in said and "; " in said
    assert not {place for place in places if place != os.devnull}, "nothing was begun"
    assert link.is_symlink() and (kind != "read-only" or target.read_bytes() == b"old")
