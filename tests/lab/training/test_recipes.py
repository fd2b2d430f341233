"""Recipes: the paper's, what a file must say, and the paper's network in small trained by one."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from torch.nn import functional as F

from langflash_core.errors import InputError, WeightsError
from langflash_core.lab.training import recipes
from langflash_core.lab.training.commands import cache_plan, run_recipe
from langflash_core.lab.training.grouping import AggregationWeights, GroupingWeights
from langflash_core.lab.training.loop import LoopOptions
from langflash_core.lab.training.recipes import read_recipe
from langflash_core.lab.training.scenes import source_at
from langflash_core.lab.training.shards import write_shard
from langflash_core.lab.training.trained import run_export
from langflash_core.network import PRESETS, PointMapNet
from langflash_core.network.checkpoints.parts import part_folder, read_part
from langflash_core.network.checkpoints.store import assemble_network, install
from langflash_core.types import Views
from tests.lab.photos import layouts_made
from tests.lab.training.conftest import toy_record
from tests.network import published
from tests.network.sizes import TINY

MACHINE = LoopOptions(minutes=0, report_s=0.0, save_s=0.0)
PAPER = (Path(recipes.__file__).parent / "paper.toml").read_text(encoding="utf-8")


def test_the_papers_recipe_says_what_the_paper_says():
    recipe = read_recipe("paper", MACHINE)
    assert recipe.preset == "full"
    grouping, aggregation = recipe.plans
    assert [plan.stage.name for plan in recipe.plans] == ["grouping", "aggregation"]
    assert (grouping.options.max_steps, aggregation.options.max_steps) == (15_000, 6_000)
    for plan in recipe.plans:
        assert plan.stage.learning_rate == 2e-4 and plan.stage.views == {2: 1.0}
    assert "siamese" not in aggregation.stage.modules and aggregation.stage.modules == ("aggregation",)
    # What the paper leaves open is what the design chose.
    own = GroupingWeights(mse=0.0, teacher=1.0)  # SAM's embedding, not what stands in for it
    assert grouping.stage.loss.keywords == {"weights": own}  # type: ignore[attr-defined]
    assert grouping.stage.dense and not aggregation.stage.dense
    assert aggregation.stage.loss.keywords == {"weights": AggregationWeights()}  # type: ignore[attr-defined]


BAD = {
    "not TOML": (r"preset = ", "preset = = ", "is not TOML"),
    "an unknown stage": (
        r'name = "grouping"',
        'name = "taste"',
        "is named one of points, grouping",
    ),
    "a word too many": (r"clip = 0.5", "clip = 0.5\nclap = 1.0", "knows no clap"),
    "a word too few": (r"clip = 0.5.*", "", "lacks clip"),
    "a weight too few": (r"dice = 1.0.*", "", "weights lacks dice"),
    "a word for a number": (
        r"iterations = 15000",
        'iterations = "many"',
        "must be a whole number",
    ),
    "no views": (r"views = \{ 2 = 1.0 \}", "views = {}", "numbers above 0"),
    "no preset": (r'preset = "full"', 'preset = "large"', "preset must be one of"),
    "half of a precision": (r'precision = "auto"', 'precision = "half"', "auto, float32, bfloat16"),
    "three betas": (r"betas = \[0.9, 0.999\]", "betas = [0.9, 0.9, 0.9]", "betas are two numbers"),
    "too many photos": (r"photos = 0.0", "photos = 2.0", "photos is a share"),
}


@pytest.mark.parametrize("kind", list(BAD))
def test_a_recipe_that_says_something_else_is_refused_in_one_sentence(kind, tmp_path):
    pattern, instead, said = BAD[kind]
    text, count = re.subn(pattern, instead, PAPER, count=1)
    assert count == 1
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said) as caught:
        read_recipe(str(path), MACHINE)
    assert "\n" not in str(caught.value) and "own.toml" in str(caught.value)


def test_a_recipe_that_is_not_there_is_named():
    with pytest.raises(InputError, match="there is no recipe 'gone'; choose paper, or the path"):
        read_recipe("gone", MACHINE)


def test_rooms_for_the_papers_network_are_squares_without_tokens():
    plan = cache_plan("train", 64, preset="full")
    assert not plan.with_tokens and {shard.size for shard in plan.shards()} == {(256, 256)}
    assert {shard.size for shard in cache_plan("train", 256).shards()} != {(256, 256)}


def _encode(phrases):
    """Unit vectors (P, 512) by the last word, as CLIP's are in number."""
    seeds = [sum(ord(c) * 31**i for i, c in enumerate(p.split()[-1])) % 2**31 for p in phrases]
    rows = [torch.randn(512, generator=torch.Generator().manual_seed(s)) for s in seeds]
    return F.normalize(torch.stack(rows), dim=-1)


@pytest.fixture
def imported(tmp_path, monkeypatch) -> Path:
    """NoPoSplat and LSeg in small, installed, and a cache of four rooms."""
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    monkeypatch.setitem(PRESETS, "full", TINY)
    for name, state in (
        ("mixRe10kDl3dv.ckpt", published.draw_noposplat(TINY)),
        ("demo_e200.ckpt", published.draw_lseg(TINY, channels=512)),
    ):
        torch.save({"state_dict": state}, tmp_path / name)
        install(tmp_path / name, TINY)
    records = [replace(toy_record(seed), tokens=None, token_scales=None) for seed in range(4)]
    write_shard(tmp_path / "cache" / "train" / "a.safetensors", records)
    return tmp_path / "cache"


