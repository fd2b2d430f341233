"""What a click can mean: a scene as a tree of regions, from parts over things to groups of things.

Every photo is a grid of nodes, one a pixel; a Gaussian that no photo made is a node of its own. Nodes are
neighbours side by side in their photo, or where two photos show the same place, or where they touch. Leaves
are neighbours of one atom and one colour between which depth does not jump. Then those two regions are
joined, again and again, that differ least, which makes a tree. Of regions a and b

    (language (1 - cos(F_a, F_b)) + colour |c_a - c_b| + jump j_ab + alone (1 - o_ab)) s^(1/4)

is what they differ by, with the weights of `REGIONS`: F what a region means, c its mean colour, j_ab the
share of their common border along which depth jumps (where two photos show the same place it does not), o_ab
the overlap of two that no photo shows side by side, s the smaller one's share of the photos that show it. A
region's height is the difference that made it, and its border holds from there up to the height of the next
one. Of the regions around it a click takes the one whose border holds longest, as a ratio, within
`REGIONS.thing`; somewhat rather one of a single atom, and one that the next is much larger than. Less and
more of it goes in steps of `REGIONS.steps`, to the regions in reach whose borders hold longest; where the one
around is too large for a step, what touches most is added of it, piece by piece.

Pairs that are each other's nearest are joined at once, which gives the same tree as one pair after the other
where no two come nearer to a third by being joined (Bruynooghe 1978), so nearly the same here.

Sizes: N Gaussians, V photos, H W pixels of a grid, K atoms, n nodes, k regions, m pairs, t regions of a tree.
"""

import math
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, Integer
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_matrix, csr_array
from scipy.sparse.csgraph import connected_components

from langflash_core.geometry.cameras import invert_rigid, world_points
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.surfels import covered_areas
from langflash_core.rig.projected import project_points
from langflash_core.scene.instances import touching
from langflash_core.scene.selection import strongest_atoms
from langflash_core.scene.settings import REGIONS
from langflash_core.types import Scene


@dataclass(frozen=True)
class Reach:
    """What one click can mean. joins: (N,) the first level that each Gaussian is of, counted from 0, the
    smallest; `count` of what is of none. chosen: the level that is one thing."""

    joins: Integer[np.ndarray, " N"] = field(repr=False)
    count: int
    chosen: int

    def rows(self, level: int) -> Bool[np.ndarray, " N"]:
        """The Gaussians of a level."""
        return self.joins <= min(max(level, 0), self.count - 1)


