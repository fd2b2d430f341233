"""Phrases as parts of a scene: one membership for all views, edges without a neighbour's colour."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core import segments
from langflash_core.errors import PromptError
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.language.spaces import language_space
from langflash_core.scene.instances import instances
from langflash_core.splat import render
from langflash_core.types import Camera, Record, Scene, Segments, Semantics
from tests.app.cli.conftest import HEIGHT, WIDTH, stripes
from tests.splat.scenes import unturned

COLOURS = torch.tensor([[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.1, 0.1, 0.9]])


def chairs() -> tuple[Scene, torch.Tensor]:
    """Three squares that face the camera, the third nearer and before a part of the second; whose is what."""
    ys, xs = torch.meshgrid(torch.arange(15.0), torch.arange(15.0), indexing="ij")
    square = torch.stack((xs, ys, torch.zeros_like(xs)), -1).reshape(-1, 3) * 0.02
    places = torch.tensor([[-0.6, -0.15, 1.0], [0.05, -0.15, 1.0], [0.12, -0.05, 0.7]])
    means = torch.cat([square + place for place in places])
    owner = torch.arange(3).repeat_interleave(len(square))
    count = len(means)
    sh = ((COLOURS[owner] - 0.5) / SH_C0)[:, None]
    gaussians = unturned(means, torch.tensor([0.014, 0.014, 0.002]), 0.95, sh)
    semantics = Semantics(torch.zeros(count, 0).long(), torch.zeros(count, 0), torch.zeros(0, 4), "test")
    K = torch.tensor([[60.0, 0, 40], [0, 60.0, 30], [0, 0, 1.0]])
    return Scene(gaussians, semantics, torch.eye(4)[None], K[None], (80, 60)), owner


def parts_of(scene: Scene, owner: torch.Tensor) -> Segments:
    """The first two squares are "chair", the third is "box"."""
    chair, box = owner < 2, owner == 2
    members = torch.stack((chair, box))
    numbers = torch.stack((torch.where(chair, owner + 1, 0), box.long()))
    return Segments(("chair", "box"), (1.0, 1.0), 0.5, members, numbers)


def view_of(camera: Camera | None = None):
    scene, owner = chairs()
    parts = parts_of(scene, owner)
    seen = camera or scene.camera(0)
    return scene, parts, segments.segmented_view(segments.carrying(scene, parts), parts, seen, render)


def test_mattes_are_sums_of_what_their_gaussians_add():
    """The twin: weights as features of plain compositing, one phrase at a time."""
    scene, parts, view = view_of()
    for phrase, members in enumerate(parts.members):
        atom = Semantics(torch.zeros(len(members), 1).long(), members[:, None].float(), torch.ones(1, 1), "t")
        twin = render(Scene(scene.gaussians, atom, scene.viewmats, scene.Ks, (80, 60)), scene.camera(0))
        assert twin.weight_maps is not None
        torch.testing.assert_close(view.mattes[phrase], twin.weight_maps[..., 0])
    torch.testing.assert_close(view.union, view.mattes.sum(0))  # no Gaussian is of both


def test_instances_are_told_apart_in_every_view():
    shifted = torch.eye(4)
    shifted[0, 3] = -0.2
    scene, parts, view = view_of()
    _, _, moved = view_of(Camera(shifted, scene.Ks[0], 80, 60))
    assert parts.things == ((0, 1), (0, 2), (1, 1)) and parts.counts == (2, 1)
    for seen, left in ((view, 4 + 0), (moved, 4 - 12)):  # 0.2 units are 12 pixels at depth 1
        assert seen.things[30, max(0, left + 5)] == 1  # the first square
        assert set(seen.things[seen.masks[0]].unique().tolist()) <= {1, 2}
        assert set(seen.things[seen.masks[1]].unique().tolist()) <= {2, 3}
        assert not seen.things[~seen.masks.any(0)].any()


def test_labels_are_of_the_phrase_that_shows_most():
    _, _, view = view_of()
    assert torch.equal(view.labels > 0, view.masks.any(0))
    assert torch.equal(view.labels == 2, view.masks[1] & ~(view.mattes[0] > view.mattes[1]))


def test_a_cut_out_has_no_colour_of_its_neighbours():
    scene, parts, view = view_of()
    for phrase, channel in ((1, 2), (0, None)):
        cut = segments.cut_out(scene, parts.members[phrase], view.camera, view.mattes[phrase], render)
        edge = (cut[..., 3] > 0.05) & (cut[..., 3] < 0.95)
        assert edge.any()  # soft
        if channel is not None:
            # Of one colour throughout, also where the mixture on screen is half another's.
            error = (cut[..., :3][edge] - COLOURS[2]).abs().max()
            assert float(error) < 1e-4  # float32 over a matte of 0.05
            assert float((view.frame.rgb[edge] - COLOURS[2]).abs().max()) > 0.3
        torch.testing.assert_close(cut[..., 3], view.mattes[phrase].clamp(0, 1))


def test_the_parts_and_what_is_left_make_the_picture_again():
    scene, parts, view = view_of()
    total = torch.zeros(60, 80, 3)
    for phrase in range(2):
        cut = segments.cut_out(scene, parts.members[phrase], view.camera, view.mattes[phrase], render)
        total += cut[..., :3] * cut[..., 3:]
    drawn = view.mattes.sum(0)[..., None] > 0.02  # below 1/255 a matte has no colour
    assert float(((total - view.frame.rgb) * drawn).abs().max()) < 2 / 255


def test_words_find_their_stripe():
    scene = stripes()
    parts = segments.segment(scene, ["armchair", "submarine"])
    assert parts.counts == (1, 0) and not parts.members[1].any()
    assert parts.scores[0] > parts.threshold > parts.scores[1]
    view = segments.segmented_view(segments.carrying(scene, parts), parts, scene.camera(0), render)
    third = WIDTH // 3
    assert view.masks[0, :, : third - 2].all() and not view.masks[0, :, third + 2 :].any()
    (box,) = segments.boxes(scene, parts)
    assert box["center"][0] == pytest.approx(-0.53, abs=0.05) and view.frame.rgb.shape == (HEIGHT, WIDTH, 3)


def test_thresholds_and_scenes_without_language():
    with pytest.raises(PromptError, match="out of range"):
        segments.segment(stripes(), ["armchair"], threshold=1.5)
    everything = segments.segment(stripes(), ["armchair"], threshold=0.0)
    assert everything.members.all() and everything.counts == (1,)


def test_numbers_that_are_none_are_left_out():
    scene, owner = chairs()
    scene.gaussians.means[0] = torch.nan
    parts = parts_of(scene, owner)
    view = segments.segmented_view(segments.carrying(scene, parts), parts, scene.camera(0), render)
    assert torch.isfinite(view.mattes).all() and view.masks[0].any()
    cut = segments.cut_out(scene, parts.members[0], view.camera, view.mattes[0], render)
    assert torch.isfinite(cut).all()
    pytest.importorskip("skimage")
    mesh = segments.surface(scene, owner == 0, [scene.camera(0, 320, 240)], render)
    assert mesh is not None and np.isfinite(mesh.vertices).all()


def test_a_surface_is_where_the_thing_is():
    pytest.importorskip("skimage")
    scene, owner = chairs()
    cameras = [scene.camera(0, 320, 240)]
    mesh = segments.surface(scene, owner == 2, cameras, render)
    assert mesh is not None and segments.surface(scene, owner > 5, cameras, render) is None
    # Centres are at depth 0.7; a voxel is 0.028.
    assert np.abs(mesh.vertices[:, 2] - 0.7).max() < 0.014
    area = (
        np.linalg.norm(np.cross(*np.diff(mesh.vertices[mesh.faces], axis=1).swapaxes(0, 1)), axis=1).sum() / 2
    )
    assert area == pytest.approx(0.28**2, rel=0.25)  # half a voxel at each rim
    assert np.abs(mesh.colours.mean(0) - 255 * COLOURS[2].numpy()).max() < 3
    assert math.isfinite(float(mesh.vertices.sum()))


def sized(scene: Scene, words: list[str], parts: list[tuple[torch.Tensor, float, int]]) -> Scene:
    """The scene's cameras, of more pixels, before discs that face them: means, radius, atom of each part."""
    means = torch.cat([places for places, _, _ in parts])
    scales = torch.cat([torch.tensor([[r, r, 0.1 * r]]).repeat(len(places), 1) for places, r, _ in parts])
    atoms = torch.cat([torch.full((len(places), 1), atom) for places, _, atom in parts])
    count = len(means)
    dictionary = language_space("minilm").encode(words)
    semantics = Semantics(atoms, torch.ones(count, 1), dictionary, "minilm")
    ids = torch.zeros(count, dtype=torch.int64)
    Ks = torch.stack([scene.camera(view, 160, 120).K for view in range(2)])
    return replace(
        scene,
        gaussians=unturned(means, scales, 0.99),
        semantics=semantics,
        view_ids=ids,
        view_size=(160, 120),
        Ks=Ks,
    )


