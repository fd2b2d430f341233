"""Readers that are not ours run apart: what ends their processes is one sentence, and nothing else."""

import json
import os
import signal
import struct
import sys
import time
from collections.abc import Generator
from pathlib import Path

import numpy as np
import pytest

from langflash_core.base import apart
from langflash_core.base.apart import process, serving
from langflash_core.errors import FilmError, ImageError, InputError, SceneFileError
from langflash_core.export import read
from langflash_core.images.decode import read_photo
from langflash_core.images.film import open_film
from tests import films

# A reader that does what its request says, in the place of one of ours.
ODD = """
import os, signal, sys, time
import numpy as np

def answers(reader, request, content):
    do = request["do"]
    if do == "crash":
        yield {"n": 1}, {"a": np.arange(3)}
        os.kill(os.getpid(), signal.SIGSEGV)
    if do == "sleep":
        time.sleep(60)
    if do == "spin":
        while True:
            pass
    if do == "eat":
        held = []
        while True:
            held.append(bytearray(b"x" * 2**24))
    if do == "lines":
        raise ValueError("one\\n two")
    if do == "write":
        with open(request["path"], "wb") as stream:
            stream.write(b"x")
            stream.flush()
    if do == "lie":
        os.write(request["fd"] if "fd" in request else 1, b"printed")
    yield {"pid": os.getpid()}, {"shape": np.zeros((2, 0, 3), np.float32), "bytes": content}
"""


@pytest.fixture
def odd(monkeypatch, tmp_path: Path):
    """`ask`, where the reader "odd" is the one above."""
    package = tmp_path / "langflash_core" / "base" / "apart"
    package.mkdir(parents=True)
    for file in ("__init__.py", "process.py", "serving.py"):
        own = Path(apart.__file__).with_name(file)
        (package / file).write_text(own.read_text())
    core = Path(apart.__file__).parents[2]
    for file in (
        "__init__.py",
        "errors.py",
        "base/__init__.py",
        "base/devices.py",
        "base/limits.py",
        "base/threads.py",
    ):
        (tmp_path / "langflash_core" / file).write_text((core / file).read_text())
    (package / "odd.py").write_text(ODD)
    monkeypatch.setitem(serving.READERS, "odd", "odd")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    yield lambda content=b"", **request: list(apart.ask("odd", request, content))
    process.end_idle()


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_crash_is_told_after_what_came_before(odd):
    parts = apart.ask("odd", {"do": "crash"})
    assert next(parts).arrays["a"].tolist() == [0, 1, 2]
    with pytest.raises(apart.Ended, match=r"crashed \(SIGSEGV\)"):
        next(parts)


@pytest.mark.parametrize("do", ["sleep", "spin"])
def test_who_takes_too_long_is_ended(odd, monkeypatch, do):
    monkeypatch.setenv("LANGFLASH_MOST_SECONDS", "1")
    started = time.monotonic()
    with pytest.raises(apart.Ended, match=r"took longer than 1 seconds; .*LANGFLASH_MOST_SECONDS"):
        odd(do=do)
    assert time.monotonic() - started < 30  # and not the minute that it would take


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's bound")
def test_who_wants_too_much_memory_is_ended(odd, monkeypatch):
    monkeypatch.setenv("LANGFLASH_MOST_MEMORY", str(300 * 2**20))
    with pytest.raises(apart.Ended, match=r"wanted more than 300 MiB of memory"):
        odd(do="eat")


def test_what_a_reader_refuses_is_one_line(odd):
    with pytest.raises(apart.Refused, match=r"^one two$"):
        odd(do="lines")


@pytest.mark.skipif(sys.platform == "win32", reason="the kernel's bound")
def test_a_reader_cannot_write(odd, tmp_path):
    with pytest.raises(apart.Refused, match="too large"):
        odd(do="write", path=str(tmp_path / "written"))
    assert (tmp_path / "written").read_bytes() == b""


def test_processes_serve_again_after_a_good_end_alone(odd):
    (first,) = odd(b"content", do="")
    assert first.arrays["shape"].shape == (2, 0, 3) and first.arrays["bytes"].tobytes() == b"content"
    assert odd(do="lie")[0].facts == first.facts, "what libraries print is no answer"
    with pytest.raises(apart.Refused):
        odd(do="lines")
    assert odd(do="")[0].facts != first.facts
    if sys.platform != "win32":
        (waits,) = odd(do="")
        os.kill(waits.facts["pid"], signal.SIGKILL)
        assert odd(do="")[0].facts != waits.facts, "one that ended while it waited is replaced"