@dataclass(frozen=True)
class Regions:
    """The tree. leaves: (N,) the region that each Gaussian is of, -1 of none. parents: (t,) what a region is
    part of, always a later one; -1 of none. heights: (t,), no less than those of its parts. sizes: (t,) sums
    of shares of photos. atoms: (k,) of the first regions, the leaves; -1 of none. contacts (k, k): along
    how many pixels leaves meet, without a jump or as two photos show the same place; overlaps (k, k): the
    latter alone; shares of a photo."""

    leaves: Integer[np.ndarray, " N"] = field(repr=False)
    parents: Integer[np.ndarray, " t"] = field(repr=False)
    heights: Float[np.ndarray, " t"] = field(repr=False)
    sizes: Float[np.ndarray, " t"] = field(repr=False)
    atoms: Integer[np.ndarray, " k"] = field(repr=False)
    contacts: csr_array = field(repr=False)
    overlaps: csr_array = field(repr=False)

    def around(self, seen: Bool[np.ndarray, " N"]) -> Reach | None:
        """What a click can mean that shows some Gaussians; None where they are of nothing.

        Args:
            seen: a few, most of them of what was meant.
        """
        own = self.leaves[seen & (self.leaves >= 0)]
        if not len(own):
            return None
        way = [int(np.bincount(own).argmax())]
        while self.parents[way[-1]] >= 0:
            way.append(int(self.parents[way[-1]]))
        thing = self._thing(way)
        less, more = self._less(way[: thing + 1]), self._more(way[thing:])
        levels = [self._leaves_of(region) for region in less] + more
        joins = np.full(len(self.atoms) + 1, len(levels))
        for level in reversed(range(len(levels))):
            joins[:-1][levels[level]] = level
        return Reach(joins[self.leaves], len(levels), len(less))

    def _leaves_of(self, region: int) -> Bool[np.ndarray, " k"]:
        """Which leaves are of a region."""
        found, count, level = np.zeros(len(self.atoms), bool), len(self.atoms), np.array([region])
        while len(level):
            found[level[level < count]] = True
            level = self.parts[level[level >= count] - count].ravel()
        return found

    @cached_property
    def counts(self) -> Integer[np.ndarray, " t"]:
        """How many Gaussians are of each region."""
        own = np.bincount(self.leaves[self.leaves >= 0], minlength=len(self.parents)).tolist()
        for region, parent in enumerate(self.parents.tolist()):  # parents come later
            if parent >= 0:
                own[parent] += own[region]
        return np.array(own)

    @cached_property
    def parts(self) -> Integer[np.ndarray, "j 2"]:
        """The two regions that each one is joined of that is no leaf."""
        some = np.flatnonzero(self.parents >= 0)
        return some[np.argsort(self.parents[some], kind="stable")].reshape(-1, 2)

    def _steps(self, levels: list[int]) -> Integer[np.ndarray, " t"]:
        """Of each region the first level that it is part of; as many as there are, of what is of none."""
        steps, parents = [len(levels)] * len(self.parents), self.parents.tolist()
        for step, region in enumerate(levels):
            steps[region] = step
        for region in range(levels[-1] - 1, -1, -1):  # parents come later
            above = steps[parents[region]] if parents[region] >= 0 else len(levels)
            steps[region] = above if above < steps[region] else steps[region]
        return np.array(steps)

    def _thing(self, way: list[int]) -> int:
        """Which region of the way from a leaf up is a thing."""
        low, high = REGIONS.thing
        heights, sizes = self.heights[way], self.sizes[way]
        ends = np.append(heights[1:], np.inf)
        lives = np.minimum(ends, high) / np.maximum(heights, low)
        large = sizes >= REGIONS.least_thing
        lives[(heights > high) | (ends < low) | ~large] = 0.0
        grows = np.minimum(np.append(sizes[1:] / sizes[:-1], 1.0), REGIONS.most_growth)
        likely = lives * grows**REGIONS.growth * self._alike(way) ** REGIONS.of_one
        return int(likely.argmax() if likely.any() else large.argmax())

    def _alike(self, way: list[int]) -> Float[np.ndarray, " w"]:
        """Shares of the regions of a way that are of its leaf's atom."""
        leaves = len(self.atoms)
        same = self.atoms == self.atoms[way[0]]
        steps = self._steps(way)[:leaves]
        own = np.bincount(steps[same], self.sizes[:leaves][same], len(way) + 1)[: len(way)]
        return own.cumsum() / self.sizes[way]

    def _less(self, way: list[int]) -> list[int]:
        """Parts of the last region of a way, the smallest first, each clearly smaller than the next one."""
        low, high = REGIONS.steps
        sizes, found = self.sizes[way], [len(way) - 1]
        while True:
            shares = sizes[: found[0]] / sizes[found[0]]
            some = np.flatnonzero((shares * low <= 1) & (sizes[: found[0]] >= REGIONS.least_thing))
            if not len(some):
                return [way[place] for place in found[:-1]]
            near = some[shares[some] * high >= 1]
            found.insert(0, int(near[self._lives(way)[near].argmax()] if len(near) else some[-1]))

    def _more(self, way: list[int]) -> list[Bool[np.ndarray, " k"]]:
        """The first region of a way and what it is part of, each clearly larger than the one before, and no
        larger than people follow: (k,) leaves."""
        low, high = REGIONS.steps
        most = REGIONS.all * self.counts[self.parents < 0].sum()
        levels, above = [self._leaves_of(way[0])], self._above([way[0]], np.zeros(len(self.parents), bool))
        sizes, lives = self.counts[way], self._lives(way)
        while True:
            size = self.counts[: len(self.atoms)][levels[-1]].sum()
            near = np.flatnonzero((sizes >= low * size) & (sizes <= min(high * size, most)))
            more = None
            if not len(near):
                more = self._onward(levels[-1], above, low * size, min(high * size, most))
            if not len(near) and more is None:
                near = np.flatnonzero((sizes > size) & (sizes <= min(REGIONS.leap * size, most)))[:1]
            if len(near):
                around = way[int(near[lives[near].argmax()])]
                more = levels[-1] | self._leaves_of(around)
                above = self._above([around], above)
            if more is None:
                return levels
            levels.append(more)

    def _lives(self, way: list[int]) -> Float[np.ndarray, " w"]:
        """How long the borders of the regions of a way hold, as ratios; what nothing holds holds longest."""
        heights = np.maximum(self.heights[way], 1e-9)
        return np.append(heights[1:], np.inf) / heights

    def _onward(
        self, inside: Bool[np.ndarray, " k"], above: Bool[np.ndarray, " t"], least: float, most: float
    ) -> Bool[np.ndarray, " k"] | None:
        """Leaves with what is beside them that they touch most, until they are so many Gaussians; None where
        that is too large. above: the regions that they are part of; those of the new ones are added."""
        inside, small, came = inside.copy(), self.counts[: len(self.atoms)], np.flatnonzero(inside)
        areas, (touch, shared) = self.sizes[: len(small)], np.zeros((2, len(small)))
        while (size := small[inside].sum()) < least:
            touch += self.contacts[came].sum(0)
            room = (most - size) / 2  # the rest is for what other photos show of it
            beside = np.where(inside | (small > room), 0, touch)
            if not beside.any():
                return None
            new = int(beside.argmax())
            while (up := self.parents[new]) >= 0 and not above[up] and self.counts[up] <= room:
                new = int(up)
            own = np.flatnonzero(self._leaves_of(new))
            shared += self.overlaps[np.append(came, own)].sum(0)
            inside[own] = True
            twins = np.flatnonzero((shared >= REGIONS.twin * areas) & ~inside)
            twins = twins[np.argsort(-shared[twins] / areas[twins], kind="stable")]
            twins = twins[small[twins].cumsum() <= most - size - self.counts[new]]
            shared += self.overlaps[twins].sum(0)
            inside[twins] = True
            self._above([new, *twins.tolist()], above)
            came = np.append(own, twins)
        return inside

    def _above(self, regions: list[int], held: Bool[np.ndarray, " t"]) -> Bool[np.ndarray, " t"]:
        """What regions are part of, into what is held."""
        for region in regions:
            while (region := self.parents[region]) >= 0 and not held[region]:
                held[region] = True
        return held


