"""Learning with few labels: what is pasted and what it is called, the averaged teacher, that it learns."""

import json
import math
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training import fewlabels
from langflash_core.lab.training.bank import NameBank
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.fewlabels import (
    ATTRACTION,
    TEMPERATURE,
    Averaged,
    cut_boxes,
    name_loss,
    pasted,
    scaled,
)
from langflash_core.lab.training.further import Sets, train_few
from langflash_core.lab.training.late import SkippingBlock, make_whole
from langflash_core.lab.training.loop import LoopOptions, Optimising
from langflash_core.lab.training.real import MODULES
from langflash_core.lab.training.shards import Label, write_shard
from langflash_core.lab.training.states import load_averaged
from langflash_core.lab.training.words import build_table
from langflash_core.network import MINI
from langflash_core.network.build import build_network
from langflash_core.network.encoders.late import LateHalf

from .conftest import NAMES, encode, red_walls, toy_record


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    root = tmp_path_factory.mktemp("sets")
    main = red_walls(root / "main", 6, labelled=1)
    more = [red_walls(root / "outlines", 3, labelled=0.3), red_walls(root / "plain", 2, labelled=0)]
    return Sets.of(main, main.ids, more, encode)


def test_sets_are_told_or_silent(sets):
    assert [one.folder.root.name for one in sets.told.sets] == ["main"]
    assert sets.silent is not None and [one.folder.root.name for one in sets.silent.sets] == [
        "outlines",
        "plain",
    ]
    drawn = sets.silent.draw(12, torch.Generator().manual_seed(1))
    again = sets.silent.draw(12, torch.Generator().manual_seed(1))
    assert torch.equal(drawn.relit, again.relit) and drawn.seeds == again.seeds
    plain = drawn.sets == 2
    assert plain.any() and (drawn.classes[plain] == -1).all()
    assert (drawn.classes[~plain] >= 0).any() and (drawn.classes[~plain] == -1).any()
    assert not torch.equal(drawn.images, drawn.relit), "the teacher sees the photo's own light"


def test_pasted_pixels_and_what_the_teacher_said_of_them_go_together():
    """A map of places, cut like the photos at four pixels a patch, names the pixel that shows there."""
    photos = torch.randint(0, 255, (5, 1, 3, 8 * 14, 10 * 14), generator=torch.manual_seed(0))
    boxes, other = cut_boxes(5, (8, 10), torch.Generator().manual_seed(1))
    assert any(bottom > top for top, _, bottom, _ in boxes) and any(not any(box) for box in boxes)
    mixed = pasted(photos, scaled(boxes, 14), other)
    places = torch.arange(5 * 32 * 40).view(5, 32, 40)
    origin = pasted(places, scaled(boxes, 4), other)
    for place in range(0, origin.numel(), 7):
        b, y, x = np.unravel_index(place, (5, 32, 40))
        from_b, from_y, from_x = np.unravel_index(int(origin[b, y, x]), (5, 32, 40))
        assert (from_y, from_x) == (y, x)
        row, column = int((y + 0.5) * 3.5), int((x + 0.5) * 3.5)
        assert torch.equal(mixed[b, 0, :, row, column], photos[from_b, 0, :, row, column])


def test_what_a_set_does_not_name_changes_no_loss():
    """Against a plain loop in double precision, and with other texts for the name that nobody denies."""
    texts = F.normalize(torch.randn(4, 384, generator=torch.manual_seed(0)), dim=1)
    against = torch.ones(1, 4, 4, dtype=torch.bool)
    against[0, :3, 3] = False
    bank = NameBank(("a", "b", "c", "d"), texts, texts, torch.ones(4), (), (), against)
    units = F.normalize(torch.randn(5, 384, generator=torch.manual_seed(1)), dim=1)
    rows, of_set = torch.tensor([0, 1, 2, 0, 1]), torch.zeros(5, dtype=torch.int64)
    said = float(name_loss(units, rows, of_set, bank))
    truth = 0.0
    for unit, row in zip(units.double(), rows.tolist(), strict=True):
        cosines = texts.double()[:3] @ unit
        truth += float((TEMPERATURE * cosines).logsumexp(0) - TEMPERATURE * cosines[row])
        truth += ATTRACTION * float(1 - cosines[row])
    assert said == pytest.approx(truth / 5, rel=1e-3)  # Adam makes rounding large; other photos: tenths
    other = torch.cat((texts[:3], units[:1]))
    changed = NameBank(bank.texts, other, texts, torch.ones(4), (), (), against)
    assert float(name_loss(units, rows, of_set, changed)) == pytest.approx(said, rel=1e-6)


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    made = build_network(MINI)
    made.begin_halves()
    return made


