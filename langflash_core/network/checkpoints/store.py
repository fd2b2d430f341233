"""Parts into networks: published checkpoints installed as parts, and networks assembled out of them.

A file named by the user goes before the parts of the preset's folder.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from jaxtyping import Shaped
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from langflash_core.base.files import written_atomically
from langflash_core.base.resources import weights_folder
from langflash_core.errors import WeightsError
from langflash_core.network.build import build_network
from langflash_core.network.checkpoints.catalogue import trained_side
from langflash_core.network.checkpoints.importing import convert, preset_for, read_checkpoint
from langflash_core.network.checkpoints.origins import COPY
from langflash_core.network.checkpoints.parts import (
    REMEDY,
    TRUNK,
    Part,
    installed_parts,
    part_folder,
    read_part,
    write_part,
)
from langflash_core.network.checkpoints.sharing import mismatch, settle
from langflash_core.network.checkpoints.stored import ALIGNMENT
from langflash_core.network.model import LangFlashNet
from langflash_core.network.presets import PointMaps, Preset

CLIP_FILE = "clip_vitb32.safetensors"


@dataclass(frozen=True)
class Installed:
    """paths: the files written, the part first. notes: what its user should know, a sentence each."""

    paths: tuple[Path, ...]
    notes: tuple[str, ...]


def install(
    checkpoint: Path, preset: Preset, out: Path | None = None, *, side: int | None = None
) -> Installed:
    """Convert a published checkpoint.

    Args:
        out: where to put the part; None: the preset's folder, replacing the part of its kind.
        side: pixels a side of the photos it was trained on; None: as the file's name tells, if it does.

    Raises:
        WeightsError: the checkpoint cannot be read or does not fit; nothing is written then.
        OutputError: the file cannot be written.
    """
    imported = convert(read_checkpoint(checkpoint), preset, checkpoint)
    path = out or part_folder(preset) / f"{imported.origin.part}.safetensors"
    known = trained_side(checkpoint.name) if side is None else side
    write_part(path, imported.tensors, preset, imported.origin.title, checkpoint.name, side=known)
    notes = imported.notes + (settle(preset) if out is None else ())
    if not imported.clip:
        return Installed((path,), notes)
    clip = weights_folder() / CLIP_FILE
    with written_atomically(clip, SafetensorError) as temporary:
        save_file({name: value.contiguous() for name, value in imported.clip.items()}, temporary)
    return Installed((path, clip), notes)


def assemble_network(
    preset: Preset, weights: Path | None, device: str | torch.device, *, bfloat16: bool = False
) -> LangFlashNet:
    """A network out of parts, in evaluation mode.

    Every module comes from the first part that fills it: `weights`, then the preset's folder.
    The network is built without memory and takes over the tensors one by one, each in the
    precision it is needed in, so that nothing is held twice.

    Raises:
        WeightsError: a module that must have weights has none, or a part does not fit.
    """
    sources = _sources(_parts(preset, weights))
    with torch.device("meta"):
        network = build_network(_filtering(preset_for(preset, sources), sources)).eval()
    if bfloat16:
        network.use_bfloat16()
    for name, part in sources.items():
        _fill(network, name, part.path, device)
    network.complete(set(sources), _advice(preset))
    network.trained_side = _side(sources)
    network.notes = _notes(sources)
    return channels_last(network).to(device)


def network_to_train(
    preset: Preset, weights: Path | None, seed: int, fresh: Collection[str] = ()
) -> tuple[LangFlashNet, set[str]]:
    """A network of parts with every other module drawn from `seed`, and the modules that were filled.

    Masks are groups by their existence, which is what training teaches.

    Args:
        weights: goes before the preset's folder. fresh: modules to draw although there are weights.

    Raises:
        WeightsError: what is never trained has no weights, or a part does not fit.
    """
    held = _sources(_parts(preset, weights))
    dropped = {*fresh, *(name for name in held if name.startswith(COPY) and "grouping" in fresh)}
    sources = {name: part for name, part in held.items() if name not in dropped}
    torch.manual_seed(seed)
    shape = preset_for(preset, sources)
    network = build_network(replace(shape, mask_filter=None) if isinstance(shape, PointMaps) else shape)
    missing = [name for name in network.frozen if name not in sources]
    if missing:
        raise WeightsError(f"there are no weights for {', '.join(missing)}; {_advice(preset)}")
    for name, part in sources.items():
        _fill(network, name, part.path, "cpu")
    network.trained_side = _side(sources)
    return network, set(sources)


def _filtering(preset: Preset, sources: dict[str, Part]) -> Preset:
    """The preset's filter of masks reads scores as the released grouping gives them; one that was trained
    here gives existence."""
    grouping = sources.get("grouping")
    if isinstance(preset, PointMaps) and grouping is not None and not grouping.filtered:
        return replace(preset, mask_filter=None)
    return preset


def _parts(preset: Preset, weights: Path | None) -> list[Part]:
    """What there is for a preset, in the order in which modules are looked for."""
    parts = ([read_part(weights)] if weights is not None else []) + installed_parts(preset)
    for part in parts:
        _check_preset(part, preset)
    return parts


def _sources(parts: Sequence[Part]) -> dict[str, Part]:
    """Which part fills which module: the first that can. Copies for the grouping come with it, and only
    where it was trained on another trunk than the one there is."""
    sources: dict[str, Part] = {}
    for part in parts:
        for name in part.modules:
            sources.setdefault(name, part)
    grouping = sources.get("grouping")
    plain = {name: part for name, part in sources.items() if not name.startswith(COPY)}
    if grouping is None or grouping.reads == _trunk(sources):
        return plain
    return plain | dict.fromkeys(grouping.copies, grouping)


def _trunk(sources: dict[str, Part]) -> str:
    """Fingerprint of encoder and decoder together; "" where that is unknown."""
    held = [sources.get(name) for name in TRUNK]
    return held[0].trunk if held[0] is not None and held[0] is held[1] else ""


def _side(sources: dict[str, Part]) -> int:
    return sources["decoder"].side if "decoder" in sources else 0


def _notes(sources: dict[str, Part]) -> tuple[str, ...]:
    grouping = sources.get("grouping")
    if grouping is None or any(name.startswith(COPY) for name in sources):
        return ()
    note = mismatch(grouping, _trunk(sources))
    return (note,) if note else ()


def _check_preset(part: Part, preset: Preset) -> None:
    if part.preset != preset.name:
        raise WeightsError(
            f"{part.path.name} holds weights of preset '{part.preset}', not '{preset.name}'; "
            "choose --preset to match"
        )


def channels_last(network: LangFlashNet) -> LangFlashNet:
    """The same numbers in another order: convolutions are a fifth to a third faster on a CPU."""
    for parameter in network.parameters():
        if parameter.ndim == 4:
            parameter.data = parameter.data.contiguous(memory_format=torch.channels_last)
    return network


def verify_part(path: Path, preset: Preset) -> None:
    """Read every number of a part and check that it fits the preset's network.

    Raises:
        WeightsError: it does not.
    """
    modules = read_part(path).modules
    with torch.device("meta"):
        network = build_network(preset_for(preset, modules))
    for name in modules:
        _fill(network, name, path, "cpu")


def _fill(network: LangFlashNet, name: str, path: Path, device: str | torch.device) -> None:
    """One module from a part, strictly."""
    module = getattr(network, name, None)
    if not isinstance(module, torch.nn.Module):
        raise WeightsError(f"{path} fills '{name}', which this network does not have; {REMEDY}")
    expected = module.state_dict()
    with safe_open(str(path), framework="pt") as file:
        keys = [key.removeprefix(f"{name}.") for key in file.keys() if key.startswith(f"{name}.")]  # noqa: SIM118
        problems = _differences(expected.keys(), keys)
        tensors = {}
        for key in expected.keys() & set(keys):
            value = on_own_address(file.get_tensor(f"{name}.{key}").to(device, expected[key].dtype))
            if value.shape != expected[key].shape:
                problems.append(f"{key} is {tuple(value.shape)}, expected {tuple(expected[key].shape)}")
            tensors[key] = value
    problems += [f"{k} holds NaN or Inf" for k, v in tensors.items() if not finite(v)]
    if problems:
        shown = "; ".join(sorted(problems)[:5]) + ("; ..." if len(problems) > 5 else "")
        raise WeightsError(f"{path} does not fit '{name}' ({len(problems)} tensors: {shown}); {REMEDY}")
    module.load_state_dict(tensors, assign=True)


def on_own_address(value: Shaped[Tensor, "*any"]) -> Shaped[Tensor, "*any"]:
    """The same numbers where torch would have put them, on a multiple of 64 bytes.

    A tensor of a safetensors file starts at any address, and matrix products may choose their way by it
    (MKL promises equal bits for equal addresses modulo 64 alone): the last bits would depend on how
    long the file's header is.
    """
    return value if value.data_ptr() % ALIGNMENT == 0 else value.clone()


def finite(value: Shaped[Tensor, "..."]) -> bool:
    """One sum tells nearly always, and is several times faster than asking every number."""
    return bool(torch.isfinite(value.sum())) or bool(torch.isfinite(value).all())


def _differences(expected: Iterable[str], found: Iterable[str]) -> list[str]:
    wanted, given = set(expected), set(found)
    return [f"missing {k}" for k in wanted - given] + [f"surplus {k}" for k in given - wanted]


def _advice(preset: Preset) -> str:
    return (
        f"see `langflash weights list`, then `langflash weights get NAME` or `langflash weights import PATH` "
        f"(weights of '{preset.name}' live in {part_folder(preset)})"
    )
