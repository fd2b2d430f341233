"""Weights on disk: one safetensors file, matrices as int8 rows, metadata in the header.

A matrix or convolution is stored as int8 with one float16 scale per output row under
`<key>.scale`; everything else is float16.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import overload

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from langflash_core.errors import WeightsError
from langflash_core.files import make_folder, write_atomically
from langflash_core.network.build import build_network, network_class
from langflash_core.network.checkpoints.store import assemble_network, write_part
from langflash_core.network.encoders.local import convert
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.presets import PRESETS, GuidedDepth, Preset
from langflash_core.resources import asset_path

FORMAT = "langflash-weights-1"
_MIN_QUANTISED = 4096  # numbers; smaller tensors are not worth a scale per row


def load_network(
    preset: str = "mini",
    weights: Path | None = None,
    device: str | torch.device = "cpu",
    *,
    bfloat16: bool = False,
) -> LangFlashNet:
    """The network of a preset with trained weights, in evaluation mode.

    Args:
        weights: a file written by `save_network` or `weights import`; None takes the embedded one,
            or what has been imported.
        bfloat16: compute in it where the network has a rule for that.

    Raises:
        WeightsError: the file is missing, damaged, of another preset, or does not fit.
    """
    if preset not in PRESETS:
        raise WeightsError(f"there is no preset '{preset}'; choose one of {', '.join(PRESETS)}")
    if not network_class(PRESETS[preset]).compact:
        named = None if weights is None else Path(weights)
        return assemble_network(PRESETS[preset], named, device, bfloat16=bfloat16)
    path = _embedded(preset) if weights is None else Path(weights)
    tensors, metadata = read_weights(path)
    if metadata.get("preset") != preset:
        raise WeightsError(
            f"{path.name} holds weights of preset '{metadata.get('preset')}', not '{preset}'; "
            "choose --preset to match"
        )
    network = build_network(PRESETS[preset])
    load_strictly(network, tensors, path)
    network.calibration = metadata.get("calibration", {})
    return network.eval().to(device)


def _embedded(preset: str) -> Path:
    try:
        return asset_path(f"weights/{preset}.safetensors")
    except FileNotFoundError as error:
        raise WeightsError(f"{error}, or name a checkpoint with --weights") from None


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
    load_strictly(network.local, convert(read_weights(local)[0]), local)
    save_network(network, out)


def start_from(network: LangFlashNet, weights: Path, modules: Sequence[str]) -> bool:
    """Fill some modules from a weights file; False, and nothing changed, where it does not hold
    exactly their tensors (an older shape of the network, say).

    Args:
        modules: attribute names of the network, all or none of which are filled.
    """
    tensors, _ = read_weights(weights)
    prefixes = tuple(f"{name}." for name in modules)
    own = {k: v for k, v in tensors.items() if k.startswith(prefixes)}
    wanted = {k: v.shape for k, v in network.state_dict().items() if k.startswith(prefixes)}
    if wanted != {k: v.shape for k, v in own.items()}:
        return False
    network.load_state_dict(own, strict=False)
    return True


def save_network(network: LangFlashNet, path: Path, metadata: Mapping | None = None) -> None:
    """Write all weights atomically. `metadata` is plain JSON: data, steps, hours, metrics, calibration."""
    if not network.compact:
        write_part(path, network.state_dict(), network.preset, "trained here", path.name)
        return
    header = {
        "format": FORMAT,
        "preset": network.preset.name,
        "calibration": network.calibration,
        **(metadata or {}),
    }
    make_folder(path.parent)
    write_atomically(path, save(quantise(network.state_dict()), {"langflash": json.dumps(header)}))


def read_weights(path: Path) -> tuple[dict[str, Tensor], dict]:
    """Float32 tensors and metadata of a safetensors file ({} for a foreign one)."""
    try:
        with safe_open(str(path), framework="pt") as file:
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118 (no mapping)
            header = json.loads((file.metadata() or {}).get("langflash", "{}"))
    except FileNotFoundError:
        raise WeightsError(
            f"there is no weights file {path}; check the path or leave --weights out"
        ) from None
    except (SafetensorError, OSError, ValueError) as error:
        raise WeightsError(
            f"{path} is not a readable safetensors file ({error}); download or convert it again"
        ) from None
    return dequantise(tensors), header


def quantise(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
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


def dequantise(stored: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Float32 tensors of `quantise`."""
    tensors = {}
    for key, value in stored.items():
        if value.dtype == torch.int8:
            scale = stored[f"{key}.scale"].float().reshape(-1, *[1] * (value.ndim - 1))
            tensors[key] = value.float() * scale
        elif not key.endswith(".scale"):
            tensors[key] = value.float()
    return tensors


def load_strictly(module: torch.nn.Module, tensors: dict[str, Tensor], path: Path) -> None:
    """Fill a module with exactly its tensors.

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
    bad = [k for k, v in tensors.items() if not bool(torch.isfinite(v).all())]
    problems += [f"{k} holds NaN or Inf" for k in bad]
    if problems:
        shown = "; ".join(sorted(problems)[:5]) + ("; ..." if len(problems) > 5 else "")
        raise WeightsError(
            f"{path} does not fit this network ({len(problems)} tensors: {shown}); choose another file"
        )
    module.load_state_dict(tensors)
