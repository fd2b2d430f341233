"""The late half: the encoder's own tokens until something is learned, and what is cut keeps what it can."""

import pytest
import torch

from langflash_core.lab.training.late import WholeLateHalf, cut, soften, whole
from langflash_core.network import MINI
from langflash_core.network.encoders.late import LateHalf
from langflash_core.network.encoders.plain import PlainViT


@pytest.fixture(scope="module")
def vit():
    torch.manual_seed(0)
    made = PlainViT(MINI)
    with torch.no_grad():
        for parameter in made.parameters():  # fresh blocks add next to nothing, so nothing would show
            parameter.normal_(0, 0.05)
    return made.eval()


@pytest.fixture(scope="module")
def states(vit):
    with torch.inference_mode():
        return vit.states(torch.randn(2, 3, 28, 42, generator=torch.manual_seed(1)), MINI.hooks)


def moved(vit: PlainViT, rank: int) -> WholeLateHalf:
    """Whole blocks whose matrices differ from the encoder's by one of `rank`, everything else at random."""
    late = LateHalf(MINI)
    late.begin(vit)
    made = whole(late, vit)
    generator = torch.manual_seed(2)
    with torch.no_grad():
        for parameter in made.parameters():
            if parameter.ndim == 1:
                parameter.add_(0.01 * torch.randn(parameter.shape, generator=generator))
            else:
                thin = [torch.randn(n, rank, generator=generator) for n in parameter.shape]
                parameter.add_(0.01 * thin[0] @ thin[1].T)
    return made.eval()


def test_it_begins_as_the_encoder(vit, states):
    """To the bit: W + U D with U = D = 0 is W."""
    late = LateHalf(MINI)
    late.begin(vit)
    with torch.inference_mode():
        found = late(states[1], vit)
        expected = [vit.norm(x)[:, 1:] for x in states[2:]]
    assert len(found) == len(expected) == 2
    assert all(torch.equal(*pair) for pair in zip(found, expected, strict=True))


def test_a_change_of_its_rank_is_cut_without_loss(vit, states):
    learned = moved(vit, MINI.late_rank)
    kept = cut(learned, vit, MINI)
    with torch.inference_mode():
        for mine, theirs in zip(kept(states[1], vit), learned(states[1], vit), strict=True):
            # Six blocks of sums over 1,536 products in float32: 6 * sqrt(1536) * 6e-8, and room for tenfold.
            torch.testing.assert_close(mine, theirs, atol=2e-4, rtol=2e-4)


def test_a_cut_is_the_nearest_of_its_rank_and_whole_blocks_come_back(vit):
    learned = moved(vit, 2 * MINI.late_rank)
    kept = cut(learned, vit, MINI)
    again = whole(kept, vit)
    for own, back, (block, base) in zip(learned.each(), again.each(), kept.pairs(vit), strict=True):
        layers = [[layer.weight.detach() for _, layer in block.pairs(of)] for of in (own, back, base)]
        for new, cut_new, old in zip(*layers, strict=True):
            full, cut_off = new - old, cut_new - old
            values = torch.linalg.svdvals(full.double())
            lost = (full - cut_off).double().square().sum().sqrt()
            least = values[MINI.late_rank :].square().sum().sqrt()  # Eckart and Young
            assert float(lost) == pytest.approx(float(least), rel=1e-3)
            assert float(lost) > 0.1 * float(values.square().sum().sqrt()), "nothing was cut"


def test_softening_goes_back_a_part_of_the_way(vit):
    learned, late = moved(vit, 4), LateHalf(MINI)
    late.begin(vit)
    start = whole(late, vit).state_dict()
    before = {name: value.clone() for name, value in learned.state_dict().items()}
    soften(learned, vit, 0.75)
    for name, value in learned.state_dict().items():
        torch.testing.assert_close(value, start[name] + 0.75 * (before[name] - start[name]))


def test_branches_are_skipped_only_while_it_learns(vit, states):
    late = LateHalf(MINI)
    late.begin(vit)
    learned = whole(late, vit)
    early = states[1]
    with torch.inference_mode():
        expected, same = late(early, vit), learned.eval()(early, vit)
        torch.manual_seed(0)
        other = learned.train()(early.repeat(32, 1, 1), vit)
    torch.testing.assert_close(same[-1], expected[-1], rtol=0, atol=1e-5)  # a scale times a matrix is rounded
    assert len({tuple(row[0, :4].tolist()) for row in other[-1]}) > 8, "pictures lose different branches"


def test_a_network_gives_both_halves(vit):
    from langflash_core.network.build import build_network

    network = build_network(MINI).eval()
    network.encoder.vit.load_state_dict(vit.state_dict())
    network.late.begin(network.encoder.vit)
    images, Ks = torch.rand(1, 2, 3, 28, 42), torch.eye(3).expand(1, 2, 3, 3)
    with torch.inference_mode():
        tokens = network.encode(images, Ks)
    assert [tuple(hook.shape) for hook in tokens.named] == [(1, 2, 6, 384)] * 2
    assert all(torch.equal(a, b) for a, b in zip(tokens.named, tokens.hooks[2:], strict=True))
    assert [hook.shape[1] for hook in tokens.views([1]).named] == [1, 1]
