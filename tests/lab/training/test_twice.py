"""What the weights say of photos seen mirrored and larger: the looks, the odds, and that it teaches."""

import json
import math

import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.training.bank import NameBank
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.fewlabels import TEMPERATURE
from langflash_core.lab.training.further import TWICE_SHARES, Sets, train_twice
from langflash_core.lab.training.loop import LoopOptions, Optimising
from langflash_core.lab.training.pool import larger
from langflash_core.lab.training.shards import Label, write_shard
from langflash_core.lab.training.twice import Copy, Weights, mirrored, odds_apart, said_loss
from langflash_core.lab.training.words import build_table
from langflash_core.network import MINI
from langflash_core.network.build import build_network
from langflash_core.network.encoders.late import LateHalf

from .conftest import NAMES, encode, red_walls, toy_record


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    root = tmp_path_factory.mktemp("sets")
    main = red_walls(root / "main", 4, labelled=1)
    more = [red_walls(root / "outlines", 3, labelled=0.3), red_walls(root / "plain", 2, labelled=0)]
    return Sets.of(main, main.ids, more, encode)


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    made = build_network(MINI)
    made.begin_halves()
    return made.eval()


def test_all_sets_teach_together_with_their_larger_pictures(sets):
    pool = sets.together()
    assert [one.folder.root.name for one in pool.sets] == ["main", "outlines", "plain"]
    assert pool.sets[0].share == TWICE_SHARES[0]
    assert sum(one.share for one in pool.sets[1:]) == pytest.approx(TWICE_SHARES[2])
    drawn = pool.draw(4, torch.Generator().manual_seed(2)).to("cpu")
    height, width = drawn.images.shape[-2:]
    assert drawn.large.shape[-2:] == larger((width, height))[::-1]
    small = F.interpolate(drawn.large[:, 0], size=(height, width), mode="area")
    assert float((small - drawn.images[:, 0]).abs().mean()) < 0.02, "the same windows; edges differ"
    across = drawn.large.shape[-1] / width
    assert torch.allclose(drawn.large_Ks[:, 0, 0, 2], across * drawn.Ks[:, 0, 0, 2], rtol=1e-4)
    assert sets.told.draw(2, torch.Generator().manual_seed(0)).large is None


def test_larger_pictures_are_whole_patches():
    assert larger((252, 196)) == (308, 238) and larger((196, 252)) == (238, 308)


def test_a_copy_says_the_mean_of_what_it_sees_mirrored_and_larger(sets, network):
    """Against the network itself, look by look."""
    photos = sets.together().draw(2, torch.Generator().manual_seed(1)).to("cpu")
    said, logs = Copy(network).says(photos)
    with torch.no_grad():
        images, Ks = photos.images.flip(-1), photos.Ks.clone()
        Ks[..., 0, 2] = images.shape[-1] - Ks[..., 0, 2]
        tokens = network.encode(images, Ks)
        one = network.language(tokens, images)[:, 0].flip(-1)
        deep = network.monocular_depth(tokens, Ks).log_depths[:, 0].flip(-1)
        tokens = network.encode(photos.large, photos.large_Ks)
        two = network.language(tokens, photos.large)[:, 0]
        two = F.interpolate(two, size=one.shape[-2:], mode="bilinear", align_corners=False)
        deeper = network.monocular_depth(tokens, photos.large_Ks).log_depths
        deeper = F.interpolate(deeper, size=deep.shape[-2:], mode="bilinear", align_corners=False)[:, 0]
    expected = F.normalize(one + two, dim=1).movedim(1, -1)
    assert torch.allclose(said, expected, atol=1e-5)  # float32, sums of some thousand products
    assert torch.allclose(logs, (deep + deeper) / 2, atol=1e-5)


def test_a_copy_stays_what_it_was(network):
    copy, bias = Copy(network), network.language_head.get_parameter("out.bias")
    with torch.no_grad():
        bias += 1
    assert torch.allclose(copy.head.get_parameter("out.bias") + 1, bias)
    assert not any(value.requires_grad for half in (copy.late, copy.deep) for value in half.parameters())


def test_photos_without_larger_pictures_are_refused(sets, network):
    with pytest.raises(ValueError, match="larger pictures"):
        Copy(network).says(sets.told.draw(1, torch.Generator().manual_seed(0)))


def test_mirrored_twice_is_as_before():
    images = torch.rand(2, 1, 3, 28, 42, generator=torch.Generator().manual_seed(0))
    Ks = torch.tensor([[40.0, 0, 20], [0, 40, 14], [0, 0, 1]]).expand(2, 1, 3, 3)
    again, lenses = mirrored(*mirrored(images, Ks))
    assert torch.equal(again, images) and torch.equal(lenses, Ks)


def test_odds_apart_are_those_of_a_plain_loop():
    generator = torch.Generator().manual_seed(0)
    units, said, texts = (F.normalize(torch.randn(n, 384, generator=generator), dim=1) for n in (5, 5, 7))
    found = odds_apart(units, texts, TEMPERATURE * said @ texts.T)
    for ours, theirs, value in zip(units.double(), said.double(), found.tolist(), strict=True):
        p = [math.exp(TEMPERATURE * float(theirs @ text)) for text in texts.double()]
        q = [math.exp(TEMPERATURE * float(ours @ text)) for text in texts.double()]
        terms = (a / sum(p) * math.log((a / sum(p)) / (b / sum(q))) for a, b in zip(p, q, strict=True))
        assert value == pytest.approx(sum(terms), rel=1e-4)


def test_who_says_the_same_loses_nothing():
    texts = F.normalize(torch.randn(37, 384, generator=torch.Generator().manual_seed(0)), dim=1)
    bank = NameBank((), texts, texts, torch.ones(37), (), (), torch.ones(1, 37, 37, dtype=torch.bool))
    units = F.normalize(torch.randn(6, 384, generator=torch.Generator().manual_seed(1)), dim=1)
    same, _ = said_loss(units, units, bank, Weights())
    other, told = said_loss(units, units.roll(1, 0), bank, Weights())
    assert float(same) == pytest.approx(0, abs=1e-5) and float(other) > 1
    assert set(told) == {"apart", "said_classes", "said_names"}


def test_a_few_steps_teach_and_end_in_a_cut_half(sets, tmp_path, network):
    """What the copy says is nearer after some steps with other light and hidden channels."""
    write_shard(tmp_path / "rooms" / "a.safetensors", [toy_record(seed) for seed in (0, 1)])
    table = build_table([Label(*names) for names in NAMES], encode)
    options = LoopOptions(
        minutes=10,
        max_steps=3,
        report_s=0.0,
        pictures=2,
        learning_rate=1e-3,
        optimising=Optimising(warm_up=1),
    )
    rooms = RoomSet(tmp_path / "rooms", tokens=False)
    state = train_twice(network, sets, rooms, table, tmp_path / "run", options)
    assert state.step == 3 and isinstance(network.late, LateHalf)
    rows = [json.loads(line) for line in (tmp_path / "run" / "late_twice.jsonl").read_text().splitlines()]
    taught = [row for row in rows if row["kind"] == "train"]
    assert all(math.isfinite(row["loss"]) for row in taught)
    assert {"apart", "said_classes", "said_names", "classes", "names", "depth", "phrases"} <= {
        key for row in taught for key in row
    }
    assert (tmp_path / "run" / "late.pt").exists()
    for half in (network.late, network.deep):
        assert float(half.get_parameter("blocks.0.qkv.up").detach().abs().max()) > 0
