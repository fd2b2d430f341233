"""A scene cleaned up as a recipe says (`recipes.py`): which Gaussians go, and why.

Sizes: N Gaussians.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.meant import answering
from langflash_core.mending.settings import CLEANING
from langflash_core.scene.instances import disc_radii
from langflash_core.scene.joining import append_part
from langflash_core.splat.visibility import seen_shares
from langflash_core.types import Scene

from .filling import fill
from .looks import Render
from .recipes import COLOUR, Box, Recipe, Rule
from .strength import choose_removed, kind_strengths

_ALL = "everything else"


@dataclass(frozen=True)
class Cleaned:
    """rows (N,) bool: what goes. counts: how many of them for each reason, each counted once."""

    rows: Bool[np.ndarray, " N"]
    counts: Mapping[str, int]


def apply_recipe(scene: Scene, recipe: Recipe) -> Cleaned:
    """What of a scene a recipe takes away.

    Raises:
        InputError: the scene does not know what a rule asks for. PromptError: no Gaussian answers the
        phrases.
    """
    every = np.ones(len(scene.gaussians), bool)
    scope = answering(scene, recipe.within) if recipe.within else every
    reasons: dict[str, Bool[np.ndarray, " N"]] = {}
    if recipe.strength:
        found = kind_strengths(scene, every, recipe.kinds)
        reasons = {kind: choose_removed(least, recipe.strength) for kind, least in found.items()}
    for rule in recipe.rules:
        reasons[_describe_rule(rule)] = meeting(scene, rule)
    reasons = {name: rows & scope for name, rows in reasons.items()}
    if recipe.invert:
        found = np.logical_or.reduce([~every, *reasons.values()])
        reasons = {_ALL: scope & ~found}
    if recipe.crop is not None:
        reasons["outside the box"] = ~inside(scene, box_of(scene, recipe.crop, every))
    rows, counts = np.zeros(len(every), bool), {}
    for name, found in reasons.items():
        counts[name] = int((found & ~rows).sum())
        rows |= found
    return Cleaned(rows, counts)


def taken_out(scene: Scene, rows: Bool[np.ndarray, " N"], fill_with: Render | None = None) -> Scene:
    """The scene without some Gaussians; with their hole filled by what is around it, where somebody draws.

    Raises:
        InputError: nothing would be left.
    """
    if rows.all():
        raise InputError("nothing would be left of the scene; choose less")
    gone = torch.from_numpy(rows)
    left = scene.rows(~gone).with_record(num_deleted=scene.record.num_deleted + int(rows.sum()))
    return left if fill_with is None or not rows.any() else append_part(left, fill(scene, gone, fill_with))


def box_of(scene: Scene, crop: str | Box, visible: Bool[np.ndarray, " N"]) -> Box:
    """The corners of a preset: "core" holds nearly all; "room" that and the photos' places, and a little
    more."""
    if isinstance(crop, tuple):
        return crop
    means = scene.gaussians.means.detach().cpu().double().numpy()
    shown = means[visible & np.isfinite(means).all(1)]
    if not len(shown):
        raise InputError("the scene holds nothing that a box could be put around; open another")
    low, high = np.quantile(shown, CLEANING.core, axis=0), np.quantile(shown, 1 - CLEANING.core, axis=0)
    if crop == "room":
        eyes = invert_rigid(scene.viewmats.cpu().double())[:, :3, 3].numpy()
        low, high = np.minimum(low, eyes.min(0)), np.maximum(high, eyes.max(0))
        low, high = low - CLEANING.room * (high - low), high + CLEANING.room * (high - low)
    (a, b, c), (d, e, f) = low.tolist(), high.tolist()
    return a, b, c, d, e, f


def inside(scene: Scene, box: Box) -> Bool[np.ndarray, " N"]:
    """Gaussians whose centre is in a box."""
    means = scene.gaussians.means.detach().cpu().double().numpy()
    return np.all((means >= box[:3]) & (means <= box[3:]), axis=1)


def meeting(
    scene: Scene, rule: Rule, measure: Callable[[str], Float[np.ndarray, " N"]] | None = None
) -> Bool[np.ndarray, " N"]:
    """Gaussians of which all conditions of a rule hold.

    Args:
        measure: `measure_gaussians` of the scene by name, where they are remembered; None: measured here.

    Raises:
        InputError: the scene does not know what a condition asks for.
    """
    rows = np.ones(len(scene.gaussians), bool)
    for name, limits in rule.items():
        if name == COLOUR:
            *shade, off = np.array(limits, float)
            colours = 0.5 + SH_C0 * scene.gaussians.sh[:, 0].detach().cpu().double().numpy()
            rows &= (abs(colours - shade) <= off).all(1)
            continue
        values, (low, high) = measure_gaussians(scene, name) if measure is None else measure(name), limits
        rows &= (values > (-np.inf if low is None else low)) & (values < (np.inf if high is None else high))
    return rows


def measure_gaussians(scene: Scene, name: str) -> Float[np.ndarray, " N"]:
    """One of `MEASURES` of each Gaussian, in its units.

    Raises:
        InputError: the scene does not know it.
    """
    match name:
        case "opacity":
            return scene.gaussians.opacities.detach().cpu().double().numpy()
        case "size":
            return disc_radii(scene.gaussians)
        case "depth":
            eyes = invert_rigid(scene.viewmats.cpu().double())[:, :3, 3]
            return torch.cdist(scene.gaussians.means.cpu().double(), eyes).amin(1).numpy()
        case "photos":
            pixels = scene.view_size[0] * scene.view_size[1]
            return (seen_shares(scene) * pixels >= CLEANING.seen).sum(0).double().numpy()
    if scene.confidences is None:
        raise InputError(
            "this scene does not say how sure its depth is; leave the condition on confidence out"
        )
    return scene.confidences.cpu().double().numpy()


def _describe_rule(rule: Rule) -> str:
    """A rule for people."""
    parts = []
    for name, limits in rule.items():
        if name == COLOUR:
            parts.append(name)
            continue
        bounds = zip("><", limits, strict=True)
        parts += [f"{name} {sign} {limit:g}" for sign, limit in bounds if limit is not None]
    return " and ".join(parts)