@pytest.mark.parametrize(
    "head",
    [
        b"no json", b"[]", b'{"kind": "part", "facts": {}, "arrays": [["a", "|O", [1]]]}',
        b'{"kind": "part", "facts": {}, "arrays": [["a", "<f8", [1000000000000]]]}',
        b'{"kind": "part", "facts": {}, "arrays": [["a", "<f8", [-1, -1]]]}',
    ],
)  # fmt: skip
def test_a_reader_that_was_taken_over_cannot_lie(head):
    """Answers whose types or sizes cannot be true: no object is unpickled, and no such memory taken."""
    worker = object.__new__(process._Worker)
    worker.bounds, worker._late, worker.served = (2**32, 60), False, False
    came, goes = os.pipe()
    os.write(goes, struct.pack("<Q", len(head)) + head)
    os.close(goes)
    worker._from = open(came, "rb", buffering=0)  # noqa: SIM115 - closed below
    with worker._from, pytest.raises(apart.Ended, match="cannot be true"):
        worker.answer()


def no_answer(reader: str, request: dict, content: bytes = b""):
    raise apart.Ended("crashed (SIGSEGV)")
    yield


def test_users_get_one_sentence_and_code_2(tmp_path, monkeypatch):
    pytest.importorskip("pxr")
    for place in ("export.usd", "images.film", "base.apart"):
        monkeypatch.setattr(f"langflash_core.{place}.ask", no_answer)
    for name in ("a.usdc", "a.mp4", "a.heic"):
        (tmp_path / name).write_bytes(b"\0\0\0\x18ftypheic" + bytes(99))

    def film() -> None:
        with open_film(tmp_path / "a.mp4"):
            pass

    for does, kind in (
        (lambda: read(tmp_path / "a.usdc"), SceneFileError), (film, FilmError),
        (lambda: read_photo(tmp_path / "a.heic"), ImageError),
    ):  # fmt: skip
        with pytest.raises(kind, match=r"SIGSEGV.*; ") as raised:
            does()
        assert "\n" not in str(raised.value) and raised.value.exit_code == InputError.exit_code == 2


@pytest.mark.slow
def test_damaged_usdc_never_ends_this_process(tmp_path):
    """What ended the whole program 32 times in 632: OpenUSD reads it apart now."""
    pytest.importorskip("pxr")
    from langflash_core.export import export
    from langflash_core.scene.bare import bare_scene
    from tests.export.mutations import mutated
    from tests.export.splats import random_gaussians

    export(bare_scene(random_gaussians(20), "made"), tmp_path / "a.usdc")
    whole, rng = (tmp_path / "a.usdc").read_bytes(), np.random.default_rng(5)
    said = []
    for _ in range(6):
        (tmp_path / "a.usdc").write_bytes(mutated(whole, whole[::-1], rng))
        try:
            read(tmp_path / "a.usdc")
        except SceneFileError as error:
            said.append(str(error))
    assert said and all("; " in each and "\n" not in each for each in said)


HOSTILE = Path(__file__).resolve().parents[2] / "fixtures" / "hostile"


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's bound of memory")
@pytest.mark.parametrize("name", ["memory.usdc", "unpacking.usdc"])
def test_usdc_that_took_all_memory_is_a_sentence(name):
    """Some 1.3 KB each. Without a bound OpenUSD took memory until the system killed its process."""
    pytest.importorskip("pxr")
    with pytest.raises(SceneFileError, match=r"of memory|damaged") as raised:
        read(HOSTILE / name)
    assert "\n" not in str(raised.value) and raised.value.exit_code == 2


def test_a_film_that_is_a_list_of_other_files_is_none(tmp_path):
    """FFmpeg would open what a list names, whatever the list is called."""
    films.write(tmp_path / "real.mp4", films.walk(4))
    for text in ("ffconcat version 1.0\nfile real.mp4\n", "#EXTM3U\n#EXTINF:1,\nreal.mp4\n#EXT-X-ENDLIST\n"):
        (tmp_path / "list.mp4").write_text(text)
        with pytest.raises(FilmError, match="no film that can be decoded"), open_film(tmp_path / "list.mp4"):
            pass


def test_a_film_left_early_ends_its_process(tmp_path):
    path = films.write(tmp_path / "walk.mp4", films.walk(40))
    with open_film(path) as reader:
        pictures = reader.pictures(0.0, None, lambda: None)
        assert isinstance(pictures, Generator)
        next(pictures)
        waiting = len(process._idle.get("films", []))
        pictures.close()
    assert len(process._idle.get("films", [])) == waiting == 0


def test_readers_import_no_torch():
    """A second and more, for each process."""
    for module in set(serving.READERS.values()):
        text = (Path(apart.__file__).with_name(f"{module}.py")).read_text()
        names = [line.split()[1] for line in text.splitlines() if line.startswith(("import ", "from "))]
        assert not [name for name in names if name.startswith(("torch", "langflash_core"))], module
    assert json.loads(json.dumps(serving.READERS)) == serving.READERS
