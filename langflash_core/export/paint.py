"""Frames painted by numbers on the processor: depth, atoms, one weight map, as arrays of uint8.

The window paints the same by shaders. Colours, heat-maps and label maps are in `png.py`.
"""

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import encoded
from langflash_core.export.colours import atom_colours, heat
from langflash_core.export.png import to_8bit
from langflash_core.types import Frame

Span = tuple[float, float]


def write_picture(path: Path, pixels: np.ndarray) -> None:
    """Pixels (H, W) or (H, W, 3 or 4) uint8 as a PNG, whole or not at all.

    Raises:
        OutputError: the folder cannot be made or written.
    """
    make_folder(path.parent)
    write_atomically(path, encoded(pixels, "PNG"))


def atom_picture(frame: Frame, dictionary: Tensor) -> np.ndarray:
    """(H, W, 3): every atom of the dictionary (K, C) its own colour, mixed as the splats mix them."""
    colours = atom_colours(dictionary.detach().cpu().double().numpy())
    return to_8bit(_weights(frame) @ torch.from_numpy(colours))


def weight_picture(frame: Frame, atom: int) -> np.ndarray:
    """(H, W): W_k of one atom, black 0 to white 1."""
    return to_8bit(_weights(frame)[..., atom, None].expand(-1, -1, 3))[..., 0]


def depth_picture(frame: Frame) -> tuple[np.ndarray, Span | None]:
    """(H, W, 3): near bright, far dark, linear in 1/z so that near things keep contrast; empty black.

    Returns:
        Pixels, and the depths of the first and the last colour, scene units: those of the middle 96 % of the
        pixels that show something; None where none does.
    """
    depths = frame.depths.detach().cpu().float()
    seen = depths > 0
    if not seen.any():
        return np.zeros((*depths.shape, 3), np.uint8), None
    near, far = np.percentile(depths[seen].numpy(), [2, 98])
    span = max(1 / near - 1 / max(far, near * 1.001), 1e-9)
    levels = (1 / torch.where(seen, depths, torch.tensor(far)) - 1 / far) / span
    return to_8bit(heat(levels) * seen[..., None]), (float(near), float(far))


def _weights(frame: Frame) -> Tensor:
    if frame.weight_maps is None:
        raise ValueError("frame: expected weight maps, received none")
    return frame.weight_maps.detach().cpu().float()
