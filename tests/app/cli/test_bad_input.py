"""Bad input: one sentence on stderr, exit code 2, and no file left."""

import json
import os
import sys
import time
from pathlib import Path

import pytest
import torch
from PIL import Image
from safetensors.torch import save_file

from langflash_core.base.outputs import ALL_OUT
from langflash_core.base.resources import asset_path
from tests.app.cli.conftest import shell


@pytest.fixture
def photo() -> Path:
    return asset_path("photos/books_left.jpg")


@pytest.fixture
def output(tmp_path) -> Path:
    return tmp_path / "out" / "scene.langflash"


def test_photos_that_are_none(refused, output, photo, tmp_path):
    """Others are in test_start.py: missing, of another kind, damaged."""
    assert "PHOTO" in refused("reconstruct", "-o", output)
    Image.new("RGB", (1, 1)).save(tmp_path / "dot.png")
    assert "dot.png" in refused("reconstruct", photo, tmp_path / "dot.png", "-o", output)
    (tmp_path / "empty").mkdir()
    assert "folder" in refused("reconstruct", photo, tmp_path / "empty", "-o", output)


def test_weights_that_are_no_checkpoint(refused, output, photo, tmp_path):
    other = tmp_path / "other.safetensors"
    save_file({"layer": torch.zeros(3)}, other)
    assert other.name in refused("reconstruct", photo, "--weights", other, "-o", output)
    assert other.name in refused("weights", "verify", other)


def test_output_is_an_input(refused, photo, tmp_path):
    copy = tmp_path / "photo.jpg"
    copy.write_bytes(photo.read_bytes())
    assert "also an input" in refused("reconstruct", photo, copy, "-o", copy)


def test_lens_given_twice(refused, output, photo):
    sentence = refused("reconstruct", photo, "--fov", "60", "--intrinsics", "1,1,1,1", "-o", output)
    assert "not allowed with" in sentence


BAD_OPTIONS = """
--fov=0 --fov=180 --fov=nan --fov=wide --intrinsics=500,500,300 --intrinsics=0,500,300,200
--intrinsics=inf,500,300,200 --size=0 --size=4096 --device=abacus --preset=huge --detail=highest --detail=
--gaussians=999 --gaussians=4000001 --gaussians=many --gaussians=2e5
"""


@pytest.mark.parametrize("option", BAD_OPTIONS.split())
def test_bad_option_of_reconstruct(refused, output, photo, option):
    assert option.partition("=")[0] in refused("reconstruct", photo, option, "-o", output)


@pytest.mark.parametrize("option", ["--detail=highest", "--gaussians=0"])
def test_bad_detail_of_a_batch(refused, photo, tmp_path, option):
    assert option.partition("=")[0] in refused("batch", photo.parent, option, "-o", tmp_path / "out")


@pytest.mark.parametrize(
    "text", ["", "640", "640x", "0x480", "640x8193", "-1x4", "4.5x3", "640x480x3", "9" * 40 + "x1"]
)
def test_bad_size(refused, scene_file, tmp_path, text):
    assert "--size" in refused("render", scene_file, f"--size={text}", "-o", tmp_path / "a.png")


@pytest.mark.parametrize("kept", [0, 7, 0.5, 0.999])
def test_truncated_scene(refused, scene_file, tmp_path, kept):
    cut = tmp_path / "cut.langflash"
    content = scene_file.read_bytes()
    cut.write_bytes(content[: kept if isinstance(kept, int) else int(kept * len(content))])
    assert "cut.langflash" in refused("query", cut, "armchair", "-o", tmp_path / "out")
    assert "cut.langflash" in refused("info", cut)


def test_photo_as_scene(refused, photo, tmp_path):
    assert photo.name in refused("render", photo, "-o", tmp_path / "a.png")


@pytest.mark.parametrize("view", ["3", "99999", "-1", "first", "1.5"])
def test_unknown_view(refused, scene_file, tmp_path, view):
    assert "view" in refused("render", scene_file, f"--view={view}", "-o", tmp_path / "a.png")


@pytest.mark.parametrize("words", [("render",), ("query", "armchair"), ("export",)])
def test_the_number_of_a_photo_as_it_was_counted_before(refused, scene_file, tmp_path, words):
    """0 was the first photo; it is not taken for another one."""
    command, *phrases = words
    said = refused(command, scene_file, *phrases, "--view", "0", "-o", tmp_path / "a.png")
    assert "photos count from 1" in said


@pytest.mark.parametrize("prompt", ["", "   ", "\n\t"])
def test_empty_prompt(refused, scene_file, tmp_path, prompt):
    assert "empty" in refused("query", scene_file, "armchair", prompt, "-o", tmp_path / "out")
    assert "empty" in refused("query", scene_file, "armchair", "-o", tmp_path / "out", "--negatives", prompt)


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("--what relevance", "--prompt"),
        ("--what labels", "--prompt"),
        ("--what relevance --prompt a b", "labels"),
        ("--what rgb --prompt a", "takes no --prompt"),
        ("--what weights:3", "weights:0 to weights:2"),
        ("--what weights", "weights:K"),
        ("--what weights:-1", "whole number"),
        ("--what rgb:1", "weights:K"),
        ("--what smell", "weights:K"),
        ("--view 1 --camera x.json", "not allowed with"),
        ("--camera gone.json", "camera file"),
        ("--backend paint", "--backend"),
    ],
)
def test_bad_picture(refused, scene_file, tmp_path, words, hint):
    assert hint in refused("render", scene_file, *words.split(), "-o", tmp_path / "a.png")


