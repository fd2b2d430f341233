"""Learning what other networks' maps mean: pixels that are drawn, that it learns, that a run keeps it."""

import pytest
import torch

from langflash_core.lab.photos.names import CLASSES37
from langflash_core.lab.training.further import Sets, train_second
from langflash_core.lab.training.loop import LoopOptions, Optimising
from langflash_core.lab.training.second import (
    DRAWN,
    PARTLY_PIXELS,
    PIXELS,
    ROOM_PIXELS,
    KeptPixels,
    PixelBatch,
    PixelSet,
    Scored,
    room_pixels,
    second_stage,
)
from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.states import load_averaged
from langflash_core.lab.training.words import build_table
from langflash_core.network import MINI
from langflash_core.network.build import build_network

from .conftest import encode, red_walls

WALL, CHAIR = CLASSES37.index("wall"), CLASSES37.index("chair")


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    root = tmp_path_factory.mktemp("sets")
    main = red_walls(root / "main", 6, labelled=1)
    more = [red_walls(root / "outlines", 3, labelled=0.3), red_walls(root / "plain", 2, labelled=0)]
    return Sets.of(main, main.ids, more, encode).named()


@pytest.fixture(scope="module")
def network():
    """One whose layers keep the size of what they read (He et al. 2015), so that maps tell colours apart."""
    torch.manual_seed(0)
    made = build_network(MINI).eval()
    for layer in made.others.modules():
        if isinstance(layer, torch.nn.Conv2d):
            torch.nn.init.kaiming_normal_(layer.weight)
    return made


@pytest.fixture(scope="module")
def pixels(learned, network):
    return PixelSet.of(network.others, learned, torch.Generator().manual_seed(0))


def test_photos_without_names_are_left_and_partly_named_ones_give_less(learned, pixels):
    assert [one.folder.root.name for one in learned.sets] == ["main", "outlines"]
    counts = torch.bincount(pixels.table.sets)
    assert counts.tolist() == [6 * PIXELS, len(learned.sets[1].ids) * PARTLY_PIXELS]
    assert set(pixels.table.classes.tolist()) == {WALL, CHAIR}


def test_what_is_seen_lies_under_what_it_is_called(pixels, network):
    """The layers are random, but some channel has another mean over red than over blue, by more than what
    it changes within both; labels of other pixels would leave nothing of it."""
    table = pixels.table
    red, blue = (table.maps[table.classes == row].float() for row in (WALL, CHAIR))
    apart = (red.mean(0) - blue.mean(0)).abs() / (red.std(0) + blue.std(0) + 1e-6)
    mixed = table.maps[torch.randperm(len(table.maps), generator=torch.Generator().manual_seed(0))].float()
    other, rest = mixed[: len(red)], mixed[len(red) :]
    chance = (other.mean(0) - rest.mean(0)).abs() / (other.std(0) + rest.std(0) + 1e-6)
    assert float(apart.max()) > 5 * float(chance.max())


def test_classes_come_as_they_are_and_names_alike():
    classes = torch.tensor([0] * 900 + [1] * 100 + [-1] * 50)
    names = torch.tensor([3] * 900 + [-1] * 100 + [7] * 50)
    table = PixelBatch(torch.arange(1050.0)[:, None], classes, names, torch.zeros(1050, dtype=torch.int64))
    drawn = PixelSet(table).draw(8, 1, torch.Generator().manual_seed(0))
    half = 8 * DRAWN // 2
    assert len(drawn.classes) == 2 * half and bool((drawn.classes[:half] >= 0).all())
    assert torch.equal(table.classes[drawn.maps[:, 0].long()], drawn.classes), "rows stay together"
    # 3000 draws: shares are off by 3 sigma, 3 sqrt(p (1 - p) / 3000), at most.
    assert float((drawn.classes[:half] == 1).float().mean()) == pytest.approx(0.1, abs=0.017)
    assert float((drawn.names[half:] == 7).float().mean()) == pytest.approx(0.5, abs=0.028)


