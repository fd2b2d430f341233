"""A wheel, installed outside the checkout, finds its shaders and assets."""

import os
import subprocess
import sys
import zipfile
from email import message_from_bytes
from pathlib import Path

import pytest

import langflash_core

ROOT = Path(__file__).resolve().parent.parent
pytestmark = pytest.mark.slow


def python(*words, cwd: Path, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=cwd,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    python("-m", "build", "--wheel", "--no-isolation", "-o", folder, ROOT, cwd=folder)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    """The wheel alone, in a folder of its own; what it needs comes from this environment."""
    folder = tmp_path_factory.mktemp("installed")
    python(
        "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", folder, wheel, cwd=folder
    )
    return folder


def test_holds_every_shader_and_asset(wheel):
    with zipfile.ZipFile(wheel) as archive:
        sizes = {entry.filename: entry.file_size for entry in archive.infolist()}
    for kind in ("shaders", "assets"):
        files = [path for path in (ROOT / kind).rglob("*") if path.is_file()]
        files = [path for path in files if not path.is_relative_to(ROOT / "assets" / "readme")]
        assert files
        for path in files:
            name = f"langflash_core/_bundled/{path.relative_to(ROOT).as_posix()}"
            assert sizes.get(name) == path.stat().st_size, name


def test_holds_no_tests_and_no_rubbish(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"app", "langflash_core", f"langflash-{langflash_core.__version__}.dist-info"}
    assert not [name for name in names if name.endswith((".pyc", ".part", ".log"))]


def test_metadata(wheel):
    with zipfile.ZipFile(wheel) as archive:
        info = next(name.rsplit("/", 1)[0] for name in archive.namelist() if name.endswith("/METADATA"))
        metadata = message_from_bytes(archive.read(f"{info}/METADATA"))
        licences = [name for name in archive.namelist() if name.startswith(f"{info}/licenses/")]
    assert metadata["Version"] == langflash_core.__version__
    assert metadata["License-Expression"] == "Apache-2.0"
    assert {Path(name).name for name in licences} == {"LICENSE", "NOTICE"}


def test_installed_package_finds_its_files(installed, tmp_path):
    code = """
from pathlib import Path
import langflash_core
from langflash_core.images.views import load_views
from langflash_core.language.spaces import language_space
from langflash_core.resources import asset_path, shader_path

home = Path(langflash_core.__file__).parent
assert shader_path("splat/quad.vert").is_relative_to(home), shader_path("splat/quad.vert")
views = load_views([asset_path("photos/books_left.jpg"), asset_path("photos/books_right.jpg")])
assert views.num_views == 2
assert language_space("minilm").encode(["book"]).shape == (1, 384)
print(home)
"""
    printed = python("-c", code, cwd=tmp_path, PYTHONPATH=str(installed))
    assert Path(printed.strip()) == installed / "langflash_core"


def test_installed_commands_answer(installed, tmp_path):
    expected = f"langflash {langflash_core.__version__}\n"
    assert python("-m", "app", "--version", cwd=tmp_path, PYTHONPATH=str(installed)) == expected
    script = installed / "bin" / "langflash"
    assert python(script, "--version", cwd=tmp_path, PYTHONPATH=str(installed)) == expected


def test_installed_renderer_compiles_its_shaders(installed, tmp_path):
    code = """
import torch
from app.gl import SplatRenderer, offscreen_context
from langflash_core.types import Gaussians, Scene, Semantics

one = Gaussians(torch.tensor([[0.0, 0.0, 1.0]]), torch.tensor([[1.0, 0, 0, 0]]), torch.full((1, 3), 0.2),
                torch.ones(1), torch.ones(1, 1, 3))
meaning = Semantics(torch.zeros(1, 1, dtype=torch.int64), torch.ones(1, 1), torch.ones(1, 1), "minilm")
K = torch.tensor([[[16.0, 0, 8], [0, 16.0, 8], [0, 0, 1]]])
scene = Scene(one, meaning, torch.eye(4)[None], K, (16, 16))
context = offscreen_context()
renderer = SplatRenderer(context)
renderer.set_scene(scene)
renderer.draw(scene.camera(0))
print(float(renderer.frame().alphas.max()))
renderer.release()
context.release()
"""
    printed = python("-c", code, cwd=tmp_path, PYTHONPATH=str(installed))
    assert float(printed) > 0.9  # 0.99, the largest alpha, in half precision
