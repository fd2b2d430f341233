"""Gaussians between their stored forms and the activated one, in parts: large files need little memory.

3D Gaussian Splatting stores log scales, logit opacities and unnormalised quaternions wxyz.
Source: Kerbl et al. 2023.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch

from langflash_core.base.limits import GAUSSIANS
from langflash_core.base.memory import check_room
from langflash_core.errors import SceneFileError
from langflash_core.export.settings import STORED
from langflash_core.geometry.quaternions import unit_quats
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Gaussians, Scene

PLAIN, ANTIALIASED, FLAT = "default", "antialiased", "2dgs"
"""What splats were trained as, in the words of SOG."""


@dataclass(frozen=True)
class Rows:
    """Some Gaussians as a file holds them, float32: scales and opacities in whatever form it has.

    means (n, 3), quats (n, 4) wxyz of any norm, scales (n, 3), opacities (n,), sh (n, S, 3).
    """

    means: np.ndarray
    quats: np.ndarray
    scales: np.ndarray
    opacities: np.ndarray
    sh: np.ndarray

    def all(self) -> tuple[np.ndarray, ...]:
        return self.means, self.quats, self.scales, self.opacities, self.sh

    def some(self, which: slice) -> "Rows":
        """Some of the rows, not copied."""
        return Rows(*(values[which] for values in self.all()))


class Gathering:
    """N Gaussians filled in part by part; those with a number that is not finite stay out.

    An infinite logit opacity is kept, it means 0 or 1, and so is a log scale of minus infinity.
    """

    def __init__(self, most: int, num_bases: int, name: str):
        """most: Gaussians of the file called `name`.

        Raises:
            SceneFileError: a file may not hold so many, or they do not fit into the memory that is free.
        """
        GAUSSIANS.check(most, name, SceneFileError)
        check_room(most, 4 * most * (11 + 3 * num_bases), name, SceneFileError)
        shapes = ((3,), (4,), (3,), (), (num_bases, 3))
        self._rows = Rows(*(np.empty((most, *shape), np.float32) for shape in shapes))
        self._count = 0
        self.num_seen = 0

    def add(self, part: Rows) -> None:
        """Take the usable rows of a part."""
        usable = ~np.isnan(part.opacities) & (np.isfinite(part.scales) | np.isneginf(part.scales)).all(1)
        for values in (part.means, part.quats, part.sh.reshape(len(part.sh), -1)):
            usable &= np.isfinite(values).all(1)
        self.num_seen += len(usable)
        chosen = slice(None) if usable.all() else usable
        end = self._count + int(usable.sum())
        for into, values in zip(self._rows.all(), part.all(), strict=True):
            into[self._count : end] = values[chosen]
        self._count = end

    @property
    def num_dropped(self) -> int:
        """Gaussians that were not usable."""
        return self.num_seen - self._count

    def stored(self) -> Rows:
        """What was taken so far, not copied."""
        return self._rows.some(slice(self._count))


def to_scene(
    gathering: Gathering, name: str, warnings: list[str], *, logs: bool, logits: bool, model: str = PLAIN
) -> Scene:
    """The scene of gathered rows, activated in place.

    Args:
        name: of the file. logs, logits: scales and opacities are stored that way. model: `PLAIN`,
            `ANTIALIASED`, or what else the file says that its splats are; it is said where it is not plain.

    Raises:
        SceneFileError: no Gaussian is usable.
    """
    rows = gathering.stored()
    if not len(rows.means):
        raise SceneFileError(
            f"{name} holds no Gaussian that could be drawn ({gathering.num_dropped} have numbers that are "
            "not finite); export it again"
        )
    if gathering.num_dropped:
        some = f"{gathering.num_dropped:,} of {gathering.num_seen:,} Gaussians"
        warnings = [*warnings, f"{some} have numbers that are not finite; they are left out."]
    scales, opacities = torch.from_numpy(rows.scales), torch.from_numpy(rows.opacities)
    if logs:
        scales.exp_()
    if logits:
        opacities.sigmoid_()
    gaussians = Gaussians(
        means=torch.from_numpy(rows.means),
        quats=unit_quats(torch.from_numpy(rows.quats)),
        scales=scales.clamp_(STORED.smallest, STORED.largest),
        opacities=opacities.clamp_(0, 1),
        sh=torch.from_numpy(rows.sh),
    )
    if model != PLAIN:
        kinds = {ANTIALIASED: "smoothed splats", FLAT: "flat splats (2DGS)"}
        made = kinds.get(model, f"splats of a kind that is not known here ({model[:40]})")
        warnings = [*warnings, f"The scene was made for {made}, which are drawn as plain ones here."]
    scene = bare_scene(gaussians, name, tuple(warnings))
    return scene.with_record(antialiased=model == ANTIALIASED)


def parts(gaussians: Gaussians) -> Iterator[Rows]:
    """Activated rows on the CPU, `STORED.rows_at_once` at a time."""
    fields = (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh)
    for first in range(0, len(gaussians), STORED.rows_at_once):
        some = slice(first, first + STORED.rows_at_once)
        yield Rows(*(values[some].detach().cpu().float().numpy() for values in fields))


def logit(opacities: np.ndarray) -> np.ndarray:
    """Stored opacities, finite."""
    inside = np.clip(opacities.astype(np.float64), 1 - STORED.opaque, STORED.opaque)
    return np.log(inside / (1 - inside)).astype(np.float32)
