"""Layers of another scene of the same world put into a scene: photos more for a room that is finished.

Both have some of the same photos. Each scene brings its photos p to one light, c = g p + o, so that a photo
of both gives c = (g / g') (c' - o') + o for colours c' of the other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.scene.joining import append_layers
from langflash_core.surface.prune import sparser
from langflash_core.types import Gaussians, Scene


@dataclass(frozen=True)
class Shared:
    """Photos that two scenes have: their numbers in the first (`ours`) and in the other (`theirs`)."""

    ours: tuple[int, ...]
    theirs: tuple[int, ...]


def add_layers(first: Scene, other: Scene, shared: Shared) -> Scene:
    """The first scene with the layers of the other's photos that are not shared, behind its own.

    Names and edits are the first's. What a layer weighs are atoms of the other, which follow the first's.

    Args:
        first, other: of layers, in one world and unit, of one language space and one size of views.

    Raises:
        InputError: they speak different languages, or have too many atoms together.
        ValueError: their views have other sizes.
    """
    if first.view_size != other.view_size:
        raise ValueError(f"other: expected views of {first.view_size}, received {other.view_size}")
    new = [view for view in range(other.num_views) if view not in shared.theirs]
    part, light = _layers_of(other, new), _common_light(first, other, shared)
    part = replace(part, gaussians=light.of_colours(part.gaussians))
    return append_layers(first, part).with_record(**_records(first, other, new, shared, light))


def _layers_of(scene: Scene, views: Sequence[int]) -> Scene:
    """What some photos made, as a scene of theirs alone, with the atoms that it needs."""
    assert scene.view_ids is not None, "scenes of layers know which photo made what"
    numbers = torch.full((scene.num_views,), -1)
    numbers[list(views)] = torch.arange(len(views))
    part = sparser(scene.rows((scene.view_ids >= 0) & (numbers[scene.view_ids] >= 0)))
    assert part.view_ids is not None, "rows keep them"
    return replace(
        part,
        view_ids=numbers[part.view_ids],
        viewmats=part.viewmats[list(views)],
        Ks=part.Ks[list(views)],
        photos=tuple(part.photos[view] for view in views),
        record=replace(part.record, light={}),
    )


@dataclass(frozen=True)
class _Light:
    """c = gain c' + offset, from the other's light to the first's (3,), float64; lights of the first's photos
    and of the other's, rows of gains and offsets."""

    gain: np.ndarray
    offset: np.ndarray
    first: tuple[np.ndarray, np.ndarray]
    other: tuple[np.ndarray, np.ndarray]

    def of_colours(self, gaussians: Gaussians) -> Gaussians:
        gain, offset = (torch.from_numpy(part).to(gaussians.sh) for part in (self.gain, self.offset))
        sh = gaussians.sh * gain
        sh[:, 0] += (0.5 * gain + offset - 0.5) / SH_C0
        return replace(gaussians, sh=sh)

    def stored(self, new: Sequence[int]) -> dict[str, list]:
        """Of all photos, as `Record.light` has it."""
        gains, offsets = (part[list(new)] for part in self.other)
        return {
            "gains": np.concatenate((self.first[0], self.gain * gains)).round(6).tolist(),
            "offsets": np.concatenate((self.first[1], self.gain * offsets + self.offset)).round(6).tolist(),
        }


def _common_light(first: Scene, other: Scene, shared: Shared) -> _Light:
    """By what the shared photos say in the mean, gains as logarithms."""
    ours, theirs = _light_of(first), _light_of(other)
    gains, offsets = (part[list(shared.ours)] for part in ours)
    their_gains, their_offsets = (part[list(shared.theirs)] for part in theirs)
    gain = np.exp(np.log(gains / their_gains).mean(0))
    return _Light(gain, (offsets - gain * their_offsets).mean(0), ours, theirs)


def _light_of(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Gains and offsets (V, 3) of a scene's photos; of one light where the record says nothing."""
    light = scene.record.light
    if not light:
        return np.ones((scene.num_views, 3)), np.zeros((scene.num_views, 3))
    return np.array(light["gains"], np.float64), np.array(light["offsets"], np.float64)


def _records(first: Scene, other: Scene, new: Sequence[int], shared: Shared, light: _Light) -> dict[str, Any]:
    """What the record says of photos one by one, of all of them; rows that one of both lacks go."""
    ours, theirs = first.record, other.record
    names = [theirs.photos[view] for view in new]
    numbers = dict(zip(shared.theirs, shared.ours, strict=True))
    numbers |= {view: first.num_views + place for place, view in enumerate(new)}
    seen = {**theirs.foreseen, "nearest": [numbers[view] for view in theirs.foreseen.get("nearest", ())]}
    shares = [record.left_out.get("shares") or [0.0] * len(record.photos) for record in (ours, theirs)]
    shares = [*shares[0], *(shares[1][view] for view in new)]
    left_out = {name: value for name, value in ours.left_out.items() if name != "shares"}
    return {
        "photos": (*ours.photos, *names),
        "warnings": (*ours.warnings, *(line for line in theirs.warnings if line not in ours.warnings)),
        "light": light.stored(new) if ours.light or theirs.light else {},
        "foreseen": _with_rows(ours.foreseen, seen, ("covered", "alike", "nearest"), new),
        "left_out": left_out | ({"shares": shares} if any(shares) else {}),
        "detail": _with_rows(ours.detail, theirs.detail, ("photos_psnr_db",), new),
    }


def _with_rows(
    ours: Mapping[str, Any], theirs: Mapping[str, Any], names: Sequence[str], new: Sequence[int]
) -> dict[str, Any]:
    """With the new photos' numbers behind those of ours."""
    both = {
        name: [*ours[name], *(theirs[name][view] for view in new)]
        for name in names
        if ours.get(name) and theirs.get(name)
    }
    return {name: value for name, value in ours.items() if name not in names} | both
