"""What of a scene the photos of another scene show to be gone: by depth, and by what is there instead.

A Gaussian has gone where a photo of the other scene looks through its place at something behind that is
called otherwise or has another colour. Either alone would not do: depth of photos is off by several percent,
so walls and table tops are looked through by a little, at the same wall and the same table; and what stands
before a thing hides it without being it. Both together need no name of the thing that went.

What has gone and touches is one change. Colours are compared after the brightness of either scene's photos.
Sizes: N Gaussians, V photos, K and L atoms, S weights of each Gaussian.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Integer
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.pinhole import see
from langflash_core.geometry.rotations import turn_of
from langflash_core.inventory.alignment import Fit, Render
from langflash_core.inventory.settings import GONE
from langflash_core.inventory.things import Inventory
from langflash_core.language.settings import ANSWERING
from langflash_core.scene.instances import touching
from langflash_core.types import Scene, Semantics


@dataclass(frozen=True)
class Fate:
    """What became of each Gaussian. known: (N,) the other's photos look at its place. gone: (N,) what was
    there is not."""

    known: Bool[np.ndarray, " N"]
    gone: Bool[np.ndarray, " N"]


@dataclass(frozen=True)
class _Sight:
    """How one photo shows the places of N Gaussians. met: it shows something there. behind: how much farther
    that is, in metres; depth: of the place. cosines: of what both say. colours: (N, 3) that it shows."""

    met: Bool[np.ndarray, " N"]
    behind: Float[np.ndarray, " N"]
    depth: Float[np.ndarray, " N"]
    cosines: Float[np.ndarray, " N"]
    colours: Float[np.ndarray, "N 3"]


def fate(whose: Inventory, other: Inventory, fit: Fit, render: Render, metre: float) -> Fate:
    """What the other scene's photos show of a scene.

    Args:
        fit: from the world of `whose` to the other's. metre: in the other's unit.
    """
    world = other.world
    points = fit.placed(whose.stands) / other.scale @ turn_of(world) + np.array(world.origin)
    own = whose.scene.semantics
    unit, views = _unit(own), range(other.scene.num_views)
    sights = [_sight(other.scene, view, points, own, unit, render, other.scale / metre) for view in views]
    colours = 0.5 + SH_C0 * whose.scene.gaussians.sh[:, 0].double().numpy()
    differ = _differ(sights, colours)
    known, gone = np.zeros(len(colours), bool), np.zeros(len(colours), bool)
    for sight in sights:
        known |= sight.met & (sight.behind >= -_spare(sight, GONE.there))
        another = (sight.cosines < GONE.otherwise) | differ(sight)
        gone |= sight.met & (sight.behind > _spare(sight, GONE.behind)) & another
    return Fate(known, gone)


def _differ(sights: list[_Sight], colours: Float[np.ndarray, "N 3"]) -> Callable[[_Sight], np.ndarray]:
    """Tells (N,) whose colours a photo does not show, each channel by its brightness in both scenes."""
    there = [sight.met & (np.abs(sight.behind) <= _spare(sight, GONE.there)) for sight in sights]
    shown = np.concatenate([s.colours[same] for s, same in zip(sights, there, strict=True)])
    own = np.concatenate([colours[same] for same in there])
    gains, usual = np.ones(3), 0.0
    if len(own):
        gains = np.median(own.clip(GONE.dark), 0) / np.median(shown.clip(GONE.dark), 0)
        usual = float(np.median(np.abs(gains * shown - own).mean(1)))
    limit = max(GONE.colours[0], GONE.colours[1] * usual)
    return lambda sight: np.abs(gains * sight.colours - colours).mean(1) > limit


def _spare(sight: _Sight, how: tuple[float, float]) -> Float[np.ndarray, " N"]:
    return how[0] + how[1] * sight.depth


def _sight(
    scene: Scene,
    view: int,
    points: Float[np.ndarray, "N 3"],
    own: Semantics,
    unit: Float[np.ndarray, "N S"],
    render: Render,
    metres: float,
) -> _Sight:
    """Args:
    own, unit: what the places say. metres: per unit of the scene."""
    camera = scene.camera(view)
    frame = render(scene, camera)
    assert frame.weight_maps is not None, "render draws weight maps unless told otherwise"
    size = camera.width, camera.height
    there = see(points, camera.viewmat.double().numpy(), camera.K.double().numpy(), size)
    columns, rows = (np.where(there.inside, pixels, 0).astype(int) for pixels in (there.x, there.y))
    met = there.inside & (frame.alphas.cpu().numpy()[rows, columns] >= ANSWERING.covered_alpha)
    chosen, cosines = np.flatnonzero(met), np.zeros(len(points))
    maps = frame.weight_maps.cpu().numpy()[rows[chosen], columns[chosen]].astype(float)
    ids = own.weight_ids.numpy()[chosen]
    cosines[chosen] = _cosines(maps, scene.semantics, ids, unit[chosen], own)
    seen = frame.depths.cpu().double().numpy()[rows, columns]
    colours = frame.rgb.cpu().double().numpy()[rows, columns]
    return _Sight(met, metres * (seen - there.z), metres * np.abs(there.z), cosines, colours)


def _unit(semantics: Semantics) -> Float[np.ndarray, "N S"]:
    """The weights of each Gaussian, such that it says a vector of length 1; 0 of what says nothing."""
    gram = _gram(semantics, semantics)
    ids, weights = semantics.weight_ids.numpy(), semantics.weight_values.double().numpy()
    squares = sum(
        weights[:, s] * weights[:, t] * gram[ids[:, s], ids[:, t]]
        for s in range(ids.shape[1])
        for t in range(ids.shape[1])
    )
    return weights / np.sqrt(np.maximum(squares, 1e-24))[:, None]


def _gram(one: Semantics, other: Semantics) -> Float[np.ndarray, "K L"]:
    """Products of the words of two dictionaries."""
    ours, theirs = (np.nan_to_num(each.dictionary.double().numpy()) for each in (one, other))
    return ours @ theirs.T


def _cosines(
    maps: Float[np.ndarray, "n K"],
    shown: Semantics,
    ids: Integer[np.ndarray, "n S"],
    weights: Float[np.ndarray, "n S"],
    own: Semantics,
) -> Float[np.ndarray, " n"]:
    """Of what weight maps say of the dictionary of `shown`, and what ids and `_unit` weights say of `own`."""
    both = (np.take_along_axis(maps @ _gram(shown, own), ids, 1) * weights).sum(1)
    squares = ((maps @ _gram(shown, shown)) * maps).sum(1)
    return both / np.sqrt(squares.clip(1e-24))


def changes(found: Inventory, gone: Bool[np.ndarray, " N"]) -> list[Integer[np.ndarray, " n"]]:
    """Rows of each change, the largest first: what has gone, touches, and fills `GONE.least` of a photo."""
    starts, others = touching(found.scene.gaussians)
    both = gone[starts] & gone[others]
    graph = coo_matrix((np.ones(int(both.sum()), bool), (starts[both], others[both])), (len(gone), len(gone)))
    rows = np.flatnonzero(gone)
    numbers = np.unique(connected_components(graph, directed=False)[1][rows], return_inverse=True)[1]
    if not len(rows):
        return []
    sizes = np.stack([np.bincount(numbers, row[rows]) for row in found.shares]).max(0)
    order = np.argsort(-sizes, kind="stable")
    return [rows[numbers == number] for number in order if sizes[number] >= GONE.least]