def regions_of(scene: Scene) -> Regions:
    """The tree of a scene. Linear in Gaussians and pixels of all grids."""
    *_, tree = regions_in_steps(scene)
    assert isinstance(tree, Regions)
    return tree


@torch.no_grad()
def regions_in_steps(scene: Scene) -> Iterator[float | Regions]:
    """The same at the end; before, shares of the work that are done."""
    nodes = yield from _Nodes.of(scene)
    if not len(nodes.atoms):
        none, zero, alone = np.zeros(0, int), np.zeros(0), csr_array((0, 0))
        yield Regions(nodes.own, none, zero, zero, none, alone, alone)
        return
    first, second = nodes.pairs
    near = np.linalg.norm(nodes.colours[first] - nodes.colours[second], axis=1) < REGIONS.shade
    same = near & (nodes.atoms[first] == nodes.atoms[second]) & (nodes.jumps < 0.5) & nodes.beside
    leaves = _label_components(first[same], second[same], len(nodes.atoms))
    joining = _Joining.of(nodes, leaves, _meaning(scene))
    (first, second), shape = joining.ends, (len(joining.sizes), len(joining.sizes))
    both, pixels = (np.append(first, second), np.append(second, first)), math.prod(scene.view_size)
    lengths = joining.borders - joining.jumps + joining.overlaps, joining.overlaps
    meet = [csr_array((np.tile(each / pixels, 2).astype(np.float32), both), shape) for each in lengths]
    tree = yield from joining.done()
    atoms = np.full(int(leaves.max()) + 1, -1)
    atoms[leaves] = nodes.atoms
    yield Regions(np.append(leaves, -1)[nodes.own], *tree, atoms, *meet)


