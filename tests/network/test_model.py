"""The network as a whole: every view count, hard photos, determinism, cancelling, and its files."""

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from langflash_core.base.records import FoundFocal
from langflash_core.cameras.poses import Poses
from langflash_core.errors import Cancelled, WeightsError
from langflash_core.network import MINI, GuidedDepthNet, guided, initial_network, load_network, save_network
from langflash_core.network.checkpoints.files import dequantise, quantise, start_from
from langflash_core.types import Prediction, Views


def _views(images: torch.Tensor) -> Views:
    focal = 0.9 * images.shape[-1]
    K = torch.tensor([[focal, 0, images.shape[-1] / 2], [0, focal, images.shape[-2] / 2], [0, 0, 1]])
    names = tuple(f"photo {v}" for v in range(len(images)))
    return Views(images, K.expand(len(images), 3, 3), names)


def _pattern(num_views: int, height: int = 84, width: int = 112) -> torch.Tensor:
    rng = np.random.default_rng(0)
    wide = torch.nn.functional.interpolate(
        torch.from_numpy(rng.random((1, 3, height // 4, width // 2))).float(),
        size=(height, 2 * width),
        mode="bilinear",
    )[0]
    return torch.stack([wide[:, :, 6 * v : 6 * v + width] for v in range(num_views)])


def _assert_sound(prediction: Prediction, num_views: int, pixels: int) -> None:
    gaussians = prediction.gaussians
    for values in (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh):
        assert values.shape[0] == num_views * pixels
        assert torch.isfinite(values).all()
    assert (gaussians.scales > 0).all()
    assert ((gaussians.opacities >= 0) & (gaussians.opacities <= 1)).all()
    assert torch.allclose(gaussians.quats.norm(dim=-1), torch.ones(1), atol=1e-5)
    assert torch.isfinite(prediction.viewmats).all() and torch.isfinite(prediction.weights).all()
    assert torch.equal(prediction.viewmats[0], torch.eye(4))
    assert torch.allclose(prediction.dictionary.norm(dim=-1), torch.ones(1), atol=1e-5)
    assert tuple(prediction.timings) == GuidedDepthNet.stages


@pytest.mark.parametrize("num_views", [1, 2, 3, 8])
def test_any_number_of_views(untrained, num_views):
    prediction = untrained.predict(_views(_pattern(num_views)))
    _assert_sound(prediction, num_views, 84 * 112)


@pytest.mark.parametrize("name", ["identical", "black", "white", "unrelated"])
def test_hard_pairs_stay_finite_and_are_reported(untrained, name):
    pattern = _pattern(1)
    images = {
        "identical": pattern.expand(2, -1, -1, -1),
        "black": torch.zeros(2, 3, 84, 112),
        "white": torch.ones(2, 3, 84, 112),
        "unrelated": torch.cat((pattern, torch.rand(1, 3, 84, 112, generator=torch.manual_seed(1)))),
    }[name]
    prediction = untrained.predict(_views(images))
    _assert_sound(prediction, 2, 84 * 112)
    if name == "identical":
        assert not prediction.warnings
        assert torch.allclose(prediction.viewmats[1], torch.eye(4), atol=1e-3)
    if name == "unrelated":
        assert "photo 1" in prediction.warnings[0]


def test_the_same_photos_give_the_same_numbers(untrained):
    views = _views(_pattern(2))
    first, second = untrained.predict(views), untrained.predict(views)
    assert torch.equal(first.gaussians.means, second.gaussians.means)
    assert torch.equal(first.dictionary, second.dictionary)


def test_cancelling_stops_between_stages(untrained):
    seen: list[str] = []
    with pytest.raises(Cancelled):
        untrained.predict(
            _views(_pattern(1)), progress=lambda s, _: seen.append(s), cancelled=lambda: len(seen) == 2
        )
    assert tuple(seen) == GuidedDepthNet.stages[:2]


def test_weights_survive_a_round_trip(untrained, tmp_path):
    """Int8 rows lose at most half a step; what was stored once is stored again unchanged."""
    save_network(untrained, tmp_path / "w.safetensors", {"steps": 3})
    loaded = load_network("mini", tmp_path / "w.safetensors")
    save_network(loaded, tmp_path / "again.safetensors", {"steps": 3})
    again = load_network("mini", tmp_path / "again.safetensors")
    first, second = loaded.state_dict(), again.state_dict()
    for key, value in untrained.state_dict().items():
        stored = first[key]
        step = value.abs().flatten(1).amax(1) / 127 if value.ndim > 1 else value.abs() / 1024
        bound = (
            (0.51 * step).reshape(-1, *[1] * (value.ndim - 1)) + 1e-3 * value.abs() + 1e-7
        )  # float16 scale
        assert ((value - stored).abs() <= bound).all(), key
        assert torch.allclose(stored, second[key], rtol=1e-3, atol=1e-7), key


def test_quantised_rows_of_zeros_stay_zero():
    assert dequantise(quantise({"w": torch.zeros(80, 80)}))["w"].abs().max() == 0


def test_heads_of_another_shape_are_not_started_from(untrained):
    tensors = {f"depth_head.{k}": v + 1 for k, v in untrained.depth_head.state_dict().items()}
    tensors["refiner.sharpness"] = torch.zeros(3)
    network = GuidedDepthNet(MINI)
    before = network.refiner.sharpness.detach().clone()
    assert not start_from(network, tensors, ("refiner",))
    assert torch.equal(network.refiner.sharpness.detach(), before)
    assert start_from(network, tensors, ("depth_head",))
    moved = network.depth_head.state_dict()["head.0.bias"]
    assert torch.equal(moved, untrained.depth_head.state_dict()["head.0.bias"] + 1)


def test_initial_network_takes_the_frozen_parts_and_draws_the_rest(untrained, tmp_path):
    save_network(untrained, tmp_path / "w.safetensors")
    fresh = initial_network(MINI, tmp_path / "w.safetensors", seed=7)
    stored = load_network("mini", tmp_path / "w.safetensors")
    assert isinstance(stored, GuidedDepthNet)
    key = "encoder.vit.blocks.0.attn.qkv.weight"
    assert torch.allclose(fresh.state_dict()[key], stored.state_dict()[key], rtol=1e-3)
    assert torch.allclose(fresh.local.skip.weight, stored.local.skip.weight)
    assert not torch.equal(fresh.decoder.embed.weight, stored.decoder.embed.weight)
    assert isinstance(fresh, GuidedDepthNet)


def _damaged(path, kind, network):
    tensors = quantise(network.state_dict())
    header = {"langflash": '{"preset": "mini"}'}
    if kind == "missing file":
        return path.with_name("absent.safetensors")
    if kind == "text":
        path.write_text("these are no weights")
        return path
    if kind == "missing":
        tensors.pop("decoder.embed.bias")
    elif kind == "surplus":
        tensors["extra"] = torch.ones(3)
    elif kind == "shape":
        tensors["decoder.embed.bias"] = torch.ones(3)
    elif kind == "nan":
        tensors["decoder.embed.bias"] = torch.full_like(tensors["decoder.embed.bias"], float("nan"))
    elif kind == "preset":
        header = {"langflash": '{"preset": "other"}'}
    save_file(tensors, path, metadata=header)
    if kind == "truncated":
        path.write_bytes(path.read_bytes()[:-1000])
    return path


@pytest.mark.parametrize(
    "kind", ["missing file", "text", "truncated", "missing", "surplus", "shape", "nan", "preset"]
)
def test_damaged_weights_are_refused_in_one_sentence(untrained, tmp_path, kind):
    path = _damaged(tmp_path / "w.safetensors", kind, untrained)
    with pytest.raises(WeightsError) as caught:
        load_network("mini", path)
    assert "\n" not in str(caught.value)


def test_photos_that_bend_lines_are_handed_back(untrained, monkeypatch):
    """As a value, before anything rests on straight lines."""
    lens = FoundFocal(1.0, 0.01, 3, -0.05, 0.001)
    monkeypatch.setattr(guided, "find_poses", lambda *of: Poses.of_bent((lens,), 2))
    found = untrained.predict(_views(_pattern(2)))
    assert found.bent == (lens,) and len(found.depths) == len(found.gaussians) == 0
    assert "poses" in found.timings and "grouping" not in found.timings
