"""Outlines: what a picture shows of a part, by the reference's own mattes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.mending.looks import mattes
from langflash_core.splat import compose
from langflash_core.splat.outlines import outlines, silhouette
from langflash_core.types import Scene
from tests.scene.test_regions import LEFT, RIGHT, WALL, photographed


@pytest.fixture(scope="module")
def boxes() -> tuple[Scene, np.ndarray]:
    return photographed()


def every(scene: Scene) -> np.ndarray:
    return np.ones(len(scene.gaussians), bool)


def test_a_silhouette_is_where_most_of_the_light_is_of_the_part(boxes):
    scene, own = boxes
    camera = scene.camera(0)
    for thing in (LEFT, RIGHT, WALL):
        matte = mattes(scene, torch.from_numpy(own == thing), [camera], compose.render)[0][0].numpy() > 0.5
        found = silhouette(scene, every(scene), own == thing, camera)
        # a border of a pixel around things of some thousand pixels
        assert (found & matte).sum() / (found | matte).sum() > 0.9 and matte.sum() > 500, thing


def test_lines_go_around_what_is_seen(boxes):
    scene, own = boxes
    camera = scene.camera(0, 800, 600)  # on a grid of 320 pixels
    lines = outlines(scene, every(scene), own == RIGHT, camera)
    low, high = (np.concatenate(lines).min(0), np.concatenate(lines).max(0))
    lines_of, columns = np.nonzero((own[: 60 * 80] == RIGHT).reshape(60, 80))
    assert low == pytest.approx((10 * columns.min(), 10 * lines_of.min()), abs=15)  # a pixel of the photo
    assert high == pytest.approx((10 * columns.max() + 10, 10 * lines_of.max() + 10), abs=15)


def test_what_is_hidden_or_nothing_has_no_line(boxes):
    scene, own = boxes
    camera, none = scene.camera(0), np.zeros(len(own), bool)
    assert outlines(scene, every(scene), none, camera) == ()
    assert outlines(scene, own != LEFT, own == LEFT, camera) == ()
    assert outlines(scene.rows(torch.zeros(0, dtype=torch.int64)), none[:0], none[:0], camera) == ()
    behind = scene.camera(0)
    turned = behind.viewmat.clone()
    turned[[0, 2]] *= -1  # looks the other way
    assert outlines(scene, every(scene), own == LEFT, type(behind)(turned, behind.K, 80, 60)) == ()


def test_what_stands_before_a_part_covers_it(boxes):
    scene, own = boxes
    camera, before = scene.camera(0), scene.gaussians.means.clone()
    before[torch.from_numpy(own == RIGHT)] *= 0.5  # of the first photo: in their pixels, before all else
    before[torch.from_numpy(own == RIGHT), 0] -= 0.3  # and over the left box
    covered = replace(scene, gaussians=replace(scene.gaussians, means=before))
    alone = silhouette(covered, own != RIGHT, own == LEFT, camera)
    seen = silhouette(covered, every(scene), own == LEFT, camera)
    assert alone.sum() > 500 and seen.sum() < 0.7 * alone.sum() and not (seen & ~alone).any()