def test_a_class_counts_from_its_own_usual_sureness(network):
    texts = torch.eye(len(CLASSES37), 384)
    teacher = Averaged(network)
    teacher.age.fill_(10**6)
    teacher.usual.fill_(0.4)
    teacher.usual[3], teacher.usual[5] = 0.9, 0.1

    def seen(row: int, sureness: float) -> torch.Tensor:
        """A unit vector whose softmax gives `row` so much, all the rest alike."""
        gap = math.log(sureness * (len(CLASSES37) - 1) / (1 - sureness)) / TEMPERATURE
        vector = torch.zeros(384)
        vector[row] = gap
        vector[300] = math.sqrt(1 - gap**2)
        return vector

    # Row 3 needs .9, row 5 .9 / 3 = .3, others .9 * 2 / 3 = .6.
    features = torch.stack([seen(3, 0.92), seen(3, 0.88), seen(5, 0.35), seen(5, 0.25), seen(7, 0.58)])
    assert teacher.surely(TEMPERATURE * features @ texts.T).tolist() == [3, -1, 5, -1, -1]
    assert float(teacher.usual[3]) == pytest.approx(0.98 * 0.9 + 0.02 * 0.9, rel=1e-3)
    assert float(teacher.usual[7]) == pytest.approx(0.98 * 0.4 + 0.02 * 0.58, rel=1e-3)
    assert float(teacher.usual[9]) == pytest.approx(0.4), "nothing was said of it"


def test_the_teacher_follows(network):
    teacher = Averaged(network)
    changed = deepcopy(network)
    with torch.no_grad():
        changed.language_head.out.bias += 1
    teacher.follow(changed)  # at age 1: a tenth of what was, nine of what is
    moved = teacher.out.bias - network.language_head.out.bias
    assert torch.allclose(moved, torch.full_like(moved, 0.9), atol=1e-6)


def test_the_teacher_says_the_same_of_a_mirrored_photo_mirrored(network):
    """Two looks: changing left and right changes nothing but left and right, up to rounding of sums."""
    teacher = Averaged(network)
    images = torch.rand(2, 1, 3, 56, 84, generator=torch.manual_seed(0))
    Ks = torch.tensor([[70.0, 0, 40], [0, 70, 28], [0, 0, 1]]).expand(2, 1, 3, 3)
    hidden, logs = teacher.looks(network, images, Ks)
    other, deeper = teacher.looks(network, *fewlabels.mirrored(images, Ks))
    one, _ = teacher._look(network, images, Ks, deep=False)
    assert logs is not None and deeper is not None
    assert torch.allclose(hidden, other.flip(2), atol=1e-4) and torch.allclose(
        logs, deeper.flip(-1), atol=1e-4
    )
    assert not torch.allclose(hidden, one, atol=1e-3), "one look is another"


def test_depth_is_not_said_of_what_was_pasted():
    maps = fewlabels.without(torch.ones(2, 6, 8), [(1, 2, 4, 5), (0, 0, 0, 0)])
    assert (
        float(maps[0].sum()) == 48 - 9 and float(maps[0, 1:4, 2:5].sum()) == 0 and bool((maps[1] == 1).all())
    )


def test_scaled_matrices_are_scaled_answers(network):
    """A skipping block at rest gives what the encoder's own block gives."""
    base = network.encoder.vit.blocks[-1]
    block = SkippingBlock(MINI.encoder_dim, MINI.encoder_heads)
    block.load_state_dict(base.state_dict())
    with torch.no_grad():
        block.ls1.gamma.uniform_(0.5, 2)
        block.ls2.gamma.uniform_(0.5, 2)
        x = torch.randn(2, 9, MINI.encoder_dim)
        plain = x + block.ls1(block.attn(block.norm1(x)))
        plain = plain + block.ls2(block.mlp(block.norm2(plain)))
        assert torch.allclose(block.eval()(x), plain, atol=1e-5)  # float32, sums of 1,536


