"""The other networks: their layers against plain loops, what they say of parts, that they can be silent."""

from dataclasses import replace

import cv2
import pytest
import torch
from torch import nn
from torch.nn import functional as F

from langflash_core.network import MINI
from langflash_core.network.checkpoints.files import complete_tensors, load_network
from langflash_core.network.encoders.deeplab import pad_frame
from langflash_core.network.encoders.mosaic import enlarge
from langflash_core.network.encoders.others import CHANNELS, SIDE, OtherEyes, resize_pictures
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.model import Seen
from langflash_core.network.semantics.naming import describe, places
from langflash_core.network.semantics.second import SecondHead, both, looked_at
from langflash_core.network.semantics.settings import OPINION


@pytest.fixture(scope="module")
def others() -> OtherEyes:
    torch.manual_seed(0)
    return OtherEyes().eval()


def at(x: torch.Tensor, layer: nn.Conv2d, row: int, column: int) -> float:
    """One number of a depthwise layer as TensorFlow's SAME has it, from what lies around it."""
    stride, dilation = layer.stride[0], layer.dilation[0]
    assert layer.bias is not None
    total = float(layer.bias[0])
    side = layer.kernel_size[0]
    for i in range(side):
        for j in range(side):
            places = []
            for place, step, length in ((row, i, x.shape[-2]), (column, j, x.shape[-1])):
                given = -(-length // stride)
                over = max(0, (given - 1) * stride + (side - 1) * dilation + 1 - length)
                places.append(place * stride + step * dilation - over // 2)
            y, z = places
            if 0 <= y < x.shape[-2] and 0 <= z < x.shape[-1]:
                total += float(layer.weight[0, 0, i, j]) * float(x[0, 0, y, z])
    return total


@torch.inference_mode()
@pytest.mark.parametrize("side, stride, dilation", [(3, 1, 1), (3, 2, 1), (3, 1, 2), (5, 2, 1), (5, 1, 2)])
@pytest.mark.parametrize("size", [(7, 8), (1, 5), (6, 6)])
def test_a_layer_frames_what_it_reads_as_tensorflow_does(side, stride, dilation, size):
    torch.manual_seed(1)
    layer = nn.Conv2d(1, 1, side, stride, dilation=dilation).double()
    x = torch.randn(1, 1, *size, dtype=torch.float64)
    found = layer(pad_frame(x, layer))
    assert found.shape[-2:] == tuple(-(-length // stride) for length in size)
    for row in range(found.shape[-2]):
        for column in range(found.shape[-1]):
            assert float(found[0, 0, row, column]) == pytest.approx(at(x, layer, row, column), abs=1e-12)


@torch.inference_mode()
@pytest.mark.parametrize("size", [(196, 252), (252, 196), (40, 1000), (3, 2)])
def test_they_see_pictures_of_any_shape_at_one_size(others, size):
    torch.manual_seed(2)
    picture = torch.rand(1, 3, *size)
    assert max(resize_pictures(picture).shape[-2:]) == SIDE
    maps = others(picture)
    height, width = (-(-length // 4) for length in resize_pictures(picture).shape[-2:])
    assert maps.shape == (1, CHANNELS, height, width) and bool(torch.isfinite(maps).all())
    assert float(maps.min()) >= 0


@torch.inference_mode()
def test_single_precision_is_enough(others):
    """Some 60 layers of sums over up to 960 numbers, each off by 1e-7 of its size at random: 1e-5."""
    picture = torch.rand(1, 3, 56, 70, generator=torch.manual_seed(3))
    fast = others(picture)
    slow = OtherEyes().eval().double()
    slow.load_state_dict(others.state_dict())
    exact = slow(picture.double())
    for own, true in zip(
        fast.split((256, CHANNELS - 256), 1), exact.split((256, CHANNELS - 256), 1), strict=True
    ):
        assert float((own - true).abs().max()) < 1e-5 * float(true.abs().max())


@torch.inference_mode()
@pytest.mark.parametrize("times, size", [(2, (5, 6)), (8, (20, 17))])
def test_maps_are_enlarged_as_tensorflow_did_at_first(times, size):
    """Row r is read at r / times; behind the last one it goes on. Means of two halves round twice: 1e-12."""
    x = torch.randn(1, 2, 3, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(8))
    found = enlarge(x, times, size)
    assert found.shape[-2:] == size
    for row in range(size[0]):
        for column in range(size[1]):
            (y, v), (z, w) = (divmod(place / times, 1) for place in (row, column))
            y, z, down, right = int(y), int(z), min(int(y) + 1, 2), min(int(z) + 1, 2)
            upper = (1 - w) * x[..., y, z] + w * x[..., y, right]
            lower = (1 - w) * x[..., down, z] + w * x[..., down, right]
            assert torch.allclose(found[..., row, column], (1 - v) * upper + v * lower, atol=1e-12, rtol=0)


@torch.inference_mode()
def test_a_part_is_the_mean_of_its_pixels(others):
    torch.manual_seed(4)
    images, weights = torch.rand(2, 3, 56, 70), torch.rand(2, 4, 8, 10).softmax(1)
    weights[:, 3] = 0
    head = SecondHead(MINI)
    head.begin()
    nn.init.normal_(head.photo.weight, std=1e-3)
    found = looked_at(others, head, images.split(1), weights)
    maps = torch.cat([F.interpolate(others(one[None]), (8, 10), mode="bilinear") for one in images]).double()
    words = head.words.weight.double(), head.words.bias.double()
    said = torch.einsum("oc,vchw->vohw", words[0], maps) + words[1][:, None, None]
    said = said / said.norm(dim=1, keepdim=True)
    odds = OPINION.steepness * torch.einsum("c,vchw->vhw", head.photo.weight[0].double(), maps).mean()
    said = said / (1 + torch.exp(-OPINION.together * odds) / OPINION.photos)
    for part in range(3):
        own = weights[:, part].double()
        slow = (said * own[:, None]).sum((0, 2, 3)) / own.sum()
        # Sums of 160 numbers in single precision, and the millionth that keeps empty parts from 0 / 0.
        assert float((found[part] - slow).abs().max()) < 1e-5 * float(slow.abs().max())
    assert not found[3].any(), "a part that no pixel shows says nothing"


@torch.inference_mode()
def test_they_are_heard_as_far_as_a_scene_looks_like_photos(others):
    torch.manual_seed(7)
    images, weights = torch.rand(2, 3, 56, 70), torch.rand(2, 4, 8, 10).softmax(1)
    head = SecondHead(MINI)
    head.begin()
    unsure = looked_at(others, head, images.split(1), weights)
    for odds, heard in ((20.0, 1.0), (-20.0, 0.0)):
        nn.init.constant_(head.photo.bias, odds / OPINION.steepness)
        said = looked_at(others, head, images.split(1), weights)
        # Twice 20 nats are e^-40 from certainty; who knows nothing expects three photos of four.
        assert torch.allclose(said, heard * unsure * (1 + 1 / OPINION.photos), atol=1e-7)


def test_odds_are_added():
    """Log odds between two words, of an atom that both made, are the sum of both's, times its length."""
    torch.manual_seed(5)
    first, second = F.normalize(torch.randn(3, 384), dim=1), 0.3 * torch.randn(3, 384)
    texts = F.normalize(torch.randn(2, 384), dim=1)
    atoms = both(first, second)
    odds = (atoms @ (texts[0] - texts[1])) * (first + OPINION.counts * second).norm(dim=1)
    assert torch.allclose(odds, (first + OPINION.counts * second) @ (texts[0] - texts[1]), atol=1e-6)
    assert torch.allclose(atoms.norm(dim=1), torch.ones(3), atol=1e-6)
    assert torch.allclose(both(first, torch.zeros_like(first)), first, atol=1e-7)


@pytest.fixture
def network():
    return load_network("mini")


def saw(network) -> tuple[torch.Tensor, torch.Tensor, Seen]:
    torch.manual_seed(6)
    hooks = tuple(torch.randn(1, 1, 16, MINI.encoder_dim) for _ in range(4))
    tokens = Tokens(hooks, (4, 4), named=hooks[-2:])
    atoms, weights = F.normalize(torch.randn(3, 384), dim=1), torch.rand(1, 3, 16, 16).softmax(1)
    K = torch.tensor([[60.0, 0, 28], [0, 60, 28], [0, 0, 1]])[None]
    seen_of = Seen(torch.rand(1, 3, 56, 56), tokens, torch.rand(1, 56, 56) + 1, torch.eye(4)[None], K)
    return atoms, weights, seen_of


@torch.inference_mode()
def test_what_has_learned_is_asked_and_what_is_silent_is_not(network, monkeypatch):
    atoms, weights, seen_of = saw(network)
    network.others, network.second_head = OtherEyes().eval(), SecondHead(MINI)
    network.second_head.begin()
    said = network.named(atoms, weights, seen_of)
    where = places(weights, seen_of.depths, seen_of.viewmats, seen_of.Ks)
    alone = network.namer(atoms, describe(weights, seen_of.tokens), where)
    second = looked_at(network.others, network.second_head, seen_of.images.split(1), weights)
    assert torch.equal(said, both(alone, second)) and not torch.equal(said, alone)
    network.second_head = SecondHead(MINI)
    monkeypatch.setattr(OtherEyes, "forward", None)  # whoever asks it fails
    assert torch.equal(network.named(atoms, weights, seen_of), alone)


@torch.inference_mode()
def test_photos_are_seen_in_more_pixels_where_there_are_some(network):
    """A photo of three colours, at twice the network's size, without loss: blue before green before red."""
    *_, plain = saw(network)
    assert [picture.shape for picture in plain.pictures()] == [(1, 3, 56, 56)]
    pixels = torch.tensor([255, 128, 0], dtype=torch.uint8).expand(112, 112, 3).numpy()
    source = cv2.imencode(".png", pixels)[1].tobytes()
    (picture,) = replace(plain, sources=(source,)).pictures()
    assert picture.shape == (1, 3, 112, 112)
    assert torch.equal(picture[0, :, 5, 7], torch.tensor([0, 128, 255]) / 255)


def test_weights_from_before_them_say_nothing(network):
    own = network.state_dict()
    old = {name: value for name, value in own.items() if name.split(".")[0] not in ("others", "second_head")}
    another = {"deeplab.stem.weight": torch.ones(1), "second_head.words.weight": torch.ones(384, 256)}
    for before in (old, old | another):
        filled = complete_tensors(before)
        assert filled.keys() == own.keys()
        assert {name: value.shape for name, value in filled.items()} == {k: v.shape for k, v in own.items()}
        new = filled.keys() - old.keys()
        assert new and not any(bool(filled[name].any()) for name in new)
    assert complete_tensors(own) == own, "what is there stays"
    foreign = {"conv.weight": torch.ones(1)}
    assert complete_tensors(foreign) == foreign
