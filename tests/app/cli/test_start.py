"""What is answered without torch: an import that takes seconds where the answer takes a moment."""

import subprocess
import sys
from pathlib import Path

import pytest

from langflash_core.base.resources import asset_path

PHOTO = asset_path("photos/books_left.jpg")
RUN = """
import sys
from app.cli import main
code = main(sys.argv[1:])
heavy = {"torch", "torchvision", "timm", "scipy", "open_clip", "tokenizers", "moderngl"} & set(sys.modules)
sys.exit(code if not heavy else f"imported {heavy}")
"""


def _run(*words) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-c", RUN, *map(str, words)], capture_output=True, text=True)


@pytest.fixture
def damaged(tmp_path) -> Path:
    path = tmp_path / "photo.jpg"
    path.write_bytes(PHOTO.read_bytes()[:5000])
    return path


def test_info_of_a_scene(scene_file):
    done = _run("info", scene_file)
    assert done.returncode == 0 and "gaussians:" in done.stdout, done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("reconstruct", PHOTO, "nowhere.jpg", "-o", "{out}"), "there is no photo"),
        (("reconstruct", PHOTO, "{text}", "-o", "{out}"), "not a picture"),
        (("reconstruct", PHOTO, "{damaged}", "-o", "{out}"), "damaged"),
        (("reconstruct", PHOTO, "-o", "{out}", "--weights", "{text}"), "not a readable safetensors file"),
        (("reconstruct", PHOTO, "-o", "{out}", "--size", "5000"), "1024"),
        (("info", "{text}"), "not a LangFlash scene"),
        (("query", "{text}", "plant", "-o", "{folder}"), "not a LangFlash scene"),
        (("query", "nowhere.langflash", "plant", "-o", "{folder}"), "there is no scene"),
    ],
)
def test_bad_input(words, said, tmp_path, damaged):
    text = tmp_path / "text.langflash"
    text.write_text("a letter")
    places = {"out": tmp_path / "x.langflash", "text": text, "damaged": damaged, "folder": tmp_path / "f"}
    done = _run(*(str(word).format(**places) for word in words))
    assert done.returncode == 2 and said in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1 and not places["out"].exists()
