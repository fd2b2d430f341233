"""`scene.langflash`: one safetensors file, no pickle, whole or refused.

The safetensors header's `__metadata__` holds four strings: `format` ("langflash-scene"),
`version`, `scene` (JSON: space, view_size, metadata) and `digest`, the SHA-256 of the JSON
and of every tensor with its name, type and shape. Tensors: `fields.py`; `metadata`: `record.py`.

Equal scenes give equal bytes: the header is in one order, and nothing of the run that made the
scene is in the file. Version 1 said in its metadata how many Gaussians each view made, where
version 2 has the tensor `view_ids`, and held what the run cost. Version 3 has the tensors `levels` and
`confidences`, either or both; a scene without them is written as version 2, which older programs read, where
they refuse one of version 3 with a sentence that says so.
"""

import json
from dataclasses import replace
from pathlib import Path

import safetensors.torch
import torch
from torch import Tensor

from langflash_core.base.files import write_atomically
from langflash_core.base.memory import out_of_memory
from langflash_core.scene.checks import check_scene
from langflash_core.scene.container import FORMAT, VERSION, damage_error, digest, in_order, read_container
from langflash_core.scene.fields import NEWER, from_fields, to_fields
from langflash_core.scene.record import counts_per_view, from_json, to_json
from langflash_core.types import Scene


def save(scene: Scene, path: Path | str) -> None:
    """Write a scene; the file is whole or not there.

    Raises:
        OutputError: the path cannot be written.
        ValueError: the scene is not whole (`check_scene`), or its record is not plain JSON.
    """
    check_scene(scene)
    fields = to_fields(scene)
    described = {
        "space": scene.semantics.space,
        "view_size": scene.view_size,
        "metadata": to_json(scene.record),
    }
    text = json.dumps(described, allow_nan=False)
    version = VERSION if any(name in fields for name in NEWER) else 2
    header = {"format": FORMAT, "version": str(version), "scene": text, "digest": _digest(text, fields)}
    write_atomically(Path(path), in_order(safetensors.torch.save(fields, header)))


def load(path: Path | str) -> Scene:
    """Read a scene onto the CPU.

    Raises:
        SceneFileError: missing, truncated, damaged, foreign, or of a newer version; says what was
            expected and what was found.
    """
    path = Path(path)
    found = read_container(path)
    try:
        fields = {name: torch.from_numpy(array) for name, array in found.arrays.items()}
        width, height = found.view_size
        scene = from_fields(fields, found.space, (width, height), from_json(found.metadata))
        if found.version == 1:
            scene = replace(scene, view_ids=_view_ids(scene, counts_per_view(found.metadata)))
        check_scene(scene)
    except (ValueError, LookupError, TypeError, RuntimeError, ArithmeticError) as error:
        if out_of_memory(error):
            raise
        raise damage_error(path, error) from error
    return scene


def _view_ids(scene: Scene, counts: list[int]) -> Tensor | None:
    """(N,) of Gaussians in the order of the views that made them; None where the counts do not fit."""
    if len(counts) != scene.num_views or sum(counts) != len(scene.gaussians):
        return None
    return torch.arange(len(counts)).repeat_interleave(torch.tensor(counts))


def _digest(text: str, fields: dict[str, Tensor]) -> str:
    return digest(text, {name: values.numpy() for name, values in fields.items()})
