"""What of a scene has gone in another: by depth and by what is there instead, whatever it is called."""

from dataclasses import replace

import numpy as np
import pytest

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.inventory import inventory
from langflash_core.inventory.beside import difference
from langflash_core.inventory.gone import changes, fate
from langflash_core.inventory.settings import GONE
from langflash_core.language.spaces import language_space
from langflash_core.splat import render
from tests.boxroom import METRES, TABLE, WORDS, box_room
from tests.inventory.conftest import SAME


def found_in(scene):
    return inventory(scene.with_record(metric_scale=METRES))


@pytest.fixture(scope="module")
def room():
    return found_in(box_room())


def told(room, other):
    return fate(room, other, SAME, render, 1.0)


def of(room, word: str) -> np.ndarray:
    return room.scene.semantics.weight_ids[:, 0].numpy() == WORDS.index(word)


def test_what_another_scene_lacks_has_gone_and_nothing_else_has(room):
    fates = told(room, found_in(box_room(table=None).with_record(world=room.world)))
    table = of(room, "table")
    assert (fates.gone & table).sum() >= 0.5 * (fates.known & table).sum() > 0
    assert (fates.gone & ~table).sum() <= 0.01 * (~table).sum()
    (rows,) = changes(room, fates.gone)
    assert table[rows].mean() >= 0.95 and room.shares[:, rows].sum(1).max() >= GONE.least


def test_the_same_things_at_depths_off_by_a_tenth_have_not_gone(room):
    """The same rays show the same things, so whatever is looked through is still there."""
    gaussians = room.scene.gaussians
    farther = replace(room.scene, gaussians=replace(gaussians, means=1.1 * gaussians.means))
    fates = told(room, found_in(farther.with_record(world=room.world)))
    assert fates.gone.sum() <= 0.02 * fates.known.sum() and fates.known.mean() > 0.3


def test_darker_photos_change_nothing(room):
    gaussians = room.scene.gaussians
    colours = 0.4 * (0.5 + SH_C0 * gaussians.sh)
    dark = replace(room.scene, gaussians=replace(gaussians, sh=(colours - 0.5) / SH_C0))
    assert not told(room, found_in(dark)).gone.any()


def test_what_no_inventory_lists_is_found_to_have_moved(room, aligned):
    """A table that both scenes take for a part of the wall."""

    def misnamed(east):
        scene = box_room(chairs=(), table=(east, TABLE[1])).with_record(world=room.world)
        atoms = scene.semantics.dictionary.clone()
        atoms[WORDS.index("table")] = language_space("minilm").encode(("wall",))[0]
        return found_in(replace(scene, semantics=replace(scene.semantics, dictionary=atoms)))

    before, after = misnamed(1.2), misnamed(2.8)
    assert not {"table", "desk"} & {*before.counts, *after.counts}
    found = difference(before, after, render)
    assert [pair.by for pair in found.moved] == [pytest.approx(1.6, abs=0.1)]
    assert not found.came and not found.went
    rows = found.moved[0].before.rows
    assert of(before, "table")[rows].mean() >= 0.9