def square(x: float, y: float, z: float, side: float, step: float) -> torch.Tensor:
    """Centres of a square's elements, its middle given."""
    along = (torch.arange(round(side / step)) + 0.5) * step - side / 2
    ys, xs = torch.meshgrid(along, along, indexing="ij")
    return torch.stack((x + xs, y + ys, torch.full_like(xs, z)), -1).reshape(-1, 3)


def test_a_flat_thing_of_few_large_elements_is_found_beside_a_textured_one():
    """One element of 30 x 30 pixels in a photo of 160 x 120: what pixels say, not how many elements."""
    wall = (square(0, 0, 1, 2.0, 0.02), 0.014, 0)
    lamp = (torch.tensor([[0.2, 0.2, 0.9]]), 0.1, 1)
    scene = sized(stripes(), ["armchair", "lamp"], [wall, lamp])
    parts = segments.segment(scene, ["lamp", "armchair"])
    assert parts.counts == (1, 1) and int(parts.members[0].sum()) == 1
    assert parts.scores[0] > parts.threshold


def test_a_thing_is_without_its_halo_and_a_less_sure_one_is_whole(monkeypatch):
    """As a mask has them: beside a door of .98 the wall has .8, and another door has .9."""
    near, apart = square(-0.3, 0, 1, 0.6, 0.02), square(0.4, 0, 1, 0.3, 0.02)
    scene = sized(stripes(), ["armchair"], [(near, 0.014, 0), (apart, 0.014, 0)])
    door = ((near[:, :2] - torch.tensor([-0.3, 0.0])).abs() < 0.15).all(1)
    sure = torch.cat((torch.where(door, 0.98, 0.8), torch.full((len(apart),), 0.9)))
    monkeypatch.setattr(segments, "meant_relevance", lambda *_: (sure[None], ("",)))
    parts = segments.segment(scene, ["armchair"])
    assert parts.threshold < 0.8 and parts.counts == (2,)
    assert torch.equal(parts.members[0], sure > 0.8) and torch.equal(parts.instances[0] > 0, sure > 0.8)
    assert segments.segment(scene, ["armchair"], threshold=0.79).members.all()


