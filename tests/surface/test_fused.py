"""One surface of a scene of layers."""

from dataclasses import replace

import torch

from langflash_core.splat import render
from langflash_core.surface.fused import fuse_layers, fused_rows
from tests.splat.test_compose import SIZE, layered


def test_of_two_layers_that_show_one_wall_one_keeps_it():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 0.2])
    whole = fuse_layers(scene)
    assert not whole.layered and len(whole.gaussians) < 0.75 * len(scene.gaussians)
    frames = [scene.layer(0), whole]
    camera = scene.camera(0)
    alphas = [render(each, camera).alphas for each in frames]
    assert float(alphas[1].min()) > 0.9 * float(alphas[0].min())  # as closed as one layer


def test_its_colours_make_the_pictures_of_all_layers():
    """Two layers show one wall, grey of .3 and of .5: one surface of it is between both."""
    scene = layered([(2, 0.3, 0), (2, 0.5, 1)], [0, 0.2])
    whole = fuse_layers(scene)
    for view, grey in enumerate((0.3, 0.5)):
        drawn = render(whole, scene.camera(view)).rgb
        assert abs(float(drawn[SIZE // 4 : -SIZE // 4, SIZE // 4 : -SIZE // 4].mean()) - grey) < 0.15


def test_a_photo_without_a_layer_says_nothing():
    """Two more photos, whose layers a scene of many photos leaves out: the same rows as without them."""
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 0.2])
    more = replace(scene, viewmats=scene.viewmats[[0, 1, 1, 1]], Ks=scene.Ks[[0, 1, 1, 1]])
    assert torch.equal(fused_rows(more), fused_rows(scene))


def test_what_no_photo_made_stays():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 0.2])
    assert scene.view_ids is not None
    ids = scene.view_ids.clone()
    ids[:7] = -1
    assert bool(fused_rows(replace(scene, view_ids=ids))[:7].all())


def test_a_scene_without_layers_is_as_it_was():
    scene = layered([(2, 0.2, 0)], [0]).with_record(layered=False)
    assert fuse_layers(scene) is scene


def test_where_layers_show_nothing_nothing_fails():
    scene = layered([(2, 0.2, 0), (2, 0.8, 1)], [0, 0.2])
    empty = scene.rows(torch.zeros(len(scene.gaussians), dtype=torch.bool))
    assert len(fuse_layers(empty).gaussians) == 0