def _label_components(first: np.ndarray, second: np.ndarray, count: int) -> Integer[np.ndarray, " n"]:
    """Numbers from 0 of what is connected by pairs."""
    graph = coo_matrix((np.ones(len(first), bool), (first, second)), (count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _meaning(scene: Scene) -> Float[np.ndarray, "K r"]:
    """The dictionary in as few numbers as its atoms' cosines need."""
    atoms = scene.semantics.dictionary.detach().cpu().double()
    if not len(atoms):
        return np.zeros((0, 0))
    unit = torch.nn.functional.normalize(atoms, dim=-1)
    values, vectors = torch.linalg.eigh(unit @ unit.T)
    return (vectors * values.clamp_min(0).sqrt()).numpy()


# Nodes


@dataclass(frozen=True)
class _Nodes:
    """What regions are made of. atoms: (n,), -1 of none. colours: (n, 3) CIELAB / 100. views: (n,) the photo
    whose pixel it is, -1 of none. shares: (n,) of it. own: (N,) the node of each Gaussian, -1 of none. pairs:
    two of (m,), neighbours; jumps: (m,) 1 where depth jumps between them; beside: (m,) bool, in one photo or
    in space; else two photos show the same place."""

    atoms: Integer[np.ndarray, " n"]
    colours: Float[np.ndarray, "n 3"]
    views: Integer[np.ndarray, " n"]
    shares: Float[np.ndarray, " n"]
    own: Integer[np.ndarray, " N"]
    pairs: tuple[Integer[np.ndarray, " m"], Integer[np.ndarray, " m"]]
    jumps: Float[np.ndarray, " m"]
    beside: Bool[np.ndarray, " m"]

    @staticmethod
    def of(scene: Scene) -> Generator[float, None, "_Nodes"]:
        """Of a scene; half of the work."""
        means = scene.gaussians.means.detach().cpu()
        finite = torch.isfinite(means).all(1).numpy() & (covered_areas(scene.gaussians) > 0)
        views = np.full(len(means), -1) if scene.view_ids is None else scene.view_ids.cpu().numpy()
        grids, seen = list[_Grid](), np.unique(views[views >= 0]).tolist()
        for number, view in enumerate(seen):
            yield 0.25 * number / len(seen)
            grids += [grid for grid in [_Grid.of(scene, view, finite & (views == view))] if len(grid.rows)]
        free = np.flatnonzero(finite & (views < 0))
        pixels = scene.view_size[0] * scene.view_size[1]
        start = len(grids) * pixels
        own = np.full(len(means), -1)
        for number, grid in enumerate(grids):
            own[grid.rows] = number * pixels + grid.pixels
        own[free] = start + np.arange(len(free))
        atoms, colours = strongest_atoms(scene.semantics), _lab(scene)
        front = np.concatenate([*(grid.front.ravel() for grid in grids), free]).astype(np.int64)
        areas = covered_areas(scene.gaussians)[free]
        links = [*_within(grids, pixels), _free(scene, free, start)]
        for number, link in enumerate(_across(scene, grids, pixels)):
            yield 0.25 + 0.25 * number / max(len(grids) * REGIONS.partners, 1)
            links.append(link)
        first, second, jumps, beside = (np.concatenate(each) for each in zip(*links, strict=True))
        return _Nodes(
            np.where(front >= 0, np.append(atoms, -1)[front], -1),
            np.concatenate([*(grid.colours(colours) for grid in grids), colours[free]]),
            np.append(np.repeat([grid.view for grid in grids], pixels), np.full(len(free), -1)).astype(int),
            np.append(np.full(start, 1 / pixels), areas / max(float(areas.sum()), 1e-30)),
            own,
            (first, second),
            jumps,
            beside,
        )


def _lab(scene: Scene) -> Float[np.ndarray, "N 3"]:
    """Colours of Gaussians, CIELAB / 100."""
    rgb = (0.5 + SH_C0 * scene.gaussians.sh[:, 0].detach().cpu()).nan_to_num(0).clamp(0, 1).numpy()
    if not len(rgb):
        return np.zeros((0, 3))
    return cv2.cvtColor(rgb[None].astype(np.float32), cv2.COLOR_RGB2LAB)[0].astype(float) / 100


@dataclass(frozen=True)
class _Grid:
    """One photo. rows: (r,) of its Gaussians. pixels: (r,) that each is of. front: (H, W) the largest one of
    each pixel or the nearest one beside, -1 where none is near. depths: (H, W) logarithms. weights: (r,) of
    colours. at: (r,) the pixel that each lies in."""

    view: int
    rows: Integer[np.ndarray, " r"]
    pixels: Integer[np.ndarray, " r"]
    at: Integer[np.ndarray, " r"]
    front: Integer[np.ndarray, "H W"]
    nearest: Integer[np.ndarray, "H W"]
    depths: Float[np.ndarray, "H W"]
    weights: Float[np.ndarray, " r"]

    @staticmethod
    def of(scene: Scene, view: int, some: Bool[np.ndarray, " N"]) -> "_Grid":
        """Of some Gaussians, those in front of the camera and within its picture."""
        width, height = scene.view_size
        rows = np.flatnonzero(some)
        viewmat, K = (values[view].detach().cpu().double() for values in (scene.viewmats, scene.Ks))
        points = scene.gaussians.means.detach().cpu()[torch.from_numpy(rows)].double().T.contiguous()
        there = project_points(points, viewmat, K, (height, width))
        x, y, z = (values.numpy() for values in (there.x, there.y, there.z))
        inside = (z > 1e-8) & (x >= -width) & (x < 2 * width) & (y >= -height) & (y < 2 * height)
        rows, z = rows[inside], np.log(z[inside])
        at = y[inside].clip(0, height - 1).astype(int) * width + x[inside].clip(0, width - 1).astype(int)
        weights = np.log(np.maximum(covered_areas(scene.gaussians)[rows], 1e-30)) - 2 * z
        front, depths = np.full(width * height, -1), np.zeros(width * height)
        order = np.argsort(weights, kind="stable")  # of several in a pixel the largest stays
        front[at[order]] = rows[order]
        order = np.argsort(-z, kind="stable")  # and the nearest one's depth
        depths[at[order]] = z[order]
        known = (front >= 0).reshape(height, width)
        if not known.any():
            none = np.zeros((height, width), int)
            return _Grid(view, rows, at, at, none - 1, none, none.astype(float), weights)
        which = np.asarray(distance_transform_edt(~known, return_distances=False, return_indices=True))
        nearest = which[0] * width + which[1]
        far = np.hypot(*(which - np.indices(known.shape)))
        front = np.where(far <= REGIONS.filled, front[nearest], -1)
        depths = depths[nearest]
        return _Grid(view, rows, _assign_pixels(at, z, depths), at, front, nearest, depths, np.exp(weights))

    def colours(self, colours: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "n 3"]:
        """Mean colour of each pixel."""
        count = self.front.size
        sums = np.stack([np.bincount(self.at, self.weights * c, count) for c in colours[self.rows].T], 1)
        means = sums / np.maximum(np.bincount(self.at, self.weights, count), 1e-30)[:, None]
        return means[self.nearest.ravel()]


def _assign_pixels(
    at: Integer[np.ndarray, " r"], z: Float[np.ndarray, " r"], depths: Float[np.ndarray, "H W"]
) -> Integer[np.ndarray, " r"]:
    """The pixels that Gaussians are of: their own, or the one beside it whose depth is theirs, where a jump
    goes through it."""
    height, width = depths.shape
    flat, pixels = depths.ravel(), at.copy()
    off = np.flatnonzero(np.abs(z - flat[at]) > REGIONS.step)
    lines, columns = np.divmod(at[off], width)
    best = np.abs(z[off] - flat[at[off]])
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            there = (lines + down).clip(0, height - 1) * width + (columns + right).clip(0, width - 1)
            apart = np.abs(z[off] - flat[there])
            nearer = apart < best
            pixels[off[nearer]], best[nearer] = there[nearer], apart[nearer]
    return pixels


_Links = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _within(grids: list[_Grid], pixels: int) -> Iterator[_Links]:
    """Neighbours in one photo. Depth jumps by a step that those on both sides of it do not have."""
    for number, grid in enumerate(grids):
        ids = number * pixels + np.arange(pixels).reshape(grid.front.shape)
        for lines in (True, False):
            depths, places, there = (
                (each if lines else each.T) for each in (grid.depths, ids, grid.front >= 0)
            )
            steps = np.abs(np.diff(depths, axis=0))
            if not steps.size:
                continue
            beside = np.minimum(np.vstack((steps[:1], steps[:-1])), np.vstack((steps[1:], steps[-1:])))
            jumps = ((steps - 2 * beside) / REGIONS.step).clip(0, 1)
            both = there[1:] & there[:-1]
            yield places[:-1][both], places[1:][both], jumps[both], np.ones(int(both.sum()), bool)


def _across(scene: Scene, grids: list[_Grid], pixels: int) -> Iterator[_Links]:
    """Pixels of two photos that show the same place."""
    poses = invert_rigid(scene.viewmats.detach().cpu().double()).numpy()
    for number, grid in enumerate(grids):
        apart = [_apart(poses[grid.view], poses[other.view]) for other in grids]
        partners = [other for other in np.argsort(apart, kind="stable") if other != number]
        for other in partners[: REGIONS.partners]:
            pair = number * pixels, other * pixels
            here, there = _same_places(scene, grid, grids[other])
            yield pair[0] + here, pair[1] + there, np.zeros(len(here)), np.zeros(len(here), bool)


def _apart(first: Float[np.ndarray, "4 4"], second: Float[np.ndarray, "4 4"]) -> float:
    """How far two cameras are from each other, a scene unit as much as an angle of one."""
    return float(np.linalg.norm(first[:3, 3] - second[:3, 3]) + np.linalg.norm(first[:3, 2] - second[:3, 2]))


def _same_places(scene: Scene, grid: _Grid, other: _Grid) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of one photo, and those of another that show the same places."""
    mats, Ks = (values.detach().cpu().double() for values in (scene.viewmats, scene.Ks))
    depths = torch.from_numpy(np.exp(grid.depths))[None]
    points = world_points(depths, mats[grid.view][None], Ks[grid.view][None])[0].reshape(-1, 3).T
    height, width = other.front.shape
    projected = project_points(points.contiguous(), mats[other.view], Ks[other.view], (height, width))
    inside = projected.inside.numpy() & (grid.front.ravel() >= 0)
    there = np.where(inside, projected.pixels.numpy(), 0)
    same = (
        np.abs(np.log(np.where(inside, projected.z.numpy(), 1.0)) - other.depths.ravel()[there])
        <= REGIONS.same
    )
    same &= inside & (other.front.ravel()[there] >= 0)
    return np.flatnonzero(same), there[same]


def _free(scene: Scene, free: Integer[np.ndarray, " f"], start: int) -> _Links:
    """Gaussians that no photo made, and touch."""
    some = torch.from_numpy(free)
    first, second = touching(scene.gaussians.map(lambda values: values[some]))
    once = first < second
    count = int(once.sum())
    return start + first[once], start + second[once], np.zeros(count), np.ones(count, bool)


# The tree


@dataclass
class _Joining:
    """Regions while they are joined. names: (k,) their numbers in the tree. sizes: (k,) sums of shares.
    seen: (k, V + 1) by which photos. colours (k, 3), meanings (k, r): sums. ends: of pairs (m,); borders,
    jumps, overlaps: (m,) how long their border is, how much of it is a jump, and how many pixels of two
    photos they share."""

    names: Integer[np.ndarray, " k"]
    sizes: Float[np.ndarray, " k"]
    seen: Bool[np.ndarray, "k _"]
    colours: Float[np.ndarray, "k 3"]
    meanings: Float[np.ndarray, "k r"]
    weights: Float[np.ndarray, " k"]
    ends: tuple[np.ndarray, np.ndarray]
    borders: Float[np.ndarray, " m"]
    jumps: Float[np.ndarray, " m"]
    overlaps: Float[np.ndarray, " m"]
    tree: list[np.ndarray]

    @staticmethod
    def of(nodes: _Nodes, leaves: Integer[np.ndarray, " n"], meaning: Float[np.ndarray, "K r"]) -> "_Joining":
        """Of leaves."""
        count, atoms = int(leaves.max(initial=-1)) + 1, len(meaning)
        known = nodes.atoms >= 0
        places = leaves[known] * max(atoms, 1) + nodes.atoms[known]
        shares = np.bincount(places, minlength=count * max(atoms, 1)).reshape(count, max(atoms, 1))[:, :atoms]
        seen = np.zeros((count, int(nodes.views.max(initial=-1)) + 2), bool)
        seen[leaves, nodes.views] = True  # of no photo: the last
        first, second = (leaves[each] for each in nodes.pairs)
        told = [nodes.beside.astype(float), nodes.jumps * nodes.beside, (~nodes.beside).astype(float)]
        ends, (borders, jumps, overlaps) = _pairs(first, second, told, count)
        sizes = np.bincount(leaves, nodes.shares, count)
        return _Joining(
            np.arange(count),
            sizes,
            seen,
            np.stack([np.bincount(leaves, c, count) for c in nodes.colours.T], 1),
            shares @ meaning,
            np.bincount(leaves, minlength=count).astype(float),
            ends,
            borders,
            jumps,
            overlaps,
            [np.full(count, -1), np.zeros(count), sizes.copy()],
        )

    def differences(self) -> Float[np.ndarray, " m"]:
        """Of pairs; infinite where they do not meet."""
        first, second = self.ends
        norms = np.maximum(np.linalg.norm(self.meanings, axis=1), 1e-12)
        units, colours = self.meanings / norms[:, None], self.colours / self.weights[:, None]
        known = norms > 1e-12  # of what means nothing nothing is known to be another thing
        language = 1 - np.einsum("mr,mr->m", units[first], units[second])
        language *= known[first] & known[second]
        colour = np.linalg.norm(colours[first] - colours[second], axis=1)
        smaller = np.minimum(self.weights[first], self.weights[second])
        overlap = (self.overlaps / (2 * smaller)).clip(0, 1)
        side = self.borders > 0
        jump = np.where(side, self.jumps / np.maximum(self.borders + self.overlaps, 1e-9), 0.0)
        shares = self.sizes / self.seen.sum(1)
        total = (
            REGIONS.language * language
            + REGIONS.colour * colour
            + REGIONS.jump * jump
            + REGIONS.alone * np.where(side, 0, 1 - overlap)
        )
        total *= np.minimum(shares[first], shares[second]) ** REGIONS.size
        return np.where(side | (overlap >= REGIONS.least_overlap), total, np.inf)

    def done(self) -> Generator[float, None, tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Parents, heights and sizes of the tree; the other half of the work."""
        most = len(self.sizes)
        while len(self.borders):
            yield 1 - 0.5 * len(self.sizes) / most
            differences = self.differences()
            pairs = _mutual(self.ends, differences, len(self.sizes))
            if not len(pairs):
                break
            self._join(self.ends[0][pairs], self.ends[1][pairs], differences[pairs])
        parents, heights, sizes = self.tree
        return parents, heights, sizes

    def _join(self, first: np.ndarray, second: np.ndarray, differences: np.ndarray) -> None:
        """Make one region of each pair; no region is in two of them."""
        parents, heights, _ = self.tree
        new = len(parents) + np.arange(len(first))
        parents[self.names[first]] = parents[self.names[second]] = new
        parts = np.maximum(heights[self.names[first]], heights[self.names[second]])
        for values in (self.sizes, self.colours, self.meanings, self.weights, self.seen):
            values[first] += values[second]
        made = np.full(len(new), -1), np.maximum(differences, parts), self.sizes[first]
        self.tree = [np.append(old, own) for old, own in zip(self.tree, made, strict=True)]
        self.names[first] = new
        into, kept = np.arange(len(self.sizes)), np.ones(len(self.sizes), bool)
        into[second], kept[second] = first, False
        place = (kept.cumsum() - 1)[into]
        self.names, self.sizes, self.weights = self.names[kept], self.sizes[kept], self.weights[kept]
        self.colours, self.meanings, self.seen = self.colours[kept], self.meanings[kept], self.seen[kept]
        told = [self.borders, self.jumps, self.overlaps]
        first, second = (place[each] for each in self.ends)
        self.ends, (self.borders, self.jumps, self.overlaps) = _pairs(first, second, told, len(self.sizes))


def _pairs(
    first: np.ndarray, second: np.ndarray, told: list[np.ndarray], count: int
) -> tuple[tuple[np.ndarray, np.ndarray], list[np.ndarray]]:
    """Each pair of two regions once, the lower number first, and the sums of what is told of it."""
    apart = first != second
    first, second = first[apart].astype(np.int64), second[apart].astype(np.int64)
    keys = np.minimum(first, second) * count + np.maximum(first, second)
    pairs, which = np.unique(keys, return_inverse=True)
    sums = [np.bincount(which, each[apart], len(pairs)).astype(float) for each in told]
    low, high = np.divmod(pairs, max(count, 1))
    return (low, high), sums


def _mutual(
    ends: tuple[np.ndarray, np.ndarray], differences: Float[np.ndarray, " m"], count: int
) -> Integer[np.ndarray, " p"]:
    """Pairs of regions that are each other's nearest; of several equally near ones the first."""
    order = np.argsort(differences, kind="stable")
    order = order[np.isfinite(differences[order])]
    place = np.arange(len(order))
    nearest = np.full(count, len(order))
    for each in ends:
        np.minimum.at(nearest, each[order], place)
    return order[(nearest[ends[0][order]] == place) & (nearest[ends[1][order]] == place)]
