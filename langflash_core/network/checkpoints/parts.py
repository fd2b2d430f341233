"""Parts: imported weights on disk, one safetensors file each, as published, in float.

A part's header says which modules of the network it fills, and what it was made from. The parts of a preset
live in `weights/<preset>/` of the cache folder.

The *trunk* is what all heads read: encoder and decoder. A grouping is good for the trunk it was trained on
alone, so parts remember trunks by fingerprints of their numbers.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import torch
from jaxtyping import Shaped
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from langflash_core.base.files import written_atomically
from langflash_core.base.resources import weights_folder
from langflash_core.errors import WeightsError
from langflash_core.network.checkpoints.catalogue import trained_side
from langflash_core.network.checkpoints.origins import COPY
from langflash_core.network.presets import PointMaps, Preset

FORMAT = "langflash-part-1"
REMEDY = "import the checkpoint again with `langflash weights import`"
TRUNK = ("encoder", "decoder")
TRAINED_HERE = "trained here"
"""As an origin."""


@dataclass(frozen=True)
class Part:
    """A file of weights: preset and modules it fills; origin and source, for people.

    side: pixels a side of the photos it was trained on; 0: unknown. trunk: fingerprint of the encoder and
    decoder in it; "": it holds none. reads: that of the trunk its grouping was trained on; "": it holds
    no grouping, or nobody knows. filtered: its grouping's scores are for the preset's filter of masks; else
    they are existence.
    """

    path: Path
    preset: str
    modules: tuple[str, ...]
    origin: str = ""
    source: str = ""
    side: int = 0
    trunk: str = ""
    reads: str = ""
    filtered: bool = True

    @property
    def copies(self) -> tuple[str, ...]:
        """Its modules that the grouping alone reads."""
        return tuple(name for name in self.modules if name.startswith(COPY))


def part_folder(preset: Preset) -> Path:
    """Where the parts of a preset are kept."""
    return weights_folder() / preset.name


def installed_parts(preset: Preset) -> list[Part]:
    """Every part in the preset's folder, by file name."""
    return [read_part(path) for path in sorted(part_folder(preset).glob("*.safetensors"))]


def write_part(
    path: Path,
    tensors: Mapping[str, Shaped[Tensor, "..."]],
    preset: Preset,
    origin: str = "",
    source: str = "",
    *,
    side: int = 0,
    reads: str = "",
) -> None:
    """Write whole modules of a network, by our names, atomically.

    Args:
        side: pixels a side of the photos they were trained on.
        reads: fingerprint of the trunk that the grouping was trained on, where `tensors` hold neither
            a trunk nor a copy of one for the grouping.
    """
    modules = sorted({name.partition(".")[0] for name in tensors})
    trunk = fingerprint(tensors)
    if "grouping" in modules:
        reads = fingerprint(tensors, COPY) or trunk or reads
    header = {
        "format": FORMAT, "preset": preset.name, "modules": modules, "origin": origin, "source": source,
        "side": side, "trunk": trunk, "reads": reads,
        "filtered": isinstance(preset, PointMaps) and preset.mask_filter is not None,
    }  # fmt: skip
    whole = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    with written_atomically(path, SafetensorError) as temporary:
        save_file(whole, temporary, {"langflash": json.dumps(header)})


def read_part(path: Path) -> Part:
    """The header of a part.

    Raises:
        WeightsError: the file is missing, damaged, or no part.
    """
    try:
        with safe_open(str(path), framework="pt") as file:
            header = json.loads((file.metadata() or {}).get("langflash", "{}"))
    except FileNotFoundError:
        raise WeightsError(f"there is no weights file {path}; check the path") from None
    except (SafetensorError, OSError, ValueError) as error:
        raise WeightsError(f"{path} is not a readable safetensors file ({error}); {REMEDY}") from None
    if header.get("format") != FORMAT or not isinstance(header.get("modules"), list):
        raise WeightsError(f"{path} was not converted for this network; {REMEDY}")
    source = str(header.get("source", ""))
    side = header.get("side", trained_side(source))  # older parts say nothing but their source
    return Part(
        path, str(header.get("preset")), tuple(header["modules"]), str(header.get("origin", "")), source,
        side if isinstance(side, int) else 0, str(header.get("trunk", "")), str(header.get("reads", "")),
        bool(header.get("filtered", True)),
    )  # fmt: skip


def fingerprint(tensors: Mapping[str, Shaped[Tensor, "..."]], prefix: str = "") -> str:
    """Of the trunk among tensors by our names, `prefix` before them; alike where their float32 values are.

    Returns:
        32 hexadecimal digits; "" where encoder or decoder is missing.
    """
    own = {k.removeprefix(prefix): k for k in tensors if _module(k) in {prefix + name for name in TRUNK}}
    if {_module(name) for name in own} != set(TRUNK):
        return ""
    return digest({name: tensors[key] for name, key in own.items()})


def digest(tensors: Mapping[str, Shaped[Tensor, "..."]]) -> str:
    """Of names and float32 values, 32 hexadecimal digits."""
    whole = hashlib.sha256()
    for name in sorted(tensors):
        whole.update(name.encode())
        numbers = tensors[name].detach().cpu().to(torch.float32).contiguous()
        whole.update(numbers.flatten().view(torch.uint8).numpy().data)
    return whole.hexdigest()[:32]


def read_tensors(part: Part, modules: Iterable[str]) -> dict[str, Shaped[Tensor, "..."]]:
    """Some modules of a part, mapped from the disk, by their whole names."""
    wanted = set(modules)
    with safe_open(str(part.path), framework="pt") as file:
        return {key: file.get_tensor(key) for key in file.keys() if _module(key) in wanted}  # noqa: SIM118


def _module(name: str) -> str:
    return name.partition(".")[0]
