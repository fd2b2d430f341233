"""Cutting late halves by what they answer: the best product there is, and what whole blocks read."""

import pytest
import torch

from langflash_core.lab.training.late import leading, make_cut, make_whole, moments, nearest_answers
from langflash_core.network import MINI
from langflash_core.network.build import build_network
from langflash_core.network.encoders.late import LateHalf


def answers_apart(change, product, read) -> float:
    """Mean squared error of the answers (., m) to what is read (., n)."""
    return float(((read @ (change - product).T) ** 2).sum(1).mean())


@pytest.mark.parametrize("shape", [(6, 20), (20, 6)])
def test_no_product_of_the_rank_answers_nearer(shape):
    """Against the optimum, the trailing singular values of the matrix times a root of the moments."""
    generator = torch.Generator().manual_seed(0)
    change = torch.randn(shape, dtype=torch.float64, generator=generator)
    mix = torch.randn(shape[1], shape[1], dtype=torch.float64, generator=generator)
    read = torch.randn(500, shape[1], dtype=torch.float64, generator=generator) @ (
        mix * torch.logspace(0, -2, shape[1])
    )
    sums = read.T @ read
    ours, plain = (up @ down for up, down in (nearest_answers(change, sums, 3), leading(change, 3)))
    root = torch.linalg.cholesky(sums / len(read))
    least = float((torch.linalg.svdvals(change @ root)[3:] ** 2).sum())
    found = answers_apart(change, ours, read)
    # The optimum up to the thousandth by which unread directions count.
    assert (
        least * (1 - 1e-9)
        <= found
        <= least + 2e-3 * float(sums.diagonal().mean() / len(read)) * float((change**2).sum())
    )
    assert found < answers_apart(change, plain, read)


def test_where_everything_is_read_alike_it_is_the_nearest_matrix():
    change = torch.randn(8, 5, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    ours, plain = (
        up @ down for up, down in (nearest_answers(change, 7 * torch.eye(5).double(), 2), leading(change, 2))
    )
    assert torch.allclose(ours, plain, atol=1e-7)  # singular values by a Gram matrix: half the digits


@pytest.fixture
def network():
    torch.manual_seed(0)
    made = build_network(MINI)
    made.begin_halves()
    with torch.no_grad():
        for name in ("up", "down"):
            made.late.get_parameter(f"blocks.1.fc1.{name}").normal_(std=0.02)
    return made.eval()


def test_moments_are_of_what_the_blocks_read(network):
    make_whole(network)
    pictures = [torch.rand(1, 1, 3, 56, 84, generator=torch.Generator().manual_seed(n)) for n in (0, 1)]
    found = moments(network.late, network, pictures)
    assert [len(sums) for sums in found] == [4] * len(network.late.each())
    expected = torch.zeros(())
    with torch.no_grad():
        for picture in pictures:
            _, early = network.encoder(picture)
            first, second = network.late.each()[:2]
            read = second.norm1(first(early)).flatten(0, 1).double()
            expected = expected + read.T @ read
    assert torch.allclose(found[1][0], expected, rtol=1e-3, atol=1e-3 * float(expected.diagonal().mean()))


def test_a_half_of_the_rank_is_cut_to_itself(network):
    """What has the rank already stays, whatever is read."""
    make_whole(network)
    before = {f"{n}": block.mlp.fc1.weight.clone() for n, block in enumerate(network.late.each())}
    make_cut(network, [torch.rand(1, 1, 3, 56, 84, generator=torch.Generator().manual_seed(3))])
    assert isinstance(network.late, LateHalf)
    for n, (block, base) in enumerate(network.late.pairs(network.encoder.vit)):
        after = block.fc1.matrix(base.mlp.fc1)
        assert torch.allclose(after, before[str(n)], atol=1e-5), n  # float32
