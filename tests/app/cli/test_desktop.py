"""The desktop's files: whole, only where they belong, and gone again; never somebody else's."""

import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from app.cli.commands import desktop
from app.cli.commands.desktop import ENTRY, ICON, KIND, TYPE, contents, install
from langflash_core.errors import OutputError

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="XDG folders are Linux's")


def files(folder: Path) -> set[str]:
    """All but the desktop's own indices."""
    found = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return {name for name in found if not name.startswith("mime/") or "/packages/" in name} - {
        "applications/mimeinfo.cache"
    }


@pytest.fixture
def data(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    return tmp_path / "data"


def test_what_is_installed_is_removed(run, data, tmp_path):
    assert run("desktop", "--install").code == 0 == run("desktop", "--install").code
    assert files(data) == {ENTRY, ICON, KIND} and not (tmp_path / "home").exists()
    assert f"MimeType={TYPE};" in (data / ENTRY).read_text() and "%F" in (data / ENTRY).read_text()
    kind = ElementTree.parse(data / KIND).getroot()[0]
    assert kind.get("type") == TYPE and kind[2].get("pattern") == "*.langflash"
    assert ElementTree.parse(data / ICON).getroot().tag.endswith("svg")
    if shutil.which("update-mime-database"):
        assert f"{TYPE}:*.langflash" in (data / "mime" / "globs2").read_text()
    if shutil.which("desktop-file-validate"):
        assert subprocess.run(["desktop-file-validate", data / ENTRY], timeout=30).returncode == 0
    assert "removed" in run("desktop", "--remove").out and files(data) == set()
    assert "nothing was installed" in run("desktop", "--remove").out


def test_files_of_others_stay(run, data):
    (data / ENTRY).parent.mkdir(parents=True)
    (data / ENTRY).write_text("[Desktop Entry]\nName=Another\n")
    for way in ("--install", "--remove"):
        outcome = run("desktop", way)
        assert outcome.code == 2 and "move it away" in outcome.err
    assert files(data) == {ENTRY}


def test_all_or_nothing(data, monkeypatch):
    write, written = desktop.write_atomically, []

    def full(path, content):
        if len(written) == 2:
            raise OutputError("cannot write: No space left on device")
        written.append(path)
        write(path, content)

    monkeypatch.setattr(desktop, "write_atomically", full)
    with pytest.raises(OutputError, match="No space"):
        install(data, ["/usr/bin/langflash"])
    assert len(written) == 2 and files(data) == set()


def test_words_of_the_command_are_quoted():
    entry = contents(["/home/a b/$x/50%/langflash"])[ENTRY]
    assert 'Exec="/home/a b/\\\\$x/50%%/langflash" view %F' in entry
