"""Some photos at a time against all at once, which is the twin of every part."""

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from langflash_core.base import many
from langflash_core.base.many import FEW, groups_of, in_groups, in_half_precision, together
from langflash_core.cameras import structure as cameras
from langflash_core.cameras.retrieval import likeness
from langflash_core.network import GuidedDepthNet, guided, load_network
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.layers.attention import Attention, QueryBlock
from langflash_core.network.layers.decoder import TwoStackDecoder
from langflash_core.network.presets import MINI
from langflash_core.network.semantics.aggregation import average_atoms
from langflash_core.network.semantics.grouping import SemanticGrouping, surviving, surviving_of
from langflash_core.network.semantics.splitting import condense_features
from langflash_core.rig.pairs import best
from langflash_core.rig.rig import DepthMaps

VIEWS, SIDE = 11, 56
ROUNDING = 2e-5  # float32 sums of some hundreds of numbers about 1, in another order
HALF = 1e-3  # of numbers up to 1 in half precision


@pytest.fixture(scope="module")
def network() -> GuidedDepthNet:
    found = load_network("mini")
    assert isinstance(found, GuidedDepthNet)
    return found


@pytest.fixture(scope="module")
def images() -> torch.Tensor:
    drawn = torch.rand(1, VIEWS, 3, 7, 7, generator=torch.Generator().manual_seed(3))
    return F.interpolate(drawn[0], (SIDE, SIDE), mode="bicubic").clamp(0, 1)[None]


@pytest.fixture(scope="module")
def tokens(network, images) -> Tokens:
    with torch.inference_mode():
        return network.encode(images, torch.eye(3).expand(1, VIEWS, 3, 3))


def at_once(monkeypatch) -> None:
    """Everything is few."""
    for module in (many, guided):
        monkeypatch.setattr(module, "FEW", 99)


def test_groups_cover_all_and_are_small():
    assert groups_of(0) == [] and groups_of(FEW) == [slice(0, FEW)]
    for count in (1, FEW + 1, 300):
        groups = groups_of(count)
        assert [v for some in groups for v in range(count)[some]] == list(range(count))
        lengths = {some.stop - some.start for some in groups}
        assert max(lengths) <= FEW and max(lengths) - min(lengths) <= 1


@pytest.mark.parametrize("dim", [0, 1])
@pytest.mark.parametrize("count", [1, FEW, FEW + 1, 3 * FEW])
def test_in_groups_is_the_whole(count: int, dim: int):
    shape = (count, 2, 3) if dim == 0 else (2, count, 3)
    values, seen = torch.rand(shape), []

    def work(some: torch.Tensor, same: torch.Tensor) -> torch.Tensor:
        seen.append(some.shape[dim])
        return some + same

    assert torch.equal(in_groups(work, values, values, dim=dim), 2 * values)
    assert max(seen) <= FEW and sum(seen) == count


def test_few_stay_as_they_are():
    part = torch.rand(FEW, 2)
    assert together([part], FEW) is part and in_half_precision(part, FEW) is part
    assert in_half_precision(part, FEW + 1).dtype == torch.float16


def test_attention_to_a_memory_in_parts_equals_that_to_all_of_it():
    torch.manual_seed(0)
    attention, query, memory = Attention(16, 4).eval(), torch.randn(1, 5, 16), 30 * torch.randn(1, 40, 16)
    parts = (attention.memory(part, part) for part in memory.split((1, 30, 9), 1))
    # Values of up to 30, whose shares hang on logits of up to 46.
    assert torch.allclose(
        attention.gathered_in_turn(query, parts), attention(query, memory, memory), atol=30 * ROUNDING
    )


def test_a_block_of_queries_reads_a_memory_in_parts():
    torch.manual_seed(0)
    block, queries, memory = QueryBlock(16, 4).eval(), torch.randn(1, 5, 16), torch.randn(1, 40, 16)
    own, code = torch.randn(5, 16), torch.randn(40, 16)
    parts = list(zip(memory.split(13, 1), code.split(13), strict=True))
    whole = block(queries, memory, own, code)
    assert torch.allclose(block.in_turn(queries, parts, own), whole, atol=ROUNDING)
    assert not torch.allclose(block.in_turn(queries, parts[:2], own), whole, atol=0.01)