@pytest.fixture
def short(tmp_path) -> Path:
    """The paper's recipe, but for its length and SAM."""
    text = re.sub(r"iterations = \d+", "iterations = 3", PAPER)
    text = re.sub(r"teacher = 1.0", "teacher = 0.0", text)
    path = tmp_path / "short.toml"
    path.write_text(re.sub(r"batches = \d+", "batches = 2", text), encoding="utf-8")
    return path


@pytest.mark.slow
def test_the_papers_recipe_trains_grouping_and_aggregation_on_a_frozen_geometry(imported, short, tmp_path):
    before = assemble_network(TINY, None, "cpu").state_dict()
    recipe = read_recipe(str(short), MACHINE)
    network = run_recipe(recipe, imported, tmp_path / "run", None, _encode)
    assert isinstance(network, PointMapNet)
    after = network.state_dict()
    frozen = [key for key in before if not key.startswith("aggregation.")]
    assert frozen and all(torch.equal(before[key], after[key]) for key in frozen)
    drawn = torch.load(tmp_path / "run" / "grouping.pt", weights_only=True)
    assert drawn["step"] == 3 and {key.partition(".")[0] for key in drawn["ema"]} == {"scratch", "grouping"}
    out = run_export(tmp_path / "run", tmp_path / "trained.safetensors", None, preset="full")
    part = read_part(out)
    assert part.modules == ("aggregation", "grouping", "scratch")
    assert part.reads == read_part(part_folder(TINY) / "geometry.safetensors").trunk
    trained = assemble_network(TINY, out, "cpu")
    assert isinstance(trained, PointMapNet)
    assert trained.grouped and trained.aggregated and trained.notes == ()
    assert trained.sizes.mask_filter is None  # its scores are existence, not the released grouping's
    K = torch.tensor([[60.0, 0, 32], [0, 60.0, 32], [0, 0, 1]]).expand(2, 3, 3)
    prediction = trained.predict(Views(torch.rand(2, 3, 64, 64), K, ("a", "b")))
    assert torch.isfinite(prediction.dictionary).all() and prediction.dictionary.shape[1] == 512


@pytest.fixture
def scenes(tmp_path) -> dict[str, Path]:
    """ScanNet in LSM's layout and labelled chunks of RealEstate10K, two scenes each."""
    wall = layouts_made.wall(tmp_path / "wall", 5)
    layouts_made.scannet_table(tmp_path / "scannet")
    for name in ("scene0000_00", "scene0001_00"):
        layouts_made.lsm_scene(wall, tmp_path / "scannet" / name)
    layouts_made.re10k_split(wall, tmp_path / "re10k")
    layouts_made.collect(wall, tmp_path / "re10k" / "test" / "000000.torch", keys=("aaaa", "bbbb"))
    return {"scannet": tmp_path / "scannet", "re10k": tmp_path / "re10k" / "test"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["scannet", "re10k"])
def test_the_papers_recipe_runs_on_published_layouts_with_sam(name, imported, scenes, tmp_path, monkeypatch):
    monkeypatch.setitem(PRESETS, "full", replace(TINY, native_area=64 * 64))
    save_file(published.draw_mobile_sam(), tmp_path / "sam.safetensors")
    text = re.sub(r"batches = \d+", "batches = 2", re.sub(r"iterations = \d+", "iterations = 3", PAPER))
    (tmp_path / "long.toml").write_text(text, encoding="utf-8")
    kept, run = tmp_path / "kept", tmp_path / "run"
    kept.mkdir()

    def go() -> None:
        recipe = read_recipe(str(tmp_path / "long.toml"), MACHINE)
        sam = tmp_path / "sam.safetensors"
        source = source_at(scenes[name])
        run_recipe(recipe, kept, run, None, _encode, scenes=source, sam=sam, sam_side=64)

    go()
    rows = [json.loads(line) for line in (run / "grouping.jsonl").read_text().splitlines()]
    told = [row for row in rows if row["kind"] == "train"]
    assert len(told) == 3 and all(row["teacher"] > 0 for row in told)
    state = torch.load(run / "aggregation.pt", weights_only=True)
    assert state["step"] == 3 and all(torch.isfinite(value).all() for value in state["ema"].values())
    files = {path: path.stat().st_mtime_ns for path in kept.rglob("*.safetensors")}
    assert len(files) > 4
    shutil.rmtree(run)
    go()  # from the start, on what is kept: the same curve, and nothing is computed again
    again = [json.loads(line) for line in (run / "grouping.jsonl").read_text().splitlines()]
    assert [row["loss"] for row in again if row["kind"] == "train"] == [row["loss"] for row in told]
    assert {path: path.stat().st_mtime_ns for path in kept.rglob("*.safetensors")} == files


def test_a_stage_with_a_teacher_needs_its_weights(imported, tmp_path):
    with pytest.raises(InputError, match="name weights of MobileSAM with --sam-teacher"):
        run_recipe(read_recipe("paper", MACHINE), imported, tmp_path / "run", None, _encode)


def test_the_papers_recipe_needs_a_geometry(imported, short, tmp_path):
    recipe = read_recipe(str(short), MACHINE)
    (part_folder(TINY) / "language.safetensors").unlink()
    with pytest.raises(WeightsError, match=r"no weights for language_head.*weights get NAME"):
        run_recipe(recipe, imported, tmp_path / "run", None, _encode)
    last = replace(recipe, plans=recipe.plans[1:])
    install(tmp_path / "demo_e200.ckpt", TINY)
    with pytest.raises(InputError, match="stage 'aggregation' reads grouping; train that first"):
        run_recipe(last, imported, tmp_path / "run", None, _encode)
