"""Published checkpoints in, our parts out: the round trip, and every kind of damage."""

import json
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from langflash_core.errors import WeightsError
from langflash_core.network import PointMapNet, build_network, save_network
from langflash_core.network.checkpoints.importing import convert, read_checkpoint
from langflash_core.network.checkpoints.store import (
    assemble_network,
    install,
    installed,
    part_folder,
    verify_part,
)
from langflash_core.types import Views
from tests.network import published
from tests.network.sizes import TINY


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def _saved(state: dict, path: Path) -> Path:
    torch.save({"state_dict": state, "epoch": 3, "global_step": 18751}, path)
    return path


def _views() -> Views:
    images = torch.rand(2, 3, 64, 64, generator=torch.manual_seed(0))
    K = torch.tensor([[60.0, 0, 32], [0, 60.0, 32], [0, 0, 1]])
    return Views(images, K.expand(2, 3, 3), ("a", "b"))


def _installed_network(tmp_path: Path, *, grouping: bool = True) -> PointMapNet:
    install(_saved(published.draw_noposplat(TINY), tmp_path / "mixRe10kDl3dv.ckpt"), TINY)
    install(_saved(published.draw_lseg(TINY, channels=512), tmp_path / "demo_e200.ckpt"), TINY)
    if grouping:
        install(_saved(published.draw_langflash(TINY), tmp_path / "re10k.ckpt"), TINY)
    network = assemble_network(TINY, None, "cpu")
    assert isinstance(network, PointMapNet)
    return network


def test_imported_saved_and_loaded_is_the_same_network(tmp_path, home):
    network = _installed_network(tmp_path)
    assert [part.modules for part in installed(TINY)] == [
        ("decoder", "encoder", "gaussian_heads", "point_heads"),
        ("grouping", "scratch"),
        ("language_head",),
    ]
    assert (home / "weights" / "clip_vitb32.safetensors").is_file()  # LSeg brings CLIP along
    save_network(network, tmp_path / "whole.safetensors")
    for path in part_folder(TINY).iterdir():
        path.unlink()
    again = assemble_network(TINY, tmp_path / "whole.safetensors", "cpu")
    assert not network.aggregated and not again.aggregated  # none of these files holds an aggregation
    for key, value in network.state_dict().items():
        if not key.startswith("aggregation."):  # drawn, in both, and never asked
            assert torch.equal(value, again.state_dict()[key]), key
    first, second = network.predict(_views()), again.predict(_views())
    assert torch.equal(first.gaussians.means, second.gaussians.means)
    assert torch.equal(first.weights, second.weights)
    assert torch.equal(first.dictionary, second.dictionary)


def test_every_number_of_the_checkpoint_arrives(tmp_path):
    """Query, key and value are thirds of one tensor; a shuffled third would still have its shape."""
    state = published.draw_noposplat(TINY)
    tensors = convert(state, TINY, tmp_path).tensors
    fused = state["encoder.backbone.enc_blocks.1.attn.qkv.weight"]
    parts = [tensors[f"encoder.blocks.1.attn.{part}.weight"] for part in ("query", "key", "value")]
    assert torch.equal(torch.cat(parts), fused)
    arrived = sum(value.numel() for value in tensors.values())
    unused = [k for k in state if "layer_rn." in k or "refinenet4.resConfUnit1" in k or "mask_token" in k]
    assert arrived == sum(v.numel() for k, v in state.items() if k not in unused)


def test_without_grouping_and_aggregation_the_scene_is_whole(tmp_path):
    network = _installed_network(tmp_path, grouping=False)
    assert not network.grouped and not network.aggregated
    prediction = network.predict(_views())
    assert prediction.weights.shape[1] >= 1
    torch.testing.assert_close(
        prediction.dictionary.norm(dim=1), torch.ones(len(prediction.dictionary)), atol=1e-5, rtol=0
    )


def test_geometry_alone_says_what_is_missing(tmp_path, home):
    install(_saved(published.draw_noposplat(TINY), tmp_path / "a.ckpt"), TINY)
    with pytest.raises(WeightsError, match=r"no weights for language_head.*weights import") as caught:
        assemble_network(TINY, None, "cpu")
    assert str(home) in str(caught.value)


def test_bfloat16_takes_half_the_memory_and_stays_near(tmp_path):
    exact = _installed_network(tmp_path)
    mixed = assemble_network(TINY, None, "cpu", bfloat16=True)
    kinds = {key: value.dtype for key, value in mixed.state_dict().items()}
    assert kinds["encoder.blocks.0.attn.query.weight"] == torch.bfloat16
    assert kinds["encoder.norm.weight"] == kinds["point_heads.0.out.weight"] == torch.float32
    a, b = exact.predict(_views()).gaussians, mixed.predict(_views()).gaussians
    # bfloat16 keeps 8 bits: 0.4 % a product, some 2 % after all layers of this random network.
    assert (a.opacities - b.opacities).abs().mean() < 0.02
    assert ((a.means - b.means).norm(dim=1) / a.means.norm(dim=1)).median() < 0.05


