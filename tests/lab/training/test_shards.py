"""Shards: what goes in comes out, in part too; and nothing half-written stays."""

from pathlib import Path

import pytest
import torch

from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.shards import (
    Shard,
    dequantise_tokens,
    open_shards,
    quantise_tokens,
    write_shard,
)
from tests.lab.training.conftest import SIZE, toy_record


def test_a_record_comes_back_as_written(tmp_path: Path):
    records = [toy_record(seed) for seed in (3, 4)]
    write_shard(tmp_path / "a.safetensors", records)
    shard = Shard(tmp_path / "a.safetensors")
    assert (len(shard), shard.views, shard.height, shard.width) == (2, 3, SIZE, SIZE)
    back = shard.record(1)
    for name in ("rgb", "depths", "instances", "viewmats", "Ks", "tokens", "token_scales"):
        assert torch.equal(getattr(back, name), getattr(records[1], name)), name
    assert back.labels == records[1].labels
    assert back.seed == 4


def test_views_come_in_the_order_asked_for(tmp_path: Path):
    record = toy_record(0)
    write_shard(tmp_path / "a.safetensors", [record])
    part = Shard(tmp_path / "a.safetensors").record(0, views=(2, 0), with_tokens=False)
    assert torch.equal(part.rgb, record.rgb[[2, 0]])
    assert part.tokens is None


def test_tokens_lose_at_most_half_a_step():
    tokens = torch.randn(5, 7, 384, generator=torch.Generator().manual_seed(0)) * 3
    steps, scales = quantise_tokens(tokens)
    error = (dequantise_tokens(steps, scales) - tokens).abs()
    # Half a step, and the scale's own rounding to float16 (2^-11) over 127 steps.
    bound = scales.float()[..., None] * (0.5 + 127 * 2**-11)
    assert bool((error <= bound).all())
    assert not dequantise_tokens(*quantise_tokens(torch.zeros(2, 4))).any()
    with pytest.raises(ValueError, match="finite"):
        quantise_tokens(torch.tensor([[1.0, torch.nan]]))


def test_bad_shards_are_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="at least one"):
        write_shard(tmp_path / "a.safetensors", [])
    with pytest.raises(ValueError, match="one shape"):
        write_shard(tmp_path / "a.safetensors", [toy_record(0, views=2), toy_record(1, views=3)])
    with pytest.raises(ValueError, match="train cache"):
        open_shards(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_batches_start_at_view_0(tmp_path: Path):
    write_shard(tmp_path / "a.safetensors", [toy_record(seed) for seed in range(3)])
    rooms = RoomSet(tmp_path)
    batch = rooms.draw(4, 2, torch.Generator().manual_seed(5))
    assert batch.images.shape == (4, 2, 3, SIZE, SIZE)
    assert torch.allclose(batch.viewmats[:, 0], torch.eye(4).expand(4, 4, 4), atol=1e-6)  # one rounding
    assert batch.tokens is not None
    assert batch.tokens.hooks[0].shape == (4, 2, 64, 384)
    again = rooms.draw(4, 2, torch.Generator().manual_seed(5))
    assert again.seeds == batch.seeds
    assert torch.equal(again.images, batch.images)


def test_walking_sees_every_scene_once(tmp_path: Path):
    write_shard(tmp_path / "a.safetensors", [toy_record(seed) for seed in range(3)])
    write_shard(tmp_path / "b.safetensors", [toy_record(seed, views=2) for seed in range(3, 5)])
    seeds = [seed for batch in RoomSet(tmp_path).walk(2, views=2) for seed in batch.seeds]
    assert sorted(seeds) == [0, 1, 2, 3, 4]
