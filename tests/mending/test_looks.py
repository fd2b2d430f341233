"""What draws here, against the reference; mattes; and the picture of before and after."""

import torch

from langflash_core.mending.looks import before_and_after, draw_scene, mattes, redden
from langflash_core.splat import compose, render
from tests.splat.test_compose import layered


def test_it_draws_as_the_reference_does(known):
    camera = known.scene.camera(1)
    ours, theirs = draw_scene(known.scene, camera), render(known.scene, camera)
    assert ours.weight_maps is not None and theirs.weight_maps is not None
    for name in ("rgb", "alphas", "weight_maps"):
        apart = (getattr(ours, name) - getattr(theirs, name)).abs().max()
        assert float(apart) < 5e-4, name  # what tiles leave out, times the largest colour, and float32
    assert torch.allclose(ours.depths, theirs.depths, atol=2e-3)


def test_a_matte_is_what_a_part_adds(known, draw):
    camera = known.scene.camera(0)
    (ours, _), (others, _) = (
        mattes(known.scene, part, [camera], draw)[0] for part in (known.members, ~known.members)
    )
    assert torch.allclose(ours + others, draw(known.scene, camera).alphas, atol=1e-4)
    assert 0.03 < float((ours > 0.5).float().mean()) < 0.3


def test_before_and_after_stand_beside_each_other(known, draw):
    width, height = known.scene.view_size
    picture = before_and_after(known.scene, known.members, known.scene, draw)
    assert picture.shape == (known.scene.num_views * height, 2 * width, 3)
    left, right = picture[:height, :width], picture[:height, width:]
    changed = (left - right).abs().amax(-1) > 0.2
    assert 0.02 < float(changed.float().mean()) < 0.3
    assert float((left - right)[changed][:, 0].mean()) > 0.2  # red
    assert torch.equal(
        redden(known.scene, torch.zeros_like(known.members)).gaussians.sh, known.scene.gaussians.sh
    )


def test_layers_are_blended_by_whoever_draws():
    scene = layered([(2, 0.2, 0), (2.1, 0.8, 1)], [0.0, 0.5])
    part = scene.semantics.weight_ids[:, 0] == 1
    for view in range(2):
        ours, theirs = draw_scene(scene, scene.camera(view)), compose.render(scene, scene.camera(view))
        assert ours.weight_maps is not None and theirs.weight_maps is not None
        # the rasteriser for processors stops at 1e-4 of the light
        assert torch.allclose(ours.rgb, theirs.rgb, atol=3e-4)
        assert torch.allclose(ours.depths, theirs.depths, atol=3e-3)
        ((matte, depths),) = mattes(scene, part, [scene.camera(view)], draw_scene)
        assert torch.allclose(matte, theirs.weight_maps[..., 1], atol=3e-4)
        # drawn with other weight maps: sums of as many terms, each product rounded for its own shape
        assert torch.allclose(depths, ours.depths, rtol=1e-5, atol=0)
