"""Weights on disk: one safetensors file, matrices as int8 rows, metadata in the header.

How numbers are stored is said in `stored.py`, which reads them.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import overload

import numpy as np
import torch
from jaxtyping import Shaped
from safetensors.torch import save
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import WeightsError
from langflash_core.network.build import build_network, network_class
from langflash_core.network.checkpoints.parts import TRAINED_HERE, write_part
from langflash_core.network.checkpoints.store import assemble_network, finite
from langflash_core.network.checkpoints.stored import Stored, dequantise_tensors, read_stored, weights_file
from langflash_core.network.encoders.local import convert
from langflash_core.network.encoders.others import OtherEyes
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.presets import PRESETS, GuidedDepth, Preset
from langflash_core.network.semantics.second import SecondHead

FORMAT = "langflash-weights-1"
_MIN_QUANTISED = 4096  # numbers; smaller tensors are not worth a scale per row


def load_network(
    preset: str = "mini",
    weights: Path | None = None,
    device: str | torch.device = "cpu",
    *,
    bfloat16: bool = False,
    stored: Stored | None = None,
) -> LangFlashNet:
    """The network of a preset with trained weights, in evaluation mode.

    Args:
        weights: a file written by `save_network` or `weights import`; None takes the embedded one,
            or what has been imported.
        bfloat16: compute in it where the network has a rule for that.
        stored: what `stored.read_stored` found in the embedded or named file, which is then not read.

    Raises:
        WeightsError: the file is missing, damaged, of another preset, or does not fit.
    """
    if preset not in PRESETS:
        raise WeightsError(f"there is no preset '{preset}'; choose one of {', '.join(PRESETS)}")
    if not network_class(PRESETS[preset]).compact:
        named = None if weights is None else Path(weights)
        return assemble_network(PRESETS[preset], named, device, bfloat16=bfloat16)
    path = weights_file(preset, weights)
    stored = stored or read_stored(path)
    if stored.header.get("preset") != preset:
        raise WeightsError(
            f"{path.name} holds weights of preset '{stored.header.get('preset')}', not '{preset}'; "
            "choose --preset to match"
        )
    with torch.device("meta"):  # no memory and no drawn numbers: it takes over those of the file
        network = build_network(PRESETS[preset]).eval()
    load_strictly(network, complete_tensors(_tensors(stored.arrays)), path, assign=True)
    assert not any(buffer.is_meta for buffer in network.buffers())
    network.calibration = stored.header.get("calibration", {})
    return (network.use_bfloat16() if bfloat16 else network).to(device)


@overload
def initial_network(preset: GuidedDepth, frozen: Path, seed: int = 0) -> GuidedDepthNet: ...
@overload
def initial_network(preset: Preset, frozen: Path, seed: int = 0) -> LangFlashNet: ...
def initial_network(preset: Preset, frozen: Path, seed: int = 0) -> LangFlashNet:
    """A network to train: the frozen parts from a file, every head freshly drawn from `seed`.

    What is stored as int8 rows goes through them, so that the heads learn on what they will see.

    Args:
        frozen: a file of `save_network` (see `adopt_frozen` for the published files).
    """
    torch.manual_seed(seed)
    network = build_network(preset)
    tensors, _ = read_weights(frozen)
    for name in network.frozen:
        own = {k.removeprefix(f"{name}."): v for k, v in tensors.items() if k.startswith(f"{name}.")}
        own = dequantise(quantise(own)) if network.compact else own
        load_strictly(getattr(network, name), own, frozen)
    if isinstance(network, GuidedDepthNet):
        network.begin_halves()
    return network


def adopt_frozen(preset: Preset, encoder: Path, local: Path, out: Path, seed: int = 0) -> None:
    """Write a file to train from out of published weights: a timm state dict of the preset's
    encoder, and XFeat's. The heads in it are untrained."""
    torch.manual_seed(seed)
    network = build_network(preset)
    if not isinstance(network, GuidedDepthNet):
        raise WeightsError(
            f"the preset '{preset.name}' takes published weights as they are; use `langflash weights import`"
        )
    load_strictly(network.encoder.vit, read_weights(encoder)[0], encoder)
    network.begin_halves()
    load_strictly(network.local, convert(read_weights(local)[0]), local)
    save_network(network, out)


def start_from(
    network: LangFlashNet, tensors: Mapping[str, Shaped[Tensor, "..."]], modules: Sequence[str]
) -> bool:
    """Fill some modules from what `read_weights` found; False, and nothing changed, where it does not
    hold exactly their tensors (an older shape of the network, say).

    Args:
        modules: attribute names of the network, all or none of which are filled.
    """
    prefixes = tuple(f"{name}." for name in modules)
    own = {k: v for k, v in tensors.items() if k.startswith(prefixes)}
    wanted = {k: v.shape for k, v in network.state_dict().items() if k.startswith(prefixes)}
    if wanted != {k: v.shape for k, v in own.items()}:
        return False
    network.load_state_dict(own, strict=False)
    return True


