"""Depth maps as numbers: 16-bit PNG, and EXR in 32-bit floats.

Depth is z, along the viewing direction (not along the ray), in metres where the scene's scale is known,
else in scene units; 0 where a pixel shows nothing. A PNG holds whole steps of a length that is said in the
file (text chunks `step` and `unit`: depth = value * step), an EXR the lengths themselves (channel `Z`,
attributes `unit` and `langflash`). Row 0 is the top.
"""

import math
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL.PngImagePlugin import PngInfo

from langflash_core.base.files import write_atomically, written_atomically
from langflash_core.base.optional import optional_packages
from langflash_core.base.picture_files import encoded
from langflash_core.export.settings import DEPTH_FILE
from langflash_core.types import Frame

LARGEST = 2**16 - 1  # of a pixel of 16 bits


def lengths(frame: Frame, metric_scale: float | None) -> Float[np.ndarray, "H W"]:
    """Depths of a view in metres or scene units, 0 where less than half of a pixel is covered."""
    depths = frame.depths.detach().cpu().double().numpy() * (metric_scale or 1.0)
    return np.where((frame.alphas.cpu().numpy() >= DEPTH_FILE.covered) & np.isfinite(depths), depths, 0.0)


def unit_name(metric_scale: float | None) -> str:
    """`m`, or `scene` where the scale is not known."""
    return "m" if metric_scale else "scene"


def fitting_step(longest: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten, so that `longest` fits into 16 bits."""
    if not longest > 0:
        return 1e-4
    exact = longest / LARGEST
    power = math.floor(math.log10(exact))
    steps = [float(f"{first}e{power + more}") for more in (0, 1) for first in (1, 2, 5)]
    return next(step for step in steps if step >= exact)


def write_depth_png(path: Path, depths: Float[np.ndarray, "H W"], step: float, unit: str) -> None:
    """Depths as whole steps, rounded; what is seen is at least 1, what does not fit is the largest.

    Raises:
        OutputError: the path cannot be written.
    """
    counts = np.where(depths > 0, np.clip(np.rint(depths / step), 1, LARGEST), 0).astype(np.uint16)
    said = PngInfo()
    said.add_text("step", f"{step:g}")
    said.add_text("unit", unit)
    write_atomically(path, encoded(counts, "PNG", pnginfo=said))


def write_depth_exr(path: Path, depths: Float[np.ndarray, "H W"], unit: str) -> None:
    """Depths as they are, float32, losslessly packed.

    Raises:
        MissingPackageError: OpenEXR is not installed. OutputError: the path cannot be written.
    """
    with optional_packages():
        import OpenEXR  # pyright: ignore[reportMissingImports]
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "unit": unit,
        "langflash": "Z is depth along the viewing direction, 0 is nothing",
    }
    channels = {"Z": np.ascontiguousarray(depths, np.float32)}
    with written_atomically(path) as place:
        OpenEXR.File(header, channels).write(str(place))
