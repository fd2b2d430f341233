"""Steps that learn from rooms and photos at once, and the commands that put them together."""

from dataclasses import replace

import pytest
import torch

from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.commands import phrase_table, run_find_parts
from langflash_core.lab.training.loop import LoopOptions
from langflash_core.lab.training.mixing import Mixed, MixedSet, loss_of
from langflash_core.lab.training.parts import PartSet
from langflash_core.lab.training.shards import NOTHING, Label, write_shard
from langflash_core.lab.training.stages.grouping import grouping_stage
from langflash_core.lab.training.stages.stage import Loss
from langflash_core.lab.training.trained import run_export
from langflash_core.network import MINI, load_network, save_network
from langflash_core.network.build import build_network
from tests.lab.training.conftest import encode, toy_record
from tests.lab.training.runs import run_train


def photo_record(seed: int):
    """A room as a photo would be kept: one view, the left third not labelled, a name of its own."""
    record = toy_record(seed, views=1)
    ids = record.instances.clone()
    ids[:, :, : ids.shape[-1] // 3] = NOTHING
    labels = (*record.labels[:3], Label("kitchen counter", "counter"))
    return replace(record, instances=ids, labels=labels)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cache")
    for name in ("train", "validation"):
        write_shard(folder / name / "a.safetensors", [toy_record(seed) for seed in range(2)])
        write_shard(folder / "photos" / name / "b.safetensors", [photo_record(10 + k) for k in range(3)])
    return folder


@pytest.fixture
def mixed(cache):
    return MixedSet(RoomSet(cache / "train"), RoomSet(cache / "photos" / "train", partly=True), 0.75)


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    path = tmp_path_factory.mktemp("start") / "start.safetensors"
    torch.manual_seed(0)
    save_network(build_network(MINI), path)
    return path


def test_a_step_takes_its_share_of_pictures_from_photos(mixed):
    batch = mixed.draw(4, 2, torch.Generator().manual_seed(0))
    assert batch.photos.images.shape[:2] == (6, 1)
    assert batch.rooms is not None and batch.rooms.images.shape[:2] == (1, 2)
    assert batch.photos.partly and not batch.rooms.partly
    assert len(batch.seeds) == 7
    assert len(mixed) == 5
    alone = replace(mixed, share=1.0).draw(4, 1, torch.Generator().manual_seed(0))
    assert alone.rooms is None
    with pytest.raises(ValueError, match="share"):
        replace(mixed, share=0.0)


def test_losses_are_added_by_their_shares(mixed, words, network):
    batch = mixed.draw(4, 1, torch.Generator().manual_seed(0))

    def loss(network, part, words) -> Loss:
        value = 2.0 if part.partly else 10.0
        return Loss(torch.tensor(value), {"value": value})

    both = loss_of(loss, network(), batch, words)
    assert float(both.total) == pytest.approx(0.75 * 2 + 0.25 * 10)
    assert both.parts == {"value": 10.0, "photos_value": 2.0}
    only = loss_of(loss, network(), Mixed(batch.photos, None, 1.0), words)
    assert float(only.total) == 2
    assert float(loss_of(loss, network(), batch.rooms, words).total) == 10


def test_grouping_does_not_judge_what_nobody_labelled(mixed, words, network):
    """Masks may do there as they like: other logits in the unlabelled third leave the loss as it is."""
    photos = mixed.draw(2, 1, torch.Generator().manual_seed(0)).photos
    net = network().eval()
    plain, maps = net.semantic_maps, []

    def spoiled(tokens, images):
        memories, finest = plain(tokens, images)
        noise = torch.zeros_like(finest)
        noise[..., : finest.shape[-1] // 4] = maps[0]
        return memories, finest + noise

    net.semantic_maps = spoiled
    totals = {}
    for partly in (True, False):
        for noise in (0.0, 3.0):
            maps[:] = [noise]
            told = replace(words, generator=torch.Generator().manual_seed(1))
            with torch.no_grad():
                totals[partly, noise] = float(grouping_stage(net, replace(photos, partly=partly), told).total)
    assert totals[True, 0.0] == pytest.approx(totals[True, 3.0], abs=1e-5)
    assert abs(totals[False, 0.0] - totals[False, 3.0]) > 1e-3


def test_the_table_holds_the_phrases_of_photos(cache):
    table = phrase_table(cache, encode)
    assert {"kitchen counter", "counter", "oak table"} <= set(table.phrases)


@pytest.mark.slow
def test_stages_learn_from_both_and_go_on(cache, start, tmp_path):
    """depth and aggregation read photos, language does not; the run continues."""
    options = LoopOptions(minutes=10, max_steps=1, pictures=2, save_s=1e9, validate_s=1e9)
    run = tmp_path / "run"

    def train(*stages: str, steps: int = 1):
        own = replace(options, max_steps=steps)
        return run_train(stages, cache, run, start, encode, [10] * len(stages), options=own)

    train("depth")
    train("language", "depth", "aggregation", steps=2)
    log = (run / "depth.jsonl").read_text()
    assert '"step": 2' in log and "photos_shape" in log and "photos_abs_rel" in log
    assert "photos_atoms_accuracy" in (run / "aggregation.jsonl").read_text()
    assert "photos" not in (run / "language.jsonl").read_text()
    assert load_network("mini", run_export(run, tmp_path / "w.safetensors", start)).preset == MINI


@pytest.mark.slow
def test_parts_of_photos_are_found_beside_those_of_rooms(cache, start):
    count = run_find_parts(cache, start)
    rooms, photos = cache / "train" / "parts", cache / "photos" / "train" / "parts"
    both = PartSet(rooms, photos)
    assert 0 < len(PartSet(rooms)) < len(both)
    assert count >= sum(len(room.labels) for room in both.rooms)
    assert any(label.group == "counter" for room in both.rooms for label in room.labels)