def test_a_view_that_reads_all_others_by_name_reads_all_others(tokens):
    decoder, Ks = TwoStackDecoder(MINI).eval(), torch.eye(3).expand(1, VIEWS, 3, 3)
    everyone = [[other for other in range(VIEWS) if other != view] for view in range(VIEWS)]
    with torch.inference_mode():
        for named, whole in zip(decoder(tokens, Ks, everyone), decoder(tokens, Ks), strict=True):
            assert torch.allclose(named, whole, atol=ROUNDING)


def test_a_view_reads_those_that_it_is_told_to_and_no_others(tokens):
    decoder, Ks = TwoStackDecoder(MINI).eval(), torch.eye(3).expand(1, VIEWS, 3, 3)
    read = [[(view + 1) % VIEWS] for view in range(VIEWS)]
    changed = tokens.each(lambda hook: torch.cat((hook[:, :5], hook[:, 5:6] + 1, hook[:, 6:]), 1))
    with torch.inference_mode():
        before, after = (decoder(some, Ks, read)[0][0] for some in (tokens, changed))
    # After half of the layers, two, what changed has gone two views on at most.
    moved = (before - after).abs().amax((1, 2)) > ROUNDING
    assert moved.nonzero().flatten().tolist() == [3, 4, 5]


def test_photos_that_look_alike_are_found():
    rng = np.random.default_rng(0)
    places = [rng.normal(size=(40, 16)) for _ in range(3)]  # photos of three places in turn
    rows = [places[number % 3] + 0.1 * rng.normal(size=(40, 16)) for number in range(12)]
    unit = [own / np.linalg.norm(own, axis=1, keepdims=True) for own in rows]
    for view, others in enumerate(best(likeness([own.astype(np.float32) for own in unit]), 3)):
        assert sorted(others) == [other for other in range(view % 3, 12, 3) if other != view]
    assert best(likeness([own.astype(np.float32) for own in unit[:2]]), 3) == [[1], [0]]


def test_many_photos_are_encoded_and_described_as_few(network, images, tokens, monkeypatch):
    with torch.inference_mode():
        features = network.language(tokens, images)
        at_once(monkeypatch)
        whole = network.encode(images, torch.eye(3).expand(1, VIEWS, 3, 3))
        described = network.language(whole, images)
    some, every = ((*of.hooks, *of.named, *of.deep) for of in (tokens, whole))
    for own, all_of in zip(some, every, strict=True):
        assert torch.allclose(own, all_of, atol=1e-3)  # values up to some tens, through twelve blocks
    assert features.dtype == torch.float16 and torch.allclose(features.float(), described, atol=HALF)


def test_depth_of_many_photos_is_that_of_few(network, tokens, monkeypatch):
    Ks = torch.tensor([[50.0, 0, 28], [0, 50.0, 28], [0, 0, 1]]).expand(1, VIEWS, 3, 3)
    with torch.inference_mode():
        levels = network.levels(tokens, Ks)
        own = network._prior(levels, tokens)
        at_once(monkeypatch)
        whole = network._prior(levels, tokens)
    assert torch.allclose(own.log_depths, whole.log_depths, atol=1e-4)


def test_the_sweep_of_some_views_is_that_of_all(network, images, tokens):
    torch.manual_seed(0)
    Ks = torch.tensor([[50.0, 0, 28], [0, 50.0, 28], [0, 0, 1]]).expand(1, 4, 3, 3)
    poses = torch.eye(4).repeat(1, 4, 1, 1)
    poses[0, :, 0, 3] = torch.arange(4) * 0.1
    logs = 0.7 + 0.1 * torch.rand(1, 4, SIDE, SIDE)
    some, seen = tokens.views(range(4)), images[:, :4]
    near = [[1, 2], [3], [0], [1]]
    with torch.inference_mode():
        local = network.local(seen[0])
        prior = DepthMaps(logs, torch.full_like(logs, -2.0))
        whole = network.refiner(seen, some, local, prior, poses, Ks, near)[-1]
        first = DepthMaps(logs[:, :2], prior.log_errors[:, :2])
        part = network.refiner(seen, some, local, first, poses, Ks, near[:2], 2)[-1]
    assert part.log_depths.shape == (1, 2, SIDE, SIDE)
    assert torch.allclose(part.log_depths, whole.log_depths[:, :2], atol=1e-4)


