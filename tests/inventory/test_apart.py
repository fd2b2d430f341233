"""Pieces that are larger than any thing are taken apart."""

from dataclasses import replace

import numpy as np
import torch
from scipy.sparse import csr_array

from langflash_core.inventory import inventory
from langflash_core.inventory.apart import DEEPEST, SEAT, put_together, taken_apart
from langflash_core.scene.regions import Regions
from tests.boxroom import EYE, METRES, box_room
from tests.inventory.test_things import with_more


def tree(parents: list[int], leaves: int) -> Regions:
    count = len(parents)
    none, alone = np.zeros(count), csr_array((leaves, leaves))
    return Regions(np.arange(leaves), np.array(parents), none, none, np.zeros(leaves, int), alone, alone)


def test_the_largest_regions_that_fit_are_things_and_specks_are_not():
    """((0 1) (2 3)) and a leaf 4 on top: rows 0 to 9, two a leaf; row 10 is of no region."""
    regions = tree([5, 5, 6, 6, 8, 7, 7, 8, -1], 5)
    leaves = np.array([0, 0, 1, 1, 2, 2, 3, 3, 4, 4, -1])
    masses = np.ones(11)
    told = taken_apart(regions, leaves, masses, 1.0, lambda rows: len(rows) <= 4)
    parts = {tuple(np.flatnonzero(told == number)) for number in range(told.max() + 1)}
    assert parts == {(0, 1, 2, 3), (4, 5, 6, 7), (8, 9)} and told[10] == -1
    masses[8:10] = 0.1
    told = taken_apart(regions, leaves, masses, 1.0, lambda rows: len(rows) <= 8)
    assert told.tolist() == [0] * 8 + [-1] * 3
    told = taken_apart(regions, leaves, masses, 1.0, lambda rows: False)
    assert len(np.unique(told[:8])) == 4  # leaves are no further taken apart


def test_two_tables_that_touch_are_two_where_one_would_be_too_deep():
    east, north = np.meshgrid(np.arange(0.4, 3.6, 0.03), np.arange(1.3, 4.4, 0.03))
    points = np.stack((east.ravel(), np.full(east.size, 0.7), north.ravel()), 1)
    room = with_more(box_room(chairs=(), table=None).with_record(metric_scale=METRES), points, "door")
    own = torch.arange(len(room.gaussians) - len(points), len(room.gaussians))
    sh = room.gaussians.sh.clone()
    sh[own, 0] = torch.tensor([1.5, -1.5, -1.5])  # one is red, the other blue
    sh[own[torch.from_numpy(points[:, 0] > EYE[0])], 0] = torch.tensor([-1.5, -1.5, 1.5])
    words = room.semantics.weight_ids.clone()
    words[own] = 4  # "table"
    quats = room.gaussians.quats.clone()
    quats[own] = quats[room.semantics.weight_ids[:, 0] == 1][:1]  # they lie as the floor does
    semantics = replace(room.semantics, weight_ids=words)
    both = replace(room, gaussians=replace(room.gaussians, sh=sh, quats=quats), semantics=semantics)
    tables = [thing for thing in inventory(both).things if thing.kind == "table"]
    assert len(tables) == 2 and all(thing.size[1] < DEEPEST for thing in tables)
    assert abs(tables[0].place[0] - tables[1].place[0]) > 1


def test_what_is_cut_of_a_seat_is_put_together_again_and_two_seats_are_two():
    """Seat and back of two chairs side by side, from where to where along four directions."""
    turns = np.radians(np.arange(0, 180, 45))
    axes = np.stack((np.cos(turns), np.sin(turns)))
    corners = np.array([(x, y) for x in (0.0, 0.4) for y in (0.0, 0.4)])
    pieces = [corners + place for place in ((0, 0), (0.05, 0.3), (0.6, 0), (0.65, 0.3), (3, 3))]
    lows, highs = (np.stack([end(piece @ axes, 0) for piece in pieces]) for end in (np.min, np.max))
    kept = lows.copy()
    assert put_together(lows, highs, SEAT).tolist() == [0, 0, 2, 2, 4]
    assert (lows == kept).all() and put_together(lows, highs, 0.5).tolist() == [0, 1, 2, 3, 4]
    assert put_together(lows, highs, 9.0).tolist() == [0] * 5
    assert put_together(lows[:0], highs[:0], SEAT).tolist() == []


def test_chairs_that_touch_are_as_many_as_stand_there():
    """Three in a row, 1.8 m, each of a seat in its own colour and a darker back."""
    room = box_room(chairs=(), table=None).with_record(metric_scale=METRES)
    east, north = np.meshgrid(np.arange(0.015, 1.8, 0.03), np.arange(0.0, 0.5, 0.03))
    points = np.stack((east.ravel() + 1.0, np.full(east.size, 0.45), north.ravel() + 2.6), 1)
    both = with_more(room, points, "door")
    own = torch.arange(len(both.gaussians) - len(points), len(both.gaussians))
    hues = torch.tensor([[1.5, -1.5, -1.5], [-1.5, 1.5, -1.5], [-1.5, -1.5, 1.5]])
    backs = torch.from_numpy(north.ravel() > 0.3)
    sh, words, quats = (
        both.gaussians.sh.clone(),
        both.semantics.weight_ids.clone(),
        both.gaussians.quats.clone(),
    )
    sh[own, 0] = (
        hues[torch.from_numpy((east.ravel() / 0.6).astype(int))] * torch.where(backs, 0.5, 1.0)[:, None]
    )
    words[own] = 3  # "chair"
    quats[own] = quats[both.semantics.weight_ids[:, 0] == 1][:1]  # they lie as the floor does
    gaussians = replace(both.gaussians, sh=sh, quats=quats)
    both = replace(both, gaussians=gaussians, semantics=replace(both.semantics, weight_ids=words))
    found = inventory(both)
    assert found.counts["chair"] == 3
    chairs = [thing for thing in found.things if thing.kind == "chair"]
    assert all(max(thing.size[:2]) < SEAT for thing in chairs)
    gaps = np.diff(sorted(thing.place[0] for thing in chairs))
    assert np.allclose(gaps, 0.6, atol=0.1)
