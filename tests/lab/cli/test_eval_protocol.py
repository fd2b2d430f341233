"""`langflash lab eval protocol` from end to end: the shipped network, and the paper's at a size for tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from langflash_core.lab.photos import PhotoFolder
from langflash_core.language.clip import build_clip, load_clip
from langflash_core.network import PRESETS
from tests.lab.photos import layouts_made as made
from tests.network import published
from tests.network.sizes import TINY


@pytest.fixture(scope="module")
def wall(tmp_path_factory) -> PhotoFolder:
    return made.wall(tmp_path_factory.mktemp("wall") / "photos", 3)


@pytest.fixture
def scannet(wall: PhotoFolder, tmp_path: Path) -> Path:
    made.scannet_table(tmp_path / "scannet")
    made.lsm_scene(wall, tmp_path / "scannet" / "scene0700_00")
    return tmp_path / "scannet"


@pytest.fixture
def tiny_full(run, tmp_path, monkeypatch) -> Iterator[None]:
    """The preset `full` in small: random checkpoints in the published form imported, and a random CLIP."""
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    monkeypatch.setitem(PRESETS, "full", TINY)
    drawn = {
        "mixRe10kDl3dv.ckpt": published.draw_noposplat(TINY),
        "demo_e200.ckpt": published.draw_lseg(TINY, channels=512),
        "re10k.ckpt": published.draw_langflash(TINY),
    }
    for name, state in drawn.items():
        torch.save({"state_dict": state}, tmp_path / name)
        assert run("weights", "import", tmp_path / name).code == 0
    tower = build_clip()
    state = {name: tensor.contiguous() for name, tensor in tower.model.state_dict().items()}
    save_file(state, tmp_path / "home" / "weights" / "clip_vitb32.safetensors")
    load_clip.cache_clear()
    yield
    load_clip.cache_clear()


def test_the_shipped_network_is_judged_and_what_is_kept_is_used_again(run, scannet: Path, tmp_path: Path):
    words = ("lab", "eval", "protocol", "scannet", scannet, "--size", 84, "--backend", "torch", "--json")
    words = (*words, "--work", tmp_path / "work", "-o", tmp_path / "table.md")
    made_now = run(*words)
    assert made_now.code == 0, made_now.err
    result = made_now.json()
    assert result["cases"] == 1 and set(result["labels"]) == {"atoms", "features"}
    assert 0 <= result["labels"]["features"]["target_miou"] <= 1
    assert (tmp_path / "table.md").read_text().startswith("## ScanNet")
    assert run(*words).json() == result  # seconds too: nothing was judged again


def test_the_papers_network_goes_from_end_to_end(run, wall, tiny_full, scannet: Path, tmp_path: Path):
    made.masked_scene(made.wall(tmp_path / "four", 4), tmp_path / "3dovs" / "bed")
    made.re10k_split(made.wall(tmp_path / "five", 5), tmp_path / "re10k")
    options = ("--preset", "full", "--size", 64, "--backend", "torch", "--json", "--limit", 1)
    for name, folder in (("scannet", scannet), ("3dovs", tmp_path / "3dovs"), ("re10k", tmp_path / "re10k")):
        outcome = run("lab", "eval", "protocol", name, folder, *options)
        assert outcome.code == 0, outcome.err
        assert outcome.json()["cases"] == 1


def test_the_shipped_network_goes_through_the_other_protocols(run, wall, tmp_path: Path):
    made.masked_scene(made.wall(tmp_path / "four", 4), tmp_path / "3dovs" / "bed")
    made.re10k_split(made.wall(tmp_path / "five", 5), tmp_path / "re10k")
    options = ("--size", 84, "--backend", "torch", "--json", "--limit", 1, "--align")
    masked = run("lab", "eval", "protocol", "3dovs", tmp_path / "3dovs", *options)
    assert masked.code == 0, masked.err
    assert set(masked.json()["labels"]) == {"atoms", "features"} and masked.json()["cases"] == 1
    posed = run("lab", "eval", "protocol", "re10k", tmp_path / "re10k", *options)
    assert posed.code == 0, posed.err
    measures = posed.json()["measures"]
    # Of the poses tried the best is taken, the true one among them; four digits are kept.
    assert measures["psnr_whole_picture_aligned"] >= measures["psnr_whole_picture"] - 1e-3


def test_nyu_goes_on_from_what_it_kept_and_has_no_other_view(run, wall: PhotoFolder, tmp_path: Path):
    options = ["--size", "84", "--backend", "torch", "--json", "--limit", "1"]
    words = ("lab", "eval", "protocol", "nyu", wall.root, *options)
    first = run(*words, "--work", tmp_path / "work")
    assert first.code == 0, first.err
    assert run(*words, "--work", tmp_path / "work").json() == first.json()  # seconds too
    for option in (("--align",), ("--index", tmp_path / "any.json")):
        refused = run(*words, *option)
        assert refused.code == 2 and option[0] in refused.err and refused.err.count("\n") == 1


def test_nyu_takes_a_folder_and_refuses_what_is_none(run, wall: PhotoFolder, tmp_path: Path):
    words = ("--size", 84, "--backend", "torch", "--json", "--limit", 1)
    outcome = run("lab", "eval", "protocol", "nyu", wall.root, *words)
    assert outcome.code == 0, outcome.err
    assert "classes_miou" in outcome.json()["labels"]["atoms"]
    absent = run("lab", "eval", "protocol", "nyu", tmp_path / "nothing", *words)
    assert absent.code == 2 and "nyu_depth_v2_labeled.mat" in absent.err


def test_an_absent_data_set_is_one_sentence(run, tmp_path: Path):
    absent = run("lab", "eval", "protocol", "scannet", tmp_path / "nothing")
    assert absent.code == 2 and absent.err.count("\n") == 1 and "scannet_test.tar" in absent.err
    assert run("lab", "eval", "protocol", "kitti", tmp_path).code == 2