@pytest.mark.parametrize("name", ["a.jpg", "a.ply", "a", "a.png.exe"])
def test_only_png(refused, scene_file, tmp_path, name):
    assert ".png" in refused("render", scene_file, "-o", tmp_path / name)
    if not name.endswith(".ply"):
        assert ", ".join(ALL_OUT) in refused("export", scene_file, "-o", tmp_path / name)


def test_export_of_what_is_not_there(refused, scene_file, tmp_path):
    words = ("export", scene_file, "--threshold", "0.9", "-o", tmp_path / "a.png")
    sentence = refused(*words, "--prompt", "submarine")
    assert "not found" in sentence and "submarine" in sentence
    assert "--prompt" in refused(*words)


PINHOLE = [[40.0, 0.0, 28.0], [0.0, 40.0, 21.0], [0.0, 0.0, 1.0]]
IDENTITY = torch.eye(4).tolist()
CAMERA = {"viewmat": IDENTITY, "K": PINHOLE, "width": 8, "height": 8}
CAMERAS = {
    "not json": "{",
    "a list": "[]",
    "no K": {"viewmat": IDENTITY, "width": 8, "height": 8},
    "a short matrix": {**CAMERA, "viewmat": IDENTITY[:3]},
    "words": {**CAMERA, "viewmat": [["a"] * 4] * 4},
    "not finite": {**CAMERA, "viewmat": [[float("nan")] * 4, *IDENTITY[1:]]},
    "scaled": {**CAMERA, "viewmat": (2 * torch.eye(4)).tolist()},
    "mirrored": {**CAMERA, "viewmat": torch.diag(torch.tensor([-1.0, 1, 1, 1])).tolist()},
    "projective": {**CAMERA, "viewmat": [*IDENTITY[:3], [0, 0, 1, 1]]},
    "no focal length": {**CAMERA, "K": [[0, 0, 1], [0, 1, 1], [0, 0, 1]]},
    "skewed": {**CAMERA, "K": [[9, 1, 1], [0, 9, 1], [0, 0, 1]]},
    "no pixels": {**CAMERA, "width": 0},
    "half a pixel": {**CAMERA, "width": 8.5},
    "too large": {**CAMERA, "height": 9000},
}


@pytest.mark.parametrize("content", CAMERAS.values(), ids=CAMERAS.keys())
def test_bad_camera_file(refused, scene_file, tmp_path, content):
    camera = tmp_path / "camera.json"
    camera.write_text(content if isinstance(content, str) else json.dumps(content))
    assert "camera.json" in refused("render", scene_file, "--camera", camera, "-o", tmp_path / "a.png")


def test_something_is_in_the_way_of_the_output(refused, scene_file, photo, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert "not a folder" in refused("query", scene_file, "armchair", "-o", blocked / "out")
    assert "not a folder" in refused("render", scene_file, "-o", blocked / "a.png")
    assert "not a folder" in refused("reconstruct", photo, "-o", blocked / "scene.langflash")
    (tmp_path / "a.png").mkdir()
    assert "folder" in refused("render", scene_file, "-o", tmp_path / "a.png")
    assert "folder" in refused("reconstruct", photo, "-o", tmp_path)


@pytest.mark.skipif(sys.platform != "linux", reason="/proc is Linux's")
def test_output_folder_that_cannot_be_written(refused, scene_file, photo):
    """/proc refuses new files to everybody, root included."""
    start = time.perf_counter()
    assert "cannot write" in refused("reconstruct", photo, "-o", "/proc/scene.langflash")
    assert "cannot write" in refused("query", scene_file, "armchair", "-o", "/proc/out")
    assert time.perf_counter() - start < 3  # refused before the long work


def test_unknown_words(refused):
    assert "COMMAND" in refused("--")
    assert "scene to measure" in refused("bench")
    assert "--jsn" in refused("info", "x", "--jsn")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("recontruct", "langflash reconstruct"),
        ("exprot", "langflash export"),
        ("Query", "langflash query"),
        ("rec", "langflash reconstruct"),
        ("lab evla", "langflash lab eval"),
        ("tour stpo", "langflash tour stop"),
        ("weights lst", "langflash weights list"),
    ],
)
def test_a_word_close_to_a_command(refused, written, meant):
    sentence = f'langflash: "langflash {written}" is not a command; did you mean "{meant}"?\n'
    assert refused(*written.split(), "room.langflash") == sentence


@pytest.mark.parametrize("written", ["frobnicate", "x", "", "photo.jpg", "tour wander"])
def test_a_word_close_to_no_command(refused, written):
    group = "langflash tour" if written.startswith("tour") else "langflash"
    sentence = f'langflash: "langflash {written}" is not a command; {group} --help lists them\n'
    assert refused(*written.split(" ")) == sentence


@pytest.mark.parametrize("written", ["eval", "train", "rooms", "labels", "bench-network"])
def test_a_command_of_the_lab_is_found_there(refused, written):
    sentence = f'langflash: "{written}" is a command of the lab; did you mean "langflash lab {written}"?\n'
    assert refused(written, "rooms") == sentence


def test_from_a_shell(tmp_path):
    """The same through a real process: exit code, one sentence, an empty stdout, no traceback."""
    for words in (["render", "gone.langflash", "-o", "a.png"], ["frobnicate"]):
        done = shell(*words, cwd=tmp_path)
        assert done.returncode == 2 and done.stdout == ""
        assert done.stderr.startswith("langflash: ") and done.stderr.count("\n") == 1
    assert not os.listdir(tmp_path)