def test_photos_and_rooms_are_told_apart_and_what_is_denied_is_unsaid(network, learned, pixels, rooms, words):
    """After 100 steps on both. Layers are random and tell colours and edges alone, so that some pixels are
    never told apart; a coin is right of a half, and what has learned nothing of no pixel."""
    seen = room_pixels(network.others, rooms, words.generator)
    assert seen.shape == (4 * 2 * ROOM_PIXELS, pixels.table.maps.shape[1])
    table = words.sampler.table
    nothing = table.embeddings[table.baseline_rows()]
    head, stage = network.second_head, second_stage(learned.bank.denying(nothing))
    with torch.random.fork_rng():
        torch.manual_seed(0)
        head.begin()
    both = PixelSet(pixels.table, seen)
    optimiser = torch.optim.Adam(head.parameters(), 0.01)
    for _ in range(100):
        batch = both.draw(1, 1, words.generator).to("cpu")
        assert batch.rooms is not None and len(batch.rooms) == DRAWN // 2
        loss = stage.loss(network, batch, words)
        optimiser.zero_grad()
        loss.total.backward()
        optimiser.step()
    with torch.no_grad():
        photo, room = head.photo_odds(pixels.table.maps.float()), head.photo_odds(seen.float())
        said = head(pixels.table.maps.float())
    assert float((photo > 0).float().mean()) > 0.75 < float((room < 0).float().mean())
    own = (said * learned.bank.classes[pixels.table.classes]).sum(1)
    denied = (said @ nothing.T).amax(1)
    # Relevancy at 10 (LERF): more than e^2 to 1 against the nearest of what is true of nothing.
    assert float((own - denied > 0.2).float().mean()) > 0.75


def test_what_scores_say_is_least_wrong_where_it_is_answered():
    """Two names; the first map says the second one, 9 to 1 against the first and 3 to 1 against what has no
    name. Cross-entropy by hand: odds of 1 and 9 in 13, and 16 times cosines of 1 and 0."""
    texts = torch.eye(4)[:2]
    weight = torch.tensor([[3.0, 1.0], [1.0, 1.0], [9.0, 1.0]]).log()  # rows: no name, first, second
    scored = Scored(weight, torch.zeros(3), texts)
    maps = torch.tensor([[1.0, 0.0, 5.0], [1.0, 0.0, -5.0]])  # behind DeepLab's are maps of others
    right, wrong = (scored.loss(maps, texts[row].expand(2, -1)) for row in (1, 0))
    other = 16 + torch.tensor(-16.0).exp().log1p()
    mine = torch.tensor(-16.0).exp().log1p()
    first, second = 1 / 13, 9 / 13
    torch.testing.assert_close(right, second * mine + first * other, rtol=1e-5, atol=0)
    torch.testing.assert_close(wrong, second * other + first * mine, rtol=1e-5, atol=0)


def test_it_learns_and_a_run_keeps_it(learned, network, pixels, rooms, tmp_path):
    table = build_table([Label("wall", "wall"), Label("chair", "chair")], encode)
    options = LoopOptions(
        minutes=5, max_steps=60, ema_decay=0.9, learning_rate=0.01, optimising=Optimising(warm_up=5)
    )
    judge = KeptPixels(pixels, learned.bank)
    torch.manual_seed(2)
    network.second_head.begin()
    before, eyes = judge(network), network.others.mosaic.stem.weight.clone()
    train_second(network, learned, None, rooms, table, tmp_path, options)
    after = judge(network)
    assert before["classes_accuracy"] < 0.5 and after["classes_accuracy"] > 0.75
    assert torch.equal(network.others.mosaic.stem.weight.cpu(), eyes), "the others themselves learn nothing"
    torch.manual_seed(1)
    other = build_network(MINI)
    assert load_averaged(other, tmp_path, "second") is not None
    for name in ("others", "second_head"):
        own, kept = (getattr(one, name).state_dict() for one in (network, other))
        assert all(torch.equal(own[key].cpu(), kept[key]) for key in own)
