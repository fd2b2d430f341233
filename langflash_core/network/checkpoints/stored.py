"""Weights of our own format off the disk, as float32 arrays. Imports no torch: they are read while torch
is still being imported.

A matrix or convolution is stored as int8 with one float16 scale per output row under `<key>.scale`;
everything else is float16 (foreign files: float32, or bfloat16).
"""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Shaped
from safetensors import SafetensorError, safe_open

from langflash_core.base.resources import asset_path
from langflash_core.base.shipped import check_shipped
from langflash_core.errors import WeightsError

SCALE = ".scale"
ALIGNMENT = 64
"""Bytes. Matrix products may choose their way by the address of their numbers; every array starts on a
multiple of this, where torch itself would have put it, so that the last bits do not depend on the file."""


@dataclass(frozen=True)
class Stored:
    """arrays: float32, each on a multiple of `ALIGNMENT` bytes. header: our metadata; {}: a foreign file."""

    arrays: dict[str, Shaped[np.ndarray, "..."]]
    header: dict


def weights_file(preset: str, weights: Path | None) -> Path:
    """The file named, or the one embedded for the preset.

    Raises:
        WeightsError: none is embedded.
    """
    try:
        return Path(weights) if weights is not None else asset_path(f"weights/{preset}.safetensors")
    except FileNotFoundError as error:
        raise WeightsError(f"{error}, or name a checkpoint with --weights") from None


def read_header(path: Path) -> dict:
    """What a weights file says of itself; {} for a foreign one.

    Raises:
        WeightsError: there is none, or it is no safetensors file.
    """
    with _open_safetensors(path) as file:
        return json.loads((file.metadata() or {}).get("langflash", "{}"))


def read_stored(path: Path) -> Stored:
    """Everything in a weights file.

    Raises:
        WeightsError: there is none, it is no safetensors file, or not the one that was shipped.
    """
    check_shipped(path)
    with _open_safetensors(path) as file:
        raw = {key: _array(file, path, key) for key in file.keys()}  # noqa: SIM118 (no mapping)
        header = json.loads((file.metadata() or {}).get("langflash", "{}"))
    return Stored(dequantise_tensors(raw), header)


def dequantise_tensors(raw: Mapping[str, Shaped[np.ndarray, "..."]]) -> dict[str, Shaped[np.ndarray, "..."]]:
    """Aligned float32 arrays of what is stored: int8 rows times their scales, the rest as it is."""
    kept = {key: value for key, value in raw.items() if not _is_scale(key, raw)}
    arrays = allocate_aligned({key: value.shape for key, value in kept.items()})
    for key, value in kept.items():
        if value.dtype == np.int8:
            scale = raw[key + SCALE].astype(np.float32).reshape(-1, *[1] * (value.ndim - 1))
            np.multiply(value, scale, out=arrays[key], dtype=np.float32, casting="unsafe")
        else:
            arrays[key][...] = value
    return arrays


def allocate_aligned(shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Shaped[np.ndarray, "..."]]:
    """Float32 arrays of these shapes, not yet filled, one after the other in one piece of memory."""
    step = ALIGNMENT // np.dtype(np.float32).itemsize
    sizes = {key: math.prod(shape) for key, shape in shapes.items()}
    ends = np.cumsum([0, *(-(-size // step) * step for size in sizes.values())])
    room = np.empty(ends[-1] + step, np.float32)
    start = -room.ctypes.data % ALIGNMENT // room.itemsize
    return {
        key: room[start + place : start + place + size].reshape(shapes[key])
        for (key, size), place in zip(sizes.items(), ends[:-1], strict=True)
    }


def _is_scale(key: str, raw: Mapping[str, np.ndarray]) -> bool:
    return key.endswith(SCALE) and key.removesuffix(SCALE) in raw


@contextmanager
def _open_safetensors(path: Path) -> Iterator[Any]:
    try:
        with safe_open(str(path), framework="np") as file:
            yield file
    except FileNotFoundError:
        raise WeightsError(
            f"there is no weights file {path}; check the path or leave --weights out"
        ) from None
    except (SafetensorError, OSError, ValueError) as error:
        raise WeightsError(
            f"{path} is not a readable safetensors file ({error}); download or convert it again"
        ) from None


def _array(file: Any, path: Path, key: str) -> np.ndarray:
    if file.get_slice(key).get_dtype() != "BF16":
        return file.get_tensor(key)
    with safe_open(str(path), framework="pt") as again:  # numpy lacks that type; only foreign files have it
        return again.get_tensor(key).float().numpy()
