"""Published checkpoints in, our parts out: the round trip, and every kind of damage."""

import argparse
import json
import os
import sys
from collections import OrderedDict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from langflash_core.errors import WeightsError
from langflash_core.network import LangFlashNet, PointMapNet, build_network, save_network
from langflash_core.network.checkpoints.importing import convert, read_checkpoint
from langflash_core.network.checkpoints.parts import installed_parts, part_folder, read_part, read_tensors
from langflash_core.network.checkpoints.store import assemble_network, install, verify_part
from tests.network import published
from tests.network.sizes import TINY, noise_views


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def _saved(state: dict, path: Path) -> Path:
    torch.save({"state_dict": state, "epoch": 3, "global_step": 18751}, path)
    return path


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
    assert [part.modules for part in installed_parts(TINY)] == [
        ("decoder", "encoder", "gaussian_heads", "point_heads"),
        ("grouping", "scratch"),
        ("language_head",),
    ]
    assert (home / "weights" / "clip_vitb32.safetensors").is_file()  # LSeg brings CLIP along
    save_network(network, tmp_path / "whole.safetensors")
    for path in part_folder(TINY).iterdir():
        path.unlink()
    again = assemble_network(TINY, tmp_path / "whole.safetensors", "cpu")
    assert not torch.equal(network.encoder.patch.weight, build_network(TINY).encoder.patch.weight)
    assert not network.aggregated and not again.aggregated  # none of these files holds an aggregation
    for key, value in network.state_dict().items():
        if not key.startswith("aggregation."):  # drawn, in both, and never asked
            assert torch.equal(value, again.state_dict()[key]), key
    first, second = network.predict(noise_views()), again.predict(noise_views())
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
    prediction = network.predict(noise_views())
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
    a, b = exact.predict(noise_views()).gaussians, mixed.predict(noise_views()).gaussians
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


class _Shell:
    """A pickle that would run something of a module that torch blocks altogether."""

    def __reduce__(self):
        return (os.system, ("echo this must never be printed",))


class _Table(dict):
    """An object of a class nobody here knows, filled like a table."""


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
    "blocked code": "it wants to run (posix|nt).system",
    "half a framework": "is not a plain checkpoint",
    "missing": "1 missing .*dec_blocks2.1.cross_attn.projk.weight",
    "surplus": "1 surplus .*encoder.backbone.more",
    "misshaped": r"1 misshaped .*projk.weight is \(3, 5\), expected \(32, 32\)",
    "not finite": "1 not finite .*projk.weight",
    "another size": "misshaped .* and [0-9]+ more",
}