def test_groups_of_many_photos_are_those_of_few():
    torch.manual_seed(1)
    grouping = SemanticGrouping(MINI).eval()
    sizes = ((2, 2), (4, 4), (8, 8))
    memories = tuple(torch.randn(VIEWS, MINI.dpt_feature, *size) for size in sizes)
    finest = torch.randn(VIEWS, MINI.dpt_feature, 16, 16)
    with torch.inference_mode():
        whole = grouping(memories, finest, VIEWS)[-1]
        some = groups_of(VIEWS)
        queries = grouping.of_many([tuple(maps[own] for maps in memories) for own in some])
        masks = [grouping.masks(queries, finest[own]) for own in some]
    logits = torch.cat([of.mask_logits for of in masks], 1)
    assert torch.allclose(logits, whole.mask_logits, atol=1e-4)
    strongest = [of.mask_logits[0].amax((0, 2, 3)) for of in masks]
    found = surviving_of(strongest, masks[0].existence_logits[0], 0.5)
    assert torch.equal(found, surviving(whole, 0.5))


def test_parts_of_many_photos_are_weights_and_about_those_of_few(network, images, tokens, monkeypatch):
    with torch.inference_mode():
        own = network.parts(tokens, images, (SIDE, SIDE))
        at_once(monkeypatch)
        whole = network.parts(tokens, images, (SIDE, SIDE))
    assert own.dtype == torch.float16 and len(own) == VIEWS
    assert torch.allclose(own.float().sum(1), torch.ones(VIEWS, SIDE, SIDE), atol=5e-3)
    assert own.shape == whole.shape
    count = own.shape[1]
    pairs = torch.bincount((own.argmax(1) * count + whole.argmax(1)).flatten(), minlength=count**2)
    both = pairs.view(count, count).float()  # two parts about as large may change numbers
    for side in (0, 1):
        assert both.amax(side).sum() / both.sum() > 0.99  # half precision moves borders


def test_means_over_many_photos_are_those_over_all_at_once():
    torch.manual_seed(0)
    weights, features = torch.rand(1, VIEWS, 4, 5, 6), torch.randn(1, VIEWS, 40, 5, 6)
    plain = torch.einsum("bvkhw,bvchw->bkc", weights, features) / weights.sum((1, 3, 4))[..., None]
    assert torch.allclose(average_atoms(weights, features), plain, atol=ROUNDING)


def test_few_directions_of_many_photos_keep_cosines():
    torch.manual_seed(0)
    features = (torch.randn(VIEWS * 30, 20) @ torch.randn(20, 64)).view(VIEWS, 5, 6, 64).movedim(-1, 1)
    small = condense_features(features.half())
    assert small.shape == (VIEWS, 32, 5, 6) and small.dtype == torch.float32
    full, few = (F.normalize(maps.movedim(1, -1).flatten(0, 2), dim=1) for maps in (features, small))
    assert torch.allclose(full @ full.T, few @ few.T, atol=5 * HALF)


def test_what_poses_are_found_by_holds_the_depth_of_all_photos_once():
    logs = torch.zeros(1, VIEWS, 8, 8)
    Ks = torch.eye(3).expand(VIEWS, 3, 3)
    inputs = cameras._pose_inputs(Ks, (8, 8), DepthMaps(logs, logs), torch.zeros(VIEWS, 4, 2, 2))
    starts = {view.depth.__array_interface__["data"][0] for view in inputs}
    assert max(starts) - min(starts) == (VIEWS - 1) * 8 * 8 * 4  # one block, view after view
