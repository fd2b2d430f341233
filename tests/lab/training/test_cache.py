"""Rendered rooms on disk: the plan, the pictures, resuming, and the whole chain to a weights file."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.errors import GraphicsError, InputError
from langflash_core.lab.rooms import HELD_OUT_LIBRARIES, RoomRenderer, load_pack
from langflash_core.lab.training import commands
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.cache import (
    HELD_OUT_SEED,
    CachePlan,
    ShardPlan,
    encode_pictures,
    fill_cache,
    fill_panes,
    photometric,
    rooms_renderer,
)
from langflash_core.lab.training.loop import LoopOptions
from langflash_core.lab.training.shards import NOTHING, Shard
from langflash_core.lab.training.trained import run_export
from langflash_core.network import MINI, GuidedDepthNet, load_network, save_network
from langflash_core.network.checkpoints.files import read_weights
from tests.lab.training.conftest import encode, toy_record
from tests.lab.training.runs import run_train

TINY_PACK = Path(__file__).resolve().parents[2] / "fixtures" / "rooms" / "cc0_pack.npz"


def toy_render(seed: int, shard: ShardPlan):
    return replace(toy_record(seed, views=shard.views), tokens=None, token_scales=None)


@pytest.fixture(scope="module")
def encoder(tmp_path_factory) -> Path:
    """A weights file with a randomly drawn encoder."""
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "start.safetensors"
    save_network(GuidedDepthNet(MINI), path)
    return path


def test_a_plan_covers_its_seeds_once():
    plan = CachePlan(first_seed=10, scenes=70, scenes_per_shard=32, three_view_every=2)
    shards = list(plan.shards())
    assert [(s.first_seed, s.count, s.views) for s in shards] == [(10, 32, 2), (42, 32, 3), (74, 6, 2)]
    assert all(side % 14 == 0 for s in shards for side in s.size)
    assert len({s.name for s in shards}) == 3


def test_parts_share_the_work_and_finished_shards_stay(tmp_path: Path):
    plan = CachePlan(0, 5, with_tokens=False, scenes_per_shard=2, three_view_every=0)
    assert fill_cache(tmp_path, plan, toy_render, None, part=(0, 2)) == 3
    assert fill_cache(tmp_path, plan, toy_render, None, part=(1, 2)) == 2
    times = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert fill_cache(tmp_path, plan, toy_render, None) == 0
    assert times == {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert len(RoomSet(tmp_path)) == 5


def test_bad_plans_are_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="encoder"):
        fill_cache(tmp_path, CachePlan(0, 1), toy_render, None)
    with pytest.raises(ValueError, match="part"):
        fill_cache(tmp_path, CachePlan(0, 1, with_tokens=False), toy_render, None, part=(2, 2))
    with pytest.raises(InputError, match="held_out"):
        commands.cache_plan("test", 1)


def test_cached_tokens_are_the_encoders(tmp_path: Path, network):
    net = network()
    plan = CachePlan(0, 1, augment=False, scenes_per_shard=1, three_view_every=0)
    fill_cache(tmp_path, plan, toy_render, net.encoder)
    batch = next(iter(RoomSet(tmp_path).walk(1)))
    assert batch.tokens is not None
    exact, _ = net.encoder(batch.images)
    assert batch.tokens.grid == exact.grid
    for stored, true in zip(batch.tokens.hooks, exact.hooks, strict=True):
        # bfloat16 passes through twelve blocks, and eight bits a value: 3 % is what they lose.
        assert float((stored - true).norm() / true.norm()) < 0.03


def test_augmentation_repeats_and_keeps_views_alike():
    rgb = toy_record(0).rgb
    assert torch.equal(photometric(rgb, 7), photometric(rgb, 7))
    changed = [photometric(rgb, seed) for seed in range(60)]
    grey = sum(bool((c.amax(1).int() - c.amin(1).int()).max() <= 1) for c in changed)
    assert 2 <= grey <= 19  # 15 % of 60, 4 sigma
    same = torch.cat([rgb[:1], rgb[:1]])
    alike = [torch.equal(*photometric(same, seed)) for seed in range(60)]
    assert 14 <= sum(alike) <= 46  # half of 60, 4 sigma: the others have exposures of their own
    drifts = [photometric(same, seed).float().mean((1, 2, 3)) for seed in range(60)]
    assert max(float(d.max() / d.min()) for d in drifts) < 1.7  # e^0.5: both ends of the range


def test_panes_belong_to_the_nearest_opening():
    ids = np.full((6, 6), 0)
    ids[1:5, 1:5] = 2
    ids[2:4, 2:4] = NOTHING
    filled = fill_panes(ids, [2])
    assert (filled[2:4, 2:4] == 2).all()
    assert (fill_panes(ids, []) == ids).all()


def test_encoding_is_per_picture(network):
    net = network()
    rgb = toy_record(1).rgb
    both = encode_pictures(net.encoder, rgb)
    assert both.shape == (3, 4, 64, 384)
    # bfloat16 matrix products may be cut differently for another batch size.
    torch.testing.assert_close(both[1:2], encode_pictures(net.encoder, rgb[1:2]), atol=0.1, rtol=0.05)


@pytest.mark.slow
def test_from_furniture_to_weights(tmp_path: Path, encoder: Path):
    try:
        RoomRenderer(load_pack(TINY_PACK)).release()
    except GraphicsError as error:
        pytest.skip(str(error))
    cache, run = tmp_path / "cache", tmp_path / "run"
    # The tiny pack holds only public-domain furniture, which training must not see.
    assert commands.run_cache(cache, TINY_PACK, encoder, kind="held_out", scenes=2) == 2
    shard = Shard(next((cache / "held_out").iterdir()))
    assert shard.scenes[0]["seed"] == HELD_OUT_SEED
    assert shard.record(0).tokens is None
    (cache / "train").mkdir()
    net = load_network("mini", encoder)
    assert isinstance(net, GuidedDepthNet)
    renderer = RoomRenderer(load_pack(TINY_PACK))
    plan = CachePlan(0, 1, scenes_per_shard=1, three_view_every=1)
    fill_cache(
        cache / "train", plan, rooms_renderer(load_pack(TINY_PACK), renderer, HELD_OUT_LIBRARIES), net.encoder
    )
    renderer.release()
    options = LoopOptions(minutes=1, max_steps=1, pictures=2)
    with pytest.raises(InputError, match="reads depth"):
        run_train(["refine"], cache, run, encoder, encode, [1], options=options, from_scratch=True)
    with pytest.raises(InputError, match="no stage 'taste'"):
        run_train(["taste"], cache, run, encoder, encode, [1])
    with pytest.raises(InputError, match="no trained stage"):
        run_export(run, tmp_path / "mini.safetensors", encoder)
    run_train(["depth", "language"], cache, run, encoder, encode, [1, 1], options=options)
    details = {"data": "one room", "calibration": {"threshold": 0.7}}
    out = run_export(run, tmp_path / "mini.safetensors", encoder, metadata=details)
    header = read_weights(out)[1]
    assert header["training"]["depth"]["steps"] == 1
    assert header["data"] == "one room"
    assert load_network("mini", out).calibration == {"threshold": 0.7}
    json.dumps(header)