def _damaged(kind: str, path: Path) -> Path:
    state = published.draw_noposplat(TINY)
    other = {
        "blocked code": {"state_dict": state, "callbacks": _Shell()},
        "code": {"state_dict": _Code()},
        "half a framework": {"state_dict": _Table(state)},
        "list": [torch.ones(3)],
    }
    tensors = {
        "another size": lambda: published.draw_noposplat(replace(TINY, dpt_feature=20)),
        "foreign": lambda: {"conv1.weight": torch.ones(3)},
        "misshaped": lambda: state | {KEY: torch.ones(3, 5)},
        "missing": lambda: {k: v for k, v in state.items() if k != KEY},
        "not finite": lambda: state | {KEY: torch.full((32, 32), torch.nan)},
        "not tensors": lambda: state | {"encoder.note": "hello"},
        "surplus": lambda: state | {"encoder.backbone.more": torch.ones(2)},
    }
    texts = {"empty file": "", "text": "404: not found"}
    if kind in other:
        torch.save(other[kind], path)
    elif kind in tensors:
        _saved(tensors[kind](), path)
    elif kind in texts:
        path.write_text(texts[kind])
    elif kind == "truncated":
        content = _saved(state, path).read_bytes()
        path.write_bytes(content[: len(content) // 2])
    else:
        assert kind == "missing file"
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


class _ModelCheckpoint:
    """As training frameworks have it: its class is a key in what they save, its objects hold more of them."""

    def __init__(self) -> None:
        self.folder, self.best = Path("runs"), np.float32(0.3)

    def __setstate__(self, state: object) -> None:
        sys.stdout.write("this must never be printed")


def test_what_lightning_1_4_saves_is_read_and_nothing_in_it_runs(tmp_path, capsys):
    state = published.draw_lseg(TINY, channels=512)
    saved = {
        "epoch": 199, "global_step": 31600, "pytorch-lightning_version": "1.4.9",
        "callbacks": {_ModelCheckpoint: {"monitor": "val_acc", "best_model_score": torch.tensor(0.3)}},
        "optimizer_states": [{"state": {0: {"momentum_buffer": torch.ones(2)}}, "param_groups": []}],
        "lr_schedulers": [{"base_lrs": [0.004], "lr_lambdas": [None]}],
        "hparams_name": "kwargs",
        "hyper_parameters": {"args": argparse.Namespace(a=Path("a")), "b": _ModelCheckpoint(), "c": _Code()},
        "state_dict": OrderedDict(state),
    }  # fmt: skip
    torch.save(saved, tmp_path / "demo_e200.ckpt")
    found = read_checkpoint(tmp_path / "demo_e200.ckpt")
    assert found.keys() == state.keys()
    assert all(torch.equal(found[key], value) for key, value in state.items())
    assert convert(found, TINY, tmp_path).origin.name == "lseg"
    assert "never" not in capsys.readouterr().out


def _installed_pair(tmp_path, *, same: bool, grouping_first: bool) -> tuple[str, ...]:
    """Geometry and LangFlash's file, which holds the same geometry or one 2 % away; the last notes."""
    released = published.draw_langflash(TINY)
    plain = published.draw_noposplat(TINY)
    if not same:
        noise = torch.Generator().manual_seed(3)
        for key, value in plain.items():
            step = torch.randn(value.shape, generator=noise) * value.norm() / value.numel() ** 0.5
            plain[key] = value + 0.02 * step
    files = [
        _saved(plain, tmp_path / "mixRe10kDl3dv.ckpt"), _saved(released, tmp_path / "re10k.ckpt"),
    ]  # fmt: skip
    install(_saved(published.draw_lseg(TINY, channels=512), tmp_path / "demo_e200.ckpt"), TINY)
    return [install(path, TINY).notes for path in (files[::-1] if grouping_first else files)][-1]


def _logits(network: PointMapNet) -> torch.Tensor:
    views = noise_views()
    with torch.inference_mode():
        tokens = network.encode(views.images[None], views.Ks[None])
        return network.group(tokens, views.images[None])[-1].mask_logits


@pytest.mark.parametrize("grouping_first", [False, True])
def test_a_grouping_trained_on_the_installed_geometry_shares_it(tmp_path, grouping_first):
    notes = _installed_pair(tmp_path, same=True, grouping_first=grouping_first)
    assert len(notes) == 1 and "which it shares" in notes[0]
    part = read_part(part_folder(TINY) / "grouping.safetensors")
    assert part.modules == ("grouping", "scratch") and part.reads
    network = assemble_network(TINY, None, "cpu")
    assert not hasattr(network, "grouping_encoder") and network.notes == ()


@pytest.mark.parametrize("grouping_first", [False, True])
def test_a_grouping_trained_on_another_encoder_keeps_it_and_says_what_it_costs(tmp_path, grouping_first):
    notes = _installed_pair(tmp_path, same=False, grouping_first=grouping_first)
    assert len(notes) == 1 and "its own, 2 % away" in notes[0]
    assert "GB more" in notes[0] and "twice" in notes[0]
    network = assemble_network(TINY, None, "cpu")
    assert isinstance(network, PointMapNet)
    assert torch.equal(
        network.grouping_encoder.patch.weight,
        published.draw_langflash(TINY)["encoder.backbone.patch_embed.proj.weight"],
    )
    own = _logits(network)
    network.grouping_encoder, network.grouping_decoder = network.encoder, network.decoder
    fed_wrongly = _logits(network)
    # Why it is kept: two per cent of the weights are several per cent of the masks' logits.
    assert (own - fed_wrongly).norm() / own.norm() > 0.02
    assert network.notes == () and torch.isfinite(network.predict(noise_views()).weights).all()


def test_a_copy_survives_saving_and_bfloat16(tmp_path):
    _installed_pair(tmp_path, same=False, grouping_first=False)
    network = assemble_network(TINY, None, "cpu")
    save_network(network, tmp_path / "whole.safetensors")
    for path in part_folder(TINY).iterdir():
        path.unlink()
    verify_part(tmp_path / "whole.safetensors", TINY)
    again = assemble_network(TINY, tmp_path / "whole.safetensors", "cpu")
    assert isinstance(network, PointMapNet) and isinstance(again, PointMapNet)
    assert torch.equal(_logits(network), _logits(again))
    mixed = assemble_network(TINY, tmp_path / "whole.safetensors", "cpu", bfloat16=True)
    kinds = {key: value.dtype for key, value in mixed.state_dict().items()}
    assert kinds["grouping_encoder.blocks.0.attn.query.weight"] == torch.bfloat16


def test_another_geometry_under_a_sharing_grouping_is_told(tmp_path):
    _installed_pair(tmp_path, same=True, grouping_first=False)
    notes = install(
        _saved(published.draw_noposplat(TINY, seed=5), tmp_path / "re10k_3views.ckpt"), TINY
    ).notes
    assert len(notes) == 1 and "trained on another encoder" in notes[0]
    prediction = assemble_network(TINY, None, "cpu").predict(noise_views())
    assert any("trained on another encoder" in warning for warning in prediction.warnings)


def test_a_grouping_whose_encoder_was_cut_off_is_told(tmp_path):
    released = published.draw_langflash(TINY)
    cut = {key: value for key, value in released.items() if not key.startswith("encoder.backbone.")}
    install(_saved(published.draw_noposplat(TINY), tmp_path / "mixRe10kDl3dv.ckpt"), TINY)
    done = install(_saved(cut, tmp_path / "re10k.ckpt"), TINY)
    assert "was not kept" in done.notes[0]
    assert read_part(done.paths[0]).modules == ("grouping", "scratch")


def test_tensors_that_the_authors_gave_up_are_told_and_others_are_refused(tmp_path):
    released = published.draw_langflash(TINY)
    odd = {
        "prefuse.exist_head.0.fc1.weight": torch.ones(2), "encoder.scratch_head1.to1.weight": torch.ones(3),
        "prefuse.dec1.0.atten1.in_proj_weight": torch.ones(4), "later.anything": torch.ones(1),
    }  # fmt: skip
    done = install(_saved(released | odd, tmp_path / "re10k.ckpt"), TINY)
    assert "4 tensors of it are read by nobody" in done.notes[0] and "prefuse.exist_head" in done.notes[0]
    tensors = read_tensors(read_part(done.paths[0]), ("grouping", "scratch"))
    assert not any("atten1" in key for key in tensors)
    seventh = {
        "prefuse.dec1.6.norm1.weight": torch.ones(16)
    }  # another network: it would not be the same without
    with pytest.raises(WeightsError, match=r"1 surplus .*dec1\.6"):
        install(_saved(released | seventh, tmp_path / "re10k.ckpt"), TINY)


def test_parts_of_older_versions_are_read_and_say_what_they_do_not_know(tmp_path):
    install(_saved(published.draw_lseg(TINY, channels=512), tmp_path / "demo_e200.ckpt"), TINY)
    _saved(published.draw_noposplat(TINY), tmp_path / "mixRe10kDl3dv_512x512.ckpt")
    install(tmp_path / "mixRe10kDl3dv_512x512.ckpt", TINY)
    released = published.draw_langflash(TINY)
    cut = {key: value for key, value in released.items() if not key.startswith("encoder.backbone.")}
    install(_saved(cut, tmp_path / "re10k.ckpt"), TINY)
    for path in part_folder(TINY).iterdir():
        with safe_open(str(path), framework="pt") as file:
            tensors = {key: file.get_tensor(key).clone() for key in file.keys()}  # noqa: SIM118
            header = json.loads(file.metadata()["langflash"])
        older = {name: header[name] for name in ("format", "preset", "modules", "origin", "source")}
        save_file(tensors, path, {"langflash": json.dumps(older)})
    network = assemble_network(TINY, None, "cpu")
    assert network.trained_side == 512  # the source tells
    assert len(network.notes) == 1 and "import its checkpoint again" in network.notes[0]


def _of_size(network: LangFlashNet) -> list[str]:
    return [
        warning for warning in network.predict(noise_views()).warnings if "were trained on photos" in warning
    ]


def test_weights_trained_at_512_say_so_when_they_see_less(tmp_path):
    install(_saved(published.draw_lseg(TINY, channels=512), tmp_path / "demo_e200.ckpt"), TINY)
    geometry = published.draw_noposplat(TINY)
    install(_saved(geometry, tmp_path / "noposplat-mix-512-mixRe10kDl3dv_512x512.ckpt"), TINY)
    network = assemble_network(TINY, None, "cpu")
    assert network.trained_side == 512
    said = _of_size(network)
    assert len(said) == 1 and "512 x 512" in said[0] and "64 x 64" in said[0] and "--size 512" in said[0]
    for name, side, told in (("mixRe10kDl3dv.ckpt", 64, 0), ("mine.ckpt", None, 0), ("re10k.ckpt", None, 1)):
        install(_saved(geometry, tmp_path / name), TINY, side=side)
        assert len(_of_size(assemble_network(TINY, None, "cpu"))) == told, name


@pytest.mark.parametrize("kind", ["missing", "surplus", "misshaped", "nan", "foreign", "preset", "truncated"])
def test_damaged_parts_are_refused(kind, tmp_path):
    path = install(_saved(published.draw_lseg(TINY, channels=512), tmp_path / "demo.ckpt"), TINY).paths[0]
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
