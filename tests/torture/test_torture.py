"""Hostile files: finds of the past and a few hundred new ones are read or refused, and the fuzzer finds."""

import sys
from pathlib import Path

import numpy as np
import pytest

from langflash_core.errors import SceneFileError
from tests.torture import fuzz
from tests.torture.__main__ import side_by_side
from tests.torture.readers import Reader, prepare
from tests.torture.shapes import damaged

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of Unix")
FINDS = sorted(path for path in fuzz.FINDS.glob("*~*~*"))


@pytest.fixture(scope="module")
def prepared(tmp_path_factory) -> tuple[Path, dict[str, bytes], dict[str, Reader]]:
    folder = tmp_path_factory.mktemp("torture")
    files, readers = prepare(folder)
    return folder, files, {reader.name: reader for reader in readers}


@pytest.mark.parametrize("find", FINDS, ids=lambda path: path.name)
def test_finds_are_mended(find, prepared):
    folder, files, readers = prepared
    reader, _, name = find.name.split("~")
    (folder / name).write_bytes(find.read_bytes())
    try:
        assert fuzz._outcome(readers[reader], folder / name, fuzz.Told()) is None
    finally:
        (folder / name).write_bytes(files[name])


@pytest.mark.filterwarnings("ignore")
def test_a_dozen_of_every_reader(prepared):
    """`make torture` reads 100,000."""
    folder, files, readers = prepared
    assert len(readers) >= 21
    for reader in readers.values():
        told = fuzz.fuzz(reader, files, folder, 12, seed=3)
        assert not told.finds, (reader.name, told.finds)
        assert told.count == 12 + len(reader.files) and told.steps


def test_a_fault_is_found_and_made_small(tmp_path):
    """A reader that fails where a file has an X behind an A, which blind damage alone seldom meets."""

    def read(path: Path) -> None:
        content = path.read_bytes()
        if b"A" in content and b"X" in content[content.index(b"A") :]:
            raise ZeroDivisionError
        if not content.startswith(b"head"):
            raise SceneFileError("a.bin is no such file; make another")

    whole = b"head" + b"." * 40 + b"A" + b"." * 40
    (tmp_path / "a.bin").write_bytes(whole)
    reader = Reader("odd", ("a.bin",), read)
    told = fuzz.fuzz(reader, {"a.bin": whole, "b": b"X" * 90}, tmp_path, 400, seed=1)
    (((name, small)),) = told.finds.values()
    assert name == "a.bin" and small == b"AX"
    kept = fuzz.keep_find(reader, name, small, tmp_path / "finds")
    assert kept.read_bytes() == b"AX" and kept.name.split("~")[::2] == ["odd", "a.bin"]


def test_hangs_and_bad_sentences_are_finds(tmp_path, monkeypatch):
    monkeypatch.setattr(fuzz, "SECONDS", 0.2)

    def forever(path: Path) -> None:
        while True:
            pass

    def talks(path: Path) -> None:
        raise SceneFileError("one\ntwo; three")

    (tmp_path / "a").write_bytes(b"")
    for read, word in ((forever, "Slow"), (talks, "bad sentence")):
        found = fuzz._outcome(Reader("odd", ("a",), read), tmp_path / "a", fuzz.Told())
        assert found is not None and word in found
        assert fuzz.kind_of(found) == {"Slow": "over 10 s", "bad sentence": "bad sentences"}[word]
    assert fuzz.kind_of("MemoryError in bare.py:read:3") == "over 1 GB"
    assert fuzz.kind_of("IndexError in bare.py:read:3") == "crashes"


def test_damage_by_build_gets_past_checksums(prepared):
    """Else a scene's readers behind its SHA-256 would never be reached."""
    folder, files, readers = prepared
    rng, said = np.random.default_rng(0), set()
    path = folder / "spoken.langflash"
    for _ in range(60):
        path.write_bytes(damaged(path.name, files[path.name], b"", rng))
        try:
            readers["langflash"].read(path)
            said.add("read")
        except SceneFileError as error:
            said.add("checksum" if "checksum" in str(error) else "reached")
    path.write_bytes(files[path.name])
    assert {"reached", "read"} <= said


def test_one_seed_makes_the_same_files(prepared):
    _, files, _ = prepared
    for name, content in files.items():
        one, other = (damaged(name, content, b"other" * 40, np.random.default_rng(5)) for _ in range(2))
        assert one == other


def test_parts_run_side_by_side_and_one_that_fails_is_counted(capsys):
    words = ("--files", "2", "--only", "phrases")
    assert side_by_side(("files", "nothing of that name"), words, 2) == 1
    said = capsys.readouterr().out
    assert "phrases " in said and "0 crashes" in said and "no part nothing of that name" in said
    assert said.endswith("1 of 2 parts with finds\n")
