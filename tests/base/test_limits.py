"""Every limit lets through what is at it, and refuses one past it in a sentence that says how to move it."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.cli import main
from langflash_core.base import limits
from langflash_core.base.limits import LIMITS, Limit
from langflash_core.base.picture_files import opened_picture, picture_block
from langflash_core.errors import LangFlashError
from langflash_core.export import export, read
from langflash_core.export.cameras import read_posed
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.edits import History, Marks
from langflash_core.scene.edits_file import load_history, save_history
from tests.app.cli.conftest import stripes
from tests.export.mutations import other_files
from tests.export.splats import ksplat_bytes, random_gaussians

ROOT = Path(__file__).resolve().parents[2]
# tests/base/apart/test_apart.py and tests/base/test_picture_files.py have these.
APART = ("seconds", "memory", "pixels")


@pytest.fixture
def run(capsys):
    """`run("info", ...)`: code, and what it printed."""

    def command(*words: str) -> SimpleNamespace:
        code = main(words)
        printed = capsys.readouterr()
        return SimpleNamespace(code=code, out=printed.out, err=printed.err)

    return command


def around(monkeypatch, limit: Limit, most: int, does: Callable[[], object]) -> None:
    with monkeypatch.context() as patch:
        patch.setenv(limit.variable, str(most))
        does()
        patch.setenv(limit.variable, str(most - 1))
        with pytest.raises(LangFlashError, match=limit.variable) as raised:
            does()
    assert "\n" not in str(raised.value) and raised.value.exit_code == 2


SPLATS = (".ply", ".compressed.ply", ".splat", ".spz", ".sog", ".glb", ".usda", ".langflash", ".ksplat")


@pytest.mark.parametrize("suffix", SPLATS)
def test_gaussians(monkeypatch, tmp_path, suffix):
    if suffix == ".usda":
        pytest.importorskip("pxr")
    if suffix == ".spz":
        pytest.importorskip("zstandard")
    path = tmp_path / f"a{suffix}"
    if suffix == ".ksplat":
        path.write_bytes(ksplat_bytes(random_gaussians(700), 0))
    else:
        export(bare_scene(random_gaussians(7), "made"), path)
    most = 700 if suffix == ".ksplat" else 7
    around(monkeypatch, limits.GAUSSIANS, most, lambda: read(path))


def test_atoms_and_views(monkeypatch, tmp_path):
    scene = stripes()
    export(scene, tmp_path / "a.langflash")
    around(monkeypatch, limits.ATOMS, scene.semantics.num_atoms, lambda: read(tmp_path / "a.langflash"))
    around(monkeypatch, limits.VIEWS, scene.num_views, lambda: read(tmp_path / "a.langflash"))
    export(scene, tmp_path / "spoken.ply")
    monkeypatch.setenv(limits.ATOMS.variable, "1")
    warned = read(tmp_path / "spoken.ply").record.warnings
    assert any(limits.ATOMS.variable in each for each in warned), "language beside splats is left out"


def test_headers(monkeypatch, tmp_path):
    export(stripes(), tmp_path / "a.langflash")
    size = int.from_bytes((tmp_path / "a.langflash").read_bytes()[:8], "little")
    around(monkeypatch, limits.HEADER, size, lambda: read(tmp_path / "a.langflash"))
    export(bare_scene(random_gaussians(7), "made"), tmp_path / "a.glb")
    size = int.from_bytes((tmp_path / "a.glb").read_bytes()[12:16], "little")
    around(monkeypatch, limits.HEADER, size, lambda: read(tmp_path / "a.glb"))


def test_texts(monkeypatch, tmp_path):
    from langflash_core.writing.cameras import read_camera
    from langflash_core.writing.films import read_key_frames

    other_files(tmp_path)
    scene = stripes()
    marks = Marks.without_edits(len(scene.gaussians), scene.semantics.num_atoms)
    save_history(History(marks), scene, {"name": "made"}, tmp_path / "b.edits")
    for name, does in (
        ("transforms.json", lambda: read_posed(tmp_path / "transforms.json")),
        ("cameras.txt", lambda: read_posed(tmp_path / "cameras.txt")),
        ("b.edits", lambda: load_history(tmp_path / "b.edits", scene)),
        ("one.camera.json", lambda: read_camera(tmp_path / "one.camera.json")),
        ("two.keys.json", lambda: read_key_frames(tmp_path / "two.keys.json", None)),
    ):
        around(monkeypatch, limits.TEXT, (tmp_path / name).stat().st_size, does)
    around(monkeypatch, limits.VIEWS, 2, lambda: read_posed(tmp_path / "transforms.json"))


def test_files_of_a_sog(monkeypatch, tmp_path):
    import zipfile

    export(bare_scene(random_gaussians(7), "made"), tmp_path / "a.sog")
    count = len(zipfile.ZipFile(tmp_path / "a.sog").infolist())
    around(monkeypatch, limits.FILES, count, lambda: read(tmp_path / "a.sog"))


def test_profiles(monkeypatch, tmp_path):
    """Past it a block counts as none."""
    import io

    from PIL import Image

    stream = io.BytesIO()
    Image.new("RGB", (8, 8)).save(stream, "JPEG", icc_profile=bytes(100))
    with opened_picture(stream.getvalue()) as picture:
        monkeypatch.setenv(limits.PROFILE.variable, "100")
        assert picture_block(picture, "icc_profile") == bytes(100)
        monkeypatch.setenv(limits.PROFILE.variable, "99")
        assert picture_block(picture, "icc_profile") is None


def test_the_table_is_whole_printed_and_written_down(monkeypatch, run):
    declared = {value for value in vars(limits).values() if isinstance(value, Limit)}
    assert declared == set(LIMITS)
    tested = Path(__file__).read_text()
    guide = (ROOT / "SECURITY.md").read_text()
    lines = run("info", "--limits").out.splitlines()
    document = json.loads(run("info", "--limits", "--json").out)
    for limit in LIMITS:
        assert limit.name in APART or f"limits.{limit.name.upper()}" in tested
        (line,) = [line for line in lines if limit.variable in line]
        assert limit.told() in line and limit.what in line
        assert document["limits"][limit.name] == limit.default
        assert f"| `{limit.variable}` | {limit.told(limit.default)} | {limit.what} |" in guide
    monkeypatch.setenv("LANGFLASH_MOST_ATOMS", "2e3")
    assert json.loads(run("info", "--limits", "--json").out)["limits"]["atoms"] == 2000


@pytest.mark.parametrize("said", ["", "many", "-4", "0", "nan", "inf"])
def test_a_number_that_is_none_leaves_the_default(monkeypatch, said):
    monkeypatch.setenv(limits.ATOMS.variable, said)
    assert limits.ATOMS.value == limits.ATOMS.default


def test_info_needs_a_scene_or_limits(run):
    done = run("info")
    assert done.code == 2 and "--limits" in done.err


def test_limits_are_read_without_torch():
    code = "import sys, langflash_core.base.limits; sys.exit(bool({'torch', 'numpy'} & {*sys.modules}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