def test_a_few_steps_teach_and_end_in_a_cut_half(sets, tmp_path):
    """Three steps, interrupted after one; the second run goes on where the first was."""
    write_shard(tmp_path / "rooms" / "a.safetensors", [toy_record(seed) for seed in (0, 1)])
    rooms = RoomSet(tmp_path / "rooms", tokens=False)
    table = build_table([Label(*names) for names in NAMES], encode)
    rule = Optimising(warm_up=1)
    options = LoopOptions(minutes=10, report_s=0.0, learning_rate=2e-3, pictures=2, optimising=rule)

    def run(steps: int):
        torch.manual_seed(0)
        network = build_network(MINI)
        network.begin_halves()
        told = replace(options, max_steps=steps)
        return network, train_few(network, sets, rooms, table, tmp_path / "run", told)

    run(1)
    network, state = run(3)
    assert state.step == 3 and isinstance(network.late, LateHalf)
    assert not hasattr(network, "averaged"), "it is no part of the network"
    rows = [json.loads(line) for line in (tmp_path / "run" / "late_few.jsonl").read_text().splitlines()]
    losses = [row["classes"] for row in rows if row["kind"] == "train" and "classes" in row]
    assert len(losses) == 3 and losses[-1] < losses[0] and all(map(math.isfinite, losses))
    told = {key for row in rows for key in row}
    asked = "names silent sure odds said_depth silent_names depth phrases room_depth"
    assert set(asked.split()) <= told
    fresh = build_network(MINI)
    assert load_averaged(fresh, tmp_path / "run", "late") == (3, pytest.approx(state.seconds))
    ours, theirs = network.state_dict(), fresh.state_dict()
    for key in (key for key in ours if key.split(".")[0] in MODULES):
        assert torch.equal(ours[key], theirs[key]), key
    for half in (network.late, network.deep):
        assert float(half.get_parameter("blocks.0.qkv.up").detach().abs().max()) > 0


def test_names_teach_one_half_and_depth_the_other(sets, network):
    made = deepcopy(network)
    make_whole(made)
    torch.nn.init.normal_(made.decoder.embed_named.weight, std=0.02)  # it begins at 0
    generator = torch.Generator().manual_seed(0)
    photos = sets.told.draw(2, torch.Generator().manual_seed(0)).to("cpu")
    tokens = made.encode(photos.relit, photos.Ks)
    hidden, out = fewlabels.read(made, tokens), made.language_head.out
    names, _ = fewlabels.told_loss(hidden, out, photos, sets.told.bank, 0.5, generator)
    depth = fewlabels._depth(made, tokens, photos.Ks, photos.depths)
    for loss, learns, rests in ((names, made.late, made.deep), (depth, made.deep, made.late)):
        of = [
            torch.autograd.grad(loss, [*half.parameters()], retain_graph=True, allow_unused=True)
            for half in (learns, rests)
        ]
        assert any(value is not None and bool(value.any()) for value in of[0])
        assert all(value is None for value in of[1])


@pytest.mark.parametrize("sure", [0.0, 1.1])
def test_photos_without_labels_teach_by_the_teacher_alone(sets, network, monkeypatch, sure):
    """A gradient comes from what it is sure of, and none, but no failure, where it is sure of nothing."""
    monkeypatch.setattr(fewlabels, "SURE", sure)
    made = deepcopy(network)
    make_whole(made)
    made.averaged = Averaged(made)
    made.requires_grad_(False)
    made.late.requires_grad_(True)
    plain = fewlabels.PhotoPool(sets.silent.sets[1:], (2,), sets.silent.bank, strong=True)
    batch = plain.draw(2, torch.Generator().manual_seed(0)).to("cpu")
    counts = fewlabels.Weights(odds=0, said_depth=0)
    monkeypatch.setattr(fewlabels, "ATTRACTION", 0.0)
    total, told = fewlabels._silent(made, batch, sets.told.bank, counts, torch.Generator().manual_seed(0))
    assert "silent_names" not in told and told["sure"] == (sure == 0)
    total.backward()
    taught = any(p.grad is not None and bool(p.grad.abs().sum() > 0) for p in made.late.parameters())
    assert taught == (sure == 0) and math.isfinite(float(total.detach()))


@pytest.mark.slow
def test_an_interrupted_run_of_batches_drawn_ahead_goes_on_as_one_that_was_not(sets, tmp_path):
    table = build_table([Label(*names) for names in NAMES], encode)
    options = LoopOptions(minutes=10, report_s=0.0, learning_rate=2e-3, pictures=1, workers=1)

    def losses(folder, *stops: int) -> list[float]:
        for stop in stops:
            torch.manual_seed(0)
            network = build_network(MINI)
            network.begin_halves()
            train_few(network, sets, None, table, folder, replace(options, max_steps=stop))
        rows = [json.loads(line) for line in (folder / "late_few.jsonl").read_text().splitlines()]
        return [row["loss"] for row in rows if row["kind"] == "train" and "loss" in row]

    assert losses(tmp_path / "whole", 2)[1] == pytest.approx(
        losses(tmp_path / "cut", 1, 2)[1], rel=1e-3
    )  # Adam makes rounding large; other photos: tenths
