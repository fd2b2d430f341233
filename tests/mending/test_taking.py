"""What goes with a part, which views are looked at, and how little is drawn for it."""

from dataclasses import replace

import numpy as np
import torch

from langflash_core.mending.filling import delete_and_fill
from langflash_core.mending.settings import FILLING
from langflash_core.mending.taking import Nearby, most_telling, with_fringe


def test_only_what_is_beside_and_behind_goes_with_a_part(known, draw):
    scene = known.scene
    gone = with_fringe(scene, known.members, draw)
    assert gone[known.members].all()
    beyond = gone & ~known.members
    assert 0 < int(beyond.sum()) < len(gone) / 4


def test_what_stands_before_a_part_stays(known, draw):
    """The wall is taken; the screen before it is not, though it lies within the wall's picture."""
    assert not bool(with_fringe(known.scene, ~known.members, draw)[known.members].float().mean() > 0.02)


def test_what_other_layers_have_in_its_place_goes(known, draw):
    """Selected in one photo alone, the screen goes in both."""
    scene, ids = known.scene, known.scene.view_ids
    gone = with_fringe(scene, known.members & (ids == 0), draw)
    assert float(gone[known.members & (ids == 1)].float().mean()) > 0.8


def test_few_views_are_drawn_of_many_and_none_that_looks_away(known, draw):
    """Twenty more views from beside, and two that look away."""
    scene = known.scene
    aside = scene.viewmats[:1].repeat(20, 1, 1)
    aside[:, 0, 3] += torch.linspace(-0.2, 0.2, 20)
    away = scene.viewmats[:1].repeat(2, 1, 1)
    away[:, :3] *= torch.tensor([-1.0, 1.0, -1.0])[:, None]
    viewmats = torch.cat((scene.viewmats, aside, away))
    flat = scene.with_record(layered=False, light={}, warnings=())
    many = replace(flat, viewmats=viewmats, Ks=scene.Ks[:1].repeat(24, 1, 1), photos=())
    chosen = most_telling(many, known.members, FILLING.most_views)
    assert len(set(chosen)) == FILLING.most_views and not {22, 23} & set(chosen)
    drawn = []

    def counted(part, camera, **options):
        drawn.append((len(part.gaussians), camera.width * camera.height))
        return draw(part, camera, **options)

    filled = delete_and_fill(many, known.members, counted)
    whole = [count for count, _ in drawn if count > len(scene.gaussians) / 4]
    assert filled.gone[known.members].all() and len(whole) <= FILLING.most_views


def test_some_gaussians_are_drawn_as_the_whole_scene_blends_them(known, draw):
    scene = known.scene
    camera = scene.camera(1)
    every = torch.ones_like(known.members)
    nearby, whole = Nearby.of(scene).drawn(every, camera, draw), draw(scene, camera)
    assert np.allclose(nearby.rgb.numpy(), whole.rgb.numpy(), atol=1e-5)
    assert np.allclose(nearby.alphas.numpy(), whole.alphas.numpy(), atol=1e-5)
