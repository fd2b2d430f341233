"""Calls fail one after the other: a few of each kind here, all of them by `python -m tests.torture calls`."""

import errno
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import moderngl
import pytest
import torch

from app.cli import main
from langflash_core.base.graphics import refusals_said
from langflash_core.base.memory import out_of_memory
from langflash_core.errors import GraphicsError
from tests.torture import jobs, nth
from tests.torture.failing import failing, small_disk

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the harness knows Linux")
SOME = ("save", "autosave of edits", "autosave of a session", "preferences", "recovery of edits")
SOME = (*SOME, "recovery of a session", "export .ply", "export .json boxes")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("calls")


@pytest.fixture(scope="module")
def known(folder) -> Iterator[dict[str, nth.Job]]:
    before = {name: os.environ.get(name) for name in jobs.FOLDERS}
    yield {job.name: job for job in jobs.prepared(folder)}
    for name, value in before.items():
        os.environ.pop(name) if value is None else os.environ.update({name: value})


@pytest.mark.parametrize("name", SOME)
def test_a_few_failures_do_no_harm(known, folder, name):
    for row in nth.torture(known[name], folder, 0.3):
        assert not row.finds, row.finds
        assert row.tried or not row.calls


def test_jobs_share_the_time_and_what_is_left_out_is_said(known, folder):
    """In the seed's order; that is all a bound on the processor's time can promise."""
    some = [known["preferences"], known["save"]]
    assert [row.told for row in nth.everything(some, folder, 0.0)] == ["left out"] * 2
    for seed, first in ((1, "preferences"), (5, "save")):
        rows = list(nth.everything(some, folder, 0.3, seed))
        assert rows[0].name == f"{first}: place" and rows[0].tried and not any(row.finds for row in rows)


def test_there_is_a_job_for_every_kind_of_file(known):
    names = " ".join(known)
    assert all(word in names for word in (".langflash", ".html", ".mp4", "reconstruct", "batch", "train"))
    assert len(known) > 45


def test_the_nth_call_fails_and_no_other(tmp_path):
    path = tmp_path / "a"
    for number in (1, 2, 3):
        with failing("place", number, tmp_path, errno.EROFS) as fault:
            seen = []
            for step in range(3):
                try:
                    path.write_bytes(b"x" * 9)
                    seen.append(step)
                except OSError as error:
                    assert error.errno == errno.EROFS
        assert len(seen) == 2 and number - 1 not in seen and fault.calls == 3
    with failing("write", 1, tmp_path), pytest.raises(OSError):
        path.write_bytes(b"y" * 10)
    assert path.read_bytes() == b"y" * 5  # half of it, as a full disk leaves it
    with failing("read", 2, tmp_path), pytest.raises(OSError):
        path.read_bytes()
    (tmp_path.parent / "elsewhere").write_bytes(b"")
    with failing("place", 1, tmp_path) as fault:
        (tmp_path.parent / "elsewhere").write_bytes(b"")
    assert not fault.failed


def test_memory_fails_where_it_is_large(tmp_path):
    with failing("memory", 1, tmp_path), pytest.raises(RuntimeError) as caught:
        _ = torch.ones(1 << 18) * 2
    assert out_of_memory(caught.value) and out_of_memory(MemoryError())
    assert not out_of_memory(ValueError("of another kind"))
    with failing("memory", 1, tmp_path) as fault:
        _ = torch.ones(1000) * 2
    assert fault.calls == 0


def test_out_of_memory_is_one_sentence(known, folder, capsys):
    with failing("memory", 3, folder):
        words = ("render", str(folder / "in" / "s.langflash"), "-o", str(folder / "m.png"), "--backend")
        assert main([*words, "torch", "--size", "320x240"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("langflash: out of memory; ") and said.count("\n") == 1
    assert not (folder / "m.png").exists()


def test_what_the_driver_refuses_is_one_sentence(known, folder, capsys):
    scene, picture = str(folder / "in" / "s.langflash"), folder / "p.png"
    picture.write_bytes(b"old")
    for number in (9, 14):
        with failing("graphics", number, folder) as fault:
            assert main(["render", scene, "-o", str(picture), "--backend", "gl"]) == 1, fault
        said = capsys.readouterr().err
        assert "driver refused" in said and said.count("\n") == 1 and picture.read_bytes() == b"old"


class Flagged:
    """A context whose driver has run out of memory and only sets a flag, as OpenGL does."""

    error = "GL_OUT_OF_MEMORY"


def test_a_picture_without_memory_is_no_picture():
    with pytest.raises(GraphicsError, match="out of memory; smaller"), refusals_said(Flagged(), "smaller"):  # type: ignore[arg-type]
        pass
    with refusals_said(None, "x"):
        pass
    with pytest.raises(GraphicsError, match=r"refused \(line one\); x"), refusals_said(None, "x"):
        raise moderngl.Error("\nline one\nline two")


@pytest.mark.parametrize("ending", [".usda", ".usdc", ".usdz"])
def test_a_full_disk_under_openusd_is_one_sentence(known, folder, capfd, ending):
    pytest.importorskip("pxr")
    path = folder / f"u{ending}"
    path.write_bytes(b"old")
    with small_disk(5000):
        assert main(["export", str(folder / "in" / "s.langflash"), "-o", str(path), "--replace"]) == 2
    said = capfd.readouterr().err
    assert said.startswith(f"langflash: cannot write {path.name}: OpenUSD says '") and said.count("\n") == 1
    assert path.read_bytes() == b"old" and not list(folder.glob(".*.part"))


def test_a_film_that_a_full_disk_cuts_off_is_not_taken_for_whole(known, folder, capfd):
    pytest.importorskip("imageio_ffmpeg")
    words = ["export", str(folder / "in" / "s.langflash"), "--seconds", "0.2", "--size", "48x36"]
    for name in ("f.webp", "f.mp4"):
        path = folder / name
        path.write_bytes(b"old")
        with small_disk(700):
            assert main([*words, "-o", str(path), "--backend", "torch"]) == 2
        said = capfd.readouterr().err
        assert "encoder" in said and said.count("\n") == 1
        assert path.read_bytes() == b"old" and not list(folder.glob(".*.part"))