def test_many_elements_smaller_than_a_pixel_are_not_more_than_they_show():
    """A hundred of them on a part of a pixel are noise."""
    wall = (square(0, 0, 1, 2.0, 0.02), 0.014, 0)
    dust = (square(0.2, 0.2, 0.9, 2e-3, 2e-4), 1.4e-4, 1)
    scene = sized(stripes(), ["armchair", "lamp"], [wall, dust])
    parts = segments.segment(scene, ["lamp"])
    assert parts.counts == (0,) and not parts.members.any() and parts.scores[0] < parts.threshold


def test_what_no_photo_sees_is_no_thing():
    """A second lamp hides behind the wall; it stays a part of the phrase, but has no number."""
    wall = (square(0, 0, 1, 3.0, 0.02), 0.014, 0)
    seen = (square(-0.2, 0, 0.8, 0.2, 0.02), 0.014, 1)
    hidden = (square(0.3, 0, 1.6, 0.4, 0.02), 0.014, 1)
    parts = segments.segment(sized(stripes(), ["armchair", "lamp"], [wall, seen, hidden]), ["lamp"])
    assert parts.counts == (1,) and int(parts.members.sum()) == 500
    assert set(parts.instances[0].nonzero()[:, 0].tolist()) == set(range(22500, 22600))
    alone = segments.segment(sized(stripes(), ["armchair", "lamp"], [wall, hidden]), ["lamp"])
    assert alone.counts == (0,) and not alone.members.any()


