"""Bad input: one sentence on stderr, exit code 2, and no file left."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from PIL import Image
from safetensors.torch import save_file

from langflash_core.base.outputs import ALL_OUT
from langflash_core.base.resources import asset_path

IDENTITY = torch.eye(4).tolist()
PINHOLE = [[40.0, 0.0, 28.0], [0.0, 40.0, 21.0], [0.0, 0.0, 1.0]]


def files_below(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


@pytest.fixture
def refused(run, tmp_path):
    """Run a command that must be refused; returns its sentence."""

    def check(*words) -> str:
        before = files_below(tmp_path)
        outcome = run(*words)
        assert outcome.code == 2, outcome
        assert outcome.out == ""
        assert outcome.err.startswith("langflash: ")
        assert outcome.err.count("\n") == 1 and outcome.err.endswith("\n")
        assert "Traceback" not in outcome.err
        assert files_below(tmp_path) == before
        return outcome.err

    return check


@pytest.fixture
def photo() -> Path:
    return asset_path("photos/books_left.jpg")


@pytest.fixture
def output(tmp_path) -> Path:
    return tmp_path / "out" / "scene.langflash"


def test_no_photo(refused, output):
    assert "PHOTO" in refused("reconstruct", "-o", output)


def test_missing_photo(refused, output, photo):
    assert "there is no photo" in refused("reconstruct", photo, "missing.jpg", "-o", output)


def test_text_named_jpg(refused, output, photo, tmp_path):
    fake = tmp_path / "notes.jpg"
    fake.write_text("a shopping list")
    assert "notes.jpg" in refused("reconstruct", photo, fake, "-o", output)


def test_truncated_png(refused, output, photo, tmp_path):
    whole = tmp_path / "whole.png"
    Image.open(photo).save(whole)
    cut = tmp_path / "cut.png"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    assert "cut.png" in refused("reconstruct", photo, cut, "-o", output)


def test_one_pixel(refused, output, photo, tmp_path):
    dot = tmp_path / "dot.png"
    Image.new("RGB", (1, 1)).save(dot)
    assert "dot.png" in refused("reconstruct", photo, dot, "-o", output)


def test_folder_as_photo(refused, output, photo, tmp_path):
    assert "folder" in refused("reconstruct", photo, tmp_path, "-o", output)


def test_weights_that_are_no_checkpoint(refused, output, photo, tmp_path):
    weights = tmp_path / "weights.safetensors"
    weights.write_bytes(b"not a checkpoint")
    assert "weights.safetensors" in refused("reconstruct", photo, "--weights", weights, "-o", output)


def test_weights_of_something_else(refused, output, photo, tmp_path):
    weights = tmp_path / "other.safetensors"
    save_file({"layer": torch.zeros(3)}, weights)
    assert "other.safetensors" in refused("reconstruct", photo, "--weights", weights, "-o", output)
    assert "other.safetensors" in refused("weights", "verify", weights)


def test_output_is_an_input(refused, photo, tmp_path):
    copy = tmp_path / "photo.jpg"
    copy.write_bytes(photo.read_bytes())
    assert "also an input" in refused("reconstruct", photo, copy, "-o", copy)


def test_lens_given_twice(refused, output, photo):
    sentence = refused("reconstruct", photo, "--fov", "60", "--intrinsics", "1,1,1,1", "-o", output)
    assert "not allowed with" in sentence


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--fov", "0"),
        ("--fov", "180"),
        ("--fov", "nan"),
        ("--fov", "wide"),
        ("--intrinsics", "500,500,300"),
        ("--intrinsics", "0,500,300,200"),
        ("--intrinsics", "inf,500,300,200"),
        ("--size", "0"),
        ("--size", "4096"),
        ("--device", "abacus"),
        ("--preset", "huge"),
        ("--detail", "highest"),
        ("--detail", ""),
        ("--gaussians", "999"),
        ("--gaussians", "4000001"),
        ("--gaussians", "many"),
        ("--gaussians", "2e5"),
    ],
)
def test_bad_option_of_reconstruct(refused, output, photo, option, value):
    assert option in refused("reconstruct", photo, option, value, "-o", output)


@pytest.mark.parametrize(("option", "value"), [("--detail", "highest"), ("--gaussians", "0")])
def test_bad_detail_of_a_batch(refused, photo, tmp_path, option, value):
    assert option in refused("batch", photo.parent, option, value, "-o", tmp_path / "out")


@pytest.mark.parametrize(
    "text", ["", "640", "640x", "0x480", "640x8193", "-1x4", "4.5x3", "640x480x3", "9" * 40 + "x1"]
)
def test_bad_size(refused, scene_file, tmp_path, text):
    assert "--size" in refused("render", scene_file, f"--size={text}", "-o", tmp_path / "a.png")


def test_missing_scene(refused, tmp_path):
    for words in (
        ["query", "gone.langflash", "armchair", "-o", tmp_path / "out"],
        ["info", "gone.langflash"],
    ):
        assert "there is no scene at gone.langflash" in refused(*words)


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


@pytest.mark.parametrize(
    "words", [("render",), ("query", "armchair"), ("export",)], ids=lambda words: words[0]
)
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
        (["--what", "relevance"], "--prompt"),
        (["--what", "labels"], "--prompt"),
        (["--what", "relevance", "--prompt", "a", "b"], "labels"),
        (["--what", "rgb", "--prompt", "a"], "takes no --prompt"),
        (["--what", "weights:3"], "weights:0 to weights:2"),
        (["--what", "weights"], "weights:K"),
        (["--what", "weights:-1"], "whole number"),
        (["--what", "rgb:1"], "weights:K"),
        (["--what", "smell"], "weights:K"),
        (["--view", "1", "--camera", "x.json"], "not allowed with"),
        (["--backend", "paint"], "--backend"),
    ],
)
def test_bad_picture(refused, scene_file, tmp_path, words, hint):
    assert hint in refused("render", scene_file, *words, "-o", tmp_path / "a.png")


@pytest.mark.parametrize("name", ["a.jpg", "a.ply", "a", "a.png.exe"])
def test_only_png(refused, scene_file, tmp_path, name):
    assert ".png" in refused("render", scene_file, "-o", tmp_path / name)
    if not name.endswith(".ply"):
        assert ", ".join(ALL_OUT) in refused("export", scene_file, "-o", tmp_path / name)


def test_export_of_what_is_not_there(refused, scene_file, tmp_path):
    sentence = refused(
        "export", scene_file, "--prompt", "submarine", "--threshold", "0.9", "-o", tmp_path / "a.png"
    )
    assert "not found" in sentence and "submarine" in sentence
    assert "--prompt" in refused("export", scene_file, "--threshold", "0.9", "-o", tmp_path / "a.png")


CAMERAS = {
    "not json": "{",
    "a list": "[]",
    "no K": json.dumps({"viewmat": IDENTITY, "width": 8, "height": 8}),
    "a short matrix": json.dumps({"viewmat": IDENTITY[:3], "K": PINHOLE, "width": 8, "height": 8}),
    "words": json.dumps({"viewmat": [["a"] * 4] * 4, "K": PINHOLE, "width": 8, "height": 8}),
    "not finite": json.dumps(
        {"viewmat": [[float("nan")] * 4, *IDENTITY[1:]], "K": PINHOLE, "width": 8, "height": 8}
    ),
    "scaled": json.dumps({"viewmat": (2 * torch.eye(4)).tolist(), "K": PINHOLE, "width": 8, "height": 8}),
    "mirrored": json.dumps(
        {"viewmat": torch.diag(torch.tensor([-1.0, 1, 1, 1])).tolist(), "K": PINHOLE, "width": 8, "height": 8}
    ),
    "projective": json.dumps(
        {"viewmat": [*IDENTITY[:3], [0, 0, 1, 1]], "K": PINHOLE, "width": 8, "height": 8}
    ),
    "no focal length": json.dumps(
        {"viewmat": IDENTITY, "K": [[0, 0, 1], [0, 1, 1], [0, 0, 1]], "width": 8, "height": 8}
    ),
    "skewed": json.dumps(
        {"viewmat": IDENTITY, "K": [[9, 1, 1], [0, 9, 1], [0, 0, 1]], "width": 8, "height": 8}
    ),
    "no pixels": json.dumps({"viewmat": IDENTITY, "K": PINHOLE, "width": 0, "height": 8}),
    "half a pixel": json.dumps({"viewmat": IDENTITY, "K": PINHOLE, "width": 8.5, "height": 8}),
    "too large": json.dumps({"viewmat": IDENTITY, "K": PINHOLE, "width": 8, "height": 9000}),
}


@pytest.mark.parametrize("content", CAMERAS.values(), ids=CAMERAS.keys())
def test_bad_camera_file(refused, scene_file, tmp_path, content):
    camera = tmp_path / "camera.json"
    camera.write_text(content)
    assert "camera.json" in refused("render", scene_file, "--camera", camera, "-o", tmp_path / "a.png")


def test_missing_camera_file(refused, scene_file, tmp_path):
    assert "camera file" in refused("render", scene_file, "--camera", "gone.json", "-o", tmp_path / "a.png")


def test_output_below_a_file(refused, scene_file, photo, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert "not a folder" in refused("query", scene_file, "armchair", "-o", blocked / "out")
    assert "not a folder" in refused("render", scene_file, "-o", blocked / "a.png")
    assert "not a folder" in refused("reconstruct", photo, "-o", blocked / "scene.langflash")


def test_output_is_a_folder(refused, scene_file, photo, tmp_path):
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
    assert "frobnicate" in refused("frobnicate")
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
    said = refused(written, "rooms")
    assert (
        said == f'langflash: "{written}" is a command of the lab; did you mean "langflash lab {written}"?\n'
    )


def test_from_a_shell(tmp_path):
    """The same through a real process: exit code, one sentence, an empty stdout, no traceback."""
    for words in (["render", "gone.langflash", "-o", "a.png"], ["frobnicate"]):
        done = subprocess.run(
            [sys.executable, "-m", "langflash_core", *words],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            timeout=60,
        )
        assert done.returncode == 2
        assert done.stdout == ""
        assert done.stderr.startswith("langflash: ") and done.stderr.count("\n") == 1
    assert not os.listdir(tmp_path)
