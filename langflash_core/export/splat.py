"""antimatter15's .splat: 32 bytes a Gaussian, no header, plain colours.

Position 3 x float32, scale 3 x float32 (lengths), colour and opacity 4 x uint8, quaternion wxyz as
4 x uint8, 128 (1 + q). Colour is the degree-0 one, 0.5 + SH_C0 f_dc; higher degrees are not held.
Source: antimatter15/splat (MIT), the layout in its README and convert.py.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from langflash_core.base.files import write_atomically
from langflash_core.errors import SceneFileError
from langflash_core.export.packing import to_bytes
from langflash_core.export.settings import SPLAT_BYTES, STORED
from langflash_core.export.stored import Gathering, Rows, parts, to_scene
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.types import Gaussians, Scene

_ROW = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("quat", "u1", 4)])
_REMEDY = "export it again, or name a .ply"


def read_splat(path: Path) -> Scene:
    """A scene without language from a .splat.

    Raises:
        SceneFileError: missing, cut off, something else, or without a usable Gaussian.
    """
    size = path.stat().st_size
    if size == 0:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    if size % _ROW.itemsize:
        raise SceneFileError(
            f"{path.name} is cut off or no .splat: expected whole rows of {_ROW.itemsize} bytes, "
            f"found {size:,} bytes; {_REMEDY}"
        )
    count = size // _ROW.itemsize
    gathering, unit = Gathering(count, 1, path.name), 0
    with path.open("rb") as stream:
        for first in range(0, count, STORED.rows_at_once):
            rows = np.fromfile(stream, _ROW, min(STORED.rows_at_once, count - first))
            quats = rows["quat"].astype(np.float32) / 128 - 1
            norms = np.linalg.norm(quats, axis=1)
            usual = (
                (rows["scale"] >= 0).all(1) & (norms > SPLAT_BYTES.unit[0]) & (norms < SPLAT_BYTES.unit[1])
            )
            unit += int(usual.sum())
            colours = rows["rgba"].astype(np.float32) / 255
            sh = ((colours[:, :3] - 0.5) / SH_C0)[:, None]
            gathering.add(Rows(rows["mean"], quats, rows["scale"], colours[:, 3], sh))
    if unit < SPLAT_BYTES.plausible * count:
        raise SceneFileError(f"{path.name} is not a .splat file, whatever its name says; {_REMEDY}")
    return to_scene(gathering, path.name, [], logs=False, logits=False)


def write_splat(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene, 8 bits for colour, opacity and rotation; in the scene's own order.

    Raises:
        OutputError: the path cannot be written.
    """
    write_atomically(path, _encode(scene.gaussians))


def _encode(gaussians: Gaussians) -> Iterator[bytes]:
    for part in parts(gaussians):
        rows = np.empty(len(part.means), _ROW)
        rows["mean"], rows["scale"] = part.means, part.scales
        rows["rgba"][:, :3] = to_bytes((0.5 + SH_C0 * part.sh[:, 0]) * 255)
        rows["rgba"][:, 3] = to_bytes(part.opacities * 255)
        rows["quat"] = to_bytes(part.quats * 128 + 128)
        yield rows.tobytes()