def test_what_a_merge_brought_counts_by_its_surface():
    """No photo of the scene shows it, and no photo could."""
    wall = (square(0, 0, 1, 3.0, 0.02), 0.014, 0)
    brought = (square(0.3, 0, 1.6, 0.4, 0.02), 0.014, 1)
    scene = sized(stripes(), ["armchair", "lamp"], [wall, brought])
    assert scene.view_ids is not None
    ids = torch.where(torch.arange(len(scene.view_ids)) < 22500, 0, -1)
    assert segments.segment(replace(scene, view_ids=ids), ["lamp"]).counts == (1,)


def test_boxes_hold_the_surface_however_its_elements_are_spread():
    """A table top of large elements, fine detail on a hundredth of it: all of the top is in the box."""
    top = (square(0, 0, 1, 1.0, 0.1), 0.07, 1)
    detail = (square(0.4, 0.4, 0.999, 0.1, 0.001), 0.0005, 1)
    scene = sized(stripes(), ["armchair", "table"], [top, detail])
    (box,) = segments.boxes(scene, segments.segment(scene, ["table"]))
    assert box["size"][:2] == pytest.approx([0.9, 0.9], abs=0.01)  # from the middles of the outer ones
    assert box["center"][:2] == pytest.approx([0, 0], abs=0.01)


def twice(apart: float = 1.08) -> tuple[Scene, torch.Tensor]:
    """The squares in two layers, of photos beside each other, the second's depths so many times as large."""
    scene, owner = chairs()
    g = scene.gaussians
    rows = torch.arange(len(g)).repeat(2)
    both = replace(g.rows(rows), means=torch.cat((g.means, apart * g.means)))
    aside = torch.eye(4)
    aside[0, 3] = -0.1
    layers = replace(
        scene,
        gaussians=both,
        semantics=scene.semantics.rows(rows),
        viewmats=torch.stack((torch.eye(4), aside)),
        Ks=scene.Ks.repeat(2, 1, 1),
        view_ids=torch.arange(2).repeat_interleave(len(g)),
        record=Record(layered=True),
    )
    return layers, owner.repeat(2)


def test_a_thing_in_two_layers_is_counted_once_and_has_the_gaussians_of_both():
    scene, owner = twice()
    assert len(np.unique(instances(scene.gaussians, (owner < 2).numpy()))) == 5  # by touch alone each twice
    numbers = segments.connected_things(scene, owner < 2, segments.photo_shares(scene))
    told = [numbers[owner == square].unique().tolist() for square in range(3)]
    assert sorted(told[:2]) == [[1], [2]] and told[2] == [0]


def test_what_one_layer_alone_shows_and_what_stands_far_behind_are_things_of_their_own():
    scene, owner = twice(1.3)  # 26 % of depth: no longer the same
    numbers = segments.connected_things(scene, owner == 0, segments.photo_shares(scene))
    assert sorted(numbers.unique().tolist()) == [0, 1, 2]
    assert scene.view_ids is not None
    scene, owner = scene.rows(scene.view_ids == 0), owner[scene.view_ids == 0]
    numbers = segments.connected_things(scene, owner < 2, segments.photo_shares(scene))
    assert sorted(numbers.unique().tolist()) == [0, 1, 2]


def test_mattes_of_layers_are_blended_as_pictures_are():
    scene, owner = twice()
    parts = parts_of(scene, owner)
    carrying = segments.carrying(scene, parts)
    for view in range(2):
        seen = segments.segmented_view(carrying, parts, scene.camera(view), render)
        for phrase, members in enumerate(parts.members):
            ids = torch.zeros(len(members), 1).long()
            twin = replace(scene, semantics=Semantics(ids, members[:, None].float(), torch.ones(1, 1), "t"))
            maps = render(twin, scene.camera(view)).weight_maps
            assert maps is not None
            torch.testing.assert_close(seen.mattes[phrase], maps[..., 0])
