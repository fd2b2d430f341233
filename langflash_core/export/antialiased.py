"""Splats that were trained to be drawn antialiased, and what says so in splat files.

Such splats are dimmed by how much the filter of a pixel widens them (Yu et al. 2024, Mip-Splatting): drawn
as plain ones they are too strong where they are thin. This program draws plain ones, says so, and keeps the
mark for programs that do both.

Marks: a PLY's comment `SplatRenderMode: mip` (Brush) or `antialiased 1` (Postshot), the last one wins; a
SOG's `"model": "antialiased"`; a bit of a .spz; and the property `filter_3D` of Mip-Splatting's own PLY.
Source: the formats as Brush, gsplat, splat-transform and Mip-Splatting write them.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from langflash_core.export.stored import ANTIALIASED, FLAT, PLAIN, Rows, logit
from langflash_core.types import Scene

_FILTER = "filter_3d"
_MARK = re.compile(rb"^comment[ \t]+(?:splatrendermode:[ \t]*(\S+)|antialiased[ \t]+([01]))\s*$", re.I | re.M)
_MODELS = {"mip": ANTIALIASED, "1": ANTIALIASED, "0": PLAIN}  # by what the comments say, where it differs
_MOST_HEADER = 1 << 16  # bytes


def ply_model(path: Path) -> str:
    """What the comments of a .ply's header say that its splats are, as `to_scene` takes it."""
    with path.open("rb") as stream:
        header = stream.read(_MOST_HEADER).split(b"\nend_header", 1)[0]
    marks = [b"".join(mark).decode("latin-1").lower() for mark in _MARK.findall(header)]
    model = _MODELS.get(marks[-1], marks[-1]) if marks else PLAIN
    return PLAIN if model == FLAT and b" scale_2" not in header else model  # flat is then how it is read


def ply_comments(scene: Scene) -> list[str]:
    """The lines of a PLY's header that say what the scene's splats are."""
    return ["comment SplatRenderMode: mip"] if scene.record.antialiased else []


def filter_of(names: tuple[str, ...] | None) -> str | None:
    """Which of a PLY's properties is Mip-Splatting's 3D filter; None: there is none."""
    return next((name for name in names or () if name.lower() == _FILTER), None)


def apply_filter(rows: Rows, radii: np.ndarray) -> Rows:
    """Stored rows as Mip-Splatting draws them: s'^2 = s^2 + f^2, o' = o prod(s / s'), of each Gaussian.

    Args:
        rows: log scales, logit opacities. radii: f (n,), scene units; 0 changes nothing.
    """
    squares = np.square(radii.astype(np.float64))[:, None]
    with np.errstate(all="ignore"):  # rows that are not finite stay out
        logs = rows.scales.astype(np.float64)
        wider = np.where(squares > 0, np.logaddexp(2 * logs, np.log(squares)) / 2, logs + squares)
        opacities = np.exp((logs - wider).sum(1)) / (1 + np.exp(-rows.opacities.astype(np.float64)))
        changed = np.where(squares[:, 0] == 0, rows.opacities, logit(opacities))
    return replace(rows, scales=wider.astype(np.float32), opacities=changed.astype(np.float32))
