"""Imported weights on disk: one safetensors file per part of the network, as published, in float.

A part's header says which modules of the network it fills. The parts of a preset live in
`weights/<preset>/` of the cache folder; a file named by the user goes before them.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file
from torch import Tensor

from langflash_core.errors import WeightsError
from langflash_core.files import written_atomically
from langflash_core.network.build import build_network
from langflash_core.network.checkpoints.importing import convert, read_checkpoint
from langflash_core.network.checkpoints.stored import ALIGNMENT
from langflash_core.network.model import LangFlashNet
from langflash_core.network.presets import Preset
from langflash_core.resources import weights_folder

FORMAT = "langflash-part-1"
CLIP_FILE = "clip_vitb32.safetensors"
_REMEDY = "import the checkpoint again with `langflash weights import`"


@dataclass(frozen=True)
class Part:
    """A file of weights: preset and modules it fills; origin and source, for people."""

    path: Path
    preset: str
    modules: tuple[str, ...]
    origin: str
    source: str


def part_folder(preset: Preset) -> Path:
    """Where the parts of a preset are kept."""
    return weights_folder() / preset.name


def installed(preset: Preset) -> list[Part]:
    """Every part in the preset's folder, by file name."""
    return [read_part(path) for path in sorted(part_folder(preset).glob("*.safetensors"))]


def install(checkpoint: Path, preset: Preset, out: Path | None = None) -> list[Path]:
    """Convert a published checkpoint; returns the files written, the part first.

    Args:
        out: where to put the part; None: the preset's folder, replacing the part of its kind.

    Raises:
        WeightsError: the checkpoint cannot be read or does not fit; nothing is written then.
        OutputError: the file cannot be written.
    """
    imported = convert(read_checkpoint(checkpoint), preset, checkpoint)
    path = out or part_folder(preset) / f"{imported.origin.part}.safetensors"
    write_part(path, imported.tensors, preset, imported.origin.title, checkpoint.name)
    if not imported.clip:
        return [path]
    clip = weights_folder() / CLIP_FILE
    with written_atomically(clip) as temporary:
        save_file({name: value.contiguous() for name, value in imported.clip.items()}, temporary)
    return [path, clip]


def write_part(
    path: Path, tensors: Mapping[str, Tensor], preset: Preset, origin: str = "", source: str = ""
) -> None:
    """Write whole modules of a network, by our names, atomically."""
    modules = sorted({name.partition(".")[0] for name in tensors})
    header = {
        "format": FORMAT, "preset": preset.name, "modules": modules, "origin": origin, "source": source,
    }  # fmt: skip
    whole = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    with written_atomically(path) as temporary:
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
        raise WeightsError(f"{path} is not a readable safetensors file ({error}); {_REMEDY}") from None
    if header.get("format") != FORMAT or not isinstance(header.get("modules"), list):
        raise WeightsError(f"{path} was not converted for this network; {_REMEDY}")
    return Part(
        path, str(header.get("preset")), tuple(header["modules"]), str(header.get("origin", "")),
        str(header.get("source", "")),
    )  # fmt: skip


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
    with torch.device("meta"):
        network = build_network(preset).eval()
    if bfloat16:
        network.use_bfloat16()
    parts = ([read_part(weights)] if weights is not None else []) + installed(preset)
    filled: set[str] = set()
    for part in parts:
        if part.preset != preset.name:
            raise WeightsError(
                f"{part.path.name} holds weights of preset '{part.preset}', not '{preset.name}'; "
                "choose --preset to match"
            )
        fresh = [name for name in part.modules if name not in filled]
        for name in fresh:
            _fill(network, name, part.path, device)
        filled.update(fresh)
    network.complete(filled, _advice(preset))
    return channels_last(network).to(device)


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
    with torch.device("meta"):
        network = build_network(preset)
    for name in read_part(path).modules:
        _fill(network, name, path, "cpu")


def _fill(network: LangFlashNet, name: str, path: Path, device: str | torch.device) -> None:
    """One module from a part, strictly."""
    module = getattr(network, name, None)
    if not isinstance(module, torch.nn.Module):
        raise WeightsError(f"{path} fills '{name}', which this network does not have; {_REMEDY}")
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
        raise WeightsError(f"{path} does not fit '{name}' ({len(problems)} tensors: {shown}); {_REMEDY}")
    module.load_state_dict(tensors, assign=True)


def on_own_address(value: Tensor) -> Tensor:
    """The same numbers where torch would have put them, on a multiple of 64 bytes.

    A tensor of a safetensors file starts at any address, and matrix products may choose their way by it
    (MKL promises equal bits for equal addresses modulo 64 alone): the last bits would depend on how
    long the file's header is.
    """
    return value if value.data_ptr() % ALIGNMENT == 0 else value.clone()


def finite(value: Tensor) -> bool:
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