def test_a_safetensors_checkpoint_is_read_too(tmp_path):
    state = {k: v for k, v in published.draw_noposplat(TINY).items() if "layer_rn." not in k}  # no aliases
    save_file(state, tmp_path / "model.safetensors")
    assert convert(read_checkpoint(tmp_path / "model.safetensors"), TINY, tmp_path).origin.name == "noposplat"


class _Code:
    """A pickle that would run something."""

    def __reduce__(self):
        return (print, ("this must never be printed",))


KEY = "encoder.backbone.dec_blocks2.1.cross_attn.projk.weight"
DAMAGE = {
    "missing file": "there is no checkpoint",
    "empty file": "is empty",
    "text": "is not a plain checkpoint|damaged",
    "truncated": "damaged",
    "code": "it wants to run .*print",
    "list": "holds no table of tensors",
    "not tensors": "things that are no tensors",
    "foreign": "none of the checkpoints",
    "missing": "1 missing .*dec_blocks2.1.cross_attn.projk.weight",
    "surplus": "1 surplus .*encoder.backbone.more",
    "misshaped": r"1 misshaped .*projk.weight is \(3, 5\), expected \(32, 32\)",
    "not finite": "1 not finite .*projk.weight",
    "another size": "misshaped .* and [0-9]+ more",
}


def _damaged(kind: str, path: Path) -> Path:
    state = published.draw_noposplat(TINY)
    match kind:
        case "missing file":
            return path
        case "empty file":
            path.touch()
        case "text":
            path.write_text("404: not found")
        case "truncated":
            content = _saved(state, path).read_bytes()
            path.write_bytes(content[: len(content) // 2])
        case "code":
            torch.save({"state_dict": _Code()}, path)
        case "list":
            torch.save([torch.ones(3)], path)
        case "not tensors":
            _saved(state | {"encoder.note": "hello"}, path)
        case "foreign":
            _saved({"conv1.weight": torch.ones(3)}, path)
        case "missing":
            _saved({k: v for k, v in state.items() if k != KEY}, path)
        case "surplus":
            _saved(state | {"encoder.backbone.more": torch.ones(2)}, path)
        case "misshaped":
            _saved(state | {KEY: torch.ones(3, 5)}, path)
        case "not finite":
            _saved(state | {KEY: torch.full((32, 32), torch.nan)}, path)
        case "another size":
            from dataclasses import replace

            _saved(published.draw_noposplat(replace(TINY, dpt_feature=20)), path)
    return path


@pytest.mark.parametrize("kind", list(DAMAGE))
def test_damaged_checkpoints_are_refused_in_one_sentence(kind, tmp_path, home, capsys):
    path = _damaged(kind, tmp_path / "model.ckpt")
    with pytest.raises(WeightsError, match=DAMAGE[kind]) as caught:
        install(path, TINY)
    message = str(caught.value)
    assert "\n" not in message and str(path) in message and len(message) < 1000
    assert message.endswith(("choose another file", "check the path"))
    assert not home.exists()  # nothing was written
    assert "never" not in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["missing", "surplus", "misshaped", "nan", "foreign", "preset", "truncated"])
def test_damaged_parts_are_refused(kind, tmp_path):
    path = install(_saved(published.draw_lseg(TINY, channels=512), tmp_path / "demo.ckpt"), TINY)[0]
    verify_part(path, TINY)
    with safe_open(str(path), framework="pt") as file:
        tensors = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
        header = file.metadata()
    key = "language_head.out.bias"
    if kind == "missing":
        del tensors[key]
    elif kind == "surplus":
        tensors["language_head.more"] = torch.ones(1)
    elif kind == "misshaped":
        tensors[key] = torch.ones(3)
    elif kind == "nan":
        tensors[key] = torch.full_like(tensors[key], torch.nan)
    elif kind == "foreign":
        header = {}
    elif kind == "preset":
        header = {"langflash": json.dumps(json.loads(header["langflash"]) | {"preset": "other"})}
    save_file(tensors, path, header)
    if kind == "truncated":
        path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(WeightsError) as caught:
        assemble_network(TINY, path, "cpu")
    assert "\n" not in str(caught.value)


def test_a_fresh_network_of_the_same_shape_is_not_filled(tmp_path):
    """The test of all tests here: drawn weights differ from the imported ones."""
    network = _installed_network(tmp_path)
    fresh = build_network(TINY)
    assert not torch.equal(network.encoder.patch.weight, fresh.encoder.patch.weight)
