"""Published checkpoints to our files: read without running their code, checked, renamed.

Refused with the list: tensors that are missing, surplus, misshaped, or not finite. Surplus ones that
are known to change nothing are told instead.
"""

import pickle
import re
import struct
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Shaped
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor

from langflash_core.errors import WeightsError
from langflash_core.network.build import build_network
from langflash_core.network.checkpoints.origins import COPY, LSEG, ORIGINS, Origin
from langflash_core.network.checkpoints.pickles import read_pickle, stub_name
from langflash_core.network.presets import PointMaps, Preset

_SHOWN = 6  # names of each kind of trouble in a message
_BROKEN = (
    SafetensorError, zipfile.BadZipFile, struct.error, RuntimeError, EOFError, OSError, ValueError,
    KeyError, IndexError, TypeError, AttributeError,
)  # fmt: skip
"""What a reader of pickles and zip files may stumble over in bytes that are none."""
_CLIP_PREFIX = "clip_pretrained."
_REMEDY = "download it again, or choose another file"


@dataclass(frozen=True)
class Imported:
    """A converted checkpoint: our tensors by our names; `clip`: CLIP's own where it carries them;
    `notes`: what its user should know, a sentence each."""

    origin: Origin
    tensors: dict[str, Shaped[Tensor, "..."]]
    clip: dict[str, Shaped[Tensor, "..."]]
    notes: tuple[str, ...] = ()


def read_checkpoint(path: Path) -> dict[str, Shaped[Tensor, "..."]]:
    """The state dict of a .safetensors file, or of a pickle of plain tensors.

    Nothing in a pickle is executed, whatever it names.

    Raises:
        WeightsError: there is no such file, it cannot be read, or it holds something else.
    """
    if not path.is_file():
        raise WeightsError(f"there is no checkpoint {path}; check the path")
    if path.stat().st_size == 0:
        raise WeightsError(f"{path} is empty; {_REMEDY}")
    try:
        held = _read_safetensors(path) if path.suffix == ".safetensors" else read_pickle(path)
    except pickle.UnpicklingError as error:
        wanted = _forbidden(str(error))
        raise WeightsError(f"{path} is not a plain checkpoint{wanted}; {_REMEDY}") from None
    except _BROKEN as error:
        reason = " ".join(str(error).split())[:120]
        raise WeightsError(f"{path} is damaged or no checkpoint ({reason}); {_REMEDY}") from None
    return _state_dict(held, path)


def _read_safetensors(path: Path) -> Any:
    return load_file(str(path))


def _forbidden(message: str) -> str:
    """Which code a refused pickle wanted to run, where torch says so."""
    found = re.search(r"[Uu]nsupported (?:global: )?GLOBAL (\S+)", message)
    return _wants(found[1]) if found else ""


def _wants(name: str) -> str:
    return f": it wants to run {name}, which is not allowed"


def _state_dict(held: Any, path: Path) -> dict[str, Tensor]:
    for wrapper in ("state_dict", "model"):
        if isinstance(held, Mapping) and isinstance(held.get(wrapper), Mapping):
            held = held[wrapper]
            break
        if isinstance(held, Mapping) and (name := stub_name(held.get(wrapper))):
            raise WeightsError(f"{path} is not a plain checkpoint{_wants(name)}; {_REMEDY}")
    if not isinstance(held, Mapping) or not held:
        raise WeightsError(f"{path} holds no table of tensors; {_REMEDY}")
    strange = [str(name) for name, value in held.items() if not isinstance(value, Tensor)]
    if strange:
        raise WeightsError(f"{path} holds things that are no tensors ({_list_names(strange)}); {_REMEDY}")
    return {str(name): value for name, value in held.items()}


def recognise(state: Mapping[str, Shaped[Tensor, "..."]], path: Path) -> Origin:
    """Which published checkpoint this is.

    Raises:
        WeightsError: none that is known.
    """
    for origin in ORIGINS:
        if origin.marker in state:
            return origin
    known = ", ".join(origin.title for origin in ORIGINS)
    raise WeightsError(
        f"{path} is none of the checkpoints that can be imported: {known}; choose another file"
    )


def convert(state: Mapping[str, Shaped[Tensor, "..."]], preset: Preset, path: Path) -> Imported:
    """Our tensors of a published state dict.

    Args:
        path: for messages.

    Raises:
        WeightsError: it is of no known kind, or does not fit the preset; with the list.
    """
    state = {name.removeprefix("net."): value for name, value in state.items()}
    origin = _without_copy(recognise(state, path), state)
    wanted = _wanted_shapes(origin, preset)
    used = {origin.theirs(key)[0] for key in wanted}
    surplus = {name for name in state.keys() - used if not origin.ignores(name)}
    tolerated = sorted(filter(origin.tolerates, surplus))
    problems = {
        "missing": sorted(used - state.keys()),
        "surplus": sorted(surplus - set(tolerated)),
        "misshaped": [],
        "not finite": [],
    }
    tensors: dict[str, Tensor] = {}
    for key, shape in wanted.items():
        name, third = origin.theirs(key)
        if name not in state:
            continue
        found, whole = tuple(state[name].shape), shape if third is None else (3 * shape[0], *shape[1:])
        if found != whole:
            problems["misshaped"].append(f"{name} is {found}, expected {whole}")
        elif not bool(torch.isfinite(state[name]).all()):
            problems["not finite"].append(name)
        else:
            part = state[name] if third is None else state[name].chunk(3)[third]
            tensors[key] = part.clone() if third is not None else part.contiguous()
    _refuse(problems, origin, path)
    return Imported(origin, tensors, _clip_of(state) if origin is LSEG else {}, _unread(tolerated))


def _without_copy(origin: Origin, state: Mapping[str, Tensor]) -> Origin:
    """The origin as it is in a file from which somebody cut the copy that it carries."""
    if origin.inside is None or origin.inside.marker in state:
        return origin
    return replace(origin, modules=tuple(m for m in origin.modules if not m.startswith(COPY)), inside=None)


def _unread(names: list[str]) -> tuple[str, ...]:
    told = f"{len(names)} tensors of it are read by nobody and left out ({_list_names(names)})"
    return (told,) if names else ()


def _wanted_shapes(origin: Origin, preset: Preset) -> dict[str, tuple[int, ...]]:
    """Our tensors that this kind of checkpoint fills, and their shapes."""
    with torch.device("meta"):
        state = build_network(preset_for(preset, origin.modules)).state_dict()
    prefixes = tuple(f"{name}." for name in origin.modules)
    return {key: tuple(value.shape) for key, value in state.items() if key.startswith(prefixes)}


def preset_for(preset: Preset, modules: Iterable[str]) -> Preset:
    """The preset of a network that has these modules, copies for the grouping among them or not."""
    if not isinstance(preset, PointMaps):
        return preset
    return replace(preset, own_grouping=any(name.startswith(COPY) for name in modules))


def _refuse(problems: Mapping[str, list[str]], origin: Origin, path: Path) -> None:
    told = [
        f"{len(set(names))} {kind} ({_list_names(sorted(set(names)))})"
        for kind, names in problems.items()
        if names
    ]
    if told:
        raise WeightsError(
            f"{path} is not the {origin.title} checkpoint that this network reads: tensors "
            f"{', '.join(told)}; {_REMEDY}"
        )


def _list_names(names: list[str]) -> str:
    return ", ".join(names[:_SHOWN]) + (f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else "")


def _clip_of(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """CLIP's own state dict, which LSeg carries along."""
    return {k.removeprefix(_CLIP_PREFIX): v for k, v in state.items() if k.startswith(_CLIP_PREFIX)}
