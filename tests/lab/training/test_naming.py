"""The parts of rooms on disk, and the stage that learns names from them."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.lab.training import naming
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.naming import NAMING, naming_stage
from langflash_core.lab.training.parts import PartSet, guessed_geometry, joined, parts_of, run_parts
from langflash_core.lab.training.stages.stage import one_scene
from langflash_core.lab.training.validation import MEASURES, Validator


@pytest.fixture
def parts(rooms, network, tmp_path: Path) -> PartSet:
    net = network().eval()
    assert run_parts(net, rooms.folder, tmp_path / "parts") > 0
    return PartSet(tmp_path / "parts")


def test_parts_of_a_room_are_called_what_they_show(rooms, network, words):
    net, batch = network().eval(), one_scene(rooms.draw(1, 2, words.generator), 0)
    *found, truth = parts_of(net, batch)
    assert [label.group for label in truth.labels] == ["wall", "floor", "sofa", "table"]
    assert torch.equal(truth.quality.round(decimals=4), torch.ones(4))  # a mask is wholly itself
    assert truth.looks.shape == (4, 4 * 384)
    assert all(bool((room.quality > 0.3).all()) for room in found)
    assert all(torch.isfinite(getattr(truth, name)).all() for name in ("atoms", "looks", "places"))


def test_the_guessed_geometry_is_in_view_0s_unit(rooms, network, words):
    net, batch = network().eval(), one_scene(rooms.draw(1, 2, words.generator), 0)
    depths, viewmats = guessed_geometry(net, batch)
    truth = batch.depths[0]
    ratios = [float((d[t > 0] / t[t > 0]).median()) for d, t in zip(depths, truth, strict=True)]
    assert ratios[1] == pytest.approx(ratios[0], rel=1e-3)  # float32 medians
    torch.testing.assert_close(viewmats[1, :3, 3], batch.viewmats[0, 1, :3, 3] * ratios[0])
    torch.testing.assert_close(viewmats[:, :3, :3], batch.viewmats[0, :, :3, :3])


def test_what_is_stored_comes_back(parts, rooms, network):
    written = joined(parts.rooms)
    made = joined([room for one in rooms.walk(1, views=2) for room in parts_of(network().eval(), one)])
    assert written.labels == made.labels
    assert written.sizes == made.sizes
    assert written.seeds == made.seeds
    torch.testing.assert_close(written.places, made.places)
    torch.testing.assert_close(written.atoms, made.atoms, atol=2e-3, rtol=2e-3)  # stored as float16
    torch.testing.assert_close(written.looks, made.looks, atol=1e-2, rtol=2e-3)
    again = joined(joined(parts.rooms).rooms())
    assert torch.equal(again.looks, written.looks)
    assert again.labels == written.labels


@pytest.mark.parametrize(("absent", "left"), [(0.0, "all"), (0.5, "some"), (1.0, "one")])
def test_a_thinned_room_keeps_whole_parts(parts, monkeypatch, absent, left):
    """Every part that stays keeps its own numbers and name; one always stays."""
    monkeypatch.setattr(naming, "ABSENT", absent)
    room = joined(parts.rooms)  # all parts as one room, so that there are many
    room = replace(room, sizes=(len(room.labels),), seeds=room.seeds[:1])
    thin = naming._thinned(room, torch.Generator().manual_seed(3))
    rows = [int((room.looks == look).all(1).nonzero()[0]) for look in thin.looks]
    assert rows == sorted(set(rows))
    assert [room.labels[i] for i in rows] == list(thin.labels)
    assert torch.equal(room.places[rows], thin.places)
    assert thin.sizes == (len(rows),)
    expected = {"all": {len(room.labels)}, "some": range(2, len(room.labels)), "one": {1}}
    assert len(rows) in expected[left]


def test_finished_files_are_left_alone(parts, rooms, network, tmp_path: Path):
    path = next((tmp_path / "parts").glob("*.safetensors"))
    before = path.stat().st_mtime_ns
    assert run_parts(network().eval(), rooms.folder, tmp_path / "parts") == 0
    assert path.stat().st_mtime_ns == before
    with pytest.raises(ValueError, match="langflash lab train parts"):
        PartSet(tmp_path / "nowhere")


@pytest.mark.slow
def test_the_namer_learns_four_rooms_and_nothing_else_moves(parts, words, network, tmp_path: Path):
    net = network()
    net.namer.mean, net.namer.std = parts.statistics()
    fixed = replace(words, generator=torch.Generator().manual_seed(7))
    batch = parts.draw(8, 1, fixed.generator)
    before = float(naming_stage(net, batch, fixed).total.detach())
    kept = {k: v.clone() for k, v in net.state_dict().items()}
    options = LoopOptions(minutes=10, max_steps=60, learning_rate=1e-3, ema_decay=0.5, save_s=1e9)
    train_stage(net, NAMING, parts, words, tmp_path / "run", options)
    fixed.generator.manual_seed(7)
    parts.draw(8, 1, fixed.generator)
    after = float(naming_stage(net, batch, fixed).total.detach())
    assert after < 0.8 * before  # about twice what was seen is left
    moved = {k for k, v in net.state_dict().items() if not torch.equal(v, kept[k])}
    assert moved
    assert all(k.startswith("namer.") for k in moved)
    measure, views = MEASURES["naming"]
    with torch.inference_mode():
        values = Validator(parts, words, measure, views)(net.eval())
    assert values["named_accuracy"] > max(0.8, values["before_accuracy"])
