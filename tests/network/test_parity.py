"""Imported networks give the published networks' numbers: against float64 twins, random weights."""

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from langflash_core.network import PointMapNet, build_network
from langflash_core.network.checkpoints.importing import convert
from langflash_core.network.points.heads import activate_gaussians
from langflash_core.network.presets import PointMaps
from tests.geometry.spread import covariances
from tests.network import published
from tests.network.sizes import TINY, large

# The bound. float32 keeps 1e-7 a step; some thirty layers and sums of a thousand terms
# leave a few 1e-6 of the largest value.
RELATIVE = 1e-4


def _relative_error(found: Tensor, expected: Tensor) -> float:
    """Largest difference over the largest value."""
    return float((found.double() - expected).abs().max() / expected.abs().max())


def _photos(num_views: int, height: int, width: int) -> tuple[Tensor, Tensor]:
    """Images (V, 3, H, W) in [0, 1], and normalised intrinsics (V, 3, 3), all different."""
    generator = torch.Generator().manual_seed(num_views)
    images = torch.rand(num_views, 3, height, width, generator=generator)
    Ks = torch.zeros(num_views, 3, 3)
    Ks[:, 0, 0], Ks[:, 1, 1] = torch.rand(2, num_views, generator=generator) * 0.4 + 0.7
    Ks[:, 0, 2], Ks[:, 1, 2], Ks[:, 2, 2] = 0.5, 0.48, 1
    return images, Ks


def _in_pixels(Ks: Tensor, height: int, width: int) -> Tensor:
    return Ks * torch.tensor([width, height, 1.0])[:, None]


def _loaded(state: published.State, sizes: PointMaps, tmp_path) -> PointMapNet:
    network = build_network(sizes).eval()
    tensors = convert(state, sizes, tmp_path / "drawn.ckpt").tensors
    found = network.load_state_dict(tensors, strict=False)
    assert not found.unexpected_keys
    return network


@pytest.mark.parametrize(
    ("num_views", "height", "width"),
    [
        (2, 256, 256),
        (3, 256, 256),
        (2, 96, 160),
        (2, 160, 96),
        (3, 80, 112),
        (3, 112, 80),
        pytest.param(2, 512, 512, marks=large),
        pytest.param(3, 512, 512, marks=large),
    ],
)
@torch.inference_mode()
def test_gaussians_equal_the_published_ones(num_views, height, width, tmp_path):
    state = published.draw_noposplat(TINY, seed=height)
    network = _loaded(state, TINY, tmp_path)
    images, Ks = _photos(num_views, height, width)
    expected = published.noposplat(published.doubled(state), images.double() * 2 - 1, Ks.double(), TINY)
    tokens = network.encode(images[None], _in_pixels(Ks, height, width)[None])
    points = network.point_maps(tokens, images[None])[0]
    gaussians = activate_gaussians(network.raw_gaussians(tokens, images[None])[0], points)
    shape = (num_views, height, width)
    found = {
        "means": gaussians.means.unflatten(0, shape),
        "covariances": covariances(gaussians.quats, gaussians.scales).unflatten(0, shape),
        "harmonics": gaussians.sh.transpose(1, 2).unflatten(0, shape),
        "opacities": gaussians.opacities.unflatten(0, shape),
    }
    for name, values in found.items():
        assert values.shape == expected[name].shape
        assert expected[name].std() > 0  # there is something to compare
        assert _relative_error(values, expected[name]) < RELATIVE, name


@pytest.mark.parametrize(("height", "width"), [(96, 96), (128, 96), (64, 128), (192, 192)])
@torch.inference_mode()
def test_language_features_equal_the_published_ones(height, width, tmp_path):
    state = published.draw_lseg(TINY, channels=512)
    network = _loaded(state, TINY, tmp_path)
    images, _ = _photos(2, height, width)
    plain = {name.removeprefix("net."): value for name, value in state.items()}
    expected = published.lseg(published.doubled(plain), images.double() * 2 - 1, TINY)
    found = network.language_head.train().features(images)  # `train` must not wake the batch norms
    assert found.shape == (2, 512, height // 2, width // 2)
    assert _relative_error(found, expected) < RELATIVE
    unit = network.language_head(images[None])[0]
    torch.testing.assert_close(unit.norm(dim=1), torch.ones(2, height // 2, width // 2))


@pytest.mark.parametrize("num_views", [2, 3])
@torch.inference_mode()
def test_released_masks_equal_the_published_ones_whatever_the_geometry(num_views, tmp_path):
    """They come from the encoder and decoder in the same checkpoint."""
    sizes = replace(TINY, mask_filter=None)
    state = published.draw_langflash(sizes)
    network = _loaded(state, replace(sizes, own_grouping=True), tmp_path)
    geometry = convert(published.draw_noposplat(sizes, seed=7), sizes, tmp_path / "geometry.ckpt").tensors
    assert not network.load_state_dict(geometry, strict=False).unexpected_keys
    images, Ks = _photos(num_views, 64, 80)
    masks, scores = published.grouping(published.doubled(state), images.double() * 2 - 1, Ks.double(), sizes)
    tokens = network.encode(images[None], _in_pixels(Ks, 64, 80)[None])
    groups = network.group(tokens, images[None])[-1]
    assert _relative_error(groups.mask_logits[0].transpose(0, 1), masks) < RELATIVE
    assert _relative_error(groups.existence_logits[0], scores) < RELATIVE
