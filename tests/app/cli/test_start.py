"""What is answered without torch: an import that takes seconds where the answer takes a moment."""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from langflash_core.base.resources import asset_path

PHOTO = asset_path("photos/books_left.jpg")
RUN = """
import contextlib, io, json, sys
from app.cli import main
heavy = {"torch", "torchvision", "timm", "scipy", "open_clip", "tokenizers", "moderngl"}
told = []
for words in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(words)
    told.append((code, out.getvalue(), err.getvalue(), sorted(heavy & set(sys.modules))))
print(json.dumps(told))
"""


def told(commands: Sequence[Sequence[object]]) -> list[tuple[int, str, str]]:
    """Code, output and complaint of commands in one new process, none of which imports what is heavy."""
    words = json.dumps([[str(word) for word in command] for command in commands])
    done = subprocess.run([sys.executable, "-c", RUN, words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for command, (*_, imported) in zip(commands, found, strict=True):
        assert not imported, (command, imported)
    return [(code, out, err) for code, out, err, _ in found]


@pytest.fixture
def damaged(tmp_path) -> Path:
    path = tmp_path / "photo.jpg"
    path.write_bytes(PHOTO.read_bytes()[:5000])
    return path


def test_info_of_a_scene(scene_file):
    ((code, out, err),) = told([("info", scene_file)])
    assert code == 0 and "gaussians:" in out, err


def test_bad_input(tmp_path, damaged):
    text, out, folder = tmp_path / "text.langflash", tmp_path / "x.langflash", tmp_path / "f"
    text.write_text("a letter")
    cases = (
        (("reconstruct", PHOTO, "nowhere.jpg", "-o", out), "there is no photo"),
        (("reconstruct", PHOTO, text, "-o", out), "not a picture"),
        (("reconstruct", PHOTO, damaged, "-o", out), "damaged"),
        (("reconstruct", PHOTO, "-o", out, "--weights", text), "not a readable safetensors file"),
        (("reconstruct", PHOTO, "-o", out, "--size", "5000"), "1024"),
        (("info", text), "not a LangFlash scene"),
        (("query", text, "plant", "-o", folder), "not a LangFlash scene"),
        (("query", "nowhere.langflash", "plant", "-o", folder), "there is no scene"),
    )
    for (words, said), (code, _, err) in zip(cases, told([words for words, _ in cases]), strict=True):
        assert code == 2 and said in err and err.count("\n") == 1, (words, err)
    assert not out.exists() and not folder.exists()
