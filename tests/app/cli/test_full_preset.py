"""Published checkpoints in, a scene out: the commands of the preset `full`, at a size for tests."""

from pathlib import Path

import pytest
import torch

from langflash_core.base.resources import asset_path
from langflash_core.network import PRESETS
from langflash_core.scene.file import load
from tests.network import published
from tests.network.sizes import TINY

PHOTOS = [asset_path(f"photos/books_{side}.jpg") for side in ("left", "right")]


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    monkeypatch.setitem(PRESETS, "full", TINY)
    return tmp_path / "home"


@pytest.fixture
def checkpoints(tmp_path) -> list[Path]:
    drawn = {
        "mixRe10kDl3dv.ckpt": published.draw_noposplat(TINY),
        "demo_e200.ckpt": published.draw_lseg(TINY, channels=512),
        "re10k.ckpt": published.draw_langflash(TINY),
    }
    for name, state in drawn.items():
        torch.save({"state_dict": state}, tmp_path / name)
    return [tmp_path / name for name in drawn]


def test_imported_checkpoints_make_a_scene(run, checkpoints, tmp_path):
    said = [run("weights", "import", path) for path in checkpoints]
    assert all(outcome.code == 0 for outcome in said)
    assert "which it shares" in said[-1].err  # the grouping, with the geometry
    listed = run("weights", "list", "--json").json()
    parts = [Path(entry["path"]).stem for entry in listed["weights"] if entry["preset"] == "full"]
    assert parts == ["geometry", "grouping", "language"]
    assert {"noposplat-mix", "lseg", "langflash", "clip"} <= {entry["name"] for entry in listed["available"]}
    assert run("weights", "verify").out.count("sound") >= 3
    scene = tmp_path / "room.langflash"
    made = run("reconstruct", *PHOTOS, "--preset", "full", "--size", 64, "-o", scene, "--json").json()
    assert made["preset"] == "full" and made["space"] == "clip" and made["channels"] == 512
    assert made["view_size"] == [64, 64] and made["sh_degree"] == 4
    assert load(scene).record.photos[0] == "books_left.jpg"
    assert not any("detail" in note for note in made["warnings"])


def test_a_detail_that_was_asked_for_is_left_out_and_that_is_said(run, checkpoints, tmp_path):
    for path in checkpoints[:2]:
        run("weights", "import", path)
    scene = tmp_path / "room.langflash"
    for asked in (("--detail", "high"), ("--gaussians", 2000)):
        words = ("--preset", "full", "--size", 64, *asked, "-o", scene, "--json")
        made = run("reconstruct", *PHOTOS, *words).json()
        (note,) = [note for note in made["warnings"] if "detail" in note]
        assert note.startswith("the preset 'full'") and note in load(scene).record.warnings


def test_what_cannot_be_done_is_one_sentence(run, refused, checkpoints, tmp_path):
    words = ("reconstruct", *PHOTOS, "--preset", "full", "--size", 64, "-o", tmp_path / "room.langflash")
    assert "weights get NAME" in refused(*words)
    for path in checkpoints[:2]:
        run("weights", "import", path)
    for more, said in (
        (("--aggregation", "lfa"), "aggregation has no weights"),
        (("--grouping", "queries"), "grouping has no weights"),
        (("--grouping", "sam2"), "SAM 2 is not at hand"),
        (("--preset", "mini", "--grouping", "mobile-sam"), "MobileSAM's weights are not at hand"),
        (("--preset", "mini", "--aggregation", "crops"), "crops are embedded by CLIP"),
    ):
        assert said in refused(*words, *more)


def test_weights_verify(run):
    checkpoint = asset_path("weights/mini.safetensors")
    document = run("weights", "verify", checkpoint, "--json").json()
    (entry,) = document["weights"]
    assert entry["preset"] == "mini" and entry["sound"] and entry["bytes"] == checkpoint.stat().st_size
    assert "sound" in run("weights", "verify", checkpoint).out


def test_weights_verify_notices_damage(refused, tmp_path):
    content = asset_path("weights/mini.safetensors").read_bytes()
    cut = tmp_path / "cut.safetensors"
    cut.write_bytes(content[: len(content) // 2])
    assert "cut.safetensors" in refused("weights", "verify", cut)