def save_network(network: LangFlashNet, path: Path, metadata: Mapping | None = None) -> None:
    """Write all weights atomically. `metadata` is plain JSON: data, steps, hours, metrics, calibration.

    An aggregation that has no weights stands by untrained and is not written: who reads the file would
    take it for trained, and normalise atoms twice where this network does once.
    """
    if not network.compact:
        trained = {
            key: value
            for key, value in network.state_dict().items()
            if network.aggregated or not key.startswith("aggregation.")
        }
        write_part(path, trained, network.preset, TRAINED_HERE, path.name, side=network.trained_side)
        return
    header = {
        "format": FORMAT,
        "preset": network.preset.name,
        "calibration": network.calibration,
        **(metadata or {}),
    }
    make_folder(path.parent)
    write_atomically(path, save(quantise(network.state_dict()), {"langflash": json.dumps(header)}))


def read_weights(path: Path) -> tuple[dict[str, Shaped[Tensor, "..."]], dict]:
    """Float32 tensors and metadata of a safetensors file ({} for a foreign one).

    Raises:
        WeightsError: there is none, or it is no safetensors file.
    """
    stored = read_stored(path)
    return complete_tensors(_tensors(stored.arrays)), stored.header


def complete_tensors(tensors: dict[str, Shaped[Tensor, "..."]]) -> dict[str, Shaped[Tensor, "..."]]:
    """Tensors of a whole network, also from before depth had a late half of its own, and from before these
    other networks were asked, which then say nothing."""
    heard = any(name.startswith("others.") for name in tensors)
    whole = any(name.startswith("language_head.taught.") for name in tensors)
    if not whole or heard:
        return with_deep(tensors)
    earlier = ("deeplab.", "second_head.")  # of another network that was asked before
    own = {name: value for name, value in tensors.items() if not name.startswith(earlier)}
    return with_deep(own) | silent_second()


def with_deep(tensors: dict[str, Shaped[Tensor, "..."]]) -> dict[str, Shaped[Tensor, "..."]]:
    """Tensors from before depth had a late half of its own: there it takes over the one that names have."""
    if any(name.startswith("deep.") for name in tensors):
        return tensors
    late = {name: value for name, value in tensors.items() if name.startswith("late.")}
    return tensors | {f"deep.{name.removeprefix('late.')}": value.clone() for name, value in late.items()}


def silent_second() -> dict[str, Shaped[Tensor, "..."]]:
    """Tensors of other networks that say nothing."""
    preset = PRESETS["mini"]
    assert isinstance(preset, GuidedDepth)
    with torch.device("meta"):
        modules = {"others": OtherEyes(), "second_head": SecondHead(preset)}
    return {
        f"{name}.{key}": torch.zeros(value.shape)
        for name, module in modules.items()
        for key, value in module.state_dict().items()
    }


def quantise(tensors: Mapping[str, Shaped[Tensor, "..."]]) -> dict[str, Shaped[Tensor, "..."]]:
    """Int8 rows for matrices, float16 for the rest. Rows of zeros keep a scale of 0."""
    stored = {}
    for key, value in tensors.items():
        value = value.detach().float().cpu().contiguous()
        if (
            value.ndim < 2
            or value.numel() < _MIN_QUANTISED
            or key.endswith(("pos_embed", "patterns", "positions"))
        ):
            stored[key] = value.half()
            continue
        scale = (value.flatten(1).abs().amax(1) / 127).half()
        divisor = scale.float().clamp_min(1e-12).reshape(-1, *[1] * (value.ndim - 1))
        stored[key] = (value / divisor).round().clamp(-127, 127).to(torch.int8)
        stored[f"{key}.scale"] = scale
    return stored


def dequantise(stored: Mapping[str, Shaped[Tensor, "..."]]) -> dict[str, Shaped[Tensor, "..."]]:
    """Float32 tensors of `quantise`."""
    return _tensors(dequantise_tensors({key: value.numpy() for key, value in stored.items()}))


def _tensors(arrays: Mapping[str, np.ndarray]) -> dict[str, Tensor]:
    """The same memory."""
    return {key: torch.from_numpy(array) for key, array in arrays.items()}


def load_strictly(
    module: torch.nn.Module, tensors: dict[str, Shaped[Tensor, "..."]], path: Path, *, assign: bool = False
) -> None:
    """Fill a module with exactly its tensors: copies of them, or `assign` them as they are.

    Raises:
        WeightsError: tensors are missing, surplus, misshaped or not finite; lists the first five.
    """
    expected = {k: tuple(v.shape) for k, v in module.state_dict().items()}
    found = {k: tuple(v.shape) for k, v in tensors.items()}
    problems = [f"missing {k}" for k in expected.keys() - found.keys()]
    problems += [f"surplus {k}" for k in found.keys() - expected.keys()]
    problems += [
        f"{k} is {found[k]}, expected {expected[k]}"
        for k in expected.keys() & found.keys()
        if expected[k] != found[k]
    ]
    bad = [k for k, v in tensors.items() if not finite(v)]
    problems += [f"{k} holds NaN or Inf" for k in bad]
    if problems:
        shown = "; ".join(sorted(problems)[:5]) + ("; ..." if len(problems) > 5 else "")
        raise WeightsError(
            f"{path} does not fit this network ({len(problems)} tensors: {shown}); choose another file"
        )
    module.load_state_dict(tensors, assign=assign)
