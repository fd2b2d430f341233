"""The late halves: the encoder's own tokens until something is learned, what is cut keeps what it can, and
names and depth each read their own."""

from copy import deepcopy
from dataclasses import replace

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from langflash_core.lab.training.late import WholeLateHalf, cut, soften, whole
from langflash_core.network import MINI, GuidedDepthNet, initial_network, load_network, save_network
from langflash_core.network.build import build_network
from langflash_core.network.checkpoints.files import read_weights, start_from
from langflash_core.network.encoders.late import LateHalf
from langflash_core.network.encoders.plain import PlainViT, patch_tokens


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
        expected = [patch_tokens(vit.norm(x)) for x in states[2:]]
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


def test_a_half_of_one_hook_gives_the_last_alone(vit, states):
    """To the bit; and stays one of one hook, whole or cut."""
    late, deep = cut(moved(vit, 4), vit, MINI), LateHalf(MINI, given=1)
    deep.load_state_dict(late.state_dict())
    learned = whole(deep, vit).eval()
    with torch.inference_mode():
        (last,) = deep(states[1], vit)
        assert torch.equal(last, late(states[1], vit)[1])
        for half in (learned, cut(learned, vit, MINI)):
            assert len(half(states[1], vit)) == 1


@pytest.fixture(scope="module")
def network(vit):
    torch.manual_seed(3)
    made = build_network(MINI).eval()
    made.encoder.vit.load_state_dict(vit.state_dict())
    made.begin_halves()
    torch.nn.init.normal_(made.decoder.embed_named.weight)
    return made


IMAGES, KS = torch.rand(1, 2, 3, 28, 42, generator=torch.manual_seed(4)), torch.eye(3).expand(1, 2, 3, 3)


def told(network) -> tuple[torch.Tensor, torch.Tensor]:
    """Names and depth of two photos."""
    with torch.inference_mode():
        tokens = network.encode(IMAGES, KS)
        return network.language(tokens, IMAGES), network.monocular_depth(tokens, KS).log_depths


def test_a_network_gives_all_halves(network):
    with torch.inference_mode():
        tokens = network.encode(IMAGES, KS)
    assert [tuple(hook.shape) for hook in (*tokens.named, *tokens.deep)] == [(1, 2, 6, MINI.encoder_dim)] * 3
    for own, hook in zip((*tokens.named, *tokens.deep), (*tokens.hooks[2:], tokens.hooks[3]), strict=True):
        assert torch.equal(own, hook)
    assert [hook.shape[1] for hook in (*tokens.views([1]).named, *tokens.views([1]).deep)] == [1, 1, 1]


@pytest.mark.parametrize(("half", "same"), [("deep", 0), ("late", 1)])
def test_what_one_half_learns_is_nothing_to_the_other(network, half, same):
    """To the bit: names do not change with the half of depth, nor depth with that of names."""
    made = deepcopy(network)
    before = told(made)
    with torch.no_grad():
        for value in getattr(made, half).parameters():
            value.add_(0.01 * torch.randn_like(value))
    after = told(made)
    assert torch.equal(before[same], after[same]) and not torch.allclose(before[1 - same], after[1 - same])


def test_files_from_before_depth_had_a_half_tell_the_same_depth(network, tmp_path):
    """To the bit what the decoder read then: the last hook of the half that names have."""
    made = deepcopy(network)
    made.late.load_state_dict(cut(moved(made.encoder.vit, 4), made.encoder.vit, MINI).state_dict())
    save_network(made, tmp_path / "w.safetensors")
    with safe_open(tmp_path / "w.safetensors", "pt") as file:
        old = {name: file.get_tensor(name) for name in file.keys() if not name.startswith("deep.")}  # noqa: SIM118
        save_file(old, tmp_path / "old.safetensors", file.metadata())
    found = load_network("mini", tmp_path / "old.safetensors")
    assert isinstance(found, GuidedDepthNet)
    started = initial_network(MINI, tmp_path / "old.safetensors")
    assert start_from(started, read_weights(tmp_path / "old.safetensors")[0], ("late", "deep"))
    assert all(torch.equal(v, started.late.state_dict()[k]) for k, v in started.deep.state_dict().items())
    with torch.inference_mode():
        tokens = found.encode(IMAGES, KS)
        before = found.monocular_depth(replace(tokens, deep=tokens.named[1:]), KS)
        assert torch.equal(found.monocular_depth(tokens, KS).log_depths, before.log_depths)
    assert found.deep.norm.weight.data_ptr() != found.late.norm.weight.data_ptr(), "each learns alone"


def test_a_side_that_is_no_multiple_of_the_patch_is_refused():
    network = build_network(MINI)
    with pytest.raises(ValueError, match="multiples of 14, received \\(28, 43\\)"):
        network.encoder(torch.zeros(1, 1, 3, 28, 43))
