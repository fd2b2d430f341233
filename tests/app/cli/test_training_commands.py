"""rooms, train, eval, weights: words in, files out; what they compute is tested where it lives."""

import numpy as np
import pytest
import torch
from PIL import Image

from app.cli.parser import build_parser
from langflash_core.network import MINI, GuidedDepthNet, save_network
from tests.lab.rooms.conftest import TINY_PACK


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "drawn.safetensors"
    save_network(GuidedDepthNet(MINI), path)
    return path


def test_rooms_preview(run, tmp_path):
    path = tmp_path / "new" / "sheet.png"
    outcome = run("rooms", "preview", TINY_PACK, "-o", path, "--count", "1", "--held-out")
    assert outcome.code == 0, outcome.err
    assert np.asarray(Image.open(path)).std() > 10  # something was drawn


def test_rooms_render(run, tmp_path):
    words = ("--count", "2", "--seed", "3", "--views", "3", "--size", "70x56", "--held-out")
    outcome = run("rooms", "render", TINY_PACK, "-o", tmp_path / "rooms", *words)
    assert outcome.code == 0, outcome.err
    files = sorted((tmp_path / "rooms").iterdir())
    assert [path.name for path in files] == ["room_00000003.npz", "room_00000004.npz"]
    assert np.load(files[0])["images"].shape == (3, 56, 70, 3)


def test_weights_verify(run, checkpoint):
    document = run("weights", "verify", checkpoint, "--json").json()
    (entry,) = document["weights"]
    assert entry["preset"] == "mini" and entry["sound"] and entry["bytes"] == checkpoint.stat().st_size
    assert "sound" in run("weights", "verify", checkpoint).out


def test_weights_verify_notices_damage(run, checkpoint, tmp_path):
    content = bytearray(checkpoint.read_bytes())
    cut = tmp_path / "cut.safetensors"
    cut.write_bytes(content[: len(content) // 2])
    outcome = run("weights", "verify", cut)
    assert outcome.code == 2 and "cut.safetensors" in outcome.err and outcome.out == ""


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (["rooms", "pack", "gone", "-o", "p.npz"], "there is no folder gone"),
        (["rooms", "preview", "gone.npz", "-o", "a.png"], "no furniture pack at gone.npz"),
        (["rooms", "render", "gone.npz", "-o", "out"], "no furniture pack at gone.npz"),
        (["rooms", "render", TINY_PACK, "-o", "out", "--count", "0"], "--count"),
        (["train", "cache", "gone.npz", "-o", "out"], "no furniture pack at gone.npz"),
        (["train", "cache", TINY_PACK, "-o", "out", "--start", "gone"], "no weights file at gone"),
        (["train", "cache", TINY_PACK, "-o", "out", "--part", "2/2"], "--part"),
        (["train", "adopt", "gone", "gone", "-o", "w.safetensors"], "no encoder checkpoint at gone"),
        (
            ["train", "run", "gone", "-o", "out", "--stages", "depth", "--minutes", "1"],
            "there is no folder gone",
        ),
        (["train", "run", "gone", "-o", "out", "--stages", "depth", "--minutes", "0"], "--minutes"),
        (["train", "parts", "gone"], "there is no folder gone"),
        (["train", "parts", ".", "--run", "gone"], "there is no folder gone"),
        (["train", "export", "gone", "-o", "w.safetensors"], "there is no folder gone"),
        (["eval", "rooms", "gone"], "there is no folder gone"),
        (["eval", "calibrate", "gone"], "there is no folder gone"),
        (["weights", "verify", "gone"], "no checkpoint at gone"),
        (["weights"], "ACTION"),
    ],
)
def test_bad_input(run, tmp_path, monkeypatch, words, hint):
    monkeypatch.chdir(tmp_path)
    outcome = run(*words)
    assert outcome.code == 2 and hint in outcome.err and outcome.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_train_needs_what_a_stage_reads(run, checkpoint, tmp_path):
    (tmp_path / "cache").mkdir()
    words = ("--stages", "depth", "--minutes", "1", "--start", checkpoint)
    outcome = run("train", "run", tmp_path / "cache", "-o", tmp_path / "run", *words)
    assert outcome.code == 2 and outcome.err.count("\n") == 1  # an empty cache


def test_train_export_of_nothing(run, checkpoint, tmp_path):
    (tmp_path / "run").mkdir()
    card = tmp_path / "card.json"
    words = ("train", "export", tmp_path / "run", "-o", tmp_path / "w.safetensors", "--start", checkpoint)
    assert "no trained stage" in run(*words).err
    card.write_text("[]")
    assert "one JSON object" in run(*words, "--metadata", card).err
    assert not (tmp_path / "w.safetensors").exists()


def test_part_and_defaults():
    args = build_parser().parse_args(["train", "cache", "p.npz", "-o", "out", "--part", "1/2"])
    assert args.part == (1, 2) and args.set == "train" and args.first_seed is None
