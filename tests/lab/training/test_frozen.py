"""What frozen networks say is computed once, and read the same ever after."""

import json
from dataclasses import replace
from typing import Any

import pytest
import torch

from langflash_core.lab.training.dense import DenseSet
from langflash_core.lab.training.frozen import FrozenSet
from langflash_core.lab.training.grouping import GroupingWeights
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.mixing import Mixed, MixedSet
from langflash_core.lab.training.recipes import weighted
from langflash_core.lab.training.stages.aggregation import named_parts
from langflash_core.lab.training.stages.grouping import STUDENT, taught, untaught
from langflash_core.lab.training.stages.stage import one_scene, tokens_of
from langflash_core.lab.training.stages.table import POINT_STAGES, STAGES
from langflash_core.network import build_network
from langflash_core.network.encoders.mobile_sam import MobileSamEncoder
from tests.network.sizes import TINY

SIZES = replace(TINY, mask_filter=None)
# Eight bits with a scale a vector: half a step of 1/127 of the largest of 32 to 512 numbers.
EIGHT_BITS = 0.02


@pytest.fixture
def tiny():
    torch.manual_seed(0)
    return build_network(SIZES).eval().requires_grad_(False)


@pytest.fixture(scope="module")
def sam() -> MobileSamEncoder:
    torch.manual_seed(0)
    return MobileSamEncoder(64).eval().requires_grad_(False)


def _draw(rooms, seed=0, count=2) -> Any:
    return rooms.draw(count, 2, torch.Generator().manual_seed(seed))


def test_tokens_and_features_are_computed_once(rooms, tiny, tmp_path, monkeypatch):
    kept = FrozenSet.of(rooms, tiny, tmp_path, features=True)
    first = _draw(kept)
    tokens = tiny.encode(first.images, first.Ks)
    features = tiny.language(tokens, first.images)
    monkeypatch.setattr(tiny, "encode", None)
    monkeypatch.setattr(tiny, "language", None)
    again = _draw(kept)
    pairs = [*zip(tokens.hooks, again.frozen.tokens.hooks, strict=True), (features, again.frozen.features)]
    for exact, read in pairs:
        assert read.shape == exact.shape and (read - exact).norm() < EIGHT_BITS * exact.norm()
    assert all(map(torch.equal, first.frozen.tokens.hooks, again.frozen.tokens.hooks))
    assert torch.equal(first.frozen.features, again.frozen.features)
    assert tokens_of(tiny, again).hooks is again.frozen.tokens.hooks
    found = named_parts(tiny, one_scene(again, 1))
    assert found is None or torch.isfinite(found.atoms).all()


def test_other_networks_and_other_orders_of_views_are_kept_apart(rooms, tiny, tmp_path):
    batch = _draw(FrozenSet.of(rooms, tiny, tmp_path, features=False), count=1)
    with torch.no_grad():
        next(tiny.decoder.parameters()).mul_(1.5)
    other = _draw(FrozenSet.of(rooms, tiny, tmp_path, features=False), count=1)
    assert not torch.equal(batch.frozen.tokens.hooks[1], other.frozen.tokens.hooks[1])
    assert len(list(tmp_path.iterdir())) == 2


def test_steps_on_kept_tokens_learn_nearly_what_steps_on_fresh_ones_do(rooms, words, tmp_path):
    """The loss of the first step, on tokens that are 1 % off."""
    losses = []
    for kept in (False, True):
        torch.manual_seed(0)
        network = build_network(SIZES).eval()
        learned = FrozenSet.of(rooms, network, tmp_path / "kept", features=False) if kept else rooms
        again = replace(words, generator=torch.Generator().manual_seed(0))
        batch = learned.draw(2, 2, again.generator)
        with torch.no_grad():
            losses.append(float(POINT_STAGES["grouping"].loss(network, batch, again).total))
    assert losses[1] == pytest.approx(losses[0], rel=0.02)


def test_sams_embedding_is_computed_once_a_picture(rooms, sam, tmp_path, monkeypatch):
    kept = DenseSet(rooms, sam, tmp_path)
    first = _draw(kept)
    exact = sam.dense(first.images.flatten(0, 1)).unflatten(0, (2, 2))
    assert first.dense.shape == (2, 2, 256, 4, 4)
    assert (first.dense - exact).norm() < EIGHT_BITS * exact.norm()
    monkeypatch.setattr(sam, "dense", None)
    assert torch.equal(_draw(kept).dense, first.dense)


def test_photos_of_a_mixed_step_have_their_embedding_too(rooms, sam, tmp_path):
    mixed = DenseSet(MixedSet(rooms, rooms, 0.5), sam, tmp_path).part(0, 2)
    batch = _draw(mixed)
    assert isinstance(batch, Mixed) and batch.rooms is not None
    assert batch.photos.dense is not None and batch.rooms.dense is not None


def test_grouping_learns_sams_embedding_and_leaves_no_student_behind(rooms, words, network, sam, tmp_path):
    net = network()
    before = set(net.state_dict())
    stage = taught(weighted(STAGES["grouping"], GroupingWeights(teacher=1.0)), net)
    options = LoopOptions(minutes=1e6, max_steps=8, pictures=4, report_s=0.0, save_s=1e9, learning_rate=2e-2)
    train_stage(net, stage, DenseSet(rooms, sam, tmp_path / "sam"), words, tmp_path, options)
    rows = [json.loads(line) for line in (tmp_path / "grouping.jsonl").read_text().splitlines()]
    told = [row["teacher"] for row in rows if row["kind"] == "train"]
    assert len(told) == 8 and min(told[-2:]) < 0.9 * told[0]  # seen: .81
    assert any(name.startswith(STUDENT) for name in net.state_dict())
    untaught(net)
    assert set(net.state_dict()) == before
